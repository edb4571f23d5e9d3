"""Timed elastic bands: the time-optimal band among those on either side of what is in the way, for a differential base.

Sources: Roesmann et al., Trajectory modification considering dynamic constraints of autonomous robots, ROBOTIK 2012; Efficient
trajectory optimization using a sparse model, ECMR 2013; Integrated online trajectory planning and optimization in distinctive
topologies, Robotics and Autonomous Systems 88, 2017.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from drivers.interface.commands import BodyTwist
from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import frozen_array
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Belief
from planners import standing
from planners.planner import Diagnostics, Drawing, Plan, PlannerSetup
from planners.polyline import resample
from planners.router import Route
from planners.standing import Discs, StandingWorld, standing_world
from planners.static_field import movers
from planners.teb.band import Band, laid_along, taken_over
from planners.teb.graph_kernels import Bounds, Ends, Scene, Weights
from planners.teb.homotopy import Indices, detours, in_the_way, joined, sides, standing_discs
from planners.teb.optimiser_kernels import optimised
from planners.teb.settings import ElasticBandSettings
from planners.teb.window import Window, window_of


@dataclass(frozen=True, slots=True)
class ElasticBandDiagnostics(Diagnostics):
    """The band that was chosen, and among how many."""

    poses: int = 0
    duration_s: float = 0.0  # of the band
    cost: float = 0.0
    ways: int = 0  # classes of bands that were optimised
    feasible: bool = True  # False: its beginning touches something, and the robot brakes
    enclosed: bool = False  # the robot's own cell is occupied


class ElasticBand:
    """Optimises a band a call, warm-started, and drives its first step."""

    Settings = ElasticBandSettings
    default_shield: ClassVar[str] = "none"

    def __init__(self, settings: ElasticBandSettings, setup: PlannerSetup) -> None:
        """Take the limits.

        Raises:
            ConfigurationError: there is no base.
        """
        if setup.limits is None:
            raise ConfigurationError("planner.name 'teb' drives a base, but the robot has none")
        s, limits = settings, setup.limits
        self._settings, self._setup = settings, setup
        reverse = min(s.reverse_m_s, limits.velocity.vx) if limits.reverse else 0.0
        self._bounds = Bounds(
            min(s.max_speed_m_s, limits.velocity.vx), reverse, limits.velocity.wz,
            min(s.acceleration_m_s2, limits.acceleration.vx), min(s.acceleration_rad_s2, limits.acceleration.wz),
            s.margin_m, s.inflation_m, s.moving_inflation_m, s.penalty_margin,
        )  # fmt: skip
        self._weights = Weights(
            s.weight_time, s.weight_sideways, s.weight_forward, s.weight_speed, s.weight_rate, s.weight_acceleration,
            s.weight_turning, s.weight_obstacle, s.weight_inflation, s.weight_moving, s.weight_moving_inflation, s.weight_via,
        )  # fmt: skip
        self._band: Band | None = None

    def warm_up(self) -> None:
        """Compile the kernels."""
        standing.warm_up()
        field, discs = frozen_array(np.ones((3, 3), np.float32)), Discs.of(())
        scene = Scene(field, 0.0, 0.0, 1.0, 0.1, discs.centre, discs.velocity, discs.radius_m, np.zeros((1, 2)))
        band = self._laid(np.array([[0.0, 0.0], [1.0, 0.0]]), 0.0, 0.0)
        self._optimise(band, scene, Ends(0.0, 0.0, True))

    def plan(self, belief: Belief, route: Route) -> Plan:
        """Return the first step of the cheapest band; zero without a route, at its end, inside an obstacle, into one."""
        pose = np.array([belief.odom_from_base.x, belief.odom_from_base.y, belief.odom_from_base.yaw])
        world = standing_world(belief)
        here_m = float(world.clearance_at(pose[None, :2])[0])
        left_m = math.hypot(*(route.path_in_odom[-1] - pose[:2])) if not route.empty else 0.0
        if here_m <= 0.0 or left_m < self._settings.arrival_m:
            self._band = None
            return Plan(BodyTwist(), diagnostics=ElasticBandDiagnostics(enclosed=here_m <= 0.0))
        window, tracks = window_of(route.path_in_odom, pose, self._settings.look_ahead_m), Discs.of(movers(belief))
        band, cost, ways = self._cheapest(pose, window, world, tracks, belief.twist)
        feasible = self._feasible(band, world, tracks)
        self._band = band if feasible else None
        twist = self._first_twist(band) if feasible else BodyTwist()
        diagnostics = ElasticBandDiagnostics(len(band.poses), band.duration_s, cost, ways, feasible)
        return Plan(twist, path_in_odom=band.poses[:, :2].copy(), diagnostics=diagnostics, drawings=_drawings(band))

    def snapshot(self) -> bytes:
        """Return the band."""
        band = self._band or Band(np.zeros((0, 3)), np.zeros(0))
        return pack(poses=band.poses, times_s=band.times_s)

    def restore(self, snapshot: bytes) -> None:
        """Take over a band."""
        state = unpack(snapshot)
        self._band = Band(state["poses"], state["times_s"]) if len(state["poses"]) else None

    def _laid(self, path: F64, yaw: float, end_yaw: float) -> Band:
        return laid_along(path, yaw, end_yaw, self._bounds.speed_m_s, self._bounds.rate_rad_s, self._settings.step_s)

    def _scene(self, world: StandingWorld, tracks: Discs, path: F64) -> Scene:
        lattice = world.lattice
        via = resample(path, self._settings.via_spacing_m)[1:-1]
        return Scene(
            world.clearance_m, lattice.x_m, lattice.y_m, lattice.cell_m, self._setup.robot_radius_m,
            tracks.centre, tracks.velocity, tracks.radius_m, via,
        )  # fmt: skip

    def _optimise(self, band: Band, scene: Scene, ends: Ends) -> tuple[Band, float]:
        s = self._settings
        poses, times, cost = optimised(
            band.poses, band.times_s, scene, self._bounds, self._weights, ends,
            s.step_s, s.play_s, s.most_poses, s.rounds, s.iterations, s.obstacle_growth,
        )  # fmt: skip
        return Band(poses, times), cost

    def _cheapest(
        self, pose: F64, window: Window, world: StandingWorld, tracks: Discs, twist: BodyTwist
    ) -> tuple[Band, float, int]:
        """Return the cheapest band of all classes, its cost, and how many classes there were; the last one's is preferred."""
        scene, ends = self._scene(world, tracks, window.path), Ends(twist.vx, twist.wz, window.stops)
        fresh = self._laid(window.path, float(pose[2]), window.end_yaw)
        reach_m = self._setup.robot_radius_m + self._settings.margin_m
        obstacles, at = in_the_way(fresh, joined(tracks, standing_discs(world)), 2.0 * reach_m, self._settings.ways)
        begun = self._begun(pose, window)
        starts = [] if begun is None else [begun]
        starts += [*self._aside(fresh, obstacles, at, world, window), fresh]  # the last may lead through them
        best, best_cost, least, seen = fresh, math.inf, math.inf, set[tuple[bool, ...]]()
        for start in starts:
            way = sides(start, obstacles)
            if way in seen:
                continue
            seen.add(way)
            band, cost = self._optimise(start, scene, ends)
            weighed = cost * (self._settings.keep_way if start is begun else 1.0)
            if weighed < least:
                best, best_cost, least = band, cost, weighed
        return best, best_cost, len(seen)

    def _aside(self, fresh: Band, obstacles: Discs, at: Indices, world: StandingWorld, window: Window) -> list[Band]:
        """Return bands that pass the obstacles on every combination of sides, but for those that run into what stands."""
        if len(obstacles) == 0:
            return []
        pose, reach_m = fresh.poses[0], self._setup.robot_radius_m + self._settings.margin_m
        room_m = min(reach_m, float(world.clearance_at(pose[None, :2])[0]))
        paths = detours(fresh, obstacles, at, self._setup.robot_radius_m + self._settings.inflation_m)
        free = [path for path in paths if float(world.clearance_at(resample(path, 0.5 * reach_m)).min()) >= room_m]
        return [self._laid(path, float(pose[2]), window.end_yaw) for path in free]

    def _begun(self, pose: F64, window: Window) -> Band | None:
        """Return the last band from here to where the window ends; None when that has jumped."""
        s, end = self._settings, np.array([*window.path[-1], window.end_yaw])
        if self._band is None or math.hypot(*(self._band.poses[-1, :2] - end[:2])) > s.renewed_m:
            return None
        if math.hypot(*(self._band.poses[0, :2] - pose[:2])) > s.renewed_m:
            return None
        return taken_over(self._band, pose, end, self._setup.period_s, s.step_s, self._bounds.speed_m_s)

    def _feasible(self, band: Band, world: StandingWorld, tracks: Discs) -> bool:
        """Return whether the band's beginning touches nothing, nor comes nearer to what is nearer already."""
        radius_m = self._setup.robot_radius_m
        times = np.linspace(0.0, min(self._settings.checked_s, band.duration_s), 11)
        x, y = (np.interp(times, band.passed_s, band.poses[:, i]) for i in range(2))
        standing_m = world.clearance_at(np.stack((x, y), axis=1)) - radius_m
        if float(standing_m.min()) < min(0.0, float(standing_m[0]) - 0.5 * world.lattice.cell_m):
            return False
        centre = tracks.centre[None] + times[:, None, None] * tracks.velocity[None]
        gaps = np.hypot(x[:, None] - centre[..., 0], y[:, None] - centre[..., 1]) - tracks.radius_m - radius_m
        nearest = gaps.min(axis=1, initial=math.inf)
        return bool(nearest.min() >= min(0.0, float(nearest[0])))

    def _first_twist(self, band: Band) -> BodyTwist:
        """Return the band's first step inside the caps, its curvature kept."""
        speed, rate = band.first_twist
        cap, b = self._bounds.speed_m_s if speed > 0.0 else self._bounds.reverse_m_s, self._bounds
        share = min(1.0, cap / max(abs(speed), 1e-9), b.rate_rad_s / max(abs(rate), 1e-9))
        return BodyTwist(speed * share if cap > 0.0 else 0.0, 0.0, rate * (share if cap > 0.0 else 1.0))


def _drawings(band: Band) -> tuple[Drawing, ...]:
    """Return the band's poses, and where the robot will be at every whole second."""
    seconds = np.arange(1.0, band.duration_s)
    marks = np.stack([np.interp(seconds, band.passed_s, band.poses[:, i]) for i in range(2)], axis=1)
    return Drawing("band", band.poses[:, :2].copy(), False), Drawing("seconds", marks, False)
