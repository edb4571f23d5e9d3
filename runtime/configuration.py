"""The configuration: validated, frozen, complete.  A broken file never falls back to defaults.

Sections that choose a part by name (`planner.name`, `robot.base.driver`, `world.scenario`) hold that part's own settings beside
the name; they are validated by the part's own model.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import yaml
from pydantic import Field, ValidationError

from drivers.interface.errors import ConfigurationError, TrundleError
from drivers.interface.settings import Settings
from runtime import registry, yaml_files
from runtime.log.settings import LogSettings
from runtime.registry import Part
from runtime.sections import LoopSection, MissionSection, SupervisorSection
from sim_drivers.faulty import DeviceFault
from sim_drivers.world import WorldSettings

S = TypeVar("S", bound=Settings)
DEVICES = ("camera", "imu", "base", "arm", "scan", "operator", "truth", "markers")


@dataclass(frozen=True, slots=True)
class Choice:
    """A part chosen by name, with its validated settings."""

    name: str
    cls: Any  # the registered class
    settings: Settings

    def build(self, *setup: object) -> Any:
        """Return `cls(settings, *setup)`.

        Raises:
            ConfigurationError: the part does not fit, or its constructor failed.
        """
        try:
            return self.cls(self.settings, *setup)
        except TrundleError:
            raise
        except Exception as error:
            raise ConfigurationError(f"'{self.name}' cannot be built: {type(error).__name__}: {error}") from error


Choices = tuple[tuple[str, Choice], ...]  # (name in the robot, part)


@dataclass(frozen=True, slots=True)
class Chosen(Generic[S]):
    """A chosen part and what the runtime itself needs to know about how to use it."""

    choice: Choice
    common: S


class RobotCommon(Settings):
    """What holds for the whole robot."""

    name: str = Field(min_length=1)
    radius_m: float = Field(gt=0.0, le=2.0, description="radius of the circle around the footprint")
    height_m: float = Field(gt=0.0, le=3.0)
    faults: tuple[DeviceFault, ...] = Field(default=(), description="misbehaviour of its devices, by script")


class PlannerCommon(Settings):
    """How the runtime calls the planner."""

    period_ticks: int = Field(default=1, ge=1, le=100, description="it plans every n-th tick")
    latency_ticks: int = Field(default=0, ge=0, le=100, description="its plan takes effect so much later, in the background")
    budget_ms: float | None = Field(default=None, gt=0.0, description="none: one control period")


class NoCommon(Settings):
    """Nothing beyond the part's own settings."""


@dataclass(frozen=True, slots=True)
class Configuration:
    """Everything that a run depends on, together with the seed."""

    source: str
    robot: RobotCommon
    devices: Choices  # the drivers, in the order of DEVICES
    emulation: Choices | None  # their firmware, where the world lives in `trundle emulate`; None: it does not
    world: Chosen[WorldSettings] | None
    estimator: Choice
    router: Choice
    planner: Chosen[PlannerCommon]
    shield: Choice
    supervisor: SupervisorSection
    loop: LoopSection
    log: LogSettings
    mission: MissionSection

    @property
    def scenario(self) -> str:
        """The scenario's name, or that of the file where there is no world."""
        return self.world.choice.name if self.world else Path(self.source).stem

    def as_yaml(self) -> str:
        """Return the effective configuration, every default written out."""
        document: dict[str, Any] = {"robot": _plain(self.robot)}
        for name, device in self.devices:
            document["robot"][name] = {"driver": device.name} | _plain(device.settings)
        if self.emulation is not None:
            document["robot"]["emulation"] = {name: _plain(firmware.settings) for name, firmware in self.emulation}
        if self.world:
            document["world"] = {"scenario": self.world.choice.name} | _plain(self.world.common, self.world.choice.settings)
        document["estimator"] = {"name": self.estimator.name} | _plain(self.estimator.settings)
        document["router"] = {"name": self.router.name} | _plain(self.router.settings)
        planner = self.planner
        document["planner"] = {"name": planner.choice.name} | _plain(planner.common, planner.choice.settings)
        document["shield"] = {"name": self.shield.name} | _plain(self.shield.settings)
        for section in ("supervisor", "loop", "log", "mission"):
            document[section] = _plain(getattr(self, section))
        return yaml.safe_dump(document, sort_keys=False)


