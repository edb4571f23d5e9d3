"""An emulated FCI controller in a process of its own: pylibfranka holds the interpreter's lock while it waits for it."""

import multiprocessing
import os
import random
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from drivers.interface.geometry import SE2
from sim_drivers.firmware.fci_controller import FciController
from sim_drivers.firmware.fci_lockstep import run_lockstep
from sim_drivers.firmware.firmware import FirmwareSetup, LockstepHost
from sim_drivers.scene import Scene
from sim_drivers.world import MujocoWorld, WorldSettings

FORKS = multiprocessing.get_context("forkserver")  # MuJoCo is loaded once
FORKS.set_forkserver_preload([__name__])


@dataclass(frozen=True)
class Wire:
    """What a franka driver's settings would say."""

    host: str


def controller_of(host: str, seed: int = 1, scene: Scene | None = None, **settings: Any) -> tuple[MujocoWorld, FciController]:
    """Return a compiled world with a controller in it."""
    world = MujocoWorld(scene or Scene("bench", SE2(), (), 60.0, ()), WorldSettings())
    setup = FirmwareSetup("arm", seed, world, LockstepHost(world))
    controller = FciController(Wire(host), FciController.Settings(**settings), setup)
    world.compile()
    return world, controller


def free_host() -> str:
    """Return a loopback address on which nobody listens: the port is the protocol's."""
    draw = random.SystemRandom()
    while True:
        host = f"127.{draw.randrange(1, 255)}.{draw.randrange(256)}.{draw.randrange(1, 255)}"
        with socket.socket() as listener, suppress(OSError):
            listener.bind((host, 1337))
            return host


@contextmanager
def lockstep_server(seed: int = 1, **settings: Any) -> Iterator[str]:
    """Serve in lockstep within the block; yields the address."""
    host, (ours, theirs) = free_host(), FORKS.Pipe()
    process = FORKS.Process(target=_serve, args=(theirs, host, seed, settings), daemon=True)
    process.start()
    try:
        assert ours.recv() == "ready"
        yield host
    finally:
        process.kill()
        process.join()
        ours.close()


def _serve(told: Any, host: str, seed: int, settings: dict[str, Any]) -> None:
    parent = os.getppid()
    world, controller = controller_of(host, seed, **settings)
    controller.open()
    told.send("ready")
    run_lockstep(world, controller, lambda: os.getppid() != parent)
