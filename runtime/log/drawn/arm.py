"""The arm: its links as nested frames in the scene, its joints over time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import rerun as rr

from drivers.interface.commands import JointTrajectory
from drivers.interface.geometry import SE3
from runtime.cycle import Cycle
from runtime.log.drawn import colours
from runtime.log.drawn.layers import Layer, Rows, Static
from runtime.log.drawn.plots import NAN, Values, series
from runtime.log.drawn.urdf import Link
from runtime.log.header import ArmShape

POSITION = "/view/arm/position"
SET_POINT = "/view/arm/set_point"
VELOCITY = "/view/arm/velocity"
TORQUE = "/view/arm/torque"


def layers(entity: str, arm: ArmShape) -> list[Layer[Any]]:
    """Return the frames of the links below the entity, and the plots of the joints."""
    drawn: list[Layer[Any]] = []
    frame, joints = entity, 0
    for link in arm.links:
        frame = f"{frame}/{link.name}"
        origin = link.parent_from_joint if drawn else arm.base_from_foot @ link.parent_from_joint
        drawn.append(Layer(_turned(origin, joints if link.turns else None), Rows(frame, _transforms, _solids(frame, link))))
        joints += link.turns
    return [*drawn, *_plots(joints)]


def set_point(trajectory: JointTrajectory | None, now_ns: int, joints: int) -> Values:
    """Return where a trajectory wants the joints at a time [rad]: the cubic through its knots' positions and velocities.

    Before the first and after the last knot it is that knot's position; without a trajectory, or at rest, NaN.
    """
    if trajectory is None or trajectory.is_rest:
        return (NAN,) * joints
    times, position, velocity = trajectory.time_from_start_s, trajectory.position_rad, trajectory.velocity_rad_s
    now_s = min(max((now_ns - trajectory.start_ns) * 1e-9, float(times[0])), float(times[-1]))
    knot = min(max(int(np.searchsorted(times, now_s, "right")) - 1, 0), len(times) - 2)
    span = float(times[knot + 1] - times[knot])
    s = (now_s - float(times[knot])) / span
    here = (1 + 2 * s) * (1 - s) ** 2 * position[knot] + s * (1 - s) ** 2 * span * velocity[knot]
    there = s**2 * (3 - 2 * s) * position[knot + 1] + s**2 * (s - 1) * span * velocity[knot + 1]
    return tuple((here + there).tolist())


def _plots(joints: int) -> list[Layer[Any]]:
    names = [f"joint {index + 1}" for index in range(joints)]
    palette = colours.STAGES[:joints]

    def commanded(cycle: Cycle) -> Values:
        return set_point(cycle.verdict.command.arm, cycle.sensed.tick.start_ns, joints)

    return [
        Layer(_measured("position_rad"), series(POSITION, names, palette)),
        Layer(commanded, series(SET_POINT, [f"{name}, set point" for name in names], palette)),
        Layer(_measured("velocity_rad_s"), series(VELOCITY, names, palette)),
        Layer(_measured("torque_nm"), series(TORQUE, names, palette)),
    ]


def _measured(field: str) -> Callable[[Cycle], Values | None]:
    def pick(cycle: Cycle) -> Values | None:
        return None if cycle.belief.joints is None else tuple(getattr(cycle.belief.joints, field).tolist())

    return pick


def _turned(origin: SE3, joint: int | None) -> Callable[[Cycle], SE3 | None]:
    def pick(cycle: Cycle) -> SE3 | None:
        if cycle.belief.joints is None:
            return None
        if joint is None:
            return origin
        angle = float(cycle.belief.joints.position_rad[joint])
        return origin @ SE3(qw=math.cos(angle / 2), qz=math.sin(angle / 2))

    return pick


def _transforms(poses: list[SE3]) -> rr.ComponentColumnList:
    return rr.Transform3D.columns(
        translation=[(pose.x, pose.y, pose.z) for pose in poses],
        quaternion=[(pose.qx, pose.qy, pose.qz, pose.qw) for pose in poses],
    )


def _solids(frame: str, link: Link) -> Static:
    if not link.cylinders:
        return ()
    poses: Sequence[SE3] = [cylinder.link_from_cylinder for cylinder in link.cylinders]
    solid = rr.Cylinders3D(
        centers=[(pose.x, pose.y, pose.z) for pose in poses],
        quaternions=[(pose.qx, pose.qy, pose.qz, pose.qw) for pose in poses],
        radii=[cylinder.radius_m for cylinder in link.cylinders],
        lengths=[cylinder.length_m for cylinder in link.cylinders],
        colors=[colours.SENT],
        fill_mode="solid",
    )
    return [(f"{frame}/solid", solid)]
