"""Where the autopilot is: a URL."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["serial", "tcp", "udp", "udpin"]
FORMS = "serial:/dev/ttyACM0:115200, tcp:HOST:PORT, udp:HOST:PORT (it listens there) or udpin:HOST:PORT (we do)"
DEFAULT_BAUD = 115_200
BITS_A_BYTE = 10  # with start and stop bit


@dataclass(frozen=True, slots=True)
class Place:
    """A parsed URL.

    >>> Place.parse("serial:/dev/ttyACM0:57600")
    Place(kind='serial', host='/dev/ttyACM0', number=57600)
    >>> Place.parse("tcp:127.0.0.1:5760").number
    5760
    """

    kind: Kind
    host: str  # or the path of a serial port or pseudo-terminal
    number: int  # port, or baud rate

    @classmethod
    def parse(cls, url: str) -> Place:
        """Parse a URL.

        Raises:
            ValueError: it is none of the known forms.
        """
        kind, _, rest = url.partition(":")
        host, colon, number = rest.rpartition(":")
        if kind == "serial":
            path, baud = (host, number) if colon and number.isdigit() else (rest, str(DEFAULT_BAUD))
            if path.startswith("/") and int(baud) > 0:
                return cls("serial", path, int(baud))
        elif kind in {"tcp", "udp", "udpin"} and host and number.isdigit() and 0 < int(number) < 65536:
            return cls(kind, host, int(number))  # type: ignore[arg-type]  # one of the three
        raise ValueError(f"'{url}' is no place of an autopilot; write {FORMS}")

    @property
    def bytes_s(self) -> float | None:
        """What a serial line carries [byte/s]; a network has no such limit worth minding."""
        return self.number / BITS_A_BYTE if self.kind == "serial" else None
