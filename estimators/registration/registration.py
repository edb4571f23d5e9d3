"""Scan-to-map registration: the surface in each frame against straight walls seen before, which moves `map_from_odom` only.

What the frames are registered against.  The grid memory lies in odom and drifts with it: a frame laid on it can only agree
with the odometry that put it there.  So it decides here what is static (points on what came to stand where it was free take no
part), and the reference is apart from it, in map: straight pieces of the static surface, as lines that hold the moments of
their points (`estimators.registration.reference_lines`).  A wall keeps the direction and the place that the first, well-known
poses gave it, however long it is; later frames are laid on it before their points are taken in, so that they make it longer
but do not turn it.  Key scans chained one to the next would let the heading walk at random with each link.  Curved and small
things are not straight for `piece_min_m` and say nothing, a walker among them.

How.  Gauss-Newton on SE(2) for the pose of base in map at the frame's capture, of the weighted squared distances from points to
lines (point-to-line ICP: Censi, An ICP variant using a point-to-line metric, ICRA 2008) with Cauchy's weights, plus the
squared distance from the pose that odometry carried on since the last frame, by the covariance of that: an iterated extended
Kalman filter, whose state is where odom lies in the map.

Degeneracy.  In a corridor the frame does not say how far along one is.  Directions (of x, y and yaw, 1 rad counting as 1 m)
are the eigenvectors of the mean outer product of the distances' derivatives; those whose eigenvalue falls below a share are
undetermined: the frame moves the pose only along the others (Zhang, Kaess, Singh, On degeneracy of optimization-based state
estimation problems, ICRA 2016, solution remapping), and `Registration.undetermined` names them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2
from drivers.interface.samples import DepthFrame, Intrinsics, Stamp, frozen_array
from drivers.interface.sensed import Sensed
from drivers.interface.stateful import pack, unpack
from estimators.belief import F64, Registration
from estimators.grid.depth_grid import DepthGridSettings
from estimators.grid.scan_grid import ScanGridSettings
from estimators.memory.remembered import Remembered
from estimators.registration.reference_lines import ReferenceLines, Sighting
from estimators.registration.registration_settings import RegistrationSettings
from estimators.registration.scan_alignment import Alignment, Expected, align
from estimators.registration.slab_points import points_of_depth, points_of_scan
from estimators.registration.straight_pieces import straight_pieces

START_STD = np.array([1e-3, 1e-3, 1e-3])  # m, m, rad: the map is where the robot says that it starts


@dataclass(frozen=True, slots=True)
class SurfaceSource:
    """Which sensor the surface comes from, and how the grid reads it: the same slab and least range hold here."""

    kind: Literal["depth", "scan"]
    depth: DepthGridSettings
    scan: ScanGridSettings

    def points(self, sensed: Sensed, range_max_m: float, sectors: int) -> F64:
        """Return the surface in base, shape (n, 2) [m], of a tick whose frame is sound."""
        if self.kind == "scan":
            return points_of_scan(sensed.scans[-1], self.scan.range_min_m, range_max_m) if sensed.scans else np.empty((0, 2))
        return np.empty((0, 2)) if sensed.depth is None else points_of_depth(sensed.depth, self.depth, range_max_m, sectors)

    def warm_up(self) -> None:
        """Compile the kernel, on a frame that knows nothing."""
        nothing, pinhole = np.zeros((4, 4), dtype=np.uint16), Intrinsics(4, 4, 4.0, 4.0, 2.0, 2.0)
        points_of_depth(DepthFrame(Stamp(0, 0, 0), nothing, 0.001, pinhole, BODY_FROM_OPTICAL), self.depth, 1.0, 4)


class ScanRegistration:
    """Lays frames on the map; `update` with each, read `map_from_odom` and `latest`."""

    def __init__(self, settings: RegistrationSettings, source: SurfaceSource, map_from_start: SE2) -> None:
        """Start with odom where the robot starts, and no lines."""
        self._settings, self._source = settings, source
        self._lines = ReferenceLines(settings.lines_max, settings.trusted_after)
        self._map_from_odom = map_from_start
        self._covariance = np.diag(START_STD**2)  # (3, 3) of map_from_base at the last frame
        self._odom_from_base = SE2()  # at the last frame
        self._key = map_from_start  # map_from_base at the last key frame
        self._frame_ns: int | None = None
        self._frames = 0
        self.latest: Registration | None = None  # what the last frame gave

    @property
    def map_from_odom(self) -> SE2:
        """Where odom lies in the map."""
        return self._map_from_odom

    def warm_up(self) -> None:
        """Compile every kernel, on a wall that is seen twice; what is believed stays as it is."""
        wall = np.stack((np.linspace(1.0, 3.0, 40), np.ones(40)), axis=-1)
        self._source.warm_up()
        spare = ScanRegistration(self._settings, self._source, SE2())
        for stamp_ns in range(2):
            spare.register(wall, SE2(), stamp_ns)

    def update(self, sensed: Sensed, odom_from_base: SE2, remembered: Remembered, captured_ns: int) -> None:
        """Take in the sound frame of this tick, captured at `captured_ns` with the robot at `odom_from_base`.

        `remembered` is what the memory knows with that frame.
        """
        surface = self._source.points(sensed, self._settings.range_max_m, self._settings.sectors)
        self.register(surface[~came(surface, odom_from_base, remembered)], odom_from_base, captured_ns)

    def register(self, surface: F64, odom_from_base: SE2, captured_ns: int) -> None:
        """Take in the static surface in base, shape (n, 2) [m], neighbours next to each other."""
        settings = self._settings
        noise_m = settings.noise_floor_m + settings.noise_per_m * (surface**2).sum(axis=1)
        deviation_m = settings.piece_deviation_m + noise_m
        found = straight_pieces(surface, deviation_m, settings.piece_gap_m, settings.piece_min_m, settings.piece_points_min)
        expected = self._expected(odom_from_base, captured_ns)
        aligned = align(found, noise_m, expected, self._lines, settings)
        pose = SE2(*aligned.pose.tolist())
        self._map_from_odom = pose @ odom_from_base.inverse()
        self._covariance, self._odom_from_base, self._frame_ns = aligned.covariance, odom_from_base, captured_ns
        self._frames += 1
        if aligned.believed:
            self._learn(Sighting(found, noise_m, deviation_m, aligned.line), pose)
        self.latest = _registration(aligned, expected, captured_ns)

    def _expected(self, odom_from_base: SE2, captured_ns: int) -> Expected:
        """Return where odometry has carried the robot since the last frame, and how sure that is."""
        settings, pose = self._settings, self._map_from_odom @ odom_from_base
        before = self._map_from_odom @ self._odom_from_base
        way_m = before.distance(pose)
        time_s = 0.0 if self._frame_ns is None else (captured_ns - self._frame_ns) * 1e-9
        turns = np.array([[1.0, 0.0, before.y - pose.y], [0.0, 1.0, pose.x - before.x], [0.0, 0.0, 1.0]])
        place = settings.drift_per_sqrt_m**2 * way_m
        heading = settings.drift_rad_per_sqrt_m**2 * way_m + settings.drift_rad_per_sqrt_s**2 * time_s
        spread = turns @ self._covariance @ turns.T + np.diag([place, place, heading])
        return Expected(np.array([pose.x, pose.y, pose.yaw]), spread)

    def _learn(self, seen: Sighting, map_from_base: SE2) -> None:
        settings, turned = self._settings, (self._key.inverse() @ map_from_base).yaw
        key = self._key.distance(map_from_base) >= settings.key_m or abs(turned) >= settings.key_rad
        if key:
            self._key = map_from_base
        in_map = replace(seen, pieces=replace(seen.pieces, points=map_from_base.apply(seen.pieces.points)))
        self._lines.learn(in_map, self._frames, None if key else settings.settle_frames)

    def snapshot(self) -> bytes:
        """Return the whole state."""
        poses = [(pose.x, pose.y, pose.yaw) for pose in (self._map_from_odom, self._odom_from_base, self._key)]
        return pack(
            poses=poses,
            covariance=self._covariance,
            frame_ns=np.array([] if self._frame_ns is None else [self._frame_ns], dtype=np.int64),
            frames=self._frames,
            lines=np.frombuffer(self._lines.snapshot(), dtype=np.uint8),
            **_packed(self.latest),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._map_from_odom, self._odom_from_base, self._key = (SE2(*pose) for pose in state["poses"].tolist())
        self._covariance, self._frames = state["covariance"], int(state["frames"])
        self._frame_ns = int(state["frame_ns"][0]) if state["frame_ns"].size else None
        self._lines.restore(state["lines"].tobytes())
        self.latest = _unpacked(state)


def came(surface: F64, odom_from_base: SE2, remembered: Remembered) -> NDArray[np.bool_]:
    """Return which points of the surface in base, shape (n, 2), lie on what was not always there; beyond the grid none does."""
    lattice = remembered.grid.lattice
    rows, columns = lattice.cell_of(odom_from_base.apply(surface))
    inside = (rows >= 0) & (rows < lattice.rows) & (columns >= 0) & (columns < lattice.columns)
    found = np.zeros(len(surface), dtype=np.bool_)
    found[inside] = remembered.came[rows[inside], columns[inside]]
    return found


def _registration(aligned: Alignment, expected: Expected, captured_ns: int) -> Registration:
    correction = SE2(*(aligned.pose - expected.pose).tolist())
    return Registration(
        captured_ns=captured_ns,
        points=aligned.points,
        residual_m=aligned.residual_m,
        correction=SE2(correction.x, correction.y, math.remainder(correction.yaw, math.tau)),
        covariance=frozen_array(aligned.covariance),
        undetermined=frozen_array(aligned.undetermined.copy() if aligned.believed else np.eye(3)),
    )


def _packed(latest: Registration | None) -> dict[str, NDArray[np.float64] | NDArray[np.int64]]:
    if latest is None:
        return {"counts": np.empty(0, dtype=np.int64)}
    correction = latest.correction
    return {
        "counts": np.array([latest.captured_ns, latest.points], dtype=np.int64),
        "gave": np.array([latest.residual_m, correction.x, correction.y, correction.yaw]),
        "gave_covariance": latest.covariance,
        "undetermined": latest.undetermined,
    }


def _unpacked(state: dict[str, NDArray[np.float64]]) -> Registration | None:
    if not state["counts"].size:
        return None
    captured_ns, points = state["counts"].tolist()
    residual_m, x, y, yaw = state["gave"].tolist()
    spread, undetermined = frozen_array(state["gave_covariance"]), frozen_array(state["undetermined"])
    return Registration(captured_ns, points, residual_m, SE2(x, y, yaw), spread, undetermined)
