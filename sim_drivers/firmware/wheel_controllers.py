"""Three motor controllers on a CAN bus that turn the wheels of an omni base, as an ODrive does under CANSimple."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.firmware.axis import Axis
from sim_drivers.firmware.can_port import CanPort, CanWire
from sim_drivers.firmware.can_simple import (
    Command,
    Fault,
    Frame,
    floats,
    heartbeat,
    version_payload,
    words,
)
from sim_drivers.firmware.firmware import FirmwareSetup
from sim_drivers.firmware.frame_faults import FrameFaults
from sim_drivers.firmware.wheel_power import WheelPower
from sim_drivers.firmware.wheel_settings import WheelControllerSettings
from sim_drivers.omni_rollers import WHEELS, RollerOmniChassis
from sim_drivers.wheel_encoders import EncoderSettings, WheelEncoders
from sim_drivers.world import SECOND_NS, MujocoWorld

TURN = 2.0 * math.pi
F64 = NDArray[np.float64]


class OmniCanWire(CanWire, Protocol):
    """What both ends must agree on: the settings of the `omni_can` driver."""

    @property
    def node_ids(self) -> tuple[int, int, int]:
        """CAN node of each wheel."""
        ...

    @property
    def signs(self) -> tuple[int, int, int]:
        """Of each motor: -1 turns the other way round."""
        ...

    @property
    def gear_ratio(self) -> float:
        """Turns of the motor for one of the wheel."""
        ...

    @property
    def nominal(self) -> OmniThreeWheel:
        """The geometry on the drawing."""
        ...


class WheelControllers:
    """Three axes that wake up idle, and a base that goes where its wheels take it; a disarmed axis lets its wheel coast."""

    Settings: ClassVar[type[Settings]] = WheelControllerSettings
    max_step_s = RollerOmniChassis.max_step_s
    period_ns = RollerOmniChassis.period_ns

    def __init__(self, driver_settings: OmniCanWire, settings: WheelControllerSettings, setup: FirmwareSetup) -> None:
        """Join the world."""
        self._settings = settings
        self._setup = setup
        self._nodes = tuple(driver_settings.node_ids)
        self._motor_from_wheel = np.array(driver_settings.signs) * driver_settings.gear_ratio  # (3,)
        size_m = (settings.radius_m, settings.height_m)
        self._chassis = RollerOmniChassis(_true(driver_settings.nominal, settings), settings.mass_kg, size_m, settings.torque_nm)
        self._port = CanPort(driver_settings, setup.name)
        self._faults = FrameFaults(settings.faults, stream(setup.seed, f"{setup.name}.faults"))
        self._losses = stream(setup.seed, f"{setup.name}.loss")
        self._servos = slice(0, 0)
        self._velocities: list[int] = []
        self._zero_rad = np.zeros(3)  # of the motors; an encoder counts from where its axis woke up
        self._power_up(0)
        setup.world.add(self)

    @property
    def listens(self) -> str:
        """The bus and the nodes on it."""
        return f"CAN {self._port.place}, nodes {', '.join(map(str, self._nodes))}, firmware {self._settings.version}"

    @property
    def axes(self) -> tuple[Axis, ...]:
        """The axes, in the order of the wheels."""
        return tuple(self._axes)

    def open(self) -> None:
        """Come on the bus.

        Raises:
            DeviceError: there is no such bus.
        """
        self._port.open()

    def close(self) -> None:
        """Leave the bus."""
        self._port.close()

    def build(self, spec: Any, base: Any) -> None:
        """Add the base; every drive can be switched off by itself."""
        self._chassis.build(spec, base)
        for index, name in enumerate(WHEELS):
            spec.joint(name).frictionloss = self._settings.friction_nm
            spec.actuator(name).group = index + 1

    def bind(self, world: MujocoWorld) -> None:
        """Find wheels and drives; nothing is armed yet."""
        self._chassis.bind(world)
        first = int(world.model.actuator(WHEELS[0]).id)
        self._servos = slice(first, first + 3)
        self._velocities = [int(world.model.joint(name).dofadr[0]) for name in WHEELS]
        self._drive(world, np.zeros(3))

    def act(self, world: MujocoWorld) -> None:
        """Hear what has come, advance the axes, drive the wheels, send what is due."""
        now_ns = world.now_ns
        turns = self._measure(world)
        self._hear(world, turns)
        velocity = self._velocity_rad_s / TURN
        self._strike(world)
        targets = [axis.step(now_ns, turns[i], velocity[i]) for i, axis in enumerate(self._axes)]
        self._drive(world, np.array(targets) * TURN / self._motor_from_wheel)
        torque_nm = np.where([axis.armed for axis in self._axes], world.data.actuator_force[self._servos], 0.0)
        self._power.step(now_ns, torque_nm, world.data.qvel[self._velocities])
        if now_ns >= self._ready_ns:
            self._send_due(now_ns, world.scene_ns)
        self._flush(now_ns)

    def _power_up(self, now_ns: int) -> None:
        settings = self._settings
        encoder = EncoderSettings(
            rate_hz=1e9 / self.period_ns, counts_per_rev=settings.encoder_counts_per_turn, latency_s=0.0, loss_probability=0.0,
            velocity_lag_s=0.005, buffered_samples=4,
        )  # fmt: skip
        self._encoders = WheelEncoders(encoder, stream(self._setup.seed, f"{self._setup.name}.encoders"), 3, now_ns - 1)
        self._position_rad, self._velocity_rad_s = np.zeros(3), np.zeros(3)
        self._axes = [Axis(settings.axis, settings.version, now_ns) for _ in self._nodes]
        self._power = WheelPower(settings.power, now_ns)
        self._ready_ns = now_ns + round(settings.boot_s * SECOND_NS)
        self._due_ns = dict.fromkeys(self._cyclic(), self._ready_ns)
        self._on_the_way: deque[tuple[int, Frame]] = deque()

    def _cyclic(self) -> dict[Command, int]:
        """Return the period [ns] of each message that is sent unasked."""
        s = self._settings
        periods = {
            Command.HEARTBEAT: s.heartbeat_ms,
            Command.GET_ENCODER_ESTIMATES: s.encoder_ms,
            Command.GET_BUS_VOLTAGE_CURRENT: s.bus_ms,
            Command.GET_ERROR: s.error_ms,
            Command.GET_TEMPERATURE: s.temperature_ms if s.version == "0.6" else 0,
        }
        return {command: period_ms * 1_000_000 for command, period_ms in periods.items() if period_ms}

    def _measure(self, world: MujocoWorld) -> F64:
        """Return how far the motors have turned since power-up [turn], shape (3,), as the encoders count."""
        if self._encoders.due(world.now_ns):
            self._encoders.measure(world.now_ns, self._motor_rad(world) - self._zero_rad)
            for sample in self._encoders.delivery.drain(world.now_ns):
                self._position_rad, self._velocity_rad_s = sample.position_rad, sample.velocity_rad_s
        return self._position_rad / TURN

    def _motor_rad(self, world: MujocoWorld) -> F64:
        return self._motor_from_wheel * self._chassis.wheel_angles(world)

    def _hear(self, world: MujocoWorld, turns: F64) -> None:
        for frame in self._port.receive():
            if frame.node not in self._nodes or world.now_ns < self._ready_ns:
                continue
            index = self._nodes.index(frame.node)
            if self._faults.active("deaf", world.scene_ns, frame.node):
                continue
            if frame.command == Command.REBOOT:
                self._reboot(world, index)
            elif frame.is_request or not frame.command_is_report:
                self._axes[index].take(frame, world.now_ns, turns[index])
                if frame.is_request:
                    self._send(index, frame.command, world.now_ns, world.scene_ns)

    def _strike(self, world: MujocoWorld) -> None:
        """Let happen by itself what the script says."""
        for index, node in enumerate(self._nodes):
            if self._faults.strikes("estop", world.scene_ns, node):
                self._axes[index].fail(Fault.ESTOP)
            if self._faults.strikes("drive", world.scene_ns, node):
                self._axes[index].fail(Fault.DRIVE)
            if self._faults.strikes("reboot", world.scene_ns, node):
                self._reboot(world, index)
        for frame in self._faults.flood(world.scene_ns, self.period_ns / SECOND_NS):
            self._port.send(frame)

    def _reboot(self, world: MujocoWorld, index: int) -> None:
        """Power one axis up anew: idle, its encoder counts from where the wheel stands."""
        self._zero_rad[index] = self._motor_rad(world)[index]
        self._axes[index] = Axis(self._settings.axis, self._settings.version, world.now_ns)

    def _drive(self, world: MujocoWorld, rates_rad_s: F64) -> None:
        """Run armed wheels at these rates as far as torque allows; MuJoCo leaves out the drives whose group is disabled."""
        self._chassis.drive(world, rates_rad_s)
        world.model.opt.disableactuator = sum(1 << (i + 1) for i, axis in enumerate(self._axes) if not axis.armed)

    def _send_due(self, now_ns: int, scene_ns: int) -> None:
        for command, period_ns in self._cyclic().items():
            if now_ns >= self._due_ns[command]:
                self._due_ns[command] += max(1, (now_ns - self._due_ns[command]) // period_ns + 1) * period_ns
                for index in range(len(self._nodes)):
                    self._send(index, command, now_ns, scene_ns)

    def _send(self, index: int, command: int, now_ns: int, scene_ns: int) -> None:
        """Put a message on its way, unless it is unknown, lost, or the script has it otherwise."""
        payload = self._payload(index, command)
        if payload is None or self._losses.random() < self._settings.loss_probability:
            return
        frame = self._faults.sent(Frame(self._nodes[index], command, payload), scene_ns)
        if frame is not None:
            self._on_the_way.append((now_ns + round(self._settings.latency_s * SECOND_NS), frame))

    def _flush(self, now_ns: int) -> None:
        while self._on_the_way and self._on_the_way[0][0] <= now_ns:
            self._port.send(self._on_the_way.popleft()[1])

    def _payload(self, index: int, command: int) -> bytes | None:
        """Return what an axis answers to a request; None: this version knows no such message."""
        axis, new = self._axes[index], self._settings.version == "0.6"
        turns, turns_s = self._position_rad[index] / TURN, self._velocity_rad_s[index] / TURN
        counts = round(turns * self._settings.encoder_counts_per_turn)
        match command:
            case Command.HEARTBEAT:
                faulty = Fault.CONTROLLER in axis.faults
                return heartbeat(self._settings.version, axis.error_word, axis.state, axis.result, faulty)
            case Command.GET_ENCODER_ESTIMATES:
                return floats(turns, turns_s)
            case Command.GET_BUS_VOLTAGE_CURRENT:
                return floats(self._power.voltage_v, self._power.current_a(index))
            case Command.GET_IQ:
                return floats(*self._power.iq_a(index))
            case Command.GET_ERROR:
                return words(axis.active_word, axis.disarm_word) if new else words(axis.active_word & Fault.DRIVE.bit("0.5"), 0)
            case Command.GET_VERSION if new:
                return version_payload((0, 6, 10))
            case Command.GET_TEMPERATURE if new:
                return floats(*self._power.temperature_c(index))
            case Command.GET_ENCODER_COUNT if not new:
                return words(counts & 0xFFFF_FFFF, counts % self._settings.encoder_counts_per_turn)
            case Command.GET_ENCODER_ERROR if not new:
                return words(0, 0)
            case Command.GET_CONTROLLER_ERROR if not new:
                return words(int(Fault.CONTROLLER in axis.faults), 0)
        return None


def _true(nominal: OmniThreeWheel, settings: WheelControllerSettings) -> OmniThreeWheel:
    radius = tuple(r * (1.0 + e) for r, e in zip(nominal.wheel_radius_m, settings.wheel_radius_error, strict=True))
    a, b, c = radius
    return OmniThreeWheel((a, b, c), nominal.wheel_distance_m, nominal.wheel_bearing_rad, settings.wheel_heading_error_rad)
