"""What to do when the best that the window offers is to stand: turn once around, since the camera sees only ahead."""

from __future__ import annotations

import math

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import wrap_angle
from drivers.interface.stateful import pack, unpack
from estimators.belief import Belief
from estimators.field_query import sample

STANDING_M_S = 0.03
TURNING_RAD_S = 0.1
_PROBE_M = 0.5  # where the room to the left and right is compared


class LookAround:
    """Turns on the spot, after standing for `stall_s`, until the window offers a way on or one turn is complete."""

    def __init__(self, stall_s: float, rate_rad_s: float, period_s: float) -> None:
        """Start moving."""
        self._stall_s, self._rate_rad_s, self._period_s = stall_s, rate_rad_s, period_s
        self.reset()

    def reset(self) -> None:
        """Forget the standing: the robot moves, or has nothing to do."""
        self._stalled_s, self._turn, self._turned_rad = 0.0, 0.0, 0.0

    @property
    def active(self) -> bool:
        """Whether it is turning."""
        return self._turn != 0.0

    def amend(self, chosen: BodyTwist, belief: Belief, bearing_rad: float) -> BodyTwist:
        """Return the twist chosen, or the turn in its place; `bearing_rad` is where the route leads, seen from the robot."""
        turning = abs(chosen.wz) >= TURNING_RAD_S and not self.active
        if chosen.speed_m_s >= STANDING_M_S or turning:
            self.reset()
            return chosen
        self._stalled_s += self._period_s
        if self._stalled_s < self._stall_s:
            return chosen
        if not self.active:
            self._turn = freer_side(belief, bearing_rad)
        self._turned_rad += self._rate_rad_s * self._period_s
        if self._turned_rad >= 2.0 * math.pi:
            self.reset()
            return chosen
        return BodyTwist(0.0, 0.0, self._turn * self._rate_rad_s)

    def snapshot(self) -> bytes:
        """Return the whole state."""
        return pack(stalled_s=self._stalled_s, turn=self._turn, turned_rad=self._turned_rad)

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._stalled_s, self._turn, self._turned_rad = (float(state[k]) for k in ("stalled_s", "turn", "turned_rad"))


def freer_side(belief: Belief, bearing_rad: float) -> float:
    """Return +1 for left or -1 for right: towards the route when it leads aside, else where there is more room."""
    bearing = wrap_angle(bearing_rad)
    if abs(bearing) > 0.3:
        return math.copysign(1.0, bearing)
    sides = belief.odom_from_base.apply(np.array([[0.0, _PROBE_M], [0.0, -_PROBE_M]]))
    left, right = sample(belief.clearance.clearance_m, belief.clearance.lattice, sides)
    return 1.0 if left >= right else -1.0
