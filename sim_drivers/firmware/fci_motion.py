"""How the controller takes motion commands: one each millisecond, none too wild, and what it does when one is missing.

Source: Franka Control Interface documentation, Robot and interface specifications (limits; constant acceleration while packets
are lost; abort after 20 in a row) and Error handling (which limit makes which error).
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from drivers.interface.arm_motion import PANDA, TrajectoryFollower
from sim_drivers.firmware.fci_protocol import Error

F64 = NDArray[np.float64]

CYCLE_S, CYCLE_NS = 1e-3, 1_000_000
MOST_LOST = 20  # commands in a row
WINDOW = 100  # cycles that the success rate counts
SLACK = 1.001  # on every limit, for the client's rounding
START_TOLERANCE_RAD = 1e-3  # between the first command and where the arm stands


class SetPoint:
    """Where the joints are to be: as the client says while it may, otherwise braked to rest by the controller itself."""

    def __init__(self, position_rad: F64) -> None:
        """Rest at a position, shape (7,)."""
        self.position_rad = position_rad.copy()  # (7,)
        self.velocity_rad_s = np.zeros(7)
        self.acceleration_rad_s2 = np.zeros(7)
        self._brake = TrajectoryFollower(PANDA, position_rad)
        self._braked_ns = 0

    def take(self, position_rad: F64, *, first: bool) -> Error | None:
        """Go where a command says, shape (7,), or return what is wrong with it; then nothing has changed."""
        velocity = (position_rad - self.position_rad) / CYCLE_S
        acceleration = (velocity - self.velocity_rad_s) / CYCLE_S
        jerk = (acceleration - self.acceleration_rad_s2) / CYCLE_S
        if not np.isfinite(position_rad).all():
            return Error.POSITION_LIMITS_VIOLATION
        if first and np.abs(position_rad - self.position_rad).max() > START_TOLERANCE_RAD:
            return Error.START_POSE_INVALID
        if (position_rad < PANDA.position_min_rad).any() or (position_rad > PANDA.position_max_rad).any():
            return Error.POSITION_LIMITS_VIOLATION
        if (np.abs(velocity) > SLACK * PANDA.velocity_rad_s).any():
            return Error.VELOCITY_LIMITS_VIOLATION
        if (np.abs(acceleration) > SLACK * PANDA.acceleration_rad_s2).any():
            return Error.VELOCITY_DISCONTINUITY
        if (np.abs(jerk) > SLACK * PANDA.jerk_rad_s3).any():
            return Error.ACCELERATION_DISCONTINUITY
        self._set(position_rad, velocity, acceleration)
        return None

    def extrapolate(self) -> None:
        """Go on with the same acceleration: the command for this cycle is lost."""
        velocity = self.velocity_rad_s + self.acceleration_rad_s2 * CYCLE_S
        self._set(self.position_rad + velocity * CYCLE_S, velocity, self.acceleration_rad_s2)

    def brake(self) -> None:
        """Go on towards rest, inside the limits."""
        if not (self.velocity_rad_s.any() or self.acceleration_rad_s2.any()):
            return
        brake = self._brake
        brake.resume(self.position_rad, self.velocity_rad_s, self.acceleration_rad_s2, self._braked_ns)
        self._braked_ns += CYCLE_NS
        brake.step(self._braked_ns)
        if brake.is_at_rest:
            self._set(brake.position_rad, np.zeros(7), np.zeros(7))
        else:
            self._set(brake.position_rad, brake.velocity_rad_s, brake.acceleration_rad_s2)

    def _set(self, position_rad: F64, velocity_rad_s: F64, acceleration_rad_s2: F64) -> None:
        self.position_rad, self.velocity_rad_s, self.acceleration_rad_s2 = position_rad, velocity_rad_s, acceleration_rad_s2


class Quality:
    """Counts the commands that came in time."""

    def __init__(self) -> None:
        """Start with a perfect record."""
        self._window: deque[bool] = deque(maxlen=WINDOW)
        self.lost_in_a_row = 0
        self.lost = 0  # since the motion began

    def count(self, *, came: bool) -> None:
        """Take one cycle into account."""
        self._window.append(came)
        self.lost += not came
        self.lost_in_a_row = 0 if came else self.lost_in_a_row + 1

    @property
    def rate(self) -> float:
        """Share of the last cycles' commands that came in time."""
        return sum(self._window) / len(self._window) if self._window else 0.0

    @property
    def is_too_bad(self) -> bool:
        """Whether the motion must be aborted."""
        return self.lost_in_a_row >= MOST_LOST
