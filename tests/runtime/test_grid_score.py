"""The judge of grids, on a room whose answers are known."""

import math

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from estimators.belief import FREE, OCCUPIED, Lattice, OccupancyGrid
from runtime.evaluations.grid_score import GridFigures, View, compare
from runtime.floor_plan import FloorPlan
from sim_drivers.scene import Shape

CELL_M, REACH_M, ORIGIN = 0.05, 2.4, SE2()
PILLAR = (Shape.cylinder(0.2, 1.0), SE2(1.5, 0.0))
WALL = (Shape.box(0.1, 6.0, 1.0), SE2(2.15, 0.0))
PLAN = FloorPlan((PILLAR, WALL))
LATTICE = Lattice(-3.0, -3.0, CELL_M, 120, 120)


def view(plan=PLAN, heading=0.0):
    bearings = np.linspace(-0.7, 0.7, 120)
    return View(np.zeros(2), bearings, heading, plan.sight_m(np.zeros(2), heading + bearings, REACH_M), REACH_M)


def true_grid(odom_from_map=ORIGIN):
    """Occupied where something stands, to half a cell."""
    rows, columns = np.indices((LATTICE.rows, LATTICE.columns)).reshape(2, -1)
    distance_m = PLAN.distance_m(odom_from_map.inverse().apply(LATTICE.centres(rows, columns)))
    label = np.where(distance_m < 0.5 * CELL_M, OCCUPIED, FREE).astype(np.uint8)
    return label.reshape(LATTICE.rows, LATTICE.columns)


def test_distances_and_lines_of_sight_are_those_of_plain_geometry():
    points = np.array([[0.0, 0.0], [1.5, 0.1], [2.15, 0.0], [1.0, 2.0], [2.0, 4.0]])
    expected = [1.3, -0.1, -0.05, 1.1, math.hypot(0.1, 1.0)]
    np.testing.assert_allclose(PLAN.distance_m(points), expected, atol=1e-12)
    bearings = np.array([0.0, 0.1, 0.3, 0.6])
    along = 1.5 * math.cos(0.1) - math.sqrt(0.2**2 - (1.5 * math.sin(0.1)) ** 2)
    np.testing.assert_allclose(
        PLAN.sight_m(np.zeros(2), bearings, REACH_M), [1.3, along, 2.1 / math.cos(0.3), REACH_M], atol=0.01
    )


@pytest.mark.parametrize("turned", [SE2(), SE2(0.1, -0.2, 0.4)])
def test_the_true_grid_has_no_fault_wherever_odom_lies(turned):
    figures = compare(OccupancyGrid(LATTICE, true_grid(turned)), view(), PLAN, turned)
    assert (figures.false_cells, figures.missed_points) == (0, 0)
    assert figures.free_cells > 500
    assert figures.surface_points > 70


def test_a_false_cell_counts_only_in_view():
    label = true_grid()
    for x, y in ((1.0, 0.1), (1.9, 0.0), (-1.0, 0.0), (1.0, 2.0), (0.3, 0.0)):  # in view; hidden; behind; beside; too near
        row, column = LATTICE.cell_of(np.array([[x + 0.01, y + 0.01]]))
        label[row, column] = OCCUPIED
    figures = compare(OccupancyGrid(LATTICE, label), view(), PLAN, SE2())
    assert figures.false_cells == 1


def test_a_pillar_that_the_grid_does_not_show_is_missed_where_it_is_seen():
    label = true_grid()
    rows, columns = LATTICE.cell_of(np.array([[1.2, -0.35], [1.75, 0.35]]))
    label[rows[0] : rows[1], columns[0] : columns[1]] = FREE
    seen, half = view(), math.asin(0.2 / 1.5)
    on_pillar = int((np.abs(seen.bearings) < half).sum())
    figures = compare(OccupancyGrid(LATTICE, label), seen, PLAN, SE2())
    assert figures.missed_points == pytest.approx(on_pillar, abs=2)


def test_figures_add_up():
    assert GridFigures(1, 2, 3, 4) + GridFigures(10, 20, 30, 40) == GridFigures(11, 22, 33, 44)
