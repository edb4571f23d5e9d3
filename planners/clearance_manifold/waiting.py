"""What is done while the way is blocked: look at what blocks it, then all around, or nobody would see a door open again."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2, wrap_angle
from estimators.belief import F64, Belief
from estimators.field_query import sample
from planners.clearance_manifold.chart import STEP_M, Chart
from planners.clearance_manifold.closing import nearest_of
from planners.clearance_manifold.settings import WaitingSettings

STILL_RAD = 0.05  # nearer than this it need not look
SECOND_NS = 1_000_000_000


class Waiting:
    """Since when the robot waits, and how it turns meanwhile."""

    def __init__(self, settings: WaitingSettings, most_rad_s: float) -> None:
        """Take the settings, and how fast the base turns at most."""
        self._settings, self._most_rad_s = settings, most_rad_s
        self._since_ns = 0

    def over(self) -> None:
        """Have a way again."""
        self._since_ns = 0

    def turn(self, chart: Chart, arc_m: float, reach_m: float, least_m: float, belief: Belief, come: F64) -> float:
        """Return wz: towards who comes, or what blocks the way, or all around.

        Args:
            chart: the last one that led somewhere.
            arc_m: of the robot on it.
            reach_m: how far ahead what blocks it is looked for.
            least_m: clearance that the robot needs.
            belief: the field.
            come: who comes, shape (n, 5).
        """
        self._since_ns = self._since_ns or belief.stamp_ns
        s, waited_s = self._settings, (belief.stamp_ns - self._since_ns) / SECOND_NS
        pose = belief.odom_from_base
        if len(come):
            return self._turn_to(nearest_of(come, np.array([pose.x, pose.y])), pose)
        if waited_s > s.patience_s:
            return min(s.turn_rad_s, self._most_rad_s)
        return self._turn_to(blocked_at(chart, arc_m, reach_m, least_m, belief), pose)

    def _turn_to(self, point: F64, pose: SE2) -> float:
        off_rad = wrap_angle(math.atan2(point[1] - pose.y, point[0] - pose.x) - pose.yaw)
        most = min(self._settings.turn_rad_s, self._most_rad_s)
        return min(max(off_rad, -most), most) if abs(off_rad) > STILL_RAD else 0.0

    def state(self) -> dict[str, NDArray[np.int64]]:
        """Return what is carried on, as named arrays."""
        return {"waiting_since_ns": np.array(self._since_ns, np.int64)}

    def take(self, state: dict[str, NDArray[np.int64]]) -> None:
        """Take over a state."""
        self._since_ns = int(state["waiting_since_ns"])


def blocked_at(chart: Chart, arc_m: float, reach_m: float, least_m: float, belief: Belief) -> F64:
    """Return the first point ahead on a chart without the clearance `least_m`, shape (2,), in odom; else the farthest."""
    points, _, _ = chart.frames(np.arange(arc_m, arc_m + reach_m, STEP_M), 1.0)
    short = np.flatnonzero(sample(belief.clearance.clearance_m, belief.clearance.lattice, points) < least_m)
    found: F64 = points[short[0] if short.size else -1]
    return found
