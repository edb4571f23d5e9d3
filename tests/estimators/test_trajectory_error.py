"""Trajectory errors: invariant to where a trajectory lies, right for what can be worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from estimators.odometry.trajectory_error import absolute_error_m, aligned, relative_error_m

TRUTH = np.cumsum(stream(0, "walk").standard_normal((60, 2)), axis=0)


@given(x=st.floats(-50.0, 50.0), y=st.floats(-50.0, 50.0), yaw=st.floats(-3.0, 3.0))
def test_where_a_trajectory_lies_is_no_error(x, y, yaw):
    moved = SE2(x, y, yaw).apply(TRUTH)
    assert absolute_error_m(moved, TRUTH) < 1e-9
    assert relative_error_m(moved, TRUTH, 3) < 1e-9


def test_a_mirrored_trajectory_is_not_turned_inside_out():
    mirrored = TRUTH * (1.0, -1.0)
    assert absolute_error_m(mirrored, TRUTH) > 1.0
    lengths = (np.linalg.norm(np.diff(points, axis=0), axis=1) for points in (aligned(mirrored, TRUTH), TRUTH))
    np.testing.assert_allclose(*lengths)


def test_scale_is_not_aligned_away():
    line = np.column_stack((np.linspace(-1.0, 1.0, 101), np.zeros(101)))
    assert absolute_error_m(1.1 * line, line) == pytest.approx(0.1 * math.sqrt(np.mean(line[:, 0] ** 2)))
    assert relative_error_m(1.1 * line, line, 50) == pytest.approx(0.1)


def test_alignment_is_the_best_there_is():
    noisy = TRUTH + 0.1 * stream(1, "noise").standard_normal(TRUTH.shape)
    least = absolute_error_m(noisy, TRUTH)
    found = aligned(noisy, TRUTH)
    for nudge in (SE2(0.01, 0.0, 0.0), SE2(0.0, 0.01, 0.0), SE2(0.0, 0.0, 0.002)):
        worse = math.sqrt(np.mean(np.sum((nudge.apply(found) - TRUTH) ** 2, axis=1)))
        assert worse > least
