"""Depth frames: filtered, with the intrinsics that go with their size."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivers.interface.frame_slot import FrameSlot
from drivers.realsense.filters import FilterChain, FilterSettings
from drivers.realsense.stream import FrameStamps, camera_clock


class DepthReader:
    """Runs the filter chain and leaves the newest image for the loop."""

    def __init__(self, filters: FilterSettings, latency_s: float, slot: FrameSlot) -> None:
        """Go on with the numbers where an earlier process stopped."""
        self._settings = filters
        self._slot = slot
        self.stamps = FrameStamps(camera_clock(latency_s), slot.written)
        self.restart()

    def restart(self) -> None:
        """Forget the frames before: the camera was opened anew."""
        self.stamps.restart()
        self._chain = FilterChain(self._settings)

    def take(self, frame: Any, now_ns: int) -> bool:
        """Take in an `rs.depth_frame` that was read now; return whether it is a new one."""
        stamp = self.stamps.take(frame, now_ns)
        if stamp is None:
            return False
        filtered = self._chain.process(frame)
        k = filtered.get_profile().as_video_stream_profile().get_intrinsics()
        unit_m = float(f"{filtered.get_units():.6g}")  # librealsense keeps a float32
        size = (filtered.get_width(), filtered.get_height())
        self._slot.put((*stamp.row, *size, k.fx, k.fy, k.ppx, k.ppy, unit_m), np.asanyarray(filtered.get_data()))
        return True
