"""The standard estimator as a whole: what a belief says, with every device missing in turn, on bad frames, restored."""

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2, SE3
from drivers.interface.kinematics import OmniThreeWheel
from drivers.interface.samples import JointSample, ObstacleTruth, RangeScan, Stamp, TruthSample
from drivers.interface.seeds import stream
from estimators.belief import FREE, OCCUPIED, UNKNOWN, EstimatorFault
from estimators.estimator import Estimator, EstimatorSetup
from estimators.standard import StandardEstimator, StandardSettings
from tests.estimators.scenes import MS, Floor, Pillar, Wall, frame, sensed, wheels

OMNI = OmniThreeWheel.symmetric(wheel_radius_m=0.05, wheel_distance_m=0.1)
START = SE2(2.0, -1.0, 0.6)
TICK_NS, FRAME_TICKS, LATENCY_NS = 50 * MS, 2, 40 * MS
INVALID = (EstimatorFault.INVALID_INPUT,)


def build(kinematics=OMNI, **settings):
    setup = EstimatorSetup(period_s=0.05, robot_radius_m=0.12, map_from_start=START, kinematics=kinematics)
    return StandardEstimator(StandardSettings(**settings), setup)


def pose_at(time_ns, twist):
    return SE2().integrate(twist.vx, twist.vy, twist.wz, time_ns * 1e-9)


def drive(twist, solids, ticks, noise=0.0):
    """The inputs of a drive at a constant twist: wheels every 10 ms, a late frame every other tick."""
    rates = OMNI.wheel_rates(twist)
    random = stream(3, "depth")

    def spoil(depth):
        return depth * (1.0 + noise * random.normal(size=depth.shape))

    for index in range(ticks):
        now = index * TICK_NS
        times = range(max(0, now - 40 * MS), now + 1, 10 * MS)
        captured = now - LATENCY_NS
        depth = None
        if index % FRAME_TICKS == 0 and captured >= 0:
            depth = frame(solids(captured), pose_at(captured, twist), captured_ns=captured, spoil=spoil)
        yield sensed(now, index, base=[wheels(t, rates * t * 1e-9, rates) for t in times], depth=depth)


def at(belief, x, y):
    grid = belief.grid
    return grid.label[grid.lattice.cell_of(np.array([[x, y]]))][0]


def hall(_time_ns=0):
    return [Floor(), Wall(math.pi / 2, 0.82), Wall(-math.pi / 2, 0.82), Pillar(2.0, 0.3, 0.1)]


def test_it_stands_behind_the_contract():
    assert isinstance(build(), Estimator)
    with pytest.raises(ValidationError):
        StandardSettings(pose="gps")


def test_a_first_belief_knows_only_the_ground_under_the_robot():
    belief = build().update(sensed(0))
    assert belief.odom_from_base == SE2()
    assert belief.map_from_odom == START
    assert at(belief, 0.0, 0.0) == FREE
    assert (belief.grid.label == FREE).sum() < 30
    assert not (belief.grid.label == OCCUPIED).any()
    assert (belief.clearance.clearance_m == np.float32(6.0)).all()
    assert not belief.clearance.overlap.any()
    assert belief.oldest_input_ns == belief.stamp_ns == 0


def test_a_drive_down_a_hall():
    twist, estimator = BodyTwist(0.5, 0.05, 0.1), build()
    for inputs in drive(twist, hall, 41):
        belief = estimator.update(inputs)
    assert belief.faults == ()
    assert belief.odom_from_base.distance(pose_at(2000 * MS, twist)) < 1e-6
    assert belief.twist.vx == pytest.approx(0.5)
    assert at(belief, 1.91, 0.3) == OCCUPIED
    assert at(belief, 2.5, 0.82) == OCCUPIED
    assert at(belief, 2.5, -0.4) == FREE
    assert at(belief, 0.5, 0.0) == FREE  # behind it by now
    assert belief.oldest_input_ns == 2000 * MS - LATENCY_NS
    row, column = belief.grid.lattice.cell_of(np.array([[1.5, 0.3]]))
    assert belief.clearance.clearance_m[row[0], column[0]] == pytest.approx(0.4, abs=0.06)


def test_past_static_things_hardly_anything_seems_to_move():
    """Points of a surface fall into the next cell now and then; that is all that is left of ego-motion."""
    estimator, rates = build(), []
    for inputs in drive(BodyTwist(0.5, 0.0, 0.2), hall, 41):
        field = estimator.update(inputs).clearance
        rates.append(np.abs(field.rate_m_s[field.overlap & (field.clearance_m < 1.0)]))
    assert np.mean(np.concatenate(rates[8:])) < 0.02


