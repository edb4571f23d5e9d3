"""A runtime reduced to its arm: `python -m tests.faults.arm_commander HOST` swings the first joint until it is told or ended."""

import signal
import sys
import time

import numpy as np

from drivers.franka.driver import FrankaArm
from drivers.interface.commands import JointTrajectory
from drivers.interface.devices import DeviceSetup, DeviceState
from tests.faults.told import until_told

LIFETIME_NS = 250_000_000
SWING_RAD, SWING_S = 2.0, 2.2
SETTLED_S = 0.5  # an arm that is in a reflex says so by then


def main(host: str) -> None:
    arm = FrankaArm(FrankaArm.Settings(host=host), DeviceSetup("arm", 0, time.monotonic_ns))
    arm.open()
    began_s = time.monotonic()
    while arm.health().state is not DeviceState.OPEN or time.monotonic() < began_s + SETTLED_S:
        arm.clear_faults()  # what the last try has left behind
        time.sleep(0.2)
    here = arm.drain()[-1].position_rad
    swing = swing_from(here)
    for _ in until_told():
        if time.monotonic_ns() > swing.start_ns + (SWING_S + 0.2) * 1e9:
            swing = swing_from(swing.position_rad[1])
        arm.command(swing, time.monotonic_ns() + LIFETIME_NS)
    arm.stop()
    signal.pause()


def swing_from(here: np.ndarray) -> JointTrajectory:
    """Return the way to the other side, from a position of shape (7,)."""
    ends = np.stack((here, here))
    ends[1, 0] = -np.sign(here[0] or 1.0) * 0.5 * SWING_RAD
    return JointTrajectory(time.monotonic_ns(), np.array([0.0, SWING_S]), ends, np.zeros_like(ends))


if __name__ == "__main__":
    main(sys.argv[1])
