"""Bilinear reading of fields: exact on planes, slopes against differences, clamped outside."""

import numpy as np
import pytest

from drivers.interface.seeds import stream
from estimators.belief import Lattice
from estimators.field_query import bilinear, bilinear_gradient, gradient, sample

LATTICE = Lattice(-1.2, 0.35, 0.05, 40, 60)


def _centres() -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.indices((LATTICE.rows, LATTICE.columns))
    xy = LATTICE.centres(rows.ravel(), columns.ravel()).reshape(LATTICE.rows, LATTICE.columns, 2)
    return xy[..., 0], xy[..., 1]


def _inner_points(count: int) -> np.ndarray:
    unit = stream(1, "points").random((count, 2))
    return np.array([-1.15, 0.4]) + unit * np.array([2.85, 1.85])


def test_a_plane_is_read_exactly() -> None:
    x, y = _centres()
    points = _inner_points(200)
    field = 2.0 * x - 3.0 * y + 0.5
    np.testing.assert_allclose(sample(field, LATTICE, points), points @ [2.0, -3.0] + 0.5, atol=1e-12)
    np.testing.assert_allclose(gradient(field, LATTICE, points), np.tile([2.0, -3.0], (200, 1)), atol=1e-10)


def test_the_gradient_is_the_slope_of_the_value() -> None:
    field = stream(2, "field").random((LATTICE.rows, LATTICE.columns)).astype(np.float32)
    x_m, y_m, cell_m, step = LATTICE.x_m, LATTICE.y_m, LATTICE.cell_m, 1e-7
    for x, y in _inner_points(50):
        value, dx, dy = bilinear_gradient(field, x_m, y_m, cell_m, x, y)
        assert value == pytest.approx(bilinear(field, x_m, y_m, cell_m, x, y))
        ahead = bilinear(field, x_m, y_m, cell_m, x + step, y), bilinear(field, x_m, y_m, cell_m, x, y + step)
        assert (dx, dy) == pytest.approx(((ahead[0] - value) / step, (ahead[1] - value) / step), abs=1e-5)


def test_outside_the_border_goes_on() -> None:
    field = stream(3, "field").random((LATTICE.rows, LATTICE.columns))
    far = np.array([[-100.0, -100.0], [100.0, 100.0], [-100.0, 100.0]])
    assert sample(field, LATTICE, far).tolist() == [field[0, 0], field[-1, -1], field[-1, 0]]
    assert not gradient(field, LATTICE, far).any()


def test_nan_and_a_single_cell_stay_inside_memory() -> None:
    one = np.array([[7.0]])
    lattice = Lattice(0.0, 0.0, 0.05, 1, 1)
    assert sample(one, lattice, np.array([[np.nan, 0.3], [0.01, 0.02], [np.inf, -np.inf]])).tolist() == [7.0, 7.0, 7.0]
