"""CANSimple as an axis speaks it: identifiers, states, errors and payloads, by `struct` from the published protocol.

Sources: ODrive, CAN Protocol (documentation of firmware 0.5.6 and of 0.6), the 0.5.6 firmware's `can_simple.cpp`, and its error
tables.  Identifier: node << 5 | command; all values little endian.
"""

from __future__ import annotations

import enum
import struct
from dataclasses import dataclass
from typing import Literal

Version = Literal["0.5", "0.6"]
COMMAND_BITS = 5
COMMAND_MASK = (1 << COMMAND_BITS) - 1


class Command(enum.IntEnum):
    """Command identifiers; those that only one version has are marked."""

    GET_VERSION = 0x00  # 0.6
    HEARTBEAT = 0x01
    ESTOP = 0x02
    GET_ERROR = 0x03  # 0.6: active errors and disarm reason; 0.5: the motor's error
    GET_ENCODER_ERROR = 0x04  # 0.5
    SET_AXIS_STATE = 0x07
    GET_ENCODER_ESTIMATES = 0x09
    GET_ENCODER_COUNT = 0x0A  # 0.5
    SET_CONTROLLER_MODE = 0x0B
    SET_INPUT_POS = 0x0C
    SET_INPUT_VEL = 0x0D
    SET_INPUT_TORQUE = 0x0E
    SET_LIMITS = 0x0F
    GET_IQ = 0x14
    GET_TEMPERATURE = 0x15  # 0.6
    REBOOT = 0x16
    GET_BUS_VOLTAGE_CURRENT = 0x17
    CLEAR_ERRORS = 0x18
    GET_CONTROLLER_ERROR = 0x1D  # 0.5


REPORTS = frozenset(command for command in Command if command.name.startswith("GET_")) | {Command.HEARTBEAT}


class AxisState(enum.IntEnum):
    """States that a host asks for or sees."""

    UNDEFINED = 0
    IDLE = 1
    CLOSED_LOOP_CONTROL = 8


class ControlMode(enum.IntEnum):
    """What the controller closes its loop around."""

    VOLTAGE = 0
    TORQUE = 1
    VELOCITY = 2
    POSITION = 3


class InputMode(enum.IntEnum):
    """How an input becomes a set point."""

    INACTIVE = 0
    PASSTHROUGH = 1
    VEL_RAMP = 2


class ProcedureResult(enum.IntEnum):
    """0.6: how the last requested state ended."""

    SUCCESS = 0
    DISARMED = 3


class Fault(enum.Enum):
    """What can go wrong with an axis; the value is its bit in (0.5, 0.6)."""

    INVALID_STATE = (0x1, 0x10)  # 0.6 knows no such error; a refused state reads as bad configuration
    CONTROLLER = (0x200, 0x8000)  # overspeed; 0.6: velocity limit violation
    WATCHDOG = (0x800, 0x0100_0000)
    ESTOP = (0x4000, 0x0200_0000)
    DRIVE = (0x40, 0x20)  # the power stage: motor failed, gate driver fault

    def bit(self, version: Version) -> int:
        """Return its bit in a version's error word."""
        return self.value[0 if version == "0.5" else 1]


@dataclass(frozen=True, slots=True)
class Frame:
    """A CAN 2.0A frame: 11-bit identifier, up to 8 bytes."""

    node: int
    command: int
    data: bytes = b""
    is_request: bool = False  # a remote frame

    @property
    def command_is_report(self) -> bool:
        """Whether only an axis sends such a frame with data in it."""
        return self.command in REPORTS

    @property
    def identifier(self) -> int:
        """The arbitration identifier."""
        return self.node << COMMAND_BITS | self.command


def heartbeat(version: Version, error: int, state: int, result: int, faulty: bool) -> bytes:
    """Return a heartbeat's payload.

    0.5: error, state, then one flag byte each for motor, encoder and controller; 0.6: error, state, procedure result, trajectory
    done, reserved.
    """
    if version == "0.5":
        return struct.pack("<IBBBB", error, state, 0, 0, int(faulty))
    return struct.pack("<IBBBB", error, state, result, 0, 0)


def floats(*values: float) -> bytes:
    """Return IEEE 754 single precision numbers."""
    return struct.pack(f"<{len(values)}f", *values)


def words(*values: int) -> bytes:
    """Return unsigned 32-bit words."""
    return struct.pack(f"<{len(values)}I", *values)


def version_payload(firmware: tuple[int, int, int]) -> bytes:
    """Return Get_Version's payload (0.6): protocol 2, an ODrive S1's hardware 5.2.0, the firmware, no pre-release."""
    return struct.pack("<8B", 2, 5, 2, 0, *firmware, 0)
