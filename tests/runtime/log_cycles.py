"""Cycles as a loop would make them: a robot drives down a corridor towards a walker, with everything a log can hold."""

import math
import struct
from dataclasses import dataclass, fields, is_dataclass

import numpy as np

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.devices import DeviceHealth, DeviceState
from drivers.interface.geometry import BODY_FROM_OPTICAL, SE2, SE3
from drivers.interface.mission import Goal, Mission
from drivers.interface.samples import (
    DepthFrame,
    ImuSample,
    Intrinsics,
    Jog,
    MarkerSample,
    NewGoal,
    ObstacleTruth,
    OperatorEvent,
    PoseSample,
    Stamp,
    TruthSample,
    WheelSample,
    frozen_array,
)
from drivers.interface.seeds import stream
from drivers.interface.sensed import Sensed, Tick
from estimators.belief import Belief, ClearanceField, Lattice, OccupancyGrid, Track
from planners.planner import Diagnostics, Plan
from planners.router import Route
from planners.shield import Filtered, ReachableSet
from runtime.cycle import Cycle, Verdict
from runtime.faults import Fault, FaultReport, Response
from runtime.log.header import RunHeader, SceneShape

PERIOD_NS = 50_000_000
LATTICE = Lattice(-3.0, -3.0, 0.05, 120, 120)
INTRINSICS = Intrinsics(160, 90, 82.0, 82.0, 79.5, 44.5)
CAMERA = SE3(0.1, 0.0, 0.25) @ BODY_FROM_OPTICAL
WALKER = SceneShape("walker", "cylinder", SE2(), (0.2, 0.2, 0.85))


@dataclass(frozen=True, slots=True)
class Cost(Diagnostics):
    """What a planner may say."""

    candidates: int
    best_cost: float
    stuck: bool
    reason: str


def header(**changes: object) -> RunHeader:
    walls = tuple(SceneShape(f"wall_{i}", "box", SE2(3.0, y), (5.0, 0.05, 0.4)) for i, y in enumerate((-1.25, 1.25)))
    known = {"static": walls, "movers": (WALKER,), "devices": ("camera", "imu", "base", "truth")}
    return RunHeader("robot: {}\n", 3, "hallway", "dwa", 0.12, **(known | changes))