def test_what_comes_closer_does_so_at_its_speed():
    estimator, speed = build(), 0.6

    def approaching(time_ns):
        return [Floor(), Pillar(2.3 - speed * time_ns * 1e-9, 0.0, 0.15), Wall(0.0, 4.0)]

    for inputs in drive(BodyTwist(), approaching, 41):
        belief = estimator.update(inputs)
    front = 2.3 - speed * 1.96 - 0.15
    row, column = belief.grid.lattice.cell_of(np.array([[front - 0.4, 0.0]]))
    assert belief.clearance.rate_m_s[row[0], column[0]] == pytest.approx(-speed, abs=0.25)


def test_turning_fast_with_a_late_camera_smears_nothing():
    twist, estimator = BodyTwist(0.0, 0.0, 1.2), build()
    solids = [Pillar(1.5 * math.cos(a), 1.5 * math.sin(a), 0.1) for a in (0.3, 1.2, 2.1)]
    for inputs in drive(twist, lambda _: solids, 31):
        belief = estimator.update(inputs)
    rows, columns = np.nonzero(belief.grid.label == OCCUPIED)
    centres = belief.grid.lattice.centres(rows, columns)
    off = np.min([np.abs(np.hypot(*(centres - [p.x_m, p.y_m]).T) - 0.1) for p in solids], axis=0)
    assert off.max() < 0.06


def test_between_frames_the_field_is_the_same_object():
    estimator = build()
    beliefs = [estimator.update(inputs) for inputs in drive(BodyTwist(0.3, 0.0, 0.0), hall, 7)]
    assert beliefs[3].clearance is beliefs[2].clearance
    assert beliefs[3].grid is beliefs[2].grid
    assert beliefs[4].clearance is not beliefs[3].clearance
    assert beliefs[4].odom_from_base.x > beliefs[3].odom_from_base.x > beliefs[2].odom_from_base.x


def arrays_of(value):
    if isinstance(value, np.ndarray):
        yield value
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from arrays_of(getattr(value, field.name))


def test_beliefs_share_no_array_that_can_change():
    estimator = build()
    inputs = list(drive(BodyTwist(0.3, 0.0, 0.0), hall, 9))
    beliefs = [estimator.update(one) for one in inputs]
    kept = [[array.copy() for array in arrays_of(belief)] for belief in beliefs]
    for one in inputs[3:]:
        later = replace(one.tick, start_ns=one.tick.start_ns + 10**9)
        estimator.update(replace(one, tick=later))
    for belief, copies in zip(beliefs, kept, strict=True):
        for array, copy in zip(arrays_of(belief), copies, strict=True):
            assert not array.flags.writeable
            np.testing.assert_array_equal(array, copy)


def test_depth_alone_stands_still():
    estimator = build(kinematics=None)
    for inputs in drive(BodyTwist(), hall, 9):
        belief = estimator.update(replace(inputs, base=()))
    assert belief.faults == ()
    assert belief.odom_from_base == SE2()
    assert at(belief, 1.91, 0.3) == OCCUPIED


def test_wheels_alone_drive_out_of_the_first_window():
    estimator, twist = build(), BodyTwist(1.0, 0.0, 0.0)
    for inputs in drive(twist, hall, 101):
        belief = estimator.update(replace(inputs, depth=None))
    assert belief.odom_from_base.x == pytest.approx(5.0)
    lattice = belief.grid.lattice
    assert lattice.x_m + 1.0 < 5.0 < lattice.x_m + lattice.columns * lattice.cell_m - 1.0
    assert belief.oldest_input_ns == 5000 * MS
    assert belief.clearance.lattice == lattice


@pytest.mark.parametrize(
    "spoil",
    [
        lambda f: replace(f, base_from_optical=SE3(x=math.nan)),
        lambda f: replace(f, depth=f.depth[:40]),
        lambda f: replace(f, depth=f.depth.astype(np.float64)),
        lambda f: replace(f, intrinsics=replace(f.intrinsics, fx=math.nan)),
        lambda f: replace(f, depth_unit_m=-0.001),
        lambda f: replace(f, stamp=Stamp(-(10**9), 0, 0)),
        lambda f: replace(f, stamp=Stamp(10**12, 0, 0)),
    ],
)
def test_a_bad_frame_is_dropped_and_flagged(spoil):
    estimator = build()
    inputs = list(drive(BodyTwist(), hall, 8))
    before = [estimator.update(one) for one in inputs[:6]][-1]
    bad = estimator.update(replace(inputs[6], depth=spoil(inputs[6].depth)))
    assert bad.faults == INVALID
    assert bad.grid is before.grid
    assert estimator.update(inputs[7]).faults == ()


