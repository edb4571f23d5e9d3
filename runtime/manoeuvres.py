"""Drives that are driven for what they tell: the operator's script jogs the base, the whole loop watches over it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.errors import TrundleError
from drivers.interface.sensed import Sensed
from runtime import configuration
from runtime.run import RunOptions, run

REST_S = 1.5  # between manoeuvres: what stands tells of the gyro's bias
SHARE = 0.5  # of the base's caps
LONGEST_M, SPEED_MAX_M_S, TURN_RATE_MAX_RAD_S = 1.5, 0.4, 0.8


@dataclass(frozen=True, slots=True)
class Leg:
    """A twist that is held for a time, then the base rests."""

    twist: BodyTwist
    duration_s: float


def calibration_legs(limits: BaseLimits) -> tuple[Leg, ...]:
    """Return what excites every parameter: there and back along each axis and across, turns both ways, curves; 1.5 m around."""
    speed = min(SPEED_MAX_M_S, SHARE * limits.velocity.vx)
    turn = min(TURN_RATE_MAX_RAD_S, SHARE * limits.velocity.wz)
    headings = [(1.0, 0.0)]
    if limits.holonomic:
        speed = min(speed, limits.velocity.vy)
        headings += [(0.0, 1.0), (0.7, 0.7), (0.7, -0.7)]
    straight = [
        Leg(BodyTwist(sign * x * speed, sign * y * speed, 0.0), LONGEST_M / speed) for x, y in headings for sign in (1.0, -1.0)
    ]
    turns = [Leg(BodyTwist(0.0, 0.0, sign * turn), 6.0 / turn) for sign in (1.0, -1.0)]
    curves = [Leg(BodyTwist(speed, 0.0, sign * turn), 6.0 / turn) for sign in (1.0, -1.0)]
    if not limits.reverse:
        straight = [leg for leg in straight if leg.twist.vx >= 0.0]
    return (*straight, *turns, *curves, *straight)


def square_legs(limits: BaseLimits, side_m: float) -> tuple[Leg, ...]:
    """Return a square (Borenstein, Feng, UMBmark, 1994), counter-clockwise."""
    speed, turn = min(SPEED_MAX_M_S, limits.velocity.vx), min(TURN_RATE_MAX_RAD_S, SHARE * limits.velocity.wz)
    side = Leg(BodyTwist(speed, 0.0, 0.0), side_m / speed)
    corner = Leg(BodyTwist(0.0, 0.0, turn), 1.5707963 / turn)
    return (side, corner) * 4


def overrides_of(legs: tuple[Leg, ...]) -> tuple[str, ...]:
    """Return what makes a configuration drive the legs and nothing else."""
    events: list[dict[str, object]] = [{"at_s": 0.0, "action": "enable"}]
    at_s = REST_S
    for leg in legs:
        twist = {"vx": leg.twist.vx, "vy": leg.twist.vy, "wz": leg.twist.wz}
        events.append({"at_s": at_s, "action": "jog", "duration_s": leg.duration_s, **twist})
        at_s += leg.duration_s + REST_S
    return (
        f"robot.operator={json.dumps({'driver': 'script', 'events': events})}",
        'planner={"name": "idle"}',
        'router={"name": "straight"}',
        "mission.goals=[]",
        f"mission.time_limit_s={at_s}",
    )


def driven(
    config: str,
    legs: tuple[Leg, ...],
    changes: tuple[str, ...] = (),
    seed: int = 0,
    done: Callable[[Sensed], None] = lambda _: None,
) -> tuple[Sensed, ...]:
    """Drive the legs and return all that was sensed.

    Raises:
        TrundleError: the drive came to no good end: a collision, a latched stop, a device that failed.
    """
    return observed(config, (*changes, *overrides_of(legs)), seed, done, "; clear the floor 2 m around the robot")


def observed(
    config: str,
    changes: tuple[str, ...] = (),
    seed: int = 0,
    done: Callable[[Sensed], None] = lambda _: None,
    advice: str = "",
) -> tuple[Sensed, ...]:
    """Run a configuration and return all that was sensed.

    Raises:
        TrundleError: the run came to no good end; `advice` says what may help.
    """
    sensed: list[Sensed] = []

    def keep(one: Sensed) -> None:
        sensed.append(one)
        done(one)

    result = run(configuration.load(config, changes), RunOptions(seed=seed, progress=lambda cycle: keep(cycle.sensed)))
    if result.failure is not None:
        raise result.failure
    if result.report.outcome != "reached":
        raise TrundleError(f"{config}: the drive ended early ({result.report.outcome}){advice}")
    return tuple(sensed)
