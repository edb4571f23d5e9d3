"""What the process on the CAN bus does: finds the axes, sees their watchdogs trip, arms on the first command, drives, rests.

Source: ODrive, CAN Protocol and Axis (watchdog, states), documentation of firmware 0.5.6 and 0.6.  On 0.5 every frame that is
addressed to an axis feeds its watchdog, so after the last command nothing is sent but the zeros that brake.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from drivers.io.session import Port
from drivers.omni_can.axes import ZERO, Axes, SessionSettings
from drivers.omni_can.axis import IDLE
from drivers.omni_can.can_wire import BusChoice, CanWire, Wire

ARMING_NS = 1_000_000_000  # until every axis must be in closed loop
ASK_NS = 300_000_000  # for an answer to Get_Version
ZERO_PERIOD_NS = 20_000_000  # between the zeros that brake
POLL_NS = 2_000_000  # of a bus within a process, which has no descriptor to wait for
PATIENCE_NS = 100_000_000


class Phase(enum.Enum):
    """Where it stands."""

    CONNECTING = "connecting"  # not every axis has been heard
    TRIAL_ARMING = "trial arming"  # arming at rest, to see the watchdogs trip
    TRIAL = "trial"  # silent until every watchdog has tripped
    READY = "ready"  # disarmed; the next fresh command arms
    ARMING = "arming"
    DRIVING = "driving"
    FAULTED = "faulted"


class OmniCanSession:
    """Drives three axes on one bus."""

    def __init__(self, settings: SessionSettings, port: Port, join: Callable[[BusChoice], Wire] = CanWire) -> None:
        """Remember; the bus is not touched."""
        self._settings = settings
        self._port = port
        self._health = port.health
        self._join = join
        self._wire: Wire | None = None
        self._began_ns: int | None = None  # the first poll after `open`
        self._since_ns = 0  # when the phase began
        self._rates: tuple[float, ...] = ZERO  # of the newest order
        self._brakes = False  # zero is repeated
        self._brake_until_ns: int | None = None
        self._last_zero_ns = 0
        self._gathering = False
        self._phase = Phase.CONNECTING

    def open(self) -> None:
        """Join the bus; the axes are looked for while it is polled.

        Raises:
            DeviceError: there is no such bus.
        """
        self._wire = self._join(self._settings.bus)
        self._axes = Axes(self._settings, self._port, self._wire)
        self._phase, self._began_ns, self._brakes, self._gathering = Phase.CONNECTING, None, False, False
        self._health.state = DeviceState.RECONNECTING

    def wakes_on(self) -> tuple[int, ...]:
        """Return the bus's descriptor, except right after frames came: others that follow closely are read together."""
        if self._wire is None or self._gathering:
            return ()
        descriptor = self._wire.fileno()
        return (descriptor,) if descriptor >= 0 else ()

    def next_ns(self, now_ns: int) -> int:
        """Return when the next poll is due."""
        if self._gathering:
            return now_ns + round(self._settings.gather_s * 1e9)
        if self._wire is not None and self._wire.fileno() < 0:
            return now_ns + POLL_NS
        repeats = self._brakes or self._phase is Phase.TRIAL_ARMING
        return now_ns + (ZERO_PERIOD_NS if repeats else PATIENCE_NS)

    def poll(self, now_ns: int) -> None:
        """Take in what has come and do what is due.

        Raises:
            DeviceError: the bus is gone, or an axis is silent or was never heard; names it.
        """
        if self._began_ns is None:
            self._began_ns = now_ns
        self._gathering = self._axes.receive(now_ns) and self._settings.gather_s > 0.0
        self._check_silence(now_ns, self._began_ns)
        self._advance(now_ns, self._began_ns)
        self._brake(now_ns)
        self._tell()

    def send(self, values: NDArray[np.float64], now_ns: int) -> None:
        """Send motor rates [turn/s], shape (3,); while the axes are being armed zero, and the rates once they are."""
        self._brakes, self._rates = False, tuple(values.tolist())
        if self._phase is Phase.READY:
            self._enter(Phase.ARMING, now_ns)
            self._axes.arm()
        elif self._phase is Phase.ARMING:
            self._axes.send_rates(ZERO)
        elif self._phase is Phase.DRIVING:
            self._axes.send_rates(self._rates)

    def rest(self) -> None:
        """Send zero now, and go on braking for a while."""
        if self._phase in {Phase.DRIVING, Phase.ARMING} and not self._brakes:
            self._brakes, self._brake_until_ns = True, None
            self._axes.send_rates(ZERO)

    def clear_faults(self) -> None:
        """Be ready for the next command, which clears the axes' errors and arms them."""
        if self._phase is Phase.FAULTED:
            self._be_ready()

    def close(self) -> None:
        """Disarm what stands, and leave the bus.  What still rolls brakes at zero until its watchdog trips."""
        wire, self._wire = self._wire, None
        if wire is not None:
            try:
                if self._axes.standing:
                    self._axes.request(IDLE)
            finally:
                wire.close()

    def _check_silence(self, now_ns: int, began_ns: int) -> None:
        if self._phase is Phase.CONNECTING:
            late = now_ns - began_ns > self._settings.connect_s * 1e9
            silent = [axis.name for axis in self._axes.each if late and not axis.heard]
        else:
            patience_ns = self._settings.silent_s * 1e9
            silent = [axis.name for axis in self._axes.each if now_ns - axis.last_ns > patience_ns]
        if silent:
            raise DeviceError(f"{self._port.name}: {' and '.join(silent)} cannot be heard on {self._settings.bus.place}")

    def _advance(self, now_ns: int, began_ns: int) -> None:
        """Go from phase to phase."""
        match self._phase:
            case Phase.CONNECTING:
                self._connect(now_ns, began_ns)
            case Phase.TRIAL_ARMING:
                self._repeat_zero(now_ns)  # until all are armed at once; the trial begins with the silence
                self._await_closed_loop(now_ns, Phase.TRIAL)
            case Phase.TRIAL:
                self._await_trip(now_ns)
            case Phase.ARMING:
                if self._await_closed_loop(now_ns, Phase.DRIVING) and not self._brakes:
                    self._axes.send_rates(self._rates)
            case Phase.DRIVING:
                fallen = [axis for axis in self._axes.each if not axis.is_closed_loop]
                if fallen:
                    self._fail(f"{fallen[0].name} has disarmed: {fallen[0].condition}")

    def _connect(self, now_ns: int, began_ns: int) -> None:
        axes, health = self._axes, self._health
        if not all(axis.heard for axis in axes.each) or (not axes.firmware and now_ns - began_ns < ASK_NS):
            return
        axes.firmware = axes.firmware or "0.5"  # no answer to Get_Version
        health.firmware = next((axis.firmware for axis in axes.each if axis.firmware), axes.firmware)
        health.protocol = f"CANSimple {axes.firmware}"
        if self._port.reopened:
            self._fail("it was lost and is back; it is armed again after the operator's reset")
        elif self._settings.verify_watchdog:
            self._enter(Phase.TRIAL_ARMING, now_ns)
            axes.arm()
        else:
            self._be_ready()

    def _await_closed_loop(self, now_ns: int, then: Phase) -> bool:
        """Go on once all are armed; return whether they are."""
        fallen = [axis for axis in self._axes.each if not axis.is_closed_loop]
        if not fallen:
            self._enter(then, now_ns)
        elif now_ns - self._since_ns > ARMING_NS:
            self._fail(f"{fallen[0].name} cannot be armed: {fallen[0].condition}")
        return not fallen

    def _await_trip(self, now_ns: int) -> None:
        """Stay silent: a watchdog that is what the settings say has tripped by now."""
        s = self._settings
        awake = [axis for axis in self._axes.each if not axis.tripped]
        if not awake:
            self._be_ready()
        elif now_ns - self._since_ns > (s.watchdog_s + 3.0 * s.heartbeat_s) * 1e9:
            self._axes.request(IDLE)
            self._fail(f"the watchdog of {awake[0].name} did not trip within {s.watchdog_s:g} s; is it enabled?")

    def _enter(self, phase: Phase, now_ns: int) -> None:
        self._phase, self._since_ns = phase, now_ns

    def _be_ready(self) -> None:
        self._phase = Phase.READY
        self._health.state, self._health.fault = DeviceState.OPEN, ""

    def _fail(self, fault: str) -> None:
        """Take no more commands until the operator's reset; the axes that still drive are told to stand."""
        self._axes.send_rates(ZERO)
        self._phase = Phase.FAULTED
        self._health.state, self._health.fault = DeviceState.FAULTED, f"{self._port.name}: {fault}"

    def _brake(self, now_ns: int) -> None:
        """After the last command repeat zero for a while; then be silent, and the watchdogs disarm."""
        if not self._brakes or self._phase not in {Phase.DRIVING, Phase.ARMING}:
            return
        if self._brake_until_ns is None:
            self._brake_until_ns, self._last_zero_ns = now_ns + round(self._settings.brake_s * 1e9), now_ns
        if now_ns < self._brake_until_ns:
            self._repeat_zero(now_ns)

    def _repeat_zero(self, now_ns: int) -> None:
        if now_ns - self._last_zero_ns >= ZERO_PERIOD_NS:
            self._last_zero_ns = now_ns
            self._axes.send_rates(ZERO)

    def _tell(self) -> None:
        s, health = self._settings, self._health
        health.bus_load = self._axes.load.load
        voltages_v = sorted(axis.voltage_v for axis in self._axes.each if math.isfinite(axis.voltage_v))
        if voltages_v:  # of one battery: the median, so that one damaged frame does not stop the robot
            voltage_v = voltages_v[len(voltages_v) // 2]
            health.battery_v = voltage_v
            share = (voltage_v - s.battery_empty_v) / (s.battery_full_v - s.battery_empty_v)
            health.battery_fraction = min(max(share, 0.0), 1.0)
        for index, axis in enumerate(self._axes.each):
            health.figures[index] = axis.temperature_c
