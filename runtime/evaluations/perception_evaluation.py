"""`trundle evaluate perception`: tracks and grid against the simulator's truth, recorded frames against their raw depth."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path
from typing import Any

from pydantic import Field, model_validator

from drivers.interface.samples import Intrinsics
from drivers.interface.settings import Settings
from runtime import yaml_files
from runtime.evaluations.evaluation import Evaluation, EvaluationTable
from runtime.evaluations.frame_phantoms import Phantoms, phantoms, read_frames
from runtime.evaluations.perception import Perceived, perception
from runtime.evaluations.side_by_side import Workers, side_by_side

HEAD = (
    "scene",
    "front end",
    "runs",
    "looks",
    "position RMS",
    "velocity RMS",
    "runs without a switch",
    "missed looks",
    "false tracks",
    "false occupied cells",
    "missed surface",
)


class SceneSection(Settings):
    """One simulated scene and the front ends it is seen with."""

    configuration: str
    overrides: tuple[str, ...] = ()
    front_ends: tuple[str, ...] = Field(min_length=1)
    seeds: int | None = Field(default=None, ge=1, description="none: the experiment's")


class FramesSection(Settings):
    """Recorded depth frames, and every estimator setting (each of `depth` with each of `memory`) they are played through."""

    path: Path = Field(description="folder of 16-bit PNG files in millimetres; relative to the current folder")
    width: int = Field(gt=0, le=10_000)
    height: int = Field(gt=0, le=10_000)
    fx_px: float = Field(gt=0.0, le=1e5)
    fy_px: float = Field(gt=0.0, le=1e5)
    cx_px: float = Field(ge=0.0, le=1e5)
    cy_px: float = Field(ge=0.0, le=1e5)
    within_m: float = Field(default=1.5, gt=0.0, le=20.0, description="how near a phantom counts")
    depth: dict[str, dict[str, Any]] = Field(min_length=1, description="keys of estimator.depth, by a name of their own")
    memory: dict[str, dict[str, Any]] = Field(min_length=1, description="keys of estimator.memory, likewise")

    @property
    def camera(self) -> Intrinsics:
        """Of the camera that took them."""
        return Intrinsics(self.width, self.height, self.fx_px, self.fy_px, self.cx_px, self.cy_px)

    @property
    def settings(self) -> dict[str, dict[str, Any]]:
        """The estimator's keys, by name."""
        pairs = product(self.depth.items(), self.memory.items())
        return {f"{depth}, {memory}": {"tracks": "grid", "depth": d, "memory": m} for (depth, d), (memory, m) in pairs}


class PerceptionExperiment(Settings):
    """What is looked at; `configs/experiments/perception.yaml` is the shipped one."""

    title: str
    front_ends: dict[str, tuple[str, ...]] = Field(description="overrides a.b=c by the front end's name")
    scenes: dict[str, SceneSection] = Field(min_length=1)
    seeds: int = Field(default=10, ge=1)
    frames: FramesSection | None = None

    @model_validator(mode="after")
    def _named(self) -> PerceptionExperiment:
        for name, scene in self.scenes.items():
            if unknown := [one for one in scene.front_ends if one not in self.front_ends]:
                raise ValueError(f"scenes.{name}: there is no front end '{unknown[0]}'; known: {', '.join(self.front_ends)}")
        return self


@dataclass(frozen=True, slots=True, order=True)
class Look:
    """One run: a scene, a front end and a seed."""

    scene: str
    front_end: str
    seed: int
    configuration: str
    overrides: tuple[str, ...]


