"""Markers by their projected corners: poses against the closed form, tracks through occlusion, false numbers, bad input."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2, SE3
from drivers.interface.samples import Intrinsics, MarkerSample, Stamp
from drivers.interface.seeds import stream
from estimators.tracks.marker_pose import marker_pose
from estimators.tracks.marker_settings import MarkerSettings
from estimators.tracks.marker_tracking import MarkerTracker

K = Intrinsics(848, 480, 434.27, 434.27, 431.77, 240.45)
SIDE_M, MS = 0.1, 1_000_000
SQUARE = 0.5 * SIDE_M * np.array([(-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)])
CAMERA = SE3(0.2, 0.0, 1.0) @ BODY_FROM_OPTICAL
TOWARDS_CAMERA = SE3.from_euler(0.0, 0.0, 0.0, math.pi / 2, 0.0, -math.pi / 2)  # upright, facing -x of base


def corners_of(optical_from_marker: SE3) -> np.ndarray:
    """To single precision, as the detector gives them (OpenCV's solver does not bear a square that is seen exactly head-on)."""
    x, y, z = optical_from_marker.apply(SQUARE).T
    exact = np.stack((K.fx * x / z + K.cx, K.fy * y / z + K.cy), axis=1)
    return exact + stream(1, "precision").uniform(-1e-4, 1e-4, (4, 2))


def sample(time_ms: int, places: dict[int, tuple[float, float]], sigma_px: float = 0.0) -> MarkerSample:
    """What a camera on base sees of upright markers at places in base."""
    rng = stream(1, "corners", time_ms)
    seen = [
        corners_of(CAMERA.inverse() @ SE3(x, y, 1.0) @ TOWARDS_CAMERA) + sigma_px * rng.standard_normal((4, 2))
        for x, y in places.values()
    ]
    stamp = Stamp(time_ms * MS, time_ms * MS, time_ms)
    return MarkerSample(stamp, tuple(places), np.array(seen).reshape(-1, 4, 2), K, CAMERA)


def still(_: int) -> SE2:
    return SE2()


def follow(
    tracker: MarkerTracker, places: Callable[[float], dict[int, tuple[float, float]]], times_ms: range, sigma_px: float = 0.2
) -> None:
    for time_ms in times_ms:
        assert tracker.update((sample(time_ms, places(time_ms / 1000), sigma_px),), time_ms * MS, still)


def settings(**changes: float) -> MarkerSettings:
    return MarkerSettings(**({"side_m": SIDE_M} | changes))


@pytest.mark.parametrize("tilt", [0.0, 0.4, -0.8])
@pytest.mark.parametrize("distance_m", [0.4, 1.0, 3.0])
def test_a_pose_from_true_corners_is_true(distance_m: float, tilt: float) -> None:
    truth = SE3.from_euler(0.1, -0.05, distance_m, math.pi, tilt, 0.3)
    found = marker_pose(corners_of(truth), SIDE_M, K, 0.3)
    assert found is not None
    assert found.position_m == pytest.approx(truth.translation, abs=2e-4 * distance_m)
    assert found.rotation == pytest.approx(truth.rotation, abs=0.01)
    assert found.residual_px < 1e-2


def test_the_covariance_is_that_of_many_noisy_looks() -> None:
    truth, rng = SE3.from_euler(0.1, 0.0, 1.2, math.pi, 0.5, 0.3), stream(3, "looks")
    poses = [marker_pose(corners_of(truth) + 0.3 * rng.standard_normal((4, 2)), SIDE_M, K, 0.3) for _ in range(400)]
    errors = np.array([pose.position_m - truth.translation for pose in poses if pose is not None])
    scatter = np.sqrt(np.diag(errors.T @ errors) / len(errors))
    exact = marker_pose(corners_of(truth), SIDE_M, K, 0.3)
    assert exact is not None
    assert scatter == pytest.approx(np.sqrt(np.diag(exact.covariance_m2)), rel=0.3)
    assert scatter[2] > 3.0 * scatter[0]  # farther or nearer is what a small square shows least


@pytest.mark.parametrize("corners", [np.zeros((4, 2)), np.array([(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (3.0, 3.0)])])
def test_no_square_has_no_pose(corners: np.ndarray) -> None:
    assert marker_pose(corners, SIDE_M, K, 0.3) is None


def test_a_track_has_place_velocity_and_an_honest_covariance() -> None:
    tracker = MarkerTracker(settings())
    follow(tracker, lambda t: {7: (1.5, -0.2 + 0.1 * t)}, range(0, 3000, 66))
    (track,) = tracker.tracks_at(2970 * MS)
    error = np.array([*track.position_in_odom, *track.velocity_in_odom]) - (1.5, -0.2 + 0.297, 0.0, 0.1)
    assert track.identity == 7
    assert np.abs(error[:2]).max() < 0.02
    assert np.abs(error[2:]).max() < 0.1
    assert error @ np.linalg.solve(track.covariance, error) < 18.5  # 99.9 % of four axes


def test_it_coasts_out_of_sight_ever_less_certain_and_dies() -> None:
    tracker = MarkerTracker(settings(coast_s=1.0))
    follow(tracker, lambda t: {7: (1.5, 0.2 * t)}, range(0, 2000, 66))
    seen_ms = 1980
    follow(tracker, lambda _: {}, range(2046, 2900, 66))
    (soon,), (late,) = tracker.tracks_at((seen_ms + 100) * MS), tracker.tracks_at((seen_ms + 990) * MS)
    assert late.position_in_odom[1] == pytest.approx(0.2 * (seen_ms + 990) / 1000, abs=0.08)
    assert np.linalg.det(late.covariance[:2, :2]) > np.linalg.det(soon.covariance[:2, :2])
    assert tracker.tracks_at((seen_ms + 1001) * MS) == ()
    follow(tracker, lambda t: {7: (1.5, 0.2 * t)}, range(4000, 4100, 66))
    assert [track.identity for track in tracker.tracks_at(4070 * MS)] == [7]


def test_two_that_cross_keep_their_numbers() -> None:
    tracker = MarkerTracker(settings())
    for time_ms in range(0, 4000, 66):
        t = time_ms / 1000
        follow(tracker, lambda t: {3: (1.5, -0.4 + 0.2 * t), 9: (1.7, 0.4 - 0.2 * t)}, range(time_ms, time_ms + 1))
        places = {track.identity: track.position_in_odom for track in tracker.tracks_at(time_ms * MS)}
        if time_ms > 500:
            assert places[3] == pytest.approx((1.5, -0.4 + 0.2 * t), abs=0.03)
            assert places[9] == pytest.approx((1.7, 0.4 - 0.2 * t), abs=0.03)


def test_it_is_given_out_only_once_seen_often_enough() -> None:
    tracker = MarkerTracker(settings(hits_min=3))
    for count, time_ms in enumerate((0, 66, 132), start=1):
        follow(tracker, lambda _: {1: (1.0, 0.0)}, range(time_ms, time_ms + 1))
        assert len(tracker.tracks_at(time_ms * MS)) == (count >= 3)


def test_a_misread_number_moves_no_track() -> None:
    tracker = MarkerTracker(settings())
    follow(tracker, lambda _: {1: (1.0, 0.0)}, range(0, 660, 66))
    follow(tracker, lambda _: {1: (2.0, 0.5)}, range(660, 661))
    assert tracker.tracks_at(660 * MS)[0].position_in_odom == pytest.approx((1.0, 0.0), abs=0.01)


def test_a_robot_that_moves_does_not_move_the_marker() -> None:
    tracker = MarkerTracker(settings())
    for time_ms in range(0, 1980, 66):
        odom_from_base = SE2(0.2 * time_ms / 1000, 0.1, 0.1 * time_ms / 1000)
        in_base = odom_from_base.inverse().apply(np.array([2.0, 0.3]))
        in_base_view = sample(time_ms, {5: (float(in_base[0]), float(in_base[1]))})
        assert tracker.update((in_base_view,), time_ms * MS, lambda _, pose=odom_from_base: pose)  # type: ignore[misc]
    (track,) = tracker.tracks_at(1914 * MS)
    assert track.position_in_odom == pytest.approx((2.0, 0.3), abs=0.005)
    assert math.hypot(*track.velocity_in_odom) < 0.02


def test_what_cannot_be_used_is_said_and_changes_nothing() -> None:
    tracker = MarkerTracker(settings())
    follow(tracker, lambda _: {1: (1.0, 0.0)}, range(0, 660, 66))
    before = tracker.snapshot()
    broken = sample(700, {1: (1.0, 0.0)})
    broken.corners_px[0, 0, 0] = math.nan
    for bad in (broken, sample(594, {1: (1.0, 0.0)}), sample(100, {}), sample(5000, {1: (1.0, 0.0)})):
        assert not tracker.update((bad,), 800 * MS, still)
        assert tracker.snapshot() == before


def test_a_number_that_is_seen_twice_is_nobodys() -> None:
    tracker, twice = MarkerTracker(settings(hits_min=1)), sample(0, {1: (1.0, 0.0), 2: (1.0, 0.3)})
    doubled = MarkerSample(twice.stamp, (1, 1), twice.corners_px, K, CAMERA)
    assert tracker.update((doubled,), 0, still)
    assert tracker.tracks_at(0) == ()
