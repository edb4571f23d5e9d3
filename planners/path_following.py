"""What planners share that follow the route as a path: the piece of it ahead, the room they keep, and why they stand."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interface.commands import BaseLimits
from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import wrap_angle
from estimators.belief import Belief
from estimators.field_query import sample
from planners.planner import PlannerSetup
from planners.polyline import arc_length, resample
from planners.router import Route

F64 = NDArray[np.float64]

NO_ROUTE, INVALID, ENCLOSED, ARRIVED = "no route", "invalid pose or velocity", "inside an obstacle", "arrived"


@dataclass(frozen=True, slots=True)
class Task:
    """What there is to follow at a tick, all in odom; `standing` says why nothing is followed, in which case `path` is empty."""

    pose: F64  # (3,): x, y [m], yaw [rad]
    path: F64  # (n, 2), from the point nearest to the robot on, with equal spacing
    left_m: float = 0.0  # along the route from there to its end
    goal: tuple[float, float] = (0.0, 0.0)  # the route's end
    distance_m: float = 0.0  # from the robot to it, straight
    turn_rad: float | None = None  # left to turn to the heading asked for at the goal; None: any heading will do
    required_m: float = 0.0  # clearance of the robot's centre below which a place counts as a collision
    standing: str = ""


def limits_of(setup: PlannerSetup, name: str) -> BaseLimits:
    """Return the limits of the base.

    Raises:
        ConfigurationError: there is none.
    """
    if setup.limits is None:
        raise ConfigurationError(f"planner.name '{name}' drives a base, but the robot has none")
    return setup.limits


def task_of(belief: Belief, route: Route, required_m: float, arrival_m: float, length_m: float, spacing_m: float) -> Task:
    """Return what to follow: at most `length_m` of the route, from where the robot is on it.

    A robot that stands nearer to something than `required_m` may still go where it is no narrower than here, or it could
    never leave.  Nearer to the goal than `arrival_m`, only the heading is left to see to.
    """
    here = belief.odom_from_base
    pose = np.array([here.x, here.y, here.yaw])
    if not (np.isfinite(pose).all() and belief.twist.finite and np.isfinite(route.path_in_odom).all()):
        return Task(pose, np.zeros((0, 2)), standing=INVALID)
    if len(route.path_in_odom) < 2:
        return Task(pose, np.zeros((0, 2)), standing=NO_ROUTE)
    clearance_m = float(sample(belief.clearance.clearance_m, belief.clearance.lattice, pose[None, :2])[0])
    if clearance_m <= 0.0:
        return Task(pose, np.zeros((0, 2)), standing=ENCLOSED)
    path, left_m = ahead(route.path_in_odom, pose[:2], length_m, spacing_m)
    goal = float(route.path_in_odom[-1, 0]), float(route.path_in_odom[-1, 1])
    distance_m = math.hypot(goal[0] - pose[0], goal[1] - pose[1])
    turn_rad = None if route.goal_yaw_in_odom is None else wrap_angle(route.goal_yaw_in_odom - pose[2])
    if distance_m < arrival_m and turn_rad is None:
        return Task(pose, np.zeros((0, 2)), standing=ARRIVED)
    return Task(pose, path, left_m, goal, distance_m, turn_rad, min(required_m, clearance_m))


def ahead(path: F64, position: F64, length_m: float, spacing_m: float) -> tuple[F64, float]:
    """Return the path from its point nearest to the position on, resampled and cut, shape (m, 2), and how much is left uncut [m].

    >>> points, left_m = ahead(np.array([[0.0, 0.0], [4.0, 0.0]]), np.array([1.0, 0.5]), 1.0, 0.5)
    >>> points.tolist(), left_m
    ([[1.0, 0.0], [1.5, 0.0], [2.0, 0.0]], 3.0)
    """
    start, step = path[:-1], np.diff(path, axis=0)
    share = ((position - start) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-12)
    foot = start + np.clip(share, 0.0, 1.0)[:, None] * step
    nearest = int(np.argmin(np.hypot(*(foot - position).T)))
    rest = np.concatenate((foot[nearest : nearest + 1], path[nearest + 1 :]))
    along = arc_length(rest)
    left_m, kept_m = float(along[-1]), min(length_m, float(along[-1]))
    end = [[np.interp(kept_m, along, rest[:, 0]), np.interp(kept_m, along, rest[:, 1])]]
    return resample(np.concatenate((rest[along < kept_m], end)) if kept_m > 0.0 else rest[[0, -1]], spacing_m), left_m
