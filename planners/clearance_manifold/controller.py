"""Layer 3: the manifold dynamical system (equation 4), its longitudinal law, and the twist for either kind of base."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.geometry import SE2, wrap_angle
from estimators.belief import F64
from planners.clearance_manifold.control_kernels import brakable, known_way, longitudinal
from planners.clearance_manifold.differential import Differential
from planners.clearance_manifold.governor import Around, Governor, Motion, approach
from planners.clearance_manifold.governor_kernels import room_along, time_to_pass
from planners.clearance_manifold.passing_kernels import give_way, meeting
from planners.clearance_manifold.settings import ControllerSettings
from planners.point_ds.kernels import within

UNKNOWN_GAP_M = 0.15  # shorter stretches of unknown cells are holes in a depth image, not the edge of what was seen
SEEN_AHEAD_M = 0.6  # enough to brake from the caps
STANDSTILL_M_S = 0.01
LEAD_S = 0.4  # the robot is out of the way so long before somebody passes: he is as wide as he is, and so is it
NEAR_M = 1.0  # who passes at more than this does not press
BACK_OFF_M = 0.3  # with less room behind, what is too near to be seen is driven over as it was seen last
APPROACH = 0.25  # of the jerk, on the way to the manifold: the rest is left for what else happens


@dataclass(frozen=True, slots=True)
class Situation:
    """What the controller reads of the manifold: 1-D quantities at the robot (proposition 3)."""

    error: F64  # (2,), e_perp, in odom [m]
    tangent: F64  # (2,), unit
    ridge_clearance_m: float  # rho_ridge, near the robot
    margin_m: float  # M_min: least predicted clearance beyond rho_min ahead
    commitment: float  # a_pred
    free_m: float  # how far ahead it may go at most: to the end of what is wide, known and before the goal,
    clear_m: float  # and to where somebody unseen may come
    most_m_s: float  # and how fast, whatever the clearance
    heading_rad: float  # where the robot should look, in odom
    feasible: bool
    robot: F64  # (2,), the point that is controlled, in odom
    velocity: F64  # (2,), of the base, in odom
    closing: F64  # (n, 5), what closes in,
    hands: F64  # (n,), and on which hand it passes (`Passing`)
    behind_m: float = 0.0  # how far a base that cannot strafe may back off
    stale: bool = False  # nobody has looked at the ground right before it for long


class ManifoldController:
    """Turns a situation into a body twist."""

    def __init__(self, settings: ControllerSettings, limits: BaseLimits, governor: Governor, radius_m: float) -> None:
        """Take gains, limits and radius, and what smooths the velocity, which is carried on with this one's state."""
        self._settings, self._limits, self._governor = settings, limits, governor
        self._differential = Differential(settings, limits)
        self.apart_m = radius_m + settings.yield_m if settings.yield_m > 0.0 else 0.0
        self._radius_m = radius_m
        self._delay_s = settings.delay_s
        if limits.holonomic and governor.enabled:  # braking begins with a ramp
            self._delay_s += 0.5 * settings.deceleration_m_s2 / governor.ease_m_s3

    def speed(self, at: Situation) -> float:
        """Return k_parallel: cruise by clearance and margin, plus commitment, below what can be braked."""
        s = self._settings
        room = min(at.ridge_clearance_m / s.cruise_clearance_m, 1.0)
        margin = min(max((at.margin_m - s.margin_low_m) / (s.margin_high_m - s.margin_low_m), 0.0), 1.0)
        cruise = s.speed_m_s * max(room, 0.0) * margin
        wanted = min(max(cruise + at.commitment * s.commitment_m_s, 0.0), s.speed_m_s)
        return float(min(wanted, at.most_m_s, self._brakable(min(at.free_m, at.clear_m))))

    def command(self, at: Situation, yaw: float, around: Around) -> tuple[BodyTwist, float]:
        """Return the twist and the speed along the manifold."""
        cap = self._limits.velocity
        body = SE2(0.0, 0.0, -yaw)
        pass_s = min(time_to_pass(at.robot, who, NEAR_M) for who in at.closing) - LEAD_S
        least_m_s3 = self._governor.pressing(float(np.hypot(*at.error)), pass_s)
        push, tangent, speed = body.apply(self._push(at.error, least_m_s3)), body.apply(at.tangent), self.speed(at)
        if at.feasible and speed + float(push @ tangent) < self._settings.progress_m_s:
            speed = min(self._settings.progress_m_s, self._brakable(min(at.free_m, at.clear_m)))
        if not self._limits.holonomic:
            along = body.inverse().apply(push + speed * tangent) if speed > STANDSTILL_M_S else np.zeros(2)
            u = self._yielding(along, at)
            behind_m = at.behind_m if np.any(u != along) else 0.0  # only who gives way backs off
            return self._differential.twist(body.apply(u), speed, wrap_angle(at.heading_rad - yaw), behind_m), speed
        low_x = -cap.vx if self._limits.reverse else -1e-9
        push_x, push_y = within(float(push[0]), float(push[1]), low_x, cap.vx, cap.vy)
        k = longitudinal(push_x, push_y, float(tangent[0]), float(tangent[1]), speed, cap.vx, cap.vy, min(low_x, 0.0))
        if at.stale and self._can_back_off(at, around):
            k = -self._settings.progress_m_s if k > self._settings.progress_m_s else 0.0
        along = body.inverse().apply(np.array([push_x, push_y]) + k * tangent)
        u = body.apply(self._smoothed(along, at, around, least_m_s3, pass_s))
        vx, vy = within(float(u[0]), float(u[1]), low_x, cap.vx, cap.vy)
        return BodyTwist(max(vx, low_x, -cap.vx if self._limits.reverse else 0.0), vy, self.turn(at, yaw)), k

    def _push(self, error: F64, jerk_m_s3: float) -> F64:
        """Return equation 4's velocity towards the manifold, shape (2,), in odom, if it can still end there with that jerk."""
        error_m, gain_per_s = float(np.hypot(*error)), self._settings.lateral_gain_per_s
        if not self._limits.holonomic:
            return self._differential.push(error)
        if not self._governor.enabled or error_m < 1e-9:
            return np.asarray(-gain_per_s * error)
        speed = min(gain_per_s * error_m, approach(error_m, APPROACH * jerk_m_s3))
        return np.asarray(-speed / error_m * error)

    def _smoothed(self, along: F64, at: Situation, around: Around, least_m_s3: float, pass_s: float) -> F64:
        """Return the velocity to ask for, shape (2,), of that along the manifold, in odom: giving way, and smoothed."""
        yielding = self._over_known_ground(self._yielding(along, at), at, around)
        least_m_s3 = max(least_m_s3, self._governor.to_change(float(np.hypot(*(yielding - along))), pass_s))
        return self._governor.follow(
            yielding, Motion(at.robot, at.velocity, at.tangent, at.free_m, at.clear_m), around, least_m_s3
        )

    def _can_back_off(self, at: Situation, around: Around) -> bool:
        """Return whether there is room behind, to see what is too near."""
        room_m = room_along(around.ground, around.known, at.robot, -at.tangent, around.least_m, around.body_m, BACK_OFF_M)
        return bool(room_m >= BACK_OFF_M)

    def _brakable(self, free_m: float) -> float:
        return float(brakable(free_m, self._settings.deceleration_m_s2, self._delay_s))

    def _yielding(self, u: F64, at: Situation) -> F64:
        """Return the velocity, shape (2,), in odom, changed so that what closes in passes at a distance.

        Projected in turn onto what each of them leaves, and last onto what who passes first does.
        """
        come = [(meeting(at.robot, who)[0], who, hand) for who, hand in zip(at.closing, at.hands, strict=True) if hand != 0.0]
        come.sort(key=lambda one: -one[0])
        for _, who, hand in come * len(come):
            u = np.asarray(give_way(u, at.robot, who, self.apart_m, self._settings.yield_horizon_s, hand))
        return u

    def reset(self) -> None:
        """Stand."""
        self._governor.reset()

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is carried on, as named arrays."""
        return self._governor.state()

    def take(self, state: dict[str, NDArray[Any]]) -> None:
        """Take over what `state` gave."""
        self._governor.take(state)

    def _over_known_ground(self, u: F64, at: Situation, around: Around) -> F64:
        """Return a velocity, shape (2,), in odom, slow enough to be braked before what was never seen.

        The manifold ends there, but who gives way or comes back to it sideways does not go along it: what is behind a pillar
        that the robot passed, nobody saw.
        """
        speed, ground = float(np.hypot(*u)), around.ground
        if speed < STANDSTILL_M_S:
            return u
        corner = np.array([ground.x_m, ground.y_m])
        free_m = known_way(
            around.known, corner, ground.cell_m, at.robot, u / speed, self._radius_m, around.body_m, UNKNOWN_GAP_M, SEEN_AHEAD_M
        )
        return np.asarray(u * min(1.0, brakable(free_m, self._settings.deceleration_m_s2, self._settings.delay_s) / speed))

    def turn(self, at: Situation, yaw: float) -> float:
        """Return wz towards the heading wanted."""
        cap = self._limits.velocity.wz
        return min(max(self._settings.heading_gain_per_s * wrap_angle(at.heading_rad - yaw), -cap), cap)
