"""How good the grid is: compared with the true plan of the floor where the camera looks, frame by frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import SE2
from drivers.interface.samples import DepthFrame, TruthSample
from estimators.belief import OCCUPIED, Belief, OccupancyGrid
from runtime.cycle import Cycle
from runtime.floor_plan import FloorPlan
from sim_drivers.scene import Scene

F64 = NDArray[np.float64]
EVERY = 5  # frames; neighbours hardly differ
RAYS = 120  # across the picture
MARGIN_RAD = 0.05  # the picture's edges are left out: a cell there is seen in part
NEAREST_M = 0.6  # nearer, an obstacle may give no return
TOLERANCE_CELLS = 2  # between a cell and the surface it stands for


@dataclass(frozen=True, slots=True)
class GridFigures:
    """Sums over the frames that were looked at."""

    free_cells: int  # that the camera sees and nothing stands on
    false_cells: int  # of them, occupied in the grid
    surface_points: int  # on what really stands or walks in view, one a line of sight
    missed_points: int  # of them, without an occupied cell near

    def __add__(self, other: GridFigures) -> GridFigures:
        """Return the sums of both."""
        return GridFigures(
            self.free_cells + other.free_cells,
            self.false_cells + other.false_cells,
            self.surface_points + other.surface_points,
            self.missed_points + other.missed_points,
        )


@dataclass(frozen=True, slots=True)
class View:
    """Where the camera of one frame is in the map, and how far it truly sees at each bearing."""

    eye: F64  # (2,)
    bearings: F64  # (RAYS,), ascending [rad], from where the camera looks
    heading: float  # where that is
    sight_m: F64  # (RAYS,)
    reach_m: float

    def clear(self, points: F64, short_m: float) -> NDArray[np.bool_]:
        """Tell which points in the map, shape (n, 2), the camera sees, at least `short_m` before any surface."""
        off = SE2(0.0, 0.0, -self.heading).apply(points - self.eye)
        far, bearing = np.hypot(off[:, 0], off[:, 1]), np.arctan2(off[:, 1], off[:, 0])
        inside = (bearing > self.bearings[0]) & (bearing < self.bearings[-1]) & (far > NEAREST_M) & (far < self.reach_m)
        index = np.clip(np.searchsorted(self.bearings, bearing), 1, len(self.bearings) - 1)
        sight_m = np.minimum(self.sight_m[index - 1], self.sight_m[index])
        return np.asarray(inside & (far < sight_m - short_m))

    @property
    def surface(self) -> F64:
        """The points in the map, shape (n, 2), at which lines of sight end on something."""
        ended = (self.sight_m < self.reach_m) & (self.sight_m > NEAREST_M)
        angle = self.heading + self.bearings[ended]
        return np.asarray(self.eye + self.sight_m[ended, None] * np.stack((np.cos(angle), np.sin(angle)), axis=-1))


class GridScore:
    """Hears every cycle of a run and keeps count."""

    def __init__(self, scene: Scene, range_max_m: float) -> None:
        """Take what really is there, and how far the grid is meant to reach."""
        self._scene, self._range_max_m = scene, range_max_m
        self._frames = 0
        self.figures = GridFigures(0, 0, 0, 0)

    def hear(self, cycle: Cycle) -> None:
        """Score the grid, if a frame made it anew at this tick."""
        frame, truth = cycle.sensed.depth, cycle.sensed.truth
        if frame is None or truth is None:
            return
        self._frames += 1
        if self._frames % EVERY == 0:
            belief = cycle.belief
            plan = self._plan(frame, truth)
            view = self._view(frame, truth, plan, belief.grid.lattice.cell_m)
            self.figures += compare(belief.grid, view, plan, _odom_from_map(truth, belief))

    def _plan(self, frame: DepthFrame, truth: TruthSample) -> FloorPlan:
        """Return what stood where when the frame was taken."""
        ago_s = _ago_s(frame, truth)
        now = {one.name: one for one in truth.obstacles}
        moving = [
            (mover.shape, replace(pose, x=pose.x - ago_s * vx, y=pose.y - ago_s * vy))
            for mover in self._scene.movers
            for pose, (vx, vy) in [(now[mover.name].map_from_obstacle, now[mover.name].velocity_m_s)]
        ]
        return FloorPlan((*((one.shape, one.map_from_shape) for one in self._scene.static), *moving))

    def _view(self, frame: DepthFrame, truth: TruthSample, plan: FloorPlan, cell_m: float) -> View:
        """Return what the camera truly saw, from where the robot was then."""
        k, camera, twist = frame.intrinsics, frame.base_from_optical, truth.twist
        map_from_base = truth.map_from_base.integrate(twist.vx, twist.vy, twist.wz, -_ago_s(frame, truth))
        ahead = camera.rotation @ np.array([0.0, 0.0, 1.0])
        heading = map_from_base.yaw + math.atan2(ahead[1], ahead[0])
        eye = map_from_base.apply(camera.translation[:2])
        low, high = -math.atan2(k.width - 1.0 - k.cx, k.fx) + MARGIN_RAD, math.atan2(k.cx, k.fx) - MARGIN_RAD
        bearings, reach_m = np.linspace(low, high, RAYS), self._range_max_m - TOLERANCE_CELLS * cell_m
        sight_m = plan.sight_m(eye, heading + bearings, reach_m)
        return View(np.asarray(eye), bearings, heading, sight_m, reach_m)


def _ago_s(frame: DepthFrame, truth: TruthSample) -> float:
    return (truth.stamp.captured_ns - frame.stamp.captured_ns) * 1e-9


def _odom_from_map(truth: TruthSample, belief: Belief) -> SE2:
    """Return where the map is in odom as the robot has it: what odometry is off by must not count against the grid."""
    return belief.odom_from_base @ truth.map_from_base.inverse()


def compare(grid: OccupancyGrid, view: View, plan: FloorPlan, odom_from_map: SE2) -> GridFigures:
    """Return how a grid differs from the true plan in view."""
    lattice, occupied = grid.lattice, grid.label == OCCUPIED
    tolerance_m = TOLERANCE_CELLS * lattice.cell_m
    rows, columns = np.indices(occupied.shape).reshape(2, -1)
    centres = odom_from_map.inverse().apply(lattice.centres(rows, columns))
    near = np.hypot(*(centres - view.eye).T) < view.reach_m
    rows, columns, centres = rows[near], columns[near], centres[near]
    free = view.clear(centres, tolerance_m) & (plan.distance_m(centres) > tolerance_m)
    surface = odom_from_map.apply(view.surface)
    marks = lattice.centres(*np.nonzero(occupied))
    apart = np.abs(surface[:, None] - marks[None]).max(axis=2).min(axis=1, initial=np.inf)  # (points,)
    missed = apart > (TOLERANCE_CELLS + 0.5) * lattice.cell_m
    return GridFigures(int(free.sum()), int(occupied[rows, columns][free].sum()), len(surface), int(missed.sum()))
