"""The finite command set of a base that is driven by (v, omega), and where the base gets under each command.

A command is a target: the base's velocity approaches it with a time constant and within its acceleration, so the same lattice
serves at any present velocity.  A base that can strafe is driven without: vy = 0.

Source of the finite differential-drive lattice: Han, Zhu, RCSP, sections 3 and 4.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.kernel import kernel
from drivers.interface.settings import Settings
from estimators.belief import UNKNOWN
from estimators.field_query import bilinear

F64 = NDArray[np.float64]
F32 = NDArray[np.float32]

_SPARE_M = 1e-3  # who stands nearer than he should may go on where it is no narrower, to this
_STEEPEST = 1.5  # no interpolated field of distances falls by more per metre


class LatticeSettings(Settings):
    """The command set U and how the base answers; 11 x 15 = 165 commands."""

    max_speed_m_s: float = Field(default=0.65, gt=0.0, le=5.0, description="cruise cap, below the base's own")
    reverse_m_s: float = Field(default=0.65, ge=0.0, le=5.0, description="fastest backwards, where the base may reverse at all")
    max_turn_rad_s: float = Field(default=1.5, gt=0.0, le=10.0, description="below the base's own")
    speeds: int = Field(default=11, ge=2, le=101)
    turns: int = Field(default=15, ge=3, le=101)
    latency_s: float = Field(default=0.1, ge=0.0, le=1.0, description="from the belief to when the drives hear of the command")
    response_s: float = Field(default=0.12, ge=0.0, le=2.0, description="time constant with which the base's velocity follows")


@dataclass(frozen=True, slots=True)
class VelocityLattice:
    """All pairs of a speed and a turn; command u has speed u // turns and turn u % turns."""

    speed_m_s: F64  # (speeds,), increasing, zero among them
    turn_rad_s: F64  # (turns,), likewise

    @classmethod
    def of(cls, settings: LatticeSettings, limits: BaseLimits) -> VelocityLattice:
        """Return the lattice of a base."""
        fastest, turn = min(settings.max_speed_m_s, limits.velocity.vx), min(settings.max_turn_rad_s, limits.velocity.wz)
        slowest = -min(settings.reverse_m_s, limits.velocity.vx) if limits.reverse else 0.0
        return cls(_through_zero(slowest, fastest, settings.speeds), _through_zero(-turn, turn, settings.turns))

    def __len__(self) -> int:
        """Return the number of commands."""
        return len(self.speed_m_s) * len(self.turn_rad_s)

    @property
    def index_of_rest(self) -> int:
        """The command to stand."""
        rest = int(np.argmin(np.abs(self.speed_m_s))), int(np.argmin(np.abs(self.turn_rad_s)))
        return rest[0] * len(self.turn_rad_s) + rest[1]

    def nearest(self, twist: BodyTwist) -> int:
        """Return the command nearest to how a base drives, axis by axis."""
        speed, turn = np.argmin(np.abs(self.speed_m_s - twist.vx)), np.argmin(np.abs(self.turn_rad_s - twist.wz))
        return int(speed) * len(self.turn_rad_s) + int(turn)

    def change_from(self, index: int) -> F64:
        """Return how far each command is from one of them, shape (commands,), in full speeds and turns."""
        speed, turn = divmod(index, len(self.turn_rad_s))
        along = np.abs(self.speed_m_s - self.speed_m_s[speed]) / self.speed_m_s[-1]
        across = np.abs(self.turn_rad_s - self.turn_rad_s[turn]) / self.turn_rad_s[-1]
        return np.asarray((along[:, None] + across).ravel())

    def twist(self, index: int) -> BodyTwist:
        """Return a command."""
        return BodyTwist(
            float(self.speed_m_s[index // len(self.turn_rad_s)]), 0.0, float(self.turn_rad_s[index % len(self.turn_rad_s)])
        )


def _through_zero(lowest: float, highest: float, count: int) -> F64:
    """Return `count` values from lowest to highest; the one nearest to zero is zero.

    >>> _through_zero(-0.2, 1.0, 5).round(3).tolist()
    [-0.2, 0.0, 0.4, 0.7, 1.0]
    """
    values = np.linspace(lowest, highest, count)
    values[int(np.argmin(np.abs(values)))] = 0.0
    return values


class Drive(NamedTuple):
    """How a base answers a command."""

    acceleration: float  # m/s^2
    turn_acceleration: float  # rad/s^2
    latency_s: float
    response_s: float

    @classmethod
    def of(cls, settings: LatticeSettings, limits: BaseLimits) -> Drive:
        """Return that of a base."""
        return cls(limits.acceleration.vx, limits.acceleration.wz, settings.latency_s, settings.response_s)


class Ground(NamedTuple):
    """What stands still around the robot; lengths in metres, odom frame."""

    clearance: F32  # (rows, columns), to the centres of occupied cells
    label: NDArray[np.uint8]  # (rows, columns)
    corner_x: float
    corner_y: float
    cell_m: float
    radius_m: float  # of the robot
    hold_m: float  # nearer than this to what stands still it does not go: there it brakes
    body_m: float  # it also brakes before cells that were never seen, but for those so near; negative: they count as free
    far_m: float  # clearance beyond which more makes no difference: there it is not looked up at every step


class Rollouts(NamedTuple):
    """Where each command leads; the pose at the end of every step."""

    x: F32  # (commands, steps), in odom
    y: F32  # (commands, steps)
    yaw: F32  # (commands, steps)
    static_m: F32  # (commands,): least clearance to what stands still, surface to surface, exact up to the ground's `far_m`
    held: NDArray[np.int64]  # (commands,): steps driven before it had to brake for that; all of them where it had not
    brakable: NDArray[np.bool_]  # (commands,): it can stop in time where it has to
    rest: F32  # (commands, 2): where it stands after the last step when it brakes there, in odom


def path_of(rolled: Rollouts, command: int) -> F64:
    """Return where one command leads, shape (steps, 2), in odom."""
    path = np.empty((rolled.x.shape[1], 2))
    path[:, 0], path[:, 1] = rolled.x[command], rolled.y[command]
    return path


@kernel()
def _never_seen(label: NDArray[np.uint8], columns: float, rows: float) -> bool:
    """Return whether a point, in cells from the lower corner, lies in a cell that was never seen; outside none was."""
    inside = 0.0 <= rows < label.shape[0] and 0.0 <= columns < label.shape[1]
    return not inside or label[np.uint32(rows), np.uint32(columns)] == UNKNOWN


@kernel()
def profiles(now: float, targets: F64, acceleration: float, response_s: float, step_s: float, steps: int) -> F64:
    """Return the velocities at the ends of the steps, first the present one, shape (targets, steps + 1)."""
    share = 1.0 - math.exp(-step_s / response_s) if response_s > 0.0 else 1.0
    most = acceleration * step_s
    values = np.empty((len(targets), steps + 1))
    for i in range(len(targets)):
        values[i, 0] = now
        for k in range(steps):
            change = (targets[i] - values[i, k]) * share
            values[i, k + 1] = values[i, k] + min(max(change, -most), most)
    return values


@kernel()
def after_latency(pose: F64, now: F64, asked: F64, drive: Drive) -> tuple[F64, F64]:
    """Return pose (x, y, yaw) and velocity (v, omega) when the next command takes hold, the last one being followed till then.

    Args:
        pose: x, y, yaw in odom, shape (3,).
        now: v and omega driven now, shape (2,).
        asked: v and omega asked last, shape (2,).
        drive: how the base answers.
    """
    v = profiles(now[0], asked[:1], drive.acceleration, drive.response_s, drive.latency_s, 1)[0]
    w = profiles(now[1], asked[1:], drive.turn_acceleration, drive.response_s, drive.latency_s, 1)[0]
    forward_m, turned = 0.5 * (v[0] + v[1]) * drive.latency_s, 0.5 * (w[0] + w[1]) * drive.latency_s
    heading = pose[2] + 0.5 * turned
    moved = np.array([pose[0] + forward_m * np.cos(heading), pose[1] + forward_m * np.sin(heading), pose[2] + turned])
    return moved, np.array([v[1], w[1]])


@kernel()
def least_room(points: F64, around: Ground) -> float:
    """Return the least clearance to what stands still at some points, shape (n, 2), surface to surface [m]."""
    least = np.inf
    for i in range(len(points)):
        c = bilinear(around.clearance, around.corner_x, around.corner_y, around.cell_m, points[i, 0], points[i, 1])
        least = min(least, c - around.radius_m)
    return least


@kernel()
def roll_out(pose: F64, now: F64, speeds: F64, turns: F64, drive: Drive, step_s: float, steps: int, around: Ground) -> Rollouts:
    """Drive every pair of a speed and a turn from a pose, shape (3,), and a velocity, shape (2,).

    Heading depends on the turn alone and speed on the speed alone, so that sines are taken once per turn.  Each step goes
    straight in the direction of its middle.
    """
    v = profiles(now[0], speeds, drive.acceleration, drive.response_s, step_s, steps)
    w = profiles(now[1], turns, drive.turn_acceleration, drive.response_s, step_s, steps)
    count = len(speeds) * len(turns)
    x, y, yaw = np.empty((count, steps), np.float32), np.empty((count, steps), np.float32), np.empty((count, steps), np.float32)
    static, held, brakable = np.empty(count, np.float32), np.empty(count, np.int64), np.empty(count, np.bool_)
    rest = np.empty((count, 2), np.float32)
    cosine, sine, heading = np.empty(steps), np.empty(steps), np.empty(steps)
    here = bilinear(around.clearance, around.corner_x, around.corner_y, around.cell_m, pose[0], pose[1]) - around.radius_m
    least = min(around.hold_m, here - _SPARE_M)
    far, label, per_cell = max(around.far_m, around.hold_m), around.label, 1.0 / around.cell_m
    for j in range(len(turns)):
        angle = pose[2]
        for k in range(steps):
            turned = 0.5 * (w[j, k] + w[j, k + 1]) * step_s
            cosine[k], sine[k] = np.cos(angle + 0.5 * turned), np.sin(angle + 0.5 * turned)
            angle += turned
            heading[k] = angle
        for i in range(len(speeds)):
            u = i * len(turns) + j
            px, py, room, driven, travelled, free = pose[0], pose[1], here, steps, 0.0, (here - far) / _STEEPEST
            for k in range(steps):
                if driven == steps:
                    forward = 0.5 * (v[i, k] + v[i, k + 1]) * step_s
                    nx, ny = px + forward * cosine[k], py + forward * sine[k]
                    free, c = free - abs(forward), room
                    if free < 0.0:
                        c = bilinear(around.clearance, around.corner_x, around.corner_y, around.cell_m, nx, ny) - around.radius_m
                        free = (c - far) / _STEEPEST
                    blind = 0.0 <= around.body_m < travelled + abs(forward)
                    blind = blind and _never_seen(label, (nx - around.corner_x) * per_cell, (ny - around.corner_y) * per_cell)
                    if c < least or blind:
                        driven = k
                    else:
                        px, py, room, travelled = nx, ny, min(room, c), travelled + abs(forward)
                x[u, k], y[u, k], yaw[u, k] = px, py, heading[min(k, max(driven - 1, 0))]
            fastest = max(abs(v[i, 0]), abs(v[i, 1]))
            stop_m = fastest * step_s + 0.5 * fastest * fastest / drive.acceleration
            static[u], held[u], brakable[u] = room, driven, driven == steps or stop_m <= travelled
            on_m = 0.5 * v[i, steps] * abs(v[i, steps]) / drive.acceleration if driven == steps else 0.0
            rest[u, 0], rest[u, 1] = px + on_m * cosine[steps - 1], py + on_m * sine[steps - 1]
    return Rollouts(x, y, yaw, static, held, brakable, rest)
