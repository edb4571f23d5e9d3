"""The static corridor of the clearance paper's question 1."""

from __future__ import annotations

from pydantic import Field

from sim_drivers.scenarios.corridor import CorridorSettings, closed_corridor, corridor_scene
from sim_drivers.scene import Scene


class StaticCorridorSettings(CorridorSettings):
    """Length and time limit are the paper's (appendix C)."""

    length_m: float = Field(24.0, ge=6.0, le=100.0, description="corridor from x = 0; the goal lies 1 m before its end")
    time_limit_s: float = Field(50.0, gt=0.0, le=600.0, description="when the run is given up")


class StaticCorridor:
    """A straight corridor of 24 m with nobody in it; every seed is the same."""

    Settings = StaticCorridorSettings

    def __init__(self, settings: StaticCorridorSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        return corridor_scene("static_corridor", self._settings, closed_corridor(self._settings))