def depth_frame(index: int, start_ns: int, intrinsics: Intrinsics = INTRINSICS) -> DepthFrame:
    """A floor and walls seen from 0.25 m, with noise."""
    v, u = np.mgrid[0 : intrinsics.height, 0 : intrinsics.width]
    x, y = (u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy
    floor = np.where(y > 0.01, 0.25 / np.maximum(y, 0.01), 9.0)
    wall = np.where(np.abs(x) > 0.01, 1.2 / np.maximum(np.abs(x), 0.01), 9.0)
    z = np.minimum(np.minimum(floor, wall), 6.0)
    z += stream(3, "camera", index).normal(size=z.shape) * 0.003 * z**2
    depth = frozen_array((z * 1000.0).astype(np.uint16))
    return DepthFrame(Stamp(start_ns - 21_000_000, start_ns - 900_000, index, "camera"), depth, 0.001, intrinsics, CAMERA)


def field(x: float) -> tuple[OccupancyGrid, ClearanceField]:
    """Corridor walls and a disc in front, as far as 2.5 m."""
    rows, columns = np.mgrid[0:120, 0:120]
    points = LATTICE.centres(rows.ravel(), columns.ravel())
    wall = 1.2 - np.abs(points[:, 1])
    disc = np.hypot(points[:, 0] - 2.0, points[:, 1] - 0.3) - 0.2
    clearance = np.maximum(np.minimum(wall, disc), 0.0).reshape(120, 120).astype(np.float32)
    known = (np.hypot(points[:, 0] - x, points[:, 1]) < 2.5).reshape(120, 120)
    label = np.where(known, np.where(clearance > 0.0, 0, 100), 255).astype(np.uint8)
    rate = np.full_like(clearance, -0.1)
    arrays = [frozen_array(a) for a in (clearance, rate, known, known.copy())]
    return OccupancyGrid(LATTICE, frozen_array(label)), ClearanceField(LATTICE, *arrays)


def make_cycles(count: int, *, intrinsics: Intrinsics = INTRINSICS, period_ns: int = PERIOD_NS) -> list[Cycle]:
    """Every third tick has no frame, as a 15 Hz camera on a 20 Hz loop; a fault and a jog lie in the middle."""
    cycles: list[Cycle] = []
    for index in range(count):
        sensed = _sensed(index, period_ns, intrinsics)
        cycles.append(_cycle(index, count, sensed, cycles[-1] if cycles else None))
    return cycles


def _sensed(index: int, period_ns: int, intrinsics: Intrinsics) -> Sensed:
    start = 10**12 + index * period_ns
    t = index * period_ns / 1e9
    random = stream(3, "wheels", index)
    imu = tuple(
        ImuSample(Stamp(start - k * 5_000_000, start, 10 * index + k), tuple(random.normal(size=3)), (0.0, -0.0, 9.81))
        for k in range(10)
    )
    wheels = tuple(
        WheelSample(Stamp(start - k, start, k), frozen_array(random.normal(size=3)), frozen_array(random.normal(size=3)))
        for k in range(5)
    )
    pose = PoseSample(Stamp(start, start, index, "autopilot"), SE2(t, 0.1, math.nan), None, frozen_array(np.eye(3)))
    events = ((OperatorEvent(Stamp(start, start, 0), Jog(BodyTwist(0.1, 0.0, -0.0), start + 1)),) if index % 7 == 3 else ()) + (
        (OperatorEvent(Stamp(start, start, 1), NewGoal(Goal(1.0, 2.0, None))),) if index % 7 == 5 else ()
    )
    walker = ObstacleTruth("walker", SE2(5.0 - 0.8 * t, 0.4, math.pi), (-0.8, 0.0), 0.2)
    truth = TruthSample(Stamp(start, start, index), SE2(0.51 * t, 0.01, 0.0), BodyTwist(0.51), (walker,), 0.9, ())
    health = tuple(
        DeviceHealth(name, DeviceState.OPEN, received=index, battery_fraction=fraction)
        for name, fraction in (("camera", None), ("base", 0.75))
    )
    return Sensed(
        Tick(index, start, period_ns),
        depth_frame(index, start, intrinsics) if index % 4 != 3 else None,
        imu,
        (*wheels, pose),
        (),
        (),
        events,
        truth,
        health,
        Mission(SE2(), (Goal(7.0, 0.0),)),
        _markers(index, start, intrinsics),
    )


def _markers(index: int, start: int, intrinsics: Intrinsics) -> tuple[MarkerSample, ...]:
    """None, or an image with as many markers as its number allows."""
    count = index % 3
    corners = frozen_array(stream(3, "markers", index).uniform(size=(count, 4, 2)))
    sample = MarkerSample(Stamp(start - 60_000_000, start, index), tuple(range(count)), corners, intrinsics, CAMERA)
    return (sample,) if index % 4 else ()


def _cycle(index: int, count: int, sensed: Sensed, before: Cycle | None) -> Cycle:
    start, t = sensed.tick.start_ns, index * sensed.tick.period_ns / 1e9
    grid, clearance = field(0.5 * t) if before is None or sensed.depth else (before.belief.grid, before.belief.clearance)
    pose = SE2(0.5 * t, 0.1 * math.sin(t), 0.1 * math.cos(t))
    track = Track(7, (2.0, 0.3), (-0.5, 0.0), 0.25, frozen_array(np.eye(4)))
    covariance = frozen_array(np.diag([0.01, 0.01, 0.001]))
    belief = Belief(
        index, start, pose, SE2(), BodyTwist(0.5, 0.0, 0.1), covariance, grid, clearance, (track,), None, start - 21_000_000
    )
    s = np.linspace(0.0, 1.0, 12)
    path = frozen_array(pose.apply(np.stack((2.0 * s, -0.5 * s**2), axis=-1)))
    route = Route((7.0, 0.0), frozen_array(np.array([[pose.x, pose.y], [3.0, -0.4], [7.0, 0.0]])), 7.0 - pose.x)
    asked = BodyTwist(0.6, 0.1 * math.sin(2 * t), -0.4 * math.sin(t))
    sent = BodyTwist(0.5, 0.08 * math.sin(2 * t), -0.4 * math.sin(t))
    plan = Plan(asked, None, path, Cost(300, 1.5 + math.sin(t), index % 9 == 0, "clear"))
    silent = (FaultReport(Fault.SILENT_DEVICE, "camera", "nothing for 210 ms"),)
    faults = silent if count // 2 <= index < count // 2 + max(2, count // 10) else ()
    command = Command(BodyTwist() if faults else sent, None, start + 10**8, start - 21_000_000)
    asking = Command(asked, None, start + 10**8, start - 21_000_000)
    verdict = Verdict(
        command,
        asking,
        Response.STAND_DOWN if faults else Response.RUN,
        faults,
        ReachableSet(BodyTwist(-0.1, -0.1, -1.0), BodyTwist(0.75, 0.5, 1.2)),
        None if faults else Filtered(command, True),
    )
    stages = tuple(round(1e6 * x) for x in (0.4, 2.0, 0.3, 1.5 + 0.3 * math.sin(t), 0.2, 0.1, 0.02))
    return Cycle(sensed, belief, route, plan, verdict, stages)


def bits(value: object) -> object:
    """The value in a form whose equality is that of every bit: NaN equals itself, 0.0 is not -0.0."""
    if is_dataclass(value):
        return (type(value).__name__, [(f.name, bits(getattr(value, f.name))) for f in fields(value)])
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, tuple):
        return tuple(bits(item) for item in value)
    return struct.pack("<d", value) if isinstance(value, float) else value
