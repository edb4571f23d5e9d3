import itertools
import math

import numpy as np
import pytest

from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal, Mission
from estimators.belief import UNKNOWN, Lattice
from planners.polyline import arc_length
from planners.router import RouterSetup
from planners.routers.grid import GridRouter
from planners.routers.grid_kernels import pull_straight, segment_cost
from planners.routers.grid_search import cheapest, way_to
from planners.routers.straight import StraightRouter
from planners.routers.window import around, remainder_outside, ring
from tests.planners.synthetic import Box, Disc, belief_of, mission_to


def router_of(**settings):
    router = GridRouter(GridRouter.Settings(**settings), RouterSetup(0.05, 0.12))
    router.warm_up()
    return router


def relaxed_until_still(cost, start):
    """Cheapest cost to every cell by plain relaxation."""
    rows, columns = cost.shape
    best = np.full(cost.shape, np.inf)
    best[start] = 0.0
    steps = [(r, c) for r, c in itertools.product((-1, 0, 1), repeat=2) if (r, c) != (0, 0)]
    changed = True
    while changed:
        changed = False
        for row, column in itertools.product(range(rows), range(columns)):
            for r, c in steps:
                if 0 <= row + r < rows and 0 <= column + c < columns and math.isfinite(cost[row, column]):
                    edge = 0.1 * math.hypot(r, c) * 0.5 * (cost[row, column] + cost[row + r, column + c])
                    if best[row + r, column + c] + edge < best[row, column] - 1e-12:
                        best[row, column] = best[row + r, column + c] + edge
                        changed = True
    return best


@pytest.mark.parametrize("seed", range(8))
def test_search_agrees_with_plain_relaxation(seed):
    rng = np.random.default_rng(seed)
    rows, columns = int(rng.integers(2, 9)), int(rng.integers(2, 9))
    cost = rng.uniform(1.0, 5.0, (rows, columns))
    cost[rng.random(cost.shape) < 0.3] = np.inf
    cost[0, 0] = 1.0
    reached = cheapest(cost, (0, 0), 0.1)
    assert reached == pytest.approx(relaxed_until_still(cost, (0, 0)))
    target = tuple(np.argwhere(np.isfinite(reached))[-1].tolist())
    path = way_to(target, reached, cost, 0.1)
    assert tuple(path[0]) == (0, 0)
    assert tuple(path[-1]) == target
    steps = np.diff(path, axis=0)
    assert (np.abs(steps).max(axis=1) == 1).all()
    prices = cost[tuple(path.T)]
    total = np.sum(0.1 * np.hypot(*steps.T) * 0.5 * (prices[:-1] + prices[1:]))
    assert total == pytest.approx(reached[target])


def test_there_is_no_way_back_from_what_is_not_reached():
    cost = np.ones((5, 5))
    cost[:, 2] = np.inf
    reached = cheapest(cost, (0, 0), 0.1)
    for target, of in (((4, 4), cost), ((4, 1), 2.0 * cost)):
        with pytest.raises(ValueError, match="no neighbour led here"):
            way_to(target, reached, of, 0.1)


@pytest.mark.parametrize("seed", range(30))
def test_remainder_is_the_shortest_way_round_the_window(seed):
    rng = np.random.default_rng(seed)
    low, high = np.array([-3.0, -3.0]), np.array([3.0, 3.0])
    goal = rng.uniform(-9, 9, 2)
    if np.all(np.abs(goal) <= 3.0):
        goal[0] += 7.0
    rows, columns, side = ring(13, 13)
    border = np.stack((-3.0 + 0.5 * columns, -3.0 + 0.5 * rows), axis=1)
    corners = [np.array(c) for c in ((-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0))]

    def through(a, b):
        inner = a + np.linspace(0.01, 0.99, 99)[:, None] * (b - a)
        return bool(np.any(np.all(np.abs(inner) < 3.0 - 1e-9, axis=1)))

    def shortest(point):
        ways = [[point, *via, goal] for n in range(4) for via in itertools.permutations(corners, n)]
        return min(
            sum(float(np.hypot(*(b - a))) for a, b in itertools.pairwise(way))
            for way in ways
            if not any(through(a, b) for a, b in itertools.pairwise(way))
        )

    chosen = rng.integers(0, len(border), 6)
    found = remainder_outside(border, side, low, high, goal)[chosen]
    assert found == pytest.approx([shortest(border[i]) for i in chosen], rel=1e-6)


@pytest.mark.parametrize("point", [(0.31, -0.42), (-1.0, 0.7), (1.05, -1.2), (5.0, 5.0)])
def test_cells_around_a_point_are_all_that_are_within_reach(point):
    lattice = Lattice(-1.0, -1.2, 0.1, 19, 22)
    rows, columns, away_m = around(lattice, np.array(point), 0.4)
    everywhere = lattice.centres(*np.indices((19, 22)).reshape(2, -1)) - point
    within = (np.hypot(*everywhere.T) <= 0.4).reshape(19, 22)
    found = np.zeros_like(within)
    found[rows, columns] = away_m <= 0.4
    assert np.array_equal(found, within)


