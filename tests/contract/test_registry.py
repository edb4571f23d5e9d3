"""Every registered part, of whatever kind: it is what its entry point says, and its settings are strict."""

import pytest
from pydantic import ValidationError

from drivers.interface.settings import Settings
from runtime.registry import Part, first_line, load, names
from sim_drivers.scenario import Scenario
from sim_drivers.scene import Scene
from sim_drivers.world import MujocoWorld, WorldSettings
from tests.contract.devices import DATA, SETTINGS
from tests.contract.facts import facts

WITHOUT_GOALS = {"arm_bench", "hidden_crossing", "gazebo"}  # their robots go nowhere, or where the mission says
WORLD_FILES = {
    "barn": {"path": DATA / "barn" / "barn_2_worlds.json", "world": 20},
    "dynabarn": {"path": DATA / "dynabarn" / "dynabarn_2_worlds.json", "world": 18},
    "gazebo": {"path": DATA / "gazebo" / "yard.world"},
}
NEEDED = {Part.DRIVER: SETTINGS, Part.SCENARIO: WORLD_FILES}
REGISTERED = [pytest.param(part, name, id=f"{part.noun}-{name}") for part in Part for name in names(part)]


@pytest.mark.parametrize(("part", "name"), REGISTERED)
def test_says_what_it_is_in_one_line(part, name):
    line = first_line(part, name)
    assert 10 < len(line) < 150
    assert line.strip() == line


@pytest.mark.parametrize(("part", "name"), REGISTERED)
def test_settings_are_strict_frozen_and_survive_their_own_dump(part, name):
    model, needed = load(part, name).Settings, NEEDED.get(part, {}).get(name, {})
    assert issubclass(model, Settings)
    settings = model(**needed)
    assert model.model_validate(settings.model_dump(mode="json")) == settings
    with pytest.raises(ValidationError, match="extra_forbidden"):
        model(**needed, no_such_key=1)
    for field in model.model_fields:
        with pytest.raises(ValidationError, match="frozen_instance"):
            setattr(settings, field, None)


@pytest.mark.parametrize(("part", "name"), REGISTERED)
def test_numbers_have_bounds_and_settings_have_a_schema(part, name):
    """A bare `float` would take any number."""
    schema = load(part, name).Settings.model_json_schema()
    models = [schema, *schema.get("$defs", {}).values()]
    numbers = [(key, value) for model in models for key, value in model.get("properties", {}).items() if _is_number(value)]
    assert [key for key, value in numbers if not _bounds(value)] == []


@pytest.mark.parametrize("name", names(Part.SCENARIO))
def test_a_scenario_draws_a_scene_that_compiles(name):
    cls, needed = load(Part.SCENARIO, name), WORLD_FILES.get(name, {})
    scenario = cls(cls.Settings(**needed))
    assert isinstance(scenario, Scenario)
    scene = scenario.draw(4)
    assert isinstance(scene, Scene)
    assert scene.name == name
    assert scene.goals or name in WITHOUT_GOALS
    assert scene.time_limit_s > 0.0
    assert facts(cls(cls.Settings(**needed)).draw(4)) == facts(scene)
    MujocoWorld(scene, WorldSettings()).compile()


def _is_number(schema: dict) -> bool:
    return any(option.get("type") in {"number", "integer"} for option in (schema, *schema.get("anyOf", ())))


def _bounds(schema: dict) -> set[str]:
    return {key for option in (schema, *schema.get("anyOf", ())) for key in option} & {
        "minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum", "enum",
    }  # fmt: skip
