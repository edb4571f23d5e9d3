"""Takes out of a damaged log the messages at which Rerun's own program ends, so that it can save the others.

Found by halving: what is written again is about twice the file for one such message.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

_FILE_HEAD_BYTES = 12
_HEAD = struct.Struct("<QQ")  # kind and length of a message
_STORE = 1  # kind of a message that says which recording those after it belong to


@dataclass(frozen=True, slots=True)
class _Message:
    kind: int
    begin: int
    end: int


def without_fatal(file: Path, copy: Path, survives: Callable[[Path], bool]) -> None:
    """Write to `copy` all messages of a file but those that a reader does not survive."""
    messages = _messages(file)
    stores = [message for message in messages if message.kind == _STORE]

    def fatal(suspects: Sequence[_Message]) -> list[_Message]:
        _write(file, copy, sorted({*stores, *suspects}, key=lambda message: message.begin))
        if not suspects or survives(copy):
            return []
        half = len(suspects) // 2
        return list(suspects) if half == 0 else fatal(suspects[:half]) + fatal(suspects[half:])

    lost = set(fatal([message for message in messages if message.kind != _STORE]))
    _write(file, copy, [message for message in messages if message not in lost])


def _messages(file: Path) -> list[_Message]:
    """Return all messages up to the end of the file, or to one whose length cannot be."""
    size, at, found = file.stat().st_size, _FILE_HEAD_BYTES, []
    with file.open("rb") as source:
        while at + _HEAD.size <= size:
            source.seek(at)
            kind, length = _HEAD.unpack(source.read(_HEAD.size))
            end = at + _HEAD.size + length
            if end > size:
                break
            found.append(_Message(kind, at, end))
            at = end
    return found


def _write(file: Path, copy: Path, messages: Sequence[_Message]) -> None:
    with file.open("rb") as source, copy.open("wb") as target:
        target.write(source.read(_FILE_HEAD_BYTES))
        for message in messages:
            source.seek(message.begin)
            target.write(source.read(message.end - message.begin))
