"""Lattices that follow the robot by whole cells, and values moved from one such lattice to another."""

from __future__ import annotations

import math
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2
from estimators.belief import Lattice

Scalar = TypeVar("Scalar", bound=np.generic)


def lattice_around(x: float, y: float, cell_m: float, rows: int, columns: int) -> Lattice:
    """Return the lattice whose middle cell holds the point (x, y) of odom.

    >>> lattice_around(0.26, -0.01, 0.1, 5, 5)
    Lattice(x_m=0.0, y_m=-0.30000000000000004, cell_m=0.1, rows=5, columns=5)
    """
    column, row = math.floor(x / cell_m) - columns // 2, math.floor(y / cell_m) - rows // 2
    return Lattice(column * cell_m, row * cell_m, cell_m, rows, columns)


def cells_between(source: Lattice, target: Lattice) -> tuple[int, int]:
    """Return by how many rows and columns the target's corner lies above and right of the source's."""
    return round((target.y_m - source.y_m) / source.cell_m), round((target.x_m - source.x_m) / source.cell_m)


def transfer(values: NDArray[Scalar], source: Lattice, target: Lattice, fill: Any) -> NDArray[Scalar]:
    """Return the source's values, shape (rows, columns), on the target lattice; `fill` where the source does not reach.

    Always a new array; nothing is interpolated, both lattices lie on the same cells.
    """
    moved = np.full((target.rows, target.columns), fill, dtype=values.dtype)
    up, right = cells_between(source, target)
    rows = max(0, up), min(source.rows, up + target.rows)
    columns = max(0, right), min(source.columns, right + target.columns)
    if rows[0] < rows[1] and columns[0] < columns[1]:
        moved[rows[0] - up : rows[1] - up, columns[0] - right : columns[1] - right] = values[slice(*rows), slice(*columns)]
    return moved


def strays(window: Lattice, odom_from_base: SE2) -> bool:
    """Tell whether a robot is more than a quarter of the square window away from its middle."""
    half = 0.5 * window.rows * window.cell_m
    x, y = window.x_m + half, window.y_m + half
    return max(abs(odom_from_base.x - x), abs(odom_from_base.y - y)) > 0.5 * half
