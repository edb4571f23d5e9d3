"""Registration of a frame of a corridor on the walls known from the frames before, on a robot that drives along it."""

import itertools
from collections.abc import Callable

from drivers.interface.geometry import SE2
from estimators.grid.depth_grid import DepthGrid, DepthGridSettings
from estimators.grid.scan_grid import ScanGridSettings
from estimators.memory.grid_memory import GridMemory, GridMemorySettings
from estimators.registration.registration import ScanRegistration, SurfaceSource
from estimators.registration.registration_settings import RegistrationSettings
from tests.benchmarks.bench_estimators import FRAME_NS, hall, sensed_of

FRAMES = 20


def registration(width: int, height: int) -> Callable[[], object]:
    """Frames of the size, each 3 cm farther along and a little off in heading, so that none agrees with the one before."""
    source = SurfaceSource("depth", DepthGridSettings(), ScanGridSettings())
    one = ScanRegistration(RegistrationSettings(enabled=True), source, SE2())
    one.warm_up()
    frames = [sensed_of(hall(width, height, step), step * FRAME_NS) for step in range(FRAMES)]
    memory = GridMemory(GridMemorySettings(), 6.0, 0.05, 0.12)
    memory.merge(DepthGrid(DepthGridSettings(), 0.05).label(hall(160, 90, 0), SE2()), 0, SE2())
    remembered, steps = memory.remembered, itertools.count()

    def register() -> object:
        step = next(steps)
        pose = SE2(0.03 * (step % FRAMES), 0.0, 0.002 * (step % 3))
        return one.update(frames[step % FRAMES], pose, remembered, step * FRAME_NS)

    return register


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return what is timed, by name."""
    return [("registration_160x90", registration(160, 90)), ("registration_848x480", registration(848, 480))]
