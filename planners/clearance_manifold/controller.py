"""Layer 3: the manifold dynamical system (equation 4), its longitudinal law, and the twist for either kind of base."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.geometry import SE2, wrap_angle
from estimators.belief import F64
from planners.clearance_manifold.control_kernels import brakable, give_way, longitudinal
from planners.clearance_manifold.settings import ControllerSettings
from planners.point_ds.kernels import within

LEFT = np.array([0.0, 1.0])
STANDSTILL_M_S = 0.01  # a base that cannot strafe turns on the spot below this


@dataclass(frozen=True, slots=True)
class Situation:
    """What the controller reads of the manifold: 1-D quantities at the robot (proposition 3)."""

    error: F64  # (2,), e_perp, in odom [m]
    tangent: F64  # (2,), unit
    ridge_clearance_m: float  # rho_ridge, near the robot
    margin_m: float  # M_min: least predicted clearance beyond rho_min ahead
    commitment: float  # a_pred
    free_m: float  # how far ahead it may go at most
    most_m_s: float  # and how fast, whatever the clearance
    heading_rad: float  # where the robot should look, in odom
    feasible: bool
    robot: F64  # (2,), the point that is controlled, in odom
    closing: F64  # (5,), what closes in


class ManifoldController:
    """Turns a situation into a body twist."""

    def __init__(self, settings: ControllerSettings, limits: BaseLimits) -> None:
        """Take the gains and the limits."""
        self._settings, self._limits = settings, limits

    def speed(self, at: Situation) -> float:
        """Return k_parallel: cruise by clearance and margin, plus commitment, below what can be braked."""
        s = self._settings
        room = min(at.ridge_clearance_m / s.cruise_clearance_m, 1.0)
        margin = min(max((at.margin_m - s.margin_low_m) / (s.margin_high_m - s.margin_low_m), 0.0), 1.0)
        cruise = s.speed_m_s * max(room, 0.0) * margin
        wanted = min(max(cruise + at.commitment * s.commitment_m_s, 0.0), s.speed_m_s)
        return float(min(wanted, at.most_m_s, brakable(at.free_m, s.deceleration_m_s2, s.delay_s)))

    def command(self, at: Situation, yaw: float) -> tuple[BodyTwist, float]:
        """Return the twist and the speed along the manifold."""
        s, cap = self._settings, self._limits.velocity
        body = SE2(0.0, 0.0, -yaw)
        push = body.apply(-s.lateral_gain_per_s * at.error)
        tangent = body.apply(at.tangent)
        speed = self.speed(at)
        if at.feasible and speed + float(push @ tangent) < s.progress_m_s:
            speed = min(s.progress_m_s, brakable(at.free_m, s.deceleration_m_s2, s.delay_s))
        if not self._limits.holonomic:
            u = self._yielding(push + speed * tangent, at, body)
            return self._look_ahead_twist(u, speed, self.turn(at, yaw)), speed
        low_x = -cap.vx if self._limits.reverse else 0.0
        push_x, push_y = within(float(push[0]), float(push[1]), low_x if low_x < 0.0 else -1e-9, cap.vx, cap.vy)
        k = longitudinal(push_x, push_y, float(tangent[0]), float(tangent[1]), speed, cap.vx, cap.vy, low_x)
        u = self._yielding(np.array([push_x, push_y]) + k * tangent, at, body)
        vx, vy = within(float(u[0]), float(u[1]), low_x if low_x < 0.0 else -1e-9, cap.vx, cap.vy)
        return BodyTwist(max(vx, low_x), vy, self.turn(at, yaw)), k

    def _yielding(self, u: F64, at: Situation, body: SE2) -> F64:
        """Return the velocity, shape (2,), in the body frame, changed so that what closes in passes at a distance."""
        s = self._settings
        away = -at.error / max(float(np.hypot(*at.error)), 1e-9) if float(np.hypot(*at.error)) > 1e-6 else body.apply(LEFT)
        odom = body.inverse()
        yielding = give_way(odom.apply(u), at.robot, at.closing, s.yield_m, s.yield_horizon_s, away)
        return body.apply(yielding)

    def turn(self, at: Situation, yaw: float) -> float:
        """Return wz towards the heading wanted."""
        cap = self._limits.velocity.wz
        return min(max(self._settings.heading_gain_per_s * wrap_angle(at.heading_rad - yaw), -cap), cap)

    def _look_ahead_twist(self, u: F64, speed: float, turn: float) -> BodyTwist:
        """Return the twist that moves the point `look_ahead_m` ahead with velocity u, shape (2,), in the body frame.

        Feedback linearisation: v = u_x, w = u_y / d.  What does not point ahead is turned to on the spot; with no speed along
        the manifold, `turn` says where to look meanwhile.
        """
        cap, d = self._limits.velocity, self._settings.look_ahead_m
        if u[0] <= STANDSTILL_M_S:
            if speed > STANDSTILL_M_S:  # it is to go there, whatever it would look at
                turn = min(max(self._settings.heading_gain_per_s * math.atan2(u[1], u[0]), -cap.wz), cap.wz)
            return BodyTwist(0.0, 0.0, turn)
        vx, wz_d = within(float(u[0]), float(u[1]), -cap.vx, cap.vx, cap.wz * d)
        return BodyTwist(vx, 0.0, wz_d / d)
