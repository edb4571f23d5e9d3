"""Colour frames: now and then one as JPEG."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from drivers.interface.frame_slot import FrameSlot
from drivers.realsense.plan import LARGEST_PICTURE
from drivers.realsense.stream import FrameStamps, camera_clock


class ColourReader:
    """Encodes a picture whenever one is due."""

    def __init__(self, rate_hz: float, quality: int, latency_s: float, slot: FrameSlot) -> None:
        """Take so many a second."""
        self._period_ns = round(1e9 / rate_hz)
        self._quality = [cv2.IMWRITE_JPEG_QUALITY, quality]
        self._slot = slot
        self._due_ns = 0
        self.stamps = FrameStamps(camera_clock(latency_s), slot.written)

    def restart(self) -> None:
        """Expect another beginning of the stream."""
        self.stamps.restart()

    def take(self, frame: Any, now_ns: int) -> bool:
        """Take in an `rs.video_frame` of format rgb8 that was read now; return whether it is a new one."""
        stamp = self.stamps.take(frame, now_ns)
        if stamp is None or now_ns < self._due_ns:
            return stamp is not None
        self._due_ns = now_ns + self._period_ns
        picture = cv2.cvtColor(np.asanyarray(frame.get_data()), cv2.COLOR_RGB2BGR)
        done, jpeg = cv2.imencode(".jpg", picture, self._quality)
        if done and len(jpeg) <= LARGEST_PICTURE:
            self._slot.put(stamp.row, jpeg)
        return True
