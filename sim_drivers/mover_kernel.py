"""Where all movers of a scene are at one time, written straight into MuJoCo's mocap arrays: one call a physics step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from sim_drivers.scene import Mover

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]


def pack_movers(movers: Sequence[Mover], mocap_ids: Sequence[int]) -> tuple[F64, I64]:
    """Return all key frames, shape (frames, 4), and for each mover its first frame, its end, whether it loops and its mocap id.

    The second array has shape (movers, 4).
    """
    frames = [mover.keyframes for mover in movers]
    ends = np.cumsum([len(part) for part in frames], dtype=np.int64)
    rows = [
        (end - len(mover.keyframes), end, mover.looped, mocap) for mover, mocap, end in zip(movers, mocap_ids, ends, strict=True)
    ]
    return np.concatenate([np.zeros((0, 4)), *frames]), np.array(rows, dtype=np.int64).reshape(-1, 4)


@kernel()
def place_movers(time_s: float, keyframes: F64, spans: I64, mocap_pos: F64, mocap_quat: F64) -> None:
    """Write x and y, shape (mocaps, 3), and yaw, shape (mocaps, 4), as `Mover.pose_at` gives them; z is left as it is."""
    for mover in range(len(spans)):
        first, end, looped, mocap = spans[mover]
        start, last = keyframes[first, 0], keyframes[end - 1, 0]
        t = start + (time_s - start) % (last - start) if looped and time_s > start else time_s
        after = first + np.searchsorted(keyframes[first:end, 0], t, side="right")
        before = max(after - 1, first)
        after = min(after, end - 1)
        span = keyframes[after, 0] - keyframes[before, 0]
        part = (t - keyframes[before, 0]) / span if span > 0.0 else 0.0
        yaw = _between(keyframes, before, after, 3, part)
        mocap_pos[mocap, 0] = _between(keyframes, before, after, 1, part)
        mocap_pos[mocap, 1] = _between(keyframes, before, after, 2, part)
        mocap_quat[mocap, 0], mocap_quat[mocap, 3] = np.cos(yaw / 2.0), np.sin(yaw / 2.0)


@kernel()
def _between(keyframes: F64, before: int, after: int, column: int, part: float) -> float:
    low = keyframes[before, column]
    return float(low + part * (keyframes[after, column] - low))
