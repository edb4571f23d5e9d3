"""What all simulated sensors share: they measure on a fixed grid while open, and their samples arrive late or never."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Generic, TypeVar

from drivers.interface.devices import DeviceHealth, DeviceSetup, DeviceState
from drivers.interface.samples import Stamp
from drivers.interface.seeds import stream
from sim_drivers.delivery import Delivery
from sim_drivers.world import SECOND_NS, MujocoWorld, require_world

S = TypeVar("S")


class SimSensor(ABC, Generic[S]):
    """A `Part` of the world that only looks, and the life of a `Device` around it.

    A lost sample is counted as dropped and leaves a gap in the sequence; what the loop does not fetch in time falls out of
    the buffer and is counted as overflowed.
    """

    def __init__(
        self, setup: DeviceSetup, rate_hz: float, latency_s: float = 0.0, loss_probability: float = 0.0, capacity: int = 1
    ) -> None:
        """Register with the world; at most `capacity` samples wait for the loop (1: only the newest counts).

        Raises:
            ConfigurationError: there is no simulated world.
        """
        self._setup = setup
        self._world = require_world(setup)
        self.max_step_s = min(0.01, 1.0 / rate_hz)
        self._period_ns = round(SECOND_NS / rate_hz)
        self._latency_ns = round(latency_s * SECOND_NS)
        self._loss_probability = loss_probability
        self._capacity = capacity
        self._state = DeviceState.CLOSED
        self._reset()
        self._world.add(self)

    @property
    def period_ns(self) -> int:
        """How often it measures [ns]."""
        return self._period_ns

    @abstractmethod
    def build(self, spec: Any, base: Any) -> None:
        """Add to the model what the sensor needs."""

    @abstractmethod
    def bind(self, world: MujocoWorld) -> None:
        """Look up ids in the compiled model, and let numba compile what `act` will need."""

    @abstractmethod
    def _measure(self, world: MujocoWorld, stamp: Stamp) -> S:
        """Return what the sensor measures now."""

    def act(self, world: MujocoWorld) -> None:
        """Measure and send, if open."""
        if self._state is not DeviceState.OPEN:
            return
        sample = self._measure(world, Stamp(world.now_ns, world.now_ns + self._latency_ns, self._sequence))
        if self._is_lost():
            self._dropped += 1
        else:
            self._delivery.send(world.now_ns, sample)
        self._sequence += 1

    def open(self) -> None:
        """Start measuring; counters and sequence begin anew."""
        if self._state is not DeviceState.OPEN:
            self._reset()
            self._state = DeviceState.OPEN

    def stop(self) -> None:
        """Do nothing: a sensor does not move."""

    def close(self) -> None:
        """Stop measuring; what was not fetched is gone."""
        self._state = DeviceState.CLOSED

    def health(self) -> DeviceHealth:
        """Say how it stands."""
        return DeviceHealth(
            device=self._setup.name,
            state=self._state,
            received=self._delivery.arrived,
            dropped=self._dropped,
            overflowed=self._delivery.overflowed,
            expected_period_ns=self._period_ns,
        )

    def drain(self) -> tuple[S, ...]:
        """Return every sample that has arrived since the last call, oldest first."""
        return self._delivery.drain(self._world.now_ns) if self._state is DeviceState.OPEN else ()

    def _reset(self) -> None:
        self._delivery: Delivery[S] = Delivery(self._latency_ns, self._capacity)
        self._losses = stream(self._setup.seed, f"{self._setup.name}.loss")  # one draw a sample, in their order
        self._sequence = self._dropped = 0

    def _is_lost(self) -> bool:
        return self._losses.random() < self._loss_probability
