"""A Gazebo world file: what stands in it, as far as it is made of boxes and cylinders.

Source: the SDF specification (sdformat.org): a world's models with their links' collisions; poses are `x y z roll pitch yaw`,
each in the frame of what it stands in; a `state` says where a model was when the world was saved.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from pydantic import Field

from drivers.interface.errors import ConfigurationError
from drivers.interface.geometry import SE2
from drivers.interface.settings import Settings
from sim_drivers.scenarios.world_file import read_text
from sim_drivers.scene import Scene, Shape, StaticObstacle

UPRIGHT_RAD = 1e-3  # a solid that leans by less stands upright
SCENERY = ("model://sun", "model://ground_plane")  # what every world includes; our floor is already there


class GazeboSettings(Settings):
    """Which file; where the robot starts and what its goals are stands in the configuration's `mission`."""

    path: Path = Field(description="a .world or .sdf file")
    time_limit_s: float = Field(default=120.0, gt=0.0, le=3600.0, description="when the run is given up")


class Gazebo:
    """A Gazebo world file's boxes and cylinders, standing still; the mission names start and goals."""

    Settings = GazeboSettings

    def __init__(self, settings: GazeboSettings) -> None:
        """Take the settings; the file is read when the scene is drawn."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene, with nothing to reach.

        Raises:
            ConfigurationError: the file cannot be read, is no SDF world, or holds what is neither box, cylinder nor floor.
        """
        path = self._settings.path
        return Scene("gazebo", SE2(), (), self._settings.time_limit_s, _WorldFile(path).obstacles())


class _WorldFile:
    """Walks a file's tree, with its name in every complaint."""

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            root = ElementTree.fromstring(read_text(path))
        except ElementTree.ParseError as error:
            raise self._wrong(f"line {error.position[0]}: it is no XML: {error}") from error
        worlds = root.findall("world") if root.tag in {"sdf", "gazebo"} else []
        if len(worlds) != 1:
            raise self._wrong(f"an SDF file with one world is needed, but it holds {len(worlds)}")
        self._world = worlds[0]
        self._saved = {str(m.get("name")): m.find("pose") for m in self._world.iterfind("state/model")}

    def obstacles(self) -> tuple[StaticObstacle, ...]:
        for include in self._world.iter("include"):
            uri = (include.findtext("uri") or "").strip()
            if uri not in SCENERY:
                raise self._wrong(
                    f"it includes '{uri}', which is another file; only boxes and cylinders in the file itself are read"
                )
        if self._world.find("actor") is not None:
            raise self._wrong("it has an actor, who walks; only what stands still is read")
        solids = [solid for model in self._world.findall("model") for solid in self._solids(model, SE2(), 0.0)]
        return tuple(
            StaticObstacle(f"{name}_{index}", shape, pose, low_m) for index, (name, shape, pose, low_m) in enumerate(solids)
        )

    def _solids(self, model: Element, parent: SE2, parent_z_m: float) -> Iterator[tuple[str, Shape, SE2, float]]:
        """Yield name, shape, pose and lowest height of every solid of a model and of the models in it."""
        name = str(model.get("name"))
        saved = self._saved.get(name) if model in list(self._world) else None
        pose, z_m = self._stands(name, model.find("pose") if saved is None else saved, parent, parent_z_m)
        for inner in model.findall("model"):
            yield from self._solids(inner, pose, z_m)
        for link in model.findall("link"):
            link_pose, link_z_m = self._stands(name, link.find("pose"), pose, z_m)
            for collision in link.findall("collision"):
                solid_pose, solid_z_m = self._stands(name, collision.find("pose"), link_pose, link_z_m)
                shape = self._shape(name, collision.find("geometry"))
                if shape is not None:
                    yield name, shape, solid_pose, solid_z_m - shape.half_extents_m[2]

    def _shape(self, name: str, geometry: Element | None) -> Shape | None:
        """Return the shape of a collision; None: it is a floor."""
        solid = None if geometry is None else next(iter(geometry), None)
        if solid is None or solid.tag in {"plane", "empty"}:
            return None
        if solid.tag == "box":
            return Shape.box(*self._numbers(name, solid.find("size"), 3, above=0.0))
        if solid.tag == "cylinder":
            (radius_m,), (length_m,) = (self._numbers(name, solid.find(tag), 1, above=0.0) for tag in ("radius", "length"))
            return Shape.cylinder(radius_m, length_m)
        raise self._wrong(f"model '{name}' has a collision of shape '{solid.tag}'. Known: box, cylinder, plane")

    def _stands(self, name: str, pose: Element | None, parent: SE2, parent_z_m: float) -> tuple[SE2, float]:
        """Return pose and height in the world of what has this pose in its parent."""
        if pose is None:
            return parent, parent_z_m
        if pose.get("relative_to"):
            raise self._wrong(
                f"model '{name}' has a pose relative to '{pose.get('relative_to')}'; only poses in the parent are read"
            )
        x, y, z, roll, pitch, yaw = self._numbers(name, pose, 6)
        if max(abs(math.sin(roll)), abs(math.sin(pitch))) > UPRIGHT_RAD or math.cos(roll) < 0.0 or math.cos(pitch) < 0.0:
            raise self._wrong(f"model '{name}' leans (roll {roll:g}, pitch {pitch:g} rad); only what stands upright is read")
        return parent @ SE2(x, y, yaw), parent_z_m + z

    def _numbers(self, name: str, element: Element | None, count: int, above: float = -math.inf) -> tuple[float, ...]:
        words = "" if element is None else element.text or ""
        try:
            numbers = tuple(float(word) for word in words.split())
        except ValueError:
            numbers = ()
        if len(numbers) == count and all(math.isfinite(number) and number > above for number in numbers):
            return numbers
        where = "a shape without its size" if element is None else f"<{element.tag}> '{words.strip()}'"
        raise self._wrong(f"model '{name}' has {where}; it takes {count} finite numbers" + (" above 0" if above == 0.0 else ""))

    def _wrong(self, complaint: str) -> ConfigurationError:
        return ConfigurationError(f"{self._path}: {complaint}")
