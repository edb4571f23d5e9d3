"""Who closes in is kept in mind: carried on out of view, each in a slot of his own, and forgotten where he is not."""

from dataclasses import replace

import numpy as np
import pytest

from planners.clearance_manifold.closing import SLOTS, ClosingMemory
from planners.clearance_manifold.prediction import ArrivalField
from planners.clearance_manifold.prediction_kernels import MOVER_M
from planners.clearance_manifold.settings import PredictionSettings
from tests.planners.synthetic import Box, Disc, belief_of

NOBODY = np.zeros((0, 5))


def ground(age_s):
    """Return a field with nothing in it, seen so long ago."""
    field = belief_of([]).clearance
    return field, np.full(field.known.shape, age_s, np.float32)


def coming(*at):
    """Return who comes along x with 0.8 m/s, at these places, the nearest first."""
    return np.array([[x, y, -0.8, 0.0, 20.0] for x, y in at])


def watched(memory, ticks, *ys):
    """Let somebody come along each y until he is at x = 1; return who is in which slot."""
    field, age = ground(1.0)
    for tick in range(ticks):
        x = 1.0 + 0.04 * (ticks - 1 - tick)
        told = memory.update(coming(*((x, y) for y in ys)), field, age, 0.05)
    return told


def test_what_left_the_view_goes_on_for_a_moment_and_is_dropped_where_it_is_seen_not_to_be():
    field, age = ground(1.0)
    memory = ClosingMemory(1.0)
    watched(memory, 50, 0.5)
    for step in range(1, 10):
        kept = memory.update(NOBODY, field, age, 0.1)[0]
        assert kept[:2] == pytest.approx([1.0 - 0.08 * step, 0.5], abs=1e-3)
    assert not memory.update(NOBODY, field, age, 0.2).any()
    watched(memory, 10, 0.5)
    assert not memory.update(NOBODY, field, 0.0 * age, 0.1).any()


def test_before_a_wall_in_view_he_goes_on_for_less_long_than_out_of_view():
    """There the clearance is the wall's, and never tells that a place is free."""
    field = belief_of([Box(-4.0, 0.7, 12.0, 0.9)]).clearance
    for age_s, longer in ((1.0, True), (0.0, False)):
        memory, age = ClosingMemory(1.0), np.full(field.known.shape, age_s, np.float32)
        watched(memory, 20, 0.5)
        told = [bool(memory.update(NOBODY, field, age, 0.05).any()) for _ in range(20)]
        assert told[3]
        assert told[12] is longer


def test_what_seemed_to_close_in_for_a_moment_only_is_not_carried_on():
    field, age = ground(1.0)
    memory = ClosingMemory(1.0)
    assert memory.update(coming((1.0, 0.5)), field, age, 0.05).any()
    assert not memory.update(NOBODY, field, age, 0.05).any()
    for _ in range(20):  # it has a rate, but stays: a wall seen while turning
        memory.update(np.array([[1.0, 0.5, -0.3, 0.2, 9.0]]), field, age, 0.05)
    assert not memory.update(NOBODY, field, age, 0.05).any()


def test_who_is_out_of_view_is_kept_in_mind_beside_who_comes_next():
    field, age = ground(1.0)
    memory = ClosingMemory(1.5)
    watched(memory, 20, 0.5)
    for tick in range(1, 11):
        told = memory.update(coming((4.0 - 0.04 * tick, -0.6)), field, age, 0.05)
    assert told[0, :3] == pytest.approx([0.6, 0.5, -0.8], abs=0.05)
    assert told[1, :2] == pytest.approx([3.6, -0.6], abs=0.1)
    assert (memory.begins == [False, False, True]).all()


def test_each_keeps_his_slot_in_whatever_order_they_are_seen():
    field, age = ground(1.0)
    memory = ClosingMemory(1.0)
    before = watched(memory, 20, 0.5, -0.6)
    after = memory.update(coming((0.96, -0.6), (0.96, 0.5)), field, age, 0.05)
    assert after[:, 1] == pytest.approx(before[:, 1], abs=0.01)
    assert not memory.begins[:2].any()


def test_of_what_is_not_sure_yet_the_nearest_counts():
    memory = ClosingMemory(1.0)
    assert (watched(memory, 1, 0.5, -0.6, 2.0)[:, 4] > 0.0).tolist() == [True, False, False]
    assert (watched(memory, 20, 0.5, -0.6, 2.0)[:, 4] > 0.0).all()


def test_when_all_slots_are_taken_who_was_not_seen_for_longest_makes_room():
    field, age = ground(1.0)
    memory = ClosingMemory(1.5)
    watched(memory, 20, 0.5, -0.6, 2.0)
    memory.update(coming((0.96, 0.5), (0.96, -0.6)), field, age, 0.05)
    told = memory.update(coming((5.0, 0.0)), field, age, 0.05)
    assert told[:2, 1] == pytest.approx([0.5, -0.6], abs=0.01)
    assert told[2, :2] == pytest.approx([5.0, 0.0])


def test_who_is_seen_where_another_must_be_is_that_one():
    """Two that were seen apart come together: no second one is left behind."""
    field, age = ground(1.0)
    memory = ClosingMemory(1.0)
    watched(memory, 20, 0.3, -0.3)
    told = memory.update(coming((0.96, 0.0)), field, age, 0.05)
    assert (told[:, 4] > 0.0).sum() == 1


def test_what_is_kept_goes_on_from_a_snapshot_and_does_not_grow():
    field, age = ground(1.0)
    memory, other = ClosingMemory(1.0), ClosingMemory(1.0)
    watched(memory, 20, 0.5, -0.6, 2.0)
    other.take(memory.state())
    seen = coming((0.96, 0.5))
    assert (memory.update(seen, field, age, 0.05) == other.update(seen, field, age, 0.05)).all()
    assert memory.state()["closing"].shape == (SLOTS, 10)


def test_boundaries_apart_are_found_apart_the_nearest_first():
    """At the first look the nearest counts; half a second later both do, each with his own velocity."""
    field = ArrivalField(PredictionSettings(), 0.12)
    for tick in range(12):
        t = 0.05 * tick
        belief = belief_of([Disc(1.4 - 0.6 * t, 0.9, 0.25, -0.6, 0.0), Disc(1.8, -1.2 + 0.7 * t, 0.25, 0.0, 0.7)], tick=tick)
        told = field.update(replace(belief, stamp_ns=round(1e9 * t))).closing
    near, far = told[0], told[1]
    assert np.hypot(*(near[:2] - far[:2])) > MOVER_M
    assert near[:2] == pytest.approx([1.4 - 0.6 * t, 0.9], abs=0.25)
    assert far[:2] == pytest.approx([1.8, -1.2 + 0.7 * t], abs=0.25)
    assert near[2] < -0.4 < far[2]
    assert far[3] > 0.4 > near[3]
    assert not told[2].any()
