"""Misbehaviour on a MAVLink wire, by script: frames are lost, frozen, damaged, repeated, or come from somebody else."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from sim_drivers.firmware.fault_script import Fault, FaultScript

REMEMBERED = 64  # frames that a replay plays again

Kind = Literal[
    "drop", "corrupt", "truncate", "silent", "deaf", "noise", "other_system", "replay", "forge", "nan", "clock_jump",
    "disconnect", "disarm", "leave_mode", "reboot",
]  # fmt: skip


class LinkFault(Fault):
    """One misbehaviour."""

    kind: Kind = Field(
        description="drop, corrupt, truncate: some frames; silent: nothing is sent; deaf: nothing is heard; noise: bytes between "
        "frames; other_system: frames of a second vehicle; replay: old frames again; forge: a frame that nobody signed; nan: in "
        "all that it measures of its motion; clock_jump: its clock goes ahead, once; disconnect: the connection is cut, once; "
        "disarm, leave_mode, reboot: by itself, once"
    )
    probability: float = Field(default=0.3, ge=0.0, le=1.0, description="of drop, corrupt and truncate, for each frame")


class LinkFaults(FaultScript[LinkFault]):
    """Applies a script to what an autopilot sends."""

    def __init__(self, script: tuple[LinkFault, ...], rng: np.random.Generator) -> None:
        """Take the script; what is left to chance is drawn from `rng`, in the order of the frames."""
        super().__init__(script, rng)
        self._sent: list[bytes] = []
        self._replayed = 0

    def sent(self, frame: bytes, scene_ns: int) -> list[bytes]:
        """Return what is on the wire instead of a frame."""
        if not self._script:
            return [frame]
        if self.active("silent", scene_ns):
            return []
        result = [frame]
        for fault in self.going_on(scene_ns):
            result = self._changed(fault, result)
        self._sent = [*self._sent, frame][-REMEMBERED:]
        return result

    def _changed(self, fault: LinkFault, frames: list[bytes]) -> list[bytes]:
        match fault.kind:
            case "drop":
                return [frame for frame in frames if not self._chance(fault)]
            case "corrupt":
                return [self._bent(frame) if self._chance(fault) else frame for frame in frames]
            case "truncate":
                return [frame[: int(self._rng.integers(1, len(frame)))] if self._chance(fault) else frame for frame in frames]
            case "noise":
                return [self._rng.bytes(int(self._rng.integers(1, 40))), *frames]
            case "replay" if self._sent:
                self._replayed += 1
                return [*frames, self._sent[self._replayed % len(self._sent)]]
        return frames

    def _bent(self, frame: bytes) -> bytes:
        place = int(self._rng.integers(1, len(frame)))
        return frame[:place] + bytes((frame[place] ^ int(self._rng.integers(1, 256)),)) + frame[place + 1 :]