def test_pulling_straight_never_costs_more_and_keeps_the_ends():
    rng = np.random.default_rng(1)
    cost = rng.uniform(1.0, 3.0, (30, 30))
    reached = cheapest(cost, (0, 0), 1.0)
    staircase = way_to((29, 29), reached, cost, 1.0)[:, ::-1].astype(float)
    pulled = pull_straight(staircase, cost)

    def total(path):
        return sum(segment_cost(cost, *a, *b) for a, b in itertools.pairwise(path))

    assert pulled[0].tolist() == [0.0, 0.0]
    assert pulled[-1].tolist() == [29.0, 29.0]
    assert total(pulled) <= total(staircase) + 1e-6
    assert np.isfinite(reached).all()


@pytest.mark.parametrize("falling", [False, True])
def test_a_path_that_touches_blocked_corners_is_not_pulled_through_what_is_blocked(falling):
    cost = np.full((12, 12), np.inf)
    cells = [(k, k) for k in range(9)] + [(8, y) for y in range(7, 0, -1)]  # along a diagonal gap, and back beside it
    path = np.array([(x, 11 - y if falling else y) for x, y in cells], dtype=float)
    cost[path[:, 1].astype(int), path[:, 0].astype(int)] = 1.0
    pulled = pull_straight(path, cost)
    corner = path[8].tolist()
    assert pulled[0].tolist() == path[0].tolist()
    assert pulled[-1].tolist() == path[-1].tolist()
    assert corner in pulled.tolist()


def test_open_space_is_crossed_in_a_straight_line():
    route = router_of().route(belief_of([]), mission_to(2.0, 0.7))
    assert route.path_in_odom[0] == pytest.approx([0.0, 0.0])
    assert route.path_in_odom[-1] == pytest.approx([2.0, 0.7])
    assert route.length_m == pytest.approx(math.hypot(2.0, 0.7), rel=0.01)


@pytest.mark.parametrize("goal", [(15.0, 3.0), (-12.0, 1.0), (2.0, -20.0)])
def test_goal_outside_the_window_is_headed_for(goal):
    route = router_of().route(belief_of([]), mission_to(*goal))
    assert route.length_m == pytest.approx(math.hypot(*goal), rel=0.02)
    assert np.all(np.abs(route.path_in_odom) <= 3.0)
    end = route.path_in_odom[-1]
    assert math.atan2(end[1], end[0]) == pytest.approx(math.atan2(goal[1], goal[0]), abs=0.2)


@pytest.mark.parametrize(
    "obstacles",
    [[Disc(1.5, 0.05, 0.4)], [Box(1.0, -3.0, 1.2, -0.4), Box(1.0, 0.4, 1.2, 3.0)], [Box(1, -2, 1.2, 1), Box(0.2, 1, 1.2, 1.2)]],
)
@pytest.mark.parametrize("goal", [(2.4, 0.0), (8.0, 0.5)])
def test_route_keeps_the_robots_radius_free(obstacles, goal):
    route = router_of().route(belief_of(obstacles), mission_to(*goal))
    x, y = route.path_in_odom.T
    assert min(o.distance(x, y).min() for o in obstacles) > 0.12 + 0.05
    assert not route.blocked


def test_the_wider_of_two_gaps_is_preferred():
    walls = [Box(1, -3, 1.2, -1.2), Box(1, -0.4, 1.2, 0.55), Box(1, 1.05, 1.2, 3)]  # gaps of 0.8 m and 0.5 m
    route = router_of().route(belief_of(walls), mission_to(2.4, 0.0))
    at_wall = np.interp(1.1, route.path_in_odom[:, 0], route.path_in_odom[:, 1])
    assert -1.2 < at_wall < -0.4


def test_unknown_is_crossed_where_nothing_better_is_known():
    assert not router_of().route(belief_of([], seen_m=0.0), mission_to(8.0, 0.0)).blocked
    belief = belief_of([])
    belief.grid.label[50:70, 80:110] = UNKNOWN
    detour = router_of(unknown_cost=5.0).route(belief, mission_to(2.8, 0.0)).path_in_odom
    through = router_of(unknown_cost=0.0).route(belief, mission_to(2.8, 0.0)).path_in_odom
    assert np.abs(detour[:, 1]).max() > 0.3
    assert np.abs(through[:, 1]).max() < 0.05


ROOM = [Box(-1, -1, 1, -0.9), Box(-1, 0.9, 1, 1), Box(-1, -1, -0.9, 1), Box(0.9, -1, 1, 1)]


@pytest.mark.parametrize(
    ("obstacles", "goal"),
    [
        (ROOM, (2.0, 0.0)),
        (ROOM, (9.0, 0.0)),
        ([Box(-3, -3, 3, 3)], (5.0, 0.0)),
        ([Disc(2.0, 0.0, 0.6)], (2.0, 0.0)),
        ([Box(-9, 0.9, 9, 1.0), Box(-9, -1.0, 9, -0.9), Box(2, -1, 2.2, 1)], (8.0, 0.0)),
    ],
    ids=["goal outside a room", "far goal", "all occupied", "goal in a wall", "corridor closed ahead"],
)
def test_no_way_is_blocked(obstacles, goal):
    route = router_of().route(belief_of(obstacles), mission_to(*goal))
    assert route.blocked
    assert route.empty
    assert route.goal_in_odom == pytest.approx(goal)


