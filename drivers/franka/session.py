"""What the process at the arm does: reads each state, answers it while a motion runs, and brings the arm to rest.

Source: Franka Control Interface documentation and libfranka's reference.  A motion begins with the first order and ends when the
arm has stood for a while; in between every state is answered within its millisecond.
"""

from __future__ import annotations

import enum
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivers.franka.client import MILLISECOND_NS, ArmState, Client, LibfrankaClient, MotionAbortedError
from drivers.franka.exchange import Exchange, RobotClock
from drivers.franka.orders import unpacked
from drivers.franka.settings import FrankaSettings
from drivers.interface.arm_motion import PANDA
from drivers.interface.devices import DeviceState
from drivers.io.session import Port

SAMPLE = np.dtype(
    [
        ("captured_ns", "i8"),
        ("received_ns", "i8"),
        ("sequence", "i8"),
        ("position_rad", "f8", (7,)),
        ("velocity_rad_s", "f8", (7,)),
        ("torque_nm", "f8", (7,)),
    ]
)
GRACE_STATES = 200  # for opening to succeed: an arm in a reflex is there, and the operator's reset must be able to reach it
READY_MODES = frozenset({"Idle", "Move", "AutomaticErrorRecovery"})
NOTHING = np.zeros(0)
BRAKE_MS = 1500  # the longest that closing waits for the arm to stand
BELIEVED_RAD = 0.1  # beyond a joint's range
FROZEN_AFTER = 20  # equal states in a row: a torque sensor is never so quiet
KEPT, RESUMED, CYCLES, STATES_LOST = range(4)  # places in the health's figures


class Phase(enum.Enum):
    """Where it stands."""

    READY = "ready"  # no motion; the next order begins one
    MOVING = "moving"
    FAULTED = "faulted"


