"""The simulated IMU against the kinematics of motions in closed form, and its noise against its own settings."""

import math

import mujoco
import numpy as np
import pytest

from drivers.interface.devices import DeviceSetup
from drivers.interface.geometry import SE2
from sim_drivers.imu import ImuSettings, SimImu
from sim_drivers.imu_noise import ImuNoise, ImuNoiseSettings
from sim_drivers.scene import Scene
from sim_drivers.world import MujocoWorld, WorldSettings

GRAVITY = 9.81
SILENT = dict.fromkeys(
    (
        "gyro_noise_rad_s_sqrt_hz",
        "gyro_walk_rad_s2_sqrt_hz",
        "gyro_bias_rad_s",
        "gyro_resolution_rad_s",
        "accel_noise_m_s2_sqrt_hz",
        "accel_walk_m_s3_sqrt_hz",
        "accel_bias_m_s2",
        "accel_resolution_m_s2",
    ),
    0.0,
)


class Cart:
    """A 2 kg base that slides along the map's x, turns, pushed by a constant force."""

    max_step_s = 0.001
    period_ns = 1_000_000_000

    def __init__(self, speed_m_s=0.0, turn_rad_s=0.0, force_n=0.0):
        self.start, self.force_n = (speed_m_s, turn_rad_s), force_n

    def build(self, spec, base):
        base.add_joint(name="x", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
        base.add_joint(name="yaw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        base.mass, base.inertia, base.explicitinertial = 2.0, [0.1, 0.1, 0.1], True
        base.ipos, base.iquat = [0, 0, 0], [1, 0, 0, 0]

    def bind(self, world):
        world.data.qvel[:2] = self.start
        world.data.qfrc_applied[0] = self.force_n
        mujoco.mj_step1(world.model, world.data)

    def act(self, world):
        pass


def measured(seconds=0.5, cart=None, start=None, seed=1, **settings):
    world = MujocoWorld(Scene("test", start or SE2(), (), 60.0, ()), WorldSettings())
    if cart is not None:
        world.add(cart)
    imu = SimImu(ImuSettings(**settings), DeviceSetup("imu", seed, lambda: world.now_ns, world))
    world.compile()
    imu.open()
    world.step_to(round(seconds * 1e9))
    return imu.drain(), imu


def test_at_rest_it_feels_gravity_upwards():
    samples, _ = measured(noise=SILENT, latency_s=0.0, loss_probability=0.0)
    assert len(samples) == 100
    for sample in samples:
        assert sample.gyro_rad_s == (0.0, 0.0, 0.0)
        assert sample.accel_m_s2 == pytest.approx((0.0, 0.0, GRAVITY))


def test_turning_it_feels_the_centripetal_acceleration_of_its_place():
    turn, arm_m = 1.5, 0.3
    samples, _ = measured(cart=Cart(turn_rad_s=turn), noise=SILENT, x_m=arm_m)
    for sample in samples[1:]:
        assert sample.gyro_rad_s == pytest.approx((0.0, 0.0, turn))
        # The change of velocity over a sample is a chord; against base's axes at its end it leans by half the angle turned.
        lean = turn * 0.005 / 2
        expected = arm_m * turn**2 * np.array((-math.cos(lean), math.sin(lean)))
        np.testing.assert_allclose(sample.accel_m_s2[:2], expected, atol=1e-5)


def test_pushed_it_feels_the_push_along_its_own_axes():
    samples, _ = measured(cart=Cart(force_n=3.0), noise=SILENT, start=SE2(1.0, 2.0, math.pi / 2))
    for sample in samples[1:]:
        assert sample.accel_m_s2 == pytest.approx((1.5, 0.0, GRAVITY), abs=1e-6)  # the joint slides along base's own x


def test_it_comes_at_its_rate_late_and_in_order():
    samples, imu = measured(latency_s=0.01, loss_probability=0.0)
    stamps = [sample.stamp for sample in samples]
    assert [stamp.sequence for stamp in stamps] == list(range(98))
    assert [stamp.captured_ns for stamp in stamps] == [5_000_000 * k for k in range(1, 99)]
    assert {stamp.received_ns - stamp.captured_ns for stamp in stamps} == {10_000_000}
    assert imu.health().received == len(samples)


def test_a_ring_that_nobody_drains_overflows_and_says_so():
    samples, imu = measured(buffered_samples=10, latency_s=0.0, loss_probability=0.0)
    assert len(samples) == 10
    assert imu.health().overflowed == 90


def test_noise_is_as_dense_as_the_data_sheet_says():
    """White noise of a one-sided density d, sampled at 200 Hz, fills 100 Hz: its deviation is 10 d."""
    settings = ImuNoiseSettings(**{**SILENT, "gyro_noise_rad_s_sqrt_hz": 2.44e-4, "accel_noise_m_s2_sqrt_hz": 1.47e-3})
    noise = ImuNoise(settings, 200.0, 7, "imu")
    spoilt = np.array([noise.spoil(np.zeros(6), k) for k in range(10_000)])
    np.testing.assert_allclose(spoilt[:, :3].std(axis=0), 2.44e-3, rtol=0.03)
    np.testing.assert_allclose(spoilt[:, 3:].std(axis=0), 1.47e-2, rtol=0.03)


def test_the_bias_wanders_with_the_square_root_of_time():
    walk = 1e-3
    settings = ImuNoiseSettings(**{**SILENT, "gyro_walk_rad_s2_sqrt_hz": walk})
    ends = []
    for seed in range(200):
        noise = ImuNoise(settings, 50.0, seed, "imu")
        ends.append([noise.spoil(np.zeros(6), k) for k in range(200)][-1][:3])  # 4 s
    assert np.std(ends) == pytest.approx(walk * math.sqrt(4.0), rel=0.1)


def test_it_saturates_and_counts_in_whole_steps():
    settings = ImuNoiseSettings(**{**SILENT, "gyro_resolution_rad_s": 0.5, "gyro_range_rad_s": 2.0, "accel_range_m_s2": 5.0})
    spoilt = ImuNoise(settings, 200.0, 1, "imu").spoil(np.array((0.6, -0.8, 9.0, 1.23, -9.0, 0.0)), 0)
    assert spoilt.tolist() == pytest.approx([0.5, -1.0, 2.0, 1.23, -5.0, 0.0], abs=1e-12)


def test_what_is_not_a_number_is_not_hidden_by_saturation():
    truth = np.array((np.nan, 0.1, np.inf, 1.0, -np.inf, np.nan))
    spoilt = ImuNoise(ImuNoiseSettings(), 200.0, 1, "imu").spoil(truth, 0)
    assert np.isnan(spoilt).tolist() == [True, False, False, False, False, True]


def test_same_seed_same_samples():
    first, again, other = (measured(seed=seed)[0] for seed in (1, 1, 2))
    assert first == again
    assert first != other
