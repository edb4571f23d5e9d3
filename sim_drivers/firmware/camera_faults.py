"""Misbehaviour of a camera, by script."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sim_drivers.firmware.fault_script import Fault, FaultScript
from sim_drivers.world import SECOND_NS


class CameraFault(Fault):
    """One misbehaviour."""

    kind: Literal["freeze", "drop", "delay", "disconnect", "clock_jump"] = Field(
        description="freeze: the same frame again; drop: some are lost; delay: all come later; disconnect: it is off the bus; "
        "clock_jump: its clock is ahead"
    )
    by_s: float = Field(default=0.2, gt=0.0, le=100.0, description="of delay and clock_jump")


class CameraFaults(FaultScript[CameraFault]):
    """The misbehaviour of one sensor inside a camera."""

    def shift_ns(self, kind: str, scene_ns: int) -> int:
        """Return by how much a fault of a kind shifts time now."""
        fault = self.active(kind, scene_ns)
        return 0 if fault is None else round(fault.by_s * SECOND_NS)
