"""A corridor with a side passage, seen by a camera that no wall is transparent to, and a walker who comes out of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from estimators.belief import FREE, OCCUPIED, UNKNOWN, Belief, ClearanceField, Lattice, OccupancyGrid
from estimators.clearance import distance_to
from planners.router import RouterSetup
from planners.routers.straight import StraightRouter
from planners.shield import ShieldSetup
from planners.shields.field_cbf import FieldCbf
from tests.planners.synthetic import OMNI, Box, Disc, command_of, mission_to, reachable_from

PERIOD_S, RADIUS_M, WALKER_M = 0.1, 0.12, 0.25
LATTICE = Lattice(-1.5, -4.0, 0.1, 80, 75)
GOAL = (4.5, 0.0)


@dataclass(frozen=True)
class Corner:
    """A corridor along x with a passage to the right, and one to the left if `both`."""

    x_m: float = 2.0  # where it opens
    width_m: float = 0.8
    half_width_m: float = 1.0
    both: bool = False

    def walls(self):
        h, x0, x1 = self.half_width_m, self.x_m, self.x_m + self.width_m
        return [
            wall
            for side in (-1.0, 1.0)
            for wall in (
                (_box(-1.5, side * h, x0, side * (h + 4.0)), _box(x1, side * h, 6.0, side * (h + 4.0)))
                if side < 0.0 or self.both
                else (_box(-1.5, h, 6.0, h + 1.0),)
            )
        ]


def _box(x0, y0, x1, y1):
    return Box(x0, min(y0, y1), x1, max(y0, y1))


class Eyes:
    """What has been seen of a still world, and what is seen of a walker now."""

    def __init__(self, corner, fov_deg=87.0, range_m=2.5):
        at = LATTICE
        rows, columns = np.divmod(np.arange(at.rows * at.columns), at.columns)
        self._x, self._y = at.centres(rows, columns).T
        self._solid = np.min([w.distance(self._x, self._y) for w in corner.walls()], axis=0) <= 0.0
        self._seen = np.hypot(self._x, self._y) < 0.25
        self._half, self._range = math.radians(0.5 * fov_deg), range_m
        self._part = np.linspace(0.0, 0.97, 40)

    def _in_view(self, pose, solid):
        dx, dy = self._x - pose.x, self._y - pose.y
        bearing = np.arctan2(dy, dx) - pose.yaw
        cone = (np.abs(np.arctan2(np.sin(bearing), np.cos(bearing))) < self._half) & (np.hypot(dx, dy) < self._range)
        chosen = np.flatnonzero(cone)
        x = pose.x + np.outer(dx[chosen], self._part)
        y = pose.y + np.outer(dy[chosen], self._part)
        column, row = ((x - LATTICE.x_m) / LATTICE.cell_m).astype(int), ((y - LATTICE.y_m) / LATTICE.cell_m).astype(int)
        index = np.clip(row, 0, LATTICE.rows - 1) * LATTICE.columns + np.clip(column, 0, LATTICE.columns - 1)
        view = np.zeros(len(dx), bool)
        view[chosen] = ~(solid[index] & (index != chosen[:, None])).any(axis=1)
        return view

    def look(self, tick, pose, twist, walker):
        body = walker.distance(self._x, self._y) <= 0.0
        view = self._in_view(pose, self._solid | body)
        self._seen |= view
        there = body & view
        shape = (LATTICE.rows, LATTICE.columns)
        label = np.where((self._solid & self._seen) | there, OCCUPIED, np.where(self._seen, FREE, UNKNOWN)).astype(np.uint8)
        grid = OccupancyGrid(LATTICE, label.reshape(shape))
        clearance = distance_to(grid.label == OCCUPIED, LATTICE.cell_m)
        apart = walker.distance(self._x, self._y)
        moving = there.any() & (np.abs(clearance.ravel() - apart) < 0.15)
        rate = np.where(moving, walker.rate(self._x, self._y), 0.0).astype(np.float32).reshape(shape)
        known = grid.label != UNKNOWN
        field = ClearanceField(LATTICE, clearance, rate, known, known)
        stamp_ns = round(tick * PERIOD_S * 1e9)
        return Belief(tick, stamp_ns, pose, SE2(), twist, np.zeros((3, 3)), grid, field, (), None, stamp_ns)


def meet(planner, corner, speed_m_s, meet_s, *, fov_deg=87.0, duration_s=25.0):
    """Drive past the corner while a walker crosses the corridor's middle at `meet_s`.

    Returns the least distance between their surfaces [m], and when the goal was reached [s], inf if it was not.
    """
    router = StraightRouter(StraightRouter.Settings(), RouterSetup(PERIOD_S, RADIUS_M))
    shield = FieldCbf(FieldCbf.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, OMNI))
    eyes, pose, twist, least = Eyes(corner, fov_deg), SE2(), BodyTwist(), math.inf
    mission, x = mission_to(*GOAL), corner.x_m + 0.5 * corner.width_m
    for tick in range(round(duration_s / PERIOD_S)):
        walker = Disc(x, speed_m_s * (tick * PERIOD_S - meet_s), WALKER_M, 0.0, speed_m_s)
        least = min(least, float(walker.distance(pose.x, pose.y)) - RADIUS_M)
        if math.hypot(pose.x - GOAL[0], pose.y - GOAL[1]) < 0.3:
            return least, tick * PERIOD_S
        belief = eyes.look(tick, pose, twist, walker)
        plan = planner.plan(belief, router.route(belief, mission))
        reachable = reachable_from(twist, OMNI, PERIOD_S)
        twist = shield.filter(command_of(reachable.clip(plan.base)), belief, reachable).command.base
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, PERIOD_S)
    return least, math.inf
