"""The exported schema and the loader agree: what ships is accepted, and what the loader would refuse is refused."""

import json
from pathlib import Path

import pytest
import yaml
from pydantic import ValidationError

from runtime import registry, yaml_files
from runtime.cli import run_command
from runtime.registry import Part
from runtime.schema import document, schema

SCENARIOS = [yaml_files.SHIPPED / "scenarios" / f"{name}.yaml" for name in yaml_files.shipped("scenarios")]


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_every_shipped_file_is_accepted(path: Path) -> None:
    document().model_validate(yaml.safe_load(path.read_text()))


@pytest.mark.parametrize(
    "text",
    [
        "planner: {name: dwaa}",
        "planner: {name: idle, horizon_s: 2.0}",
        "planner: {period_ticks: 0}",
        "robot: {radius_m: -1.0}",
        "robot: {camera: {driver: sim_imu}}",
        "loop: {rate_hz: fast}",
        "loops: {rate_hz: 20}",
    ],
)
def test_what_the_loader_refuses_is_refused(text: str) -> None:
    with pytest.raises(ValidationError):
        document().model_validate(yaml.safe_load(text))


def test_a_part_has_its_own_and_the_common_settings_with_their_bounds() -> None:
    planner = schema()["$defs"]["planner_dwa"]["properties"]
    assert set(registry.load(Part.PLANNER, "dwa").Settings.model_fields) | {"name", "period_ticks", "budget_ms"} <= set(planner)
    assert planner["name"]["anyOf"][0]["const"] == "dwa"
    assert (planner["period_ticks"]["minimum"], planner["period_ticks"]["maximum"]) == (1, 100)


def test_it_is_written_where_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["schema", "--out", str(tmp_path / "schemas" / "trundle.json")]) == 0
    assert run_command(["schema"]) == 0
    written = json.loads((tmp_path / "schemas" / "trundle.json").read_text())
    assert written == json.loads(capsys.readouterr().out)
    assert set(written["properties"]) == set(document().model_fields)
    assert "required" not in written


def test_nothing_is_required_since_a_file_may_extend_another() -> None:
    document().model_validate({"robot": {"extends": "xlerobot", "base": {"wheels": "rollers"}}, "planner": {"budget_ms": 3.0}})
