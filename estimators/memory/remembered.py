"""What a memory knows of its cells beyond their labels: for those who ask what moves."""

from __future__ import annotations

from dataclasses import dataclass

from estimators.belief import Mask, OccupancyGrid


@dataclass(frozen=True, slots=True)
class Remembered:
    """The grid, which of its occupied cells did not always stand there, and where ground was seen free all around."""

    grid: OccupancyGrid
    came: Mask  # (rows, columns); occupied where it was free lately, and not for long
    open: Mask  # (rows, columns); the cell and its neighbours have been seen free at some time
