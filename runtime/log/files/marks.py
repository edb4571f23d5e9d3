"""What stands at both ends of a file of a log: which of how many it is, and that it is whole."""

from __future__ import annotations

from dataclasses import dataclass

import rerun as rr

SEGMENT = "/run/segment"
END = "/run/end"


@dataclass(frozen=True, slots=True)
class Segment:
    """The place of a file among those of its log."""

    recording_id: str | None = None  # None: a new one; the same in all files of a log
    index: int = 0
    deleted: tuple[int, ...] = ()  # indices of files that the disk budget had no room for, as far as known

    def as_components(self) -> rr.AnyValues:
        """Return what is logged at the beginning of the file."""
        return rr.AnyValues(index=self.index, deleted=list(self.deleted) or None)


@dataclass(frozen=True, slots=True)
class End:
    """Logged last: a file without it was cut, or its writer killed."""

    ticks: int
    is_last: bool  # no further file follows
    bytes: int  # before this mark
    crc32: int  # of them

    def as_components(self) -> rr.AnyValues:
        """Return what is logged at the end of the file."""
        return rr.AnyValues(ticks=self.ticks, is_last=self.is_last, bytes=self.bytes, crc32=self.crc32)
