"""Registration: known motions found again on walls of known place, corridors named, movers ignored, odom left alone."""

import math

import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.samples import RangeScan, Stamp
from drivers.interface.seeds import stream
from estimators.belief import EstimatorFault
from estimators.estimator import EstimatorSetup
from estimators.grid.depth_grid import DepthGridSettings
from estimators.grid.scan_grid import ScanGridSettings
from estimators.registration.registration import ScanRegistration, SurfaceSource
from estimators.registration.registration_settings import RegistrationSettings
from estimators.registration.slab_points import points_of_depth, points_of_scan
from estimators.standard import StandardEstimator, StandardSettings
from tests.estimators.scenes import MS, ORIGIN, SMALL, Floor, Pillar, Wall, frame, level_camera, sensed, wheels

SOURCE = SurfaceSource("depth", DepthGridSettings(), ScanGridSettings())
START = SE2(2.0, -1.0, 0.6)
FRAME_NS = 66 * MS
BEARINGS = np.linspace(-0.75, 0.75, 160)
CORRIDOR = (((-5.0, 1.2), (40.0, 1.2)), ((-5.0, -1.2), (40.0, -1.2)))
ROOM = (((-1.0, 1.2), (3.5, 1.2)), ((-1.0, -1.2), (3.5, -1.2)), ((3.5, -1.2), (3.5, 1.2)))
NO_SURFACE = np.empty((0, 2))
OMNI = OmniThreeWheel.symmetric(wheel_radius_m=0.05, wheel_distance_m=0.1)


def surface(walls, base, noise_m=0.0, seed=0, reach_m=5.0):
    """The nearest point on walls (pairs of ends in map) along each bearing, in the base at a pose in map; by Cramer's rule."""
    angle = base.yaw + BEARINGS
    ray = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    best = np.full(len(angle), np.inf)
    for start, end in walls:
        along, to = np.subtract(end, start), np.subtract(start, (base.x, base.y))
        with np.errstate(divide="ignore", invalid="ignore"):
            cross = ray[:, 0] * along[1] - ray[:, 1] * along[0]
            reach = (to[0] * along[1] - to[1] * along[0]) / cross
            share = (to[0] * ray[:, 1] - to[1] * ray[:, 0]) / cross
        best = np.where((reach > 0.0) & (share >= 0.0) & (share <= 1.0), np.minimum(best, reach), best)
    best = best + noise_m * stream(seed, "surface").normal(size=len(best))
    return np.stack((best * np.cos(BEARINGS), best * np.sin(BEARINGS)), axis=-1)[best <= reach_m]


def build(map_from_start=ORIGIN, **settings):
    return ScanRegistration(RegistrationSettings(enabled=True, **settings), SOURCE, map_from_start)


def map_from_base(registration, odom_from_base):
    return registration.map_from_odom @ odom_from_base


def follow(registration, walls, poses, drift, first=0, noise_m=0.0):
    """Register frames from true poses while odometry strays by `drift(k)`; return the believed poses."""
    believed = []
    for k, true in enumerate(poses, first):
        odom = drift(k) @ true
        registration.register(surface(walls, true, noise_m, k), odom, k * FRAME_NS)
        believed.append(map_from_base(registration, odom))
    return believed


def no_drift(_):
    return SE2()


def sideways(k):
    """An odometry that turns by 0.5 mrad and slips 1 mm to the left with each frame."""
    return SE2(0.0, 0.001 * k, 0.0005 * k)


@pytest.mark.parametrize("error", [SE2(0.05, 0.04, 0.03), SE2(-0.06, 0.03, -0.05), SE2(0.0, -0.08, 0.02)])
def test_a_known_transform_is_found_again(error):
    """In a room whose walls determine all three, with a prediction that is believed to be loose."""
    registration = build(drift_rad_per_sqrt_s=1.0, drift_per_sqrt_m=1.0, settle_frames=3)
    follow(registration, ROOM, [SE2()] * 4, no_drift)
    true = SE2(0.3, 0.1, 0.1)
    odom = true @ error
    for k in range(4, 12):  # the robot stands, so that what is left is the frames' word alone
        registration.register(surface(ROOM, true), odom, k * FRAME_NS)
    found = map_from_base(registration, odom)
    assert found.distance(true) < 1e-3
    assert abs(found.yaw - true.yaw) < 1e-3
    assert registration.latest.undetermined.shape == (0, 3)


def test_drift_across_a_corridor_is_corrected_over_all_its_length():
    """Against its own memory in odom no frame could see it: after 13 m, odometry is 3 m and 0.22 rad off."""
    registration = build()
    true = [SE2(0.03 * k, 0.1 * math.sin(0.02 * k), 0.05 * math.sin(0.03 * k)) for k in range(450)]
    believed = follow(registration, CORRIDOR, true, sideways, noise_m=0.01)
    assert (sideways(449) @ true[-1]).distance(true[-1]) > 2.0
    assert max(abs(pose.y - other.y) for pose, other in zip(believed, true, strict=True)) < 0.05
    assert max(abs(pose.yaw - other.yaw) for pose, other in zip(believed, true, strict=True)) < 0.01


