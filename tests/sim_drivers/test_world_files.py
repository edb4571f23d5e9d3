"""Worlds that others made: what stands in the files stands in the scene, and what is wrong with a file is said in a sentence."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from drivers.interface.errors import ConfigurationError
from sim_drivers.scenarios.barn import Barn
from sim_drivers.scenarios.dynabarn import DynaBarn
from sim_drivers.scenarios.gazebo import Gazebo
from sim_drivers.scene import Kind, Scene
from tests.sim_drivers.footprints import clearance

DATA = Path(__file__).parents[1] / "data"
BARN, DYNABARN, YARD = DATA / "barn/barn_2_worlds.json", DATA / "dynabarn/dynabarn_2_worlds.json", DATA / "gazebo/yard.world"


def barn(path: Path = BARN, world: int | None = 20) -> Scene:
    return Barn(Barn.Settings(path=path, world=world)).draw(0)


def dynabarn(path: Path = DYNABARN, world: int | None = 18, seed: int = 0, **settings: float) -> Scene:
    return DynaBarn(DynaBarn.Settings(path=path, world=world, **settings)).draw(seed)


def gazebo(tmp_path: Path, models: str) -> Scene:
    path = tmp_path / "w.world"
    path.write_text(f'<sdf version="1.6"><world name="w">{models}</world></sdf>')
    return Gazebo(Gazebo.Settings(path=path)).draw(0)


def changed(tmp_path: Path, path: Path, change) -> Path:
    """A copy of a JSON file in which something was changed."""
    content = json.loads(path.read_text())
    change(content)
    copy = tmp_path / path.name
    copy.write_text(json.dumps(content))
    return copy


@pytest.mark.parametrize("world", [20, 240])
def test_a_barn_world_stands_as_in_the_file_and_its_reference_path_is_free(world: int) -> None:
    scene, file = barn(world=world), json.loads(BARN.read_text())
    places = [(o.map_from_shape.x, o.map_from_shape.y) for o in scene.static]
    np.testing.assert_array_equal(places, file["worlds"][str(world)]["cylinders"])
    assert all(o.shape.kind is Kind.CYLINDER and o.shape.half_extents_m == (0.075, 0.075, 0.5) for o in scene.static)
    reference = np.array(file["worlds"][str(world)]["reference_path"])
    assert clearance(scene, reference).min() > 0.215  # half the Jackal's width
    assert (scene.map_from_start.x, scene.map_from_start.y, scene.map_from_start.yaw) == (-2.25, 3.0, 1.5708)
    assert [(g.x_m, g.y_m, g.tolerance_m) for g in scene.goals] == [(-2.25, 13.0, 1.0)]


def test_discs_go_the_ways_of_the_file_and_begin_again() -> None:
    scene, file = dynabarn(), json.loads(DYNABARN.read_text())["worlds"]["18"]
    assert len(scene.movers) == len(file)
    for mover, disc in zip(scene.movers, file, strict=True):
        assert mover.shape.bounding_radius_m == disc["radius_m"]
        for t, x, y in disc["keyframes_t_x_y"][:-1]:
            for round_trips in (0, 2):
                pose = mover.pose_at(t + round_trips * disc["period_s"])
                np.testing.assert_allclose((pose.x, pose.y), (x, y), atol=1e-6)
    assert (scene.map_from_start.x, scene.map_from_start.y, abs(scene.map_from_start.yaw)) == (11.0, 0.0, math.pi)


def test_between_key_frames_a_disc_follows_gazebos_spline() -> None:
    """Held against SciPy's Hermite spline in each key frame's own time; it never turns on the spot, whose way it is not."""
    scene, file = dynabarn(), json.loads(DYNABARN.read_text())["worlds"]["18"]
    for mover, disc in zip(scene.movers, file, strict=True):
        t, *places = np.array(disc["keyframes_t_x_y"]).T
        index = np.arange(len(t))
        # np.gradient is half of what lies between the neighbours, at the ends all of what lies to the only one.
        slopes = [np.gradient(p) * np.r_[0.5, np.ones(len(t) - 2), 0.5] for p in places]
        wanted = [
            CubicHermiteSpline(index, p, slope)(np.interp(mover.keyframes[:, 0], t, index))
            for p, slope in zip(places, slopes, strict=True)
        ]
        np.testing.assert_allclose(mover.keyframes[:, 1:3].T, wanted, atol=1e-9)
        assert np.diff(mover.keyframes[:, 0]).max() <= 0.1 + 1e-9


def test_three_walls_stand_around_the_floor_and_the_way_across_is_free() -> None:
    scene = dynabarn()
    across = np.stack((np.linspace(11.0, -9.0, 41), np.zeros(41)), axis=1)
    assert clearance(scene, across).min() == pytest.approx(0.75)  # the goal lies before the back wall
    assert clearance(scene, np.array([[0.0, 9.0], [0.0, -9.0]])) == pytest.approx([0.75, 0.75])


def test_a_lead_that_the_seed_draws_only_turns_the_clock_forward() -> None:
    now, leads = dynabarn(), [dynabarn(seed=seed, lead_s=20.0) for seed in range(6)]
    shifts = np.array([(now.movers[0].keyframes - led.movers[0].keyframes)[0, 0] for led in leads])
    assert np.ptp(shifts) > 5.0
    assert np.all((shifts >= 0.0) & (shifts <= 20.0))
    for led, shift in zip(leads, shifts, strict=True):
        for before, after in zip(now.movers, led.movers, strict=True):
            one, other = before.pose_at(float(shift) + 3.0), after.pose_at(3.0)
            np.testing.assert_allclose((one.x, one.y), (other.x, other.y), atol=1e-9)


def test_a_gazebo_world_stands_as_its_nested_and_saved_poses_say() -> None:
    scene = Gazebo(Gazebo.Settings(path=YARD)).draw(0)
    stands = {
        o.name: (*np.round((o.map_from_shape.x, o.map_from_shape.y), 9).tolist(), round(o.base_z_m, 9), o.shape.half_extents_m)
        for o in scene.static
    }
    assert stands == {
        "crate_0": (3.0, 1.0, 0.0, (1.0, 0.3, 0.5)),
        "table_1": (5.0, -2.0, 0.65, (0.5, 0.4, 0.05)),
        "table_2": (4.9, -1.6, 0.0, (0.05, 0.05, 0.325)),  # 0.4 m ahead and 0.1 m to the left of one that looks along y
        "post_3": (6.0, 3.0, 0.0, (0.1, 0.1, 1.0)),
        "barrel_4": (4.0, 0.0, 0.0, (0.3, 0.3, 0.5)),  # where it was when the world was saved
    }
    assert scene.static[0].map_from_shape.yaw == pytest.approx(math.pi / 2)
    assert (scene.goals, scene.movers) == ((), ())


LINK = "<model name='m'>{pose}<link name='l'><collision name='c'><geometry>{shape}</geometry></collision></link></model>"


@pytest.mark.parametrize(
    ("models", "said"),
    [
        ("<include><uri>model://house</uri></include>", "it includes 'model://house'"),
        ("<actor name='a'/>", "it has an actor"),
        (
            LINK.format(pose="", shape="<sphere><radius>1</radius></sphere>"),
            "model 'm' has a collision of shape 'sphere'. Known: box",
        ),
        (
            LINK.format(pose="", shape="<box><size>1 1</size></box>"),
            r"model 'm' has <size> '1 1'; it takes 3 finite numbers above 0",
        ),
        (LINK.format(pose="", shape="<box><size>1 1 -1</size></box>"), "takes 3 finite numbers above 0"),
        (LINK.format(pose="", shape="<box/>"), "model 'm' has a shape without its size"),
        (LINK.format(pose="<pose>0 0 0 0 0</pose>", shape="<box/>"), r"<pose> '0 0 0 0 0'; it takes 6 finite numbers$"),
        (LINK.format(pose="<pose>0 0 nan 0 0 0</pose>", shape="<box/>"), "it takes 6 finite numbers"),
        (LINK.format(pose="<pose>0 0 0 1.57 0 0</pose>", shape="<box/>"), "model 'm' leans"),
        (LINK.format(pose="<pose relative_to='n'>0 0 0 0 0 0</pose>", shape="<box/>"), "relative to 'n'"),
    ],
)
def test_what_a_gazebo_world_must_not_hold_is_named(tmp_path: Path, models: str, said: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"w\.world: .*{said}"):
        gazebo(tmp_path, models)


@pytest.mark.parametrize(
    ("text", "said"),
    [("<sdf><world>", "line 1: it is no XML"), ("<robot/>", "one world is needed, but it holds 0"), ("", "it is no XML")],
)
def test_what_is_no_world_file_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "w.world"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=rf"w\.world: .*{said}"):
        Gazebo(Gazebo.Settings(path=path)).draw(0)


@pytest.mark.parametrize(("scene", "known"), [(barn, "20, 240"), (dynabarn, "0, 18")])
def test_a_world_that_is_not_there_or_not_named_says_which_there_are(scene, known: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"there is no world 7 in it\. Known: {known}$"):
        scene(world=7)
    with pytest.raises(ConfigurationError, match=rf"several worlds, so world\.world must name one of them\. Known: {known}$"):
        scene(world=None)


def test_the_only_world_need_not_be_named(tmp_path: Path) -> None:
    assert barn(changed(tmp_path, BARN, lambda content: content["worlds"].pop("20")), world=None).static


@pytest.mark.parametrize(
    ("scene", "path", "change", "said"),
    [
        (barn, BARN, lambda c: c.pop("goal"), r"goal: Field required"),
        (barn, BARN, lambda c: c.update(cylinder_radius_m=-1.0), r"cylinder_radius_m: Input should be greater than 0"),
        (barn, BARN, lambda c: c["worlds"]["20"]["cylinders"].append([1.0]), r"worlds\.20\.cylinders\.\d+"),
        (dynabarn, DYNABARN, lambda c: c["worlds"]["18"][0].update(period_s=3.0), r"worlds\.18\.0: .*but period_s is 3"),
        (dynabarn, DYNABARN, lambda c: c["worlds"]["0"][1]["keyframes_t_x_y"].reverse(), r"worlds\.0\.1: .*go on in time"),
        (dynabarn, DYNABARN, lambda c: c.update(worlds={}), r"worlds: "),
    ],
)
def test_a_broken_file_is_refused_with_its_key(tmp_path: Path, scene, path: Path, change, said: str) -> None:
    with pytest.raises(ConfigurationError, match=rf"\.json: {said}"):
        scene(changed(tmp_path, path, change))


def test_what_cannot_be_read_is_refused(tmp_path: Path) -> None:
    broken = tmp_path / "b.json"
    broken.write_text('{"worlds":\n oops}')
    with pytest.raises(ConfigurationError, match=r"b\.json, line 2: it is no JSON"):
        barn(broken)
    with pytest.raises(ConfigurationError, match=r"none\.json cannot be read"):
        barn(tmp_path / "none.json")
