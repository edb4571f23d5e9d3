"""One simulated second of each base in motion among forty boxes: physics, drives, encoders, and a loop at 20 Hz; no camera."""

from collections.abc import Callable

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceSetup
from drivers.interface.geometry import SE2
from sim_drivers.omni_base import SimOmniBase
from sim_drivers.scene import Scene, Shape, StaticObstacle
from sim_drivers.skid_steer_base import SimSkidSteerBase
from sim_drivers.world import MujocoWorld, WorldSettings

MS = 1_000_000


def world_second(driver: type[SimOmniBase] | type[SimSkidSteerBase], twist: BodyTwist, **settings: str) -> Callable[[], object]:
    """Return a call that drives on for one second of the world's time."""
    boxes = tuple(
        StaticObstacle(f"box_{index}", Shape.box(0.3, 0.3, 1.0), SE2(index % 10 - 4.5, 3.0 if index < 20 else -3.0 - index // 30))
        for index in range(40)
    )
    world = MujocoWorld(Scene("bench", SE2(), (), 1e6, boxes), WorldSettings())
    base = driver(driver.Settings(**settings), DeviceSetup("base", 1, lambda: world.now_ns, world))
    world.compile()
    base.open()

    def drive_on() -> None:
        for _ in range(20):
            base.command(twist, world.now_ns + 150 * MS)
            world.step_to(world.now_ns + 50 * MS)
            base.drain()

    return drive_on


def cases() -> list[tuple[str, Callable[[], object]]]:
    """Return what is timed, by name."""
    circle = BodyTwist(0.4, 0.2, 0.6)
    return [
        ("world_second_ideal", world_second(SimOmniBase, circle, wheels="ideal")),
        ("world_second_rollers", world_second(SimOmniBase, circle, wheels="rollers")),
        ("world_second_skid_steer", world_second(SimSkidSteerBase, BodyTwist(0.5, 0.0, 0.6))),
    ]
