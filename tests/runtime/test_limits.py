"""What the limits admit: never empty, never beyond, and from every reachable motion there is a way on."""

import math
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from drivers.interface.commands import BaseLimits, BodyTwist
from runtime.limits import AXES, Limiter, Motion

LIMITS = BaseLimits(
    velocity=BodyTwist(0.75, 0.5, 1.2),
    acceleration=BodyTwist(1.5, 1.5, 3.0),
    jerk=BodyTwist(15.0, 15.0, 30.0),
    stop_deceleration=BodyTwist(2.0, 2.0, 4.0),
)
DT = 0.05
LIMITER = Limiter(LIMITS, DT)


@given(st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 3), min_size=1, max_size=60))
def test_any_sequence_of_wishes_keeps_velocity_acceleration_and_jerk(wishes: list[tuple[float, float, float]]) -> None:
    motion = Motion()
    for wish in wishes:
        reachable = LIMITER.reachable(motion)
        sent = reachable.clip(BodyTwist(*wish))
        after = LIMITER.after(motion, sent)
        for axis in AXES:
            assert getattr(reachable.lowest, axis) <= getattr(reachable.highest, axis)
            assert abs(getattr(sent, axis)) <= getattr(LIMITS.velocity, axis) + 1e-9
            assert abs(getattr(after.acceleration, axis)) <= getattr(LIMITS.acceleration, axis) + 1e-9
            change = abs(getattr(after.acceleration, axis) - getattr(motion.acceleration, axis))
            assert change <= getattr(LIMITS.jerk, axis) * DT + 1e-6
        motion = after


def test_full_speed_is_reached_and_held() -> None:
    motion = Motion()
    for _ in range(100):
        motion = LIMITER.after(motion, LIMITER.reachable(motion).clip(BodyTwist(9.0, 0.0, 0.0)))
    assert math.isclose(motion.twist.vx, 0.75, abs_tol=1e-3)


def test_a_stop_takes_the_time_its_deceleration_says_and_ends_at_rest() -> None:
    motion, ticks = Motion(BodyTwist(0.75, -0.5, 1.2)), 0
    while motion.twist != BodyTwist():
        stopped = LIMITER.stopping(motion)
        assert abs(stopped.vx) < abs(motion.twist.vx) or stopped.vx == 0.0
        motion, ticks = LIMITER.after(motion, stopped), ticks + 1
    assert ticks == math.ceil(0.75 / (2.0 * DT))


def test_lowered_caps_slow_down_at_the_normal_deceleration() -> None:
    motion = Motion(BodyTwist(0.75, 0.0, 0.0))
    speeds = []
    for _ in range(40):
        motion = LIMITER.after(motion, LIMITER.reachable(motion, 0.5).clip(BodyTwist(9.0, 0.0, 0.0)))
        speeds.append(motion.twist.vx)
    assert all(a - b <= 1.5 * DT + 1e-9 for a, b in zip([0.75, *speeds], speeds, strict=False))
    assert speeds[-1] <= 0.375 + 1e-6


def test_a_base_that_cannot_strafe_or_reverse_is_never_allowed_to() -> None:
    forward = BaseLimits(
        BodyTwist(1.0, 0.0, 2.0), BodyTwist(2.0, 0.0, 4.0), BodyTwist(20.0, 0.0, 40.0), BodyTwist(3.0, 0.0, 6.0), reverse=False
    )
    reachable = Limiter(forward, DT).reachable(Motion())
    assert (reachable.lowest.vy, reachable.highest.vy) == (0.0, 0.0)
    assert reachable.lowest.vx == 0.0 < reachable.highest.vx


def test_a_slip_that_was_measured_is_nothing_that_a_base_can_be_told() -> None:
    limiter = Limiter(replace(LIMITS, velocity=BodyTwist(0.75, 0.0, 1.2), reverse=False), DT)
    assert limiter.nearest(BodyTwist(0.8, -0.02, -1.3)) == BodyTwist(0.75, 0.0, -1.2)
    assert limiter.nearest(BodyTwist(-0.1, 0.02, 0.3)) == BodyTwist(0.0, 0.0, 0.3)
    assert limiter.within_caps(limiter.stopping(Motion(limiter.nearest(BodyTwist(0.8, -0.02, -1.3)))))
