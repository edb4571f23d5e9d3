"""Times every stage of every tick, without the loop having to say so."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from runtime.cycle import STAGES
from runtime.durations import Durations

P = ParamSpec("P")
R = TypeVar("R")


class Stopwatch:
    """Wall time of the stages, of this tick and of all."""

    def __init__(self) -> None:
        """Start with no tick."""
        self._now = [0] * len(STAGES)
        self.durations = Durations(len(STAGES))  # of every tick, in the order of STAGES

    def timed(self, stage: str, call: Callable[P, R]) -> Callable[P, R]:
        """Return the call with its duration counted towards a stage."""
        index = STAGES.index(stage)

        @functools.wraps(call)
        def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
            start_ns = time.perf_counter_ns()
            try:
                return call(*args, **kwargs)
            finally:
                self._now[index] = time.perf_counter_ns() - start_ns

        return wrapped

    def stage_ns(self) -> tuple[int, ...]:
        """Return the durations of this tick's stages so far [ns], in the order of STAGES; `record` is the tick before's."""
        return tuple(self._now)

    def plan_ns(self) -> int:
        """Return how long this tick's planner took [ns]."""
        return self._now[STAGES.index("plan")]

    def tick_over(self) -> None:
        """Count this tick's durations."""
        self.durations.add(tuple(self._now))
