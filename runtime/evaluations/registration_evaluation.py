"""`trundle evaluate registration`: how far the pose strays in the map without and with scan-to-map registration."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any, Literal

from pydantic import Field

from drivers.interface.geometry import SE2, wrap_angle
from drivers.interface.sensed import Sensed
from drivers.interface.settings import Settings
from estimators.estimator import Estimator, EstimatorSetup
from runtime import yaml_files
from runtime.evaluations.evaluation import Evaluation, EvaluationTable
from runtime.evaluations.side_by_side import Workers, side_by_side

Kind = Literal["dead_reckoning", "ekf"]
KINDS: tuple[Kind, ...] = ("dead_reckoning", "ekf")
HEAD = ("drive", "odometry", "wheels and gyro", "registration", "across, at the end", "across, at most", "along", "heading")


class CalibrationDrive(Settings):
    """Where the robot is calibrated: the same robot, on other ground."""

    configuration: str
    overrides: tuple[str, ...] = ()


class RegistrationExperiment(Settings):
    """What is driven; `configs/experiments/registration.yaml` is the shipped one."""

    title: str
    configuration: str
    overrides: tuple[str, ...] = ()
    calibration: CalibrationDrive
    odometry: tuple[Kind, ...] = Field(default=KINDS, min_length=1, description="kinds of odometry that are compared")
    seeds: int = Field(default=10, ge=1)


@dataclass(frozen=True, slots=True, order=True)
class RegistrationCase:
    """One seed: a calibration drive, then the drive."""

    configuration: str
    overrides: tuple[str, ...]
    calibration: str
    calibration_overrides: tuple[str, ...]
    odometry: tuple[Kind, ...]
    seed: int


@dataclass(frozen=True, slots=True)
class Estimate:
    """How far an estimator was off on a drive; across and along are meant of the start's heading."""

    kind: Kind
    calibrated: bool
    registered: bool
    across_end_m: float
    across_most_m: float
    along_end_m: float
    heading_end_rad: float


@dataclass(frozen=True, slots=True)
class Driven:
    """A drive and what every estimator made of it."""

    outcome: str
    way_m: float
    estimates: tuple[Estimate, ...]


class RegistrationEvaluation(Evaluation):
    """One drive a seed, and all estimators on what was sensed in it."""

    def __init__(self, settings: RegistrationExperiment, seeds: int | None, changes: tuple[str, ...]) -> None:
        """Lay out the drives."""
        overrides, calibration = (*settings.overrides, *changes), settings.calibration
        robot = tuple(override for override in overrides if override.startswith("robot"))
        self._settings = settings
        self._todo = tuple(
            RegistrationCase(
                settings.configuration,
                overrides,
                calibration.configuration,
                (*robot, *calibration.overrides),
                settings.odometry,
                seed,
            )
            for seed in range(seeds or settings.seeds)
        )
        super().__init__(settings.title, len(self._todo))

    @classmethod
    def from_mapping(cls, content: yaml_files.Mapping, seeds: int | None, changes: tuple[str, ...]) -> RegistrationEvaluation:
        """Read the file's keys; raises pydantic's ValidationError."""
        return cls(RegistrationExperiment.model_validate(content), seeds, changes)

    def run(self, workers: Workers) -> EvaluationTable:
        """Drive them all."""
        found = side_by_side(self._todo, drive_and_estimate, workers)
        single = [{"seed": case.seed} | asdict(driven) for case, driven in found.items()]
        return EvaluationTable(
            HEAD, tuple(_rows(self._settings.configuration, list(found.values()))), json.dumps(single, indent=1)
        )


