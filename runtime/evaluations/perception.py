"""How good tracks are: compared with the truth, tick by tick, as seen from the robot, while an obstacle is in view."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.samples import DepthFrame, ObstacleTruth, TruthSample
from estimators.belief import Belief, Track
from estimators.standard import StandardSettings
from runtime import configuration
from runtime.assembly import Assembly
from runtime.cycle import Cycle
from runtime.evaluations.grid_score import GridFigures, GridScore
from runtime.run import RunOptions, run

F64 = NDArray[np.float64]
SETTLED_NS = 500_000_000  # an obstacle counts when it has been in view for so long
SEEN_AS_M = 0.3  # its surface is in the picture if depth there agrees so well; the picture is a moment old
MATCH_M = 0.5  # a track farther from every obstacle is of nothing
OTHER_M = 1e6


@dataclass(frozen=True, slots=True)
class PerceptionFigures:
    """What came of a run, over all obstacles and ticks that count."""

    looks: int  # obstacles that counted, summed over ticks
    missed: int  # of them without a track
    position_rms_m: float  # not a number when nothing was looked at
    velocity_rms_m_s: float
    switches: int  # an obstacle's track was another one than before
    phantoms_per_tick: float  # tracks near no obstacle
    false_tracks: int  # tracks that were near no obstacle as long as they lived


class TrackScore:
    """Hears every cycle of a run (as `RunOptions.progress`) and keeps count."""

    def __init__(self, range_max_m: float) -> None:
        """Only obstacles whose surface is nearer than `range_max_m` count."""
        self._range_max_m = range_max_m
        self._frame: DepthFrame | None = None
        self._since_ns: dict[str, int] = {}  # obstacles in view
        self._identity: dict[str, int] = {}
        self._errors: list[tuple[float, float]] = []  # position [m], velocity [m/s]
        self._ticks = self._missed = self._switches = self._phantoms = 0
        self._born: set[int] = set()  # identities; only counted
        self._true: set[int] = set()

    def hear(self, cycle: Cycle) -> None:
        """Score one tick."""
        truth, self._frame = cycle.sensed.truth, cycle.sensed.depth or self._frame
        if truth is None or self._frame is None:
            return
        self._ticks += 1
        tracks = cycle.belief.tracks
        offsets = np.array([_errors(obstacle, truth, track, cycle.belief) for obstacle in truth.obstacles for track in tracks])
        offsets = offsets.reshape(len(truth.obstacles), len(tracks), 2)
        pairs = _matched(offsets[:, :, 0])
        of_nothing = np.all(offsets[:, :, 0] > MATCH_M, axis=0)  # (tracks,)
        self._phantoms += int(of_nothing.sum())
        self._born.update(track.identity for track in tracks)
        self._true.update(track.identity for track, stray in zip(tracks, of_nothing.tolist(), strict=True) if not stray)
        for index, obstacle in enumerate(truth.obstacles):
            if self._counts(obstacle, truth, self._frame):
                if index in pairs:
                    self._score(obstacle.name, tracks[pairs[index]], offsets[index, pairs[index]])
                else:
                    self._missed += 1

    def _score(self, name: str, track: Track, errors: F64) -> None:
        self._errors.append((float(errors[0]), float(errors[1])))
        self._switches += self._identity.get(name, track.identity) != track.identity
        self._identity[name] = track.identity

    def _counts(self, obstacle: ObstacleTruth, truth: TruthSample, frame: DepthFrame) -> bool:
        """Tell whether an obstacle has been in view long enough."""
        now_ns = truth.stamp.captured_ns
        if not _in_view(truth.map_from_base.inverse() @ obstacle.map_from_obstacle, obstacle.radius_m, frame, self._range_max_m):
            self._since_ns.pop(obstacle.name, None)
            return False
        return now_ns - self._since_ns.setdefault(obstacle.name, now_ns) >= SETTLED_NS

    @property
    def figures(self) -> PerceptionFigures:
        """What came of it so far."""
        errors = np.array(self._errors).reshape(-1, 2)
        position, velocity = (float(np.sqrt(np.mean(squares))) if squares.size else math.nan for squares in np.square(errors).T)
        phantoms = self._phantoms / max(self._ticks, 1)
        looks = len(errors) + self._missed
        false = len(self._born - self._true)
        return PerceptionFigures(looks, self._missed, position, velocity, self._switches, phantoms, false)


@dataclass(frozen=True, slots=True)
class Perceived:
    """What came of one run."""

    tracks: PerceptionFigures
    grid: GridFigures


def perception(name_or_path: str, seed: int, overrides: tuple[str, ...] = ()) -> Perceived:
    """Run a simulated configuration with tracks from the grid and return how good they and the grid were.

    Raises:
        ConfigurationError: the configuration is wrong, has no world, or its estimator makes no grid from depth.
    """
    loaded = configuration.load(name_or_path, ("estimator.tracks=grid", *overrides))
    settings = loaded.estimator.settings
    if not isinstance(settings, StandardSettings):
        raise ConfigurationError(
            f"{name_or_path}: estimator.name '{loaded.estimator.name}': tracks are judged for 'standard' only"
        )
    if loaded.world is None:
        raise ConfigurationError(f"{name_or_path}: without a world there is no truth to judge perception by")
    tracks = TrackScore(settings.depth.range_max_m)
    grids: list[GridScore] = []

    def ready(assembly: Assembly) -> None:
        assert assembly.scene is not None  # there is a world
        grids.append(GridScore(assembly.scene, settings.depth.range_max_m))

    def progress(cycle: Cycle) -> None:
        tracks.hear(cycle)
        grids[0].hear(cycle)

    result = run(loaded, RunOptions(seed=seed, progress=progress, ready=ready))
    if result.failure is not None:
        raise result.failure
    return Perceived(tracks.figures, grids[0].figures)


def _errors(obstacle: ObstacleTruth, truth: TruthSample, track: Track, belief: Belief) -> tuple[float, float]:
    """Return how far off a track is for an obstacle, in position [m] and velocity [m/s], both seen from the robot."""
    to_truth, to_belief = truth.map_from_base.inverse(), belief.odom_from_base.inverse()
    place = to_truth @ obstacle.map_from_obstacle
    off = to_belief.apply(np.array(track.position_in_odom)) - (place.x, place.y)
    turned = _turned(track.velocity_in_odom, to_belief.yaw) - _turned(obstacle.velocity_m_s, to_truth.yaw)
    return float(np.hypot(*off)), float(np.hypot(*turned))


def _turned(vector: tuple[float, float], yaw: float) -> F64:
    return np.asarray(SE2(0.0, 0.0, yaw).apply(np.array(vector)))


def _matched(offsets_m: F64) -> dict[int, int]:
    """Return the obstacles' tracks, one to one, at the least total distance; none farther than `MATCH_M`."""
    cost = np.where(offsets_m <= MATCH_M, offsets_m, OTHER_M)
    return {int(o): int(t) for o, t in zip(*linear_sum_assignment(cost), strict=True) if cost[o, t] < OTHER_M}


