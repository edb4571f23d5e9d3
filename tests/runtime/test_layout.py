import math
from pathlib import Path

import numpy as np
import pytest

from drivers.interface.commands import JointTrajectory
from drivers.interface.geometry import SE3
from runtime import configuration
from runtime.log.drawn import drawings, plots, scene, timing
from runtime.log.drawn.arm import set_point
from runtime.log.drawn.urdf import links_of
from runtime.log.reading.opening import reader_of
from runtime.log.reading.read import STATIC, Log, read
from runtime.run import RunOptions, run

DRIVE = ("dynamic_hallway", "planner.name=point_ds", "estimator.tracks=truth", "mission.time_limit_s=2.0")
ARM = ("arm_bench", "mission.time_limit_s=1.0")
ONLY_IF_SAID = {plots.PLANNER, plots.SHIELD, scene.COLOUR, drawings.DRAWN}  # not each has something to say
HIDDEN = {"/view/map/truth"}  # logged for those who want to see it; a second trail beside the robot's own would confuse


@pytest.fixture(scope="module", params=[DRIVE, ARM], ids=["drive", "arm"])
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Log:
    name, *changes = request.param
    path = tmp_path_factory.mktemp("log") / "a.rrd"
    run(configuration.load(name, tuple(changes)), RunOptions(seed=1, log=path))
    return read(path)


def shown(path: Path) -> tuple[set[str], set[str]]:
    """What the embedded layout's views ask for, and what they leave out, as patterns."""
    reader = reader_of(path)
    origins: dict[str, str] = {}
    queries: dict[str, list[str]] = {}
    for chunk in reader.stream(store=reader.blueprints()[0]):
        batch = chunk.to_record_batch()
        for name in set(batch.schema.names) & {"ViewBlueprint:space_origin", "ViewContents:query"}:
            value = next(cell for cell in batch.column(name).to_pylist() if cell)
            if name == "ViewBlueprint:space_origin":
                origins[chunk.entity_path] = value[0]
            else:
                queries[chunk.entity_path.removesuffix("/ViewContents")] = value
    assert len(origins) >= 9
    wanted, unwanted = set(), set()
    for view, patterns in queries.items():
        for pattern in patterns:
            out = pattern.startswith("-")
            (unwanted if out else wanted).add(pattern.lstrip("+- ").replace("$origin", origins[view]))
    return wanted | set(origins.values()), unwanted


def matches(entity: str, pattern: str) -> bool:
    stem = pattern.removesuffix("/**")
    return entity == stem or (pattern != stem and entity.startswith(stem + "/"))


def test_every_view_finds_what_it_shows(log: Log) -> None:
    wanted, _ = shown(log.path)
    empty = {pattern for pattern in wanted if not any(entity.startswith(pattern.removesuffix("/**")) for entity in log.entities)}
    assert {pattern.removesuffix("/**") for pattern in empty} <= ONLY_IF_SAID


def test_everything_that_is_drawn_or_plotted_is_shown_by_a_view(log: Log) -> None:
    wanted, _ = shown(log.path)
    drawn = {
        entity
        for entity, components in log.entities.items()
        if entity.startswith(("/view", "/timing")) and any(set(history) - {STATIC} for history in components.values())
    }
    assert len(drawn) > 15
    unseen = {entity for entity in drawn if not any(matches(entity, pattern) for pattern in wanted)}
    assert unseen <= HIDDEN


def test_the_stages_lie_on_top_of_each_other_up_to_the_end_of_the_tick(log: Log) -> None:
    stages, done = (log.history(entity, "Scalars:scalars") for entity in (timing.STAGE_TIMES, timing.DONE))
    assert [*stages] == [*done] == log.ticks
    for tick, ms in stages.items():
        assert np.diff(done[tick][:-1]) == pytest.approx(ms)
        assert done[tick][0] == 0.0  # in lockstep the loop wakes at the grid time
        assert done[tick][-1] == pytest.approx(50.0)


def test_a_simulated_device_delivers_at_its_nominal_rate(log: Log) -> None:
    rates = log.history(timing.RATES, "Scalars:scalars")
    after_a_second = [cell for tick, cell in rates.items() if tick > 25]
    before = [cell for tick, cell in rates.items() if tick < 15]
    assert np.isnan(before).all()
    if after_a_second:
        assert np.nanmedian(after_a_second, axis=0) == pytest.approx(100.0, abs=8.0)


def test_the_arms_links_are_chained_as_mujoco_chains_them() -> None:
    import mujoco

    urdf = (Path(__file__).parents[2] / "configs/models/panda.urdf").read_text()
    spec = mujoco.MjSpec.from_string(urdf)
    spec.compiler.fusestatic = False
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = angles = np.array([0.3, -0.7, 0.2, -2.0, 0.5, 1.4, -0.9])
    mujoco.mj_kinematics(model, data)
    pose, joint = SE3(), 0
    for link in links_of(urdf):
        pose = pose @ link.parent_from_joint
        if link.turns:
            pose = pose @ SE3(qw=math.cos(angles[joint] / 2), qz=math.sin(angles[joint] / 2))
            joint += 1
        if joint:
            body = data.body(link.name)
            assert pose.translation == pytest.approx(body.xpos, abs=1e-9)
            assert pose.rotation.ravel() == pytest.approx(body.xmat, abs=1e-9)
    assert joint == 7


@pytest.mark.parametrize(
    "urdf",
    [
        "<robot><link name='a'/><link name='b'/></robot>",
        "<robot><link name='a'/><link name='b'/>"
        "<joint name='j' type='prismatic'><parent link='a'/><child link='b'/></joint></robot>",
    ],
)
def test_what_is_no_arm_of_turning_joints_is_refused(urdf: str) -> None:
    with pytest.raises(ValueError, match=r"one chain of links|does not turn about z"):
        links_of(urdf)


def test_a_set_point_lies_on_the_cubic_through_the_knots() -> None:
    times = np.array([0.0, 0.5, 2.0])
    coefficients = np.array([[0.2, -0.3, 0.4, 0.1]])
    position = np.stack([np.polyval(coefficients[0], times)], axis=1)
    velocity = np.stack([np.polyval(np.polyder(coefficients[0]), times)], axis=1)
    trajectory = JointTrajectory(10**9, times, position, velocity)
    for t in (0.0, 0.1, 0.5, 0.7, 1.9, 2.0):
        assert set_point(trajectory, round((1.0 + t) * 1e9), 1) == pytest.approx((np.polyval(coefficients[0], t),))
    assert set_point(trajectory, 9 * 10**9, 1) == pytest.approx(tuple(position[-1]))
    assert np.isnan(set_point(JointTrajectory.rest(), 0, 7)).all()
