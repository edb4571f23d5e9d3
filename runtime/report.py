"""The run report: how it ended, what it cost and how long everything took, as JSON and as a table."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.table import Table

from runtime.cycle import STAGES
from runtime.durations import Durations
from runtime.outputs import write_text


@dataclass(frozen=True, slots=True)
class StageTime:
    """Statistics of one stage's wall time [ms]."""

    mean: float
    p50: float
    p99: float
    max: float


@dataclass(frozen=True, slots=True)
class FaultCount:
    """How often a fault was present, and when and where first."""

    fault: str
    ticks: int
    first_tick: int
    device: str
    detail: str


@dataclass(frozen=True, slots=True)
class RecordingFigures:
    """What the recorder did."""

    path: str
    ticks: int
    dropped_ticks: int
    dropped_views: int
    bytes: int
    bytes_per_s: float  # per second of the run's own time
    queue_high_water: int
    files: int  # that it consists of
    deleted_files: int  # to keep the disk budget
    longest_sync_s: float  # that something written waited until it was on the disk
    incidents: tuple[str, ...]  # recordings made of latched stops
    fault: str


@dataclass(frozen=True, slots=True)
class RunReport:
    """Everything a run has to say; the field names are those of the JSON."""

    outcome: str
    planner: str
    scenario: str
    seed: int
    ticks: int
    missed_deadlines: int
    min_clearance_m: float | None  # signed, surface to surface; none without ground truth
    path_length_m: float
    duration_s: float
    odometry_error_m: float | None  # of the final pose
    odometry_error_rad: float | None
    stage_ms: dict[str, StageTime]
    faults: tuple[FaultCount, ...]
    realtime_factor: float  # run time over wall time
    realtime_void: bool  # a paced world could not keep up: the run proves nothing about timing
    realtime_refused: tuple[str, ...]
    recording: RecordingFigures | None
    error: str = ""  # what ended the run, when it was a failure of the software
    hit_while_standing: bool = False  # it collided, but something else drove into it: it had stood for 0.3 s

    def write(self, path: Path) -> None:
        """Write the JSON.

        Raises:
            ConfigurationError: the path cannot be written.
        """
        write_text(path, json.dumps(_finite(asdict(self)), indent=2, allow_nan=False) + "\n")

    def table(self) -> Table:
        """Return the report as a table for the terminal."""
        table = Table(title=f"{self.scenario}, {self.planner}, seed {self.seed}: {self.outcome}", show_header=False)
        rows: list[tuple[str, str]] = [
            ("duration", f"{self.duration_s:.2f} s, {self.ticks} ticks, {self.missed_deadlines} deadlines missed"),
            ("path", f"{self.path_length_m:.2f} m"),
            ("least clearance", _number(self.min_clearance_m, "m")),
            ("odometry error", f"{_number(self.odometry_error_m, 'm')}, {_number(self.odometry_error_rad, 'rad')}"),
            ("real-time factor", f"{self.realtime_factor:.1f}" + (" (void: below 0.98)" if self.realtime_void else "")),
        ]
        for name, time in self.stage_ms.items():
            rows.append((f"{name} [ms]", f"p50 {time.p50:.3f}   p99 {time.p99:.3f}   max {time.max:.3f}"))
        for fault in self.faults:
            told = (f"{fault.ticks} ticks, first at {fault.first_tick}", fault.device, fault.detail)
            rows.append((fault.fault, ": ".join(word for word in told if word)))
        rows += [("not granted", sentence) for sentence in self.realtime_refused]
        if self.recording is not None:
            size = f"{self.recording.path} ({self.recording.bytes / 1e6:.1f} MB)"
            rows.append(("recording", f"{size}; {self.recording.fault}" if self.recording.fault else size))
            rows += [("stop recorded", path) for path in self.recording.incidents]
        if self.hit_while_standing:
            rows.append(("collision", "it was hit while it stood"))
        if self.error:
            rows.append(("ended by", self.error))
        for name, value in rows:
            table.add_row(name, value)
        return table


def stage_times(durations: Durations) -> dict[str, StageTime]:
    """Return the statistics of every stage."""
    if not len(durations):
        return {}
    figures = (durations.mean_ns, durations.percentile_ns(50.0), durations.percentile_ns(99.0), durations.max_ns)
    ms = np.stack(figures, axis=1) * 1e-6  # (stages, 4)
    return {stage: StageTime(*row) for stage, row in zip(STAGES, ms.tolist(), strict=True)}


def finite_or_none(value: float) -> float | None:
    """Return the value, or None where it says nothing (JSON has no NaN and no infinity)."""
    return value if math.isfinite(value) else None


def _number(value: float | None, unit: str) -> str:
    return "unknown" if value is None else f"{value:.3f} {unit}"


def _finite(value: object) -> object:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return finite_or_none(value) if isinstance(value, float) else value
