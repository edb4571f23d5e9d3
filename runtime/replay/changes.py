"""What a replay may do otherwise than the recording: whatever decides, and nothing of what was there."""

from __future__ import annotations

from typing import Any

import yaml

from drivers.interface.errors import ConfigurationError
from runtime import registry, yaml_files
from runtime.configuration import Configuration, PlannerCommon, load_effective
from runtime.registry import Part

CHANGEABLE = ("estimator", "router", "planner", "shield", "supervisor")


def configuration_of(text: str, source: str, planner: str | None, overrides: tuple[str, ...]) -> Configuration:
    """Return the recorded configuration with another planner, if one is named, and with changes.

    Another planner comes with its own defaults, and under its own shield where the recorded one had his.

    Raises:
        ConfigurationError: what is recorded cannot be built here, or a change is not one to what decides.
    """
    recorded = load_effective(text, source, {})
    content: yaml_files.Mapping = yaml.safe_load(text)
    changed: dict[str, Any] = {name: content[name] for name in CHANGEABLE}
    if planner is not None:
        cls = registry.load(Part.PLANNER, planner)
        common = {name: value for name, value in changed["planner"].items() if name in PlannerCommon.model_fields}
        changed["planner"] = {"name": planner} | common
        if recorded.shield.name == recorded.planner.choice.cls.default_shield:
            changed["shield"] = {"name": cls.default_shield}
    for override in overrides:
        keys, value = yaml_files.parse_override(override)
        if keys[0] not in CHANGEABLE:
            raise ConfigurationError(
                f"--set {'.'.join(keys)}: a replay has the devices, the world and the beat of its recording; "
                f"it can change {', '.join(CHANGEABLE)}"
            )
        changed = yaml_files.override(changed, keys, value)
    return load_effective(text, source, changed)
