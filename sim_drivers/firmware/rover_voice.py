"""What an emulated autopilot says, and how often: MAVLink 2 frames of what it measures, signed where it has a key."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.interface.samples import ImuSample
from sim_drivers.firmware.rover_settings import RoverAutopilotSettings
from sim_drivers.firmware.rover_state import SECOND_NS, RoverState

GRAVITY_M_S2 = 9.80665
AUTOPILOT_COMPONENT = 1
ROVER_TYPE, STANDBY, ACTIVE = 10, 3, 4
AUTOPILOT = {"ardupilot": 3, "px4": 12}
PREARM, GYRO, ACCEL, GPS = 0x1000_0000, 1, 2, 0x20
CAPABILITIES = 0x2 | 0x4 | 0x8 | 0x80 | 0x100 | 0x2000  # floats and integers in missions and commands, local NED, MAVLink 2
SLOW_HZ = 1.0  # every stream's rate until another is asked for
DEFAULTS = ("HEARTBEAT", "SYS_STATUS", "BATTERY_STATUS", "ATTITUDE", "LOCAL_POSITION_NED", "RAW_IMU")
OFFERED = {
    "ardupilot": (*DEFAULTS, "SCALED_IMU", "RPM", "WHEEL_DISTANCE"),
    "px4": ("HEARTBEAT", "SYS_STATUS", "BATTERY_STATUS", "ATTITUDE", "LOCAL_POSITION_NED", "HIGHRES_IMU"),
}


@dataclass(slots=True)
class Measured:
    """What it knows of the rover; north-east-down, forward-right-down."""

    clock_ns: int = 0  # since boot
    north_m: float = 0.0
    east_m: float = 0.0
    velocity_m_s: tuple[float, float] = (0.0, 0.0)
    yaw_rad: float = 0.0
    yaw_rate_rad_s: float = 0.0
    distances_m: tuple[float, ...] = ()
    rpm: tuple[float, float] = (0.0, 0.0)
    imu: ImuSample | None = None  # forward-left-up, as the stand-in gives it
    voltage_v: float = 0.0


class RoverVoice:
    """Streams and answers."""

    def __init__(self, settings: RoverAutopilotSettings, system: int, key: bytes | None, send: Callable[[bytes], None]) -> None:
        """Speak as a system; the timestamp of signatures begins at nothing, as without a clock, and is learnt from who signs."""
        self._settings, self._send = settings, send
        self.link: Any = mavlink.MAVLink(None, srcSystem=system, srcComponent=AUTOPILOT_COMPONENT)
        self.link.robust_parsing = True
        if key is not None:
            self.link.signing.secret_key, self.link.signing.sign_outgoing = key, True
        self._offered = {self._number(name): name for name in OFFERED[settings.kind]}
        if not settings.wheel_encoders:
            self._offered.pop(self._number("WHEEL_DISTANCE"), None)
        wanted = [name for name in DEFAULTS if self._number(name) in self._offered]
        self._streams = {name: [round(SECOND_NS / SLOW_HZ), 0] for name in wanted}  # period and next, on the world's clock

    def say(self, message: Any) -> None:
        """Send a message."""
        self._send(self.packed(message))

    def packed(self, message: Any) -> bytes:
        """Return a message as a frame."""
        frame = bytes(message.pack(self.link))
        self.link.seq = (self.link.seq + 1) % 256
        return frame

    def set_interval(self, message_id: int, interval_us: float, now_ns: int) -> bool:
        """Obey MAV_CMD_SET_MESSAGE_INTERVAL; return whether it can."""
        name = self._offered.get(message_id)
        if name is None or (interval_us > 0 and 1e6 / interval_us > self._settings.fastest_stream_hz * 1.001):
            return False
        if interval_us < 0:
            self._streams.pop(name, None)
        else:
            self._streams[name] = [round(1000 * interval_us) or round(SECOND_NS / SLOW_HZ), now_ns]
        return True

    def step(self, now_ns: int, measured: Measured, state: RoverState) -> None:
        """Send what is due."""
        for severity, text in state.texts:
            self._complain(severity, text)
        state.texts.clear()
        for name, stream in self._streams.items():
            if now_ns >= stream[1]:
                stream[1] += max(1, (now_ns - stream[1]) // stream[0] + 1) * stream[0]
                message = self._message(name, now_ns, measured, state)
                if message is not None:
                    self.say(message)

    def heartbeat(self, state: RoverState, now_ns: int) -> Any:
        """Return the heartbeat."""
        base = 1 | 0x80 * state.armed | 0x08 * state.follows
        kind = AUTOPILOT[self._settings.kind]
        return mavlink.MAVLink_heartbeat_message(ROVER_TYPE, kind, base, state.mode, ACTIVE if state.armed else STANDBY, 3)

    def version(self) -> Any:
        """Return AUTOPILOT_VERSION."""
        major, minor, patch = self._settings.firmware_version
        word = major << 24 | minor << 16 | patch << 8 | 255
        return mavlink.MAVLink_autopilot_version_message(
            CAPABILITIES, word, 0, 0, 140 << 16, [0] * 8, [0] * 8, [0] * 8, 0x1209, 0x5740, 0x3132_3334_0051_0042
        )

    def _complain(self, severity: int, text: str) -> None:
        raw = text.encode()
        if len(raw) <= 50:
            self.say(mavlink.MAVLink_statustext_message(severity, raw))
            return
        for chunk in range(-(-len(raw) // 50) + (len(raw) % 50 == 0)):
            self.say(mavlink.MAVLink_statustext_message(severity, raw[50 * chunk : 50 * chunk + 50], 7, chunk))

    def _message(self, name: str, now_ns: int, m: Measured, state: RoverState) -> Any:
        ms, us = m.clock_ns // 1_000_000, m.clock_ns // 1000
        match name:
            case "HEARTBEAT":
                return self.heartbeat(state, now_ns)
            case "SYS_STATUS":
                present = PREARM | GYRO | ACCEL | GPS
                health = present if not state.unready(now_ns) else present & ~PREARM
                percent = self._settings.battery_percent
                volts = round(1000 * m.voltage_v)
                return mavlink.MAVLink_sys_status_message(present, present, health, 300, volts, 150, percent, 0, 0, 0, 0, 0, 0)
            case "BATTERY_STATUS":
                cells = [round(1000 * m.voltage_v), *[65_535] * 9]
                return mavlink.MAVLink_battery_status_message(0, 1, 1, 2500, cells, 150, -1, -1, self._settings.battery_percent)
            case "ATTITUDE":
                return mavlink.MAVLink_attitude_message(ms, 0.0, 0.0, m.yaw_rad, 0.0, 0.0, m.yaw_rate_rad_s)
            case "LOCAL_POSITION_NED":
                if state.unready(now_ns):
                    return None  # there is no estimate yet
                return mavlink.MAVLink_local_position_ned_message(ms, m.north_m, m.east_m, 0.0, *m.velocity_m_s, 0.0)
            case "WHEEL_DISTANCE":
                padded = [*m.distances_m, *[0.0] * (16 - len(m.distances_m))]
                return mavlink.MAVLink_wheel_distance_message(us, len(m.distances_m), padded)
            case "RPM":
                return mavlink.MAVLink_rpm_message(*m.rpm)
        return self._inertial(name, ms, us, m.imu)

    def _inertial(self, name: str, ms: int, us: int, imu: ImuSample | None) -> Any:
        if imu is None:
            return None
        (gx, gy, gz), (ax, ay, az) = imu.gyro_rad_s, imu.accel_m_s2
        gyro, accel = (gx, -gy, -gz), (ax, -ay, -az)
        if name == "HIGHRES_IMU":
            return mavlink.MAVLink_highres_imu_message(us, *accel, *gyro, 0.2, 0.0, 0.4, 1013.0, 0.0, 0.0, 25.0, 0x3F)
        counts = [_short(1000.0 * value / GRAVITY_M_S2) for value in accel] + [_short(1000.0 * value) for value in gyro]
        if name == "RAW_IMU":
            return mavlink.MAVLink_raw_imu_message(us, *counts, 0, 0, 0, 0, 2500)
        return mavlink.MAVLink_scaled_imu_message(ms, *counts, 0, 0, 0, 2500)

    @staticmethod
    def _number(name: str) -> int:
        return int(getattr(mavlink, f"MAVLINK_MSG_ID_{name}"))


def _short(value: float) -> int:
    return min(max(round(value), -32_768), 32_767) if math.isfinite(value) else 0
