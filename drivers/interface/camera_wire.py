"""How an emulated camera's frames and motion cross to another process: shared memory under a name in /dev/shm.

The writer stands in for what is plugged in: a name that exists is a device on the bus, one that was taken away is unplugged.
Stamps are the device's own clock, a counter of microseconds in 32 bits, as a D400's is.
"""

from __future__ import annotations

import fcntl
import mmap
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.interface.frame_slot import FrameSlot
from drivers.interface.samples import Intrinsics
from drivers.interface.shared_memory import Block
from drivers.interface.shared_ring import SharedRing

FOLDER = Path("/dev/shm")
COUNTER_US = 2**32  # where the device's clock begins anew
LARGEST = 1280 * 720  # pixels
FRAME = np.dtype([("number", "i8"), ("device_us", "i8"), ("width", "i4"), ("height", "i4")])
PINHOLE = np.dtype([("width", "i4"), ("height", "i4"), ("fx", "f8"), ("fy", "f8"), ("cx", "f8"), ("cy", "f8"), ("unit_m", "f8")])
MOTION = np.dtype([("number", "i8"), ("device_us", "i8"), ("gyro_rad_s", "f8", (3,)), ("accel_m_s2", "f8", (3,))])


def path_of(name: str, part: str) -> Path:
    """Return where a part ("depth" or "motion") of an emulated camera is."""
    return FOLDER / f"trundle-{name}.{part}"


@dataclass(frozen=True, slots=True)
class Lens:
    """What a stream looks through: its intrinsics, and how much one count of depth is."""

    intrinsics: Intrinsics
    depth_unit_m: float


class DepthWire:
    """Depth at its decimated size, and the lens of the whole stream."""

    def __init__(self, buffer: mmap.mmap | None) -> None:
        """Lay the parts out."""
        block = Block(buffer)
        self.plugged = block.words(1)
        self._lens = block.array(PINHOLE, 1)
        self.frames = FrameSlot(block, FRAME, 2 * LARGEST)
        self.size = block.size

    @property
    def lens(self) -> Lens:
        """What the stream looks through."""
        width, height, fx, fy, cx, cy, unit_m = self._lens[0].item()
        return Lens(Intrinsics(width, height, fx, fy, cx, cy), unit_m)

    @lens.setter
    def lens(self, lens: Lens) -> None:
        k = lens.intrinsics
        self._lens[0] = (k.width, k.height, k.fx, k.fy, k.cx, k.cy, lens.depth_unit_m)

    def put(self, number: int, device_us: int, depth: NDArray[np.uint16]) -> None:
        """Send an image (height, width)."""
        self.frames.put((number, device_us, depth.shape[1], depth.shape[0]), depth)


class MotionWire:
    """Rates and specific force, in the axes of the optical frame."""

    def __init__(self, buffer: mmap.mmap | None) -> None:
        """Lay the parts out."""
        block = Block(buffer)
        self.plugged = block.words(1)
        self.samples = SharedRing(block, MOTION, 512)
        self.size = block.size


class Wire(Protocol):
    """A part of a camera, laid out in memory."""

    plugged: memoryview  # (1,); 1 while it is on the bus
    size: int

    def __init__(self, buffer: mmap.mmap | None) -> None:
        """Lay the parts out; without a buffer only their size is of interest."""


W = TypeVar("W", bound=Wire)


class Plug(Generic[W]):
    """The writer's end."""

    def __init__(self, kind: type[W], path: Path) -> None:
        """Put the device on the bus.

        Raises:
            OSError: it cannot be put there; `BlockingIOError`: another process has one of that name.
        """
        self._path = path
        stale = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(stale, fcntl.LOCK_EX | fcntl.LOCK_NB)  # held by whoever lives; a killed writer's is free
            path.unlink()  # and is not written again: someone may still look at it
        finally:
            os.close(stale)
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        size = kind(None).size
        os.ftruncate(self._file, size)
        self.wire: W = kind(mmap.mmap(self._file, size))
        self.wire.plugged[0] = 1

    def pull(self) -> None:
        """Take it off."""
        self.wire.plugged[0] = 0
        with suppress(FileNotFoundError):
            self._path.unlink()
        os.close(self._file)


def attach(kind: type[W], path: Path) -> W:
    """Return the reader's end.

    Raises:
        OSError: nothing is there.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        size = kind(None).size
        if os.fstat(descriptor).st_size < size:
            raise FileNotFoundError(f"{path} is being made")
        return kind(mmap.mmap(descriptor, size, access=mmap.ACCESS_READ))
    finally:
        os.close(descriptor)