@pytest.mark.parametrize("value", [0, 65535])
def test_a_frame_that_knows_nothing_changes_nothing(value):
    estimator = build()
    inputs = list(drive(BodyTwist(), hall, 7))
    before = [estimator.update(one) for one in inputs[:6]][-1]
    depth = inputs[6].depth
    after = estimator.update(replace(inputs[6], depth=replace(depth, depth=np.full_like(depth.depth, value))))
    assert after.faults == ()
    np.testing.assert_array_equal(after.grid.label, before.grid.label)


def test_another_resolution_is_taken_with_its_own_intrinsics():
    estimator = build()
    inputs = list(drive(BodyTwist(), hall, 7))
    for one in inputs[:6]:
        estimator.update(one)
    k = replace(inputs[6].depth.intrinsics, width=80, height=45, fx=41.0, fy=41.0, cx=40.2, cy=22.1)
    coarse = frame(hall(), k=k, captured_ns=260 * MS)
    belief = estimator.update(replace(inputs[6], depth=coarse))
    assert belief.faults == ()
    assert at(belief, 1.91, 0.3) == OCCUPIED


def test_truth_as_pose_and_tracks():
    estimator = build(pose="truth", tracks="truth")
    walker = ObstacleTruth("walker", START @ SE2(2.0, 1.0, 0.3), (0.5 * math.cos(0.6), 0.5 * math.sin(0.6)), 0.15)
    truth = TruthSample(Stamp(0, 0, 0), START @ SE2(0.4, 0.2, 0.1), BodyTwist(0.1, 0.0, 0.0), (walker,), 1.0, ())
    belief = estimator.update(sensed(0, truth=truth))
    assert (belief.odom_from_base.x, belief.odom_from_base.y) == pytest.approx((0.4, 0.2))
    assert belief.map_from_base.distance(truth.map_from_base) < 1e-9
    track = belief.tracks[0]
    assert track.position_in_odom == pytest.approx((2.0, 1.0))
    assert track.velocity_in_odom == pytest.approx((0.5, 0.0))
    assert (track.identity, track.radius_m) == (0, 0.15)
    assert build(pose="truth").update(sensed(0, truth=truth)).tracks == ()


def test_scans_instead_of_depth():
    estimator = build(source="scan")
    ranges = np.where(np.abs(np.linspace(-1.5, 1.5, 301)) < 0.2, 1.0, np.inf)
    scan = RangeScan(Stamp(0, 0, 0), -1.5, 0.01, ranges, 4.0)
    belief = estimator.update(sensed(0, scans=[scan], depth=frame(hall())))
    assert at(belief, 1.0, 0.0) == OCCUPIED
    assert at(belief, 0.5, 1.0) == FREE
    assert at(belief, 1.3, 0.0) == UNKNOWN
    broken = replace(scan, stamp=Stamp(10 * MS, 0, 1), angle_step_rad=math.nan)
    assert estimator.update(sensed(50 * MS, scans=[broken])).faults == INVALID


def test_joints_are_handed_through_and_count_as_input():
    estimator = build()
    joints = JointSample(Stamp(10 * MS, 11 * MS, 5), *(np.arange(7.0) + i for i in range(3)))
    assert estimator.update(sensed(50 * MS, joints=[joints])).joints is joints
    later = estimator.update(sensed(100 * MS))
    assert later.joints is joints
    assert later.oldest_input_ns == 10 * MS
    other = build()
    other.restore(estimator.snapshot())
    restored = other.update(sensed(150 * MS)).joints
    assert restored.stamp == joints.stamp
    np.testing.assert_array_equal(restored.torque_nm, joints.torque_nm)


def assert_same(one, other):
    for field in dataclasses.fields(one):
        if dataclasses.is_dataclass(getattr(one, field.name)):
            assert_same(getattr(one, field.name), getattr(other, field.name))
        else:
            np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))


@pytest.mark.parametrize("cut", [0, 1, 7, 12])
def test_restored_it_goes_on_identically(cut):
    inputs = list(drive(BodyTwist(0.5, 0.1, 0.4), hall, 24, noise=0.01))
    first, second = build(), build()
    for one in inputs[:cut]:
        first.update(one)
    second.restore(first.snapshot())
    for one in inputs[cut:]:
        assert_same(first.update(one), second.update(one))
    assert first.snapshot() == second.snapshot()


def test_warming_up_changes_nothing():
    warm, cold = build(), build()
    warm.warm_up()
    assert warm.snapshot() == cold.snapshot()