def test_goal_near_a_wall_is_approached_within_its_tolerance():
    route = router_of().route(belief_of([Box(2.1, -2, 2.3, 2)]), mission_to(2.0, 0.0, tolerance_m=0.35))
    end = route.path_in_odom[-1]
    assert math.hypot(end[0] - 2.0, end[1]) <= 0.35
    assert 2.1 - end[0] > 0.2


def test_robot_inside_the_margin_finds_its_way_out():
    route = router_of().route(belief_of([Box(-2.0, 0.15, 2.0, 0.4)]), mission_to(2.5, 1.0))
    assert not route.blocked
    assert route.path_in_odom[3, 1] < -0.05


def test_robot_off_the_grid_is_blocked():
    belief = belief_of([])
    away = belief_of([], SE2(50.0, 0.0))
    odd = type(belief)(**{f: getattr(belief, f) for f in belief.__slots__} | {"odom_from_base": away.odom_from_base})
    assert router_of().route(odd, mission_to(2.0, 0.0)).blocked


@pytest.mark.parametrize("kind", ["grid", "straight"])
def test_no_goal_is_no_route(kind):
    router = router_of() if kind == "grid" else StraightRouter(StraightRouter.Settings(), RouterSetup(0.05, 0.12))
    route = router.route(belief_of([]), Mission(SE2(), ()))
    assert route.empty
    assert not route.blocked
    assert route.goal_in_odom is None


@pytest.mark.parametrize("kind", ["grid", "straight"])
def test_goals_of_the_map_are_taken_to_odom(kind):
    router = router_of() if kind == "grid" else StraightRouter(StraightRouter.Settings(), RouterSetup(0.05, 0.12))
    map_from_odom = SE2(1.0, -2.0, 0.7)
    x, y = map_from_odom.apply(np.array([1.5, 0.5]))
    route = router.route(belief_of([], map_from_odom=map_from_odom), mission_to(x, y))
    assert route.goal_in_odom == pytest.approx((1.5, 0.5))
    assert route.path_in_odom[-1] == pytest.approx([1.5, 0.5])


def test_route_stays_on_its_side_of_a_pillar_while_the_other_becomes_a_little_shorter():
    def side(router, offset):
        route = router.route(belief_of([Disc(1.5, offset, 0.3)]), mission_to(2.7, 0.0))
        return np.sign(route.path_in_odom[np.argmin(abs(route.path_in_odom[:, 0] - 1.5)), 1] - offset)

    loyal = router_of()
    assert [side(loyal, v) for v in (0.06, -0.06, 0.06, -0.06)] == [-1.0] * 4
    assert [side(router_of(), v) for v in (0.06, -0.06)] == [-1.0, 1.0]
    assert side(loyal, -0.6) == 1.0  # but not at any price


def test_restored_router_goes_on_identically():
    beliefs = [belief_of([Disc(1.5, v, 0.3)]) for v in (0.06, -0.06, -0.05)]
    first, second = router_of(), router_of()
    first.route(beliefs[0], mission_to(2.7, 0.0))
    second.restore(first.snapshot())
    for belief in beliefs[1:]:
        a, b = first.route(belief, mission_to(2.7, 0.0)), second.route(belief, mission_to(2.7, 0.0))
        assert np.array_equal(a.path_in_odom, b.path_in_odom)
        assert a.length_m == b.length_m


@pytest.mark.parametrize("cell_m", [0.05, 0.10, 0.15])
def test_route_does_not_shake_while_the_window_rolls(cell_m):
    obstacles = [Disc(2.0, 0.3, 0.4)]
    middles = []
    for step in range(8):
        belief = belief_of(obstacles, SE2(0.05 * step, 0.0), cell_m=cell_m)
        route = router_of().route(belief, mission_to(8.0, 0.0))
        middles.append(np.interp(2.0, *route.path_in_odom.T))
        assert arc_length(route.path_in_odom)[-1] < route.length_m
    assert np.ptp(middles) < 0.12


@pytest.mark.parametrize("router", [router_of(), StraightRouter(StraightRouter.Settings(), RouterSetup(0.05, 0.12))])
@pytest.mark.parametrize(("yaw_in_map", "yaw_in_odom"), [(None, None), (2.0, 1.5), (-3.0, 2.0 * math.pi - 3.5)])
def test_the_heading_to_arrive_with_is_turned_into_odom(router, yaw_in_map, yaw_in_odom):
    belief = belief_of([], map_from_odom=SE2(1.0, -2.0, 0.5))
    mission = Mission(SE2(), (Goal(2.0, 0.0, yaw_in_map),))
    assert router.route(belief, mission).goal_yaw_in_odom == (yaw_in_odom if yaw_in_odom is None else pytest.approx(yaw_in_odom))