class FrankaSession:
    """Drives one arm."""

    def __init__(
        self,
        settings: FrankaSettings,
        port: Port,
        connect: Callable[[str, FrankaSettings], Client] = LibfrankaClient,
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Remember; nothing is touched.  Reading waits for the next state, so only the clock knows when that came."""
        self._settings = settings
        self._port = port
        self._health = port.health
        self._ring = port.rings["joints"]
        self._connect = connect
        self._clock = clock
        self._client: Client | None = None
        self._exchange: Exchange | None = None  # of the motion that runs
        self._last: ArmState | None = None
        self._order = NOTHING  # that is being followed
        self._sequence = 0
        self._phase = Phase.READY
        self._prepared = False

    def open(self) -> None:
        """Connect; the arm stays at rest.

        Raises:
            DeviceError: it cannot be used.
        """
        self._client = self._connect(self._port.name, self._settings)
        self._health.protocol = f"FCI, libfranka {getattr(self._client, 'version', '')}".strip()
        self._robot_clock = RobotClock()
        self._exchange, self._last = None, None
        self._seen = self._equal = self._cycles = self._resumed = self._states_lost = 0
        self._kept = 0.0  # sum of the success rates
        self._first_slot: int | None = None
        self._base = max(self._ring.written, self._sequence)
        self._prepared = False
        if self._port.reopened:
            self._fail("it was lost and is back; it moves again after the operator's reset")
        else:
            self._be_ready()

    def wakes_on(self) -> tuple[int, ...]:
        """Return nothing: polling waits for the next state itself."""
        return ()

    def next_ns(self, now_ns: int) -> int:
        """Return `now_ns`: the next state is never far."""
        return now_ns

    def poll(self, now_ns: int) -> None:
        """Wait for the next state, and answer it.

        Raises:
            DeviceError: the wire is lost.
        """
        assert self._client is not None
        try:
            state = self._client.read()
            arrived_ns = self._clock()
            if self._exchange is not None:  # first of all: the answer is due within the millisecond
                self._answer(self._client, self._exchange, state)
            self._deliver(state, arrived_ns)
            if self._exchange is None:
                self._judge(state)
        except MotionAbortedError as aborted:
            self._abort(str(aborted))

    def send(self, values: NDArray[np.float64], now_ns: int) -> None:
        """Follow a trajectory; the first one begins a motion."""
        if self._exchange is not None and np.array_equal(values, self._order):
            return  # the same again: it only lives longer, and a spline takes its time to build
        trajectory = unpacked(values)
        if self._phase is Phase.FAULTED or not self._prepared or self._last is None or self._client is None:
            return
        if trajectory.is_rest:
            self.rest()
            return
        if self._exchange is None:
            try:
                self._client.start()
            except MotionAbortedError as aborted:
                self._abort(str(aborted))
                return
            self._exchange, self._phase, self._order = Exchange(self._last), Phase.MOVING, NOTHING
        self._order = values
        self._exchange.follow(replace(trajectory, start_ns=self._robot_clock.to_robot(trajectory.start_ns)))

    def rest(self) -> None:
        """Decelerate to rest."""
        self._order = NOTHING
        if self._exchange is not None:
            self._exchange.stop()

    def clear_faults(self) -> None:
        """Recover from a reflex and take orders again; what still holds is a fault again at the next state."""
        if self._phase is not Phase.FAULTED or self._client is None:
            return
        try:
            if self._client.read().mode == "Reflex":
                self._client.recover()
            self._seen = GRACE_STATES
            self._be_ready()
        except MotionAbortedError as aborted:
            self._fail(f"its errors could not be cleared: {aborted}")

    def close(self) -> None:
        """Bring the arm to rest, end the motion, and hang up."""
        client, exchange = self._client, self._exchange
        self._client = self._exchange = None
        if client is None:
            return
        try:
            if exchange is not None:
                with suppress(MotionAbortedError):  # then the controller brakes
                    self._brake(client, exchange)
        finally:
            client.close()

    def _brake(self, client: Client, exchange: Exchange) -> None:
        exchange.stop()
        for _ in range(BRAKE_MS):
            client.write(exchange.answer(client.read()), last=exchange.is_at_rest)
            if exchange.is_at_rest:
                return

    def _answer(self, client: Client, exchange: Exchange, state: ArmState) -> None:
        resumed = exchange.resumed
        client.write(exchange.answer(state), last=exchange.is_over)
        self._cycles += 1
        self._kept += state.success_rate
        self._resumed += exchange.resumed - resumed
        if exchange.is_over:
            self._exchange, self._phase = None, Phase.READY
        figures = self._health.figures
        figures[KEPT], figures[RESUMED], figures[CYCLES] = self._kept / self._cycles, self._resumed, self._cycles

    def _judge(self, state: ArmState) -> None:
        """See, while no motion runs, whether one could, and set the arm up for it."""
        if self._seen <= GRACE_STATES and state.mode != "Idle":
            return
        if state.mode == "UserStopped":
            self._fail("the user stop is pressed; release it, then reset")
        elif state.mode == "Reflex" and self._phase is not Phase.FAULTED:
            self._abort(f"a reflex has stopped the arm: {state.errors or 'no reason is given'}")
        elif state.mode not in READY_MODES and state.mode != "Reflex":
            self._fail(f"the controller is in the mode {state.mode} and takes no motion; unlock the joints and activate FCI")
        elif state.mode == "Idle" and not self._prepared and self._client is not None:
            self._client.prepare()
            self._prepared = True

    def _abort(self, reason: str) -> None:
        """A motion has ended, or could not begin, at the controller's will."""
        self._exchange = None
        if self._settings.auto_recover and "reflex" in reason and self._client is not None:
            with suppress(MotionAbortedError):
                self._client.recover()
                self._be_ready()
                return
        self._fail(_explained(reason))

    def _be_ready(self) -> None:
        self._phase = Phase.READY
        self._health.state, self._health.fault = DeviceState.OPEN, ""

    def _fail(self, fault: str) -> None:
        self._phase = Phase.FAULTED
        self._health.state, self._health.fault = DeviceState.FAULTED, f"{self._port.name}: {fault}"

    def _deliver(self, state: ArmState, now_ns: int) -> None:
        """Keep time, count, and hand every so many milliseconds a believed state to the loop."""
        last, self._last = self._last, state
        self._robot_clock.update(state.robot_ns, now_ns)
        self._health.received += 1
        self._seen += 1
        if last is not None:
            self._states_lost += (state.robot_ns - last.robot_ns) // MILLISECOND_NS - 1
            self._health.figures[STATES_LOST] = self._states_lost
            self._equal = self._equal + 1 if _equal(state, last) else 0
        period_ns = self._settings.decimation * MILLISECOND_NS
        slot = state.robot_ns // period_ns
        if self._first_slot is None:
            self._first_slot = slot
        elif last is not None and slot == last.robot_ns // period_ns:
            return
        if self._equal >= FROZEN_AFTER or not _believed(state):
            self._health.dropped += 1
            return
        captured_ns = self._robot_clock.to_host(state.robot_ns) - round(self._settings.latency_s * 1e9)
        self._sequence = self._base + slot - self._first_slot + 1
        self._ring.put((captured_ns, now_ns, self._sequence, state.position_rad, state.velocity_rad_s, state.torque_nm))


def _equal(one: ArmState, other: ArmState) -> bool:
    return one.torque_nm.tobytes() == other.torque_nm.tobytes() and one.velocity_rad_s.tobytes() == other.velocity_rad_s.tobytes()


def _believed(state: ArmState) -> bool:
    """Whether it is finite and the joints are where and as fast as they can be."""
    inside = (state.position_rad > PANDA.position_min_rad - BELIEVED_RAD) & (
        state.position_rad < PANDA.position_max_rad + BELIEVED_RAD
    )
    slow = np.abs(state.velocity_rad_s) < 2.0 * PANDA.velocity_rad_s
    return bool(inside.all() and slow.all() and np.isfinite(state.torque_nm).all())


def _explained(reason: str) -> str:
    """Return why a motion ended, for someone who does not know libfranka."""
    if "communication_constraints_violation" in reason:
        return f"too many of its commands came late, and the controller stopped the arm ({reason}); reset to go on"
    if "preempted" in reason:
        return f"someone else has taken the motion over ({reason}); reset to go on"
    if "emergency" in reason or "user stop" in reason.lower():
        return f"the user stop was pressed ({reason}); release it, then reset"
    return f"the controller stopped the arm ({reason}); reset to go on"
