"""Where the solids of a scene are, on plain arrays."""

import numpy as np

from drivers.interface.geometry import SE2
from sim_drivers.scene import Kind, Scene, Shape


def gap(shape: Shape, pose: SE2, points: np.ndarray) -> np.ndarray:
    """Signed distance [m] of points (..., 2) from a shape's footprint."""
    local = pose.inverse().apply(points)
    x, y, _ = shape.half_extents_m
    if shape.kind is Kind.CYLINDER:
        return np.hypot(local[..., 0], local[..., 1]) - x
    outside = np.abs(local) - np.array([x, y])
    return np.hypot(*np.moveaxis(np.maximum(outside, 0.0), -1, 0)) + np.minimum(outside.max(axis=-1), 0.0)


def clearance(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Signed distance [m] of points (..., 2) from everything that stands."""
    return np.min([gap(o.shape, o.map_from_shape, points) for o in scene.static], axis=0)


def outline(shape: Shape) -> np.ndarray:
    """Points (n, 2) along a footprint's edge, in the shape's own frame."""
    x, y, _ = shape.half_extents_m
    turn = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    circle = np.column_stack((np.cos(turn), np.sin(turn)))
    return x * circle if shape.kind is Kind.CYLINDER else circle / np.abs(circle).max(axis=1, keepdims=True) * [x, y]


def lattice(scene: Scene, cell_m: float) -> np.ndarray:
    """Points (rows, columns, 2) over all that the scene holds."""
    centres = np.array([[o.map_from_shape.x, o.map_from_shape.y] for o in scene.static])
    low, high = centres.min(axis=0) - 0.5, centres.max(axis=0) + 0.5
    xs, ys = (np.arange(low[axis], high[axis], cell_m) for axis in (0, 1))
    return np.stack(np.meshgrid(xs, ys), axis=-1)


def cell_of(points: np.ndarray, x: float, y: float) -> tuple[int, int]:
    nearest = np.argmin(np.hypot(points[..., 0] - x, points[..., 1] - y))
    return tuple(int(i) for i in np.unravel_index(nearest, points.shape[:2]))


def ends(scene: Scene) -> np.ndarray:
    goal = scene.goals[0]
    return np.array([[scene.map_from_start.x, scene.map_from_start.y], [goal.x_m, goal.y_m]])


def same(a: Scene, b: Scene) -> bool:
    alike = all(np.array_equal(m.keyframes, n.keyframes) for m, n in zip(a.movers, b.movers, strict=True))
    return alike and a.static == b.static
