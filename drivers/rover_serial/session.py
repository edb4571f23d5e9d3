"""What the process at the autopilot does: greets it, arms on the first command, sends set-points, rests, and tells of it.

Sources: MAVLink developer guide (heartbeat, command, time synchronisation and offboard control protocols); ArduPilot, Rover
Commands in Guided Mode; PX4 user guide, Offboard Mode.  ArduPilot drives on for three seconds after the last set-point, so when
commands end zero is sent, again and again for a while, and then it is disarmed.
"""

from __future__ import annotations

import enum
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.interface.devices import DeviceState
from drivers.interface.errors import DeviceError
from drivers.io.session import Port
from drivers.rover_serial.arming import Arming
from drivers.rover_serial.autopilots import Autopilot
from drivers.rover_serial.commands import Commands, Result
from drivers.rover_serial.frames import Frame, Framer, SequenceCounter
from drivers.rover_serial.greeting import Greeting
from drivers.rover_serial.messages import ARM_DISARM, Decoder, Message, Speaker
from drivers.rover_serial.place import Place
from drivers.rover_serial.settings import LinkSettings
from drivers.rover_serial.signing import Verifier, timestamp_of
from drivers.rover_serial.telemetry import Telemetry
from drivers.rover_serial.timesync import TimeSync
from drivers.rover_serial.vehicle import Vehicle
from drivers.rover_serial.wire import Wire, open_wire

HEARTBEAT_NS = 500_000_000  # ours; autopilots expect one a second
ZERO_PERIOD_NS = 50_000_000  # between zeros; PX4 wants more than two a second
SETTLE_NS = 1_500_000_000  # until a heartbeat must show what was acknowledged
CLOCK_NS = 1_000_000_000  # between questions for the time
LOAD_NS = 1_000_000_000
AUTOPILOT_COMPONENT = 1


class Phase(enum.Enum):
    """Where it stands."""

    LISTENING = "listening"  # for a heartbeat
    GREETING = "greeting"
    WAITING = "waiting"  # for its pre-arm checks
    READY = "ready"  # disarmed; the next fresh command arms
    ENTERING = "entering"  # set-points, mode, arming
    DRIVING = "driving"
    FAULTED = "faulted"


