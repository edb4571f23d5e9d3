"""Analytic worlds: discs and walls drawn into a belief with exact clearance, and a robot of pure kinematics among them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist, Command
from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal, Mission
from estimators.belief import FREE, OCCUPIED, UNKNOWN, Belief, ClearanceField, Lattice, OccupancyGrid
from planners.shield import ReachableSet

ORIGIN, STANDING = SE2(), BodyTwist()
OMNI = BaseLimits(
    BodyTwist(0.75, 0.5, 1.2), BodyTwist(1.5, 1.5, 4.0), BodyTwist(20.0, 20.0, 40.0), BodyTwist(2.0, 2.0, 5.0), reverse=True
)
DIFFERENTIAL = BaseLimits(
    BodyTwist(0.75, 0.0, 1.2), BodyTwist(1.5, 0.0, 4.0), BodyTwist(20.0, 0.0, 40.0), BodyTwist(2.0, 0.0, 5.0), reverse=True
)


@dataclass(frozen=True)
class Disc:
    x: float
    y: float
    radius: float
    vx: float = 0.0
    vy: float = 0.0

    def at(self, t: float) -> Disc:
        return Disc(self.x + self.vx * t, self.y + self.vy * t, self.radius, self.vx, self.vy)

    def distance(self, x, y):
        return np.hypot(x - self.x, y - self.y) - self.radius

    def rate(self, x, y):
        reach = np.maximum(np.hypot(x - self.x, y - self.y), 1e-9)
        return -((x - self.x) * self.vx + (y - self.y) * self.vy) / reach


@dataclass(frozen=True)
class Box:
    """Axis-aligned, from (x0, y0) to (x1, y1)."""

    x0: float
    y0: float
    x1: float
    y1: float
    vx: float = 0.0
    vy: float = 0.0

    def at(self, t: float) -> Box:
        dx, dy = self.vx * t, self.vy * t
        return Box(self.x0 + dx, self.y0 + dy, self.x1 + dx, self.y1 + dy, self.vx, self.vy)

    def _outside(self, x, y):
        dx = np.maximum(x - self.x1, 0.0) - np.maximum(self.x0 - x, 0.0)
        dy = np.maximum(y - self.y1, 0.0) - np.maximum(self.y0 - y, 0.0)
        return dx, dy

    def distance(self, x, y):
        dx, dy = self._outside(x, y)
        inside = np.minimum(np.minimum(x - self.x0, self.x1 - x), np.minimum(y - self.y0, self.y1 - y))
        return np.where(inside > 0.0, -inside, np.hypot(dx, dy))

    def rate(self, x, y):
        dx, dy = self._outside(x, y)
        reach = np.maximum(np.hypot(dx, dy), 1e-9)
        return -(dx * self.vx + dy * self.vy) / reach


def belief_of(
    obstacles,
    pose=ORIGIN,
    twist=STANDING,
    *,
    tick=0,
    size_m=6.0,
    cell_m=0.05,
    seen_m=None,
    fov_rad=None,
    map_from_odom=ORIGIN,
):
    """Draw the obstacles around the robot; `seen_m`: cells farther away are unknown; `fov_rad`: so are those outside of it."""
    count = round(size_m / cell_m)
    corner = [math.floor((v - 0.5 * size_m) / cell_m + 0.5) * cell_m for v in (pose.x, pose.y)]
    lattice = Lattice(corner[0], corner[1], cell_m, count, count)
    rows, columns = np.divmod(np.arange(count * count), count)
    x, y = lattice.centres(rows, columns).T
    clearance, rate = np.full(x.shape, 2.0 * size_m), np.zeros(x.shape)
    for obstacle in obstacles:
        distance = obstacle.distance(x, y)
        nearer = distance < clearance
        clearance = np.where(nearer, distance, clearance)
        rate = np.where(nearer, obstacle.rate(x, y), rate)
    rate[clearance <= 0.0] = 0.0
    label = np.where(clearance <= 0.0, OCCUPIED, FREE).astype(np.uint8)
    if seen_m is not None:
        label[np.hypot(x - pose.x, y - pose.y) > seen_m] = UNKNOWN
    if fov_rad is not None:
        bearing = np.arctan2(y - pose.y, x - pose.x) - pose.yaw
        label[(np.abs(np.arctan2(np.sin(bearing), np.cos(bearing))) > 0.5 * fov_rad) & (label == FREE)] = UNKNOWN
    shape = (count, count)
    grid = OccupancyGrid(lattice, label.reshape(shape))
    known = grid.label != UNKNOWN
    field_ = ClearanceField(
        lattice,
        np.maximum(clearance, 0.0).astype(np.float32).reshape(shape),
        rate.astype(np.float32).reshape(shape),
        known,
        known,
    )
    return Belief(tick, tick, pose, map_from_odom, twist, np.zeros((3, 3)), grid, field_, (), None, tick)


def mission_to(x, y, tolerance_m=0.2):
    return Mission(SE2(), (Goal(x, y, None, tolerance_m),))


def command_of(twist):
    return Command(twist, None, 10**9, 0)


def reachable_from(twist, limits, period_s):
    """The box of the acceleration limits (braking at the stop's deceleration), inside the caps."""
    low, high = [], []
    for axis in ("vx", "vy", "wz"):
        now, cap = getattr(twist, axis), getattr(limits.velocity, axis)
        speed_up, brake = getattr(limits.acceleration, axis) * period_s, getattr(limits.stop_deceleration, axis) * period_s
        floor = 0.0 if axis == "vx" and not limits.reverse else -cap
        lowest = now - (max(speed_up, min(brake, now)) if now > 0.0 else speed_up)
        highest = now + (max(speed_up, min(brake, -now)) if now < 0.0 else speed_up)
        low.append(min(max(lowest, floor), cap))
        high.append(min(max(highest, floor), cap))
    return ReachableSet(BodyTwist(*low), BodyTwist(*high))


@dataclass
class Trace:
    """What a closed-loop run went through."""

    poses: list = field(default_factory=list)
    twists: list = field(default_factory=list)
    clearance_m: list = field(default_factory=list)  # surface to surface
    plans: list = field(default_factory=list)
    filtered: list = field(default_factory=list)

    @property
    def min_clearance_m(self):
        return min(self.clearance_m)

    def reached(self, x, y, tolerance_m=0.35):
        last = self.poses[-1]
        return math.hypot(last.x - x, last.y - y) <= tolerance_m


def drive(
    planner,
    router,
    shield,
    obstacles,
    goal,
    *,
    limits=OMNI,
    start=ORIGIN,
    period_s=0.05,
    duration_s=20.0,
    radius_m=0.12,
    seen_m=None,
    fov_rad=None,
    tolerance_m=0.2,
):
    """Run planner, router and shield in a world of pure kinematics until the goal or the end of the time."""
    pose, twist, trace = start, BodyTwist(), Trace()
    mission = mission_to(*goal, tolerance_m)
    for tick in range(round(duration_s / period_s)):
        world = [o.at(tick * period_s) for o in obstacles]
        gap = min((float(o.distance(pose.x, pose.y)) for o in world), default=math.inf) - radius_m
        trace.poses.append(pose)
        trace.twists.append(twist)
        trace.clearance_m.append(gap)
        if math.hypot(pose.x - goal[0], pose.y - goal[1]) < tolerance_m and twist.speed_m_s < 0.1:
            break
        belief = belief_of(world, pose, twist, tick=tick, seen_m=seen_m, fov_rad=fov_rad)
        plan = planner.plan(belief, router.route(belief, mission))
        reachable = reachable_from(twist, limits, period_s)
        filtered = shield.filter(command_of(plan.base), belief, reachable)
        trace.plans.append(plan)
        trace.filtered.append(filtered)
        twist = filtered.command.base
        pose = pose.integrate(twist.vx, twist.vy, twist.wz, period_s)
    return trace
