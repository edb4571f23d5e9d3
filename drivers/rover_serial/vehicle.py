"""What is known of the autopilot from what it says of itself."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from drivers.rover_serial.autopilots import BY_IDENTIFIER, Autopilot
from drivers.rover_serial.messages import Message

ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
PREARM_CHECK = 0x1000_0000  # MAV_SYS_STATUS_PREARM_CHECK
CAN_SPEAK_2, CAN_FOLLOW_LOCAL_NED = 0x2000, 0x80  # MAV_PROTOCOL_CAPABILITY
WORST = 4  # MAV_SEVERITY_WARNING and worse are reasons
UNKNOWN_MV = 65_535
RECENT_NS = 3_000_000_000
REASONS = 3  # the newest, so that a sentence stays one


@dataclass(slots=True)
class Vehicle:
    """An autopilot."""

    autopilot: Autopilot | None = None  # as of the first heartbeat
    other: tuple[int, int] = (0, 0)  # MAV_AUTOPILOT and MAV_TYPE of the newest heartbeat
    heartbeats: int = 0
    armed: bool = False
    custom_mode: int = 0
    firmware: str = ""
    serial: str = ""
    capabilities: int | None = None
    ready: bool | None = None  # its pre-arm checks; None: it does not say
    battery_v: float | None = None
    battery_fraction: float | None = None
    _texts: deque[tuple[int, str]] = field(default_factory=lambda: deque(maxlen=16))  # (when, text)
    _chunks: dict[int, str] = field(default_factory=dict)

    @property
    def follows(self) -> bool:
        """Whether it is armed and in the mode that follows set-points."""
        return self.armed and self.autopilot is not None and self.autopilot.is_in_mode(self.custom_mode)

    def take(self, name: str, message: Message, now_ns: int) -> None:
        """Take in a message of its."""
        match name:
            case "HEARTBEAT":
                self.autopilot = self.autopilot or BY_IDENTIFIER.get(message.autopilot)
                self.other = (message.autopilot, message.type)
                self.armed, self.custom_mode = bool(message.base_mode & ARMED), message.custom_mode
                self.heartbeats += 1
            case "AUTOPILOT_VERSION":
                version = message.flight_sw_version
                self.firmware = f"{version >> 24}.{version >> 16 & 0xFF}.{version >> 8 & 0xFF}"
                self.serial = f"{message.uid:016x}" if message.uid else ""
                self.capabilities = message.capabilities
            case "SYS_STATUS":
                if message.onboard_control_sensors_present & PREARM_CHECK:
                    self.ready = bool(message.onboard_control_sensors_health & PREARM_CHECK)
                self._power(message.voltage_battery, message.battery_remaining)
            case "BATTERY_STATUS":
                cells = [mv for mv in message.voltages if mv != UNKNOWN_MV]
                self._power(sum(cells) or UNKNOWN_MV, message.battery_remaining)
            case "STATUSTEXT":
                self._hear(message, now_ns)

    def reason(self, now_ns: int) -> str:
        """Return what it has complained of lately, newest last."""
        texts = dict.fromkeys(text for when_ns, text in self._texts if now_ns - when_ns <= RECENT_NS)
        return "; ".join([*texts][-REASONS:])

    def _power(self, millivolts: int, percent: int) -> None:
        if millivolts != UNKNOWN_MV:
            self.battery_v = millivolts * 1e-3
        if 0 <= percent <= 100:
            self.battery_fraction = percent * 0.01

    def _hear(self, message: Message, now_ns: int) -> None:
        """Keep a text that may be a reason; one in several chunks as soon as the last, which is not full, has come."""
        text = _text(message.text)
        if message.id:
            text = self._chunks.pop(message.id, "") + text if message.chunk_seq else text
            if len(message.text) == 50:
                self._chunks[message.id] = text
                return
        if message.severity <= WORST and text:
            self._texts.append((now_ns, text))


def _text(raw: str | bytes) -> str:
    text = raw.decode("utf-8", errors="replace") if isinstance(raw, bytes) else raw
    return "".join(character if character.isprintable() else " " for character in text)
