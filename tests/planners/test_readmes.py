from pathlib import Path

import pytest

import planners
from planners.dwa.planner import DynamicWindow
from planners.graceful.planner import Graceful
from planners.joint_waypoints.planner import JointWaypoints
from planners.mpc_cbf.planner import BarrierMpc
from planners.mppi.planner import Mppi
from planners.orca.planner import ReciprocalAvoidance
from planners.point_ds.planner import PointAttractor
from planners.regulated_pure_pursuit.planner import RegulatedPurePursuit
from planners.routers.grid import GridRouter
from planners.shields.field_cbf import FieldCbf
from planners.teb.planner import ElasticBand


@pytest.mark.parametrize(
    ("folder", "part"),
    [
        ("dwa", DynamicWindow),
        ("graceful", Graceful),
        ("mppi", Mppi),
        ("regulated_pure_pursuit", RegulatedPurePursuit),
        ("point_ds", PointAttractor),
        ("joint_waypoints", JointWaypoints),
        ("mpc_cbf", BarrierMpc),
        ("orca", ReciprocalAvoidance),
        ("teb", ElasticBand),
        ("routers", GridRouter),
        ("shields", FieldCbf),
    ],
)
def test_readme_names_every_setting_and_its_default(folder, part):
    text = (Path(planners.__file__).parent / folder / "README.md").read_text()
    rows = [line.split("|")[1:4] for line in text.splitlines() if line.startswith("| `")]
    stated = {}
    for keys, defaults, _ in rows:
        stated |= dict(zip([k.strip(" `") for k in keys.split(",")], [d.strip() for d in defaults.split(",")], strict=True))
    actual = {name: field.default for name, field in part.Settings.model_fields.items()}
    assert stated.keys() == actual.keys()
    for name, default in actual.items():
        assert stated[name] == str(default).lower() or float(stated[name]) == default