def load(name_or_path: str, overrides: tuple[str, ...] = ()) -> Configuration:
    """Load a configuration by path, shipped name or `NAME:FILE#WORLD`, with `a.b=c` overrides on top.

    Raises:
        ConfigurationError: with the file, the key and the valid choices.
    """
    name_or_path, imported = yaml_files.parse_import(name_or_path)
    path = yaml_files.find(name_or_path, "scenarios")
    content = yaml_files.read(path, "scenarios")
    for keys, value in imported:
        content = yaml_files.override(content, keys, value)
    changes = [yaml_files.parse_override(text) for text in overrides]
    for keys, value in changes:
        if keys == ("robot",):  # a change of robot comes before changes to it
            content = content | {"robot": value}
    content = content | {"robot": _whole_robot(path, content.get("robot"))}
    for keys, value in changes:
        if keys != ("robot",):
            content = yaml_files.override(content, keys, value)
    return _Reader(str(path)).configuration(content)


def load_effective(text: str, source: str, changes: yaml_files.Mapping) -> Configuration:
    """Load what `as_yaml` gave, with whole or part sections laid over it.

    Raises:
        ConfigurationError: with the source, the key and the valid choices.
    """
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigurationError(f"{source}: the configuration in it is damaged") from error
    if not isinstance(content, dict):
        raise ConfigurationError(f"{source}: there is no configuration in it")
    return _Reader(source).configuration(content | changes)


def _whole_robot(path: Path, robot: Any) -> yaml_files.Mapping:
    """Return the robot's mapping, whether it stands there, is named, or extends a named one."""
    if isinstance(robot, str):
        return yaml_files.read(yaml_files.find(robot, "robots"), "robots")
    if isinstance(robot, dict):
        base = robot.get("extends")
        own = {key: value for key, value in robot.items() if key != "extends"}
        return own if base is None else yaml_files.merge(_whole_robot(path, str(base)), own)
    raise ConfigurationError(f"{path}: robot takes a name or keys; known: {', '.join(yaml_files.shipped('robots'))}")


