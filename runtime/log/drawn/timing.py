"""What tells why a tick was late: when each stage was done, missed deadlines, the recorder's queue, devices and their samples."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import accumulate
from typing import Any

from drivers.interface.devices import DeviceHealth
from planners.planner import Plan
from runtime.cycle import STAGES, Cycle
from runtime.log.drawn import colours
from runtime.log.drawn.layers import Layer, Rows
from runtime.log.drawn.plots import NAN, Values, series
from runtime.log.files.sink import Sink

STAGE_TIMES = "/timing/stages"
DONE = "/timing/done"
MISSED = "/timing/missed"
QUEUE = "/timing/queue"
RATES = "/view/devices/rate"
LOSSES = "/view/devices/lost"
SAMPLE_AGES = "/view/devices/age"
INPUT_AGE = "/view/age/input"
PLAN_AGE = "/view/age/plan"
_RATE_WINDOW_NS = 1_000_000_000


def layers() -> list[Layer[Any]]:
    """Return the plots that need no device.  What lies under /timing alone may differ between two lockstep runs of one seed."""
    done = ("woke", *STAGES[:-1], "record, of the tick before", "deadline")
    palette = (colours.TRUTH, *colours.STAGES, colours.RESPONSES[-1])
    return [
        Layer(lambda c: tuple(ns / 1e6 for ns in c.stage_ns), series(STAGE_TIMES, STAGES, colours.STAGES)),
        Layer(_done_ms, series(DONE, done, palette)),
        Layer(_Sum(lambda c: c.sensed.tick.skipped), series(MISSED, ("missed so far",), (colours.MOVING,), steps=True)),
        Layer(_input_age_ms, series(INPUT_AGE, ("oldest input of the command",), (colours.SENT,))),
        Layer(_PlanAge(), series(PLAN_AGE, ("plan in force",), (colours.ASKED,))),
    ]


class Queue:
    """Plots how many ticks waited for the recorder when one was handed over, and how many it has lost so far."""

    def __init__(self) -> None:
        """Nothing was lost yet."""
        self._rows = series(QUEUE, ("waiting", "lost so far"), (colours.SENT, colours.MOVING), steps=True)
        self._lost = 0

    def put(self, cycle: Cycle, waiting: int, lost_before: int) -> None:
        """Plot the tick."""
        self._lost += lost_before
        self._rows.add(cycle.sensed.tick, (float(waiting), float(self._lost)))

    def send(self, sink: Sink) -> None:
        """Send the rows and start a new batch."""
        self._rows.send(sink)


class DevicePlots:
    """Plots of every device that has a rate: samples a second over the nominal, samples lost, age of the newest sample."""

    def __init__(self) -> None:
        """Know of no device yet."""
        self._rows: tuple[Rows[Values], Rows[Values], Rows[Values]] | None = None
        self._past: deque[tuple[int, tuple[int, ...]]] = deque()  # (when, received by device) over the window
        self._captured_ns: dict[str, int] = {}  # the newest sample of each device

    def put(self, cycle: Cycle) -> None:
        """Plot the tick."""
        healths = [health for health in cycle.sensed.health if health.expected_period_ns > 0]
        if not healths:
            return
        tick = cycle.sensed.tick
        self._captured_ns |= _newest_ns(cycle)
        if self._rows is None:
            self._rows = _device_rows(healths)
        rates, losses, ages = self._rows
        rates.add(tick, self._rates(healths, tick.start_ns))
        losses.add(tick, tuple(float(health.dropped + health.overflowed) for health in healths))
        now_ns = tick.start_ns + tick.lateness_ns
        ages.add(tick, tuple((now_ns - self._captured_ns.get(h.device, now_ns)) / 1e6 for h in healths))

    def send(self, sink: Sink) -> None:
        """Send the rows and start a new batch."""
        for rows in self._rows or ():
            rows.send(sink)

    def _rates(self, healths: list[DeviceHealth], now_ns: int) -> Values:
        """Return the share [%] of its nominal rate at which each device delivered over the last second; NaN before that."""
        self._past.append((now_ns, tuple(health.received for health in healths)))
        while len(self._past) > 1 and now_ns - self._past[1][0] >= _RATE_WINDOW_NS:
            self._past.popleft()
        then_ns, received = self._past[0]
        span_ns = now_ns - then_ns
        if span_ns < _RATE_WINDOW_NS:
            return (NAN,) * len(healths)
        return tuple(
            100.0 * (h.received - before) * h.expected_period_ns / span_ns for h, before in zip(healths, received, strict=True)
        )


class _Sum:
    """The sum of something over all ticks so far."""

    def __init__(self, pick: Callable[[Cycle], int]) -> None:
        self._pick, self._sum = pick, 0

    def __call__(self, cycle: Cycle) -> Values:
        self._sum += self._pick(cycle)
        return (float(self._sum),)


class _PlanAge:
    """How long the plan has been in force [ms]: since the tick that was the first to be given it."""

    def __init__(self) -> None:
        self._plan: Plan | None = None
        self._since_ns = 0

    def __call__(self, cycle: Cycle) -> Values:
        tick = cycle.sensed.tick
        if cycle.plan is not self._plan:
            self._plan, self._since_ns = cycle.plan, tick.start_ns
        return ((tick.start_ns - self._since_ns) / 1e6,)


def _done_ms(cycle: Cycle) -> Values:
    """Return when, after the grid time, the loop woke and each stage was done, and the end of the period [ms]."""
    tick = cycle.sensed.tick
    return (*(ns / 1e6 for ns in accumulate(cycle.stage_ns, initial=tick.lateness_ns)), tick.period_ns / 1e6)


def _input_age_ms(cycle: Cycle) -> Values:
    tick = cycle.sensed.tick
    return ((tick.start_ns + tick.lateness_ns - cycle.verdict.command.oldest_input_ns) / 1e6,)


def _newest_ns(cycle: Cycle) -> dict[str, int]:
    """Return when the newest sample of each device that delivered was taken [ns]."""
    s = cycle.sensed
    newest = {"imu": s.imu, "base": s.base, "arm": s.joints, "scan": s.scans, "markers": s.markers}
    single = {"camera": s.depth, "truth": s.truth}
    return {name: samples[-1].stamp.captured_ns for name, samples in newest.items() if samples} | {
        name: sample.stamp.captured_ns for name, sample in single.items() if sample is not None
    }


def _device_rows(healths: list[DeviceHealth]) -> tuple[Rows[Values], Rows[Values], Rows[Values]]:
    names = [health.device for health in healths]
    nominal = [f"{health.device}, of {1e9 / health.expected_period_ns:g} Hz" for health in healths]
    palette = colours.STAGES[: len(healths)]
    return series(RATES, nominal, palette), series(LOSSES, names, palette, steps=True), series(SAMPLE_AGES, names, palette)
