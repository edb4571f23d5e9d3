"""On which hand who comes passes: when and where, what that leaves of the way, and that everything keeps to one answer."""

from types import SimpleNamespace

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from planners.clearance_manifold.branch_kernels import BODY_M, EARLY
from planners.clearance_manifold.closing import SLOTS
from planners.clearance_manifold.extraction import Scene
from planners.clearance_manifold.passing import Passing
from planners.clearance_manifold.passing_kernels import ABREAST_M, give_way, left_to, meeting, runs_along
from planners.clearance_manifold.ridge_kernels import Ground, Sections

LEAST_M, APART_M, SPEED_M_S = 0.2, 0.6, 0.5
STANDS = np.zeros(2)
NOBODY = np.zeros(5)
SAME, ANOTHER = np.zeros(SLOTS, np.bool_), np.ones(SLOTS, np.bool_)


def sections_at(xs, reach_m=1.0):
    n = len(xs)
    return Sections(
        np.stack((np.array(xs), np.zeros(n)), axis=1), np.tile([0.0, 1.0], (n, 1)), np.tile([-reach_m, reach_m], (n, 1))
    )


def coming(x, y, vx, vy):
    return np.array([x, y, vx, vy, 20.0])


def scene_of(*come, robot=STANDS):
    closing = np.zeros((SLOTS, 5))
    closing[: len(come)] = come
    ground, none = Ground(np.ones((2, 2), np.float32), 0.0, 0.0, 1.0), np.zeros(4)
    return Scene(ground, sections_at([0.0, 0.5, 1.0, 2.0]), none, none, 0.0, robot, 4, 0.4, closing)


def passing(left=0.0, right=0.0):
    """Return what chooses, where to the left of who comes a branch costs this, and to the right of him that [m]."""

    def pays(scene):
        return right if scene.sections.reach[0, 1] < 1.0 else left

    return Passing(SimpleNamespace(own=0, least_m=LEAST_M, pays=pays), APART_M, SPEED_M_S)


def first_of(chooses, scene, velocity, begins):
    """Return the hand of who is in the first slot, and what is left of the scene."""
    hands, left = chooses.update(scene, velocity, begins)
    return float(hands[0]), left


def holding(hand):
    """Return the state of what has chosen a hand for somebody who comes along the way."""
    return {"hands": np.array([hand, 0.0, 0.0]), "along": np.ones(SLOTS, np.bool_)}


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_when_and_on_which_hand_somebody_passes(yaw):
    """He comes from 2 m ahead at 0.5 m/s, 0.3 m to the robot's left, which is to the right of his way."""
    turned = SE2(0.0, 0.0, yaw)
    closing = np.concatenate((turned.apply(np.array([2.0, 0.3])), turned.apply(np.array([-0.5, 0.0])), (9.0,)))
    assert meeting(STANDS, closing) == pytest.approx((4.0, -0.3))
    assert meeting(turned.apply(np.array([3.0, 0.5])), closing) == pytest.approx((-2.0, 0.2))
    assert np.isnan(meeting(STANDS, NOBODY)).all()
    normal = turned.apply(np.array([0.0, 1.0]))
    assert runs_along(normal, closing)
    assert not runs_along(turned.apply(np.array([1.0, 0.0])), closing)


@pytest.mark.parametrize("hand", [1.0, -1.0])
@pytest.mark.parametrize("line_m", [0.0, -0.2])
def test_the_sections_end_at_the_side_of_who_comes_where_he_still_comes_by(hand, line_m):
    """He comes along y = line from 2 m ahead; left of his way is the robot's right."""
    xs, speed, v = np.linspace(0.0, 1.9, 20), 0.4, 0.8
    reach = left_to(hand, sections_at(xs), 0, STANDS, speed, coming(2.0, line_m, -v, 0.0), LEAST_M)
    end = line_m + hand * (BODY_M + LEAST_M)
    first = np.where(xs > 0.0, EARLY * np.hypot(xs, end) / speed, 0.0)
    met = (2.0 - xs + ABREAST_M) / v > first
    assert 5 < met.sum() < 20
    assert reach[~met] == pytest.approx(np.tile([-1.0, 1.0], ((~met).sum(), 1)))
    assert reach[met] == pytest.approx(np.tile([end, 1.0] if hand > 0.0 else [-1.0, end], (met.sum(), 1)))


