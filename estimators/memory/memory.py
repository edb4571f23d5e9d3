"""The contract of a memory of the cells around the robot, and which one is built."""

from __future__ import annotations

from typing import Literal, Protocol

from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.settings import Settings
from drivers.interface.stateful import Stateful
from estimators.belief import OccupancyGrid
from estimators.grid.labelling import FrameLabels
from estimators.memory.field_memory import FieldMemory, FieldMemorySettings
from estimators.memory.grid_memory import GridMemory, GridMemorySettings
from estimators.memory.remembered import Remembered


class Memory(Stateful, Protocol):
    """What is remembered of the cells in a window around the robot: seen cells win, unseen ones fade as each kind has it."""

    @property
    def grid(self) -> OccupancyGrid:
        """What is remembered now, as a copy."""
        ...

    @property
    def remembered(self) -> Remembered:
        """The grid and what else is known of its cells."""
        ...

    def strays(self, odom_from_base: SE2) -> bool:
        """Tell whether the robot has come so far from the window's middle that `follow` is due."""
        ...

    def follow(self, odom_from_base: SE2) -> None:
        """Take the window along with the robot and free the ground under it."""
        ...

    def merge(self, frame: FrameLabels, stamp_ns: int, odom_from_base: SE2) -> None:
        """Fold in one frame that was captured at `stamp_ns`, with the robot at `odom_from_base`."""
        ...


class MemorySettings(Settings):
    """Which memory, how large its window is, and what each kind is set to."""

    kind: Literal["rolling", "layers"] = Field(default="rolling", description="retention times, or the paper's two layers")
    window_m: float = Field(default=6.0, gt=0.5, le=40.0, description="side of the square window around the robot")
    rolling: GridMemorySettings = GridMemorySettings()
    layers: FieldMemorySettings = FieldMemorySettings()


def memory_of(settings: MemorySettings, cell_m: float, robot_radius_m: float) -> Memory:
    """Return the memory that the settings name, on cells of `cell_m`.

    Raises:
        ConfigurationError: the layers' cells or extent do not fit those of the window.
    """
    if settings.kind == "layers":
        return FieldMemory(settings.layers, settings.window_m, cell_m, robot_radius_m)
    return GridMemory(settings.rolling, settings.window_m, cell_m, robot_radius_m)
