"""MAVLink 2 packed by hand from its document (mavlink.io: Packet Serialization, Message Signing), without any library of it."""

import hashlib
import struct

# CRC_EXTRA of each message, as its document states
HEARTBEAT, COMMAND_LONG, SET_POSITION, ATTITUDE = (0, 50), (76, 152), (84, 143), (30, 39)


def crc(data: bytes) -> int:
    """CRC-16/MCRF4XX, bit by bit: polynomial 0x1021 reflected, initial value 0xFFFF."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0x8408 if value & 1 else 0)
    return value


def frame(message, payload, system=1, component=1, sequence=0, key=None, link=1, timestamp=0):
    number, extra = message
    while len(payload) > 1 and payload[-1] == 0:  # trailing zeros are not sent, except the first byte
        payload = payload[:-1]
    flags = 1 if key else 0
    body = bytes((len(payload), flags, 0, sequence, system, component)) + number.to_bytes(3, "little") + payload
    whole = b"\xfd" + body + struct.pack("<H", crc(body + bytes((extra,))))
    if key:
        whole += bytes((link,)) + timestamp.to_bytes(6, "little")
        whole += hashlib.sha256(key + whole).digest()[:6]
    return whole


def heartbeat(armed=False, mode=0, kind=10, autopilot=3, **header):
    return frame(HEARTBEAT, struct.pack("<IBBBBB", mode, kind, autopilot, 1 | 0x80 * armed, 4, 3), **header)