def test_what_lies_behind_the_robot_and_who_has_passed_leave_the_sections_whole():
    whole = sections_at([-0.5, 0.0, 0.5])
    assert (left_to(1.0, whole, 1, STANDS, 0.4, coming(2.0, 0.0, -0.8, 0.0), LEAST_M)[0] == whole.reach[0]).all()
    assert (left_to(1.0, whole, 1, STANDS, 0.4, coming(-ABREAST_M - 0.01, 0.0, -0.8, 0.0), LEAST_M) == whole.reach).all()


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_the_robot_gives_way_to_its_hand(hand):
    """He comes straight on and is there after 2 s."""
    closing, u = coming(2.0, 0.0, -1.0, 0.0), np.array([0.4, 0.0])
    assert give_way(u, STANDS, closing, APART_M, 2.5, hand) == pytest.approx([0.4, 0.5 * APART_M * hand])
    assert (give_way(u, STANDS, closing, APART_M, 1.9, hand) == u).all()  # that is not soon
    assert (give_way(u, STANDS, closing, APART_M, 2.5, 0.0) == u).all()
    assert (give_way(u, STANDS, NOBODY, APART_M, 2.5, hand) == u).all()


def test_who_is_beside_the_robot_is_not_fled_from_but_not_gone_to_either():
    closing = coming(-0.2, 0.4, -1.0, 0.0)  # on its left, right of his way
    assert give_way(np.array([0.4, 0.3]), STANDS, closing, APART_M, 2.5, -1.0) == pytest.approx([0.4, 0.0])
    assert give_way(np.array([0.4, -0.1]), STANDS, closing, APART_M, 2.5, -1.0) == pytest.approx([0.4, -0.1])


def test_the_hand_is_kept_when_the_line_of_who_comes_sways():
    chooses = passing()
    first, _ = first_of(chooses, scene_of(coming(2.2, 0.02, -1.0, 0.0)), STANDS, ANOTHER)
    for tick, sway_m in enumerate((-0.03, 0.04, -0.08, 0.09, -0.15, 0.18, -0.18)):
        closing = coming(2.1 - 0.25 * tick, sway_m, -1.0, 0.0)
        hand, scene = first_of(chooses, scene_of(closing), STANDS, SAME)
        assert hand == first
        assert bool(scene.sections.reach[0, 0] > -1.0) is (hand > 0.0)  # the way ends at his side on the same hand
        assert give_way(STANDS, STANDS, closing, APART_M, 9.0, hand)[1] * hand > 0.0


@pytest.mark.parametrize(("distance_m", "goes_m_s", "changes"), [(2.4, 0.0, True), (0.7, -0.5, False)])
def test_the_hand_that_the_robot_goes_to_is_kept_when_he_is_near(distance_m, goes_m_s, changes):
    """He had come along on the robot's left, and now comes along 0.4 m to its right."""
    chooses = passing()
    before, _ = first_of(chooses, scene_of(coming(2.5, 0.4, -1.0, 0.0)), STANDS, ANOTHER)
    after, _ = first_of(chooses, scene_of(coming(distance_m, -0.4, -1.0, 0.0)), np.array([0.0, goes_m_s]), SAME)
    assert before == -1.0
    assert (after == 1.0) is changes


@pytest.mark.parametrize(("across_m_s", "hand"), [(-0.15, -1.0), (-0.2, 1.0)])
def test_what_leads_across_the_way_of_who_comes_along_it_counts_for_a_while_only(across_m_s, hand):
    """He is 3 m ahead, 0.1 m to the robot's left, and sways to its right: by 0.09 or 0.12 m in ACROSS_S, by 0.6 m in all."""
    assert first_of(passing(), scene_of(coming(3.0, 0.1, -0.7, across_m_s)), STANDS, ANOTHER)[0] == hand


def test_for_who_turns_the_hand_is_chosen_anew():
    """Who crosses in front of the robot is passed behind; then he turns along the way, 0.3 m on that hand."""
    chooses = passing()
    crossing, _ = first_of(chooses, scene_of(coming(1.5, 0.8, -0.5, -0.5)), STANDS, ANOTHER)
    assert crossing == 1.0
    assert first_of(chooses, scene_of(coming(1.0, 0.15, -0.7, -0.05)), STANDS, SAME)[0] == -1.0
    kept = passing()
    kept.take(holding(1.0))
    assert first_of(kept, scene_of(coming(1.0, 0.15, -0.7, -0.05)), STANDS, SAME)[0] == 1.0


