"""Misbehaviour on a CAN bus, by script: what an axis sends is lost, frozen, damaged, misplaced or drowned."""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from sim_drivers.firmware.can_simple import Command, Frame
from sim_drivers.firmware.fault_script import Fault, FaultScript

ESTIMATES = (Command.GET_ENCODER_ESTIMATES, Command.GET_BUS_VOLTAGE_CURRENT, Command.GET_IQ)

Kind = Literal[
    "drop", "freeze", "nan", "out_of_range", "corrupt", "truncate", "wrong_node", "silent", "deaf", "flood", "estop", "drive",
    "reboot",
]  # fmt: skip


class FrameFault(Fault):
    """One misbehaviour of one axis, or of all."""

    kind: Kind = Field(
        description="drop: some frames are lost; freeze: the same values again; nan, out_of_range: in the estimates; corrupt, "
        "truncate: the payload; wrong_node: under another identifier; silent: sends nothing; deaf: hears nothing; flood: foreign "
        "frames; estop, drive: a fault of its own, once; reboot: powers up anew, once"
    )
    node: int | None = Field(default=None, ge=0, le=63, description="of the axis; none: all of them")
    flood_per_s: float = Field(default=2000.0, gt=0.0, le=20_000.0, description="foreign frames a second")

    def concerns(self, node: int | None) -> bool:
        """Whether it is this axis that misbehaves."""
        return self.node is None or node is None or self.node == node


class FrameFaults(FaultScript[FrameFault]):
    """Applies a script to the frames that axes send."""

    def __init__(self, script: tuple[FrameFault, ...], rng: np.random.Generator) -> None:
        """Take the script; what is left to chance is drawn from `rng`, in the order of the frames."""
        super().__init__(script, rng)
        self._frozen: dict[int, bytes] = {}  # by identifier
        self._flooded = 0.0

    def sent(self, frame: Frame, scene_ns: int) -> Frame | None:
        """Return what a frame has become when it leaves the axis; None: it never does."""
        result: Frame | None = frame
        for fault in self.going_on(scene_ns, frame.node):
            if result is not None:
                result = self._changed(result, fault)
        if self.active("freeze", scene_ns, frame.node) is None:
            self._frozen.pop(frame.identifier, None)
        return result

    def flood(self, scene_ns: int, elapsed_s: float) -> list[Frame]:
        """Return foreign frames that have come since the last call."""
        for fault in self.going_on(scene_ns):
            if fault.kind == "flood":
                self._flooded += fault.flood_per_s * elapsed_s
        count, self._flooded = int(self._flooded), self._flooded % 1.0
        return [Frame(63, 0x1F, self._rng.bytes(8)) for _ in range(count)]

    def _changed(self, frame: Frame, fault: FrameFault) -> Frame | None:
        match fault.kind:
            case "silent":
                return None
            case "drop":
                return None if self._chance(fault) else frame
            case "freeze":
                return replace(frame, data=self._frozen.setdefault(frame.identifier, frame.data))
            case "nan" if frame.command in ESTIMATES:
                return replace(frame, data=struct.pack("<2f", float("nan"), float("nan")))
            case "out_of_range" if frame.command in ESTIMATES:
                return replace(frame, data=struct.pack("<2f", 3.0e9, -3.0e9))
            case "corrupt" if self._chance(fault):
                return replace(frame, data=self._rng.bytes(len(frame.data)))
            case "truncate" if self._chance(fault):
                return replace(frame, data=frame.data[: int(self._rng.integers(0, max(len(frame.data), 1)))])
            case "wrong_node":
                return replace(frame, node=(frame.node + 32) % 64)
        return frame
