"""Tracks against the truth of analytic scenes: where, how fast, how wide, and who is who."""

import math

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from drivers.interface.seeds import stream
from estimators.belief import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from estimators.grid.depth_grid import DepthGrid, DepthGridSettings
from estimators.grid.labelling import FrameLabels
from estimators.memory.memory import MemorySettings, memory_of
from estimators.memory.remembered import Remembered
from estimators.memory.rolling import lattice_around
from estimators.tracks.constant_velocity import ConstantVelocity, Motion, corrected, squared_distances
from estimators.tracks.segmentation import Disc, Surfaces, centred, segments, surfaces_of
from estimators.tracks.traces import Traces
from estimators.tracks.tracking import GridTracker, TrackingSettings
from tests.estimators.scenes import MS, Floor, Pillar, Wall, frame

CELL_M, RADIUS_M = 0.05, 0.12
FRAME_NS = 66 * MS
HALL = (Floor(), Wall(math.pi / 2, 1.6), Wall(-math.pi / 2, 1.6), Wall(0.0, 3.4))


class Scene:
    """Walkers, each (x, y, vx, vy, radius) from its start on, seen with a camera's noise from a robot on its way."""

    def __init__(self, *walkers, seed=0, robot=lambda _: SE2(), kind="rolling", **settings):
        self.walkers, self.robot, self.random = walkers, robot, stream(seed, "depth")
        self.front_end = DepthGrid(DepthGridSettings(), CELL_M)
        self.memory = memory_of(MemorySettings(kind=kind), CELL_M, RADIUS_M)
        self.tracker = GridTracker(TrackingSettings(**settings))
        self.step = 0

    @property
    def now_s(self):
        return self.step * FRAME_NS * 1e-9

    def place(self, walker, at_s):
        x, y, vx, vy, _ = walker
        return np.array([x + vx * at_s, y + vy * at_s])

    def see(self):
        """One more frame."""
        self.step += 1
        pose, stamp_ns = self.robot(self.now_s), self.step * FRAME_NS
        pillars = [Pillar(*self.place(walker, self.now_s), walker[4]) for walker in self.walkers]
        seen = self.front_end.label(frame([*HALL, *pillars], pose, captured_ns=stamp_ns, spoil=self.spoil), pose)
        self.memory.merge(seen, stamp_ns, pose)
        self.tracker.update(seen, self.memory.remembered, stamp_ns)
        return self.tracker.tracks_at(stamp_ns)

    def spoil(self, depth):
        spoilt = depth * (1.0 + 0.002 * np.minimum(depth, 9.0) * self.random.normal(size=depth.shape))
        return np.where(self.random.random(depth.shape) < 0.02, np.inf, spoilt)

    def nearest(self, tracks, walker):
        """The track nearest to a walker, and how far it is from him."""
        place = self.place(walker, self.now_s)
        return min(((float(np.hypot(*(place - track.position_in_odom))), track) for track in tracks), key=lambda pair: pair[0])


@pytest.mark.parametrize("kind", ["rolling", "layers"])
@pytest.mark.parametrize(
    ("walker", "robot"),
    [
        ((2.6, 0.3, -1.0, 0.0, 0.25), lambda _: SE2()),
        ((1.7, -1.1, 0.0, 0.8, 0.25), lambda _: SE2()),
        ((1.8, -0.6, 0.3, 0.5, 0.15), lambda t: SE2(0.3 * t, 0.0, 0.2 * math.sin(2.0 * t))),
    ],
    ids=["oncoming", "crossing", "the robot drives and turns"],
)
def test_a_walker_is_where_he_is_and_walks_as_he_walks(walker, robot, kind):
    scene, off_m, off_m_s = Scene(walker, robot=robot, kind=kind), [], []
    for _ in range(25):
        tracks = scene.see()
        if scene.now_s > 0.8:
            distance, track = scene.nearest(tracks, walker)
            assert track.identity == 0
            assert len(tracks) == 1
            assert track.radius_m == pytest.approx(walker[4], abs=0.06)
            off_m.append(distance)
            off_m_s.append(np.hypot(*np.subtract(track.velocity_in_odom, walker[2:4])))
    assert np.sqrt(np.mean(np.square(off_m))) < 0.06
    assert np.sqrt(np.mean(np.square(off_m_s))) < 0.2


