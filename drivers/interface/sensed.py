"""What one tick of the loop got from all devices together."""

from __future__ import annotations

from dataclasses import dataclass, field

from drivers.interface.devices import DeviceHealth
from drivers.interface.mission import Mission
from drivers.interface.samples import (
    BaseSample,
    ColourFrame,
    DepthFrame,
    ImuSample,
    JointSample,
    MarkerSample,
    OperatorEvent,
    RangeScan,
    TruthSample,
)


@dataclass(frozen=True, slots=True)
class Tick:
    """One beat of the loop on its absolute grid; everything here is recorded and replayed as an input."""

    index: int
    start_ns: int  # the grid time of this tick
    period_ns: int
    skipped: int = 0  # grid times that passed unused just before this tick, because the loop was late
    lateness_ns: int = 0  # how long after the grid time the loop really woke
    last_work_ns: int = 0  # how long the work of the tick before took (in lockstep: as the latency model says)
    last_plan_ns: int = 0  # how long its planner took (likewise)


@dataclass(frozen=True, slots=True)
class Sensed:
    """All samples since the last tick, the devices' own word on how they stand, and the mission as it is now."""

    tick: Tick
    depth: DepthFrame | None
    imu: tuple[ImuSample, ...]
    base: tuple[BaseSample, ...]
    joints: tuple[JointSample, ...]
    scans: tuple[RangeScan, ...]
    operator: tuple[OperatorEvent, ...]
    truth: TruthSample | None
    health: tuple[DeviceHealth, ...]
    mission: Mission
    markers: tuple[MarkerSample, ...] = ()
    colour: ColourFrame | None = field(default=None, compare=False)  # for the log only: neither used nor replayed
