"""The Franka Control Interface's wire, protocol version 10, from the robot's end; the tables are the emulation's own.

Source: libfranka's public research-interface headers, version 10.  All numbers are little-endian, all structures packed.
"""

from __future__ import annotations

import enum
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

VERSION = 10
PORT = 1337  # TCP; the client has it built in, so robots are told apart by their address
HEADER = struct.Struct("<III")  # command, id, size of the whole message
LARGEST_REQUEST = 4096  # bytes; what claims to be longer is no request


class Request(enum.IntEnum):
    """What a client asks over TCP."""

    CONNECT = 0
    MOVE = 1
    STOP_MOVE = 2
    SET_COLLISION_BEHAVIOR = 3
    SET_JOINT_IMPEDANCE = 4
    SET_CARTESIAN_IMPEDANCE = 5
    SET_GUIDING_MODE = 6
    SET_EE_TO_K = 7
    SET_NE_TO_EE = 8
    SET_LOAD = 9
    AUTOMATIC_ERROR_RECOVERY = 10
    GET_ROBOT_MODEL = 11


# Bytes after the header.  A move: controller, generator, two deviations of 3, asynchronous, highest velocities.
PAYLOAD_BYTES = {
    Request.CONNECT: 4,
    Request.MOVE: 113,
    Request.STOP_MOVE: 0,
    Request.SET_COLLISION_BEHAVIOR: 416,
    Request.SET_JOINT_IMPEDANCE: 56,
    Request.SET_CARTESIAN_IMPEDANCE: 48,
    Request.SET_GUIDING_MODE: 7,
    Request.SET_EE_TO_K: 128,
    Request.SET_NE_TO_EE: 128,
    Request.SET_LOAD: 104,
    Request.AUTOMATIC_ERROR_RECOVERY: 0,
    Request.GET_ROBOT_MODEL: 0,
}


class MoveStatus(enum.IntEnum):
    """Replies to a Move: one when it starts, one when it ends."""

    SUCCESS = 0
    MOTION_STARTED = 1
    PREEMPTED = 2
    NOT_POSSIBLE = 5
    INVALID_ARGUMENT = 7
    REFLEX_ABORTED = 8
    EMERGENCY_ABORTED = 9


SUCCESS, NOT_POSSIBLE, INVALID_ARGUMENT = 0, 1, 2  # replies to everything else
INCOMPATIBLE_VERSION = 1  # to Connect
MANUAL_RECOVERY_REQUIRED = 3  # to AutomaticErrorRecovery


class RobotMode(enum.IntEnum):
    """What the robot is doing."""

    OTHER = 0
    IDLE = 1
    MOVE = 2
    GUIDING = 3
    REFLEX = 4
    USER_STOPPED = 5
    AUTOMATIC_ERROR_RECOVERY = 6


class Generator(enum.IntEnum):
    """Who generates the motion, as the state says; a Move asks for the number below."""

    IDLE = 0
    JOINT_POSITION = 1
    JOINT_VELOCITY = 2


class Controller(enum.IntEnum):
    """Who controls the torques."""

    JOINT_IMPEDANCE = 0
    CARTESIAN_IMPEDANCE = 1
    EXTERNAL = 2
    OTHER = 3


class Error(enum.IntEnum):
    """Places in the states' lists of errors, of those that this emulation knows."""

    JOINT_REFLEX = 6
    START_POSE_INVALID = 11
    POSITION_LIMITS_VIOLATION = 12
    VELOCITY_LIMITS_VIOLATION = 13
    VELOCITY_DISCONTINUITY = 14  # the acceleration was too high
    ACCELERATION_DISCONTINUITY = 15  # the jerk was
    COMMUNICATION_CONSTRAINTS_VIOLATION = 25


ERRORS = 41
_FLOATS: tuple[tuple[str, int], ...] = (
    ("O_T_EE", 16), ("O_T_EE_d", 16), ("F_T_EE", 16), ("EE_T_K", 16), ("F_T_NE", 16), ("NE_T_EE", 16), ("m_ee", 1), ("I_ee", 9),
    ("F_x_Cee", 3), ("m_load", 1), ("I_load", 9), ("F_x_Cload", 3), ("elbow", 2), ("elbow_d", 2), ("tau_J", 7), ("tau_J_d", 7),
    ("dtau_J", 7), ("q", 7), ("q_d", 7), ("dq", 7), ("dq_d", 7), ("ddq_d", 7), ("joint_contact", 7), ("cartesian_contact", 6),
    ("joint_collision", 7), ("cartesian_collision", 6), ("tau_ext_hat_filtered", 7), ("O_F_ext_hat_K", 6), ("K_F_ext_hat_K", 6),
    ("O_dP_EE_d", 6), ("O_ddP_O", 3), ("elbow_c", 2), ("delbow_c", 2), ("ddelbow_c", 2), ("O_T_EE_c", 16), ("O_dP_EE_c", 6),
    ("O_ddP_EE_c", 6), ("theta", 7), ("dtheta", 7), ("accelerometer_top", 18), ("accelerometer_bottom", 18),
)  # fmt: skip
STATE = np.dtype(
    [
        ("message_id", "<u8"),  # milliseconds; the only clock that the client knows
        *((name, "<f4", (count,)) for name, count in _FLOATS),
        ("generator", "u1"),
        ("controller", "u1"),
        ("errors", "?", (ERRORS,)),
        ("reflex_reason", "?", (ERRORS,)),
        ("robot_mode", "u1"),
        ("success_rate", "<f4"),
    ]
)
COMMAND = np.dtype(
    [
        ("message_id", "<u8"),  # of the state that it answers
        ("q", "<f8", (7,)),
        ("dq", "<f8", (7,)),
        ("pose", "<f8", (16,)),  # column-major
        ("twist", "<f8", (6,)),
        ("elbow", "<f8", (2,)),
        ("elbow_valid", "?"),
        ("motion_finished", "?"),
        ("tau", "<f8", (7,)),
        ("torque_finished", "?"),
    ]
)


@dataclass(frozen=True, slots=True)
class Asked:
    """A request as it came."""

    request: Request
    identity: int
    payload: bytes

    @property
    def well_formed(self) -> bool:
        """Whether it has its length."""
        return len(self.payload) == PAYLOAD_BYTES[self.request]

    def doubles(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return a payload that holds nothing else."""
        return np.frombuffer(self.payload, dtype="<f8")


def reply(request: int, identity: int, status: int, more: bytes = b"") -> bytes:
    """Return the bytes of a reply: the request's header with the reply's own length, the status, and what else belongs to it."""
    return HEADER.pack(request, identity, HEADER.size + 1 + len(more)) + bytes((status,)) + more


def blank_state() -> np.ndarray[Any, np.dtype[np.void]]:
    """Return the state, shape (1,), of an arm with nothing in its hand: unit transforms, gravity where it belongs."""
    state = np.zeros(1, STATE)
    for name in ("O_T_EE", "O_T_EE_d", "F_T_EE", "EE_T_K", "F_T_NE", "NE_T_EE", "O_T_EE_c"):
        state[name] = np.eye(4, dtype=np.float32).reshape(16)
    state["O_ddP_O"] = (0.0, 0.0, -9.81)  # without it the client's model knows no gravity
    return state
