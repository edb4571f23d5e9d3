"""Cuts a small recording out of a log: the seconds around a tick, with all that the viewer and a replay need to begin there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import rerun as rr

from drivers.interface.errors import ConfigurationError
from runtime.log.drawn.events import EVENTS
from runtime.log.drawn.layout import layout
from runtime.log.exact.columns import ArrowColumn, timelines
from runtime.log.exact.keyframes import KEY_FRAME
from runtime.log.exact.part import CHECK
from runtime.log.exact.times import starts_ns
from runtime.log.files.marks import END, SEGMENT, End
from runtime.log.files.paths import stem_of
from runtime.log.files.sink import Sink
from runtime.log.reading.carried import Carried, Piece, piece_of
from runtime.log.reading.opening import chunks
from runtime.log.reading.origin import header_of

CUT = "/run/cut"
_CLOSE_TIMEOUT_S = 30.0
_SYNC_INTERVAL_S = 1.0


@dataclass(frozen=True, slots=True)
class Span:
    """The ticks of a cut."""

    first: int  # that of a key frame, or of the log, so that a replay can begin there
    last: int
    around: int
    first_ns: int


def cut(log: Path, around: int, seconds: float, output: Path | None = None) -> Path:
    """Write the seconds around a tick to a recording of their own, and a bit more: back to where a replay can begin.

    Returns the path; by default beside the log.

    Raises:
        ConfigurationError: the log will not do, does not hold the tick, or the recording exists or cannot be written.
    """
    path = output or stem_of(log).with_suffix(f".cut-{around}.rrd")
    if path.exists():
        raise ConfigurationError(f"{path} exists already; nothing is overwritten")
    span = span_of(log, around, seconds)
    try:
        sink = Sink(path, None, layout(header_of(log)), _SYNC_INTERVAL_S)
    except OSError as error:
        raise ConfigurationError(f"{path} cannot be written: {error.strerror}") from error
    try:
        ticks = _fill(sink, log, path, span)
    except BaseException:
        sink.close(_CLOSE_TIMEOUT_S)
        path.unlink()
        raise
    sink.close(_CLOSE_TIMEOUT_S, END, lambda size, crc32: End(ticks, True, size, crc32).as_components())
    if sink.fault:
        path.unlink()
        raise ConfigurationError(sink.fault)
    return path


def span_of(log: Path, around: int, seconds: float) -> Span:
    """Return the ticks that a cut takes.

    Raises:
        ConfigurationError: the log does not hold the tick.
    """
    times = starts_ns(log, CHECK)
    if around not in times:
        held = f"ticks {min(times)} to {max(times)}" if times else "no tick"
        raise ConfigurationError(f"--around {around}: the log {log} holds {held}, not this one")
    half_ns = round(seconds * 0.5e9)
    near = [tick for tick, start_ns in times.items() if abs(start_ns - times[around]) <= half_ns]
    begins = [tick for tick in (*starts_ns(log, KEY_FRAME), min(times)) if tick <= min(near)]
    return Span(max(begins), max(near), around, times[max(begins)])


def _fill(sink: Sink, log: Path, path: Path, span: Span) -> int:
    """Send what belongs into the cut; return how many ticks that is."""
    carried, ticks = Carried(span.first), 0
    for chunk in chunks(log, "/**"):
        if chunk.is_static:
            if chunk.entity_path not in {SEGMENT, END, CUT}:
                sink.forward(chunk)
            continue
        piece = piece_of(chunk)
        carried.put(piece)
        rows = [row for row, tick in enumerate(piece.ticks) if span.first <= tick <= span.last]
        if rows:
            _send(sink, piece, rows)
            ticks += len(rows) if piece.entity == CHECK else 0
    for entity, columns in carried.columns():
        sink.send(entity, timelines((span.first,), (span.first_ns,)), columns)
    _sign(sink, log, path, span)
    return ticks


def _send(sink: Sink, piece: Piece, rows: Sequence[int]) -> None:
    times = timelines(tuple(piece.ticks[row] for row in rows), tuple(piece.starts_ns[row] for row in rows))
    sink.send(piece.entity, times, [ArrowColumn(c.descriptor, c.array.take(rows)) for c in piece.columns])


def _sign(sink: Sink, log: Path, path: Path, span: Span) -> None:
    """Say where the recording comes from, and how to replay it, for people and for tools."""
    command = f"trundle replay {path.name}"
    sentence = f"cut from {log.name}: ticks {span.first} to {span.last}, around {span.around}; replay it with `{command}`"
    text = rr.TextLog.columns(text=[sentence], level=[rr.TextLogLevel.INFO])
    sink.send(EVENTS, timelines((span.first,), (span.first_ns,)), text)
    origin = rr.AnyValues(log=str(log), around=span.around, first_tick=span.first, last_tick=span.last, command=command)
    sink.log_static(CUT, origin)
