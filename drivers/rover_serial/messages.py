"""The few MAVLink messages that are exchanged, by pymavlink's dialect."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.rover_serial.autopilots import Autopilot, Target
from drivers.rover_serial.frames import Frame
from drivers.rover_serial.signing import LINK_ID

Message = Any  # an object of pymavlink's, with a field for each of the message's
MAVLINK_VERSION = 3
GCS, NO_AUTOPILOT, ACTIVE = 6, 8, 4  # MAV_TYPE, MAV_AUTOPILOT, MAV_STATE
REQUEST_MESSAGE, REQUEST_CAPABILITIES, SET_MESSAGE_INTERVAL = 512, 520, 511  # MAV_CMD
DO_SET_MODE, ARM_DISARM = 176, 400
_AUTOPILOT_COMPONENT = 1


def message_id(name: str) -> int:
    """Return the number of a message.

    >>> message_id("WHEEL_DISTANCE")
    9000
    """
    return int(getattr(dialect, f"MAVLINK_MSG_ID_{name}"))


class Decoder:
    """Makes messages of frames that were found right."""

    def __init__(self) -> None:
        """Take pymavlink's decoder; signatures are not its business."""
        self._mavlink: Any = dialect.MAVLink(None)

    def decode(self, frame: Frame) -> Message | None:
        """Return the message, or None for one that is not known or cannot be read."""
        try:
            message = self._mavlink.decode(bytearray(frame.raw))
        except dialect.MAVError:
            return None
        return None if message.get_msgId() < 0 or message.get_type().startswith("UNKNOWN") else message


class Speaker:
    """Sends messages as a ground station does, to one autopilot."""

    def __init__(self, system: int, component: int, target_system: int, send: Callable[[bytes], None]) -> None:
        """Speak as a component of a system to a system."""
        self._mavlink: Any = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        self._target = (target_system, _AUTOPILOT_COMPONENT)
        self._send_bytes = send

    def sign(self, key: bytes, timestamp: int) -> None:
        """Sign all from now on."""
        signing = self._mavlink.signing
        signing.secret_key, signing.link_id, signing.sign_outgoing = key, LINK_ID, True
        signing.timestamp = max(signing.timestamp, timestamp)

    def heartbeat(self) -> None:
        """Say that we are there."""
        self._send(dialect.MAVLink_heartbeat_message(GCS, NO_AUTOPILOT, 0, 0, ACTIVE, MAVLINK_VERSION))

    def command(self, command: int, confirmation: int, parameters: tuple[float, ...]) -> None:
        """Send COMMAND_LONG with up to seven parameters."""
        padded = (*parameters, *(0.0,) * (7 - len(parameters)))
        self._send(dialect.MAVLink_command_long_message(*self._target, command, confirmation, *padded))

    def set_point(self, now_ns: int, autopilot: Autopilot, target: Target) -> None:
        """Send SET_POSITION_TARGET_LOCAL_NED with a velocity in the body's frame."""
        fields = (target.vx_m_s, target.vy_m_s, 0.0, 0.0, 0.0, 0.0, 0.0, target.yaw_rate_rad_s)
        time_ms = now_ns // 1_000_000 & 0xFFFF_FFFF
        message = dialect.MAVLink_set_position_target_local_ned_message(
            time_ms, *self._target, autopilot.frame, autopilot.type_mask, 0.0, 0.0, 0.0, *fields
        )
        self._send(message)

    def ask_time(self, now_ns: int) -> None:
        """Ask for the autopilot's time."""
        self._send(dialect.MAVLink_timesync_message(0, now_ns))

    def tell_time(self, asked_ns: int, now_ns: int) -> None:
        """Answer when the autopilot asks for ours."""
        self._send(dialect.MAVLink_timesync_message(now_ns, asked_ns))

    def ask_parameter(self, name: str) -> None:
        """Ask for the value of a parameter."""
        self._send(dialect.MAVLink_param_request_read_message(*self._target, name.encode(), -1))

    def _send(self, message: Any) -> None:
        data = message.pack(self._mavlink)
        self._mavlink.seq = (self._mavlink.seq + 1) % 256
        self._send_bytes(data)
