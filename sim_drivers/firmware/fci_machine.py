"""The controller's state machine: idle, moving, reflex, user stop, recovery."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_drivers.firmware.fci_motion import CYCLE_S, Quality, SetPoint
from sim_drivers.firmware.fci_protocol import (
    ERRORS,
    MANUAL_RECOVERY_REQUIRED,
    NOT_POSSIBLE,
    SUCCESS,
    Controller,
    Error,
    Generator,
    MoveStatus,
    RobotMode,
)

Command = np.ndarray[Any, np.dtype[np.void]]  # (1,), of dtype COMMAND
RECOVERY_CYCLES = 50  # until an error is cleared


class Machine:
    """One arm's controller.  `ended` is called with how a motion ended, `recovered` with what came of a recovery."""

    def __init__(
        self, position_rad: NDArray[np.float64], ended: Callable[[MoveStatus], None], recovered: Callable[[int], None]
    ) -> None:
        """Wake up idle, with the brakes open, at a position, shape (7,)."""
        self.set_point = SetPoint(position_rad)
        self.mode = RobotMode.IDLE
        self.generator = Generator.IDLE
        self.controller = Controller.OTHER
        self.errors = np.zeros(ERRORS, dtype=bool)
        self.reflex_reason = np.zeros(ERRORS, dtype=bool)
        self.quality = Quality()
        self._ended = ended
        self._recovered = recovered
        self._first = False
        self._recovering = 0  # cycles left
        self._user_stop = False

    @property
    def is_moving(self) -> bool:
        """Whether a client's motion is running."""
        return self.mode is RobotMode.MOVE

    def start(self, generator: int, controller: int) -> MoveStatus:
        """Begin a motion, if that is possible; the numbers are those of the request."""
        if self.mode is not RobotMode.IDLE:
            return MoveStatus.NOT_POSSIBLE
        if generator + 1 not in (Generator.JOINT_POSITION, Generator.JOINT_VELOCITY) or controller not in (
            Controller.JOINT_IMPEDANCE,
            Controller.CARTESIAN_IMPEDANCE,
        ):
            return MoveStatus.INVALID_ARGUMENT
        self.mode, self.generator, self.controller = RobotMode.MOVE, Generator(generator + 1), Controller(controller)
        self.quality, self._first = Quality(), True
        self.reflex_reason[:] = False
        return MoveStatus.MOTION_STARTED

    def step(self, command: Command | None) -> None:
        """Advance one cycle; the command is the one that answers the newest state, None: it did not come."""
        if self._recovering:
            self._recovering -= 1
            if not self._recovering:
                self.mode = RobotMode.USER_STOPPED if self._user_stop else RobotMode.IDLE
                self.errors[:] = False
                self._recovered(SUCCESS)
        if not self.is_moving:
            self.set_point.brake()
        elif command is None:
            self._miss()
        else:
            self._obey(command)

    def expect_commands(self) -> None:
        """Count what does not come from now on, also when nothing has come yet: the client is gone."""
        self._first = False

    def stop(self) -> None:
        """End the motion at the client's wish, or at another one's; the arm brakes by itself."""
        if self.is_moving:
            self._end(RobotMode.IDLE, MoveStatus.PREEMPTED)

    def reflex(self, error: Error) -> None:
        """Stop by itself, for a reason that must be acknowledged."""
        self.errors[error] = self.reflex_reason[error] = True
        self._end(RobotMode.REFLEX, MoveStatus.REFLEX_ABORTED)

    def press_user_stop(self, *, pressed: bool) -> None:
        """Press or release the person's own button."""
        if pressed and not self._user_stop:
            self._end(RobotMode.USER_STOPPED, MoveStatus.EMERGENCY_ABORTED)
        elif not pressed and self.mode is RobotMode.USER_STOPPED:
            self.mode = RobotMode.REFLEX if self.errors.any() else RobotMode.IDLE
        self._user_stop = pressed

    def recover(self) -> None:
        """Clear a reflex; the outcome is told when it is known."""
        if self.mode is RobotMode.REFLEX:
            self.mode, self._recovering = RobotMode.AUTOMATIC_ERROR_RECOVERY, RECOVERY_CYCLES
        elif self.mode is RobotMode.USER_STOPPED:
            self._recovered(MANUAL_RECOVERY_REQUIRED)
        else:
            self._recovered(SUCCESS if self.mode is RobotMode.IDLE else NOT_POSSIBLE)

    def _obey(self, command: Command) -> None:
        point, asked = self.set_point, command[0]
        self.quality.count(came=True)
        velocity = self.generator is Generator.JOINT_VELOCITY
        position = point.position_rad + asked["dq"] * CYCLE_S if velocity else np.array(asked["q"])
        error = point.take(position, first=self._first and not velocity)
        self._first = False
        if error is not None:
            self.reflex(error)
        elif asked["motion_finished"]:
            self._end(RobotMode.IDLE, MoveStatus.SUCCESS)

    def _miss(self) -> None:
        if self._first:  # the client has not said anything yet
            return
        self.quality.count(came=False)
        if self.quality.is_too_bad:
            self.reflex(Error.COMMUNICATION_CONSTRAINTS_VIOLATION)
        else:
            self.set_point.extrapolate()

    def _end(self, mode: RobotMode, status: MoveStatus) -> None:
        moving, self.mode = self.is_moving, mode
        self.generator, self.controller, self._recovering = Generator.IDLE, Controller.OTHER, 0
        if moving:
            self._ended(status)
