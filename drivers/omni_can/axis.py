"""What is known of one motor controller, from what it sends; nothing that cannot be is believed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivers.omni_can.cadence import Cadence
from drivers.omni_can.codec import Codec, Message, bit_names

CLOSED_LOOP = 8
IDLE = 1
WATCHDOG = "WATCHDOG_TIMER_EXPIRED"
FROZEN_AFTER = 5  # equal positions in a row of a wheel that says it turns
POSITION_SLACK_TURNS = 0.05  # besides what the speed allows


@dataclass(slots=True)
class Turning:
    """A believed encoder frame, with the angle going on where an axis that was rebooted begins anew."""

    captured_ns: int
    turns: float
    turns_s: float


@dataclass(slots=True)
class Axis:
    """One controller."""

    name: str
    node: int
    codec: Codec
    fastest_turns_s: float  # what is faster is not believed
    cadence: Cadence  # of its encoder's messages
    state: int | None = None  # as of the last heartbeat
    error: int = 0
    turning: Turning | None = None
    voltage_v: float = math.nan
    temperature_c: float = math.nan
    firmware: str = ""
    last_ns: int = 0  # when it was last heard
    _offset_turns: float = 0.0
    _doubted: tuple[int, float] | None = None  # when and where a jump went
    _equal: int = 0
    _errors: tuple[str, ...] = ()

    @property
    def heard(self) -> bool:
        """Whether heartbeat and encoder have both come."""
        return self.state is not None and self.turning is not None

    @property
    def is_closed_loop(self) -> bool:
        """Whether it drives its motor."""
        return self.state == CLOSED_LOOP

    @property
    def errors(self) -> str:
        """Its errors by name; empty when there are none."""
        heartbeat = self.codec["Heartbeat"]
        named = bit_names(self.error, heartbeat.signals[heartbeat.index("Axis_Error")].names)
        return ", ".join((named, *self._errors) if named else self._errors)

    @property
    def condition(self) -> str:
        """Its errors, or without any its state, by name."""
        heartbeat = self.codec["Heartbeat"]
        states = heartbeat.signals[heartbeat.index("Axis_State")].names
        return self.errors or states.get(self.state or 0, f"state {self.state}")

    @property
    def tripped(self) -> bool:
        """Whether its watchdog has disarmed it."""
        return not self.is_closed_loop and WATCHDOG in self.errors

    def take(self, message: Message, data: bytes | bytearray, captured_ns: int) -> bool:
        """Take in a message of its; return whether it was believed."""
        if len(data) != message.length:
            return False
        values = message.decode(data)
        self.last_ns = captured_ns
        match message.name:
            case "Get_Encoder_Estimates":
                return self._turn(self.cadence.captured_ns(captured_ns), float(values[0]), float(values[1]))
            case "Heartbeat":
                return self._beat(message, values)
            case "Get_Bus_Voltage_Current":
                return self._power(float(values[0]))
            case "Get_Temperature":
                self.temperature_c = float(values[0])
                return -60.0 < self.temperature_c < 250.0
            case "Get_Version":
                self.firmware = ".".join(str(value) for value in values[4:7])
                return True
        return False

    def _beat(self, message: Message, values: tuple[int | float, ...]) -> bool:
        named = dict(zip((signal.name for signal in message.signals), values, strict=True))
        state = int(named["Axis_State"])
        states = message.signals[message.index("Axis_State")].names
        if states and state not in states:
            return False
        self.state, self.error = state, int(named["Axis_Error"])
        self._errors = tuple(
            name.removesuffix("_Flag").upper() for name, value in named.items() if "Error_Flag" in name and value
        )
        return True

    def _power(self, voltage_v: float) -> bool:
        if not 0.0 <= voltage_v < 100.0:  # also when it is no number
            return False
        self.voltage_v = voltage_v
        return True

    def _turn(self, captured_ns: int, turns: float, turns_s: float) -> bool:
        if not (math.isfinite(turns) and abs(turns_s) <= self.fastest_turns_s):
            return False
        last = self.turning
        if last is None:
            self._offset_turns = -turns  # angles count from where the base was opened
            self.turning = Turning(captured_ns, 0.0, turns_s)
            return True
        here = turns + self._offset_turns
        if not self._reachable(captured_ns - last.captured_ns, here - last.turns):
            return self._doubt(captured_ns, turns, turns_s, last)
        self._doubted = None
        self._equal = self._equal + 1 if here == last.turns and abs(turns_s) > POSITION_SLACK_TURNS else 0
        if self._equal >= FROZEN_AFTER:
            return False
        self.turning = Turning(captured_ns, here, turns_s)
        return True

    def _doubt(self, captured_ns: int, turns: float, turns_s: float, last: Turning) -> bool:
        """Drop a jump; one that the next frame confirms is an axis that counts anew, and its angle goes on from where it was."""
        doubted, self._doubted = self._doubted, (captured_ns, turns)
        if doubted is None or not self._reachable(captured_ns - doubted[0], turns - doubted[1]):
            return False
        self._offset_turns, self._doubted = last.turns - turns, None
        self.turning = Turning(captured_ns, last.turns, turns_s)
        return True

    def _reachable(self, elapsed_ns: int, turns: float) -> bool:
        return abs(turns) <= self.fastest_turns_s * max(elapsed_ns, 0) * 1e-9 + POSITION_SLACK_TURNS
