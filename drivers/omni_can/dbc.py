"""From a DBC file to the messages that the driver speaks; cantools reads it, and this says what is missing in it."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from importlib import resources
from pathlib import Path

from cantools.database import load_string
from cantools.database.can import Database
from cantools.database.can import Message as DbcMessage
from cantools.database.can import Signal as DbcSignal
from cantools.database.errors import Error

from drivers.interface.errors import ConfigurationError
from drivers.omni_can.codec import COMMAND_MASK, Codec, Message, Signal

# What the driver relies on, in this order of signals; other messages and signals of the file are not looked at.
NEEDED = {
    "Heartbeat": ("Axis_Error", "Axis_State"),
    "Get_Encoder_Estimates": ("Pos_Estimate", "Vel_Estimate"),
    "Get_Bus_Voltage_Current": ("Bus_Voltage", "Bus_Current"),
    "Set_Axis_State": ("Axis_Requested_State",),
    "Set_Controller_Mode": ("Control_Mode", "Input_Mode"),
    "Set_Input_Vel": ("Input_Vel", "Input_Torque_FF"),
    "Clear_Errors": (),
}
OPTIONAL = ("Get_Version", "Get_Temperature")


def load_codec(firmware: str, path: Path | None = None) -> Codec:
    """Return the messages by name, of the shipped file for a firmware ("0.5" or "0.6") or of the user's own.

    Messages may carry the prefix of an axis (`Axis0_Heartbeat`), as in ODrive's own files; the command number is what counts.

    Raises:
        ConfigurationError: the file is missing, is no DBC, or lacks a message or signal; names it.
    """
    return _shipped(firmware) if path is None else _compiled(_read(path.read_text, str(path)), str(path))


@cache
def _shipped(firmware: str) -> Codec:
    name = f"cansimple_{firmware.replace('.', '_')}.dbc"
    return _compiled(_read(resources.files("drivers.omni_can").joinpath(name).read_text, name), name)


def _read(text_of: Callable[..., str], name: str) -> Database:
    try:
        database = load_string(text_of(encoding="utf-8"), "dbc")
    except (OSError, UnicodeDecodeError, Error) as error:
        raise ConfigurationError(f"robot.base.dbc: {name} cannot be read as a DBC file: {error}") from error
    assert isinstance(database, Database)
    return database


def _compiled(database: Database, name: str) -> Codec:
    found: dict[str, DbcMessage] = {}
    for message in sorted(database.messages, key=lambda message: message.frame_id):
        found.setdefault(re.sub(r"^Axis\d+_", "", message.name), message)
    codec = {}
    for wanted, signals in NEEDED.items():
        if wanted not in found:
            raise ConfigurationError(f"robot.base.dbc: {name} has no message {wanted}")
        missing = set(signals) - {signal.name for signal in found[wanted].signals}
        if missing:
            raise ConfigurationError(f"robot.base.dbc: the message {wanted} of {name} has no signal {min(missing)}")
    for wanted in (*NEEDED, *OPTIONAL):
        if wanted in found:
            codec[wanted] = _message(found[wanted], wanted, name)
    return codec


def _message(message: DbcMessage, wanted: str, name: str) -> Message:
    signals = sorted(message.signals, key=lambda signal: signal.start)
    for signal in signals:
        if signal.byte_order != "little_endian" or (signal.scale, signal.offset) != (1, 0) or signal.is_multiplexer:
            raise ConfigurationError(f"robot.base.dbc: {name}: the signal {wanted}.{signal.name} is not plain and little-endian")
    return Message(wanted, message.frame_id & COMMAND_MASK, message.length, tuple(_signal(signal) for signal in signals))


def _signal(signal: DbcSignal) -> Signal:
    kind = "f" if signal.is_float else "s" if signal.is_signed else "u"
    names = {int(value): str(choice) for value, choice in (signal.choices or {}).items()}
    return Signal(signal.name, signal.start, signal.length, kind, names)