class RoverSession:
    """Drives one autopilot."""

    def __init__(
        self,
        settings: LinkSettings,
        port: Port,
        connect: Callable[[Place], Wire] = open_wire,
        unix_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        """Remember; the wire is not touched.  `unix_ns` is asked when it is opened: signatures carry the time of day."""
        self._all, self._settings = settings, settings.base
        self._port, self._health = port, port.health
        self._connect, self._unix_ns = connect, unix_ns
        self._wire: Wire | None = None
        self._verifier = Verifier(settings.key, timestamp_of(unix_ns())) if settings.key is not None else None
        self._phase = Phase.LISTENING

    def open(self) -> None:
        """Open the wire; the autopilot is looked for while it is polled.

        Raises:
            DeviceError: there is no such wire.
        """
        s = self._settings
        try:
            self._wire = self._connect(s.place)
        except OSError as error:
            raise DeviceError(f"{self._port.name}: the autopilot at {s.url} cannot be reached: {error}") from error
        self._framer, self._decoder, self._sequence = Framer(), Decoder(), SequenceCounter()
        self._vehicle, self._clock = Vehicle(), TimeSync()
        self._telemetry = Telemetry(s, self._port, self._clock)
        self._speaker = Speaker(s.own_system_id, s.own_component_id, s.system_id, self._send_bytes)
        if self._all.key is not None and self._verifier is not None:
            self._verifier.timestamp = max(self._verifier.timestamp, timestamp_of(self._unix_ns()))
            self._speaker.sign(self._all.key, self._verifier.timestamp)
        self._commands = Commands(self._speaker.command)
        self._greeting = Greeting(
            s, self._all.imu, self._vehicle, self._speaker, self._commands, self._clock, self._telemetry
        )  # fmt: skip
        self._phase, self._since_ns, self._began_ns = Phase.LISTENING, 0, -1
        self._now_ns = self._heartbeat_ns = self._zero_ns = self._asked_ns = 0
        self._brake_until_ns: int | None = None
        self._arming: Arming | None = None
        self._twist = (0.0, 0.0)  # of the newest order
        self._followed = False  # a heartbeat has shown what was acknowledged
        self._gathering = False
        self._bytes, self._load_ns = 0, 0
        self._health.state, self._health.fault = DeviceState.RECONNECTING, ""

    def wakes_on(self) -> tuple[int, ...]:
        """Return the wire's descriptor, except right after bytes came: others that follow closely are read together."""
        if self._wire is None or self._gathering:
            return ()
        descriptor = self._wire.fileno()
        return (descriptor,) if descriptor >= 0 else ()

    def next_ns(self, now_ns: int) -> int:
        """Return when the next poll is due."""
        if self._gathering:
            return now_ns + round(self._settings.gather_s * 1e9)
        repeats = self._brake_until_ns is not None or self._phase in {Phase.ENTERING, Phase.GREETING}
        return now_ns + (ZERO_PERIOD_NS if repeats else 2 * ZERO_PERIOD_NS)

    def poll(self, now_ns: int) -> None:
        """Take in what has come and do what is due.

        Raises:
            DeviceError: the wire is gone, or the autopilot is silent, is not what was expected, or has restarted.
        """
        self._now_ns = now_ns
        if self._began_ns < 0:
            self._began_ns = self._load_ns = now_ns
        try:
            self._receive(now_ns)
            self._check_silence(now_ns)
            self._advance(now_ns)
            self._commands.step(now_ns)
            self._brake(now_ns)
            self._chatter(now_ns)
        except DeviceError as error:
            raise DeviceError(f"{self._port.name}: {error}") from error
        self._tell(now_ns)

    def send(self, values: NDArray[np.float64], now_ns: int) -> None:
        """Send a twist: vx [m/s] and wz [rad/s], shape (2,); while it is being armed zero, and the twist once it is."""
        self._now_ns, self._brake_until_ns = now_ns, None
        vx_m_s, wz_rad_s = values.tolist()
        self._twist = (vx_m_s, wz_rad_s)
        if self._phase is Phase.READY:
            self._enter(now_ns)
        if self._phase is Phase.DRIVING:
            self._set_point(vx_m_s, wz_rad_s, now_ns)
        elif self._phase is Phase.ENTERING:
            self._set_point(0.0, 0.0, now_ns)

    def rest(self) -> None:
        """Send zero now, and go on for a while; then it is disarmed."""
        if self._phase in {Phase.DRIVING, Phase.ENTERING} and self._brake_until_ns is None:
            self._brake_until_ns = self._now_ns + round(self._settings.brake_s * 1e9)
            self._set_point(0.0, 0.0, self._now_ns)

    def clear_faults(self) -> None:
        """Be ready for the next command, which arms."""
        if self._phase is Phase.FAULTED:
            self._be_ready()

    def close(self) -> None:
        """Disarm what stands, and let go of the wire.  What still rolls brakes at zero until the autopilot's time-out."""
        wire = self._wire
        try:
            if wire is not None and self._phase in {Phase.DRIVING, Phase.ENTERING} and self._telemetry.standing:
                self._speaker.command(ARM_DISARM, 0, (0.0,))
        finally:
            self._wire = None
            if wire is not None:
                wire.close()

    def _receive(self, now_ns: int) -> None:
        assert self._wire is not None
        data = self._wire.receive()
        self._gathering = bool(data) and self._settings.gather_s > 0.0
        self._bytes += len(data)
        for frame in self._framer.feed(data):
            self._take(frame, now_ns)
        self._health.dropped += self._framer.damaged
        self._framer.damaged = 0
        if self._telemetry.restarted:
            raise DeviceError("the autopilot has restarted")

    def _take(self, frame: Frame, now_ns: int) -> None:
        """Take in one frame of the rover's autopilot; count what comes from others, or without the key."""
        if frame.system != self._settings.system_id or frame.component != AUTOPILOT_COMPONENT:
            self._health.foreign += 1
            return
        if self._verifier is not None and not self._verifier.accepts(frame):
            self._health.foreign += 1
            return
        self._health.dropped += self._sequence.lost_before(frame.sequence)
        message = self._decoder.decode(frame)
        if message is None:
            return
        self._health.received += 1
        name = message.get_type()
        self._vehicle.take(name, message, now_ns)
        self._telemetry.take(name, message, now_ns)
        self._answer(name, message, now_ns)

    def _answer(self, name: str, message: Message, now_ns: int) -> None:
        s = self._settings
        if name == "COMMAND_ACK" and message.target_system in {0, s.own_system_id}:
            self._commands.acknowledged(message.command, Result.of(message.result), now_ns)
        elif name == "TIMESYNC" and message.tc1:
            self._clock.answered(message.ts1, message.tc1, now_ns)
        elif name == "TIMESYNC":
            self._speaker.tell_time(message.ts1, now_ns)
        elif name == "PARAM_VALUE" and self._vehicle.autopilot is not None:
            self._greeting.take(message, self._vehicle.autopilot)

    def _check_silence(self, now_ns: int) -> None:
        s = self._settings
        if self._phase in {Phase.LISTENING, Phase.GREETING}:
            if now_ns - self._began_ns > s.connect_s * 1e9:
                raise DeviceError(self._why_not())
            return
        silent_ns = round(s.silent_s * 1e9)
        if now_ns - (self._telemetry.odometry_ns or 0) > silent_ns:
            raise DeviceError(f"no odometry has come from the autopilot at {s.url} for {s.silent_s:g} s")
        if self._all.imu is not None and now_ns - (self._telemetry.imu_ns or 0) > silent_ns:
            raise DeviceError(f"no inertial samples have come from the autopilot at {s.url} for {s.silent_s:g} s")

    def _why_not(self) -> str:
        s = self._settings
        if self._phase is Phase.GREETING:
            return f"the autopilot at {s.url} did not answer everything within {s.connect_s:g} s"
        if self._verifier is not None and self._verifier.refused:
            return f"what comes from {s.url} is not signed with the key in {s.signing_key}, or is old"
        if self._vehicle.heartbeats:
            return f"the autopilot at {s.url} is neither ArduPilot nor PX4 (MAV_AUTOPILOT {self._vehicle.other[0]})"
        if self._framer.older:
            return f"what is at {s.url} speaks MAVLink 1 only"
        others = f"; {self._health.foreign} messages came from others" if self._health.foreign else ""
        return f"no heartbeat of system {s.system_id} came from {s.url} within {s.connect_s:g} s{others}"

    def _advance(self, now_ns: int) -> None:
        """Go from phase to phase."""
        autopilot = self._vehicle.autopilot
        if autopilot is None:
            return
        match self._phase:
            case Phase.LISTENING:
                self._change(Phase.GREETING, now_ns)
                self._greeting.begin(autopilot)
            case Phase.GREETING:
                if self._greeting.step(now_ns, autopilot):
                    self._greeted(autopilot, now_ns)
            case Phase.WAITING:
                self._wait(now_ns)
            case Phase.ENTERING:
                self._go_on_entering(now_ns)
            case Phase.DRIVING:
                self._followed = self._followed or self._vehicle.follows
                unconfirmed = not self._followed and now_ns - self._since_ns <= SETTLE_NS
                if not self._vehicle.follows and not unconfirmed:
                    what = f"has left {autopilot.mode_name}" if self._vehicle.armed else "has disarmed"
                    self._fail(f"the autopilot {what}", now_ns)

    def _greeted(self, autopilot: Autopilot, now_ns: int) -> None:
        greeting, health = self._greeting, self._health
        self._telemetry.live = True
        source = "WHEEL_DISTANCE" if self._telemetry.source == "wheels" else "LOCAL_POSITION_NED"
        health.firmware, health.serial = f"{autopilot.name} {self._vehicle.firmware}".strip(), self._vehicle.serial
        signed = ", signed" if self._verifier is not None else ""
        stops = f"; stops by itself {greeting.timeout_s:g} s after the last set-point" if greeting.timeout_s is not None else ""
        health.protocol = f"MAVLink 2{signed}, odometry from {source} at {greeting.rates_hz[source]:g} Hz{stops}"
        if self._port.reopened:
            if self._vehicle.follows:  # what armed it was lost with the wire, or an earlier process
                self._set_point(0.0, 0.0, now_ns)
                self._disarm()
            self._fail("it was lost and is back; it is armed again after the operator's reset", now_ns)
        else:
            self._change(Phase.WAITING, now_ns)

    def _wait(self, now_ns: int) -> None:
        """Wait until its pre-arm checks have passed, where it tells of them."""
        if self._vehicle.ready is not False:
            self._be_ready()
        elif now_ns - self._since_ns > self._settings.ready_s * 1e9:
            why = self._vehicle.reason(now_ns) or "it does not say why"
            raise DeviceError(f"the autopilot is not ready to be armed after {self._settings.ready_s:g} s: {why}")

    def _enter(self, now_ns: int) -> None:
        """Begin to arm."""
        assert self._vehicle.autopilot is not None
        self._change(Phase.ENTERING, now_ns)
        self._arming = Arming(self._vehicle.autopilot, self._commands, self._settings.arm_s, now_ns)

    def _go_on_entering(self, now_ns: int) -> None:
        """Send zero meanwhile."""
        if self._brake_until_ns is None and now_ns - self._zero_ns >= ZERO_PERIOD_NS:
            self._set_point(0.0, 0.0, now_ns)
        arming = self._arming
        assert arming is not None
        arming.step(now_ns)
        if arming.done:
            self._change(Phase.DRIVING, now_ns)
            self._followed = False
            if self._brake_until_ns is None:
                self._set_point(*self._twist, now_ns)
        elif arming.refusal:
            self._fail(arming.refusal, now_ns)

    def _disarm(self) -> None:
        """Ask for nothing but that."""
        if self._arming is not None:
            self._arming.abandon()
        self._commands.forget()
        self._commands.ask(ARM_DISARM, (0.0,), lambda _: None)

    def _change(self, phase: Phase, now_ns: int) -> None:
        self._phase, self._since_ns = phase, now_ns

    def _be_ready(self) -> None:
        self._change(Phase.READY, self._now_ns)
        self._brake_until_ns = None
        self._health.state, self._health.fault = DeviceState.OPEN, ""

    def _fail(self, fault: str, now_ns: int) -> None:
        """Take no more commands until the operator's reset; what still drives is told to stand."""
        if self._phase in {Phase.ENTERING, Phase.DRIVING}:
            self._set_point(0.0, 0.0, now_ns)
            self._disarm()
        reason = self._vehicle.reason(now_ns)
        self._change(Phase.FAULTED, now_ns)
        self._health.state = DeviceState.FAULTED
        self._health.fault = f"{self._port.name}: {fault}{f': {reason}' if reason else ''}"

    def _brake(self, now_ns: int) -> None:
        """After the last command repeat zero for a while; then disarm, and wait for the next."""
        if self._brake_until_ns is None or self._phase not in {Phase.DRIVING, Phase.ENTERING}:
            return
        if now_ns < self._brake_until_ns:
            if now_ns - self._zero_ns >= ZERO_PERIOD_NS:
                self._set_point(0.0, 0.0, now_ns)
            return
        self._disarm()
        self._be_ready()

    def _chatter(self, now_ns: int) -> None:
        """Send what is sent all the time: our heartbeat, and the question for the time."""
        if now_ns - self._heartbeat_ns >= HEARTBEAT_NS:
            self._heartbeat_ns = now_ns
            self._speaker.heartbeat()
        if self._telemetry.live and now_ns - self._asked_ns >= CLOCK_NS:
            self._asked_ns = now_ns
            self._speaker.ask_time(now_ns)

    def _set_point(self, vx_m_s: float, wz_rad_s: float, now_ns: int) -> None:
        autopilot = self._vehicle.autopilot
        if autopilot is not None and self._wire is not None:
            self._zero_ns = now_ns
            target = autopilot.target(vx_m_s, wz_rad_s, self._settings.heading_gain_per_s)
            self._speaker.set_point(now_ns, autopilot, target)

    def _send_bytes(self, data: bytes) -> None:
        if self._wire is not None:
            self._bytes += len(data)
            self._wire.send(data)

    def _tell(self, now_ns: int) -> None:
        health, vehicle = self._health, self._vehicle
        if vehicle.battery_v is not None:
            health.battery_v = vehicle.battery_v
        if vehicle.battery_fraction is not None:
            health.battery_fraction = vehicle.battery_fraction
        if now_ns - self._load_ns >= LOAD_NS:
            bytes_s = self._settings.place.bytes_s
            if bytes_s is not None:
                health.bus_load = self._bytes / (bytes_s * (now_ns - self._load_ns) * 1e-9)
            self._bytes, self._load_ns = 0, now_ns
