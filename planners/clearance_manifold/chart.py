"""The corridor chart: a smooth centre line to measure lateral offsets from (equation 3).

It is laid along the route once and kept while the route stays in its tube: walkers, whom the route goes around, do not bend
it.  A route that leaves the tube (a fork, a door, a wall that came into view) or a new goal asks for a new chart.
"""

from __future__ import annotations

import numpy as np

from estimators.belief import F64
from planners.clearance_manifold.chart_kernels import frames, project
from planners.clearance_manifold.settings import ChartSettings
from planners.polyline import arc_length

STEP_M = 0.1  # between two points of a centre line
NEAR_M = 3.0  # a robot is looked for this far around where it was
_LONGEST_M = 100.0


class Chart:
    """One centre line, in odom."""

    def __init__(self, line: F64, goal: F64) -> None:
        """Take the line, shape (n, 2), in steps of STEP_M, and the goal that it leads to, shape (2,)."""
        self.line, self.goal = line, goal

    @property
    def length_m(self) -> float:
        """Arc length from its first point to its last, the goal."""
        return STEP_M * (len(self.line) - 1)

    def project(self, points: F64, near_m: float | None = None, reach_m: float = NEAR_M) -> F64:
        """Return arc length and lateral offset, shape (n, 2) [m], of points in odom, shape (n, 2).

        They are looked for within `reach_m` of the arc length `near_m`; None: everywhere.
        """
        near, reach = (0.0, np.inf) if near_m is None else (near_m, reach_m)
        projected: F64 = project(self.line, STEP_M, np.ascontiguousarray(points), near, reach)
        return projected

    def frames(self, arcs_m: F64, half_width_m: float) -> tuple[F64, F64, F64]:
        """Return points, normals and reach of the cross-sections at arc lengths, each shape (n, 2)."""
        at, normal, width = frames(self.line, STEP_M, arcs_m, half_width_m)
        return at, normal, width


def lay_chart(path: F64, goal: F64, behind: F64, settings: ChartSettings) -> Chart:
    """Return the chart along a route.

    Args:
        path: the route, shape (n, 2), from the robot.
        goal: where it leads to, perhaps far beyond its end, shape (2,).
        behind: the way the robot came, oldest first, shape (m, 2); may be empty.
        settings: how much it is smoothed.
    """
    points = np.concatenate((behind, path, goal[None]))
    steps = np.hypot(*np.diff(points, axis=0).T)
    points = points[np.concatenate(([True], steps > 1e-6))]
    if len(points) < 2:
        points = np.stack((goal - np.array([STEP_M, 0.0]), goal))
    along = arc_length(points)
    length_m = min(float(along[-1]), _LONGEST_M)
    count = max(2, 1 + round(length_m / STEP_M))
    # A step that divides the length would differ from STEP_M; the first point gives way instead: the goal stays the last.
    wanted: F64 = np.asarray(length_m - STEP_M * np.arange(count - 1, -1, -1), np.float64)
    line = np.stack((_extended(wanted, along, points[:, 0]), _extended(wanted, along, points[:, 1])), axis=1)
    return Chart(_smoothed(line, round(settings.smoothing_m / STEP_M)), goal.copy())


def _extended(wanted: F64, along: F64, values: F64) -> F64:
    """Interpolate; before the start the first segment goes on."""
    slope = (values[1] - values[0]) / (along[1] - along[0])
    return np.where(wanted < 0.0, values[0] + slope * wanted, np.interp(wanted, along, values))


def _smoothed(line: F64, window: int) -> F64:
    """Average twice over `window` steps, as if the line went on beyond its ends mirrored through them: they stay in place."""
    half = min(window // 2, len(line) - 1)
    for _ in range(2 if half > 0 else 0):
        before = 2.0 * line[0] - line[half:0:-1]
        after = 2.0 * line[-1] - line[-2 : -half - 2 : -1]
        total = np.cumsum(np.concatenate((np.zeros((1, 2)), before, line, after)), axis=0)
        line = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return line