def test_a_corridor_says_nothing_along_itself_and_that_is_reported():
    registration, slip = build(), 0.005
    poses = [SE2(0.03 * k, 0.0, 0.0) for k in range(60)]
    believed = follow(registration, CORRIDOR, poses, lambda k: SE2(slip * k, 0.0, 0.0))
    assert believed[-1].x - poses[-1].x == pytest.approx(59 * slip, abs=1e-6)
    assert believed[-1].y == pytest.approx(0.0, abs=1e-6)
    (direction,) = registration.latest.undetermined
    assert np.abs(direction) == pytest.approx([1.0, 0.0, 0.0], abs=1e-3)
    spread = np.sqrt(np.diag(registration.latest.covariance))
    assert spread[0] > 4.0 * spread[1]


def test_at_the_end_of_the_corridor_the_way_along_it_is_determined_again():
    registration = build()
    ended = (*CORRIDOR, ((6.0, -1.2), (6.0, 1.2)))
    poses = [SE2(0.03 * k, 0.0, 0.0) for k in range(110)]
    follow(registration, ended, poses[:20], no_drift)
    assert len(registration.latest.undetermined) == 1
    follow(registration, ended, poses[20:], no_drift, first=20)
    assert len(registration.latest.undetermined) == 0


def test_no_frame_turns_what_is_known_of_odom():
    """Corrections move map_from_odom alone: odometry's own poses come out of the estimator untouched."""
    runs = {enabled: drive(enabled) for enabled in (False, True)}
    assert [b.odom_from_base for b in runs[True]] == [b.odom_from_base for b in runs[False]]
    assert all(np.array_equal(a.grid.label, b.grid.label) for a, b in zip(runs[True], runs[False], strict=True))
    assert {b.map_from_odom for b in runs[False]} == {START}
    assert len({b.map_from_odom for b in runs[True]}) > 10


def test_the_estimator_corrects_a_base_that_slips_to_the_side():
    """Its wheels say straight ahead; it goes 0.05 m/s to the left."""
    last, off = drive(True, slip_m_s=0.05)[-1], drive(False, slip_m_s=0.05)[-1]
    true = START @ pose_at(2960 * MS, 0.05)
    across = [abs((START.inverse() @ b.map_from_base).y - (START.inverse() @ true).y) for b in (last, off)]
    assert across[0] < 0.02
    assert across[1] > 0.12


def test_a_walker_who_crosses_pulls_nothing():
    """Half the view is his as he goes by at 1 m, and the robot must stand where it stands."""
    registration, still = build(), SE2()
    follow(registration, CORRIDOR, [still] * 10, no_drift)
    for k in range(10, 60):
        seen = surface(CORRIDOR, still)
        registration.register(with_walker(seen, 1.0, 1.2 - 0.05 * (k - 10), 0.25), still, k * FRAME_NS)
        assert map_from_base(registration, still).distance(still) < 2e-3
        assert abs(map_from_base(registration, still).yaw) < 2e-3


def with_walker(seen, x, y, radius):
    """Replace what a disc hides by the disc's face, in closed form, and keep the order of the bearings."""
    bearing = np.arctan2(seen[:, 1], seen[:, 0])
    ray = np.stack((np.cos(bearing), np.sin(bearing)), axis=-1)
    along = ray @ (x, y)
    root = along**2 - (x * x + y * y - radius**2)
    face = along - np.sqrt(np.maximum(root, 0.0))
    hidden = (root > 0.0) & (face < np.hypot(*seen.T))
    return np.where(hidden[:, None], face[:, None] * ray, seen)


def test_a_door_that_swings_pulls_nothing():
    """A straight leaf of 1 m before the robot, turning by 1.5 degrees a frame, and starting while it is seen."""
    registration, still = build(), SE2()
    follow(registration, CORRIDOR, [still] * 10, no_drift)
    for k in range(10, 60):
        angle = math.radians(90.0 - 1.5 * (k - 10))
        leaf = ((2.5, -0.5), (2.5 + math.cos(angle), -0.5 + math.sin(angle)))
        registration.register(surface((*CORRIDOR, leaf), still), still, k * FRAME_NS)
        assert map_from_base(registration, still).distance(still) < 5e-3
        assert abs(map_from_base(registration, still).yaw) < 5e-3


def test_it_continues_identically_from_a_snapshot():
    poses = [SE2(0.03 * k, 0.0, 0.01 * math.sin(k)) for k in range(80)]
    one, other = build(START), build(START)
    follow(one, CORRIDOR, poses[:40], sideways, noise_m=0.01)
    other.restore(one.snapshot())
    assert other.latest.correction == one.latest.correction
    ways = [follow(each, CORRIDOR, poses[40:], sideways, first=40, noise_m=0.01) for each in (one, other)]
    assert ways[0] == ways[1]
    assert one.snapshot() == other.snapshot()


