"""What the tries of a dead man come to: how soon it was safe, how soon it stood, and how many of them were too late."""

from collections.abc import Callable, Mapping, Sequence

from tests.benchmarks.figure import Figure, of_distribution
from tests.faults.dead_man import Try

TRIES = 20  # of each blow
ORDINARY = 4  # stops beside which they are measured
SAFE_LATE_S, STILL_LATE_S = 0.02, 0.1  # what is allowed beyond the configured time and beyond the own stopping time


Attempt = Callable[[str, int], Try]  # given the blow and the number of the try


def dead_man_figures(robot: str, attempt: Attempt, configured_s: Mapping[str, tuple[float, str]]) -> list[Figure]:
    """Strike, and judge every try.

    Args:
        robot: begins the figures' names.
        attempt: makes a try.
        configured_s: by blow, within what it must be safe, and the ordinary stop that ends in the same way.

    A robot's own stopping time is the longest that an ordinary stop took from the zero command (or the disarm) to standing.
    """
    own_s: dict[str, float] = {}
    measured: list[Figure] = []
    for blow, (safe_s, ordinary) in configured_s.items():
        if ordinary not in own_s:
            own_s[ordinary] = max(attempt(ordinary, number).stopping_s for number in range(ORDINARY))
            measured.append(Figure(f"{robot}_own_stopping_{ordinary}", 1e3 * own_s[ordinary]))
        tries = [attempt(blow, number) for number in range(TRIES)]
        measured += _judged(f"{robot}_dead_man_{blow}", tries, safe_s + SAFE_LATE_S, own_s[ordinary])
    return measured


def _judged(name: str, tries: Sequence[Try], safe_s: float, own_s: float) -> list[Figure]:
    late_s = [each.stopping_s - own_s for each in tries]
    failed = sum(each.safe_s > safe_s or late > STILL_LATE_S for each, late in zip(tries, late_s, strict=True))
    return [
        of_distribution(f"{name}_safe", [1e3 * each.safe_s for each in tries]),
        of_distribution(f"{name}_late", [1e3 * late for late in late_s]),
        Figure(f"{name}_failed", failed, unit=f"of {TRIES}"),
    ]
