"""The last hop of a simulated base: command latency, dead man, and how its drives follow a set point."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.kernel import kernel
from drivers.interface.settings import Settings

F64 = NDArray[np.float64]


class DriveSettings(Settings):
    """What a base may be asked, and how its drives follow.  All accelerations are of the base, not of a wheel."""

    max_vx_m_s: float = Field(default=0.5, gt=0.0, le=5.0, description="cap forwards and backwards")
    max_vy_m_s: float = Field(default=0.0, ge=0.0, le=5.0, description="cap sideways; 0: it cannot strafe")
    max_wz_rad_s: float = Field(default=1.0, gt=0.0, le=10.0, description="cap on turning")
    reverse: bool = Field(default=True, description="whether it may drive backwards")
    acceleration_m_s2: float = Field(default=1.5, gt=0.0, le=20.0, description="cap on speeding up")
    angular_acceleration_rad_s2: float = Field(default=3.0, gt=0.0, le=50.0, description="cap on turning up")
    jerk_m_s3: float = Field(default=15.0, gt=0.0, le=1000.0, description="cap on jerk that a planner must keep")
    angular_jerk_rad_s3: float = Field(default=30.0, gt=0.0, le=1000.0, description="the same for turning")
    stop_deceleration_m_s2: float = Field(default=2.0, gt=0.0, le=20.0, description="how hard it brakes")
    stop_angular_deceleration_rad_s2: float = Field(default=6.0, gt=0.0, le=50.0, description="how hard it stops turning")
    command_latency_s: float = Field(default=0.01, ge=0.0, le=1.0, description="from command() to the drives")
    motor_lag_s: float = Field(default=0.06, ge=0.0, le=1.0, description="time constant of the speed control")

    @property
    def limits(self) -> BaseLimits:
        """The caps as the contract wants them."""
        sideways = self.max_vy_m_s > 0.0

        def twist(linear: float, angular: float) -> BodyTwist:
            return BodyTwist(linear, linear if sideways else 0.0, angular)

        return BaseLimits(
            velocity=BodyTwist(self.max_vx_m_s, self.max_vy_m_s, self.max_wz_rad_s),
            acceleration=twist(self.acceleration_m_s2, self.angular_acceleration_rad_s2),
            jerk=twist(self.jerk_m_s3, self.angular_jerk_rad_s3),
            stop_deceleration=twist(self.stop_deceleration_m_s2, self.stop_angular_deceleration_rad_s2),
            reverse=self.reverse,
        )


@dataclass(frozen=True, slots=True)
class _Order:
    twist: F64  # (3,): vx, vy, wz
    applies_ns: int
    expires_ns: int


class Drive:
    """Turns commands into the twist that the wheels are asked for now.

    A command takes effect after the latency and until it expires; then, without one, the base brakes.  The set point
    moves along a ramp, per axis, and the drives follow it with a first-order lag.
    """

    def __init__(self, settings: DriveSettings) -> None:
        """Stand still, with no order."""
        self._limits = settings.limits
        self._up, self._down = _numbers(self._limits.acceleration), _numbers(self._limits.stop_deceleration)
        self._latency_ns = round(settings.command_latency_s * 1e9)
        self._lag_s = settings.motor_lag_s
        self._pending: deque[_Order] = deque()
        self._order: _Order | None = None
        self._rest = np.zeros(3)
        self._set_point, self._output = np.zeros(3), np.zeros(3)
        self._last_ns = 0
        self.expired = 0  # times the dead man had to act
        _follow(self._set_point, self._output, self._rest, self._up, self._down, 0.0, 1.0)  # compiled by now

    def command(self, twist: BodyTwist, expires_ns: int, now_ns: int) -> None:
        """Take an order; a twist beyond the caps is cut to them, as a motor controller does."""
        self._pending.append(_Order(_numbers(_capped(twist, self._limits)), now_ns + self._latency_ns, expires_ns))

    def stop(self) -> None:
        """Forget every order, so that the base brakes from the next step on."""
        self._pending.clear()
        self._order = None

    def step(self, now_ns: int) -> F64:
        """Return the twist that the wheels are to run at from now on: vx, vy, wz, shape (3,), until the next step."""
        dt_s = (now_ns - self._last_ns) * 1e-9
        self._last_ns = now_ns
        while self._pending and self._pending[0].applies_ns <= now_ns:
            self._order = self._pending.popleft()
        if self._order is not None and self._order.expires_ns <= now_ns:
            self._order = None
            self.expired += 1
        target = self._rest if self._order is None else self._order.twist
        share = 1.0 - math.exp(-dt_s / self._lag_s) if self._lag_s > 0.0 else 1.0
        _follow(self._set_point, self._output, target, self._up, self._down, dt_s, share)
        return self._output


def _numbers(twist: BodyTwist) -> F64:
    return np.array((twist.vx, twist.vy, twist.wz))


def _capped(twist: BodyTwist, limits: BaseLimits) -> BodyTwist:
    cap = limits.velocity
    lowest_vx = -cap.vx if limits.reverse else 0.0
    return BodyTwist(
        min(max(twist.vx, lowest_vx), cap.vx),
        min(max(twist.vy, -cap.vy), cap.vy),
        min(max(twist.wz, -cap.wz), cap.wz),
    )


@kernel()
def _follow(set_point: F64, output: F64, target: F64, up: F64, down: F64, dt_s: float, share: float) -> None:
    """Move the set point a step towards the target, and what the drives make of it a share of the way to that, each (3,)."""
    for axis in range(3):
        set_point[axis] = _approach(set_point[axis], target[axis], up[axis] * dt_s, down[axis] * dt_s)
        output[axis] += share * (set_point[axis] - output[axis])


@kernel()
def _approach(value: float, target: float, step_up: float, step_down: float) -> float:
    """Move a step towards the target: `step_up` away from rest, `step_down` towards rest, but never through it."""
    if value == target:
        return target
    if value * target < 0.0:
        target = 0.0
    step = step_down if abs(target) < abs(value) else step_up
    return value + min(max(target - value, -step), step)
