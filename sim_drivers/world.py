"""The one MuJoCo world that every stand-in lives in: it owns model, data and time."""

from __future__ import annotations

import math
from typing import Any, Protocol

import mujoco
import numpy as np
from pydantic import Field

from drivers.interface.devices import DeviceSetup
from drivers.interface.errors import ConfigurationError, DeviceError, TrundleError
from drivers.interface.settings import Settings
from sim_drivers.mover_kernel import pack_movers, place_movers
from sim_drivers.scene import Conveyor, Kind, Mover, Scene, Shape, StaticObstacle

# Contact bits.  Two geoms touch when the contype of one meets the conaffinity of the other.
FLOOR_BIT, OBSTACLE_BIT = 1, 2
SECOND_NS = 1_000_000_000


class Part(Protocol):
    """A stand-in's share in the world.  Registered with `world.add(part)` by its constructor, before `world.compile()`."""

    max_step_s: float  # the largest physics step that it is still right with

    def build(self, spec: Any, base: Any) -> None:
        """Add bodies, geoms, sites, actuators to the `mujoco.MjSpec`; `base` is the robot's root body (frame base)."""
        ...

    def bind(self, world: MujocoWorld) -> None:
        """Look up ids in the compiled model; called once, the state is the start's."""
        ...

    @property
    def period_ns(self) -> int:
        """How often `act` is to be called, asked once; whole multiples of the physics step are best, others are rounded up."""
        ...

    def act(self, world: MujocoWorld) -> None:
        """Sample the state at `world.now_ns` (positions and velocities are current) and set controls."""
        ...


class WorldSettings(Settings):
    """Settings of the physics."""

    physics_step_s: float | None = Field(
        default=None, gt=0.0, le=0.01, description="physics step; none: the largest that the robot's parts accept"
    )


class MujocoWorld:
    """Model, data and time.  Parts are added, then it is compiled, then it is stepped.

    Source: MuJoCo documentation, chapter Computation (mj_step1 computes what depends on position and velocity, then controls
    may be set, mj_step2 finishes the step).
    """

    def __init__(self, scene: Scene, settings: WorldSettings) -> None:
        """Take the scene; nothing is compiled yet."""
        self.scene = scene
        self._settings = settings
        self._parts: list[Part] = []
        self._next_ns: list[int] = []
        self._periods_ns: list[int] = []
        self._due_ns = 0
        self._now_ns = 0
        self._step_ns = 0
        self._begun_ns: int | None = 0
        self._mover_frames, self._mover_spans = pack_movers((), ())
        self._belts: list[tuple[int, int, float]] = []
        self._mocap_pos, self._mocap_quat = np.zeros((0, 3)), np.zeros((0, 4))  # of the compiled world's data
        self._model: Any = None
        self._data: Any = None

    @property
    def now_ns(self) -> int:
        """The world's time [ns]; it starts at zero."""
        return self._now_ns

    @property
    def scene_ns(self) -> int:
        """How long the scene's walkers have been on their way [ns]."""
        return 0 if self._begun_ns is None else self._now_ns - self._begun_ns

    @property
    def step_ns(self) -> int:
        """The physics step [ns]."""
        self._require_compiled()
        return self._step_ns

    @property
    def model(self) -> Any:
        """The `mujoco.MjModel`.  Raises DeviceError before `compile`."""
        self._require_compiled()
        return self._model

    @property
    def data(self) -> Any:
        """The `mujoco.MjData`.  Raises DeviceError before `compile`."""
        self._require_compiled()
        return self._data

    def add(self, part: Part) -> None:
        """Register a part.  Raises DeviceError once the world is compiled."""
        if self._model is not None:
            raise DeviceError("the simulated world is compiled already; no device can be added to it")
        self._parts.append(part)

    def hold(self) -> None:
        """Keep the scene's walkers and belts where they start until `begin`; everything else goes on."""
        self._begun_ns = None

    def begin(self) -> None:
        """Let the walkers and belts set off now, if they were held."""
        if self._begun_ns is None:
            self._begun_ns = self._now_ns

    def compile(self) -> None:
        """Build the model from scene and parts and settle the state at time zero.

        Raises:
            ConfigurationError: the physics step is larger than a part accepts.
        """
        spec = mujoco.MjSpec()
        step_s = self._choose_step()
        spec.option.timestep = step_s
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=FLOOR_BIT, conaffinity=0)
        start = self.scene.map_from_start
        base = spec.worldbody.add_body(name="base", pos=[start.x, start.y, 0.0], quat=_yaw_quaternion(start.yaw))
        for obstacle in self.scene.static:
            _add_static(spec, obstacle)
        for mover in self.scene.movers:
            _add_mover(spec, mover)
        for conveyor in self.scene.conveyors:
            _add_conveyor(spec, conveyor)
        for part in self._parts:
            part.build(spec, base)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._step_ns = round(step_s * SECOND_NS)
        self._bind()

    def step_to(self, time_ns: int) -> None:
        """Simulate until `now_ns` is `time_ns` (rounded down to the step grid).

        Raises:
            TrundleError: MuJoCo warns that the physics went wrong.
        """
        model, data = self.model, self._data
        moves = bool(len(self._mover_spans) or self._belts)
        while self._now_ns + self._step_ns <= time_ns:
            mujoco.mj_step2(model, data)
            self._now_ns += self._step_ns
            if moves:
                self._place_movers()
            mujoco.mj_step1(model, data)
            if self._now_ns >= self._due_ns:
                self._act()
        self._check_physics()

    def _choose_step(self) -> float:
        most = min((part.max_step_s for part in self._parts), default=0.002)
        asked = self._settings.physics_step_s
        if asked is not None and asked > most:
            raise ConfigurationError(
                f"world.physics_step_s is {asked} s, but a simulated device of this robot needs {most} s or less"
            )
        return most if asked is None else asked

    def _bind(self) -> None:
        model, data = self._model, self._data
        self._mocap_pos, self._mocap_quat = data.mocap_pos, data.mocap_quat
        mocap_ids = [int(model.body_mocapid[model.body(m.name).id]) for m in self.scene.movers]
        self._mover_frames, self._mover_spans = pack_movers(self.scene.movers, mocap_ids)
        self._belts = []
        for conveyor in self.scene.conveyors:
            joint = model.joint(f"{conveyor.name}_belt")
            self._belts.append((int(joint.qposadr[0]), int(joint.dofadr[0]), conveyor.speed_m_s))
        self._place_movers()
        mujoco.mj_step1(model, data)
        for part in self._parts:
            part.bind(self)
        self._next_ns, self._periods_ns = [0] * len(self._parts), [part.period_ns for part in self._parts]
        self._act()

    def _act(self) -> None:
        now_ns, next_ns = self._now_ns, self._next_ns
        for index, part in enumerate(self._parts):
            if next_ns[index] <= now_ns:
                part.act(self)
                next_ns[index] += self._periods_ns[index]
        self._due_ns = min(next_ns, default=1 << 62)

    def _place_movers(self) -> None:
        data, time_s, held = self._data, self.scene_ns / SECOND_NS, self._begun_ns is None
        place_movers(time_s, self._mover_frames, self._mover_spans, self._mocap_pos, self._mocap_quat)
        for position, velocity, speed_m_s in self._belts:
            # A belt that moves on and is put back every step: contact friction sees its velocity, its place stays.
            data.qpos[position], data.qvel[velocity] = 0.0, 0.0 if held else speed_m_s

    def _check_physics(self) -> None:
        for kind in range(len(self._data.warning)):
            if self._data.warning[kind].number:
                name = mujoco.mjtWarning(kind).name.removeprefix("mjWARN_").lower()
                raise TrundleError(f"the physics went wrong at {self._now_ns / SECOND_NS:.3f} s: MuJoCo warns of {name}")

    def _require_compiled(self) -> None:
        if self._model is None:
            raise DeviceError("the simulated world is not compiled yet")


