"""A base that cannot strafe under the clearance manifold: how it turns, drives to a point beside it, and backs off."""

import math

import numpy as np
import pytest

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.geometry import SE2
from planners.clearance_manifold.differential import Differential
from planners.clearance_manifold.lookout import Outlook
from planners.clearance_manifold.settings import ControllerSettings
from tests.planners.test_clearance_manifold import at, planner_of, routed

PERIOD_S, LAG_S, TURN_RAD_S2, JERK_RAD_S3 = 0.05, 0.06, 3.0, 30.0
LIMITS = BaseLimits(
    BodyTwist(1.0, 0.0, 2.0), BodyTwist(1.5, 0.0, TURN_RAD_S2), BodyTwist(15.0, 0.0, JERK_RAD_S3), BodyTwist(2.0, 0.0, 6.0)
)
SETTINGS = ControllerSettings()


class Base:
    """Follows what was asked a tick ago: turns up at TURN_RAD_S2, which it reaches at JERK_RAD_S3, with a lag."""

    def __init__(self, pose):
        self.pose, self.last, self.set_rad_s, self.turn_rad_s, self.up_rad_s2 = pose, BodyTwist(), 0.0, 0.0, 0.0

    def step(self, asked):
        more = JERK_RAD_S3 * PERIOD_S
        wanted = min(max((self.last.wz - self.set_rad_s) / PERIOD_S, self.up_rad_s2 - more), self.up_rad_s2 + more)
        self.up_rad_s2 = min(max(wanted, -TURN_RAD_S2), TURN_RAD_S2)
        self.set_rad_s += self.up_rad_s2 * PERIOD_S
        self.turn_rad_s += (self.set_rad_s - self.turn_rad_s) * (1.0 - math.exp(-PERIOD_S / LAG_S))
        self.pose = self.pose.integrate(self.last.vx, 0.0, self.turn_rad_s, PERIOD_S)
        self.last = asked


@pytest.mark.parametrize("off_rad", [0.05, 0.4, -1.4, 3.0])
def test_a_turn_on_the_spot_ends_where_it_should_without_swinging(off_rad):
    base, differential, headings = Base(SE2()), Differential(SETTINGS, LIMITS), []
    for _ in range(80):
        base.step(BodyTwist(0.0, 0.0, differential.turn_to(math.remainder(off_rad - base.pose.yaw, math.tau))))
        headings.append(base.pose.yaw)
    assert headings[-1] == pytest.approx(off_rad, abs=0.01)
    assert np.max(np.abs(headings)) < abs(off_rad) + 0.05
    quickest_s = 2.0 * math.sqrt(abs(off_rad) / TURN_RAD_S2)  # without a limit on the rate: speeding up, then braking
    assert np.argmax(np.abs(np.array(headings) - off_rad) < 0.1) * PERIOD_S < 1.6 * quickest_s + 0.8


@pytest.mark.parametrize("start", [SE2(0.0, 0.4, 0.0), SE2(0.0, -0.2, 0.7), SE2(0.0, 0.0, 1.3)])
def test_a_line_is_joined_without_swinging_about_it(start):
    """What it asks must not be more than a base that turns up slowly can take back in time."""
    base, differential, found = Base(start), Differential(SETTINGS, LIMITS), []
    for _ in range(200):
        pose = base.pose
        point_y = pose.y + SETTINGS.look_ahead_m * math.sin(pose.yaw)
        velocity = np.array([0.5, 0.0]) + differential.push(np.array([0.0, point_y]))
        base.step(differential.twist(SE2(0.0, 0.0, -pose.yaw).apply(velocity), 0.5, 0.0, 0.0))
        found.append((pose.x, pose.y, pose.yaw))
    x, y, yaw = np.array(found).T
    assert np.abs(y[100:]).max() < 0.02
    assert np.abs(yaw[100:]).max() < 0.05
    assert (np.diff(np.sign(yaw[20:])) != 0).sum() <= 3
    assert x[-1] > 4.3  # 0.5 m/s for 10 s, less what joining takes


def test_pushed_back_it_backs_off_as_far_as_there_is_room_and_else_turns():
    differential, back = Differential(SETTINGS, LIMITS), np.array([-0.4, 0.1])
    assert differential.twist(back, 0.5, 0.0, 1.0) == BodyTwist(-0.4, 0.0, 0.0)
    near = differential.twist(back, 0.5, 0.0, 0.02)
    assert -0.2 < near.vx < 0.0
    assert near.vx**2 / (2.0 * SETTINGS.deceleration_m_s2) < 0.02
    turning = differential.twist(back, 0.5, 0.0, 0.0)
    assert turning.vx == 0.0
    assert turning.wz > 0.5


def test_with_no_speed_it_looks_aside():
    assert Differential(SETTINGS, LIMITS).twist(np.zeros(2), 0.0, -0.8, 1.0).wz < -0.5


@pytest.mark.parametrize(("strafes", "aside", "creeps"), [(False, True, False), (False, False, True), (True, True, True)])
def test_who_cannot_look_aside_while_it_drives_stands_to_look_and_creeps_then(monkeypatch, strafes, aside, creeps):
    """Where it stands in an opening already, it is to look who may come; a base that strafes creeps on meanwhile."""
    planner = planner_of(*(() if strafes else (LIMITS,)))
    place = np.array([0.3, 2.0] if aside else [2.0, 0.3])
    monkeypatch.setattr(planner._lookout, "watch", lambda *_: Outlook(math.inf, 0.15, place, 1.25, True, True))
    plan = planner.plan(*routed(at(0)))
    assert (plan.base.vx > 0.0) == creeps
    if aside:
        assert plan.base.wz > 0.3


@pytest.mark.parametrize("aside_m", [0.6, -0.6])
def test_where_the_route_turns_back_the_base_turns_on_the_spot_and_goes(aside_m):
    """A chart joined to the way it came would be a hairpin, smoothed to a tip behind it whose tangent leads anywhere."""
    planner, base = planner_of(LIMITS), Base(SE2(1.0, 0.1, 0.0))
    for tick in range(60):
        goal = (9.0, 0.0) if tick < 3 else (-3.0, aside_m)
        base.step(planner.plan(*routed(at(tick, pose=base.pose, twist=base.last), goal)).base)
    assert math.cos(base.pose.yaw) < -0.9
    assert base.pose.x < 0.75
