"""Solids of the scene: what stands, what moves, and the robot's own body."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import rerun as rr

from drivers.interface.geometry import SE2
from drivers.interface.samples import ObstacleTruth
from runtime.cycle import Cycle
from runtime.log.drawn import colours
from runtime.log.drawn.layers import Layer, Rows, Static
from runtime.log.header import RunHeader, SceneShape

_UNKNOWN_HEIGHT_M = 1.0  # of a moving thing whose shape nobody told
_SEE_THROUGH = "transparentfillmajorwireframe"
Placed = tuple[SceneShape, SE2]


def robot(entity: str, header: RunHeader) -> Static:
    """Return the robot's body, a cylinder, with an arrow for where it faces; in its own frame.  An arm is drawn by its links."""
    if header.arm is not None and "base" not in header.devices:
        return ()
    height = header.robot_height_m
    body = rr.Cylinders3D(
        lengths=[height],
        radii=[header.robot_radius_m],
        centers=[(0.0, 0.0, height / 2)],
        colors=[colours.SENT],
        fill_mode="solid",
    )
    arrow = rr.Arrows3D(
        vectors=[(2.5 * header.robot_radius_m, 0.0, 0.0)],
        origins=[(0.0, 0.0, height + 0.02)],
        radii=[0.015],
        colors=[colours.TRUTH],
    )
    return [(f"{entity}/body", body), (f"{entity}/heading", arrow)]


def solids(entity: str, shapes: Sequence[SceneShape]) -> Static:
    """Return what never moves."""
    parts: list[tuple[str, rr.AsComponents]] = []
    boxes = [(shape, shape.map_from_shape) for shape in shapes if shape.kind == "box"]
    cylinders = [(shape, shape.map_from_shape) for shape in shapes if shape.kind == "cylinder"]
    if boxes:
        colour = [shape.colour for shape, _ in boxes]
        parts.append((f"{entity}/boxes", rr.Boxes3D(**_boxes(boxes), colors=colour, fill_mode=_SEE_THROUGH)))
    if cylinders:
        colour = [shape.colour for shape, _ in cylinders]
        parts.append(
            (
                f"{entity}/cylinders",
                rr.Cylinders3D(**_cylinders(cylinders), colors=colour, fill_mode=_SEE_THROUGH),
            )
        )
    return parts


def movers(entity: str, shapes: Sequence[SceneShape]) -> list[Layer[Any]]:
    """Return the layers of what the truth reports as moving, drawn in the shapes that are known by name."""
    known = {shape.name: shape for shape in shapes}
    boxes, cylinders = f"{entity}/boxes", f"{entity}/cylinders"
    box = rr.Boxes3D.from_fields(colors=[colours.MOVING], fill_mode="solid")
    cylinder = rr.Cylinders3D.from_fields(colors=[colours.MOVING], fill_mode="solid")
    return [
        Layer(_placed(known, "box"), Rows(boxes, _box_columns, [(boxes, box)])),
        Layer(_placed(known, "cylinder"), Rows(cylinders, _cylinder_columns, [(cylinders, cylinder)])),
    ]


def _placed(known: dict[str, SceneShape], kind: str) -> Callable[[Cycle], list[Placed] | None]:
    def pick(cycle: Cycle) -> list[Placed] | None:
        if cycle.sensed.truth is None:
            return None
        all_placed = [(_shape(known, truth), truth.map_from_obstacle) for truth in cycle.sensed.truth.obstacles]
        return [placed for placed in all_placed if placed[0].kind == kind] or None

    return pick


def _shape(known: dict[str, SceneShape], truth: ObstacleTruth) -> SceneShape:
    if truth.name in known:
        return known[truth.name]
    return SceneShape(truth.name, "cylinder", SE2(), (truth.radius_m, truth.radius_m, _UNKNOWN_HEIGHT_M / 2))


def _box_columns(rows: list[list[Placed]]) -> rr.ComponentColumnList:
    fields = _boxes([placed for row in rows for placed in row])
    return rr.Boxes3D.columns(**fields).partition([len(row) for row in rows])


def _cylinder_columns(rows: list[list[Placed]]) -> rr.ComponentColumnList:
    fields = _cylinders([placed for row in rows for placed in row])
    return rr.Cylinders3D.columns(**fields).partition([len(row) for row in rows])


def _boxes(placed: Sequence[Placed]) -> dict[str, Any]:
    return {
        "centers": _centres(placed),
        "half_sizes": [shape.half_extents_m for shape, _ in placed],
        "quaternions": [(0.0, 0.0, math.sin(pose.yaw / 2), math.cos(pose.yaw / 2)) for _, pose in placed],
    }


def _cylinders(placed: Sequence[Placed]) -> dict[str, Any]:
    return {
        "centers": _centres(placed),
        "radii": [shape.half_extents_m[0] for shape, _ in placed],
        "lengths": [2.0 * shape.half_extents_m[2] for shape, _ in placed],
    }


def _centres(placed: Sequence[Placed]) -> list[tuple[float, float, float]]:
    return [(pose.x, pose.y, shape.base_z_m + shape.half_extents_m[2]) for shape, pose in placed]
