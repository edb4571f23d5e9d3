"""Tracks in the simulated hallway, with the camera's noise and the wheels' odometry, against the truth."""

import numpy as np
import pytest

from runtime.evaluations.perception import _matched, perception


@pytest.mark.parametrize(("memory", "seed"), [("rolling", 0), ("layers", 1)])
def test_walkers_in_the_hallway_are_tracked(memory, seed):
    figures = perception("dynamic_hallway", seed, ("world.walkers=3", f"estimator.memory.kind={memory}")).tracks
    assert figures.looks > 15
    assert figures.missed <= 0.02 * figures.looks
    assert figures.position_rms_m <= 0.12
    assert figures.velocity_rms_m_s <= 0.2
    assert figures.switches == 0
    assert figures.phantoms_per_tick < 0.05


def test_tracks_are_matched_one_to_one_and_none_from_afar():
    """The second obstacle is nearest to the first track too, but that one is needed elsewhere."""
    assert _matched(np.array([[0.1, 0.6], [0.05, 0.2], [0.9, 0.7]])) == {0: 0, 1: 1}
    assert _matched(np.zeros((2, 0))) == {}
