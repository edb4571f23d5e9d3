"""Memory of either kind on a drive past a walker: one frame folded in, then the clearance field with its rate."""

import itertools
from collections.abc import Callable

from drivers.interface.geometry import SE2
from estimators.clearance import ClearanceEstimator, ClearanceSettings
from estimators.depth_grid import DepthGrid, DepthGridSettings
from estimators.memory import Memory, MemorySettings, memory_of
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


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return what is timed, by name."""
    return [
        ("memory_rolling_and_clearance", memory_and_clearance("rolling")),
        ("memory_layers_and_clearance", memory_and_clearance("layers")),
    ]
