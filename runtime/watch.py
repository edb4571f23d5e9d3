"""Watches the devices: who is silent, stale, slow, or says himself that something is wrong."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from drivers.interface.devices import DeviceHealth, DeviceState
from drivers.interface.samples import Stamp
from drivers.interface.sensed import Sensed
from runtime.faults import Fault, FaultReport
from runtime.sections import SupervisorSection

SECOND_NS = 1_000_000_000
RATE_WINDOW_NS = 2 * SECOND_NS


@dataclass(frozen=True, slots=True)
class SeenState:
    """What is remembered of one device, at rest."""

    device: str
    newest: Stamp | None
    expired_commands: int
    overflowed: int
    arrivals_ns: tuple[int, ...]
    arrivals: tuple[int, ...]  # samples at each


@dataclass(frozen=True, slots=True)
class WatchState:
    """What a device watch goes on from."""

    start_ns: int | None
    seen: tuple[SeenState, ...]


@dataclass(slots=True)
class _Seen:
    """What is remembered of one device."""

    newest: Stamp | None = None
    expired_commands: int = 0
    overflowed: int = 0  # samples that came, and that the loop never saw
    arrivals: deque[tuple[int, int]] = field(default_factory=deque)  # (tick time, samples) within the rate window
    arrived: int = 0  # samples in it


class DeviceWatch:
    """Judges every device at every tick, from its samples and from its own word."""

    def __init__(self, settings: SupervisorSection) -> None:
        """Start with nothing seen."""
        self._settings = settings
        self._seen: dict[str, _Seen] = {}
        self._start_ns: int | None = None

    def faults(self, sensed: Sensed) -> list[FaultReport]:
        """Return every device fault that is present now."""
        now_ns = sensed.tick.start_ns
        if self._start_ns is None:
            self._start_ns = now_ns
        found: list[FaultReport] = []
        stamps = _stamps(sensed)
        for health in sensed.health:
            seen = self._seen.setdefault(health.device, _Seen())
            found += self._from_health(health, seen)
            if health.device in stamps and health.expected_period_ns and health.state is not DeviceState.ENDED:
                found += self._from_samples(health, stamps[health.device], seen, now_ns)
        return found

    @property
    def state(self) -> WatchState:
        """What it goes on from."""
        return WatchState(self._start_ns, tuple(_at_rest(device, seen) for device, seen in self._seen.items()))

    @state.setter
    def state(self, state: WatchState) -> None:
        self._start_ns = state.start_ns
        self._seen = {rest.device: _awake(rest) for rest in state.seen}

    def _from_health(self, health: DeviceHealth, seen: _Seen) -> list[FaultReport]:
        found = []
        if health.state is DeviceState.RECONNECTING:
            found.append(FaultReport(Fault.SILENT_DEVICE, health.device, health.fault or "it is being reconnected"))
        elif health.state is DeviceState.FAULTED or health.fault:
            found.append(FaultReport(Fault.DEVICE_FAULT, health.device, health.fault))
        if health.expired_commands > seen.expired_commands:
            seen.expired_commands = health.expired_commands
            found.append(FaultReport(Fault.DEAD_MAN_TRIPPED, health.device, "a command expired before the next one came"))
        battery = health.battery_fraction
        if battery is not None and battery < self._settings.lowest_battery_fraction:
            found.append(FaultReport(Fault.LOW_BATTERY, health.device, f"{100 * battery:.0f} % left"))
        return found

    def _from_samples(self, health: DeviceHealth, stamps: tuple[Stamp, ...], seen: _Seen, now_ns: int) -> list[FaultReport]:
        fresh = 0
        for stamp in stamps:  # the same sample again is not news
            if seen.newest is None or stamp.captured_ns > seen.newest.captured_ns:
                seen.newest, fresh = stamp, fresh + 1
        skipped, seen.overflowed = health.overflowed - seen.overflowed, health.overflowed
        if fresh:
            fresh += max(skipped, 0)  # fewer than before: it was opened again
            seen.arrivals.append((now_ns, fresh))
            seen.arrived += fresh
        if seen.newest is None:
            return [self._not_started(health.device, now_ns)]
        return self._late(health, seen, now_ns) + self._slow(health, seen, now_ns)

    def _not_started(self, device: str, now_ns: int) -> FaultReport:
        waiting_ns = now_ns - (self._start_ns or 0)
        fault = Fault.STARTING if waiting_ns <= self._settings.startup_grace_s * SECOND_NS else Fault.SILENT_DEVICE
        return FaultReport(fault, device, "no sample yet")

    def _late(self, health: DeviceHealth, seen: _Seen, now_ns: int) -> list[FaultReport]:
        assert seen.newest is not None
        settings = self._settings
        patience_ns = max(settings.silent_after_periods * health.expected_period_ns, settings.silent_after_s * SECOND_NS)
        last_arrival_ns = seen.arrivals[-1][0] if seen.arrivals else seen.newest.received_ns
        if now_ns - last_arrival_ns > patience_ns:
            return [
                FaultReport(Fault.SILENT_DEVICE, health.device, f"nothing for {(now_ns - last_arrival_ns) / SECOND_NS:.2f} s")
            ]
        age_ns = now_ns - seen.newest.captured_ns
        if age_ns > settings.stale_after_s * SECOND_NS:
            return [FaultReport(Fault.STALE_SAMPLE, health.device, f"the newest is {age_ns / SECOND_NS:.2f} s old")]
        return []

    def _slow(self, health: DeviceHealth, seen: _Seen, now_ns: int) -> list[FaultReport]:
        while len(seen.arrivals) > 1 and seen.arrivals[0][0] < now_ns - RATE_WINDOW_NS:
            seen.arrived -= seen.arrivals.popleft()[1]
        watched_ns = now_ns - (self._start_ns or 0) - self._settings.startup_grace_s * SECOND_NS
        if watched_ns < RATE_WINDOW_NS:
            return []
        ratio = seen.arrived * health.expected_period_ns / RATE_WINDOW_NS
        if ratio >= self._settings.lowest_rate_ratio:
            return []
        return [FaultReport(Fault.WRONG_RATE, health.device, f"{100 * ratio:.0f} % of its rate over two seconds")]


def _at_rest(device: str, seen: _Seen) -> SeenState:
    times, counts = zip(*seen.arrivals, strict=True) if seen.arrivals else ((), ())
    return SeenState(device, seen.newest, seen.expired_commands, seen.overflowed, times, counts)


def _awake(rest: SeenState) -> _Seen:
    arrivals = deque(zip(rest.arrivals_ns, rest.arrivals, strict=True))
    return _Seen(rest.newest, rest.expired_commands, rest.overflowed, arrivals, sum(rest.arrivals))


def _stamps(sensed: Sensed) -> dict[str, tuple[Stamp, ...]]:
    """Return the stamps of this tick's samples, for every device that the loop's decisions rest on."""
    return {
        "camera": () if sensed.depth is None else (sensed.depth.stamp,),
        "imu": tuple(sample.stamp for sample in sensed.imu),
        "base": tuple(sample.stamp for sample in sensed.base),
        "arm": tuple(sample.stamp for sample in sensed.joints),
        "scan": tuple(scan.stamp for scan in sensed.scans),
        "markers": tuple(sample.stamp for sample in sensed.markers),
    }