class _Reader:
    """Turns plain mappings into validated sections, with the file's name in every complaint."""

    def __init__(self, source: str) -> None:
        self._source = source

    def configuration(self, content: yaml_files.Mapping) -> Configuration:
        known = ("robot", "world", "estimator", "router", "planner", "shield", "supervisor", "loop", "log", "mission")
        for key in content:
            if key not in known:
                raise ConfigurationError(f"{self._source}: unknown key '{key}'. Known: {', '.join(known)}")
        planner = self._chosen(content, "planner", Part.PLANNER, PlannerCommon, "dwa")
        world = self._chosen(content, "world", Part.SCENARIO, WorldSettings, None, key="scenario") if "world" in content else None
        robot, devices, emulation = self._robot(self._mapping(content, "robot"))
        return Configuration(
            source=self._source,
            robot=robot,
            devices=devices,
            emulation=emulation,
            world=world,
            estimator=self._chosen(content, "estimator", Part.ESTIMATOR, NoCommon, "standard").choice,
            router=self._chosen(content, "router", Part.ROUTER, NoCommon, "grid").choice,
            planner=planner,
            shield=self._chosen(content, "shield", Part.SHIELD, NoCommon, planner.choice.cls.default_shield).choice,
            supervisor=self._validate(SupervisorSection, self._mapping(content, "supervisor"), "supervisor"),
            loop=self._validate(LoopSection, self._mapping(content, "loop"), "loop"),
            log=self._validate(LogSettings, self._mapping(content, "log"), "log"),
            mission=self._validate(MissionSection, self._mapping(content, "mission"), "mission"),
        )

    def _robot(self, content: yaml_files.Mapping) -> tuple[RobotCommon, Choices, Choices | None]:
        common = {key: value for key, value in content.items() if key in RobotCommon.model_fields}
        for key in content:
            if key not in RobotCommon.model_fields and key not in (*DEVICES, "emulation"):
                known = ", ".join([*RobotCommon.model_fields, *DEVICES, "emulation"])
                raise ConfigurationError(f"{self._source}: unknown key 'robot.{key}'. Known: {known}")
        devices = tuple((name, self._device(content, name)) for name in DEVICES if content.get(name) is not None)
        emulated = content.get("emulation") is not None
        emulation = self._emulation(self._mapping(content, "emulation", "robot."), devices) if emulated else None
        return self._validate(RobotCommon, common, "robot"), devices, emulation

    def _emulation(self, content: yaml_files.Mapping, devices: Choices) -> Choices:
        """Choose the firmware of every device whose driver has one; settings that are not given are its defaults."""
        emulatable = registry.names(Part.FIRMWARE)
        drivers = {name: driver.name for name, driver in devices if driver.name in emulatable}
        for key in content:
            if key not in drivers:
                raise ConfigurationError(
                    f"{self._source}: robot.emulation.{key} is no device of this robot whose driver has firmware. "
                    f"Known: {', '.join(drivers) or 'none'}; drivers with firmware: {', '.join(emulatable)}"
                )
        return tuple((name, self._firmware(content, name, driver)) for name, driver in drivers.items())

    def _firmware(self, content: yaml_files.Mapping, name: str, driver: str) -> Choice:
        cls = registry.load(Part.FIRMWARE, driver)
        values = self._mapping(content, name, "robot.emulation.")
        return Choice(driver, cls, self._validate(cls.Settings, values, f"robot.emulation.{name}"))

    def _device(self, content: yaml_files.Mapping, role: str) -> Choice:
        choice = self._chosen(content, role, Part.DRIVER, NoCommon, None, key="driver", prefix="robot.").choice
        if choice.cls.role != role:
            fitting = [name for name in registry.names(Part.DRIVER) if registry.load(Part.DRIVER, name).role == role]
            raise ConfigurationError(
                f"{self._source}: robot.{role}.driver: '{choice.name}' drives the {choice.cls.role}, not the {role}. "
                f"Known for the {role}: {', '.join(fitting)}"
            )
        return choice

    def _chosen(
        self,
        content: yaml_files.Mapping,
        section: str,
        part: Part,
        common: type[S],
        default: str | None,
        *,
        key: str = "name",
        prefix: str = "",
    ) -> Chosen[S]:
        values = dict(self._mapping(content, section, prefix))
        name = values.pop(key, None) or default
        where = f"{prefix}{section}"
        if not isinstance(name, str):
            known = ", ".join(registry.names(part))
            raise ConfigurationError(f"{self._source}: {where}.{key} must name a {part.noun}. Known: {known}")
        try:
            cls = registry.load(part, name)
        except ConfigurationError as error:
            raise ConfigurationError(f"{self._source}: {where}.{key}: {error}") from error
        own = {k: v for k, v in values.items() if k not in common.model_fields}
        shared = {k: v for k, v in values.items() if k in common.model_fields}
        settings = self._validate(cls.Settings, own, where, tuple(common.model_fields))
        return Chosen(Choice(name, cls, settings), self._validate(common, shared, where))

    def _mapping(self, content: yaml_files.Mapping, section: str, prefix: str = "") -> yaml_files.Mapping:
        values = content.get(section, {})
        if not isinstance(values, dict):
            raise ConfigurationError(f"{self._source}: {prefix}{section} takes keys with values, not {values!r}")
        return values

    def _validate(self, model: type[S], values: yaml_files.Mapping, where: str, also_known: tuple[str, ...] = ()) -> S:
        try:
            return model.model_validate(values)
        except ValidationError as error:
            raise ConfigurationError(f"{self._source}: {_sentence(error, model, where, also_known)}") from error


def _sentence(error: ValidationError, model: type[Settings], where: str, also_known: tuple[str, ...]) -> str:
    """Say the first of a model's complaints in one sentence."""
    first = error.errors()[0]
    key = ".".join([where, *(str(part) for part in first["loc"])])
    if first["type"] == "extra_forbidden":
        return f"unknown key '{key}'. Known: {', '.join([*_fields_at(model, first['loc'][:-1]), *also_known])}"
    if first["type"] == "missing":
        return f"the key '{key}' is missing"
    message = first["msg"].removeprefix("Value error, ")
    return f"{key}: {message[0].lower()}{message[1:]}, not {first['input']!r}"


def _fields_at(model: type[Settings], location: tuple[int | str, ...]) -> tuple[str, ...]:
    """Return the field names of the nested model that a location leads to."""
    for step in location:
        annotation = model.model_fields[str(step)].annotation if str(step) in model.model_fields else None
        if not (isinstance(annotation, type) and issubclass(annotation, Settings)):
            return ()
        model = annotation
    return tuple(model.model_fields)


def _plain(*settings: Settings) -> dict[str, Any]:
    return {key: value for part in settings for key, value in part.model_dump(mode="json").items()}
