"""The three axes together: who on the bus is ours, what was heard of them, and what they are told."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.io.session import Port
from drivers.omni_can.axis import CLOSED_LOOP, Axis
from drivers.omni_can.bus_load import LoadMeter
from drivers.omni_can.cadence import Cadence
from drivers.omni_can.can_wire import BusChoice, Frame, Wire
from drivers.omni_can.codec import COMMAND_BITS, COMMAND_MASK, Codec

SAMPLE = np.dtype(
    [("captured_ns", "i8"), ("received_ns", "i8"), ("sequence", "i8"), ("turns", "f8", (3,)), ("turns_s", "f8", (3,))]
)
HEARD = ("Heartbeat", "Get_Encoder_Estimates", "Get_Bus_Voltage_Current", "Get_Temperature", "Get_Version")
TOLD = ("Set_Axis_State", "Set_Controller_Mode", "Set_Input_Vel", "Clear_Errors")
VELOCITY_CONTROL = 2
INPUT_MODES = {"passthrough": 1, "vel_ramp": 2}
STANDING_TURNS_S = 0.02
ZERO = (0.0, 0.0, 0.0)
BELIEF = 2.0  # times the fastest turning that the base can be asked for


@dataclass(frozen=True, slots=True)
class SessionSettings:
    """What the session needs of the base's settings; the messages are compiled already."""

    bus: BusChoice
    hears_itself: bool
    bit_rate: int
    codecs: dict[str, Codec]  # by firmware; two: find out which
    node_ids: tuple[int, ...]
    input_mode: str
    watchdog_s: float
    verify_watchdog: bool
    heartbeat_s: float
    encoder_s: float
    latency_s: float
    connect_s: float
    silent_s: float
    brake_s: float
    gather_s: float
    fastest_turns_s: float
    battery_empty_v: float
    battery_full_v: float


class Axes:
    """Three axes on one bus."""

    def __init__(self, settings: SessionSettings, port: Port, wire: Wire) -> None:
        """Take the bus; nothing has been heard, and nothing is said but the question for the firmware's version."""
        self._settings = settings
        self._health = port.health
        self._ring = port.rings["wheels"]
        self._wire = wire
        self._sequence = self._ring.written
        self._newest_ns = -1  # when the last sample was captured
        self.load = LoadMeter(settings.bit_rate)
        self.firmware = next(iter(settings.codecs)) if len(settings.codecs) == 1 else ""  # empty: not known yet
        self._version = settings.codecs["0.6"].get("Get_Version") if "0.6" in settings.codecs else None
        self.choose(self.firmware or "0.5")
        if self._version is not None:
            for node in settings.node_ids:
                wire.send(node << COMMAND_BITS | self._version.command, b"", request=True)

    @property
    def standing(self) -> bool:
        """Whether no wheel turns."""
        return all(axis.turning is not None and abs(axis.turning.turns_s) < STANDING_TURNS_S for axis in self.each)

    def receive(self, now_ns: int) -> bool:
        """Take in what has come; return whether anything has.

        Raises:
            DeviceError: the bus is gone.
        """
        came = False
        for frame in self._wire.receive(now_ns):
            self._take(frame, now_ns)
            came = True
        self.load.update(now_ns)
        return came

    def arm(self) -> None:
        """Clear errors, set velocity control and zero, and ask for closed loop."""
        for axis in self.each:
            self._send_to(axis.node, "Clear_Errors", *([0] * len(self._codec["Clear_Errors"].signals)))
            self._send_to(axis.node, "Set_Controller_Mode", VELOCITY_CONTROL, INPUT_MODES[self._settings.input_mode])
        self.send_rates(ZERO)
        self.request(CLOSED_LOOP)

    def choose(self, firmware: str) -> None:
        """Speak a firmware's messages from now on; what was heard before is forgotten."""
        s = self._settings
        self._codec: Codec = s.codecs[firmware]
        self.each = [
            Axis(
                f"axis {index + 1} (node {node})",
                node,
                self._codec,
                BELIEF * s.fastest_turns_s,
                Cadence(round(s.encoder_s * 1e9)),
            )
            for index, node in enumerate(s.node_ids)
        ]
        self._missed = [0] * len(self.each)  # believed encoder frames since the last sample, of each axis
        self._by_node = {axis.node: index for index, axis in enumerate(self.each)}
        self._heard = {self._codec[name].command: self._codec[name] for name in HEARD if name in self._codec}
        self._told = {self._codec[name].command for name in TOLD}

    def send_rates(self, turns_s: tuple[float, ...]) -> None:
        """Send motor rates [turn/s]."""
        for axis, rate in zip(self.each, turns_s, strict=True):
            self._send_to(axis.node, "Set_Input_Vel", rate, 0.0)

    def request(self, state: int) -> None:
        """Ask every axis for a state."""
        for axis in self.each:
            self._send_to(axis.node, "Set_Axis_State", state)

    def _take(self, frame: Frame, now_ns: int) -> None:
        """Take in one frame; count what is not ours, and drop what cannot be."""
        self.load.add(len(frame.data))
        index = self._by_node.get(frame.identifier >> COMMAND_BITS)
        command = frame.identifier & COMMAND_MASK
        if index is None or not frame.is_plain:
            self._health.foreign += not (self._settings.hears_itself and index is not None)
            return
        self._find_out(command, frame)
        message = self._heard.get(command)
        if message is None:
            self._health.foreign += not (self._settings.hears_itself and command in self._told)
            return
        self._health.received += 1
        if not self.each[index].take(message, frame.data, now_ns - frame.age_ns):
            self._health.dropped += 1
        elif message.name == "Get_Encoder_Estimates":
            self._gather(index, now_ns)

    def _find_out(self, command: int, frame: Frame) -> None:
        """Who answers Get_Version speaks 0.6."""
        version = self._version
        if not self.firmware and version is not None and command == version.command and len(frame.data) == version.length:
            self.firmware = "0.6"
            self.choose("0.6")

    def _gather(self, index: int, now_ns: int) -> None:
        """Make a sample of the three encoders as soon as each has told something new; at the time of the newest."""
        self._missed[index] += 1
        if not all(self._missed):
            return
        lost = max(self._missed) - 1  # a frame of one axis, and with it a sample, did not come
        self._missed = [0] * len(self._missed)
        self._health.dropped += lost
        self._sequence += 1 + lost
        turning = [axis.turning for axis in self.each if axis.turning is not None]
        captured_ns = max(each.captured_ns for each in turning)
        if captured_ns <= self._newest_ns:  # the bus's clock has jumped
            self._health.dropped += 1
            return
        self._newest_ns = captured_ns
        turns = [each.turns + each.turns_s * (captured_ns - each.captured_ns) * 1e-9 for each in turning]
        latency_ns = round(self._settings.latency_s * 1e9)
        turns_s = [each.turns_s for each in turning]
        self._ring.put((captured_ns - latency_ns, now_ns, self._sequence, turns, turns_s))

    def _send_to(self, node: int, name: str, *values: float) -> None:
        message = self._codec[name]
        data = message.encode(*values)
        if not self._settings.hears_itself:
            self.load.add(len(data))
        self._wire.send(node << COMMAND_BITS | message.command, data)