def require_world(setup: DeviceSetup) -> MujocoWorld:
    """Return the world that a simulated device lives in.

    Raises:
        ConfigurationError: there is none.
    """
    if not isinstance(setup.world, MujocoWorld):
        raise ConfigurationError(
            f"robot.{setup.name} is a simulated device, so the configuration needs world.scenario (and no robot.emulation, "
            "which puts the world into another process)"
        )
    return setup.world


def _yaw_quaternion(yaw: float) -> list[float]:
    return [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]


def _add_solid(body: Any, name: str, shape: Shape, colour: tuple[float, float, float, float]) -> Any:
    x, y, z = shape.half_extents_m
    box = shape.kind is Kind.BOX
    return body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX if box else mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[x, y, z] if box else [x, z, 0.0],
        contype=OBSTACLE_BIT,
        conaffinity=OBSTACLE_BIT,
        rgba=np.array(colour),
    )


def _add_static(spec: Any, obstacle: StaticObstacle) -> None:
    pose = obstacle.map_from_shape
    z = obstacle.base_z_m + obstacle.shape.half_extents_m[2]
    geom = _add_solid(spec.worldbody, obstacle.name, obstacle.shape, (0.7, 0.7, 0.7, 1.0))
    geom.pos, geom.quat = [pose.x, pose.y, z], _yaw_quaternion(pose.yaw)


def _add_mover(spec: Any, mover: Mover) -> None:
    body = spec.worldbody.add_body(name=mover.name, pos=[0, 0, mover.shape.half_extents_m[2]], mocap=True)
    _add_solid(body, mover.name, mover.shape, (0.8, 0.4, 0.2, 1.0))


def _add_conveyor(spec: Any, conveyor: Conveyor) -> None:
    pose, top = conveyor.map_from_belt, conveyor.shape.half_extents_m[2]
    body = spec.worldbody.add_body(name=conveyor.name, pos=[pose.x, pose.y, top], quat=_yaw_quaternion(pose.yaw))
    body.add_joint(name=f"{conveyor.name}_belt", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1, 0, 0])
    body.mass, body.inertia, body.explicitinertial = 1e3, [1e3, 1e3, 1e3], True
    body.gravcomp = 1.0
    _add_solid(body, conveyor.name, conveyor.shape, (0.2, 0.2, 0.2, 1.0))
    for item in conveyor.items:
        p, half = item.map_from_shape, item.shape.half_extents_m[2]
        box = spec.worldbody.add_body(name=item.name, pos=[p.x, p.y, item.base_z_m + half], quat=_yaw_quaternion(p.yaw))
        box.add_freejoint()
        _add_solid(box, item.name, item.shape, (0.9, 0.8, 0.3, 1.0))
