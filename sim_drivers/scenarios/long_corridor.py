"""The long corridor: 20 m with one opposing walker."""

from __future__ import annotations

from pydantic import Field

from drivers.interface.seeds import stream
from sim_drivers.scenarios.corridor import corridor_scene
from sim_drivers.scenarios.walkers import WalkerSettings, draw_gaits, oncoming, walked_corridor
from sim_drivers.scene import Scene


class LongCorridorSettings(WalkerSettings):
    """Length and the number of walkers are the paper's (section 6)."""

    length_m: float = Field(20.0, ge=6.0, le=100.0, description="corridor from x = 0; the goal lies 1 m before its end")
    walkers: int = Field(1, ge=1, le=8, description="how many come towards the robot")


class LongCorridor:
    """A corridor of 20 m with one walker who comes towards the robot."""

    Settings = LongCorridorSettings

    def __init__(self, settings: LongCorridorSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed."""
        settings = self._settings
        gaits = draw_gaits(stream(seed, "long_corridor"), settings, settings.walkers)
        walls = walked_corridor(settings, settings.walkers)
        return corridor_scene("long_corridor", settings, walls, oncoming(settings, gaits))
