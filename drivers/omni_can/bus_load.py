"""How much of a CAN bus's bit rate is in use."""

from __future__ import annotations

HIGHEST_LOAD = 0.5  # above it frames of low priority wait too long behind others
WINDOW_NS = 1_000_000_000


def frame_bits(length: int) -> int:
    """Return the bits of a data frame with an 11-bit identifier and so many bytes, at worst.

    Source: Davis, Burns, Bril, Lukkien, Controller Area Network schedulability analysis, Real-Time Systems 35, 2007,
    equation 1: 34 + 8 n bits are subject to stuffing, one bit in four of them at worst, and 13 are not.

    >>> frame_bits(8)
    135
    """
    stuffed = 34 + 8 * length
    return stuffed + 13 + (stuffed - 1) // 4


class LoadMeter:
    """The share of the bit rate that frames took over the last second."""

    def __init__(self, bit_rate: float) -> None:
        """Start with a quiet bus of so many bits a second."""
        self._bit_rate = bit_rate
        self._bits = 0
        self._since_ns: int | None = None
        self.load = float("nan")

    def add(self, length: int) -> None:
        """Count a frame of so many bytes."""
        self._bits += frame_bits(length)

    def update(self, now_ns: int) -> None:
        """Close the window when it is over."""
        if self._since_ns is None:
            self._since_ns, self._bits = now_ns, 0
        elapsed_ns = now_ns - self._since_ns
        if elapsed_ns >= WINDOW_NS:
            self.load = self._bits / (self._bit_rate * elapsed_ns * 1e-9)
            self._since_ns, self._bits = now_ns, 0
