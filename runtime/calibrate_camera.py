"""`trundle calibrate camera`: looks at the floor while the robot stands, and writes how the camera is mounted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import BaseSample, DepthFrame, WheelSample
from estimators.calibration.ground import CameraCalibration, calibrate_camera
from runtime import configuration, yaml_files
from runtime.calibration_file import write_extension
from runtime.manoeuvres import observed
from runtime.recorded_samples import recorded, recorded_ticks

FRAMES = 30  # more say nothing new
LOOK_S = 3.0
STILL_RAD_S, STILL_M_S = 0.15, 0.02  # more than what encoders say at rest, less than what tilts a camera
STANDING = (
    'planner={"name": "idle"}',
    'router={"name": "straight"}',
    "mission.goals=[]",
    f"mission.time_limit_s={LOOK_S}",
    "robot.operator=null",
)


def calibrate(config: str, changes: tuple[str, ...] = (), seed: int = 0, log: Path | None = None) -> CameraCalibration:
    """Calibrate the configured camera by a recording, else by what it sees now; nothing is driven.

    Raises:
        ConfigurationError: there is no camera with a mounting to write, no frame, or no ground in view.
        TrundleError: a device failed.
    """
    camera = dict(configuration.load(config, changes).devices).get("camera")
    missing = {"z_m", "pitch_rad", "roll_rad"} - set(() if camera is None else type(camera.settings).model_fields)
    if missing:
        raise ConfigurationError(f"{config}: calibration needs a camera (robot.camera) that has {', '.join(sorted(missing))}")
    frames = _recorded_frames(log) if log is not None else _seen(config, changes, seed)
    if not frames:
        raise ConfigurationError(f"{log or config}: there is no depth frame of a robot that stands")
    return calibrate_camera(frames)


def _seen(config: str, changes: tuple[str, ...], seed: int) -> list[DepthFrame]:
    frames = [one.depth for one in observed(config, (*changes, *STANDING), seed) if one.depth is not None]
    return frames[:: max(1, len(frames) // FRAMES)]


def _recorded_frames(log: Path) -> list[DepthFrame]:
    """Return frames of a recording, evenly over the ticks at which the base stood."""
    still = [tick for tick, samples in zip(recorded_ticks(log), recorded(log, "base"), strict=True) if _stands(samples)]
    frames = [frame for frame in recorded(log, "depth", still[:: max(1, len(still) // (4 * FRAMES))]) if frame is not None]
    return frames[:: max(1, len(frames) // FRAMES)]


def _stands(samples: tuple[BaseSample, ...]) -> bool:
    """Tell whether a base that says anything says that it does not move; one that is not there stands."""
    for sample in samples:
        if isinstance(sample, WheelSample):
            if not np.abs(sample.velocity_rad_s).max() <= STILL_RAD_S:
                return False
        elif sample.twist is not None and sample.twist.speed_m_s + abs(sample.twist.wz) > STILL_M_S:
            return False
    return True


def write(calibration: CameraCalibration, config: str, changes: tuple[str, ...], path: Path) -> None:
    """Write a configuration that extends the calibrated one by the mounting that was found.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    robot: dict[str, Any] = {"camera": calibration.values}
    named = [value for keys, value in map(yaml_files.parse_override, changes) if keys == ("robot",)]
    stands = named[-1] if named else yaml_files.read(yaml_files.find(config, "scenarios"), "scenarios").get("robot")
    write_extension(config, {"robot": ({"extends": stands} if isinstance(stands, str) else {}) | robot}, path)


def table_of(calibration: CameraCalibration) -> Table:
    """Return what was found with its standard deviations, and how flat the ground is."""
    title = f"Calibration of the camera, {calibration.frames} frames"
    table = Table("parameter", "configured", "found", "standard deviation", "unit", title=title)
    for parameter in calibration.found:
        unknown = parameter.unknown
        table.add_row(unknown.name, f"{unknown.nominal:.4f}", f"{parameter.value:.4f}", f"{parameter.std:.1g}", unknown.unit)
    table.add_section()
    table.add_row("ground about its plane (RMS)", "", f"{1e3 * calibration.residual_m:.1f}", "", "mm")
    table.add_row("share of points on the ground", "", f"{100.0 * calibration.ground_share:.0f}", "", "%")
    return table
