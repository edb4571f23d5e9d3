"""The recording of a replay: an ordinary log of what the replay came to, with what was recorded drawn beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

from drivers.interface.commands import Command
from drivers.interface.errors import ConfigurationError
from runtime.assembly import draw_scene
from runtime.configuration import Configuration
from runtime.cycle import Cycle
from runtime.log.drawn import colours, plots, scene
from runtime.log.drawn.layers import IDENTICAL, Layer
from runtime.log.exact.block import Row
from runtime.log.files.sink import Sink
from runtime.log.header import RunHeader
from runtime.log.writer import Writer
from runtime.provenance import run_header
from runtime.replay.layout import RECORDED, RECORDED_PLAN, layout

_BATCH_TICKS = 25
_TIMEOUT_S = 30.0
_NAMES = ("recorded: asked", "recorded: sent", "replayed: asked", "replayed: sent")
_RECORDED_ASKED: colours.Rgb = (64, 200, 200)
_PALETTE = (_RECORDED_ASKED, colours.TRUTH, colours.ASKED, colours.SENT)


class RecordedSide:
    """Draws what was recorded: the plan, both commands in one plot, diagnostics."""

    def __init__(self) -> None:
        """Start with no tick."""
        self._row: Row | None = None
        self._own: list[Layer[Any] | plots.Diagnosed] = [
            Layer(lambda c: c.plan.path_in_odom, scene.path(RECORDED_PLAN, _RECORDED_ASKED, 0.02), IDENTICAL),
            plots.Diagnosed(f"{RECORDED}/planner", plots.planner_diagnostics),
            plots.Diagnosed(f"{RECORDED}/shield", plots.shield_diagnostics),
        ]
        self._both = {axis: plots.series(f"{RECORDED}/both/{axis}", _NAMES, _PALETTE) for axis in plots.AXES}

    def hold(self, row: Row) -> None:
        """Take the row of the tick that is put next."""
        self._row = row

    def put(self, cycle: Cycle) -> None:
        """Draw the recorded side of the tick."""
        assert self._row is not None
        was = replace(cycle, plan=self._row.decided("plan"), verdict=self._row.decided("verdict"))
        for layer in self._own:
            layer.put(was)
        commands = (was.verdict.asked, was.verdict.command, cycle.verdict.asked, cycle.verdict.command)
        for axis, rows in self._both.items():
            rows.add(cycle.sensed.tick, tuple(map(_value(axis), commands)))

    def send(self, sink: Sink) -> None:
        """Send the rows and start a new batch."""
        for part in (*self._own, *self._both.values()):
            part.send(sink)


class Recording:
    """A context manager that writes both sides; without a path it does nothing."""

    def __init__(self, path: Path | None) -> None:
        """Touch nothing yet."""
        self._path = path
        self._side = RecordedSide()
        self._writer: Writer | None = None
        self._waiting = 0

    def opened(self, recorded: RunHeader, configuration: Configuration) -> Recording | None:
        """Create the recording; None: there is none.

        Raises:
            ConfigurationError: it cannot be created.
        """
        if self._path is None:
            return None
        header = run_header(configuration, draw_scene(configuration, recorded.seed), recorded.seed)
        try:
            self._writer = Writer(self._path, configuration.log, header, None, blueprint=layout(header), beside=(self._side,))
        except OSError as error:
            raise ConfigurationError(f"--log {self._path} cannot be written: {error.strerror}") from error
        return self

    def put(self, row: Row, cycle: Cycle) -> None:
        """Add a tick.

        Raises:
            ConfigurationError: the file cannot be written any more.
        """
        assert self._writer is not None
        self._side.hold(row)
        self._writer.put(cycle, drawn=True, lost_before=0)
        self._waiting += 1
        if self._waiting >= _BATCH_TICKS:
            self._waiting = 0
            self._writer.send()
            self._writer.flush(_TIMEOUT_S)
            if self._writer.fault:
                raise ConfigurationError(self._writer.fault)

    def __enter__(self) -> Recording:
        """Return itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Finish the file."""
        if self._writer is None:
            return
        if error is None:
            self._writer.send()
        self._writer.close(_TIMEOUT_S, last=True if error is None else None)


def _value(axis: str) -> Callable[[Command], float]:
    return lambda command: float(getattr(command.base, axis)) if command.base is not None else plots.NAN
