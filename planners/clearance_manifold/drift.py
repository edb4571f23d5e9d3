"""How far a manifold moves in the paper's step of 0.2 s, however often it is planned: what P4 bounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64
from planners.clearance_manifold.chart import Chart

STEP_NS = 200_000_000  # Delta t of P4: the paper's control period


@dataclass(frozen=True, slots=True)
class Past:
    """A manifold that was."""

    stamp_ns: int
    points: F64  # (n, 2), in odom
    arcs_m: F64  # (n,), on the present chart, increasing
    offset_m: F64  # (n,)


class Drift:
    """Keeps the manifolds of the last step."""

    def __init__(self) -> None:
        """Start with none."""
        self._past: tuple[Past, ...] = ()

    def reset(self) -> None:
        """Forget them."""
        self._past = ()

    def rechart(self, chart: Chart) -> None:
        """Express them on another chart."""
        self._past = tuple(_on(chart, past) for past in self._past)

    def keep(self, past: Past) -> None:
        """Add one; of those older than a step only the newest stays."""
        older = [one for one in self._past if past.stamp_ns - one.stamp_ns >= STEP_NS]
        younger = [one for one in self._past if past.stamp_ns - one.stamp_ns < STEP_NS]
        self._past = (*older[-1:], *younger, past)

    def speed(self, stamp_ns: int, arcs_m: F64, offset_m: F64) -> float:
        """Return how fast the fastest station has moved sideways since a step ago [m/s]; 0 without a manifold before.

        Args:
            stamp_ns: now.
            arcs_m: of the stations, shape (n,).
            offset_m: of the manifold there, shape (n,).
        """
        before = [one for one in self._past if stamp_ns - one.stamp_ns >= STEP_NS] or list(self._past[:1])
        if not before or not len(arcs_m) or stamp_ns <= before[-1].stamp_ns:
            return 0.0
        then = np.interp(arcs_m, before[-1].arcs_m, before[-1].offset_m)
        return float(np.abs(offset_m - then).max() / ((stamp_ns - before[-1].stamp_ns) * 1e-9))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is kept, as named arrays."""
        past = self._past
        return {
            "past_ns": np.array([one.stamp_ns for one in past], np.int64),
            "past": np.array([np.column_stack((one.points, one.arcs_m, one.offset_m)) for one in past]),
        }

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._past = tuple(
            Past(int(stamp), one[:, :2].copy(), one[:, 2].copy(), one[:, 3].copy())
            for stamp, one in zip(state["past_ns"], state["past"], strict=True)
        )


def _on(chart: Chart, past: Past) -> Past:
    arcs_m, offset_m = chart.project(past.points).T
    order = np.argsort(arcs_m, kind="stable")
    return Past(past.stamp_ns, past.points, arcs_m[order], offset_m[order])
