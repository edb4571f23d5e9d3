"""`trundle evaluate odometry`: how far odometry strays, before and after calibration, in the simulator and on a recording."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any, Literal

from pydantic import Field

from drivers.interface.errors import ConfigurationError
from drivers.interface.sensed import Sensed
from drivers.interface.settings import Settings
from runtime import yaml_files
from runtime.evaluations.evaluation import Evaluation, EvaluationTable
from runtime.evaluations.recorded_odometry import RecordedScore, score_recording
from runtime.evaluations.side_by_side import Workers, side_by_side

HEAD = ("drive", "odometry", "figure", "before", "after", "ratio")
KINDS = ("dead_reckoning", "ekf")


class RecordingSection(Settings):
    """A drive that was recorded with the positions that are known of it, in the format of `drivers/wheel_log.py`."""

    wheels: Path = Field(description="file with odom2diff lines; relative to the current folder")
    truth: Path = Field(description="file with point2 lines")


class OdometryExperiment(Settings):
    """What is driven; `configs/experiments/odometry.yaml` is the shipped one."""

    title: str
    configuration: str
    overrides: tuple[str, ...] = ()
    side_m: float = Field(default=5.0, gt=0.0, le=50.0, description="of the square that is driven once around")
    seeds: int = Field(default=10, ge=1)
    recording: RecordingSection | None = None


@dataclass(frozen=True, slots=True, order=True)
class SquareCase:
    """One seed: a calibration drive, then a square."""

    configuration: str
    seed: int
    overrides: tuple[str, ...]
    side_m: float


@dataclass(frozen=True, slots=True)
class Drift:
    """How far an odometry is off at the end of a square."""

    kind: Literal["dead_reckoning", "ekf"]
    calibrated: bool
    drift_m: float
    drift_rad: float


class OdometryEvaluation(Evaluation):
    """A calibrated and an uncalibrated robot on a square, and a recording with nominal and fitted parameters."""

    def __init__(self, settings: OdometryExperiment, seeds: int | None, changes: tuple[str, ...]) -> None:
        """Lay out the drives; a recording whose files are not there is refused at once."""
        self._settings = settings
        overrides = (*settings.overrides, *changes)
        self._todo = tuple(
            SquareCase(settings.configuration, seed, overrides, settings.side_m) for seed in range(seeds or settings.seeds)
        )
        for path in () if settings.recording is None else (settings.recording.wheels, settings.recording.truth):
            if not path.is_file():
                raise ConfigurationError(
                    f"recording: there is no file '{path}'; write an experiment that extends this one with yours"
                )
        super().__init__(settings.title, len(self._todo))

    @classmethod
    def from_mapping(cls, content: yaml_files.Mapping, seeds: int | None, changes: tuple[str, ...]) -> OdometryEvaluation:
        """Read the file's keys; raises pydantic's ValidationError."""
        return cls(OdometryExperiment.model_validate(content), seeds, changes)

    def run(self, workers: Workers) -> EvaluationTable:
        """Drive all squares, then score the recording."""
        drifts = side_by_side(self._todo, drive_square, workers)
        recording = self._settings.recording
        scores = () if recording is None else score_recording(recording.wheels, recording.truth)
        way = f"square, {4.0 * self._settings.side_m:g} m"
        rows = [*_square_rows(way, [drift for found in drifts.values() for drift in found]), *_recorded_rows(scores)]
        found = {"squares": [{"seed": case.seed, "drifts": [asdict(d) for d in found]} for case, found in drifts.items()]}
        return EvaluationTable(HEAD, tuple(rows), json.dumps(found | {"recording": [asdict(s) for s in scores]}, indent=1))


def drive_square(case: SquareCase) -> tuple[Drift, ...]:
    """Calibrate a robot, drive it around a square, and say how far each kind of odometry is off, before and after."""
    from runtime import configuration  # noqa: PLC0415 - in the worker process, not in the one that hands out the work
    from runtime.assembly import assemble  # noqa: PLC0415
    from runtime.calibrate import calibrate, odometry_keys  # noqa: PLC0415
    from runtime.manoeuvres import driven, square_legs  # noqa: PLC0415

    keys = odometry_keys(calibrate(case.configuration, case.overrides, case.seed))
    base = assemble(configuration.load(case.configuration, case.overrides), case.seed).robot.devices.base
    assert base is not None  # or there would be no calibration
    sensed = driven(case.configuration, square_legs(base.limits, case.side_m), case.overrides, case.seed)
    return tuple(
        _drift(sensed, {"kind": kind} | (keys if calibrated else {}), base.kinematics)
        for kind in KINDS
        for calibrated in (False, True)
    )


def _drift(sensed: tuple[Sensed, ...], keys: dict[str, Any], kinematics: Any) -> Drift:
    from estimators.odometry.odometry_choice import OdometrySettings, build_odometry  # noqa: PLC0415

    odometry = build_odometry(OdometrySettings.model_validate(keys), kinematics)
    odometry.warm_up()
    first = next(one.truth for one in sensed if one.truth is not None)
    last = first
    for one in sensed:
        pose = odometry.update(one).odom_from_base
        last = one.truth or last
    true = first.map_from_base.inverse() @ last.map_from_base
    error = true.inverse() @ pose
    return Drift(keys["kind"], "geometry" in keys, math.hypot(error.x, error.y), abs(error.yaw))


def _square_rows(way: str, drifts: list[Drift]) -> list[tuple[str, ...]]:
    rows = []
    for kind in KINDS:
        before, after = ([d for d in drifts if d.kind == kind and d.calibrated is calibrated] for calibrated in (False, True))
        metres = [median(d.drift_m for d in group) for group in (before, after)]
        degrees = [math.degrees(median(d.drift_rad for d in group)) for group in (before, after)]
        runs = f"median of {len(after)}"
        rows.append((way, kind, f"position, {runs}", *(f"{value:.3f} m" for value in metres), _ratio(*metres)))
        rows.append((way, kind, f"heading, {runs}", *(f"{value:.2f} deg" for value in degrees), _ratio(*degrees)))
    return rows


def _recorded_rows(scores: tuple[RecordedScore, ...]) -> list[tuple[str, ...]]:
    rows = []
    for score in scores:
        drive = f"recording, {score.half} half, {score.way_m:.1f} m"
        for figure in ("absolute_m", "relative_m"):
            values = [getattr(error, figure) for error in (score.nominal, score.fitted)]
            name = "ATE (RMS)" if figure == "absolute_m" else "RPE over 1 s (RMS)"
            rows.append((drive, "dead_reckoning", name, *(f"{value:.4f} m" for value in values), _ratio(*values)))
    return rows


def _ratio(before: float, after: float) -> str:
    return f"{before / after:.1f}" if after > 0.0 else ""
