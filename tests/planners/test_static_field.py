"""What stands still near the robot is what stands still on the whole grid."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from drivers.interface.samples import frozen_array
from estimators.belief import OCCUPIED, Track
from estimators.clearance import distance_to
from planners.routers.grid_costs import GridCosts, cost_grid
from planners.static_field import near_distance, static_clearance, surroundings
from tests.planners.synthetic import Box, Disc, belief_of


@pytest.mark.parametrize("shape", [(40, 50), (3, 60), (1, 1)])
@pytest.mark.parametrize("share", [0.003, 0.1, 1.0])
def test_near_distances_are_those_of_the_whole_transform_up_to_their_bound(shape, share):
    occupied = np.random.default_rng(5).random(shape) < share
    occupied[0, 0] = True
    exact, near = distance_to(occupied, 0.05), near_distance(occupied, 9, 0.05)
    within = exact < 9 * 0.05
    assert np.array_equal(near[within], exact[within])
    assert (near[~within] >= 9 * 0.05 - 1e-6).all()


@pytest.mark.parametrize("pose", [SE2(), SE2(2.9, -2.9, 0.0), SE2(40.0, 0.0, 0.0)], ids=["middle", "corner", "off the grid"])
@pytest.mark.parametrize("tracked", [True, False])
def test_the_surroundings_are_a_window_of_the_whole(pose, tracked):
    """Cells of a disc that is tracked count in neither; where it matters the two are the same to the bit."""
    walking = Disc(0.8, 0.1, 0.25)
    belief = belief_of((Box(-0.9, -0.5, -0.7, 0.5), Box(2.0, -2.8, 2.2, -2.0), walking), SE2())
    track = Track(0, (walking.x, walking.y), (0.5, 0.0), walking.radius, frozen_array(np.zeros((4, 4))))
    belief = replace(belief, odom_from_base=pose, tracks=(track,) if tracked else ())
    near, whole, lattice = surroundings(belief, 0.1, 0.8, 0.5), static_clearance(belief, 0.1, 9.0), belief.grid.lattice
    row, column = (round((a - b) / lattice.cell_m) for a, b in ((near.lattice.y_m, lattice.y_m), (near.lattice.x_m, lattice.x_m)))
    window = np.s_[row : row + near.lattice.rows, column : column + near.lattice.columns]
    assert np.array_equal(near.label, belief.grid.label[window])
    x, y = (near.lattice.centres(*np.indices(near.label.shape).reshape(2, -1))).T
    reached = (np.hypot(x - pose.x, y - pose.y) <= 0.8).reshape(near.label.shape)
    assert reached.any() or pose.x > 10.0
    assert np.minimum(near.clearance_m, 0.5)[reached] == pytest.approx(np.minimum(whole[window], 0.5)[reached], abs=1e-7)


def test_the_router_passes_what_is_tracked_as_if_it_were_not_there():
    walls, walking = (Box(-0.9, -0.5, -0.7, 0.5), Box(2.0, -2.8, 2.2, -2.0)), Disc(0.8, 0.1, 0.25)
    track = Track(0, (walking.x, walking.y), (0.5, 0.0), walking.radius, frozen_array(np.zeros((4, 4))))
    passed, bare = replace(belief_of((*walls, walking), SE2()), tracks=(track,)), belief_of(walls, SE2())
    whole = distance_to(bare.grid.label == OCCUPIED, bare.grid.lattice.cell_m)
    bare = replace(bare, clearance=replace(bare.clearance, clearance_m=frozen_array(whole)))
    costs = cost_grid(passed, GridCosts(through_movers=True), 0.2).cost
    assert np.array_equal(costs, cost_grid(bare, GridCosts(), 0.2).cost)
    assert not np.array_equal(costs, cost_grid(passed, GridCosts(), 0.2).cost)
