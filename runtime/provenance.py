"""What the recording says about where it comes from, and the scene as plain shapes for the viewer."""

from __future__ import annotations

import time
from importlib import resources

from drivers.interface.geometry import SE2, SE3
from runtime.configuration import Choice, Configuration
from runtime.doctor.findings import recent_examination
from runtime.log.drawn.urdf import links_of
from runtime.log.header import ArmShape, RunHeader, SceneShape, code_version, library_versions, machine
from sim_drivers.scene import Scene, Shape


def run_header(configuration: Configuration, scene: Scene | None, seed: int) -> RunHeader:
    """Return the header of a run that is about to begin."""
    version, modified = code_version()
    return RunHeader(
        configuration_yaml=configuration.as_yaml(),
        seed=seed,
        scenario=configuration.scenario,
        planner=configuration.planner.choice.name,
        robot_radius_m=configuration.robot.radius_m,
        robot_height_m=configuration.robot.height_m,
        devices=tuple(name for name, _ in configuration.devices),
        arm=_arm(configuration),
        static=() if scene is None else _static(scene),
        movers=() if scene is None else _moving(scene),
        code_version=version,
        code_modified=modified,
        libraries=library_versions(),
        machine=machine(),
        doctor=recent_examination(configuration.robot.name, time.time()),
    )


def _arm(configuration: Configuration) -> ArmShape | None:
    """Return the arm's shape, where its driver names a model; an arm without a mount in its settings stands on the base."""
    arm: Choice | None = dict(configuration.devices).get("arm")
    model: str = getattr(arm.cls, "model", "") if arm is not None else ""
    if arm is None or not model:
        return None
    mount = {key: getattr(arm.settings, f"mount_{key}", 0.0) for key in ("x_m", "y_m", "z_m", "yaw_rad")}
    base_from_foot = SE3.from_euler(mount["x_m"], mount["y_m"], mount["z_m"], 0.0, 0.0, mount["yaw_rad"])
    return ArmShape(base_from_foot, links_of(resources.files("configs").joinpath(model).read_text(encoding="utf-8")))


def _static(scene: Scene) -> tuple[SceneShape, ...]:
    shapes = [_shape(o.name, o.shape, o.map_from_shape, o.base_z_m) for o in scene.static]
    return (*shapes, *(_shape(c.name, c.shape, c.map_from_belt) for c in scene.conveyors))


def _moving(scene: Scene) -> tuple[SceneShape, ...]:
    shapes = [_shape(m.name, m.shape, m.pose_at(0.0)) for m in scene.movers]
    items = [item for conveyor in scene.conveyors for item in conveyor.items]
    return (*shapes, *(_shape(item.name, item.shape, item.map_from_shape, item.base_z_m) for item in items))


def _shape(name: str, shape: Shape, map_from_shape: SE2, base_z_m: float = 0.0) -> SceneShape:
    return SceneShape(name, shape.kind.value, map_from_shape, shape.half_extents_m, base_z_m=base_z_m)