def _in_view(base_from_obstacle: SE2, radius_m: float, frame: DepthFrame, range_max_m: float) -> bool:
    """Tell whether the whole of an obstacle is in the picture, in range, and the depth in its middle is its own."""
    k, camera = frame.intrinsics, frame.base_from_optical
    ahead = camera.inverse().apply(np.array([[base_from_obstacle.x, base_from_obstacle.y, camera.z]]))[0]
    distance_m = math.hypot(ahead[0], ahead[2])
    if ahead[2] <= 0.0 or not radius_m < distance_m <= range_max_m + radius_m:
        return False
    bearing, half = math.atan2(ahead[0], ahead[2]), math.asin(radius_m / distance_m)
    if max(abs(bearing - half), abs(bearing + half)) >= 0.5 * math.pi:
        return False
    left, right = (k.cx + k.fx * math.tan(bearing + side * half) for side in (-1.0, 1.0))
    if left < 0.0 or right > k.width - 1.0:
        return False
    column, row = round(k.cx + k.fx * math.tan(bearing)), round(k.cy)
    patch = frame.depth[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3]
    seen = patch[patch > 0] * frame.depth_unit_m
    return bool(seen.size) and abs(float(np.median(seen)) - (distance_m - radius_m) * math.cos(bearing)) < SEEN_AS_M
