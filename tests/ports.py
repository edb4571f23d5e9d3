"""Ports that nobody else uses, for both ends of an emulated wire."""

import random
import socket
from contextlib import suppress

_BELOW_OUTGOING = (10_000, 32_000)  # Linux gives outgoing connections ports from 32768 on: one of those may be taken any moment
_given: set[int] = set()


def free_port() -> int:
    """Return a port, free now for TCP and for UDP; drawn at random, so that two test runs hardly meet, and never given twice."""
    while True:
        port = random.SystemRandom().randrange(*_BELOW_OUTGOING)
        if port in _given:
            continue
        with socket.socket() as stream, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagrams, suppress(OSError):
            stream.bind(("", port))
            datagrams.bind(("", port))
            _given.add(port)
            return port
