"""A rover autopilot that speaks MAVLink 2 and drives a skid-steer base, as ArduPilot Rover or PX4 does."""

from __future__ import annotations

import math
from collections import deque
from pathlib import Path
from typing import Any, ClassVar, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.interface.commands import BodyTwist
from drivers.interface.kinematics import SkidSteer
from drivers.interface.samples import ImuSample
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.drive import Drive
from sim_drivers.firmware.firmware import FirmwareSetup
from sim_drivers.firmware.rover_faults import LinkFaults
from sim_drivers.firmware.rover_port import RoverPort, Where
from sim_drivers.firmware.rover_settings import RoverAutopilotSettings
from sim_drivers.firmware.rover_state import ACCEPTED, DENIED, UNSUPPORTED, RoverState, SetPoint
from sim_drivers.firmware.rover_voice import Measured, RoverVoice
from sim_drivers.imu import ImuSettings, SimImu
from sim_drivers.skid_steer_base import WHEELS, SkidSteerChassis, SkidSteerSettings
from sim_drivers.wheel_encoders import WheelEncoders
from sim_drivers.world import SECOND_NS, MujocoWorld

F64 = NDArray[np.float64]
IMU_HZ = 100.0
FOREVER_NS = 1_000_000_000
JUMP_NS = 5_000_000_000
LEFT, RIGHT = (0, 2), (1, 3)  # of the four wheels
OTHER_SYSTEM = 77


class RoverWire(Protocol):
    """What both ends must agree on: the settings of the `rover_serial` driver."""

    @property
    def place(self) -> Where:
        """Where the wire is."""
        ...

    @property
    def system_id(self) -> int:
        """MAVLink system id of the rover."""
        ...

    @property
    def own_system_id(self) -> int:
        """The ground station's."""
        ...

    @property
    def signing_key(self) -> Path | None:
        """File with the key, or none."""
        ...

    @property
    def wheel_radius_m(self) -> float:
        """Of every wheel."""
        ...

    @property
    def effective_track_m(self) -> float:
        """Between the sides."""
        ...

    @property
    def wheel_order(self) -> tuple[int, int]:
        """Places of left and right in WHEEL_DISTANCE."""
        ...

    @property
    def wheel_signs(self) -> tuple[int, int]:
        """-1: that encoder counts the other way round."""
        ...


