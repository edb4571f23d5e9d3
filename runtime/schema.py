"""The JSON schema of a configuration, for editors: every section, and every registered part's settings by the part's name.

It is made from the same models that validate a configuration.  Nothing is required in it, as a file may extend another one or
leave a value to --set; what is still missing then, the run says.
"""

from __future__ import annotations

from copy import copy
from functools import reduce
from operator import or_
from typing import Any, Literal, cast

from pydantic import create_model

from drivers.interface.settings import Settings
from runtime import registry
from runtime.configuration import DEVICES, NoCommon, PlannerCommon, RobotCommon
from runtime.log.settings import LogSettings
from runtime.registry import Part
from runtime.sections import LoopSection, MissionSection, SupervisorSection
from sim_drivers.world import WorldSettings

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the schema.

    Raises:
        ConfigurationError: a registered part cannot be imported.
    """
    whole: dict[str, Any] = document().model_json_schema()
    return {"$schema": DIALECT} | whole


def document() -> Any:
    """Return the pydantic model of a whole file as it is written."""
    sections: dict[str, Any] = {
        "estimator": _any_of(Part.ESTIMATOR),
        "router": _any_of(Part.ROUTER),
        "planner": _any_of(Part.PLANNER, common=PlannerCommon),
        "shield": _any_of(Part.SHIELD),
        "world": _any_of(Part.SCENARIO, key="scenario", common=WorldSettings),
        "supervisor": SupervisorSection,
        "loop": LoopSection,
        "log": LogSettings,
        "mission": MissionSection,
    }
    sections["robot"] = str | _robot()
    return _model("Configuration", (Settings,), {"extends": str} | sections)


def _robot() -> Any:
    devices = {role: _any_of(Part.DRIVER, key="driver", role=role) for role in DEVICES}
    return _model("Robot", (RobotCommon,), {"extends": str} | devices | {"emulation": _emulation()})


def _emulation() -> Any:
    """Return the model of `robot.emulation`: by role, the settings of any firmware that stands in for a driver of that role."""
    roles: dict[str, list[Any]] = {}
    for name in registry.names(Part.FIRMWARE):
        firmware = _model(f"firmware_{name}", (registry.load(Part.FIRMWARE, name).Settings,), {})
        roles.setdefault(registry.load(Part.DRIVER, name).role, []).append(firmware)
    return _model("Emulation", (Settings,), {role: reduce(or_, models) for role, models in roles.items()})


def _any_of(part: Part, *, key: str = "name", common: type[Settings] = NoCommon, role: str | None = None) -> Any:
    """Return the union of the settings of all parts of a kind (of one role, for drivers), each with its name beside them."""
    classes = {name: registry.load(part, name) for name in registry.names(part)}
    models = [
        _model(f"{part.noun}_{name}", (cls.Settings, common), {key: Literal[name]})
        for name, cls in classes.items()
        if role is None or cls.role == role
    ]
    return reduce(or_, models)


def _model(name: str, bases: tuple[type[Settings], ...], more: dict[str, Any]) -> Any:
    """Return a model with the fields of all bases, and some more; all of them may be left out."""
    fields: dict[str, Any] = {key: (kind | None, None) for key, kind in more.items()}
    for key, field in ((key, field) for base in bases for key, field in base.model_fields.items() if field.is_required()):
        optional = copy(field)
        optional.default = None
        fields[key] = (cast(Any, optional.annotation) | None, optional)
    return create_model(name, __base__=bases, **fields)
