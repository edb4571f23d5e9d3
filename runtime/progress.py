"""The progress bar of a run: how much of the way is behind the robot, or of the time where there is no goal."""

from __future__ import annotations

import math
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from runtime.assembly import Assembly
from runtime.cycle import Cycle
from runtime.watch import SECOND_NS

REFRESH_S = 0.1


class RunProgress:
    """A context manager; `ready` and `update` are handed to the run."""

    def __init__(self, console: Console, title: str) -> None:
        """Show the title while the kernels compile."""
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn())
        self._bar = Progress(*columns, console=console, auto_refresh=False)
        self._title = title
        self._task = self._bar.add_task(f"{title}: preparing (kernels compile at the first run)", total=None, note="")
        self._limit_s = 0.0
        self._start_ns: int | None = None
        self._goal_m = math.nan
        self._next_s = 0.0

    def __enter__(self) -> RunProgress:
        """Start drawing."""
        self._bar.start()
        self._bar.refresh()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Leave the terminal as it was."""
        self._bar.refresh()
        self._bar.stop()

    def ready(self, assembly: Assembly) -> None:
        """Take down where the way leads; the first tick is next."""
        self._limit_s = assembly.time_limit_s
        self._bar.update(self._task, description=self._title, total=1.0, completed=0.0)

    def update(self, cycle: Cycle) -> None:
        """Draw, at most ten times a second."""
        now_s = time.monotonic()
        if now_s < self._next_s:
            return
        self._next_s = now_s + REFRESH_S
        self._bar.update(self._task, completed=self._fraction(cycle), note=_note(cycle))
        self._bar.refresh()

    def _fraction(self, cycle: Cycle) -> float:
        goal, now_ns = cycle.sensed.mission.goal, cycle.sensed.tick.start_ns
        self._start_ns = now_ns if self._start_ns is None else self._start_ns  # the host's clock does not begin at 0
        if goal is None:
            return min(1.0, (now_ns - self._start_ns) / SECOND_NS / self._limit_s)
        pose = cycle.belief.map_from_base
        left_m = math.hypot(goal.x_m - pose.x, goal.y_m - pose.y)
        if math.isnan(self._goal_m):
            self._goal_m = max(left_m, 1e-6)
        return max(0.0, 1.0 - left_m / self._goal_m)


def _note(cycle: Cycle) -> str:
    twist = cycle.belief.twist
    clearance = "" if cycle.sensed.truth is None else f"  clearance {cycle.sensed.truth.clearance_m:5.2f} m"
    return f"{twist.speed_m_s:4.2f} m/s{clearance}  {cycle.verdict.response.name.lower()}"
