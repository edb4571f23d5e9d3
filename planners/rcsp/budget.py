"""How many scenarios there is time for."""

from __future__ import annotations

from planners.rcsp.settings import BudgetSettings

GRAIN = 8  # a count is a multiple of what a vector register holds, where it follows the time


def affordable(settings: BudgetSettings, budget_ns: int | None, distances: int, *, reacting: bool) -> int:
    """Return the number of scenarios: all where there is no limit or nobody moves, else as many as fit; 0 if too few do.

    It rests on the costs of the settings, not on a stopwatch, so that the same budget gives the same count.

    Args:
        settings: counts and costs.
        budget_ns: time left; None: no limit.
        distances: robot-obstacle distances of one scenario: commands x steps x obstacles.
        reacting: whether obstacles react to each command.

    >>> affordable(BudgetSettings(), 2_000_000, 165 * 25 * 6, reacting=False)
    128
    >>> affordable(BudgetSettings(), 1_000_000, 165 * 25 * 6, reacting=False)
    48
    >>> affordable(BudgetSettings(), 100_000, 165 * 25 * 6, reacting=False)
    0
    """
    if budget_ns is None:
        return settings.scenarios
    left_ns = settings.share * budget_ns - 1e3 * settings.fixed_us
    if left_ns <= 0.0:
        return 0
    each_ns = distances * (settings.reacting_distance_ns if reacting else settings.distance_ns)
    if each_ns * settings.scenarios <= left_ns:
        return settings.scenarios
    count = int(left_ns / each_ns) // GRAIN * GRAIN
    return count if count >= settings.scenarios_min else 0
