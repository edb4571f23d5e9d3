"""`trundle calibrate base`: drives manoeuvres, identifies wheels and gyro, and writes what the odometry is to be told."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from drivers.interface.errors import ConfigurationError
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.samples import BaseSample, ImuSample, TruthSample, WheelSample
from drivers.interface.sensed import Sensed
from estimators.calibration.base import BaseCalibration, calibrate_base
from estimators.calibration.closure import calibrate_loops
from estimators.calibration.drive import drive_of
from estimators.calibration.loops import loops_of
from runtime import configuration
from runtime.assembly import assemble
from runtime.calibration_file import write_extension
from runtime.manoeuvres import calibration_legs, driven, observed
from runtime.recorded_samples import recorded

# How well a gyro's bias is found again after switching on, some kelvins warmer (BMI055 data sheet: 0.015 deg/s/K).
BIAS_REPEATS_RAD_S = 0.001


def calibrate(
    config: str,
    changes: tuple[str, ...] = (),
    seed: int = 0,
    done: Callable[[Sensed], None] = lambda _: None,
    *,
    logs: tuple[Path, ...] = (),
    closure: bool = False,
) -> BaseCalibration:
    """Calibrate the configured base, by recordings if there are any, else by driving it or playing its recorded device.

    The reference is the truth; with `closure` it is the mark on the floor where each recording begins and ends.

    Raises:
        ConfigurationError: it has no base or no reference, or the data do not determine a parameter (named).
        TrundleError: the drive came to no good end.
    """
    devices = assemble(configuration.load(config, changes), seed).robot.devices
    base = devices.base
    if base is None or base.kinematics is None:
        raise ConfigurationError(f"{config}: calibration needs a base whose wheels it can read (robot.base)")
    played = getattr(type(base), "plays_recording", False)
    if closure and not logs and not played:
        raise ConfigurationError("--closure needs recordings of loops: --log LOG, once for each")
    if len(logs) > 1 and not closure:
        raise ConfigurationError("several --log are for loops that each end where they began: add --closure")
    if not logs and not closure and devices.truth is None:
        raise _no_reference(f"{config}: the robot has no robot.truth")
    if logs:
        samples = [samples_of_log(log) for log in logs]
    else:
        legs = () if played else calibration_legs(base.limits)
        samples = [samples_of(driven(config, legs, changes, seed, done) if legs else observed(config, changes, seed, done))]
    return _calibrated(samples, base.kinematics, closure=closure)


def _calibrated(runs: list[Samples], kinematics: WheelKinematics, *, closure: bool) -> BaseCalibration:
    if closure:
        return calibrate_loops([loop for run in runs for loop in loops_of(run.wheels, run.imu, kinematics)], kinematics)
    (run,) = runs
    if not run.truth:
        raise _no_reference("the recording holds no truth")
    return calibrate_base(drive_of(run.wheels, run.imu, run.truth), kinematics)


def _no_reference(because: str) -> ConfigurationError:
    return ConfigurationError(
        f"{because}; calibration needs poses that are known from elsewhere, or --closure with recordings that begin and end on "
        "the same mark"
    )


@dataclass(frozen=True, slots=True)
class Samples:
    """What a run says of its base."""

    wheels: tuple[WheelSample, ...]
    imu: tuple[ImuSample, ...]
    truth: tuple[TruthSample, ...]


def samples_of(sensed: Iterable[Sensed]) -> Samples:
    """Return the wheel, gyro and truth samples of a run."""
    return _samples(*zip(*((one.base, one.imu, one.truth) for one in sensed), strict=True))


def samples_of_log(log: Path) -> Samples:
    """Return the same of a recording; raises ConfigurationError where it cannot be read."""
    return _samples(*(recorded(log, name) for name in ("base", "imu", "truth")))


def _samples(
    base: Iterable[tuple[BaseSample, ...]], imu: Iterable[tuple[ImuSample, ...]], truth: Iterable[TruthSample | None]
) -> Samples:
    return Samples(
        tuple(sample for tick in base for sample in tick if isinstance(sample, WheelSample)),
        tuple(sample for tick in imu for sample in tick),
        tuple(sample for sample in truth if sample is not None),
    )


def odometry_keys(calibration: BaseCalibration) -> dict[str, Any]:
    """Return the keys of `estimator.odometry` that say what was found."""
    ekf: dict[str, Any] = {} if calibration.trust is None else asdict(calibration.trust)
    keys: dict[str, Any] = {"geometry": calibration.wheels.geometry.model_dump(mode="json"), "ekf": ekf}
    if calibration.gyro is not None:
        keys |= {"gyro_bias_rad_s": calibration.gyro.bias_rad_s, "gyro_scale": calibration.gyro.scale}
        keys |= {} if calibration.held else {"wheels_late_s": calibration.wheels_late_s}
        ekf["gyro_bias_std_rad_s"] = BIAS_REPEATS_RAD_S
    return keys


def write(calibration: BaseCalibration, config: str, path: Path) -> None:
    """Write a configuration that extends the calibrated one by what was found.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    write_extension(config, {"estimator": {"odometry": odometry_keys(calibration)}}, path)


def table_of(calibration: BaseCalibration) -> Table:
    """Return what was found with its standard deviations, and the odometry's error before and after."""
    table = Table("parameter", "nominal", "found", "standard deviation", "unit", title="Calibration of the base")
    for parameter in calibration.found:
        unknown = parameter.unknown
        table.add_row(unknown.name, f"{unknown.nominal:.5f}", f"{parameter.value:.5f}", f"{parameter.std:.1g}", unknown.unit)
    table.add_section()
    for name in calibration.held:
        table.add_row(name, "held", "", "loops do not tell it", "")
    before, after = calibration.before, calibration.after
    table.add_row("error of a way (RMS)", f"{1e3 * before.way_rms_m:.2f}", f"{1e3 * after.way_rms_m:.2f}", "", "mm")
    table.add_row("error of a turn (RMS)", f"{1e3 * before.turn_rms_rad:.2f}", f"{1e3 * after.turn_rms_rad:.2f}", "", "mrad")
    table.add_row("wheels' drift at the end", f"{before.end_m:.3f}", f"{after.end_m:.3f}", "", "m")
    turned = (f"{math.degrees(error.end_rad):.2f}" for error in (before, after))
    table.add_row("", *turned, "", "degrees")
    return table