class RoverAutopilot:
    """Wakes up disarmed; its wheels go where set-points in the right mode say, and stand when they cease."""

    Settings: ClassVar[type[Settings]] = RoverAutopilotSettings
    max_step_s = SkidSteerChassis.max_step_s
    period_ns = 4 * SkidSteerChassis.period_ns

    def __init__(self, driver_settings: RoverWire, settings: RoverAutopilotSettings, setup: FirmwareSetup) -> None:
        """Join the world."""
        self._wire, self._settings, self._setup = driver_settings, settings, setup
        self._kinematics = SkidSteer(driver_settings.wheel_radius_m, driver_settings.effective_track_m, len(WHEELS))
        chassis = SkidSteerSettings(
            mass_kg=settings.mass_kg, friction=settings.friction, wheel_radius_m=driver_settings.wheel_radius_m,
            wheel_radius_error=settings.wheel_radius_error,
        )  # fmt: skip
        self._chassis = SkidSteerChassis(chassis)
        imu = ImuSettings(rate_hz=IMU_HZ, latency_s=0.0, loss_probability=0.0, x_m=0.0, z_m=0.2, noise=settings.imu_noise)
        self._imu = SimImu(imu, setup.device("imu"))
        self._port = RoverPort(driver_settings.place, setup.name)
        self._faults = LinkFaults(settings.faults, stream(setup.seed, f"{setup.name}.faults"))
        self._losses = stream(setup.seed, f"{setup.name}.loss")
        self._noise = stream(setup.seed, f"{setup.name}.position")
        self._body, self._start, self._velocity = 0, np.zeros(3), np.zeros(6)
        self._zero_rad = np.zeros(len(WHEELS))
        self._power_up(0)
        setup.world.add(self)
        setup.world.add(self._chassis.tyres)

    @property
    def listens(self) -> str:
        """The wire."""
        return f"{self._port.listens}, system {self._wire.system_id}, {self._settings.kind}"

    @property
    def state(self) -> RoverState:
        """Its state machine."""
        return self._state

    def open(self) -> None:
        """Bind the wire.

        Raises:
            DeviceError: it cannot be bound.
        """
        self._imu.open()
        self._port.open()

    def close(self) -> None:
        """Let go of the wire."""
        self._port.close()
        self._imu.close()

    def build(self, spec: Any, base: Any) -> None:
        """Add the base."""
        self._chassis.build(spec, base)

    def bind(self, world: MujocoWorld) -> None:
        """Find wheels and body."""
        self._chassis.bind(world)
        self._body = int(world.model.body("base").id)
        self._start = np.array(world.data.xpos[self._body])
        self._zero_rad = self._chassis.wheel_angles(world).copy()
        self._chassis.drive(world, np.zeros(len(WHEELS)))

    def act(self, world: MujocoWorld) -> None:
        """Hear what has come, drive, and say what is due."""
        now_ns, scene_ns = world.now_ns, world.scene_ns
        self._strike(now_ns, scene_ns)
        measured = self._measure(world)
        self._hear(now_ns, scene_ns, measured)
        speed_m_s, turn_rad_s = self._state.step(measured.yaw_rad, now_ns)
        self._follow(world, BodyTwist(speed_m_s, 0.0, -turn_rad_s))
        if self._alive and now_ns >= self._ready_ns:
            self._voice.step(now_ns, measured, self._state)
            self._meddle(now_ns, scene_ns)
        while self._on_the_way and self._on_the_way[0][0] <= now_ns:
            self._port.send(self._on_the_way.popleft()[1])

    def _power_up(self, now_ns: int) -> None:
        s = self._settings
        key = self._wire.signing_key
        self._boot_ns, self._boot_host_ns, self._jump_ns = now_ns, self._setup.host.now_ns, 0
        self._ready_ns, self._alive = now_ns + round(s.boot_s * SECOND_NS), True
        self._state = RoverState(s, now_ns)
        self._voice = RoverVoice(s, self._wire.system_id, None if key is None else _key(key), self._emit)
        self._drive = Drive(s.drive)
        self._drive.step(now_ns)
        rng = stream(self._setup.seed, f"{self._setup.name}.encoders")
        self._encoders = WheelEncoders(s.encoders, rng, len(WHEELS), now_ns - 1)
        self._turned_rad, self._rates_rad_s = np.zeros(len(WHEELS)), np.zeros(len(WHEELS))
        self._newest_imu: ImuSample | None = None
        self._on_the_way: deque[tuple[int, bytes]] = deque([(now_ns, b"\xfd\x00\x7fap boot\r\n\xfe")])  # bytes that are no frame
        self._scene_ns = 0

    def _measure(self, world: MujocoWorld) -> Measured:
        """Return what it knows, turned from x north, y west, z up."""
        if self._encoders.due(world.now_ns):
            self._encoders.measure(world.now_ns, self._chassis.wheel_angles(world) - self._zero_rad)
            for sample in self._encoders.delivery.drain(world.now_ns):
                self._turned_rad, self._rates_rad_s = sample.position_rad, sample.velocity_rad_s
        self._newest_imu = (self._imu.drain() or (self._newest_imu,))[-1]
        mujoco.mj_objectVelocity(world.model, world.data, mujoco.mjtObj.mjOBJ_BODY, self._body, self._velocity, 0)
        place = world.data.xpos[self._body] - self._start
        matrix = world.data.xmat[self._body].reshape(3, 3)
        speed = float(np.hypot(self._velocity[3], self._velocity[4]))
        noise_m = math.nan if self._faults.active("nan", world.scene_ns) else self._settings.position_noise_m
        return Measured(
            clock_ns=self._clock_ns(),
            north_m=float(place[0]) + noise_m * float(self._noise.standard_normal()),
            east_m=-float(place[1]) + noise_m * float(self._noise.standard_normal()),
            velocity_m_s=(float(self._velocity[3]), -float(self._velocity[4])),
            yaw_rad=-math.atan2(matrix[1, 0], matrix[0, 0]),
            yaw_rate_rad_s=-float(self._velocity[2]),
            distances_m=tuple(distance + 0.0 * noise_m for distance in self._distances()),
            rpm=self._rpm(),
            imu=self._newest_imu,
            voltage_v=self._settings.battery_v - self._settings.battery_sag_v * min(speed, 1.0),
        )

    def _clock_ns(self) -> int:
        """Return how long ago it booted, by its own clock, which keeps pace with the host's."""
        return self._setup.host.now_ns - self._boot_host_ns + self._jump_ns + SECOND_NS

    def _distances(self) -> tuple[float, ...]:
        """Return how far each side's wheels have gone [m], where the settings say that they are wired."""
        wire = self._wire
        each = [0.0] * (max(wire.wheel_order) + 1)
        for index, sign, side in zip(wire.wheel_order, wire.wheel_signs, (LEFT, RIGHT), strict=True):
            each[index] = sign * wire.wheel_radius_m * float(np.mean(self._turned_rad[list(side)]))
        return tuple(each)

    def _rpm(self) -> tuple[float, float]:
        left, right = (float(np.mean(self._rates_rad_s[list(side)])) * 60.0 / (2.0 * math.pi) for side in (LEFT, RIGHT))
        return self._wire.wheel_signs[0] * left, self._wire.wheel_signs[1] * right

    def _follow(self, world: MujocoWorld, twist: BodyTwist) -> None:
        if self._state.armed and self._alive:
            self._drive.command(twist, world.now_ns + FOREVER_NS, world.now_ns)
        else:
            self._drive.stop()
        vx, vy, wz = self._drive.step(world.now_ns).tolist()
        self._chassis.drive(world, self._kinematics.wheel_rates(BodyTwist(vx, vy, wz)))

    def _hear(self, now_ns: int, scene_ns: int, measured: Measured) -> None:
        self._scene_ns = scene_ns
        data = self._port.receive()
        if not data or not self._alive or now_ns < self._ready_ns or self._faults.active("deaf", scene_ns):
            return
        for message in self._voice.link.parse_buffer(data) or ():
            self._take(message, now_ns, measured)

    def _take(self, message: Any, now_ns: int, measured: Measured) -> None:
        name = message.get_type()
        if name == "HEARTBEAT" and message.get_srcSystem() == self._wire.own_system_id:
            self._state.heard_station(now_ns)
        elif name == "TIMESYNC" and message.tc1 == 0:
            self._voice.say(mavlink.MAVLink_timesync_message(measured.clock_ns, message.ts1))
        if getattr(message, "target_system", None) != self._wire.system_id:
            return
        if name == "COMMAND_LONG":
            self._obey(message, now_ns)
        elif name == "SET_POSITION_TARGET_LOCAL_NED":
            self._take_set_point(message, measured.yaw_rad, now_ns)
        elif name == "PARAM_REQUEST_READ":
            self._tell_parameter(message.param_id)

    def _take_set_point(self, message: Any, yaw_rad: float, now_ns: int) -> None:
        values = (message.vx, message.vy, message.vz, message.yaw_rate)
        if not all(map(math.isfinite, values)):
            self._alive = False  # the simulated ArduPilot aborted
            return
        point = SetPoint(message.coordinate_frame, message.type_mask, *values)
        self._state.take(point, yaw_rad, now_ns)

    def _obey(self, message: Any, now_ns: int) -> None:
        result, follow_up = UNSUPPORTED, None
        match message.command:
            case mavlink.MAV_CMD_REQUEST_MESSAGE if int(message.param1) == mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
                result, follow_up = ACCEPTED, self._voice.version()
            case mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
                result, follow_up = ACCEPTED, self._voice.version()
            case mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
                result = ACCEPTED if self._voice.set_interval(int(message.param1), message.param2, now_ns) else DENIED
            case mavlink.MAV_CMD_DO_SET_MODE:
                result = self._state.set_mode(message.param1, message.param2, message.param3, now_ns)
            case mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
                result = self._state.arm(message.param1 == 1.0, now_ns)
        target = (message.get_srcSystem(), message.get_srcComponent())
        self._voice.say(mavlink.MAVLink_command_ack_message(message.command, result, 0, 0, *target))
        if follow_up is not None:
            self._voice.say(follow_up)

    def _tell_parameter(self, name: str) -> None:
        known = {"px4": "COM_OF_LOSS_T", "ardupilot": "GUID_TIMEOUT"}[self._settings.kind]
        if name == known and self._settings.has_timeout_parameter:
            kind = mavlink.MAV_PARAM_TYPE_REAL32
            self._voice.say(mavlink.MAVLink_param_value_message(name.encode(), self._state.timeout_s, kind, 1000, 500))

    def _emit(self, frame: bytes) -> None:
        """Put a frame on its way, unless it is lost, or the script has it otherwise."""
        if self._losses.random() < self._settings.loss_probability:
            return
        due_ns = self._setup.world.now_ns + round(self._settings.latency_s * SECOND_NS)
        for sent in self._faults.sent(frame, self._scene_ns):
            self._on_the_way.append((due_ns, sent))

    def _strike(self, now_ns: int, scene_ns: int) -> None:
        """Let happen by itself what the script says."""
        if self._faults.strikes("disarm", scene_ns):
            self._state.disarm()
            self._state.texts.append((2, "Crash: Disarming"))
        if self._faults.strikes("leave_mode", scene_ns):
            self._state.leave()
        if self._faults.strikes("clock_jump", scene_ns):
            self._jump_ns += JUMP_NS
        if self._faults.strikes("disconnect", scene_ns):
            self._port.cut()
        if self._faults.strikes("reboot", scene_ns):
            self._zero_rad = self._zero_rad + self._turned_rad
            self._power_up(now_ns)

    def _meddle(self, now_ns: int, scene_ns: int) -> None:
        """Send what others send: a second vehicle, or somebody without the key."""
        for kind, system in (("other_system", OTHER_SYSTEM), ("forge", self._wire.system_id)):
            if self._faults.active(kind, scene_ns) and now_ns % 50_000_000 < self.period_ns:
                stranger = mavlink.MAVLink(None, srcSystem=system, srcComponent=1)
                self._port.send(bytes(self._voice.heartbeat(RoverState(self._settings, 0), now_ns).pack(stranger)))


def _key(path: Path) -> bytes:
    """Return the key in a file, raw or as hexadecimal digits."""
    content = path.read_bytes()
    return content if len(content) == 32 else bytes.fromhex(content.decode())
