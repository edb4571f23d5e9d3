"""The twist of a base that cannot strafe: a point ahead of its axle is moved, no faster than the base can stop turning.

Feedback linearisation: a point d ahead of the axle moves with (v, d w), so v = u_x and w = u_y / d move it with u.  The base does
not take w at once: it turns up with an acceleration a, some time after it was told.  Whatever asks it to turn is therefore kept
below what can be braked until it is there, as the speed along the manifold is; asked for more, it would swing about where it is
to point for good.
"""

from __future__ import annotations

import math

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist
from estimators.belief import F64
from planners.clearance_manifold.control_kernels import brakable
from planners.clearance_manifold.settings import ControllerSettings

STANDSTILL_M_S = 0.01  # it turns on the spot below this


class Differential:
    """Turns a velocity into a twist."""

    def __init__(self, settings: ControllerSettings, limits: BaseLimits) -> None:
        """Take the settings and the limits."""
        self._settings, self._limits = settings, limits
        self._turn_rad_s2 = settings.turn_share * limits.acceleration.wz

    def push(self, error: F64) -> F64:
        """Return the velocity, shape (2,), that takes the point back onto the manifold: k_perp, but braked in time.

        Sideways the point moves with d w, and is braked with d a.  `error` is where it is off the manifold, shape (2,) [m].
        """
        s, off_m = self._settings, float(np.hypot(*error))
        most = brakable(off_m, s.look_ahead_m * self._turn_rad_s2, s.turn_delay_s)
        return np.asarray(-min(s.lateral_gain_per_s, most / max(off_m, 1e-9)) * error)

    def turn_to(self, off_rad: float) -> float:
        """Return wz that turns the base by an angle and has it stand there."""
        most = brakable(abs(off_rad), self._turn_rad_s2, self._settings.turn_delay_s)
        return math.copysign(min(most, self._limits.velocity.wz), off_rad)

    def twist(self, u: F64, speed: float, look_rad: float, behind_m: float) -> BodyTwist:
        """Return the twist that moves the point with velocity u, shape (2,), in the body frame.

        What does not point ahead is turned to on the spot, unless there is room to back off.

        Args:
            u: the velocity [m/s].
            speed: along the manifold; with none there is time to look.
            look_rad: by how much it would turn to look, where it stands.
            behind_m: how far it may back off; 0: not at all.
        """
        cap, s = self._limits.velocity, self._settings
        forward, off_rad = float(u[0]), math.atan2(u[1], u[0])
        if forward < -STANDSTILL_M_S and behind_m > 0.0 and self._limits.reverse:
            back = min(-forward, cap.vx, brakable(behind_m, s.deceleration_m_s2, s.delay_s))
            return BodyTwist(-back, 0.0, 0.0)
        if forward <= STANDSTILL_M_S:
            return BodyTwist(0.0, 0.0, self.turn_to(off_rad if speed > STANDSTILL_M_S else look_rad))
        turn = min(abs(float(u[1])) / s.look_ahead_m, abs(self.turn_to(off_rad)))
        return BodyTwist(min(forward, cap.vx), 0.0, math.copysign(turn, float(u[1])))
