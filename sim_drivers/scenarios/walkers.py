"""Walkers: cylinders that go their way at constant speed and take no notice of the robot.

Source: Cui, Deng, Wang: a walker's 1.25 m/s (section 4.3), seeds that draw walkers' timing and lateral offset (appendix C),
random directions (figure 3).  The lowest speed, the sizes and the ranges of the draws are ours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sim_drivers.scenarios.corridor import START, CorridorSettings, Point, corridor
from sim_drivers.scene import Mover, Shape, StaticObstacle

F64 = NDArray[np.float64]

WALKER_HEIGHT_M = 1.7
AWAY_M = 3.5  # walkers wait and rest this far beyond goal and start, out of the paper's sensing range of 2.5 m
QUEUE_M = 0.8  # between two who wait
WALL_GAP_M = 0.1
HEADWAY_M = 1.5  # the next one sets out when the one before has walked this far


class WalkerSettings(CorridorSettings):
    """What all corridors with walkers share."""

    min_speed_m_s: float = Field(0.5, gt=0.0, le=2.0, description="slowest walker that is drawn")
    max_speed_m_s: float = Field(1.25, gt=0.0, le=2.0, description="fastest walker that is drawn")
    max_delay_s: float = Field(3.0, ge=0.0, le=60.0, description="longest wait that is drawn before a walker sets out")
    lateral_m: float = Field(0.3, ge=0.0, le=3.0, description="largest sideways offset that is drawn, to either side")
    walker_radius_m: float = Field(0.25, ge=0.1, le=0.35, description="radius of a walker")

    @model_validator(mode="after")
    def _consistent(self) -> WalkerSettings:
        if self.min_speed_m_s > self.max_speed_m_s:
            raise ValueError(f"min_speed_m_s {self.min_speed_m_s} is more than max_speed_m_s {self.max_speed_m_s}")
        widest = self.lateral_m + self.walker_radius_m
        if widest > self.half_width_m:
            raise ValueError(f"walkers reach {widest:.2f} m from the centre line, but half_width_m is {self.half_width_m}")
        return self

    @property
    def wall_lane_m(self) -> float:
        """How far from the centre line walks who keeps close to a wall."""
        return self.half_width_m - self.walker_radius_m - WALL_GAP_M


@dataclass(frozen=True, slots=True)
class Gait:
    """What is drawn for one walker."""

    start_s: float
    speed_m_s: float
    lateral_m: float


def draw_gaits(rng: np.random.Generator, settings: WalkerSettings, count: int) -> tuple[Gait, ...]:
    """Draw walkers who set out one after the other, the fastest first, so that none runs into the one before."""
    speeds = np.sort(rng.uniform(settings.min_speed_m_s, settings.max_speed_m_s, count))[::-1]
    delays = rng.uniform(0.0, settings.max_delay_s, count)
    laterals = rng.uniform(-settings.lateral_m, settings.lateral_m, count)
    headways = np.concatenate((np.zeros(1), HEADWAY_M / speeds[:-1]))[:count]
    starts = np.cumsum(delays + headways)
    return tuple(Gait(*map(float, drawn)) for drawn in zip(starts, speeds, laterals, strict=True))


def walker(index: int, timed_way: F64, radius_m: float) -> Mover:
    """Return the walker who is at given times [s] at given points [m] of the map, shape (n, 3); he faces where he goes."""
    legs = np.diff(timed_way[:, 1:], axis=0)
    yaw = np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))
    keyframes = np.column_stack((timed_way, np.append(yaw, yaw[-1])))
    return Mover(f"walker_{index}", Shape.cylinder(radius_m, WALKER_HEIGHT_M), keyframes)


def walk(way: list[Point], start_s: float, speed_m_s: float) -> F64:
    """Return times and points, shape (n, 3), of who goes along way points [m] from a time on.

    >>> walk([(0.0, 0.0), (3.0, 0.0), (3.0, 1.0)], start_s=2.0, speed_m_s=0.5)[:, 0].tolist()
    [2.0, 8.0, 10.0]
    """
    points = np.array(way)  # (n, 2)
    legs = np.diff(points, axis=0)
    times = start_s + np.concatenate((np.zeros(1), np.cumsum(np.hypot(legs[:, 0], legs[:, 1])) / speed_m_s))
    return np.column_stack((times, points))


def bounce(start: F64, heading_rad: float, speed_m_s: float, room: F64, until_s: float) -> F64:
    """Return times and points, shape (n, 3), of who goes straight on and is reflected by the walls of a room.

    Args:
        start: where he is at time zero [m], shape (2,), inside the room.
        heading_rad: where he goes.
        speed_m_s: how fast.
        room: lowest and highest x and y of his centre [m], shape (2, 2).
        until_s: the way lasts at least this long.
    """
    position, time_s = start.copy(), 0.0
    velocity = speed_m_s * np.array([math.cos(heading_rad), math.sin(heading_rad)])
    rows = [(time_s, *position)]
    while time_s < until_s:
        ahead = np.where(velocity > 0.0, room[1], room[0])
        time_to_wall = np.abs(ahead - position) / np.maximum(np.abs(velocity), 1e-9)  # (2,)
        step = float(time_to_wall.min())
        position = np.clip(position + step * velocity, room[0], room[1])
        velocity = np.where(time_to_wall < step + 1e-6, -velocity, velocity)  # both, in a corner
        time_s += step
        rows.append((time_s, *position))
    return np.array(rows)


def oncoming_x(settings: CorridorSettings, index: int, count: int) -> tuple[float, float]:
    """Return where the index-th of a queue of walkers sets out, beyond the goal, and where he rests, behind the start [m]."""
    return settings.goal_x_m + AWAY_M + index * QUEUE_M, START.x - AWAY_M - (count - 1 - index) * QUEUE_M


def walked_corridor(settings: CorridorSettings, count: int) -> tuple[StaticObstacle, ...]:
    """Return the walls of a corridor long enough for walkers to set out and rest out of the way."""
    beyond, _ = oncoming_x(settings, count - 1, count)
    _, behind = oncoming_x(settings, 0, count)
    return corridor(settings.half_width_m, behind - 1.0, beyond + 1.0)


def oncoming(settings: WalkerSettings, gaits: tuple[Gait, ...]) -> tuple[Mover, ...]:
    """Return walkers who come straight towards the robot, each in his own lane."""
    movers = []
    for index, gait in enumerate(gaits):
        x0, x1 = oncoming_x(settings, index, len(gaits))
        way = walk([(x0, gait.lateral_m), (x1, gait.lateral_m)], gait.start_s, gait.speed_m_s)
        movers.append(walker(index, way, settings.walker_radius_m))
    return tuple(movers)


def crossing_over(settings: WalkerSettings, gaits: tuple[Gait, ...], at_x_m: float, angle_rad: float) -> tuple[Mover, ...]:
    """Return walkers who come along one wall and cross over to the other: the first from the left, the next from the right.

    They cross the centre line near `at_x_m`, at an angle of `angle_rad` to it.  Not at a right angle: who walks faster than the
    robot drives and crosses its way squarely stays, until they meet, at a bearing that no forward-looking camera sees.
    """
    movers = []
    for index, gait in enumerate(gaits):
        lane = settings.wall_lane_m * (1.0 if index % 2 == 0 else -1.0)
        x0, x1 = oncoming_x(settings, index, len(gaits))
        x, run = at_x_m + gait.lateral_m, settings.wall_lane_m / math.tan(angle_rad)
        way = [(x0, lane), (x + run, lane), (x - run, -lane), (x1, -lane)]
        movers.append(walker(index, walk(way, gait.start_s, gait.speed_m_s), settings.walker_radius_m))
    return tuple(movers)
