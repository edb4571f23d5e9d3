"""The arm as libfranka shows it: its exceptions become sentences, its thread keeps the priority that it was given."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.franka.settings import FrankaSettings
from drivers.interface.errors import DeviceError

F64 = NDArray[np.float64]
MILLISECOND_NS = 1_000_000


class MotionAbortedError(Exception):
    """The controller has ended the motion; the connection stands."""


@dataclass(frozen=True, slots=True)
class ArmState:
    """What the controller tells each millisecond; arrays have the shape (7,)."""

    robot_ns: int  # on the controller's clock, whole milliseconds
    position_rad: F64
    velocity_rad_s: F64
    torque_nm: F64
    target_rad: F64  # where the controller's own set point is
    target_rad_s: F64
    target_rad_s2: F64
    mode: str  # Idle, Move, Reflex, UserStopped, Guiding, ...
    errors: str  # by name; empty: none
    success_rate: float  # of the last commands, while moving


class Client(Protocol):
    """What the session needs of the arm."""

    def read(self) -> ArmState:
        """Wait for the next state.  Raises MotionAbortedError, or DeviceError for a lost wire."""
        ...

    def start(self) -> None:
        """Begin a motion."""
        ...

    def write(self, position_rad: F64, *, last: bool) -> None:
        """Answer the newest state with a set point; the last one ends the motion."""
        ...

    def prepare(self) -> None:
        """Set impedance and thresholds.  Raises MotionAbortedError where the controller refuses, as it does unless it is idle."""
        ...

    def recover(self) -> None:
        """Clear a reflex; waits until it is done.  Raises MotionAbortedError when it cannot be."""
        ...

    def close(self) -> None:
        """Hang up; a motion that runs is stopped."""
        ...


class LibfrankaClient:
    """A connection through pylibfranka."""

    def __init__(self, name: str, settings: FrankaSettings) -> None:
        """Connect.

        Raises:
            DeviceError: no pylibfranka, nobody there, or another protocol.
        """
        self._lib = _library(name)
        self._name = name
        self._settings = settings
        self.version = str(self._lib.__version__)
        self._control: Any = None
        lib, s = self._lib, settings
        real_time = lib.RealtimeConfig.kEnforce if s.real_time_kernel else lib.RealtimeConfig.kIgnore
        try:
            self._robot: Any = lib.Robot(s.host, real_time)
        except (RuntimeError, self._lib.FrankaException) as error:
            raise DeviceError(f"{name}: the arm at {s.host} cannot be used: {sentence(error)}") from error
        self._settle()

    def read(self) -> ArmState:
        """Wait for the next state.

        Raises:
            MotionAbortedError: the motion was ended by the controller.
            DeviceError: the wire is lost.
        """
        try:
            state = self._robot.read_once() if self._control is None else self._control.readOnce()[0]
        except self._lib.ControlException as error:
            self._control = None
            raise MotionAbortedError(sentence(error)) from error
        except (RuntimeError, self._lib.FrankaException) as error:
            raise self._lost(error) from error
        joints = (state.q, state.dq, state.tau_J, state.q_d, state.dq_d, state.ddq_d)
        position, velocity, torque, target, target_velocity, target_acceleration = (np.array(each) for each in joints)
        return ArmState(
            robot_ns=round(state.time.to_sec() * 1000.0) * MILLISECOND_NS,
            position_rad=position,
            velocity_rad_s=velocity,
            torque_nm=torque,
            target_rad=target,
            target_rad_s=target_velocity,
            target_rad_s2=target_acceleration,
            mode=state.robot_mode.name,
            errors=_errors(str(state.current_errors)) if state.current_errors else "",
            success_rate=state.control_command_success_rate,
        )

    def start(self) -> None:
        """Begin a motion of joint positions.

        Raises:
            MotionAbortedError: the controller refuses.
            DeviceError: the wire is lost.
        """
        modes = self._lib.ControllerMode
        joint = self._settings.controller == "joint_impedance"
        try:
            self._control = self._robot.start_joint_position_control(modes.JointImpedance if joint else modes.CartesianImpedance)
        except (self._lib.ControlException, self._lib.CommandException) as error:
            raise MotionAbortedError(sentence(error)) from error
        except (RuntimeError, self._lib.FrankaException) as error:
            raise self._lost(error) from error
        self._settle()

    def write(self, position_rad: F64, *, last: bool) -> None:
        """Answer the newest state, positions of shape (7,).

        Raises:
            MotionAbortedError: the motion has ended otherwise.
            DeviceError: the wire is lost.
        """
        command = self._lib.JointPositions(position_rad.tolist())
        command.motion_finished = last
        try:
            self._control.writeOnce(command)
        except self._lib.ControlException as error:
            self._control = None
            raise MotionAbortedError(sentence(error)) from error
        except (RuntimeError, self._lib.FrankaException) as error:
            raise self._lost(error) from error
        if last:
            self._control = None

    def prepare(self) -> None:
        """Set impedance and thresholds.

        Raises:
            MotionAbortedError: the controller refuses.
            DeviceError: the wire is lost.
        """
        s = self._settings
        try:
            self._robot.set_collision_behavior(s.contact_torque_nm, s.collision_torque_nm, s.contact_force_n, s.collision_force_n)
            self._robot.set_joint_impedance(s.joint_stiffness_nm_rad)
        except self._lib.CommandException as error:
            raise MotionAbortedError(sentence(error)) from error
        except (RuntimeError, self._lib.FrankaException) as error:
            raise self._lost(error) from error

    def recover(self) -> None:
        """Clear a reflex.

        Raises:
            MotionAbortedError: it cannot be cleared.
            DeviceError: the wire is lost.
        """
        try:
            self._robot.automatic_error_recovery()
        except (self._lib.ControlException, self._lib.CommandException) as error:
            raise MotionAbortedError(sentence(error)) from error
        except (RuntimeError, self._lib.FrankaException) as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Hang up."""
        self._control = None
        self._robot = None

    def _settle(self) -> None:
        """Take the priority that was asked for: libfranka gives its caller the highest there is."""
        priority = self._settings.priority
        with suppress(OSError):  # not permitted: then it stays as it was
            if priority is None:
                os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
            else:
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))

    def _lost(self, error: Exception) -> DeviceError:
        return DeviceError(f"{self._name}: the arm at {self._settings.host} is lost: {sentence(error)}")


def sentence(error: Exception) -> str:
    """Return what libfranka says, on one line and without its own name."""
    return " ".join(str(error).split()).removeprefix("libfranka: ").removeprefix("libfranka robot: ")


def _errors(names: str) -> str:
    """Return a list of errors in words."""
    return ", ".join(name.strip('" ') for name in names.strip("[]").split(",") if name.strip('" '))


def _library(name: str) -> Any:
    try:
        import pylibfranka  # noqa: PLC0415 - only this device needs it, and it is an optional extra
    except ImportError as error:
        raise DeviceError(f"{name}: pylibfranka is missing; install it with: pip install 'trundle[franka]'") from error
    return pylibfranka