class PerceptionEvaluation(Evaluation):
    """Scenes times front ends times seeds, then the recorded frames."""

    def __init__(self, settings: PerceptionExperiment, seeds: int | None, changes: tuple[str, ...]) -> None:
        """Lay out the runs; a folder without frames is refused at once."""
        self._settings = settings
        self._frames = () if settings.frames is None else read_frames(settings.frames.path)
        self._todo = tuple(
            Look(name, front_end, seed, scene.configuration, (*scene.overrides, *settings.front_ends[front_end], *changes))
            for name, scene in settings.scenes.items()
            for front_end in scene.front_ends
            for seed in range(seeds or scene.seeds or settings.seeds)
        )
        super().__init__(settings.title, len(self._todo))

    @classmethod
    def from_mapping(cls, content: yaml_files.Mapping, seeds: int | None, changes: tuple[str, ...]) -> PerceptionEvaluation:
        """Read the file's keys, and changes to its `frames`; raises pydantic's ValidationError."""
        runs = []
        for change in changes:
            keys, value = yaml_files.parse_override(change)
            if keys[0] == "frames":  # the experiment's own key: no configuration has it
                content = yaml_files.override(content, keys, value)
            else:
                runs.append(change)
        return cls(PerceptionExperiment.model_validate(content), seeds, tuple(runs))

    def run(self, workers: Workers) -> EvaluationTable:
        """Run them all, then play the frames."""
        found = side_by_side(self._todo, look, workers)
        played = self._played()
        groups: dict[tuple[str, str], list[Perceived]] = {}
        for case, perceived in found.items():
            groups.setdefault((case.scene, case.front_end), []).append(perceived)
        rows = [(*names, *_cells(group)) for names, group in groups.items()]
        rows += [(f"{len(self._frames)} recorded frames", name, *_played_cells(one)) for name, one in played.items()]
        runs = [
            {"scene": case.scene, "front_end": case.front_end, "seed": case.seed} | asdict(one) for case, one in found.items()
        ]
        frames = [{"setting": name} | asdict(one) for name, one in played.items()]
        return EvaluationTable(HEAD, tuple(rows), json.dumps({"runs": _finite(runs), "frames": frames}, indent=1))

    def _played(self) -> dict[str, Phantoms]:
        frames = self._settings.frames
        if frames is None:
            return {}
        return {name: phantoms(self._frames, frames.camera, keys, frames.within_m) for name, keys in frames.settings.items()}


def look(case: Look) -> Perceived:
    """Run one case in this process."""
    return perception(case.configuration, case.seed, case.overrides)


def _cells(group: list[Perceived]) -> tuple[str, ...]:
    tracks = [one.tracks for one in group]
    looks, seen = sum(one.looks for one in tracks), [one.looks - one.missed for one in tracks]
    position = _rms(zip((one.position_rms_m for one in tracks), seen, strict=True))
    velocity = _rms(zip((one.velocity_rms_m_s for one in tracks), seen, strict=True))
    grid = group[0].grid
    for one in group[1:]:
        grid += one.grid
    return (
        str(len(group)),
        str(looks),
        "" if position is None else f"{position:.3f} m",
        "" if velocity is None else f"{velocity:.3f} m/s",
        f"{sum(one.switches == 0 for one in tracks)}/{len(group)}" if looks else "",
        f"{100.0 * (looks - sum(seen)) / looks:.1f} %" if looks else "",
        str(sum(one.false_tracks for one in tracks)),
        f"{1e6 * grid.false_cells / max(grid.free_cells, 1):.0f} ppm",
        f"{100.0 * grid.missed_points / max(grid.surface_points, 1):.2f} %",
    )


def _played_cells(one: Phantoms) -> tuple[str, ...]:
    return ("1", "", "", "", "", "", "", f"{one.phantom_cells} of {one.occupied_cells}", "")


def _rms(weighted: Iterable[tuple[float, int]]) -> float | None:
    """Return the root of the mean square over all looks, from each run's and how many looks it is of."""
    known = [(value, weight) for value, weight in weighted if weight]
    weight = sum(weight for _, weight in known)
    return math.sqrt(sum(value**2 * w for value, w in known) / weight) if weight else None


def _finite(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the runs with None for what says nothing, as JSON has no NaN."""
    for one in runs:
        one["tracks"] = {key: None if value != value else value for key, value in one["tracks"].items()}  # noqa: PLR0124
    return runs
