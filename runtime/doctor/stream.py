"""A device's samples over two seconds: rate, jitter, and how its clock stands to ours."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from drivers.interface.devices import DeviceHealth
from drivers.interface.samples import Stamp
from runtime.doctor.findings import Finding, Verdict
from runtime.sections import SupervisorSection

AHEAD_NS = 2_000_000  # a stamp so far in the future comes of a clock that is wrong
SLOW, FAST = 0.9, 1.1  # of the expected rate: worth a warning


def stamps_of(device: Any) -> list[Stamp]:
    """Return the stamps of what a device has delivered since the last call; never blocks."""
    samples: Iterable[Any] = device.drain() if hasattr(device, "drain") else (device.latest(),)
    return [sample.stamp for sample in samples if sample is not None]


def examine_stream(health: DeviceHealth, stamps: list[Stamp], watched_s: float, settings: SupervisorSection) -> list[Finding]:
    """Return what the stamps of a device with a fixed rate say."""
    if not health.expected_period_ns:
        return []
    fresh = sorted({stamp.captured_ns: stamp for stamp in stamps}.values(), key=lambda stamp: stamp.captured_ns)
    if len(fresh) < 3:
        return [Finding(health.device, "rate", Verdict.FORBIDS, f"{len(fresh)} samples in {watched_s:.1f} s")]
    captured_ns = np.array([stamp.captured_ns for stamp in fresh])
    age_ns = np.array([stamp.received_ns for stamp in fresh]) - captured_ns
    return [_rate(health, captured_ns, settings), _jitter(health, captured_ns), _clock(health, age_ns, settings)]


def _rate(health: DeviceHealth, captured_ns: np.ndarray[Any, Any], settings: SupervisorSection) -> Finding:
    rate_hz = 1e9 * (len(captured_ns) - 1) / float(captured_ns[-1] - captured_ns[0])
    ratio = rate_hz * health.expected_period_ns * 1e-9
    low = ratio < settings.lowest_rate_ratio
    verdict = Verdict.FORBIDS if low else Verdict.GOOD if SLOW <= ratio <= FAST else Verdict.WARNING
    told = f"{rate_hz:.1f} Hz, expected {1e9 / health.expected_period_ns:.1f} Hz"
    lost = health.dropped + health.overflowed
    return Finding(
        health.device, "rate", verdict, told + (f"; {health.dropped} dropped, {health.overflowed} overflowed" * bool(lost))
    )


def _jitter(health: DeviceHealth, captured_ns: np.ndarray[Any, Any]) -> Finding:
    gaps_ms = np.diff(captured_ns) * 1e-6
    longest_ms, period_ms = float(gaps_ms.max()), health.expected_period_ns * 1e-6
    verdict = Verdict.WARNING if longest_ms > 3.0 * period_ms else Verdict.GOOD
    return Finding(health.device, "jitter", verdict, f"{float(gaps_ms.std()):.2f} ms, longest gap {longest_ms:.1f} ms")


def _clock(health: DeviceHealth, age_ns: np.ndarray[Any, Any], settings: SupervisorSection) -> Finding:
    least_ms, median_ms = float(age_ns.min()) * 1e-6, float(np.median(age_ns)) * 1e-6
    stale = median_ms > settings.stale_after_s * 1e3
    verdict = Verdict.FORBIDS if stale else Verdict.WARNING if age_ns.min() < -AHEAD_NS else Verdict.GOOD
    told = f"received {median_ms:.1f} ms after capture (least {least_ms:.1f} ms)"
    return Finding(health.device, "clock", verdict, told + ("; its clock is ahead of ours" if age_ns.min() < -AHEAD_NS else ""))
