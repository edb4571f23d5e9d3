"""One axis of a motor controller: its state machine, errors, watchdog and set point.  No wire, no physics."""

from __future__ import annotations

import math
import struct

from pydantic import Field

from drivers.interface.settings import Settings
from sim_drivers.firmware.can_simple import (
    AxisState,
    Command,
    ControlMode,
    Fault,
    Frame,
    InputMode,
    ProcedureResult,
    Version,
)

SECOND_NS = 1_000_000_000
OVERSPEED = 1.2  # of the velocity limit; ODrive's vel_limit_tolerance


class AxisSettings(Settings):
    """How an axis was configured over USB before it came on the bus."""

    watchdog_s: float | None = Field(default=0.4, gt=0.0, le=10.0, description="watchdog_timeout; none: it is not enabled")
    watchdog_in_idle: bool = Field(default=True, description="it also runs, and sets its error, while the axis is idle")
    velocity_limit_turns_s: float = Field(default=5.0, gt=0.0, le=100.0, description="vel_limit")
    ramp_turns_s2: float = Field(default=10.0, gt=0.0, le=1000.0, description="vel_ramp_rate, in input mode VEL_RAMP")
    position_gain_per_s: float = Field(default=20.0, gt=0.0, le=200.0, description="pos_gain, in control mode POSITION")


class Axis:
    """Idle until told otherwise; whatever goes wrong disarms it, and it stays idle until its errors are cleared.

    Source: ODrive's documentation (axis state machine, watchdog timer) and firmware 0.5.6: every frame that is addressed to an
    axis feeds its watchdog, requests included; an expired one sets its error in idle too.
    """

    def __init__(self, settings: AxisSettings, version: Version, now_ns: int) -> None:
        """Power up: idle, position control, watchdog just fed."""
        self._settings = settings
        self._version = version
        self.state = AxisState.IDLE
        self.control_mode, self.input_mode = ControlMode.POSITION, InputMode.PASSTHROUGH
        self.faults: set[Fault] = set()
        self.disarm_reason: Fault | None = None
        self.result = ProcedureResult.SUCCESS
        self.watchdog_trips = 0
        self._velocity_limit_turns_s = settings.velocity_limit_turns_s
        self._input_turns_s = 0.0
        self._input_turns = 0.0
        self._ramped_turns_s = 0.0
        self._fed_ns = self._last_ns = now_ns

    @property
    def armed(self) -> bool:
        """Whether its power stage drives the motor."""
        return self.state is AxisState.CLOSED_LOOP_CONTROL and self.control_mode in (ControlMode.VELOCITY, ControlMode.POSITION)

    @property
    def error_word(self) -> int:
        """The heartbeat's error: in 0.6 what is wrong now and what disarmed it last."""
        faults = self.faults | ({self.disarm_reason} if self.disarm_reason and self._version == "0.6" else set())
        return sum(fault.bit(self._version) for fault in faults)

    @property
    def active_word(self) -> int:
        """What is wrong now."""
        return sum(fault.bit(self._version) for fault in self.faults)

    @property
    def disarm_word(self) -> int:
        """0.6: what disarmed it last."""
        return self.disarm_reason.bit(self._version) if self.disarm_reason else 0

    def take(self, frame: Frame, now_ns: int, turns: float) -> None:
        """Obey a frame for this axis, whose wheel stands at so many turns; one that is too short does nothing."""
        self._fed_ns = now_ns
        data = frame.data
        if frame.command == Command.ESTOP:
            self.fail(Fault.ESTOP)
        elif frame.command == Command.CLEAR_ERRORS:
            self.faults.clear()
            self.disarm_reason, self.result = None, ProcedureResult.SUCCESS
        elif frame.command == Command.SET_AXIS_STATE and len(data) >= 4:
            self._request(struct.unpack_from("<I", data)[0], turns)
        elif frame.command == Command.SET_CONTROLLER_MODE and len(data) >= 8:
            self._set_mode(*struct.unpack_from("<II", data))
        elif frame.command == Command.SET_LIMITS and len(data) >= 8:
            self._limit(struct.unpack_from("<f", data)[0])
        elif frame.command == Command.SET_INPUT_VEL and len(data) >= 8:
            self._set_input(struct.unpack_from("<f", data)[0])

    def fail(self, fault: Fault) -> None:
        """Set an error, which disarms."""
        self.faults.add(fault)
        if self.state is not AxisState.IDLE:
            self.state, self.disarm_reason, self.result = AxisState.IDLE, fault, ProcedureResult.DISARMED

    def step(self, now_ns: int, turns: float, turns_s: float) -> float:
        """Advance watchdog and set point; return the velocity [turn/s] to run at, while `armed`, given where the wheel is."""
        elapsed_s, self._last_ns = (now_ns - self._last_ns) / SECOND_NS, now_ns
        self._watch(now_ns)
        if not self.armed:
            self._ramped_turns_s = turns_s
            return 0.0
        if abs(turns_s) > OVERSPEED * self._velocity_limit_turns_s:
            self.fail(Fault.CONTROLLER)
            return 0.0
        if self.control_mode is ControlMode.POSITION:
            return self._clipped(self._settings.position_gain_per_s * (self._input_turns - turns))
        target, step = self._clipped(self._input_turns_s), self._settings.ramp_turns_s2 * elapsed_s
        if self.input_mode is InputMode.VEL_RAMP:
            self._ramped_turns_s += min(max(target - self._ramped_turns_s, -step), step)
        elif self.input_mode is InputMode.PASSTHROUGH:
            self._ramped_turns_s = target
        return self._ramped_turns_s

    def _watch(self, now_ns: int) -> None:
        limit_s = self._settings.watchdog_s
        running = self.state is not AxisState.IDLE or self._settings.watchdog_in_idle
        if limit_s is None or not running or now_ns - self._fed_ns <= limit_s * SECOND_NS:
            return
        if Fault.WATCHDOG not in self.faults:
            self.watchdog_trips += self.state is not AxisState.IDLE
            self.fail(Fault.WATCHDOG)

    def _request(self, state: int, turns: float) -> None:
        if state == AxisState.IDLE:
            self.state = AxisState.IDLE
        elif state == AxisState.CLOSED_LOOP_CONTROL and not self.faults:
            if self.state is not AxisState.CLOSED_LOOP_CONTROL:  # a set point from before it was armed does not count
                self._input_turns_s, self._input_turns = 0.0, turns
            self.state, self.result = AxisState.CLOSED_LOOP_CONTROL, ProcedureResult.SUCCESS
        else:  # errors not cleared, or a procedure that needs a calibration which this axis does not do
            self.fail(Fault.INVALID_STATE)

    def _set_mode(self, control: int, input_mode: int) -> None:
        try:
            self.control_mode, self.input_mode = ControlMode(control), InputMode(input_mode)
        except ValueError:  # a mode that is not emulated
            self.fail(Fault.CONTROLLER)

    def _limit(self, turns_s: float) -> None:
        if math.isfinite(turns_s) and turns_s > 0.0:
            self._velocity_limit_turns_s = turns_s

    def _set_input(self, turns_s: float) -> None:
        if math.isfinite(turns_s):
            self._input_turns_s = turns_s
        else:
            self.fail(Fault.CONTROLLER)

    def _clipped(self, turns_s: float) -> float:
        return min(max(turns_s, -self._velocity_limit_turns_s), self._velocity_limit_turns_s)
