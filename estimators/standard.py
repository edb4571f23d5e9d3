"""The standard estimator: odometry, labelled grid with memory, clearance field."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field

from drivers.interface.geometry import SE2
from drivers.interface.samples import JointSample
from drivers.interface.sensed import Sensed
from drivers.interface.settings import Settings
from drivers.interface.stateful import pack, unpack
from estimators.belief import FREE, Belief, EstimatorFault, Track
from estimators.clearance import ClearanceEstimator, ClearanceSettings
from estimators.estimator import EstimatorSetup
from estimators.grid.depth_grid import DepthGrid, DepthGridSettings
from estimators.grid.grid_filter import GridFilter
from estimators.grid.labelling import FrameLabels, FrameSource
from estimators.grid.scan_grid import ScanGrid, ScanGridSettings
from estimators.joint_state import pack_joints, unpack_joints
from estimators.memory.memory import MemorySettings, memory_of
from estimators.odometry.odometry import Odometry, OdometryEstimate, latest_valid_ns
from estimators.odometry.odometry_choice import OdometrySettings, build_odometry
from estimators.odometry.truth_odometry import TruthOdometry
from estimators.registration.registration import ScanRegistration, SurfaceSource
from estimators.registration.registration_settings import RegistrationSettings
from estimators.tracks.marker_settings import MarkerSettings
from estimators.tracks.tracking_settings import TrackingSettings
from estimators.tracks.truth_tracks import tracks_from_truth

if TYPE_CHECKING:
    from estimators.tracks.marker_tracking import MarkerTracker
    from estimators.tracks.tracking import GridTracker


class StandardSettings(Settings):
    """What each part of the standard estimator is set to."""

    pose: Literal["odometry", "truth"] = Field(default="odometry", description="where the pose comes from")
    tracks: Literal["none", "truth", "grid", "aruco"] = Field(default="none", description="where tracks of obstacles come from")
    source: Literal["depth", "scan"] = Field(default="depth", description="which sensor the grid is made from")
    cell_m: float = Field(default=0.05, ge=0.01, le=0.5, description="side of a cell of grid and clearance field")
    odometry: OdometrySettings = OdometrySettings()
    depth: DepthGridSettings = DepthGridSettings()
    scan: ScanGridSettings = ScanGridSettings()
    memory: MemorySettings = MemorySettings()
    clearance: ClearanceSettings = ClearanceSettings()
    tracking: TrackingSettings = TrackingSettings()
    markers: MarkerSettings = MarkerSettings()
    registration: RegistrationSettings = RegistrationSettings()


class StandardEstimator:
    """Makes a `Belief` from wheels or device pose, one range sensor, and the truth where the settings say so.

    Pose and twist are those of the tick.  The grid changes only when a frame comes: it and its window are those of the
    frame's capture.  Without frames the window moves on only where the robot nears its border.
    """

    Settings: ClassVar[type[Settings]] = StandardSettings

    def __init__(self, settings: StandardSettings, setup: EstimatorSetup) -> None:
        """Start at the identity of odom, with nothing known but the ground under the robot."""
        self._settings, self._setup = settings, setup
        self._odometry = _odometry_of(settings, setup)
        self._source: FrameSource = (
            DepthGrid(settings.depth, settings.cell_m) if settings.source == "depth" else ScanGrid(settings.scan, settings.cell_m)
        )
        filtered = settings.source == "depth" and settings.depth.filtered
        self._filter = GridFilter(settings.depth.filter, settings.cell_m) if filtered else None
        self._memory = memory_of(settings.memory, settings.cell_m, setup.robot_radius_m)
        self._clearance = ClearanceEstimator(settings.clearance)
        self._tracker = _tracker_of(settings)
        self._markers = _marker_tracker_of(settings)
        self._registration = _registration_of(settings, setup)
        self._grid = self._memory.grid
        self._frame_ns: int | None = None  # capture time of the newest frame used
        self._joints: JointSample | None = None

    def warm_up(self) -> None:
        """Compile every kernel; what is believed stays as it is."""
        self._odometry.warm_up()
        self._source.warm_up()
        if self._tracker is not None:
            self._tracker.warm_up()
        if self._registration is not None:
            self._registration.warm_up()
        spare = memory_of(self._settings.memory, self._settings.cell_m, self._setup.robot_radius_m)
        spare.merge(FrameLabels(spare.grid, spare.grid.label == FREE), 0, SE2())

    def update(self, sensed: Sensed) -> Belief:
        """Fold in all samples and return the belief at the tick; bad input is a fault in it."""
        odometry = self._odometry.update(sensed)
        valid = self._see(sensed)
        if self._markers is not None:
            valid &= self._markers.update(sensed.markers, latest_valid_ns(sensed), self._odometry.pose_at)
        if self._clearance.field is None or self._memory.strays(odometry.odom_from_base):
            self._memory.follow(odometry.odom_from_base)
            self._refresh(self._frame_ns or 0)
        if sensed.joints:
            self._joints = sensed.joints[-1]
        return self._belief(sensed, odometry, valid)

    def _see(self, sensed: Sensed) -> bool:
        """Fold in the frame that came, if one did; False: it could not be used."""
        stamp = self._source.stamp(sensed)
        if stamp is None:
            return True
        captured_ns = stamp.captured_ns
        if captured_ns > latest_valid_ns(sensed) or (self._frame_ns is not None and captured_ns <= self._frame_ns):
            return False
        pose = self._odometry.pose_at(captured_ns)
        frame = self._source.see(sensed, pose)
        if frame is None:
            return False
        if self._filter is not None:
            frame = self._filter.apply(frame, captured_ns)
        self._memory.merge(frame, captured_ns, pose)
        self._frame_ns = captured_ns
        self._refresh(captured_ns)
        if self._tracker is None and self._registration is None:
            return True
        remembered = self._memory.remembered
        if self._tracker is not None:
            self._tracker.update(frame, remembered, captured_ns)
        if self._registration is not None:
            self._registration.update(sensed, pose, remembered, captured_ns)
        return True

    @property
    def _map_from_odom(self) -> SE2:
        return self._setup.map_from_start if self._registration is None else self._registration.map_from_odom

    def _refresh(self, stamp_ns: int) -> None:
        self._grid = self._memory.grid
        self._clearance.update(self._grid, stamp_ns)

    def _belief(self, sensed: Sensed, odometry: OdometryEstimate, valid: bool) -> Belief:
        field = self._clearance.field
        assert field is not None  # `update` has seen to it
        stamp_ns = sensed.tick.start_ns
        joints_ns = None if self._joints is None else self._joints.stamp.captured_ns
        markers_ns = None if self._markers is None else self._markers.stamp_ns
        captures = (odometry.newest_capture_ns, self._frame_ns, joints_ns, markers_ns)
        return Belief(
            tick=sensed.tick.index,
            stamp_ns=stamp_ns,
            odom_from_base=odometry.odom_from_base,
            map_from_odom=self._map_from_odom,
            twist=odometry.twist,
            covariance=odometry.covariance,
            grid=self._grid,
            clearance=field,
            tracks=self._tracks(sensed),
            joints=self._joints,
            oldest_input_ns=min((captured_ns for captured_ns in captures if captured_ns is not None), default=stamp_ns),
            faults=odometry.faults if valid or odometry.faults else (EstimatorFault.INVALID_INPUT,),
            registration=None if self._registration is None else self._registration.latest,
        )

    def _tracks(self, sensed: Sensed) -> tuple[Track, ...]:
        if self._tracker is not None:
            return self._tracker.tracks_at(sensed.tick.start_ns)
        if self._markers is not None:
            return self._markers.tracks_at(sensed.tick.start_ns)
        if self._settings.tracks == "none" or sensed.truth is None:
            return ()
        return tracks_from_truth(sensed.truth, self._map_from_odom.inverse())

    def snapshot(self) -> bytes:
        """Return the whole state."""
        return pack(
            odometry=np.frombuffer(self._odometry.snapshot(), dtype=np.uint8),
            filter=np.frombuffer(b"" if self._filter is None else self._filter.snapshot(), dtype=np.uint8),
            memory=np.frombuffer(self._memory.snapshot(), dtype=np.uint8),
            clearance=np.frombuffer(self._clearance.snapshot(), dtype=np.uint8),
            tracker=np.frombuffer(b"" if self._tracker is None else self._tracker.snapshot(), dtype=np.uint8),
            markers=np.frombuffer(b"" if self._markers is None else self._markers.snapshot(), dtype=np.uint8),
            registration=np.frombuffer(b"" if self._registration is None else self._registration.snapshot(), dtype=np.uint8),
            frame_ns=np.array([] if self._frame_ns is None else [self._frame_ns], dtype=np.int64),
            joints=pack_joints(self._joints),
        )

    def restore(self, snapshot: bytes) -> None:
        """Take over a state."""
        state = unpack(snapshot)
        self._odometry.restore(state["odometry"].tobytes())
        if self._filter is not None:
            self._filter.restore(state["filter"].tobytes())
        self._memory.restore(state["memory"].tobytes())
        self._clearance.restore(state["clearance"].tobytes())
        if self._tracker is not None:
            self._tracker.restore(state["tracker"].tobytes())
        if self._markers is not None:
            self._markers.restore(state["markers"].tobytes())
        if self._registration is not None:
            self._registration.restore(state["registration"].tobytes())
        self._grid = self._memory.grid
        self._frame_ns = int(state["frame_ns"][0]) if state["frame_ns"].size else None
        self._joints = unpack_joints(state["joints"])


def _tracker_of(settings: StandardSettings) -> GridTracker | None:
    if settings.tracks != "grid":
        return None
    from estimators.tracks.tracking import GridTracker  # noqa: PLC0415 - FilterPy brings 40 MB that only those who filter need carry

    return GridTracker(settings.tracking)


def _marker_tracker_of(settings: StandardSettings) -> MarkerTracker | None:
    if settings.tracks != "aruco":
        return None
    from estimators.tracks.marker_tracking import MarkerTracker  # noqa: PLC0415 - likewise

    return MarkerTracker(settings.markers)


def _registration_of(settings: StandardSettings, setup: EstimatorSetup) -> ScanRegistration | None:
    if not settings.registration.enabled:
        return None
    source = SurfaceSource(settings.source, settings.depth, settings.scan)
    return ScanRegistration(settings.registration, source, setup.map_from_start)


def _odometry_of(settings: StandardSettings, setup: EstimatorSetup) -> Odometry:
    odometry = settings.odometry
    if settings.pose == "truth":
        return TruthOdometry(setup.map_from_start, odometry.trail_s, odometry.extrapolation_max_s)
    return build_odometry(odometry, setup.kinematics, setup.imu_in_base_m)
