"""A Franka arm's controller behind its research interface: what libfranka talks to, with a MuJoCo arm as the arm."""

from __future__ import annotations

import struct
from importlib import resources
from typing import Any, ClassVar, Protocol

import numpy as np
from pydantic import Field

from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.arm_model import MODEL, ArmBuild, PandaJoints
from sim_drivers.firmware.fault_script import FaultScript
from sim_drivers.firmware.fci_faults import FciFault
from sim_drivers.firmware.fci_machine import Command, Machine
from sim_drivers.firmware.fci_motion import CYCLE_NS
from sim_drivers.firmware.fci_port import FciPort
from sim_drivers.firmware.fci_protocol import (
    INVALID_ARGUMENT,
    NOT_POSSIBLE,
    SUCCESS,
    VERSION,
    Asked,
    Error,
    MoveStatus,
    Request,
    RobotMode,
    blank_state,
)
from sim_drivers.firmware.firmware import FirmwareSetup
from sim_drivers.world import MujocoWorld

UPPER_TORQUES = slice(21, 28)  # in a collision behaviour: lower and upper torque thresholds accelerating, then nominal


class FciWire(Protocol):
    """What both ends must agree on: the settings of the `franka` driver."""

    @property
    def host(self) -> str:
        """Address of the controller."""
        ...


class FciControllerSettings(ArmBuild):
    """The arm, its measurements and its misbehaviour."""

    protocol_version: int = Field(default=VERSION, ge=1, le=65535, description="that it speaks")
    collision_nm: float = Field(default=20.0, gt=0.0, le=100.0, description="a joint's external torque that makes a reflex")
    faults: tuple[FciFault, ...] = Field(default=(), description="misbehaviour, by script")


