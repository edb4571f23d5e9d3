"""Takes an arm through joint way-points, resting at each.

Source: Flash, Hogan, The coordination of arm movements, J. Neuroscience 5, 1985 (the quintic that has the least jerk).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BodyTwist, JointTrajectory
from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import JointSample
from drivers.interface.stateful import pack, unpack
from estimators.belief import Belief
from planners.joint_waypoints.profile import duration_s, knots_between
from planners.joint_waypoints.settings import JointWaypointsSettings
from planners.planner import Diagnostics, Plan, PlannerSetup
from planners.router import Route

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class JointWaypointsDiagnostics(Diagnostics):
    """How far along the mission is."""

    waypoint: int  # that the arm is heading for, counted over all rounds
    distance_rad: float  # of the joint that has farthest to go


class JointWaypoints:
    """Way-points in joint space: straight from one to the next, time-scaled into the arm's limits; it minds no obstacle."""

    Settings: ClassVar[type[JointWaypointsSettings]] = JointWaypointsSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: JointWaypointsSettings, setup: PlannerSetup) -> None:
        """Take the way-points.

        Raises:
            ConfigurationError: the robot has no arm, or there is no way-point, or one that the arm cannot reach.
        """
        if setup.arm_limits is None:
            raise ConfigurationError("planner.name 'joint_waypoints' moves an arm, but the robot has none")
        self._settings, self._limits = settings, setup.arm_limits
        self._rest = None if setup.limits is None else BodyTwist()
        self._waypoints = _checked(settings, len(setup.arm_limits.velocity_rad_s), setup)
        self._next = 0
        self._trajectory: JointTrajectory | None = None

    def warm_up(self) -> None:
        """There is nothing to compile."""

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the trajectory to the next way-point, the same until it is reached; the route is of no interest."""
        joints = belief.joints
        if joints is None:
            return Plan(self._rest, accomplished=False)
        if self._is_there(joints):
            self._next, self._trajectory = self._next + 1, None
        if self._next >= len(self._waypoints):
            return Plan(self._rest, diagnostics=JointWaypointsDiagnostics(self._next, 0.0), accomplished=True)
        if self._trajectory is None or self._is_astray(joints, self._trajectory, belief.stamp_ns):
            self._trajectory = self._way(joints, belief.stamp_ns)
        distance = float(np.abs(self._waypoints[self._next] - joints.position_rad).max())
        return Plan(self._rest, self._trajectory, diagnostics=JointWaypointsDiagnostics(self._next, distance), accomplished=False)

    def snapshot(self) -> bytes:
        """Return how far it is and the trajectory that it follows."""
        way = self._trajectory or JointTrajectory.rest()
        return pack(
            next=self._next,
            start_ns=way.start_ns,
            time=way.time_from_start_s,
            position=way.position_rad,
            velocity=way.velocity_rad_s,
        )

    def restore(self, snapshot: bytes) -> None:
        """Go on from there."""
        state = unpack(snapshot)
        self._next = int(state["next"])
        way = JointTrajectory(int(state["start_ns"]), state["time"], state["position"], state["velocity"])
        self._trajectory = None if way.is_rest else way

    def _is_there(self, joints: JointSample) -> bool:
        if self._next >= len(self._waypoints):
            return False
        s, gap = self._settings, np.abs(self._waypoints[self._next] - joints.position_rad)
        return bool((gap < s.tolerance_rad).all() and (np.abs(joints.velocity_rad_s) < s.standstill_rad_s).all())

    def _is_astray(self, joints: JointSample, way: JointTrajectory, now_ns: int) -> bool:
        """Whether the arm is not where the trajectory has it: it was stopped, or slowed down."""
        elapsed_s = (now_ns - way.start_ns) * 1e-9
        expected = [np.interp(elapsed_s, way.time_from_start_s, positions) for positions in way.position_rad.T]
        return bool((np.abs(np.array(expected) - joints.position_rad) > self._settings.astray_rad).any())

    def _way(self, joints: JointSample, now_ns: int) -> JointTrajectory:
        s, goal, limits = self._settings, self._waypoints[self._next], self._limits
        start = np.clip(joints.position_rad, limits.position_min_rad, limits.position_max_rad)
        took_s = duration_s(goal - start, limits, (s.velocity_share, s.acceleration_share, s.jerk_share))
        return JointTrajectory(now_ns, *knots_between(start, goal, took_s, s.knots))


def _checked(settings: JointWaypointsSettings, joints: int, setup: PlannerSetup) -> F64:
    """Return the way-points of all rounds, shape (n, joints)."""
    limits = setup.arm_limits
    assert limits is not None
    if not settings.waypoints_rad:
        raise ConfigurationError("planner.waypoints_rad names no way-point")
    for index, waypoint in enumerate(settings.waypoints_rad):
        if len(waypoint) != joints:
            raise ConfigurationError(
                f"planner.waypoints_rad: row {index} has {len(waypoint)} values, but the arm has {joints} joints"
            )
        inside = (limits.position_min_rad <= waypoint) & (np.array(waypoint) <= limits.position_max_rad)
        if not inside.all():
            joint = int(np.argmin(inside))
            raise ConfigurationError(
                f"planner.waypoints_rad: row {index} has {waypoint[joint]:g} rad for joint {joint + 1}, which goes from "
                f"{limits.position_min_rad[joint]:g} to {limits.position_max_rad[joint]:g} rad"
            )
    return np.array(settings.waypoints_rad * settings.rounds, dtype=np.float64)
