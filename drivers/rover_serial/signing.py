"""Message signing: which frames come from somebody who has the key, and are not old ones played again.

Source: MAVLink developer guide, Message Signing (Authentication).  Other than in pymavlink, a frame's time counts only after its
signature was found right: otherwise one forged frame with a time in the future would shut the autopilot out.
"""

from __future__ import annotations

import hashlib
import hmac
from pathlib import Path

from drivers.interface.errors import ConfigurationError
from drivers.rover_serial.frames import SIGNATURE, Frame

KEY_BYTES = 32
_DIGEST, _TIME = 6, 6
EPOCH_S = 1_420_070_400  # 1 January 2015, seconds since the Unix epoch
TICK_NS = 10_000
MINUTE = 6_000_000  # ticks
LINK_ID = 1


def read_key(path: Path) -> bytes:
    """Return the key in a file: 32 bytes, or 64 hexadecimal digits.

    Raises:
        ConfigurationError: there is no such file, or no key in it.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ConfigurationError(f"signing_key: {path} cannot be read ({error.strerror})") from error
    if len(content) == KEY_BYTES:
        return content
    try:
        key = bytes.fromhex(content.decode("ascii"))
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise ConfigurationError(f"signing_key: {path} holds no key; it must be 32 bytes, or 64 hexadecimal digits")
    return key


def timestamp_of(unix_ns: int) -> int:
    """Return a time as signatures carry it.

    >>> timestamp_of(1_420_070_400_000_010_000)
    1
    """
    return (unix_ns - EPOCH_S * 1_000_000_000) // TICK_NS


def signature_of(key: bytes, signed: bytes) -> bytes:
    """Return the six bytes that end a frame, given all that comes before: header, payload, checksum, link and time."""
    return hashlib.sha256(key + signed).digest()[:_DIGEST]


class Verifier:
    """Refuses what is unsigned, signed with another key, or old."""

    def __init__(self, key: bytes, timestamp: int) -> None:
        """Take the key and what time it is."""
        self._key = key
        self.timestamp = timestamp  # the newest that is known
        self._streams: dict[tuple[int, int, int], int] = {}
        self.refused = 0

    def accepts(self, frame: Frame) -> bool:
        """Whether a frame may be believed; counts those that may not."""
        accepted = frame.signed and self._is_right(frame)
        self.refused += not accepted
        return accepted

    def _is_right(self, frame: Frame) -> bool:
        body, digest = frame.raw[:-_DIGEST], frame.raw[-_DIGEST:]
        if not hmac.compare_digest(signature_of(self._key, body), digest):
            return False
        link_id, timestamp = frame.raw[-SIGNATURE], int.from_bytes(body[-_TIME:], "little")
        stream = (frame.system, frame.component, link_id)
        last = self._streams.get(stream)
        if timestamp <= last if last is not None else timestamp < self.timestamp - MINUTE:
            return False
        self._streams[stream] = timestamp
        self.timestamp = max(self.timestamp, timestamp)
        return True