def test_what_stands_still_is_no_track():
    scene = Scene((1.8, 0.4, 0.0, 0.0, 0.2), robot=lambda t: SE2(0.4 * t, 0.0, 0.15 * math.sin(2.0 * t)))
    assert [scene.see() for _ in range(40)] == [()] * 40


def test_the_covariance_says_how_far_off_it_is():
    """Squared Mahalanobis distances of four dimensions: their mean is 4, if the errors are as believed; less is caution."""
    squares = []
    for seed in range(6):
        walker = (2.4, 0.2 * seed - 0.5, -0.6, 0.1, 0.2)
        scene = Scene(walker, seed=seed)
        for _ in range(25):
            tracks = scene.see()
        _, track = scene.nearest(tracks, walker)
        error = np.concatenate(
            (scene.place(walker, scene.now_s) - track.position_in_odom, walker[2:4] - np.array(track.velocity_in_odom))
        )
        squares.append(error @ np.linalg.solve(track.covariance, error))
    assert np.mean(squares) < 4.0


@pytest.mark.parametrize("seed", range(10))
def test_two_who_cross_keep_their_identities(seed):
    """One passes behind the other and is hidden meanwhile."""
    random = stream(seed, "crossing")
    (near, far), (x_near, apart) = random.uniform(0.5, 1.1, 2), random.uniform([1.2, 0.52], [1.45, 0.65])
    meet_s = 1.3 / max(near, far)
    walkers = ((x_near, near * meet_s, 0.0, -near, 0.25), (x_near + apart, -far * meet_s, 0.0, far, 0.25))
    scene, identities = Scene(*walkers, seed=seed), (set(), set())
    for _ in range(round(2.0 * meet_s / (FRAME_NS * 1e-9))):
        tracks = scene.see()
        for walker, known in zip(walkers, identities, strict=True):
            if tracks and scene.nearest(tracks, walker)[0] < 0.3:
                known.add(scene.nearest(tracks, walker)[1].identity)
    assert [len(known) for known in identities] == [1, 1]
    assert not identities[0] & identities[1]


def test_walls_that_come_into_range_are_no_tracks_though_the_robot_is_a_little_off():
    """A robot that believes to go straight and turns slowly: walls slide through the cells."""
    scene = Scene()
    for step in range(90):
        true, scene.step = SE2(0.027 * step, 0.0, 0.0), step
        believed = SE2(true.x, -1e-4 * step, -0.012)
        seen = scene.front_end.label(frame(HALL, true, spoil=scene.spoil), believed)
        scene.memory.merge(seen, step * FRAME_NS, believed)
        scene.tracker.update(seen, scene.memory.remembered, step * FRAME_NS)
        assert scene.tracker.tracks_at(step * FRAME_NS) == ()


def test_out_of_sight_a_track_coasts_and_then_ends():
    walker = (1.5, 0.0, 0.0, 1.2, 0.2)
    scene = Scene(walker, coast_s=1.0)
    while scene.place(walker, scene.now_s)[1] < 1.3:
        tracks = scene.see()
    (track,) = tracks
    spread_m = track.covariance[0, 0]
    scene.walkers = ((9.0, 9.0, 0.0, 0.0, 0.2),)  # behind the wall
    scene.robot = lambda _: SE2(0.0, 0.0, -1.2)
    (coasting,) = scene.see()
    assert coasting.identity == track.identity
    assert coasting.position_in_odom[1] == pytest.approx(track.position_in_odom[1] + 1.2 * FRAME_NS * 1e-9, abs=0.02)
    assert coasting.covariance[0, 0] > spread_m
    assert [len(scene.see()) for _ in range(18)][-3:] == [0] * 3


def test_where_its_place_is_seen_free_a_track_ends_soon():
    scene = Scene((1.5, -0.6, 0.0, 0.8, 0.2), vanish_s=0.2)
    for _ in range(12):
        tracks = scene.see()
    assert len(tracks) == 1
    scene.walkers = ()
    assert [len(scene.see()) for _ in range(6)][-2:] == [0, 0]


def test_a_silent_camera_ends_tracks_too():
    scene = Scene((1.5, -0.6, 0.0, 0.8, 0.2), coast_s=1.0)
    for _ in range(12):
        scene.see()
    seen_ns = scene.step * FRAME_NS
    (later,) = scene.tracker.tracks_at(seen_ns + 500 * MS)
    assert later.position_in_odom[1] == pytest.approx(scene.place(scene.walkers[0], scene.now_s + 0.5)[1], abs=0.1)
    assert scene.tracker.tracks_at(seen_ns + 1001 * MS) == ()


