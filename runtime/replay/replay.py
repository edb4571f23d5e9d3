"""Replays a log: the same loop over what was sensed, compared tick by tick with what was decided."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from drivers.interface.errors import ConfigurationError
from runtime.assembly import assemble_recorded
from runtime.configuration import Configuration
from runtime.cycle import Cycle
from runtime.keyframes import KeyFrame
from runtime.log.exact.block import Row
from runtime.log.exact.keyframes import KEY_FRAME
from runtime.log.exact.part import CHECK, warm_up
from runtime.log.exact.stream import rows
from runtime.log.exact.times import starts_ns
from runtime.log.header import RunHeader, processor
from runtime.log.reading.origin import header_of
from runtime.loop import run_loop
from runtime.parts import Parts
from runtime.replay.changes import configuration_of
from runtime.replay.comparison import Comparison
from runtime.replay.recorded_belief import RecordedBeliefs
from runtime.replay.report import ReplayReport
from runtime.replay.robot import RecordedRobot
from runtime.replay.stretches import Stretches
from runtime.stopwatch import Stopwatch

ELSEWHERE = 1e-6  # tolerance on another processor: its last bits differ, and what they are multiplied by is not large
_NAMED = ("estimator", "router", "planner", "shield")


class SideBySide(Protocol):
    """Takes what was recorded and what the replay came to."""

    def put(self, row: Row, cycle: Cycle) -> None:
        """Add a tick."""
        ...


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """What the command line asks for."""

    first: int | None = None
    last: int | None = None
    planner: str | None = None
    overrides: tuple[str, ...] = ()
    tolerance: float | None = None  # None: exactly, where the processor is that of the recording
    opened: Callable[[RunHeader, Configuration], SideBySide | None] = field(default=lambda *_: None)


def replay(log: Path, options: ReplayOptions) -> ReplayReport:
    """Replay a log, or a part of it.

    Raises:
        ConfigurationError: the log will not do, holds nothing to begin with, or its parts are not installed here.
    """
    header = header_of(log)
    configuration = configuration_of(header.configuration_yaml, str(log), options.planner, options.overrides)
    if not configuration.log.depth and "camera" in header.devices:
        raise ConfigurationError(f"the log {log} was recorded without depth images (log.depth: false) and cannot be replayed")
    return _Replay(log, header, configuration, options).report()


class _Replay:
    def __init__(self, log: Path, header: RunHeader, configuration: Configuration, options: ReplayOptions) -> None:
        self._log, self._header, self._configuration, self._options = log, header, configuration, options
        here = processor()
        self._elsewhere = not header.machine.startswith(f"{here};")
        self._tolerance = ELSEWHERE if options.tolerance is None and self._elsewhere else options.tolerance
        self._counterfactual = options.planner is not None or bool(options.overrides)
        self._comparison = Comparison(None if self._counterfactual else self._tolerance)
        self._ticks = 0
        self._span_ns = (0, 0)

    def report(self) -> ReplayReport:
        warm_up()
        stretches = Stretches(rows(self._log), self._beginning(), self._options.last)
        side_by_side = self._options.opened(self._header, self._configuration)
        began_s = time.perf_counter()
        starts = [self._run(stretch, side_by_side) for stretch in stretches]
        if not self._ticks:
            raise ConfigurationError(f"the log {self._log} holds no tick that a replay could begin with")
        return ReplayReport(
            log=str(self._log),
            planner=self._configuration.planner.choice.name,
            counterfactual=self._counterfactual,
            tolerance=self._tolerance if not self._counterfactual else None,
            elsewhere=self._elsewhere,
            ticks=self._ticks,
            beginnings=tuple(starts),
            passed_over=stretches.passed_over,
            damaged=tuple(stretches.damaged),
            differing_ticks=self._comparison.differing_ticks,
            first_difference=self._comparison.first,
            recorded_s=(self._span_ns[1] - self._span_ns[0]) * 1e-9,
            took_s=time.perf_counter() - began_s,
        )

    def _beginning(self) -> int:
        """Return the tick to begin with: the last that one can begin with, up to the one that was asked for."""
        times = starts_ns(self._log, CHECK)
        if not times:
            raise ConfigurationError(f"the log {self._log} holds no tick")
        self._require_within(min(times), max(times))
        asked = self._options.first
        if asked is None:
            return min(times)
        return max((tick for tick in starts_ns(self._log, KEY_FRAME) if tick <= asked), default=min(times))

    def _require_within(self, begins: int, ends: int) -> None:
        first, last = self._options.first, self._options.last
        for option, asked in (("--from", first), ("--to", last)):
            if asked is not None and not begins <= asked <= ends:
                raise ConfigurationError(f"{option} {asked}: the log {self._log} holds ticks {begins} to {ends}")
        if first is not None and last is not None and last < first:
            raise ConfigurationError(f"--to {last} is before --from {first}")

    def _run(self, stretch: Iterator[Row], side_by_side: SideBySide | None) -> int:
        """Replay one stretch; return the tick that it began with."""
        first = next(stretch)
        robot, parts = self._assembled()
        frame = first.key_frame
        if frame is not None:
            self._restore(frame, parts)

        def again() -> Iterator[Row]:
            yield first
            yield from stretch

        def record(cycle: Cycle) -> None:
            assert robot.row is not None
            self._record(cycle, robot.row, side_by_side)

        stages = parts.stages(robot.read, robot.write, record)
        if self._tolerance is not None and not self._counterfactual:
            stages = RecordedBeliefs(robot.present).around(stages)
        try:
            run_loop(robot.ticks(again()), stages, Stopwatch(), lambda cycle: False)
        finally:
            parts.runner.close()
        self._comparison.finish()
        return first.tick

    def _assembled(self) -> tuple[RecordedRobot, Parts]:
        same = not self._counterfactual
        robot = RecordedRobot(same_planner=same)
        parts = assemble_recorded(self._configuration, self._header.seed, robot.ready, robot.budget)
        robot.board = parts.board
        parts.warm_up()
        return robot, parts

    def _restore(self, frame: KeyFrame, parts: Parts) -> None:
        """Begin with a key frame; a part of another name than was recorded begins anew."""
        recorded = configuration_of(self._header.configuration_yaml, str(self._log), None, ())
        anew = frozenset(name for name in _NAMED if _name_of(recorded, name) != _name_of(self._configuration, name))
        try:
            frame.restore(parts, anew)
        except (KeyError, ValueError, IndexError, TypeError) as error:
            raise ConfigurationError(
                f"a key frame of the log {self._log} does not fit the parts that it is replayed with: {error}"
            ) from error

    def _record(self, cycle: Cycle, row: Row, side_by_side: SideBySide | None) -> None:
        now_ns = cycle.sensed.tick.start_ns
        self._span_ns = (self._span_ns[0] if self._ticks else now_ns, now_ns)
        self._ticks += 1
        self._comparison.put(cycle, row)
        if side_by_side is not None:
            side_by_side.put(row, cycle)


def _name_of(configuration: Configuration, part: str) -> str:
    chosen = configuration.planner.choice if part == "planner" else getattr(configuration, part)
    return str(chosen.name)
