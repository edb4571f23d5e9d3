"""What is known of a run before its first tick: provenance for the engineer, the static scene for the viewer."""

from __future__ import annotations

import platform
import re
import subprocess
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Literal

from drivers.interface.geometry import SE2, SE3
from runtime.log.drawn.urdf import Link

SCHEMA_VERSION = 5  # of the replay columns; raised when a reader of the old ones would misread the new
READABLE_SCHEMAS = (SCHEMA_VERSION,)


@dataclass(frozen=True, slots=True)
class SceneShape:
    """An upright solid for the viewer: a box by its half extents, or a cylinder (x: its radius, z: its half height)."""

    name: str
    kind: Literal["box", "cylinder"]
    map_from_shape: SE2
    half_extents_m: tuple[float, float, float]
    colour: tuple[int, int, int] = (112, 120, 132)
    base_z_m: float = 0.0


@dataclass(frozen=True, slots=True)
class ArmShape:
    """An arm for the viewer: where its foot stands on the robot, and its links."""

    base_from_foot: SE3
    links: tuple[Link, ...]


@dataclass(frozen=True, slots=True)
class RunHeader:
    """Everything that was fixed before the first tick."""

    configuration_yaml: str  # the effective one, every default written out
    seed: int
    scenario: str
    planner: str
    robot_radius_m: float
    robot_height_m: float = 0.3
    devices: tuple[str, ...] = ()  # by their names in the robot
    arm: ArmShape | None = None
    static: tuple[SceneShape, ...] = ()
    movers: tuple[SceneShape, ...] = ()  # shapes of what the truth reports as moving, matched by name
    code_version: str = ""
    code_modified: bool = False
    libraries: tuple[str, ...] = ()  # "name version"
    machine: str = ""
    doctor: str = ""  # what `trundle doctor --json` had to say, as it was given to the run


def code_version() -> tuple[str, bool]:
    """Return the version of this code and whether it was modified: by git in a checkout, else of the installed package."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return metadata.version("trundle"), False
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        version = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):  # no git here, or a repository that is not ours to read
        return metadata.version("trundle"), False
    return version.removesuffix("-dirty"), version.endswith("-dirty")


@cache
def library_versions() -> tuple[str, ...]:
    """Return "name version" of every library that a run needs, as this distribution's own metadata lists them."""
    needed = (text for text in metadata.requires("trundle") or () if "extra ==" not in text)
    names = sorted(re.split(r"[^\w.-]", text, maxsplit=1)[0] for text in needed)
    return tuple(f"{name} {metadata.version(name)}" for name in names)


def machine() -> str:
    """Return processor, system and Python of this machine: on another processor the last bits of a result may differ."""
    system = f"{platform.machine()} {platform.system()} {platform.release()} python {platform.python_version()}"
    return f"{processor()}; {system}"


@cache
def processor() -> str:
    """Return the processor's model as the system names it, else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:  # not Linux
        return platform.processor() or platform.machine()
    found = dict(line.split(":", 1) for line in lines if ":" in line)
    named = {key.strip(): value.strip() for key, value in found.items()}
    arm = " ".join(named[key] for key in ("CPU implementer", "CPU part", "CPU variant", "CPU revision") if key in named)
    return named.get("model name") or named.get("Model") or arm or platform.machine()
