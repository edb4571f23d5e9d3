"""Every registered estimator, router, planner and shield, each with a stream of inputs to answer."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import cycle
from typing import Any

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.mission import Mission
from planners.planner import PlannerSetup
from planners.router import RouterSetup
from planners.shield import ReachableSet, ShieldSetup
from runtime.limits import Limiter, Motion
from runtime.registry import Part, load, names
from tests.contract.streams import BASES, MISSION, PERIOD_S, RADIUS_M, Stream, beliefs, routes, stream

# Settings under which a part is another one; every name is also tried with its defaults.
VARIANTS: dict[str, tuple[dict[str, Any], ...]] = {
    "standard": (
        {"source": "scan", "odometry": {"use_gyro": True}},
        {"source": "scan", "odometry": {"kind": "ekf"}},
        {"pose": "truth", "tracks": "truth"},
        {"memory": {"kind": "layers"}, "depth": {"filtered": True}, "tracks": "grid"},
        {"registration": {"enabled": True}},
        {"tracks": "aruco", "markers": {"side_m": 0.15}},
    ),
}
NAN, INF = math.nan, math.inf
ASKS = (
    BodyTwist(0.3, 0.0, 0.2), BodyTwist(9.0, -9.0, 9.0), BodyTwist(-9.0, 9.0, -9.0), BodyTwist(NAN, 0.0, 0.0),
    BodyTwist(0.1, INF, 0.0), BodyTwist(0.1, 0.0, NAN), BodyTwist(), BodyTwist(0.5, 0.0, 0.0), None,
)  # fmt: skip


@dataclass(frozen=True)
class Subject:
    """A part on one base: how it is built, asked, and what it is asked."""

    part: Part
    name: str
    settings: dict[str, Any]
    base: str

    def __str__(self) -> str:
        return "-".join([self.part.noun, self.name, *map(str, self.settings.values()), self.base])

    @property
    def driven(self) -> Stream:
        return stream(self.base)

    def build(self) -> Any:
        """Return a fresh instance; raises ConfigurationError where it cannot drive the base."""
        cls, limits = load(self.part, self.name), self.driven.limits
        setups = {
            Part.ESTIMATOR: self.driven.estimator_setup,
            Part.ROUTER: RouterSetup(PERIOD_S, RADIUS_M),
            Part.PLANNER: PlannerSetup(PERIOD_S, RADIUS_M, limits, seed=3),
            Part.SHIELD: ShieldSetup(PERIOD_S, RADIUS_M, limits),
        }
        return cls(cls.Settings(**self.settings), setups[self.part])

    @property
    def inputs(self) -> tuple[tuple[Any, ...], ...]:
        """The arguments of each call."""
        match self.part:
            case Part.ESTIMATOR:
                return tuple((sensed,) for sensed in self.driven.sensed)
            case Part.ROUTER:
                missions = cycle((MISSION,) * 9 + (Mission(MISSION.map_from_start, ()),))
                return tuple(zip(beliefs(self.base), missions, strict=False))
            case Part.PLANNER:
                return tuple(zip(beliefs(self.base), routes(self.base), strict=True))
            case _:
                return tuple(_shield_inputs(self.base))

    def answer(self, instance: Any, arguments: tuple[Any, ...]) -> Any:
        method = {Part.ESTIMATOR: "update", Part.ROUTER: "route", Part.PLANNER: "plan", Part.SHIELD: "filter"}[self.part]
        return getattr(instance, method)(*arguments)

    def answers(self, instance: Any, inputs: tuple[tuple[Any, ...], ...]) -> list[Any]:
        return [self.answer(instance, arguments) for arguments in inputs]


def subjects(*parts: Part) -> list[Subject]:
    return [
        Subject(part, name, settings, base)
        for part in parts
        for name in names(part)
        for settings in ({}, *VARIANTS.get(name, ()))
        for base in BASES
    ]


def _shield_inputs(base: str) -> Iterator[tuple[Command, Any, ReachableSet]]:
    """Ask for anything; what can be reached is what the limits leave of the motion, or one point."""
    limits = stream(base).limits
    limiter = Limiter(limits, PERIOD_S)
    for index, (belief, ask) in enumerate(zip(beliefs(base), cycle(ASKS), strict=False)):
        reachable = limiter.reachable(Motion(belief.twist))
        if index % 10 == 9:
            reachable = ReachableSet(reachable.highest, reachable.highest)
        yield Command(ask, None, belief.stamp_ns + 10**8, belief.oldest_input_ns), belief, reachable
