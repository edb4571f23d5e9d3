"""Sensed samples and beliefs for the tests of the runtime, as a healthy robot in the open would have them."""

from dataclasses import replace

import numpy as np

from drivers.interface.commands import BaseLimits, BodyTwist
from drivers.interface.devices import DeviceHealth, DeviceState
from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal, Mission
from drivers.interface.samples import OperatorAction, OperatorEvent, SetEnabled, Stamp, WheelSample
from drivers.interface.sensed import Sensed, Tick
from estimators.belief import FREE, Belief, ClearanceField, Lattice, OccupancyGrid

MS = 1_000_000
PERIOD_NS = 50 * MS
LIMITS = BaseLimits(
    velocity=BodyTwist(0.75, 0.5, 1.2),
    acceleration=BodyTwist(1.5, 1.5, 3.0),
    jerk=BodyTwist(15.0, 15.0, 30.0),
    stop_deceleration=BodyTwist(2.0, 2.0, 4.0),
)
MISSION = Mission(SE2(), (Goal(5.0, 0.0),))


def wheels(captured_ns: int, sequence: int, delay_ns: int = 2 * MS) -> WheelSample:
    return WheelSample(Stamp(captured_ns, captured_ns + delay_ns, sequence), np.zeros(3), np.zeros(3))


def health(**changes: object) -> DeviceHealth:
    return replace(DeviceHealth("base", DeviceState.OPEN, expected_period_ns=10 * MS), **changes)


def sensed(index: int, *actions: OperatorAction, base: tuple[WheelSample, ...] | None = None, **changes: object) -> Sensed:
    now_ns = index * PERIOD_NS
    if base is None:
        base = tuple(wheels(now_ns - 10 * MS * k, 5 * index - k) for k in range(5, 0, -1))
    if index == 0:
        actions = (SetEnabled(True), *actions)
    events = tuple(OperatorEvent(Stamp(now_ns, now_ns, n), action) for n, action in enumerate(actions))
    plain = Sensed(
        tick=Tick(index, now_ns, PERIOD_NS),
        depth=None,
        imu=(),
        base=base,
        joints=(),
        scans=(),
        operator=events,
        truth=None,
        health=(health(),),
        mission=MISSION,
    )
    return replace(plain, **changes)


def belief(index: int, **changes: object) -> Belief:
    lattice = Lattice(-3.0, -3.0, 0.05, 120, 120)
    shape = (120, 120)
    known = np.ones(shape, dtype=np.bool_)
    plain = Belief(
        tick=index,
        stamp_ns=index * PERIOD_NS,
        odom_from_base=SE2(),
        map_from_odom=SE2(),
        twist=BodyTwist(),
        covariance=np.zeros((3, 3)),
        grid=OccupancyGrid(lattice, np.full(shape, FREE, dtype=np.uint8)),
        clearance=ClearanceField(lattice, np.full(shape, 6.0, dtype=np.float32), np.zeros(shape, dtype=np.float32), known, known),
        tracks=(),
        joints=None,
        oldest_input_ns=index * PERIOD_NS - 10 * MS,
    )
    return replace(plain, **changes)
