"""A device that misbehaves by script: a wrapper around any other, simulated, emulated or real, that spoils what it delivers.

The script goes by the loop's clock, counted from `open`, and draws nothing: in lockstep the same script gives the same log.
"""

from __future__ import annotations

import time
from dataclasses import fields, replace
from typing import Any, Literal

import numpy as np
from pydantic import Field

from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.settings import Settings

SECOND_NS = 1_000_000_000
Kind = Literal["delay", "freeze", "drop", "nan", "out_of_range", "clock_jump", "slow_read", "disconnect", "error"]
ABSURD = 1e6  # of any unit


class DeviceFault(Settings):
    """One misbehaviour of one device."""

    device: str = Field(min_length=1, description="its name in the robot")
    kind: Kind = Field(
        description="delay: samples come later; freeze: the same sample again and again; drop: no samples; nan, out_of_range: in "
        "all measured values (a depth image: nothing seen, or the largest depth); clock_jump: stamps are off; slow_read: reading "
        "takes long; disconnect: it is reconnecting; error: reading raises"
    )
    at_s: float = Field(default=0.0, ge=0.0, le=1e6, description="after it was opened")
    for_s: float = Field(default=1.0, gt=0.0, le=1e6, description="how long it lasts")
    by_s: float = Field(default=0.5, ge=-1e3, le=1e3, description="of delay, clock_jump and slow_read: how much")


class FaultyDevice:
    """Behaves like the device inside, except when the script says otherwise; whatever it does not spoil it passes on."""

    def __init__(self, inside: Any, script: tuple[DeviceFault, ...], setup: DeviceSetup) -> None:
        """Take a device that is not yet opened, and its part of the script."""
        self._inside = inside
        self._script = script
        self._setup = setup
        self._opened_ns: int | None = None
        self._held: list[tuple[int, Any]] = []  # delayed samples, with the time when they may go
        self._last: Any = None

    def __getattr__(self, name: str) -> Any:
        """Return what the device inside has: limits, kinematics, identity."""
        return getattr(self._inside, name)

    def open(self) -> None:
        """Open it; the script begins."""
        self._inside.open()
        self._opened_ns, self._held, self._last = self._setup.now_ns(), [], None

    def stop(self) -> None:
        """Stop it."""
        self._inside.stop()

    def close(self) -> None:
        """Close it; the script is over."""
        self._opened_ns = None
        self._inside.close()

    def clear_faults(self) -> None:
        """Pass the operator's reset on, where the device inside has a use for it."""
        if hasattr(self._inside, "clear_faults"):
            self._inside.clear_faults()

    def health(self) -> DeviceHealth:
        """Say how it stands, or what the script says."""
        health: DeviceHealth = self._inside.health()
        if self._active("disconnect"):
            return replace(health, state=DeviceState.RECONNECTING, fault=f"{self._setup.name}: disconnected by the fault script")
        return health

    def command(self, order: Any, expires_ns: int) -> None:
        """Pass a command on, unless it is disconnected.

        Raises:
            DeviceError: it does not take it.
        """
        if not self._active("disconnect"):
            self._inside.command(order, expires_ns)

    def drain(self) -> tuple[Any, ...]:
        """Return what the script leaves of the samples."""
        return tuple(self._spoiled(self._inside.drain()))

    def latest(self) -> Any:
        """Return what the script leaves of the newest sample."""
        sample = self._inside.latest()
        samples = self._spoiled(() if sample is None else (sample,))
        return samples[-1] if samples else None

    def _active(self, kind: Kind) -> DeviceFault | None:
        if self._opened_ns is None:
            return None
        elapsed_s = (self._setup.now_ns() - self._opened_ns) / SECOND_NS
        return next((f for f in self._script if f.kind == kind and f.at_s <= elapsed_s < f.at_s + f.for_s), None)

    def _spoiled(self, samples: tuple[Any, ...]) -> list[Any]:
        """Apply the script to new samples."""
        if self._active("error"):
            raise DeviceError(f"{self._setup.name}: an error by the fault script")
        if slow := self._active("slow_read"):
            time.sleep(max(slow.by_s, 0.0))
        if self._active("drop") or self._active("disconnect"):
            return []
        kept = self._delayed([self._changed(sample) for sample in samples])
        if self._active("freeze"):
            return [] if self._last is None else [self._last]
        self._last = kept[-1] if kept else self._last
        return kept

    def _delayed(self, samples: list[Any]) -> list[Any]:
        """Hold samples back; what is held when the fault is over comes at once."""
        delay, now_ns = self._active("delay"), self._setup.now_ns()
        by_ns = 0 if delay is None else round(max(delay.by_s, 0.0) * SECOND_NS)
        self._held += [(sample.stamp.captured_ns + by_ns, sample) for sample in samples]
        due = [sample for release_ns, sample in self._held if delay is None or release_ns <= now_ns]
        self._held = self._held[len(due) :]
        return due

    def _changed(self, sample: Any) -> Any:
        if jump := self._active("clock_jump"):
            by_ns, stamp = round(jump.by_s * SECOND_NS), sample.stamp
            sample = replace(
                sample, stamp=replace(stamp, captured_ns=stamp.captured_ns + by_ns, received_ns=stamp.received_ns + by_ns)
            )
        if self._active("nan"):
            return _with_values(sample, np.nan)
        return _with_values(sample, ABSURD) if self._active("out_of_range") else sample


def _with_values(sample: Any, value: float) -> Any:
    """Return the sample with every measured value replaced; an array of whole numbers takes its least or its largest."""
    changes: dict[str, Any] = {}
    for field in fields(sample):
        old = getattr(sample, field.name)
        if isinstance(old, np.ndarray):
            number = value if old.dtype.kind == "f" else 0 if np.isnan(value) else np.iinfo(old.dtype).max
            changes[field.name] = np.full_like(old, number)
            changes[field.name].flags.writeable = False
        elif isinstance(old, tuple) and old and all(isinstance(part, float) for part in old):
            changes[field.name] = (value,) * len(old)
    return replace(sample, **changes)
