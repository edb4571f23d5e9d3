"""`python -m tests.faults.arm_world HOST PORT MEMORY`: the emulated arm's world, which tells a file how fast it turns.

The file holds two float64: the world's present on CLOCK_MONOTONIC [s], and the fastest joint's rate [rad/s].
"""

import sys
from pathlib import Path

import numpy as np

from runtime import configuration
from runtime.emulate import build, opened
from runtime.realtime import realtime
from sim_drivers.firmware.fci_controller import FciController


def main(host: str, port: str, memory: Path) -> None:
    told = (
        "robot=franka_emulated", "robot.camera=null", f"robot.arm.host={host}", f"robot.truth.port={port}",
        "loop.system.priority=50",
    )  # fmt: skip
    settings = configuration.load("arm_waypoints", told)
    emulation = build(settings, seed=0)
    (arm,) = (part for _, _, part in emulation.firmware if isinstance(part, FciController))
    seen = np.memmap(memory, np.float64, "r+", shape=(2,))
    with opened(emulation), realtime(settings.loop.system):
        emulation.run.start()
        print("ready", flush=True)
        while True:
            emulation.run.step()
            seen[:] = emulation.run.now_ns * 1e-9, arm.speed_rad_s(emulation.world)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], Path(sys.argv[3]))