class FciController:
    """Streams its state each millisecond and obeys joint positions and velocities inside its limits, while they come in time."""

    Settings: ClassVar[type[Settings]] = FciControllerSettings
    max_step_s = 0.001
    period_ns = CYCLE_NS
    catch_up_ns: ClassVar[int] = 3 * CYCLE_NS // 2  # a client needs its time to answer: no two cycles come close together

    def __init__(self, driver_settings: FciWire, settings: FciControllerSettings, setup: FirmwareSetup) -> None:
        """Join the world."""
        self._settings = settings
        self._joints = PandaJoints(settings, setup.name)
        self._port = FciPort(setup.name, driver_settings.host)
        self._port.version = settings.protocol_version
        self._urdf = resources.files("configs").joinpath(MODEL).read_bytes()
        self._faults = FaultScript(settings.faults, stream(setup.seed, f"{setup.name}.faults"))
        self._rng = stream(setup.seed, f"{setup.name}.joints")
        self.machine = Machine(np.array(settings.start_rad), self._motion_ended, self._recovered)
        self.told = False  # whether the newest state is on its way to a client
        self._reflex_nm = np.full(7, settings.collision_nm)
        self._state = blank_state()
        self._measured_ns = -1
        self._moves: list[Asked] = []  # a motion that is running
        self._recoveries: list[Asked] = []
        self._outbox: list[tuple[Asked, int]] = []  # replies that must not overtake the state that shows what they say
        setup.world.add(self)

    @property
    def listens(self) -> str:
        """The TCP address."""
        return f"{self._port.place}, FCI protocol {self._settings.protocol_version}"

    def open(self) -> None:
        """Bind the wire.

        Raises:
            DeviceError: the port is taken.
        """
        self._port.open()

    def close(self) -> None:
        """Let go of the wire."""
        self._port.close()

    def build(self, spec: Any, base: Any) -> None:
        """Attach the arm."""
        self._joints.attach(spec, base)

    def bind(self, world: MujocoWorld) -> None:
        """Put the joints where they start."""
        self._joints.bind(world)

    def act(self, world: MujocoWorld) -> None:
        """One cycle of a millisecond: hear, decide, drive, tell."""
        scene_ns = world.scene_ns
        silent = self._faults.active("silent", scene_ns) is not None
        if not silent:
            for asked in self._port.requests():
                self._serve(asked, world)
        self._strike(world)
        if not self._port.is_connected:
            self.machine.expect_commands()
        self.machine.step(self._answer(scene_ns))
        self._joints.drive(world, self.machine.set_point.position_rad, self.machine.set_point.velocity_rad_s)
        self._look(world, scene_ns)
        self._state["message_id"] += 1
        self.told = self._port.is_connected and not silent and not self._faults.hits("lose_states", scene_ns)
        if self.told:
            self._port.send(self._state.tobytes())
        for asked, status in self._outbox:
            self._port.answer(asked, status)
        self._outbox.clear()

    def await_client(self, seconds: float) -> None:
        """Wait until the client has said something, at most so long: what a world that is stepped in lockstep does."""
        self._port.wait(seconds)

    def speed_rad_s(self, world: MujocoWorld) -> float:
        """Return how fast the fastest joint really turns."""
        return self._joints.speed_rad_s(world)

    def _answer(self, scene_ns: int) -> Command | None:
        """Return the command that answers the newest state; any other is late, and thereby lost."""
        newest = int(self._state["message_id"][0])
        found: Command | None = None
        for command in self._port.commands():
            if int(command["message_id"][0]) == newest and not self._faults.hits("lose_commands", scene_ns):
                found = command
        return found

    def _serve(self, asked: Asked, world: MujocoWorld) -> None:
        match asked.request:
            case _ if not asked.well_formed:
                self._port.answer(asked, INVALID_ARGUMENT)
            case Request.MOVE:
                controller, generator = struct.unpack_from("<II", asked.payload)
                status = self.machine.start(generator, controller)
                if status is MoveStatus.MOTION_STARTED:
                    self._moves = [asked]
                self._port.answer(asked, status)
            case Request.STOP_MOVE:
                self.machine.stop()
                self._port.answer(asked, SUCCESS)
            case Request.AUTOMATIC_ERROR_RECOVERY:
                self._recoveries.append(asked)
                self.machine.recover()
            case Request.GET_ROBOT_MODEL:
                self._port.answer(asked, SUCCESS, self._urdf)
            case _:
                self._port.answer(asked, self._set(asked, world))

    def _set(self, asked: Asked, world: MujocoWorld) -> int:
        if self.machine.mode is not RobotMode.IDLE:
            return NOT_POSSIBLE
        if asked.request is Request.SET_JOINT_IMPEDANCE:
            self._joints.stiffen(world, asked.doubles())
        elif asked.request is Request.SET_COLLISION_BEHAVIOR:
            self._reflex_nm = asked.doubles()[UPPER_TORQUES]
        return SUCCESS

    def _strike(self, world: MujocoWorld) -> None:
        """Let happen by itself what the script says, or what the arm has run into."""
        scene_ns = world.scene_ns
        self.machine.press_user_stop(pressed=self._faults.active("user_stop", scene_ns) is not None)
        hit = (np.abs(self._joints.external_nm(world)) > self._reflex_nm).any()
        if (hit and self.machine.is_moving) or self._faults.strikes("reflex", scene_ns):
            self.machine.reflex(Error.JOINT_REFLEX)
        if self._faults.strikes("preempt", scene_ns):
            self.machine.stop()
        if self._faults.strikes("disconnect", scene_ns):
            self._port.disconnect()

    def _look(self, world: MujocoWorld, scene_ns: int) -> None:
        """Fill in the state; where the world has not moved on, the joints are measured as before."""
        state, machine = self._state, self.machine
        if world.now_ns != self._measured_ns and not self._faults.active("freeze", scene_ns):
            self._measured_ns = world.now_ns
            state["q"], state["dq"], state["tau_J"] = self._joints.measure(world, self._rng)
            state["theta"], state["dtheta"] = state["q"], state["dq"]
            state["tau_ext_hat_filtered"] = self._joints.external_nm(world)
        if self._faults.active("nan", scene_ns):
            state["q"] = np.nan
        point = machine.set_point
        state["q_d"], state["dq_d"], state["ddq_d"] = point.position_rad, point.velocity_rad_s, point.acceleration_rad_s2
        state["generator"], state["controller"], state["robot_mode"] = machine.generator, machine.controller, machine.mode
        state["errors"], state["reflex_reason"] = machine.errors, machine.reflex_reason
        state["success_rate"] = machine.quality.rate if machine.is_moving else 0.0

    def _motion_ended(self, status: MoveStatus) -> None:
        self._outbox += [(asked, status) for asked in self._moves]
        self._moves = []

    def _recovered(self, status: int) -> None:
        self._outbox += [(asked, status) for asked in self._recoveries]
        self._recoveries = []
