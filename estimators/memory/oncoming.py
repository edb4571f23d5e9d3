"""Who comes on into the blind zone right before the sensor: his front, carried on with the velocity that it had.

A depth camera gives no returns from nearer than its least range.  The last cells of somebody who comes on would stay where they
gave their last return, and neither a planner nor a shield would see him come the rest of the way.

Source: ours; the paper's simulated sensor (Cui, Deng, Wang) has no least range.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.belief import F64

NEAR_M = 1.5  # farther from the robot nobody is followed
BODY_M = 0.5  # what is nearer than this to the nearest cell is his
CELLS = 3  # fewer are noise
WHOLE = 0.85  # with less of what was seen of him before, part of him is in the blind zone
SAME_M = 0.4  # who is farther than this from where he was is somebody else
GAP_S = 0.3  # and so is who was not seen for longer
LOOK_S = 0.6  # the velocity is that of so long,
SURE_S = 0.3  # and is not known from less
SLOW_M_S, FAST_M_S = 0.3, 2.5  # what is slower may stand, what is faster is noise
FEW = 4  # looks that a velocity takes


class Oncoming:
    """One front: the nearest."""

    def __init__(self, carry_s: float) -> None:
        """Take for how long it is carried on."""
        self._carry_s = carry_s
        self._forget()

    def _forget(self) -> None:
        self._looks: F64 = np.zeros((0, 3))  # time [s] and middle [m, odom]
        self._front: F64 = np.zeros((0, 2))  # cells at the last of them [m, odom]

    def update(self, cells: F64, robot: F64, now_s: float) -> F64:
        """Return where his front must be by now, shape (m, 2), in odom; empty while he is seen, or nobody comes.

        Args:
            cells: centres of the cells that this frame sees occupied where it was free, shape (n, 2), in odom.
            robot: in odom, shape (2,).
            now_s: when.
        """
        away = np.hypot(*(cells - robot).T)
        if away.size and away.min() < NEAR_M:
            his = cells[np.hypot(*(cells - cells[int(np.argmin(away))]).T) < BODY_M]
            if len(his) >= max(CELLS, WHOLE * len(self._front)):
                self._look(his, now_s)
                return np.zeros((0, 2))
        return self._carried(robot, now_s)

    def _look(self, front: F64, now_s: float) -> None:
        """Take in a front that is seen whole, shape (n, 2)."""
        middle = front.mean(axis=0)
        if len(self._looks):
            last_s, *last = self._looks[-1].tolist()
            if now_s - last_s > GAP_S or np.hypot(*(middle - last)) > SAME_M:
                self._forget()
        self._looks = np.vstack((self._looks, (now_s, *middle)))
        self._looks = self._looks[now_s - self._looks[:, 0] <= LOOK_S]
        self._front = front if len(front) >= len(self._front) else self._front + front.mean(axis=0) - self._front.mean(axis=0)

    def _carried(self, robot: F64, now_s: float) -> F64:
        """Return the front, moved on, shape (m, 2); forget it when it is past, stands, or was seen too long ago."""
        if len(self._looks) < FEW:
            return np.zeros((0, 2))
        times, places = self._looks[:, 0], self._looks[:, 1:]
        unseen_s, off_s = now_s - float(times[-1]), times - times.mean()
        velocity = off_s @ (places - places.mean(axis=0)) / max(float(off_s @ off_s), 1e-9)
        speed, front = float(np.hypot(*velocity)), self._front + unseen_s * velocity
        comes = float((robot - front.mean(axis=0)) @ velocity) > 0.0
        sure = times[-1] - times[0] >= SURE_S and SLOW_M_S <= speed <= FAST_M_S
        if unseen_s > self._carry_s or (sure and not comes):
            self._forget()
        return np.asarray(front) if len(self._looks) and sure else np.zeros((0, 2))

    def state(self) -> dict[str, NDArray[Any]]:
        """Return what is followed, as named arrays."""
        return {"oncoming_looks": self._looks, "oncoming_front": self._front}

    def take(self, state: dict[str, Any]) -> None:
        """Take over what `state` gave."""
        self._looks, self._front = state["oncoming_looks"].copy(), state["oncoming_front"].copy()