def drive_and_estimate(case: RegistrationCase) -> Driven:
    """Calibrate a robot, drive with all that was found and registration, and let every estimator see what was sensed."""
    from runtime.calibrate import calibrate, odometry_keys  # noqa: PLC0415 - in the worker process, not in the one that hands out

    keys = odometry_keys(calibrate(case.calibration, case.calibration_overrides, case.seed))
    outcome, way_m, sensed = _drive(case, _overrides(keys, "dead_reckoning", registered=True))
    return Driven(
        outcome,
        way_m,
        tuple(
            _estimate(case, sensed, keys if calibrated else {}, kind, registered)
            for kind in case.odometry
            for calibrated in (False, True)
            for registered in (False, True)
        ),
    )


def _overrides(keys: dict[str, Any], kind: Kind, registered: bool) -> tuple[str, ...]:
    odometry = json.dumps(keys | {"kind": kind})
    return (f"estimator.odometry={odometry}", f"estimator.registration.enabled={json.dumps(registered)}")


def _drive(case: RegistrationCase, also: tuple[str, ...]) -> tuple[str, float, tuple[Sensed, ...]]:
    from runtime import configuration  # noqa: PLC0415
    from runtime.run import RunOptions, run  # noqa: PLC0415

    sensed: list[Sensed] = []
    loaded = configuration.load(case.configuration, (*case.overrides, *also))
    result = run(loaded, RunOptions(seed=case.seed, progress=lambda cycle: sensed.append(cycle.sensed)))
    if result.failure is not None:
        raise result.failure
    return result.report.outcome, result.report.path_length_m, tuple(sensed)


def _estimate(case: RegistrationCase, sensed: tuple[Sensed, ...], keys: dict[str, Any], kind: Kind, registered: bool) -> Estimate:
    estimator = _estimator(case, _overrides(keys, kind, registered), sensed[0].mission.map_from_start)
    estimator.warm_up()
    errors = []
    for one in sensed:
        believed = estimator.update(one).map_from_base
        if one.truth is not None:
            errors.append(_error(one.mission.map_from_start, one.truth.map_from_base, believed))
    along, across, heading = zip(*errors, strict=True)
    return Estimate(kind, bool(keys), registered, across[-1], max(across), along[-1], heading[-1])


def _estimator(case: RegistrationCase, also: tuple[str, ...], map_from_start: SE2) -> Estimator:
    from runtime import configuration  # noqa: PLC0415
    from runtime.assembly import assemble  # noqa: PLC0415

    loaded = configuration.load(case.configuration, (*case.overrides, *also))
    base = assemble(loaded, case.seed).robot.devices.base
    assert base is not None  # or there would be no calibration
    setup = EstimatorSetup(loaded.loop.period_ns * 1e-9, loaded.robot.radius_m, map_from_start, base.kinematics)
    estimator: Estimator = loaded.estimator.build(setup)
    return estimator


def _error(map_from_start: SE2, true: SE2, believed: SE2) -> tuple[float, float, float]:
    """Return how far the belief is off along and across the start's heading [m], and in heading [rad]; all at least zero."""
    x, y = believed.x - true.x, believed.y - true.y
    c, s = math.cos(map_from_start.yaw), math.sin(map_from_start.yaw)
    return abs(c * x + s * y), abs(c * y - s * x), abs(wrap_angle(believed.yaw - true.yaw))


def _rows(name: str, found: list[Driven]) -> list[tuple[str, ...]]:
    reached = sum(driven.outcome == "reached" for driven in found)
    drive = f"{name}, {median(driven.way_m for driven in found):.1f} m, median of {len(found)}, {reached} reached"
    return [_row(drive, group) for group in zip(*(driven.estimates for driven in found), strict=True)]


def _row(drive: str, group: tuple[Estimate, ...]) -> tuple[str, ...]:
    one = group[0]
    metres = (
        median(estimate.across_end_m for estimate in group),
        median(estimate.across_most_m for estimate in group),
        median(estimate.along_end_m for estimate in group),
    )
    heading = math.degrees(median(estimate.heading_end_rad for estimate in group))
    said = "calibrated" if one.calibrated else "nominal", "on" if one.registered else "off"
    return (drive, one.kind, *said, *(f"{value:.3f} m" for value in metres), f"{heading:.2f} deg")
