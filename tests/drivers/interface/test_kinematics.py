import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interface.commands import BodyTwist
from drivers.interface.kinematics import OmniThreeWheel, SkidSteer

speeds = st.floats(-2.0, 2.0)
radii = st.floats(0.02, 0.3)
distances = st.floats(0.05, 0.8)


def omni(radius_m: float, distance_m: float, bearing_rad: float, errors: tuple[float, ...]) -> OmniThreeWheel:
    nominal = OmniThreeWheel.symmetric(radius_m, distance_m, bearing_rad)
    return OmniThreeWheel(nominal.wheel_radius_m, nominal.wheel_distance_m, nominal.wheel_bearing_rad, errors)


small = st.floats(-0.1, 0.1)
omnis = st.builds(omni, radii, distances, st.floats(-3.0, 3.0), st.tuples(small, small, small))
twists = st.builds(BodyTwist, speeds, speeds, speeds)


@given(omnis, twists)
def test_omni_twist_undoes_wheel_rates(base, twist):
    back = base.twist(base.wheel_rates(twist))
    assert (back.vx, back.vy, back.wz) == pytest.approx((twist.vx, twist.vy, twist.wz), abs=1e-9)


@given(omnis, twists)
def test_each_omni_wheel_rolls_as_fast_as_its_hub_moves_along_it(base, twist):
    for wheel, rate in enumerate(base.wheel_rates(twist)):
        bearing, distance = base.wheel_bearing_rad[wheel], base.wheel_distance_m[wheel]
        hub = np.array([distance * math.cos(bearing), distance * math.sin(bearing)])
        velocity = np.array([twist.vx, twist.vy]) + twist.wz * np.array([-hub[1], hub[0]])  # of a rigid body's point
        heading = bearing + math.pi / 2 + base.heading_error_rad[wheel]
        rolling = velocity @ np.array([math.cos(heading), math.sin(heading)])
        assert rate * base.wheel_radius_m[wheel] == pytest.approx(rolling, abs=1e-9)


def test_an_omni_base_turning_on_the_spot_turns_all_wheels_alike():
    rates = OmniThreeWheel.symmetric(0.05, 0.1).wheel_rates(BodyTwist(wz=1.0))
    np.testing.assert_allclose(rates, 2.0)


@given(radii, distances, st.sampled_from([2, 4]), speeds, speeds)
def test_skid_steer_twist_undoes_wheel_rates(radius_m, track_m, wheels, vx, wz):
    base = SkidSteer(radius_m, track_m, wheels)
    rates = base.wheel_rates(BodyTwist(vx, 0.0, wz))
    assert rates.shape == (base.wheel_count,)
    back = base.twist(rates)
    assert (back.vx, back.vy, back.wz) == pytest.approx((vx, 0.0, wz), abs=1e-9)


def test_a_skid_steer_turning_left_runs_its_right_wheels_forward():
    rates = SkidSteer(wheel_radius_m=0.1, effective_track_m=0.5).wheel_rates(BodyTwist(0.0, 0.0, 1.0))
    np.testing.assert_allclose(rates, [-2.5, 2.5, -2.5, 2.5])  # front left, front right, rear left, rear right


@given(st.tuples(speeds, speeds, speeds, speeds))
def test_a_skid_steer_whose_wheels_disagree_moves_by_least_squares(rates):
    base = SkidSteer(0.1, 0.5)
    matrix = np.stack([base.wheel_rates(BodyTwist(1.0)), base.wheel_rates(BodyTwist(wz=1.0))], axis=1)
    expected = np.linalg.lstsq(matrix, np.array(rates), rcond=None)[0]
    twist = base.twist(np.array(rates))
    assert (twist.vx, twist.wz) == pytest.approx(tuple(expected), abs=1e-9)


def test_a_skid_steer_refuses_to_go_sideways():
    with pytest.raises(ValueError, match=r"sideways: vy = 0\.1 m/s"):
        SkidSteer(0.1, 0.5).wheel_rates(BodyTwist(0.0, 0.1, 0.0))
