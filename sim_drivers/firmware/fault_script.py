"""Misbehaviour of emulated devices, by script: what goes on at a time of the run, what happens once, what is left to chance."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Generic, TypeVar

import numpy as np
from pydantic import Field

from drivers.interface.settings import Settings
from sim_drivers.world import SECOND_NS


class Fault(Settings):
    """One misbehaviour; which kinds there are, its device's firmware says."""

    kind: str
    from_s: float = Field(default=0.0, ge=0.0, le=1e6, description="after the walkers set off")
    until_s: float = Field(default=1e6, gt=0.0, le=1e6, description="its end")
    probability: float = Field(default=0.5, ge=0.0, le=1.0, description="for each frame, where some are hit and others are not")

    def active(self, scene_ns: int) -> bool:
        """Whether it goes on at a time of the run."""
        return self.from_s * SECOND_NS <= scene_ns < self.until_s * SECOND_NS

    def concerns(self, node: int | None) -> bool:
        """Whether it is this part of the device that misbehaves."""
        return True


F = TypeVar("F", bound=Fault)


class FaultScript(Generic[F]):
    """The misbehaviour of one device.  `node` asks about one part of a device that has several."""

    def __init__(self, script: tuple[F, ...], rng: np.random.Generator) -> None:
        """Take the script; what is left to chance is drawn from `rng`, in the order of the questions."""
        self._script = script
        self._rng = rng
        self._done: set[tuple[int, int | None]] = set()  # (entry, node) of what happens once

    def going_on(self, scene_ns: int, node: int | None = None) -> Iterator[F]:
        """Yield what goes on now, in the script's order."""
        return (fault for fault in self._script if fault.active(scene_ns) and fault.concerns(node))

    def active(self, kind: str, scene_ns: int, node: int | None = None) -> F | None:
        """Return the first of a kind that goes on now."""
        return next((fault for fault in self.going_on(scene_ns, node) if fault.kind == kind), None)

    def strikes(self, kind: str, scene_ns: int, node: int | None = None) -> bool:
        """Whether something that happens once happens now."""
        for entry, fault in enumerate(self._script):
            fresh = fault.kind == kind and (entry, node) not in self._done
            if fresh and fault.active(scene_ns) and fault.concerns(node):
                self._done.add((entry, node))
                return True
        return False

    def hits(self, kind: str, scene_ns: int) -> bool:
        """Whether this frame is one of those that a kind of misbehaviour hits."""
        fault = self.active(kind, scene_ns)
        return fault is not None and self._chance(fault)

    def _chance(self, fault: F) -> bool:
        return bool(self._rng.random() < fault.probability)