@pytest.mark.parametrize(("goes_m_s", "changes"), [(0.0, True), (0.3, False)])
def test_a_hand_that_cannot_be_got_to_any_more_is_left_for_one_that_can(goes_m_s, changes):
    """He is there after 1.5 s, 0.2 m on the other hand; it stands, or already goes where he has his hand."""
    chooses = passing()
    chooses.take(holding(1.0))
    hand, _ = first_of(chooses, scene_of(coming(1.5, 0.2, -1.0, 0.0)), np.array([0.0, goes_m_s]), SAME)
    assert (hand == -1.0) is changes


def test_a_hand_that_leads_nowhere_is_changed_for_the_one_that_does_and_not_for_one_that_hardly_is_better():
    straight_on = scene_of(coming(2.4, 0.0, -0.5, 0.0))
    for better, hand in ((passing(left=0.0, right=5.0), 1.0), (passing(left=5.0, right=0.0), -1.0)):
        assert first_of(better, straight_on, STANDS, ANOTHER)[0] == hand
        better.take(holding(-hand))
        assert first_of(better, straight_on, STANDS, SAME)[0] == hand
    hardly = passing(left=0.0, right=0.2)
    hardly.take(holding(-1.0))
    assert first_of(hardly, straight_on, STANDS, SAME)[0] == -1.0


def test_where_it_already_goes_counts():
    """He comes a little to the left of it; it goes to the left with 0.4 m/s, or stands."""
    scene = scene_of(coming(2.4, 0.1, -1.0, 0.0))
    assert first_of(passing(), scene, np.array([0.0, 0.4]), ANOTHER)[0] == 1.0
    assert first_of(passing(), scene, STANDS, ANOTHER)[0] == -1.0


@pytest.mark.parametrize("left", [1.0, -1.0])
def test_who_crosses_straight_on_is_passed_behind(left):
    """He comes obliquely, to meet the robot if it stands: it goes back and to where he comes from, not on in front of him."""
    closing = coming(1.0, -left, -0.7, 0.7 * left)
    scene = scene_of(closing)
    hand, kept = first_of(passing(), scene, np.array([0.4, 0.0]), ANOTHER)
    assert kept is scene
    given = give_way(np.array([0.4, 0.0]), STANDS, closing, APART_M, 2.5, hand)
    assert given[0] < 0.2
    assert left * given[1] < 0.0


@pytest.mark.parametrize("closing", [NOBODY, coming(-0.6, 0.1, -1.0, 0.0), coming(3.0, 0.0, -0.4, 0.0)], ids=["", "past", "late"])
def test_nobody_who_comes_leaves_no_hand(closing):
    chooses, scene = passing(), scene_of(closing)
    chooses.take(holding(1.0))
    assert first_of(chooses, scene, STANDS, SAME) == (0.0, scene)
    assert not chooses.state()["hands"].any()


def test_somebody_else_begins_anew():
    chooses = passing()
    chooses.take(holding(1.0))
    near = scene_of(coming(0.7, 0.1, -1.0, 0.0))
    assert first_of(chooses, near, STANDS, SAME)[0] == 1.0
    assert first_of(chooses, near, STANDS, ANOTHER)[0] == -1.0


def test_who_comes_second_chooses_in_what_the_first_leaves():
    """Both come straight on; the first passes on the right, and what the robot keeps of him is not offered to the second."""
    offered = []

    def pays(scene):
        offered.append(scene.sections.reach[0].copy())
        return 0.0 if scene.sections.reach[0, 1] < 1.0 else 1.0  # to the right of who comes, a branch costs less

    chooses = Passing(SimpleNamespace(own=0, least_m=LEAST_M, pays=pays), APART_M, SPEED_M_S)
    late, soon = coming(2.8, 0.0, -0.5, 0.0), coming(1.4, 0.0, -0.5, 0.0)
    hands, left = chooses.update(scene_of(late, soon), STANDS, ANOTHER)
    first = chooses.update(scene_of(NOBODY, soon), STANDS, ANOTHER)[1].sections.reach[0]
    assert hands[1] != 0.0
    assert len(offered) >= 4
    assert all(low >= first[0] and high <= first[1] for low, high in offered[2:4])
    assert left.sections.reach[0, 0] >= first[0]
    assert left.sections.reach[0, 1] <= first[1]
