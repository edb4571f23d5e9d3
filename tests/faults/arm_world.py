"""`python -m tests.faults.arm_world HOST PORT MEMORY`: the emulated arm's world, which tells a file how it turns.

The file holds four float64: the world's present on CLOCK_MONOTONIC [s], the fastest joint's rate [rad/s], when the set point last
began to brake harder than a swing does [s], and for how long the world has stood still since [s].
"""

import sys
from pathlib import Path

import numpy as np

from runtime import configuration
from runtime.emulate import build, opened
from runtime.realtime import realtime
from sim_drivers.firmware.fci_controller import FciController
from sim_drivers.firmware.fci_motion import SetPoint

BRAKING_RAD_S2 = 5.0  # of the 15 that the joint can; a swing takes 2.5


def main(host: str, port: str, memory: Path) -> None:
    told = (
        "robot=franka_emulated", "robot.camera=null", f"robot.arm.host={host}", f"robot.truth.port={port}",
        "loop.system.priority=50",
    )  # fmt: skip
    settings = configuration.load("arm_waypoints", told)
    emulation = build(settings, seed=0)
    (arm,) = (part for _, _, part in emulation.firmware if isinstance(part, FciController))
    seen = np.memmap(memory, np.float64, "r+", shape=(4,))
    with opened(emulation), realtime(settings.loop.system):
        emulation.run.start()
        print("ready", flush=True)
        brakes, began_s, late_ns = False, 0.0, 0
        while True:
            emulation.run.step()
            now_s = emulation.run.now_ns * 1e-9
            brakes, braked = is_braking(arm.machine.set_point), brakes
            if brakes and not braked:
                began_s, late_ns = now_s, emulation.run.late_ns
            seen[:] = now_s, arm.speed_rad_s(emulation.world), began_s, (emulation.run.late_ns - late_ns) * 1e-9


def is_braking(point: SetPoint) -> bool:
    """Whether the first joint's set point slows down as no swing of the commander does."""
    return bool(-np.sign(point.velocity_rad_s[0]) * point.acceleration_rad_s2[0] > BRAKING_RAD_S2)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
