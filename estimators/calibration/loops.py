"""A recording of loops, cut where the base stood on the mark that each of them begins and ends on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from drivers.interface.errors import ConfigurationError
from drivers.interface.kinematics import WheelKinematics
from drivers.interface.samples import ImuSample, WheelSample
from estimators.belief import F64
from estimators.calibration.drive import Drive, References, drive_from, in_order, require

MARK_S = 4.0  # a base that stands for so long stands on the mark
STILL_RAD = 0.01  # wheels that turn no further stand, counting jitters included
LEAST_WAY_RAD = 1.0  # of a wheel: less is no loop
LEAST_TURN_RAD = math.pi  # to either side: less does not tell the track from the wheels' ratio
SPAN_S = 0.5  # turns are counted over so much time, so that jitter does not count


def loops_of(wheels: Iterable[WheelSample], imu: Iterable[ImuSample], kinematics: WheelKinematics) -> list[Drive]:
    """Return the loops of a recording that begins and ends on the mark, and stands there for `MARK_S` between two loops.

    Each loop's true turn is the whole number of turns that is nearest to what the wheels say.

    Raises:
        ConfigurationError: there are too few samples of wheels.
    """
    wheels, imu = in_order(wheels), in_order(imu)
    require(len(wheels), "wheel samples")
    times_ns = [sample.stamp.captured_ns for sample in wheels]
    cuts_ns = [times_ns[0], *_stands(wheels), times_ns[-1]]
    loops = []
    for start_ns, end_ns in pairwise(cuts_ns):
        part = [sample for sample in wheels if start_ns <= sample.stamp.captured_ns <= end_ns]
        if np.ptp([sample.position_rad for sample in part], axis=0).max() > LEAST_WAY_RAD:
            gyro = (sample for sample in imu if start_ns <= sample.stamp.captured_ns <= end_ns)
            loops.append(drive_from(part, gyro, _on_the_mark(part, kinematics)))
    return loops


def require_both_senses(loops: Sequence[Drive], kinematics: WheelKinematics) -> None:
    """Check that the loops turn to the left and to the right, all turns of a base counted.

    Raises:
        ConfigurationError: they turn to one side only, which does not tell the track from the wheels' ratio.
    """
    turns = np.concatenate([_turns(loop, kinematics) for loop in loops]) if loops else np.zeros(1)
    if min(turns[turns > 0.0].sum(), -turns[turns < 0.0].sum()) < LEAST_TURN_RAD:
        raise ConfigurationError(
            "calibration: loops in one sense do not determine wheels, track and gyro apart; drive as many to the other side"
        )


def _turns(loop: Drive, kinematics: WheelKinematics) -> F64:
    """Return how far the base turns in each span of time."""
    at_s = np.arange(loop.wheel_s[0], loop.wheel_s[-1], SPAN_S)
    angles = np.array([np.interp(at_s, loop.wheel_s, wheel) for wheel in loop.wheel_rad.T]).T
    return np.array([kinematics.twist(step).wz for step in np.diff(angles, axis=0)])


def _on_the_mark(wheels: list[WheelSample], kinematics: WheelKinematics) -> References:
    turned = kinematics.twist(wheels[-1].position_rad - wheels[0].position_rad).wz
    ends_s = np.array([wheels[0].stamp.captured_ns, wheels[-1].stamp.captured_ns]) * 1e-9
    return References(ends_s, np.array([(0.0, 0.0, 0.0), (0.0, 0.0, math.tau * round(turned / math.tau))]))


def _stands(wheels: list[WheelSample]) -> list[int]:
    """Return the middles [ns] of the times for which the wheels stood long enough, but for the last."""
    middles, first = [], wheels[0]
    for before, sample in pairwise(wheels):
        if np.abs(sample.position_rad - first.position_rad).max() > STILL_RAD:
            stood_ns = before.stamp.captured_ns - first.stamp.captured_ns
            if stood_ns >= MARK_S * 1e9:
                middles.append(first.stamp.captured_ns + stood_ns // 2)
            first = sample
    return middles
