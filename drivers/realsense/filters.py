"""librealsense's post-processing of depth, in the order and with the numbers of the clearance paper."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from drivers.interface.settings import Settings
from drivers.realsense.library import librealsense


class SpatialSettings(Settings):
    """Edge-preserving smoothing within an image."""

    magnitude: int = Field(default=4, ge=1, le=5, description="passes")
    alpha: float = Field(default=0.25, ge=0.25, le=1.0, description="weight of the pixel itself; 1: no smoothing")
    delta: int = Field(default=30, ge=1, le=50, description="a greater step is an edge")
    holes: int = Field(default=2, ge=0, le=5, description="0: none are filled; 1 to 4: up to 2, 4, 8, 16 px along a row; 5: all")


class TemporalSettings(Settings):
    """Edge-preserving smoothing over time."""

    alpha: float = Field(default=0.40, ge=0.0, le=1.0, description="weight of the newest frame; 1: no smoothing")
    delta: int = Field(default=20, ge=1, le=100, description="a greater step is a change")
    persistency: int = Field(
        default=3, ge=0, le=8, description="0: a hole stays one; 3: it keeps the last value if 2 of 4 frames had one; 8: always"
    )


class FilterSettings(Settings):
    """The chain of Cui, Deng, Wang (clearance paper), appendix D.3, table 4; hole filling, its mode 1, is off unless asked for.

    Measured: it turns a block that stands nearer than the least range, a hole in the image, into the background behind it.
    """

    decimation: int = Field(default=3, ge=1, le=8, description="pixels along each side that become one; 1: off")
    disparity: bool = Field(default=True, description="smooth disparity instead of depth")
    spatial: SpatialSettings | None = Field(default=SpatialSettings(), description="none: off")
    temporal: TemporalSettings | None = Field(default=TemporalSettings(), description="none: off")
    hole_filling: int | None = Field(
        default=None, ge=0, le=2, description="0: from the left, 1: the farthest neighbour, 2: the nearest; none: off"
    )


class FilterChain:
    """Decimation, disparity, spatial, temporal, depth again, hole filling: one object for one stream, as it remembers frames."""

    def __init__(self, settings: FilterSettings) -> None:
        """Make the filters that are on."""
        rs, s = librealsense(), settings
        spatial, temporal = s.spatial, s.temporal
        self._filters: list[Any] = []
        if s.decimation > 1:
            self._filters.append(rs.decimation_filter(s.decimation))
        if s.disparity:
            self._filters.append(rs.disparity_transform(True))
        if spatial is not None:
            self._filters.append(rs.spatial_filter(spatial.alpha, spatial.delta, spatial.magnitude, spatial.holes))
        if temporal is not None:
            self._filters.append(rs.temporal_filter(temporal.alpha, temporal.delta, temporal.persistency))
        if s.disparity:
            self._filters.append(rs.disparity_transform(False))
        if s.hole_filling is not None:
            self._filters.append(rs.hole_filling_filter(s.hole_filling))

    def process(self, frame: Any) -> Any:
        """Return a depth frame as the chain leaves it, an `rs.depth_frame`."""
        for each in self._filters:
            frame = each.process(frame)
        return frame.as_depth_frame()
