"""`trundle calibrate base`: drives manoeuvres, identifies wheels and gyro, and writes what the odometry is to be told."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml
from rich.table import Table

from drivers.interface.errors import ConfigurationError
from drivers.interface.samples import WheelSample
from drivers.interface.sensed import Sensed
from estimators.calibration.base import BaseCalibration, calibrate_base
from estimators.calibration.drive import Drive, drive_of
from runtime import configuration
from runtime.assembly import assemble
from runtime.manoeuvres import calibration_legs, driven

# How well a gyro's bias is found again after switching on, some kelvins warmer (BMI055 data sheet: 0.015 deg/s/K).
BIAS_REPEATS_RAD_S = 0.001


def calibrate(
    config: str, changes: tuple[str, ...] = (), seed: int = 0, done: Callable[[Sensed], None] = lambda _: None
) -> BaseCalibration:
    """Drive the configured robot around and calibrate its base.

    Raises:
        ConfigurationError: it has no base or no truth, or the drive does not determine a parameter (named).
        TrundleError: the drive came to no good end.
    """
    devices = assemble(configuration.load(config, changes), seed).robot.devices
    kinematics = None if devices.base is None else devices.base.kinematics
    if devices.base is None or kinematics is None:
        raise ConfigurationError(f"{config}: calibration needs a base whose wheels it can read (robot.base)")
    if devices.truth is None:
        raise ConfigurationError(f"{config}: calibration needs poses that are known from elsewhere (robot.truth)")
    sensed = driven(config, calibration_legs(devices.base.limits), changes, seed, done)
    return calibrate_base(drive_from(sensed), kinematics)


def drive_from(sensed: tuple[Sensed, ...]) -> Drive:
    """Return the wheel, gyro and truth samples of a run as a drive."""
    return drive_of(
        (sample for one in sensed for sample in one.base if isinstance(sample, WheelSample)),
        (sample for one in sensed for sample in one.imu),
        (one.truth for one in sensed if one.truth is not None),
    )


def odometry_keys(calibration: BaseCalibration) -> dict[str, Any]:
    """Return the keys of `estimator.odometry` that say what was found."""
    ekf: dict[str, Any] = asdict(calibration.trust)
    keys: dict[str, Any] = {"geometry": calibration.wheels.geometry.model_dump(mode="json"), "ekf": ekf}
    if calibration.gyro is not None:
        keys |= {"gyro_bias_rad_s": calibration.gyro.bias_rad_s, "gyro_scale": calibration.gyro.scale}
        keys |= {"wheels_late_s": calibration.wheels_late_s}
        ekf["gyro_bias_std_rad_s"] = BIAS_REPEATS_RAD_S
    return keys


def write(calibration: BaseCalibration, config: str, path: Path) -> None:
    """Write a configuration that extends the calibrated one by what was found.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    content = {"extends": config, "estimator": {"odometry": odometry_keys(calibration)}}
    try:
        path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"--output {path} cannot be written: {error.strerror}") from error


def table_of(calibration: BaseCalibration) -> Table:
    """Return what was found with its standard deviations, and the odometry's error before and after."""
    table = Table("parameter", "nominal", "found", "standard deviation", "unit", title="Calibration of the base")
    for parameter in calibration.found:
        unknown = parameter.unknown
        table.add_row(unknown.name, f"{unknown.nominal:.5f}", f"{parameter.value:.5f}", f"{parameter.std:.1g}", unknown.unit)
    table.add_section()
    before, after = calibration.before, calibration.after
    table.add_row("error of a way (RMS)", f"{1e3 * before.way_rms_m:.2f}", f"{1e3 * after.way_rms_m:.2f}", "", "mm")
    table.add_row("error of a turn (RMS)", f"{1e3 * before.turn_rms_rad:.2f}", f"{1e3 * after.turn_rms_rad:.2f}", "", "mrad")
    table.add_row("wheels' drift at the end", f"{before.end_m:.3f}", f"{after.end_m:.3f}", "", "m")
    turned = (f"{math.degrees(error.end_rad):.2f}" for error in (before, after))
    table.add_row("", *turned, "", "degrees")
    return table
