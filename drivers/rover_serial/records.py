"""How samples lie in the memory between the process at the wire and the loop."""

from __future__ import annotations

from typing import Any

import numpy as np

_STAMP = [("captured_ns", "i8"), ("received_ns", "i8"), ("sequence", "i8")]
WHEELS: np.dtype[Any] = np.dtype([*_STAMP, ("distance_m", "f8", (2,)), ("rate_m_s", "f8", (2,))])  # left, right
POSE: np.dtype[Any] = np.dtype([*_STAMP, ("pose", "f8", (3,)), ("twist", "f8", (3,))])  # north, west, yaw; body
IMU: np.dtype[Any] = np.dtype([*_STAMP, ("gyro_rad_s", "f8", (3,)), ("accel_m_s2", "f8", (3,))])