def test_identities_are_given_once_and_tracks_come_in_their_order():
    walkers = ((1.4, -0.8, 0.0, 0.6, 0.15), (2.0, 0.9, 0.0, -0.6, 0.15))
    scene = Scene(*walkers)
    seen = [[track.identity for track in scene.see()] for _ in range(40)]
    assert seen[15] == [0, 1]
    assert all(identities == sorted(set(identities)) for identities in seen)


def test_restored_it_goes_on_identically():
    walkers = ((1.4, -0.8, 0.0, 0.6, 0.15), (2.0, 0.9, 0.0, -0.6, 0.15))
    first, second = Scene(*walkers), Scene(*walkers)
    for _ in range(15):
        first.see()
        second.see()
    second.tracker = GridTracker(TrackingSettings())
    second.tracker.restore(first.tracker.snapshot())
    for _ in range(15):
        ours, theirs = first.see(), second.see()
        assert [(t.identity, t.position_in_odom, t.velocity_in_odom, t.radius_m) for t in ours] == [
            (t.identity, t.position_in_odom, t.velocity_in_odom, t.radius_m) for t in theirs
        ]
    assert second.tracker.snapshot() == first.tracker.snapshot()


LATTICE = lattice_around(0.0, 0.0, CELL_M, 101, 101)


def surface(x, y, radius, sensor=(0.0, 0.0)):
    """The cells of a disc's edge that face the sensor."""
    angles = np.linspace(-math.pi, math.pi, 2000)
    edge = np.array([x, y]) + radius * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    facing = ((edge - [x, y]) * (np.array(sensor) - edge)).sum(axis=1) > 0.0
    mask = np.zeros((LATTICE.rows, LATTICE.columns), dtype=np.bool_)
    mask[LATTICE.cell_of(edge[facing])] = True
    return mask


def loose(cells, hidden=False):
    """All of the cells move; around them is free ground, but where nothing was seen."""
    label = np.where(cells, OCCUPIED, np.where(hidden, UNKNOWN, FREE)).astype(np.uint8)
    return Surfaces(LATTICE, label, cells, np.ones(cells.shape, dtype=np.bool_))


@pytest.mark.parametrize("radius", [0.1, 0.2, 0.35])
@pytest.mark.parametrize(("x", "y"), [(1.2, 0.1), (0.9, -1.1), (-1.8, 0.3)])
def test_a_disc_seen_from_one_side_is_found_with_its_radius(x, y, radius):
    (segment,) = segments(loose(surface(x, y, radius)), [], 3, 0.6)
    assert segment.disc.radius_m == pytest.approx(radius, abs=0.05)
    assert np.hypot(*(centred(segment, radius) - [x, y])) < 0.04


@pytest.mark.parametrize("shown_m", [0.1, 0.2, 0.3, 0.4, 0.5])
def test_however_much_of_it_is_hidden_a_disc_of_known_radius_is_where_its_own_side_puts_it(shown_m):
    """What shows is what lies to the right; a centre in the middle of that would be off by half of what does not."""
    cells, hidden = surface(1.5, 0.0, 0.3), np.zeros((LATTICE.rows, LATTICE.columns), dtype=np.bool_)
    hidden[math.floor((shown_m - 0.3 + 2.525) / CELL_M) :] = True
    (segment,) = segments(loose(cells & ~hidden, hidden), [], 2, 0.6)
    assert (segment.outline.right_own, segment.outline.left_own) == (True, False)
    assert abs(centred(segment, 0.3)[1]) < 0.06
    (seen_past,) = segments(loose(cells), [], 3, 0.6)
    assert (seen_past.outline.right_own, seen_past.outline.left_own) == (True, True)


@pytest.mark.parametrize("speed_m_s", [0.5, 0.9])
def test_who_comes_out_from_behind_something_walks_as_fast_as_he_walks(speed_m_s):
    """The side that comes first moves with him; the middle of what shows would move at half his speed."""
    ratios = []
    for seed in range(4):
        walker = (2.0, -0.7, 0.0, speed_m_s, 0.25)
        scene = Scene(walker, (1.0, -0.35, 0.0, 0.0, 0.25), seed=seed)  # he begins in the shadow of a pillar
        looks, tracks = 0, []
        while looks < 4:
            tracks = [track for track in scene.see() if track.velocity_in_odom[1] > 0.1]
            looks += len(tracks) > 0
        ratios.append(tracks[0].velocity_in_odom[1] / speed_m_s)
        assert scene.place(walker, scene.now_s)[1] < 0.0  # a part of him is still hidden
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.2)


