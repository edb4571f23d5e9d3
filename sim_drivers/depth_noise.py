"""What an active stereo camera makes of true depth: noise that grows with the square of range, shadows, holes, a unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.kernel import kernel
from drivers.interface.settings import Settings

F32 = NDArray[np.float32]
U16 = NDArray[np.uint16]

# Neighbours whose disparity differs by more than their distance cannot be fused: Burt and Julesz, Science 208 (1980).
_DISPARITY_GRADIENT_LIMIT = 1.0


class DepthNoiseSettings(Settings):
    """How far a stereo camera is from the truth.

    Source of error, shadow and band: Intel RealSense D400 Series data sheet (337029, depth quality and invalid depth band) and
    Intel's white paper "Tuning D435 and D415 Cameras for Optimal Performance": RMS error = z^2 subpixel / (focal baseline).
    A subpixel of 0.08 is what its author recommends (librealsense, issue 3904); it gives 0.8 % at 4 m, inside the D455's
    "< 2 % at 4 m".
    """

    baseline_m: float = Field(default=0.095, gt=0.0, le=1.0, description="between the imagers; D455: 95 mm")
    subpixel_px: float = Field(default=0.08, ge=0.0, le=1.0, description="RMS of the disparity; 0.08 on well textured walls")
    shadow_hole_probability: float = Field(
        default=0.9, ge=0.0, le=1.0, description="of a hole where the right imager cannot see what the left one does"
    )
    edge_hole_probability: float = Field(default=0.3, ge=0.0, le=1.0, description="of a hole beside a jump of depth")
    dropout_probability: float = Field(default=0.002, ge=0.0, le=1.0, description="of a hole anywhere")


@kernel()
def _hole_probability(disparity: F32, leftmost: float, u: int, v: int, shadow: float, edge: float, dropout: float) -> float:
    """`leftmost`: the least column in the right image that anything to the right of this pixel projects to."""
    column = u - disparity[v, u]
    if column >= leftmost or column < 0.0:
        return max(shadow, dropout)
    here = disparity[v, u]
    jump = 0.0
    if u > 0:
        jump = max(jump, abs(here - disparity[v, u - 1]))
    if u + 1 < disparity.shape[1]:
        jump = max(jump, abs(here - disparity[v, u + 1]))
    if v > 0:
        jump = max(jump, abs(here - disparity[v - 1, u]))
    if v + 1 < disparity.shape[0]:
        jump = max(jump, abs(here - disparity[v + 1, u]))
    return max(edge, dropout) if jump > _DISPARITY_GRADIENT_LIMIT else dropout


@kernel()
def _spoil(
    depth: F32,
    normal: F32,
    uniform: F32,
    focal_baseline: float,
    sigma_per_m2: float,
    holes: tuple[float, float, float],
    limits: tuple[float, float, float],
    out: U16,
) -> None:
    """Write measured depth; `focal_baseline` [px m] turns depth into disparity, `limits` are least, most and unit [m]."""
    least, most, unit = limits
    disparity = np.float32(focal_baseline) / depth
    for v in range(depth.shape[0]):
        leftmost = np.inf
        for u in range(depth.shape[1] - 1, -1, -1):
            out[v, u] = 0
            if depth[v, u] < np.inf and uniform[v, u] >= _hole_probability(
                disparity, leftmost, u, v, holes[0], holes[1], holes[2]
            ):
                measured = depth[v, u] + sigma_per_m2 * depth[v, u] ** 2 * normal[v, u]
                if least <= measured <= most:
                    out[v, u] = int(measured / unit + 0.5)
            leftmost = min(leftmost, u - disparity[v, u])


def spoil(
    depth_m: F32,
    generator: np.random.Generator,
    settings: DepthNoiseSettings,
    focal_px: float,
    full_focal_px: float,
    limits_m: tuple[float, float, float],
) -> U16:
    """Return the depth image that a stereo camera delivers, in its depth unit; 0 where it does not know.

    The left imager is the reference, the right one stands `baseline_m` to its right: a point at column u is seen there at
    column u - focal * baseline / z.  It is in shadow when something to the right of it projects to the left of that, and has
    no partner when that lies outside the image (the invalid depth band).

    Args:
        depth_m: true depth, (height, width); inf where there is nothing.
        generator: draws the noise; the number of draws depends on the image's size only.
        settings: how much of what.
        focal_px: focal length of this image.
        full_focal_px: of the stream that the matcher works on, before decimation; the matching error refers to it.
        limits_m: least and greatest depth that is reported, and the depth unit.
    """
    normal = generator.standard_normal(depth_m.shape, dtype=np.float32)
    uniform = generator.random(depth_m.shape, dtype=np.float32)
    sigma_per_m2 = settings.subpixel_px / (full_focal_px * settings.baseline_m)
    holes = (settings.shadow_hole_probability, settings.edge_hole_probability, settings.dropout_probability)
    out = np.empty(depth_m.shape, dtype=np.uint16)
    _spoil(depth_m, normal, uniform, focal_px * settings.baseline_m, sigma_per_m2, holes, limits_m, out)
    return out
