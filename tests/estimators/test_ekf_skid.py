"""A skid-steer base whose centres of rotation lie ahead in a fast turn: it moves sideways, and its wheels do not say so."""

import math

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.samples import Stamp, WheelSample
from estimators.odometry.ekf_settings import EkfSettings
from estimators.odometry.wheel_way import WheelModel
from tests.estimators.test_ekf_odometry import SKID, STILL, Drive, ekf, run, smooth

AHEAD_M, PUSH = 0.12, 1.02  # where the centres lie in the turn, and how much more than the way the wheels count there


class Skidding:
    """Wheels that know nothing of moving sideways, and turn a little more than the base is driven on in a turn."""

    wheel_count = SKID.wheel_count

    @staticmethod
    def wheel_rates(twist):
        return SKID.wheel_rates(BodyTwist((PUSH if twist.wz else 1.0) * twist.vx, 0.0, twist.wz))


def curves():
    """To the left and to the right, after a rest."""
    left, right = (smooth(BodyTwist(1.5, -AHEAD_M * wz, wz), hold_s=1.5) for wz in (2.0, -1.2))
    return STILL[:100] + left + right


def error_m(**skid):
    drive = Drive(Skidding(), curves(), bias=0.003, noise=0.002)
    return run(ekf(SKID, ekf=skid), drive)[-1].odom_from_base.distance(drive.poses[-1])


def test_what_skids_in_a_turn_is_left_to_the_inertial_unit():
    believed, left = error_m(), error_m(skid_along_std_m_per_rad=0.4, skid_across_std_m_per_rad=0.4)
    assert believed > 0.12
    assert left < 0.4 * believed


def way(twist, **skid):
    model = WheelModel(EkfSettings(**skid), SKID)
    rates = SKID.wheel_rates(twist)
    return model.way(np.zeros(SKID.wheel_count), WheelSample(Stamp(0, 0, 0), rates * 0.02, rates), 0.02)


@pytest.mark.parametrize("wz", [0.0, 0.5, -2.0])
def test_a_way_is_as_uncertain_as_it_turned(wz):
    twist = BodyTwist(1.0, 0.0, wz)
    held, skidding = way(twist), way(twist, skid_along_std_m_per_rad=0.13, skid_across_std_m_per_rad=0.3)
    added = np.diag(np.square((0.13 * wz * 0.02, 0.3 * wz * 0.02, 0.0)))
    assert np.allclose(skidding.grip - held.grip, added, rtol=1e-9, atol=1e-15)
    assert np.allclose(skidding.covariance - held.covariance, added, rtol=1e-9, atol=1e-15)
    assert np.array_equal(skidding.vector, held.vector)
    assert math.isclose(held.vector[2], wz * 0.02, abs_tol=1e-12)