def test_one_component_over_two_expected_discs_is_cut_between_them():
    cells = loose(surface(1.4, -0.2, 0.2) | surface(1.4, 0.2, 0.2))
    assert len(segments(cells, [], 3, 0.6)) == 1
    right, left = segments(cells, [Disc(1.4, -0.2, 0.2), Disc(1.4, 0.2, 0.2)], 3, 0.6)
    assert right.points[:, 1].max() <= left.points[:, 1].min()


def test_what_is_wide_or_tiny_is_no_obstacle_that_moves():
    assert segments(loose(surface(1.5, 0.0, 0.7)), [], 3, 0.6) == []
    assert segments(loose(surface(1.5, 0.0, 0.01)), [], 3, 0.6) == []


def test_what_touches_the_static_world_is_explained_by_it_and_what_hangs_together_with_it_is_no_new_obstacle():
    seen, known = (np.full((LATTICE.rows, LATTICE.columns), value, dtype=np.uint8) for value in (FREE, UNKNOWN))
    wall, end, other = slice(20, 30), slice(30, 36), slice(60, 64)
    seen[40, wall] = seen[40, end] = seen[40, other] = OCCUPIED
    known[40, wall] = known[40, end] = known[40, other] = OCCUPIED
    moving = np.zeros(seen.shape, dtype=np.bool_)
    moving[40, end] = moving[40, other] = True
    frame_labels = FrameLabels(OccupancyGrid(LATTICE, seen), np.zeros(seen.shape, dtype=np.bool_))
    ground = np.ones(seen.shape, dtype=np.bool_)
    surfaces = surfaces_of(frame_labels, Remembered(OccupancyGrid(LATTICE, known), moving, ground), Traces(), 0)
    assert np.flatnonzero(surfaces.unexplained[40]).tolist() == [*range(31, 36), *range(60, 64)]
    assert [(len(one.points), one.loose) for one in segments(surfaces, [], 3, 0.6)] == [(5, False), (4, True)]
    shut_in = surfaces_of(frame_labels, Remembered(OccupancyGrid(LATTICE, known), moving, ~ground), Traces(), 0)
    assert [one.loose for one in segments(shut_in, [], 3, 0.6)] == [False, False]
    behind = ground.copy()
    behind[41:] = False  # nobody has seen what lies behind the wall's end
    for known_free, is_loose in ((ground, True), (behind, False)):
        remembered = Remembered(OccupancyGrid(LATTICE, known), moving, known_free)
        end_first = segments(surfaces_of(frame_labels, remembered, Traces(), 0, clear_cells=2), [], 3, 0.6)[0]
        assert (len(end_first.points), end_first.loose) == (5, is_loose)


def test_constant_velocity_in_closed_form():
    """One stretch, one measurement: the gain is the ratio of variances, and the velocity learns through their covariance."""
    start = Motion(np.array([1.0, 2.0, 0.5, -0.5]), np.diag([0.04, 0.04, 1.0, 1.0]))
    carried = ConstantVelocity(0.1, 2.0).carry(start)
    np.testing.assert_allclose(carried.state, [1.05, 1.95, 0.5, -0.5])
    q = 4.0 * np.array([[0.1**4 / 4, 0.1**3 / 2], [0.1**3 / 2, 0.1**2]])
    prior = np.array([[0.04 + 0.01, 0.1], [0.1, 1.0]]) + q
    np.testing.assert_allclose(carried.covariance[::2, ::2], prior)
    np.testing.assert_allclose(carried.covariance[0::2, 1::2], 0.0)
    measured = corrected(carried, np.array([1.15, 1.95]), 0.01 * np.eye(2))
    gain = prior[:, 0] / (prior[0, 0] + 0.01)
    np.testing.assert_allclose(measured.state[[0, 2]], [1.05, 0.5] + gain * 0.1)
    np.testing.assert_allclose(measured.covariance[0, 0], prior[0, 0] * (1.0 - gain[0]))
    off = squared_distances([carried, carried], np.array([[1.15, 1.95], [1.05, 2.25]]), np.array([0.1, 0.2]))
    np.testing.assert_allclose(off, [0.01 / (prior[0, 0] + 0.01), 0.09 / (prior[0, 0] + 0.04)])
