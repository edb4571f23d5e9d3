"""Finds out who the autopilot is, and has it send what is needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.interface.errors import DeviceError
from drivers.rover_serial.autopilots import ROVER_TYPES, Autopilot
from drivers.rover_serial.commands import Commands, Result
from drivers.rover_serial.messages import (
    REQUEST_CAPABILITIES,
    REQUEST_MESSAGE,
    SET_MESSAGE_INTERVAL,
    Message,
    Speaker,
    message_id,
)
from drivers.rover_serial.settings import RoverImuSettings, RoverSettings
from drivers.rover_serial.telemetry import Telemetry
from drivers.rover_serial.timesync import TimeSync
from drivers.rover_serial.vehicle import CAN_FOLLOW_LOCAL_NED, CAN_SPEAK_2, Vehicle

SLOWEST_HZ = 4.0  # a stream that is refused at this rate too is not to be had
FIRST_NS = 1_500_000_000  # until the first message of an accepted stream
ASK_NS = 300_000_000
PARAMETER_TRIES, CLOCK_TRIES = 3, 5
_STREAM_OF = {"wheels": ("WHEEL_DISTANCE",), "position": ("ATTITUDE", "LOCAL_POSITION_NED")}


@dataclass(slots=True)
class Greeting:
    """One series of questions, in order: version, streams, time-out, clock."""

    settings: RoverSettings
    imu: RoverImuSettings | None
    vehicle: Vehicle
    speaker: Speaker
    commands: Commands
    clock: TimeSync
    telemetry: Telemetry
    begun: bool = False
    rates_hz: dict[str, float] = field(default_factory=dict)  # accepted, by message
    timeout_s: float | None = None  # the autopilot's own
    refusal: str = ""  # why it cannot go on, as the end of a sentence
    _accepted_ns: int | None = None
    _asked_ns: int = 0
    _parameter_asked: int = 0
    _time_asked: int = 0
    _parameter_known: bool = False

    def begin(self, autopilot: Autopilot) -> None:
        """Ask for everything that is acknowledged."""
        self.begun = True
        s = self.settings
        if s.autopilot != "auto" and autopilot.name.lower() != s.autopilot:
            raise DeviceError(f"the autopilot is {autopilot.name}, and the settings say {s.autopilot}")
        if self.vehicle.other[1] not in ROVER_TYPES:
            raise DeviceError(f"the vehicle is of MAVLink type {self.vehicle.other[1]}, which is no rover")
        if s.reverse and not autopilot.reverses:
            raise DeviceError(f"{autopilot.name} turns round to where a velocity points; set 'reverse: false'")
        self.timeout_s = autopilot.timeout[1]
        self.commands.ask(REQUEST_MESSAGE, (message_id("AUTOPILOT_VERSION"),), self._version_asked)
        self._ask_for("HEARTBEAT", s.heartbeat_rate_hz, lambda: None)
        self._ask_for("SYS_STATUS", s.status_rate_hz, lambda: None)
        self._ask_for("BATTERY_STATUS", s.status_rate_hz, lambda: None)
        if self.imu is not None:
            name = autopilot.imu_message if self.imu.message == "auto" else self.imu.message
            self._ask_for(name, self.imu.rate_hz, lambda: self._refuse(f"it does not send {name}"))
        self._ask_for_odometry("position" if s.odometry == "position" else "wheels")

    def step(self, now_ns: int, autopilot: Autopilot) -> bool:
        """Go on; return whether all is known.

        Raises:
            DeviceError: what is needed is not to be had.
        """
        if self.refusal:
            raise DeviceError(self.refusal)
        if not self.commands.idle:
            self._accepted_ns = now_ns
            return False
        if self.telemetry.odometry_ns is None:
            if now_ns - (self._accepted_ns or now_ns) > FIRST_NS:
                self._odometry_missing(self.telemetry.source)
            return False
        self._can()
        return self._parameter(now_ns, autopilot) and self._time(now_ns)

    def take(self, message: Message, autopilot: Autopilot) -> None:
        """Take in a parameter's value."""
        if message.param_id == autopilot.timeout[0]:
            self.timeout_s, self._parameter_known = float(message.param_value), True

    def _can(self) -> None:
        can = self.vehicle.capabilities
        if can is not None and not can & CAN_SPEAK_2:
            raise DeviceError("the autopilot does not speak MAVLink 2")
        if can is not None and not can & CAN_FOLLOW_LOCAL_NED:
            raise DeviceError("the autopilot takes no velocity set-points (SET_POSITION_TARGET_LOCAL_NED)")

    def _parameter(self, now_ns: int, autopilot: Autopilot) -> bool:
        """Ask for the autopilot's own time-out; one that has no such parameter does not answer."""
        if self._parameter_known or self._parameter_asked > PARAMETER_TRIES:
            return True
        if now_ns - self._asked_ns > ASK_NS:
            self._asked_ns, self._parameter_asked = now_ns, self._parameter_asked + 1
            self.speaker.ask_parameter(autopilot.timeout[0])
        return False

    def _time(self, now_ns: int) -> bool:
        """Ask for the time a few times; without an answer samples are stamped when they come."""
        if now_ns - self._asked_ns > ASK_NS // CLOCK_TRIES:
            self._asked_ns, self._time_asked = now_ns, self._time_asked + 1
            self.speaker.ask_time(now_ns)
        return self._time_asked > CLOCK_TRIES

    def _version_asked(self, result: Result) -> None:
        if result is not Result.ACCEPTED:  # autopilots before MAV_CMD_REQUEST_MESSAGE
            self.commands.ask(REQUEST_CAPABILITIES, (1.0,), lambda _: None)

    def _ask_for_odometry(self, kind: str) -> None:
        self.telemetry.source, self._accepted_ns = kind, None
        for name in _STREAM_OF[kind]:
            self._ask_for(name, self.settings.rate_hz, lambda: self._odometry_missing(kind))
        if kind == "wheels" and self.settings.wheel_rates == "rpm":
            self._ask_for("RPM", self.settings.rate_hz, lambda: self._refuse("it does not send RPM"))

    def _odometry_missing(self, kind: str) -> None:
        if kind == "wheels" and self.settings.odometry == "auto":
            self._ask_for_odometry("position")
        else:
            self._refuse(f"it does not send {' and '.join(_STREAM_OF[kind])}, which the odometry needs")

    def _ask_for(self, name: str, rate_hz: float, missing: Callable[[], None]) -> None:
        """Ask for a message so often; where that is denied, half as often."""

        def answered(result: Result) -> None:
            if result is Result.ACCEPTED:
                self.rates_hz[name] = rate_hz
                self._expect(name, rate_hz)
            elif result in {Result.DENIED, Result.FAILED} and rate_hz / 2.0 >= SLOWEST_HZ:
                self._ask_for(name, rate_hz / 2.0, missing)
            else:
                missing()

        self.commands.ask(SET_MESSAGE_INTERVAL, (message_id(name), 1e6 / rate_hz), answered)

    def _expect(self, name: str, rate_hz: float) -> None:
        ring = {"WHEEL_DISTANCE": "wheels", "LOCAL_POSITION_NED": "pose"}.get(name, "imu" if name.endswith("IMU") else "")
        if ring in self.telemetry.series:
            self.telemetry.series[ring].period_ns = round(1e9 / rate_hz)

    def _refuse(self, why: str) -> None:
        self.refusal = self.refusal or why
