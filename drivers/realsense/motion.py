"""Gyroscope and accelerometer, which a camera reports apart and each at its own rate, as one sample."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.shared_ring import SharedRing
from drivers.realsense.stream import FrameStamp, FrameStamps, camera_clock

MOST_WAITING = 8  # rates that wait for the next force; then the last one holds
Vector = tuple[float, float, float]


class MotionReader:
    """Makes a sample of every rate, with the specific force at its time, between the one before and the one after."""

    def __init__(self, latency_s: float, ring: SharedRing) -> None:
        """Go on with the numbers where an earlier process stopped."""
        self._ring = ring
        clock = camera_clock(latency_s)
        self.stamps = FrameStamps(clock, ring.written)
        self._accel_stamps = FrameStamps(clock, 0)
        self._depth_from_motion = np.eye(3)
        self.restart(self._depth_from_motion)

    @property
    def dropped(self) -> int:
        """Rates and forces that were lost or came twice."""
        return self.stamps.dropped + self._accel_stamps.dropped

    def restart(self, depth_from_motion: NDArray[np.float64]) -> None:
        """Expect another beginning of the streams; their axes are turned by a rotation (3, 3)."""
        self._depth_from_motion = depth_from_motion
        self.stamps.restart()
        self._accel_stamps.restart()
        self._rates: deque[tuple[FrameStamp, Vector]] = deque()
        self._forces: deque[tuple[int, Vector]] = deque(maxlen=2)

    def take_gyro(self, frame: Any, now_ns: int) -> bool:
        """Take in a rate that was read now; return whether it is a new one."""
        stamp = self.stamps.take(frame, now_ns)
        if stamp is not None:
            self._rates.append((stamp, _vector(frame)))
            self._join()
        return stamp is not None

    def take_accel(self, frame: Any, now_ns: int) -> bool:
        """Take in a specific force that was read now; return whether it is a new one."""
        stamp = self._accel_stamps.take(frame, now_ns)
        if stamp is not None:
            self._forces.append((stamp.captured_ns, _vector(frame)))
            self._join()
        return stamp is not None

    def _join(self) -> None:
        """Give out every rate whose force is known."""
        while self._rates and self._forces:
            stamp, rate = self._rates[0]
            if self._forces[-1][0] < stamp.captured_ns and len(self._rates) <= MOST_WAITING:
                return
            self._rates.popleft()
            force = self._force_at(stamp.captured_ns)
            turned = self._depth_from_motion @ np.array((rate, force)).T  # (3, 2)
            self._ring.put((*stamp.row, turned[:, 0], turned[:, 1]))

    def _force_at(self, time_ns: int) -> Vector:
        (before_ns, before), (after_ns, after) = self._forces[0], self._forces[-1]
        share = min(max((time_ns - before_ns) / max(after_ns - before_ns, 1), 0.0), 1.0)
        x, y, z = (a + share * (b - a) for a, b in zip(before, after, strict=True))
        return x, y, z


def _vector(frame: Any) -> Vector:
    data = frame.as_motion_frame().get_motion_data()
    return data.x, data.y, data.z