def test_nothing_seen_changes_nothing_and_is_reported():
    registration, odom = build(START), SE2(0.3, 0.1, 0.2)
    registration.register(NO_SURFACE, odom, FRAME_NS)
    assert map_from_base(registration, odom).distance(START @ odom) < 1e-12
    assert registration.latest.points == 0
    assert registration.latest.undetermined == pytest.approx(np.eye(3))
    assert np.isfinite(registration.latest.covariance).all()


def test_what_it_keeps_is_bounded():
    """A maze of new walls for ever: the size of a snapshot does not grow."""
    registration, sizes = build(lines_max=6), []
    for k in range(120):
        x = 0.5 * k
        walls = (((x + 1.0 + 0.1 * (k % 3), -1.0), (x + 1.5, 1.0)), ((x + 1.0, 1.1), (x + 3.0, 1.3 + 0.2 * (k % 2))))
        registration.register(surface(walls, SE2(x, 0.0, 0.0)), SE2(x, 0.0, 0.0), k * FRAME_NS)
        sizes.append(len(registration.snapshot()))
        assert np.isfinite((registration.map_from_odom.x, registration.map_from_odom.y, registration.map_from_odom.yaw)).all()
    assert max(sizes) == max(sizes[:30])


def test_late_repeated_and_empty_frames_are_survived():
    estimator = standard(True)
    zeros = frame([], captured_ns=100 * MS)
    for index, depth in enumerate((hall(0), None, zeros, hall(50 * MS), zeros, hall(10_000 * MS), hall(300 * MS))):
        belief = estimator.update(sensed(index * 60 * MS, index, depth=depth))
        assert np.isfinite((belief.map_from_odom.x, belief.map_from_odom.y, belief.map_from_odom.yaw)).all()
        assert (belief.faults == (EstimatorFault.INVALID_INPUT,)) == (index in (3, 4, 5))
    assert belief.registration.captured_ns == 300 * MS


def test_points_of_a_depth_image_lie_on_the_wall():
    """Whichever way the camera leans; the wall stands 2 m before the camera's foot, across."""
    for camera in (level_camera(), level_camera(pitch_rad=0.15, x_m=0.1), level_camera(roll_rad=0.05)):
        points = points_of_depth(frame([Wall(0.0, 2.0), Floor()], base_from_optical=camera), DepthGridSettings(), 5.0, 80)
        assert len(points) == 80
        assert points[:, 0] == pytest.approx(np.full(80, 2.0), abs=2e-3)
        assert (np.diff(points[:, 1]) > 0.0).all()


def test_points_of_a_scan_are_its_valid_returns():
    scan = RangeScan(Stamp(0, 0, 0), 0.0, math.pi / 2, np.array([1.0, math.nan, math.inf, 2.0, 0.01, 9.0]), 8.0)
    assert points_of_scan(scan, 0.05, 5.0) == pytest.approx(np.array([[1.0, 0.0], [0.0, -2.0]]), abs=1e-12)


def test_a_range_scan_does_as_well():
    estimator = standard(True, source="scan")
    for k in range(20):
        points = surface(ROOM, SE2())
        reach = np.hypot(*points.T)
        scan = RangeScan(Stamp(k * 50 * MS, k * 50 * MS, k), float(BEARINGS[0]), float(BEARINGS[1] - BEARINGS[0]), reach, 8.0)
        belief = estimator.update(sensed(k * 50 * MS, k, scans=[scan]))
    assert belief.registration.points > 50
    assert belief.map_from_odom.distance(START) < 1e-3


def standard(enabled, **settings):
    setup = EstimatorSetup(period_s=0.05, robot_radius_m=0.12, map_from_start=START, kinematics=OMNI)
    return StandardEstimator(StandardSettings(registration={"enabled": enabled}, **settings), setup)


def hall(captured_ns, pose=ORIGIN):
    solids = [Floor(), Wall(math.pi / 2, 1.0), Wall(-math.pi / 2, 1.0), Pillar(3.0, 0.3, 0.1)]
    return frame(solids, pose, captured_ns=captured_ns, k=SMALL)


def pose_at(time_ns, slip_m_s):
    return SE2().integrate(0.4, slip_m_s, 0.0, time_ns * 1e-9)


def drive(enabled, ticks=60, slip_m_s=0.02):
    """Beliefs on a way down a hall whose wheels do not tell of the slip; the last frame is 40 ms old."""
    estimator, rates, beliefs = standard(enabled), OMNI.wheel_rates(BodyTwist(0.4, 0.0, 0.0)), []
    for index in range(ticks):
        now = index * 50 * MS
        base = [wheels(t, rates * t * 1e-9, rates) for t in range(max(0, now - 40 * MS), now + 1, 10 * MS)]
        beliefs.append(estimator.update(sensed(now, index, base=base, depth=hall(now, pose_at(now, slip_m_s)))))
    return beliefs
