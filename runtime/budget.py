"""How long the planner may take at a tick: measured where time is real, modelled in lockstep, recorded in replay."""

from __future__ import annotations

from collections.abc import Callable

from estimators.belief import Belief

Budget = Callable[[Belief], int]  # from the belief of a tick to the time that its planner has [ns]

AFTER_NS = 1_500_000  # of the tick: what admitting, writing and recording are given (configs/budgets.yaml: 99 % take less)


def measured(now_ns: Callable[[], int], period_ns: int) -> Budget:
    """Return what is left of the tick when the planner is called, less what comes after it.

    >>> from types import SimpleNamespace
    >>> measured(lambda: 105_000_000, 20_000_000)(SimpleNamespace(stamp_ns=100_000_000))
    13500000
    """
    return lambda belief: max(0, belief.stamp_ns + period_ns - AFTER_NS - now_ns())


def modelled(period_ns: int, work_ns: int, plan_ns: int) -> Budget:
    """Return what the latency model leaves: the period less the work of all but the planner.

    >>> modelled(20_000_000, work_ns=9_000_000, plan_ns=4_000_000)(None)
    15000000
    """
    return fixed(max(0, period_ns - (work_ns - plan_ns)))


def fixed(budget_ns: int) -> Budget:
    """Return the same at every tick."""
    return lambda belief: budget_ns


def within(budget: Budget, allowed_ns: int) -> Budget:
    """Return the budget, but no more than is allowed anyway."""
    return lambda belief: min(allowed_ns, budget(belief))
