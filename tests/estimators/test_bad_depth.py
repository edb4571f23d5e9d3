"""Depth that no camera should deliver: dropped with a named fault or harmless, never an exception, never NaN in a belief."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.interface.geometry import SE2
from drivers.interface.samples import Intrinsics, Stamp, frozen_array
from drivers.interface.seeds import stream
from estimators.belief import EstimatorFault
from estimators.estimator import EstimatorSetup
from estimators.standard import StandardEstimator, StandardSettings
from tests.estimators.scenes import MS, SMALL, Floor, Pillar, Wall, depth_image, frame, level_camera, sensed

TICK_NS = 50 * MS
SCENE = [Floor(), Pillar(1.2, 0.1, 0.2), Wall(0.0, 2.2)]
GOOD = frame(SCENE)
BELOW = frame(SCENE, base_from_optical=level_camera(-0.3))
COARSE = Intrinsics(80, 45, 41.0, 41.0, 40.2, 22.1)
FRONT_ENDS = [
    {"memory": {"kind": memory}, "depth": {"filtered": filtered}, "tracks": "grid"}
    for memory, filtered in product(("rolling", "layers"), (False, True))
]


def filled(value):
    return replace(GOOD, depth=frozen_array(np.full_like(GOOD.depth, value)))


def noise():
    random = stream(0, "noise")
    return replace(GOOD, depth=frozen_array(random.integers(0, 65_536, GOOD.depth.shape).astype(np.uint16)))


SOUND = {
    "good": GOOD,
    "zeros": filled(0),
    "saturated": filled(65_535),
    "nearest": filled(1),
    "noise": noise(),
    "coarse": replace(GOOD, depth=frozen_array(depth_image(SCENE, k=COARSE)), intrinsics=COARSE),
    "straight down": frame(SCENE, base_from_optical=level_camera(0.4, pitch_rad=1.5707963267948966)),
    "far away": replace(GOOD, depth_unit_m=1e6),
}
UNSOUND = {
    "below the ground": BELOW,
    "of another size than its intrinsics": replace(GOOD, depth=GOOD.depth[:45]),
    "empty": replace(GOOD, depth=np.zeros((0, 0), dtype=np.uint16), intrinsics=replace(SMALL, width=0, height=0)),
}
STAMPS_NS = {"now": 0, "late": -40 * MS, "repeated": None, "negative": -(10**12), "from the future": 10**10}


def build(front_end):
    return StandardEstimator(StandardSettings(**front_end), EstimatorSetup(0.05, 0.12, SE2(), None))


def fed(estimator, one, tick, captured_ns):
    """The belief after a frame at a tick."""
    return estimator.update(sensed(tick * TICK_NS, tick, depth=replace(one, stamp=Stamp(captured_ns, captured_ns, tick))))


def assert_sane(belief):
    for array in (belief.clearance.clearance_m, belief.clearance.rate_m_s, belief.covariance):
        assert np.isfinite(array).all()
    for track in belief.tracks:
        assert np.isfinite([*track.position_in_odom, *track.velocity_in_odom, track.radius_m]).all()
        assert np.isfinite(track.covariance).all()


@pytest.mark.parametrize("front_end", FRONT_ENDS)
@settings(max_examples=12)
@given(story=st.lists(st.tuples(st.sampled_from([*SOUND, *UNSOUND]), st.sampled_from(list(STAMPS_NS))), min_size=1, max_size=12))
def test_any_story_of_bad_frames_is_survived_and_each_is_named(front_end, story):
    estimator, newest_ns = build(front_end), None
    for tick, (kind, when) in enumerate(story, start=1):
        captured_ns = newest_ns or 0 if STAMPS_NS[when] is None else tick * TICK_NS + STAMPS_NS[when]
        belief = fed(estimator, (SOUND | UNSOUND)[kind], tick, captured_ns)
        assert_sane(belief)
        in_time = captured_ns <= tick * TICK_NS and (newest_ns is None or captured_ns > newest_ns)
        used = kind in SOUND and in_time
        assert belief.faults == (() if used else (EstimatorFault.INVALID_INPUT,))
        newest_ns = captured_ns if used else newest_ns


@pytest.mark.parametrize("front_end", FRONT_ENDS)
def test_what_was_dropped_leaves_no_trace(front_end):
    """With the bad frames in between, the grid is that of the good ones alone."""
    plain, disturbed = build(front_end), build(front_end)
    for tick in range(1, 7):
        expected = fed(plain, GOOD, tick, tick * TICK_NS)
        if tick > 1:
            fed(disturbed, GOOD, tick, (tick - 1) * TICK_NS)
            fed(disturbed, BELOW, tick, tick * TICK_NS)
        belief = fed(disturbed, GOOD, tick, tick * TICK_NS)
        np.testing.assert_array_equal(belief.grid.label, expected.grid.label)
        np.testing.assert_array_equal(belief.clearance.clearance_m, expected.clearance.clearance_m)
