"""Misbehaviour of a camera, by script."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from drivers.interface.settings import Settings

SECOND_NS = 1_000_000_000
Kind = Literal["freeze", "drop", "delay", "disconnect", "clock_jump"]


class CameraFault(Settings):
    """One misbehaviour."""

    kind: Kind = Field(
        description="freeze: the same frame again; drop: some are lost; delay: all come later; disconnect: it is off the bus; "
        "clock_jump: its clock is ahead"
    )
    from_s: float = Field(default=0.0, ge=0.0, le=1e6, description="after the walkers set off")
    until_s: float = Field(default=1e6, gt=0.0, le=1e6, description="its end")
    probability: float = Field(default=0.5, ge=0.0, le=1.0, description="of drop, for each frame")
    by_s: float = Field(default=0.2, gt=0.0, le=100.0, description="of delay and clock_jump")


class CameraFaults:
    """A script, asked at times of the run."""

    def __init__(self, script: tuple[CameraFault, ...]) -> None:
        """Take the script."""
        self._script = script

    def active(self, kind: Kind, scene_ns: int) -> CameraFault | None:
        """Return what of a kind is going on."""
        for fault in self._script:
            if fault.kind == kind and fault.from_s * SECOND_NS <= scene_ns < fault.until_s * SECOND_NS:
                return fault
        return None

    def shift_ns(self, kind: Kind, scene_ns: int) -> int:
        """Return by how much a fault of a kind shifts time now."""
        fault = self.active(kind, scene_ns)
        return 0 if fault is None else round(fault.by_s * SECOND_NS)
