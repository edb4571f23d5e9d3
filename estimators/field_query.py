"""Reading a field between its cells: bilinear value and gradient at points in odom.

A field holds one value per cell of a `Lattice`, valid at the cell's centre.  Outside the centres of the border cells the
field goes on as it is at the border (the point is clamped), so that value and gradient are finite everywhere.  A NaN
coordinate reads the lower border; callers check for NaN where it can occur.

`bilinear` and `bilinear_gradient` are for use inside other numba kernels: the lattice comes as its numbers
(`x_m`, `y_m`, `cell_m`, in this order), then the point.  `sample` and `gradient` take arrays of points.  numba compiles anew for
read-only arrays, as those of a `Belief` are: warm up with such.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import F64, Lattice

Field = NDArray[Any]  # (rows, columns), any real dtype


@kernel()
def _corner(coordinate: float, last: int) -> tuple[int, float]:
    """Return the lower neighbour and the weight of the upper one, clamped to centres 0 to `last`."""
    clamped = coordinate if coordinate > 0.0 else 0.0
    clamped = min(clamped, float(last))
    lower = min(int(clamped), max(last - 1, 0))
    return lower, clamped - lower


@kernel()
def bilinear(field: Field, x_m: float, y_m: float, cell_m: float, x: float, y: float) -> float:
    """Return the field's value at (x, y) [m]; (x_m, y_m) is the lattice's lower corner."""
    last_row, last_column = field.shape[0] - 1, field.shape[1] - 1
    column, u = _corner((x - x_m) / cell_m - 0.5, last_column)
    row, v = _corner((y - y_m) / cell_m - 0.5, last_row)
    right, above = min(column + 1, last_column), min(row + 1, last_row)
    below_value = (1.0 - u) * field[row, column] + u * field[row, right]
    above_value = (1.0 - u) * field[above, column] + u * field[above, right]
    value: float = (1.0 - v) * below_value + v * above_value
    return value


@kernel()
def bilinear_gradient(field: Field, x_m: float, y_m: float, cell_m: float, x: float, y: float) -> tuple[float, float, float]:
    """Return value, d/dx and d/dy [per metre] at (x, y); a component is zero where the point is clamped along it."""
    last_row, last_column = field.shape[0] - 1, field.shape[1] - 1
    along_x, along_y = (x - x_m) / cell_m - 0.5, (y - y_m) / cell_m - 0.5
    column, u = _corner(along_x, last_column)
    row, v = _corner(along_y, last_row)
    right, above = min(column + 1, last_column), min(row + 1, last_row)
    f00, f01, f10, f11 = field[row, column], field[row, right], field[above, column], field[above, right]
    value = (1.0 - v) * ((1.0 - u) * f00 + u * f01) + v * ((1.0 - u) * f10 + u * f11)
    inside_x, inside_y = 0.0 <= along_x <= last_column, 0.0 <= along_y <= last_row
    dx = ((1.0 - v) * (f01 - f00) + v * (f11 - f10)) / cell_m if inside_x else 0.0
    dy = ((1.0 - u) * (f10 - f00) + u * (f11 - f01)) / cell_m if inside_y else 0.0
    return value, dx, dy


@kernel()
def _sample(field: Field, x_m: float, y_m: float, cell_m: float, points: F64) -> F64:
    values = np.empty(len(points))
    for i in range(len(points)):
        values[i] = bilinear(field, x_m, y_m, cell_m, points[i, 0], points[i, 1])
    return values


@kernel()
def _gradient(field: Field, x_m: float, y_m: float, cell_m: float, points: F64) -> F64:
    slopes = np.empty((len(points), 2))
    for i in range(len(points)):
        _, slopes[i, 0], slopes[i, 1] = bilinear_gradient(field, x_m, y_m, cell_m, points[i, 0], points[i, 1])
    return slopes


def sample(field: Field, lattice: Lattice, points: F64) -> F64:
    """Return the field's values, shape (n,), at points in odom, shape (n, 2).

    >>> plane = np.arange(4.0) * np.ones((3, 1))  # rises by 1 per cell of 0.5 m along x
    >>> sample(plane, Lattice(0.0, 0.0, 0.5, 3, 4), np.array([[1.0, 0.6], [9.0, 0.6]])).tolist()
    [1.5, 3.0]
    """
    values: F64 = _sample(field, lattice.x_m, lattice.y_m, lattice.cell_m, points)
    return values


def gradient(field: Field, lattice: Lattice, points: F64) -> F64:
    """Return the field's gradients (d/dx, d/dy) [per metre], shape (n, 2), at points in odom, shape (n, 2).

    >>> plane = np.arange(4.0) * np.ones((3, 1))
    >>> gradient(plane, Lattice(0.0, 0.0, 0.5, 3, 4), np.array([[1.0, 0.6], [9.0, 0.6]])).tolist()
    [[2.0, 0.0], [0.0, 0.0]]
    """
    slopes: F64 = _gradient(field, lattice.x_m, lattice.y_m, lattice.cell_m, points)
    return slopes
