"""Memory of either kind with the clearance field on a drive past a walker, and tracks of ten who move."""

import itertools
import math
from collections.abc import Callable

import numpy as np

from drivers.interface.geometry import SE2
from estimators.belief import OCCUPIED, UNKNOWN, Lattice, OccupancyGrid, Track
from estimators.clearance import ClearanceEstimator, ClearanceSettings
from estimators.grid.depth_grid import DepthGrid, DepthGridSettings
from estimators.grid.labelling import FrameLabels
from estimators.memory.memory import Memory, MemorySettings, memory_of
from estimators.memory.remembered import Remembered
from estimators.memory.rolling import lattice_around
from estimators.tracks.tracking import GridTracker, TrackingSettings
from tests.benchmarks.bench_estimators import FRAME_NS, hall

CELL_M, RADIUS_M = 0.05, 0.12


def memory_and_clearance(kind: str) -> Callable[[], object]:
    """Frames of 160x90 on a window of 6 m that rolls along by half a cell a frame."""
    memory, clearance = memory_of(MemorySettings(kind=kind), CELL_M, RADIUS_M), ClearanceEstimator(ClearanceSettings())
    front_end = DepthGrid(DepthGridSettings(), CELL_M)
    poses = [SE2(0.025 * step) for step in range(20)]
    frames = [front_end.label(hall(160, 90, step), pose) for step, pose in enumerate(poses)]
    steps = itertools.count(1)
    return lambda: _fold(memory, clearance, frames, poses, next(steps))


def _fold(memory: Memory, clearance: ClearanceEstimator, frames: list, poses: list[SE2], step: int) -> object:
    memory.merge(frames[step % len(frames)], step * FRAME_NS, poses[step % len(poses)])
    return clearance.update(memory.grid, step * FRAME_NS)


def ten_tracks() -> Callable[[], object]:
    """Ten discs that go to and fro in view: found, assigned, filtered and given out."""
    tracker, lattice, empty = (
        GridTracker(TrackingSettings()),
        lattice_around(0.0, 0.0, CELL_M, 103, 103),
        np.zeros((103, 103), bool),
    )
    frames = [_discs(lattice, 0.4 * math.sin(0.1 * math.pi * step)) for step in range(20)]
    steps = itertools.count(1)
    follow = lambda: _follow(tracker, frames, empty, next(steps))  # noqa: E731 - shared with the check below
    for _ in range(20):
        tracks = follow()
    assert len(tracks) == 10
    return follow


def _discs(lattice: Lattice, shift_m: float) -> OccupancyGrid:
    """The sides of ten discs of 0.15 m that face the middle, each on its own place of a ring."""
    label = np.full((lattice.rows, lattice.columns), UNKNOWN, dtype=np.uint8)
    for one in range(10):
        bearing = 0.2 * math.pi * one + 0.25 * shift_m
        angles = bearing + np.linspace(0.6, 1.4, 200) * math.pi
        centre = 1.6 * np.array([math.cos(bearing), math.sin(bearing)])
        label[lattice.cell_of(centre + 0.15 * np.stack((np.cos(angles), np.sin(angles)), axis=1))] = OCCUPIED
    return OccupancyGrid(lattice, label)


def _follow(tracker: GridTracker, frames: list[OccupancyGrid], empty: np.ndarray, step: int) -> tuple[Track, ...]:
    grid = frames[step % len(frames)]
    tracker.update(FrameLabels(grid, empty), Remembered(grid, grid.label == OCCUPIED, ~empty), step * FRAME_NS)
    return tracker.tracks_at(step * FRAME_NS)


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return what is timed, by name."""
    return [
        ("memory_rolling_and_clearance", memory_and_clearance("rolling")),
        ("memory_layers_and_clearance", memory_and_clearance("layers")),
        ("tracks_10_obstacles", ten_tracks()),
    ]
