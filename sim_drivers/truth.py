"""How things really are in the simulated world: no noise, no latency."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, ClassVar

import mujoco
import numpy as np
from pydantic import Field

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup, DeviceState
from drivers.interface.geometry import SE2
from drivers.interface.samples import ObstacleTruth, Stamp, TruthSample, merged_truth
from drivers.interface.settings import Settings
from sim_drivers.robot_clearance import RobotClearance
from sim_drivers.sensor import SimSensor
from sim_drivers.world import SECOND_NS, MujocoWorld


class TruthSettings(Settings):
    """Settings of the ground truth."""

    rate_hz: float = Field(default=100.0, gt=0.0, le=1000.0, description="how often the world is looked at")
    buffered_samples: int = Field(default=1000, ge=1, le=100_000, description="looks that are merged into one sample at most")


class SimTruth(SimSensor[TruthSample]):
    """Ground truth: the robot's pose and twist, whatever moves, signed clearance and contacts.

    The world is looked at more often than the loop asks, so that a short touch is not missed: a sample's pose is the newest,
    its clearance the least and its contacts all of those since the sample before.
    """

    Settings: ClassVar[type[Settings]] = TruthSettings
    role: ClassVar[str] = "truth"
    _newest: TruthSample | None

    def __init__(self, settings: TruthSettings, setup: DeviceSetup) -> None:
        """Register with the world.

        Raises:
            ConfigurationError: there is no simulated world.
        """
        super().__init__(setup, settings.rate_hz, capacity=settings.buffered_samples)
        self._clearance: RobotClearance | None = None
        self._looked_s = 0.0  # when the newest look was, on the scene's own clock
        self._base_id = 0
        self._items: tuple[tuple[str, int, float], ...] = ()

    def build(self, spec: Any, base: Any) -> None:
        """Add nothing: truth only looks."""

    def bind(self, world: MujocoWorld) -> None:
        """Look up the bodies and measure once, so that nothing is compiled later."""
        model = world.model
        self._base_id = model.body("base").id
        carried = [item for conveyor in world.scene.conveyors for item in conveyor.items]
        self._items = tuple((item.name, model.body(item.name).id, item.shape.bounding_radius_m) for item in carried)
        self._clearance = RobotClearance(model)
        self._clearance.measure(world.data)

    def drain(self) -> tuple[TruthSample, ...]:
        """Return all looks since the last call as one sample, or nothing.

        Where walkers were follows from the time alone, so they are looked up here, for the newest look only.
        """
        looks = super().drain()
        if not looks:
            return ()
        newest = merged_truth(looks)
        return (replace(newest, obstacles=(*self._walkers(self._looked_s), *newest.obstacles)),)

    def latest(self) -> TruthSample | None:
        """Return the truth now, or None before the first."""
        self._newest = next(iter(self.drain()), self._newest)
        return self._newest if self._state is DeviceState.OPEN else None

    def _measure(self, world: MujocoWorld, stamp: Stamp) -> TruthSample:
        assert self._clearance is not None  # bound before the world acts
        _, _, wz, vx, vy, _ = _velocity(world, self._base_id, in_body=True)
        clearance_m, contacts = self._clearance.measure(world.data)
        items = tuple(_item(world, name, body, radius_m) for name, body, radius_m in self._items)
        self._looked_s = world.scene_ns / SECOND_NS
        return TruthSample(stamp, _pose(world, self._base_id), BodyTwist(vx, vy, wz), items, clearance_m, contacts)

    def _walkers(self, time_s: float) -> tuple[ObstacleTruth, ...]:
        return tuple(
            ObstacleTruth(m.name, m.pose_at(time_s), m.velocity_at(time_s), m.shape.bounding_radius_m)
            for m in self._world.scene.movers
        )

    def _reset(self) -> None:
        super()._reset()
        self._newest = None


def _item(world: MujocoWorld, name: str, body: int, radius_m: float) -> ObstacleTruth:
    _, _, _, vx, vy, _ = _velocity(world, body, in_body=False)
    return ObstacleTruth(name, _pose(world, body), (vx, vy), radius_m)


def _pose(world: MujocoWorld, body: int) -> SE2:
    x, y, _ = world.data.xpos[body].tolist()
    rotation = world.data.xmat[body]
    return SE2(x, y, math.atan2(rotation[3], rotation[0]))


def _velocity(world: MujocoWorld, body: int, in_body: bool) -> tuple[float, ...]:
    """Return angular and linear velocity of a body's origin, six numbers, along the body's axes or the map's."""
    velocity = np.empty(6)
    mujoco.mj_objectVelocity(world.model, world.data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, int(in_body))
    return tuple(velocity.tolist())
