"""A controller and its client in lockstep: no state is sent before the last one has been answered."""

from __future__ import annotations

from collections.abc import Callable

from sim_drivers.firmware.fci_controller import FciController
from sim_drivers.world import MujocoWorld

PATIENCE_S = 0.3  # a state that begins a motion is not answered
IDLE_S = 0.001


def run_lockstep(world: MujocoWorld, controller: FciController, over: Callable[[], bool]) -> None:
    """Step a world with an opened controller until `over`; while no motion runs its physics stand still.

    So the client's commands, and not how fast its process happens to run, decide what happens.
    """
    while not over():
        if controller.machine.is_moving:
            if controller.told:
                controller.await_client(PATIENCE_S)
            world.step_to(world.now_ns + world.step_ns)
        else:
            controller.await_client(IDLE_S)
            controller.act(world)
