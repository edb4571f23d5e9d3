import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2, SE3, wrap_angle

metres = st.floats(-50.0, 50.0)
angles = st.floats(-10.0, 10.0)
rates = st.floats(-3.0, 3.0)
poses = st.builds(lambda x, y, yaw: SE2(x, y, wrap_angle(yaw)), metres, metres, angles)
transforms = st.builds(SE3.from_euler, metres, metres, metres, angles, angles, angles)


def plane_matrix(pose: SE2) -> np.ndarray:
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return np.array([[c, -s, pose.x], [s, c, pose.y], [0.0, 0.0, 1.0]])


def space_matrix(transform: SE3) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = transform.rotation, transform.translation
    return matrix


@given(angles)
def test_a_wrapped_angle_is_the_same_direction_in_range(angle):
    wrapped = wrap_angle(angle)
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@given(poses, poses)
def test_se2_composition_is_the_product_of_matrices(a, b):
    np.testing.assert_allclose(plane_matrix(a @ b), plane_matrix(a) @ plane_matrix(b), atol=1e-9)


@given(poses)
def test_se2_inverse_is_the_inverse_matrix(a):
    np.testing.assert_allclose(plane_matrix(a.inverse()), np.linalg.inv(plane_matrix(a)), atol=1e-9)


@given(poses, st.lists(st.tuples(metres, metres), min_size=1, max_size=5))
def test_se2_apply_goes_there_and_back(a, points):
    points = np.array(points)  # (n, 2)
    there = a.apply(points)
    homogeneous = np.column_stack((points, np.ones(len(points))))
    np.testing.assert_allclose(there, (homogeneous @ plane_matrix(a).T)[:, :2], atol=1e-9)
    np.testing.assert_allclose(a.inverse().apply(there), points, atol=1e-9)
    np.testing.assert_array_equal(a.apply(points[0]), there[0])  # one point alone


@given(poses, rates, rates, rates, st.floats(0.0, 1.0))
def test_integrating_a_twist_is_the_limit_of_small_steps(start, vx, vy, wz, dt_s):
    end = start.integrate(vx, vy, wz, dt_s)
    steps = 2000
    heading = start.yaw + wz * (np.arange(steps) + 0.5) * dt_s / steps  # midpoints of the steps
    x = start.x + np.sum(vx * np.cos(heading) - vy * np.sin(heading)) * dt_s / steps
    y = start.y + np.sum(vx * np.sin(heading) + vy * np.cos(heading)) * dt_s / steps
    assert (end.x, end.y) == pytest.approx((x, y), abs=1e-6)
    assert wrap_angle(end.yaw - start.yaw - wz * dt_s) == pytest.approx(0.0, abs=1e-9)


@given(poses, rates, rates, st.floats(1e-12, 1e-6))
def test_integration_has_no_jump_where_turning_vanishes(start, vx, vy, wz):
    straight, turning = start.integrate(vx, vy, 0.0, 1.0), start.integrate(vx, vy, wz, 1.0)
    assert straight.distance(turning) < 5.0 * wz + 1e-9


@given(transforms, transforms)
def test_se3_composition_is_the_product_of_matrices(a, b):
    np.testing.assert_allclose(space_matrix(a @ b), space_matrix(a) @ space_matrix(b), atol=1e-8)


@given(transforms)
def test_se3_inverse_is_the_inverse_matrix_and_its_rotation_is_one(a):
    np.testing.assert_allclose(space_matrix(a.inverse()), np.linalg.inv(space_matrix(a)), atol=1e-8)
    np.testing.assert_allclose(a.rotation @ a.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(a.rotation) == pytest.approx(1.0)


@given(angles, angles, angles)
def test_euler_angles_turn_about_fixed_axes_x_then_y_then_z(roll, pitch, yaw):
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    rotation = SE3.from_euler(0.0, 0.0, 0.0, roll, pitch, yaw).rotation
    np.testing.assert_allclose(rotation, about_z @ about_y @ about_x, atol=1e-12)


@given(transforms, st.lists(st.tuples(metres, metres, metres), min_size=1, max_size=4))
def test_se3_apply_goes_there_and_back(a, points):
    points = np.array(points)  # (n, 3)
    np.testing.assert_allclose(a.inverse().apply(a.apply(points)), points, atol=1e-8)


def test_the_optical_frame_is_right_down_forward():
    right, down, forward = BODY_FROM_OPTICAL.apply(np.eye(3))
    np.testing.assert_allclose([right, down, forward], [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=1e-15)
