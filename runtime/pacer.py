"""The beat: an absolute grid that a late tick never shifts.  Missed grid times are skipped and counted, never burst through.

Source of the pattern: upkie's rate limiter (absolute clock with skip count and slack).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from drivers.interface.clock import Clock
from drivers.interface.sensed import Tick


class Pacer:
    """Iterates over ticks for ever; whoever iterates breaks off.

    In lockstep the host's time says nothing, so a latency model takes the place of the measurement: `model_work_ns` and
    `model_plan_ns` are what a tick's work, and the planner in it, are taken to last.
    """

    def __init__(self, clock: Clock, period_ns: int, *, lockstep: bool, model_work_ns: int = 0, model_plan_ns: int = 0) -> None:
        """Start the grid at the clock's present time.

        Raises:
            ValueError: the period is not positive.
        """
        if period_ns <= 0:
            raise ValueError(f"a control period is positive, not {period_ns} ns")
        self._clock = clock
        self._period_ns = period_ns
        self._lockstep = lockstep
        self._model = (model_work_ns, model_plan_ns)
        self.measured_plan_ns: Callable[[], int] = lambda: 0
        self.missed = 0

    def __iter__(self) -> Iterator[Tick]:
        """Yield one tick per grid time."""
        grid_ns, index, skipped = self._clock.now_ns(), 0, 0
        work_ns, plan_ns = 0, 0
        while True:
            woke_ns = self._clock.now_ns()
            yield Tick(index, grid_ns, self._period_ns, skipped, woke_ns - grid_ns, work_ns, plan_ns)
            if self._lockstep:
                work_ns, plan_ns = self._model
                done_ns = grid_ns + work_ns
            else:
                done_ns = self._clock.now_ns()
                work_ns, plan_ns = done_ns - woke_ns, self.measured_plan_ns()
            skipped = max(0, (done_ns - grid_ns - 1) // self._period_ns)
            self.missed += skipped
            grid_ns += (skipped + 1) * self._period_ns
            index += skipped + 1
            self._clock.sleep_until(grid_ns)
