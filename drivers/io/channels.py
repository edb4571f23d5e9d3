"""All that the loop and the process at the wire share, laid out in one piece of memory."""

from __future__ import annotations

import mmap
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.interface.frame_slot import FrameSlot
from drivers.interface.shared_memory import Block
from drivers.interface.shared_ring import SharedRing
from drivers.io.command_slot import CommandSlot
from drivers.io.health import HealthBlock


@dataclass(frozen=True, slots=True)
class RingSpec:
    """A ring of samples."""

    name: str
    dtype: np.dtype[Any]
    capacity: int


@dataclass(frozen=True, slots=True)
class FrameSpec:
    """A slot for large frames, each with a record about it."""

    name: str
    meta: np.dtype[Any]
    capacity_bytes: int


@dataclass(frozen=True, slots=True)
class MemorySpec:
    """What a device shares with its process."""

    rings: tuple[RingSpec, ...] = ()
    frames: tuple[FrameSpec, ...] = ()
    command_values: int = 0  # float64 values of an order, at most


class Channels:
    """The parts by name; host and child build them over the same memory from the same specification."""

    def __init__(self, spec: MemorySpec, buffer: mmap.mmap | None) -> None:
        """Lay the parts out; without a buffer only their size is of interest."""
        block = Block(buffer)
        self.health = HealthBlock(block)
        self.command = CommandSlot(block, spec.command_values)
        self.rings = {ring.name: SharedRing(block, ring.dtype, ring.capacity) for ring in spec.rings}
        self.frames = {frame.name: FrameSlot(block, frame.meta, frame.capacity_bytes) for frame in spec.frames}
        self.size = block.size

    @classmethod
    def private(cls, spec: MemorySpec) -> Channels:
        """Lay them out in memory of this process only: what a test of a session needs."""
        return cls(spec, mmap.mmap(-1, cls(spec, None).size))

    @classmethod
    def shared(cls, spec: MemorySpec, descriptor: int, size: int) -> Channels:
        """Lay them out in the shared memory behind a file descriptor."""
        return cls(spec, mmap.mmap(descriptor, size))
