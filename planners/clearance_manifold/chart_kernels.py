"""Arithmetic of a centre line: a polyline of equal steps, straight on beyond its two ends."""

from __future__ import annotations

import numpy as np

from drivers.interface.kernel import kernel
from estimators.belief import F64


@kernel()
def project(line: F64, step_m: float, points: F64, near_m: float, reach_m: float) -> F64:
    """Return arc length and lateral offset (left is positive), shape (n, 2) [m], of points, shape (n, 2), on a centre line.

    Args:
        line: shape (k, 2), k >= 2.
        step_m: between two of its points.
        points: in the line's frame.
        near_m: arc length around which the nearest point is looked for,
        reach_m: and how far from there; infinite: everywhere.
    """
    last = len(line) - 1
    first_segment = int(min(max((near_m - reach_m) / step_m, 0.0), last - 1.0)) if np.isfinite(reach_m) else 0
    end_segment = (
        int(min(max((near_m + reach_m) / step_m + 1.0, first_segment + 1.0), float(last))) if np.isfinite(reach_m) else last
    )
    out = np.empty((len(points), 2))
    for k in range(len(points)):
        best = np.inf
        for i in range(first_segment, end_segment):
            along_x, along_y = line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1]
            x, y = points[k, 0] - line[i, 0], points[k, 1] - line[i, 1]
            length2 = along_x * along_x + along_y * along_y
            part = (x * along_x + y * along_y) / length2
            low = -np.inf if i == 0 else 0.0
            high = np.inf if i == last - 1 else 1.0
            part = min(max(part, low), high)
            off_x, off_y = x - part * along_x, y - part * along_y
            distance2 = off_x * off_x + off_y * off_y
            if distance2 < best:
                best = distance2
                side = along_x * y - along_y * x
                out[k, 0] = (i + part) * step_m
                out[k, 1] = np.sqrt(distance2) if side >= 0.0 else -np.sqrt(distance2)
    return out


@kernel()
def point_at(line: F64, step_m: float, arc_m: float) -> tuple[float, float]:
    """Return the point of the line at an arc length; before its start and beyond its end it is straight."""
    last = len(line) - 1
    i = int(min(max(np.floor(arc_m / step_m), 0.0), last - 1.0))
    part = arc_m / step_m - i
    return line[i, 0] + part * (line[i + 1, 0] - line[i, 0]), line[i, 1] + part * (line[i + 1, 1] - line[i, 1])


@kernel()
def frames(line: F64, step_m: float, arcs_m: F64, half_width_m: float) -> tuple[F64, F64, F64]:
    """Return points, shape (n, 2), unit normals to the left, shape (n, 2), and reach of the cross-sections, shape (n, 2).

    On the inner side of a bend cross-sections would meet in its centre; they end before it.
    """
    n, reach = len(arcs_m), 2.0 * step_m
    at, normal, width = np.empty((n, 2)), np.empty((n, 2)), np.empty((n, 2))
    for k in range(n):
        x0, y0 = point_at(line, step_m, arcs_m[k] - reach)
        x1, y1 = point_at(line, step_m, arcs_m[k])
        x2, y2 = point_at(line, step_m, arcs_m[k] + reach)
        length = max(np.hypot(x2 - x0, y2 - y0), 1e-9)
        at[k, 0], at[k, 1] = x1, y1
        normal[k, 0], normal[k, 1] = -(y2 - y0) / length, (x2 - x0) / length
        bend = (x0 - 2.0 * x1 + x2) * normal[k, 0] + (y0 - 2.0 * y1 + y2) * normal[k, 1]
        curvature = bend / (reach * reach)  # positive: the centre of the bend lies to the left
        inner = min(half_width_m, 0.8 / max(abs(curvature), 1e-9))
        width[k, 0] = -(inner if curvature < 0.0 else half_width_m)
        width[k, 1] = inner if curvature > 0.0 else half_width_m
    return at, normal, width
