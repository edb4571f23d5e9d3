"""What the recorder's thread does with a tick: the exact columns, the drawn scene, the plots, one batch at a time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import rerun as rr
import rerun.blueprint as rrb

from runtime.cycle import Cycle
from runtime.keyframes import KeyFrame
from runtime.log.drawn import plots, scene, timing
from runtime.log.drawn.drawings import Drawings, planner_drawings, shield_drawings
from runtime.log.drawn.events import Events
from runtime.log.drawn.layout import layout
from runtime.log.exact.columns import ArrowColumn, timelines
from runtime.log.exact.keyframes import KeyFramePart
from runtime.log.exact.packing import Layout
from runtime.log.exact.part import ExactPart
from runtime.log.files.live import LiveView
from runtime.log.files.marks import END, SEGMENT, End, Segment
from runtime.log.files.sink import Sink
from runtime.log.header import SCHEMA_VERSION, RunHeader
from runtime.log.reading.opening import RUN
from runtime.log.settings import LogSettings


class Drawn(Protocol):
    """A part of what is drawn or plotted."""

    def put(self, cycle: Cycle) -> None:
        """Add a tick."""
        ...

    def send(self, sink: Sink) -> None:
        """Send what was added and start a new batch."""
        ...


class Writer:
    """Collects ticks and sends them as columns."""

    def __init__(
        self,
        path: Path | None,
        settings: LogSettings,
        header: RunHeader,
        live: LiveView | None,
        segment: Segment = Segment(),  # noqa: B008 - frozen
        *,
        blueprint: rrb.Blueprint | None = None,
        beside: tuple[Drawn, ...] = (),
    ) -> None:
        """Open the sink and log what holds for the whole run; draw also what stands `beside`, in a layout made for it.

        Raises:
            OSError: the file cannot be created.
        """
        self._sink = Sink(path, live, blueprint or layout(header), settings.flush_interval_s, segment.recording_id)
        self._flush_interval_s = settings.flush_interval_s
        self._put_ticks = 0
        self._exact = ExactPart(settings.depth)
        self._key_frames = KeyFramePart()
        self._drawn: tuple[Drawn, ...] = (
            *scene.layers(header, settings),
            *plots.layers(header),
            plots.Diagnosed(plots.PLANNER, plots.planner_diagnostics),
            plots.Diagnosed(plots.SHIELD, plots.shield_diagnostics),
            Drawings("planner", planner_drawings),
            Drawings("shield", shield_drawings),
            Events(),
            *beside,
        )
        self._timed: tuple[Drawn, ...] = (*timing.layers(), timing.DevicePlots())
        self._queue = timing.Queue()
        self._draw_interval_ns = round(1e9 * (settings.draw_interval_s if live is None else settings.flush_interval_s))
        self._draw_due_ns = 0
        self._ticks: list[int] = []
        self._starts_ns: list[int] = []
        self._sink.log_static(RUN, _provenance(header, settings))
        self._sink.log_static(SEGMENT, segment.as_components())
        for entity, archetype in scene.static(header):
            self._sink.log_static(entity, archetype)
        self._sink.flush(settings.flush_interval_s)  # a file says first what it is

    @property
    def fault(self) -> str:
        """Why the file can no longer be written; empty while it can."""
        return self._sink.fault

    @property
    def bytes_written(self) -> int:
        """Size of the file so far."""
        return self._sink.bytes_written

    @property
    def longest_sync_s(self) -> float:
        """For how long something that was written waited at most until it was on the disk."""
        return self._sink.longest_sync_s

    def put(self, cycle: Cycle, *, drawn: bool, lost_before: int, waiting: int = 0, key_frame: KeyFrame | None = None) -> None:
        """Add a tick to the batch, handed over when `waiting` others were; one that is not drawn has only its exact part and
        what tells why it was late.
        """
        self._ticks.append(cycle.sensed.tick.index)
        self._starts_ns.append(cycle.sensed.tick.start_ns)
        self._put_ticks += 1
        self._exact.put(cycle, lost_before)
        if key_frame is not None:
            self._key_frames.put(key_frame, len(self._ticks) - 1)
        self._queue.put(cycle, waiting, lost_before)
        for timed in self._timed:
            timed.put(cycle)
        if drawn:
            for part in self._drawn:
                part.put(cycle)

    def send(self) -> None:
        """Send the batch and start a new one; what is drawn goes out less often, as a batch costs much and a row little."""
        if not self._ticks:
            return
        batches = (*self._key_frames.batches(), *self._exact.batches())  # built as a whole before any of it is sent
        self._announce(self._exact.new_layouts())
        for batch in batches:
            self._sink.send(batch.entity, self._index(batch.rows or range(len(self._ticks))), batch.columns)
        now_ns = self._starts_ns[-1]
        self._ticks.clear()
        self._starts_ns.clear()
        if now_ns >= self._draw_due_ns:
            self._draw_due_ns = now_ns + self._draw_interval_ns
            self.send_drawn()

    def _announce(self, layouts: Sequence[Layout]) -> None:
        for each in layouts:
            self._sink.log_static(each.entity, each.as_components())
        if layouts:
            self._sink.flush(self._flush_interval_s)  # what is logged waits in Rerun, columns do not

    def send_drawn(self) -> None:
        """Send what waits to be drawn."""
        for part in (*self._drawn, *self._timed):
            part.send(self._sink)
        self._queue.send(self._sink)

    def _index(self, rows: Sequence[int]) -> tuple[ArrowColumn, ArrowColumn]:
        return timelines(tuple(self._ticks[row] for row in rows), tuple(self._starts_ns[row] for row in rows))

    def flush(self, timeout_s: float) -> bool:
        """Push what was sent out to the file; return whether that was done in time."""
        return self._sink.flush(timeout_s)

    def close(self, timeout_s: float, *, last: bool | None = None) -> None:
        """Finish the file: the last of its log, or one that others follow; None: one whose log has failed, which has no end."""
        if last is None:
            self._sink.close(timeout_s)
            return
        self.send_drawn()
        self._sink.close(timeout_s, END, lambda size, crc32: End(self._put_ticks, last, size, crc32).as_components())


def _provenance(header: RunHeader, settings: LogSettings) -> rr.AnyValues:
    return rr.AnyValues(
        schema_version=SCHEMA_VERSION,
        replayable=settings.depth,
        configuration=header.configuration_yaml,
        seed=header.seed,
        scenario=header.scenario,
        planner=header.planner,
        code_version=header.code_version,
        code_modified=header.code_modified,
        libraries=list(header.libraries),
        machine=header.machine,
        doctor=header.doctor,
    )
