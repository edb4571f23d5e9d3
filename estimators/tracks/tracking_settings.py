"""Settings of the tracker of moving obstacles."""

from __future__ import annotations

from pydantic import Field

from drivers.interface.settings import Settings
from estimators.tracks.traces import WIDEST_M


class TrackingSettings(Settings):
    """How obstacles are found, followed, and given up."""

    cells_min: int = Field(default=3, ge=1, le=100, description="smaller components are noise")
    radius_max_m: float = Field(default=0.6, gt=0.0, le=3.0, description="what looks wider is no obstacle that moves")
    left_width_max_m: float = Field(
        default=WIDEST_M,
        gt=0.0,
        le=6.0,
        description="widest surface, corner to corner, that is taken to move because it left ground",
    )
    clear_cells: int = Field(
        default=0, ge=0, le=20, description="what touches a wall on ground seen free so far around is tracked; 0: it is none"
    )
    radius_min_m: float = Field(default=0.05, gt=0.0, le=1.0, description="no track is thinner")
    radius_usual_m: float = Field(
        default=0.25, gt=0.0, le=1.0, description="of a new track that is hidden in part, or more where it looks wider"
    )
    sigma_m: float = Field(default=0.03, gt=0.0, le=1.0, description="of a measured centre, each axis")
    speed_sigma_m_s: float = Field(default=0.8, gt=0.0, le=5.0, description="of a new track's velocity, each axis")
    acceleration_m_s2: float = Field(default=2.0, gt=0.0, le=20.0, description="standard deviation of what changes a velocity")
    gate: float = Field(default=13.8, gt=0.0, le=100.0, description="largest squared distance; 13.8: 99.9 % of two axes")
    hits_min: int = Field(default=3, ge=1, le=100, description="frames in which a track was seen before it is given out")
    vanish_s: float = Field(default=0.25, ge=0.0, le=10.0, description="how long it lives where its place is seen free")
    coast_s: float = Field(default=1.5, ge=0.0, le=30.0, description="how long it lives out of sight")
    radius_gain: float = Field(
        default=0.3,
        gt=0.0,
        le=1.0,
        description="weight of a wider look, per frame; of a narrower a tenth, where nothing is hidden",
    )
