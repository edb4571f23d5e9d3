"""The estimator's parts on a frame of a hall with noise: depth to labels, clearance with its rate, a whole update."""

import itertools
import math
from collections.abc import Callable

import numpy as np

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2, SE3
from drivers.interface.mission import Mission
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp, frozen_array
from drivers.interface.seeds import stream
from drivers.interface.sensed import Sensed, Tick
from estimators.clearance import ClearanceEstimator, ClearanceSettings
from estimators.estimator import EstimatorSetup
from estimators.grid.depth_grid import DepthGrid, DepthGridSettings
from estimators.standard import StandardEstimator, StandardSettings

BASE_FROM_OPTICAL = SE3(0.1, 0.0, 0.4) @ BODY_FROM_OPTICAL
FRAME_NS = 66_000_000


def hall(width: int, height: int, step: int) -> DepthFrame:
    """A frame of a D455 in a hall 2 m wide, with an end wall and a walker that is `step` frames on its way."""
    fx, fy, cx, cy = 434.27 * width / 848, 434.27 * height / 480, 431.77 * width / 848, 240.45 * height / 480
    u, v = np.meshgrid((np.arange(width) - cx) / fx, (np.arange(height) - cy) / fy)
    with np.errstate(divide="ignore"):
        depth = np.minimum(np.minimum(1.0 / np.abs(u), 0.4 / np.maximum(v, 1e-9)), 5.0)
    walker = 2.2 - 0.05 * (step % 20)
    depth = np.where(np.abs(u - 0.1) < 0.15 / walker, np.minimum(depth, walker), depth)
    random = stream(step, "hall")
    depth = depth * (1.0 + 0.004 * random.normal(size=depth.shape))
    depth[random.random(depth.shape) < 0.02] = 0.0
    image = frozen_array(np.round(depth * 1000.0).astype(np.uint16))
    stamp = Stamp(step * FRAME_NS, step * FRAME_NS, step)
    return DepthFrame(stamp, image, 0.001, Intrinsics(width, height, fx, fy, cx, cy), BASE_FROM_OPTICAL)


def estimator() -> StandardEstimator:
    """An estimator that stands still, warmed up."""
    setup = EstimatorSetup(period_s=0.05, robot_radius_m=0.12, map_from_start=SE2(), kinematics=None)
    standard = StandardEstimator(StandardSettings(), setup)
    standard.warm_up()
    return standard


def sensed_of(frame: DepthFrame, start_ns: int) -> Sensed:
    """A tick that got only this frame."""
    return Sensed(Tick(0, start_ns, FRAME_NS), frame, (), (), (), (), (), None, (), Mission(SE2(), ()))


def depth_to_grid() -> Callable[[], object]:
    """848x480 to labels; the pose changes so that no two calls draw the same lines."""
    grid, frame = DepthGrid(DepthGridSettings(), 0.05), hall(848, 480, 3)
    grid.warm_up()
    poses = itertools.cycle([SE2(0.013 * i, 0.007 * i, math.radians(9 * i)) for i in range(40)])
    return lambda: grid.label(frame, next(poses))


def clearance_field() -> Callable[[], object]:
    """Field, overlap and smoothed rate over successive frames of a 120x120 grid."""
    standard, clearance = estimator(), ClearanceEstimator(ClearanceSettings())
    grids = [standard.update(sensed_of(hall(160, 90, step), step * FRAME_NS)).grid for step in range(20)]
    steps = itertools.count()
    return lambda: _clearance_step(clearance, grids, next(steps))


def _clearance_step(clearance: ClearanceEstimator, grids: list, step: int) -> object:
    return clearance.update(grids[step % len(grids)], step * FRAME_NS)


def estimator_update() -> Callable[[], object]:
    """A whole update, each with a new frame of 160x90."""
    standard, frames, steps = estimator(), [hall(160, 90, step) for step in range(20)], itertools.count(1)
    return lambda: _update(standard, frames, next(steps))


def _update(standard: StandardEstimator, frames: list[DepthFrame], step: int) -> object:
    seen, now = frames[step % len(frames)], step * FRAME_NS
    stamped = DepthFrame(Stamp(now, now, step), seen.depth, seen.depth_unit_m, seen.intrinsics, seen.base_from_optical)
    return standard.update(sensed_of(stamped, now))


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return what is timed, by name."""
    return [
        ("depth_to_grid_848x480", depth_to_grid()),
        ("clearance_field_120x120", clearance_field()),
        ("estimator_update_160x90", estimator_update()),
    ]
