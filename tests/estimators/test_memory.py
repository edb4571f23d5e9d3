"""What every memory must do with real front ends before it: near walls persist, the robot's own motion is no motion of theirs."""

import math
from itertools import product

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from estimators.belief import FREE, OCCUPIED
from estimators.clearance import ClearanceEstimator, ClearanceSettings
from estimators.grid.depth_grid import DepthGrid, DepthGridSettings
from estimators.grid.grid_filter import GridFilter, GridFilterSettings
from estimators.memory.memory import MemorySettings, memory_of
from tests.estimators.scenes import MS, Floor, Pillar, Wall, frame

CELL_M, RADIUS_M, FRAME_NS, LEAST_M = 0.05, 0.12, 66 * MS, 0.4
KINDS = list(product(["rolling", "layers"], [False, True]))
EVERY_MEMORY = pytest.mark.parametrize(("kind", "filtered"), KINDS, ids=[f"{k}-{'filtered' if f else 'raw'}" for k, f in KINDS])


class Chain:
    """A camera that is blind below its least range, labels, filter, memory, clearance."""

    def __init__(self, kind, filtered, solids):
        self.front_end = DepthGrid(DepthGridSettings(), CELL_M)
        self.filter = GridFilter(GridFilterSettings(), CELL_M) if filtered else None
        self.memory = memory_of(MemorySettings(kind=kind), CELL_M, RADIUS_M)
        self.clearance = ClearanceEstimator(ClearanceSettings())
        self.solids, self.random, self.step = solids, stream(0, "depth"), 0

    def spoil(self, depth):
        spoilt = depth * (1.0 + 0.002 * np.minimum(depth, 9.0) * self.random.normal(size=depth.shape))
        return np.where(depth < LEAST_M, np.inf, spoilt)

    def see(self, pose, steps=1):
        self.step += steps
        now = self.step * FRAME_NS
        seen = self.front_end.label(frame(self.solids, pose, spoil=self.spoil), pose)
        self.memory.merge(self.filter.apply(seen, now) if self.filter else seen, now, pose)
        return self.clearance.update(self.memory.grid, now)

    def at(self, points):
        grid = self.memory.grid
        return grid.label[grid.lattice.cell_of(np.array(points))]


@EVERY_MEMORY
def test_a_wall_nearer_than_the_camera_measures_persists_for_minutes(kind, filtered):
    wall = [Floor(), Wall(0.0, 1.22)]
    chain, front = Chain(kind, filtered, wall), [(1.22, y) for y in np.arange(-0.2, 0.21, CELL_M)]
    for x in np.arange(0.0, 0.95, 0.02):
        chain.see(SE2(float(x)))
        assert (chain.at(front) == OCCUPIED).all()
    for _ in range(40):
        chain.see(SE2(0.95), steps=100)  # four minutes
        assert (chain.at(front) == OCCUPIED).all()


@EVERY_MEMORY
def test_who_turns_away_from_a_near_wall_finds_it_again(kind, filtered):
    """Turning sweeps the edge of the blind zone over the wall."""
    chain, front = Chain(kind, filtered, [Floor(), Wall(0.0, 1.22)]), [(1.22, y) for y in np.arange(-0.2, 0.21, CELL_M)]
    for x in np.arange(0.0, 0.8, 0.02):
        chain.see(SE2(float(x)))
    for yaw in np.concatenate((np.linspace(0.0, 2.0, 40), np.linspace(2.0, 0.0, 40))):
        chain.see(SE2(0.8, 0.0, float(yaw)))
        assert (chain.at(front) == OCCUPIED).all()


@EVERY_MEMORY
def test_an_obstacle_that_left_the_near_field_is_free_when_seen_past(kind, filtered):
    chain = Chain(kind, filtered, [Floor(), Pillar(1.0, 0.0, 0.1), Wall(0.0, 3.0)])
    for _ in range(4):
        chain.see(SE2())
    assert OCCUPIED in chain.at([(0.92, 0.02)])
    chain.solids = [Floor(), Wall(0.0, 3.0)]
    chain.see(SE2())
    assert (chain.at([(0.92, 0.02), (0.97, 0.02)]) == FREE).all()


@EVERY_MEMORY
def test_driving_and_turning_past_walls_hardly_anything_seems_to_move(kind, filtered):
    solids = [Floor(), Wall(math.pi / 2, 0.82), Wall(-math.pi / 2, 0.82), Pillar(2.0, 0.3, 0.1)]
    chain, rates = Chain(kind, filtered, solids), []
    for step in range(40):
        field = chain.see(SE2(0.03 * step, 0.0, 0.3 * math.sin(0.2 * step)))
        rates.append(np.abs(field.rate_m_s[field.overlap & (field.clearance_m < 1.0)]))
    assert np.mean(np.concatenate(rates[8:])) < 0.025
