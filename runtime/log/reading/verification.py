"""Whether a log is whole: every tick there and as it was recorded, every file there and as it was written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from runtime.log.exact.stream import rows
from runtime.log.files.marks import END, SEGMENT, End
from runtime.log.files.paths import files_of
from runtime.log.files.seal import crc32_of
from runtime.log.reading.cut import CUT
from runtime.log.reading.opening import require_log
from runtime.log.reading.read import STATIC, read_file

_TICK = "/replay/sensed/tick"
_SHOWN = 5  # ticks that a sentence names; the others are counted


@dataclass(frozen=True, slots=True)
class Verification:
    """What was found; a log without findings is whole."""

    ticks: int
    first_tick: int  # -1: no tick
    last_tick: int
    damaged: tuple[int, ...]  # ticks whose checksum does not fit
    gaps: tuple[int, ...]  # ticks before which others are missing that were recorded once
    findings: tuple[str, ...]  # a sentence each


@dataclass(frozen=True, slots=True)
class _File:
    path: Path
    index: int
    deleted: tuple[int, ...]  # files that the writer knew to be deleted
    end: End | None
    is_cut_out: bool  # of a longer log


def verify(log: Path) -> Verification:
    """Read the whole of a log, or of all its files.  Damage may end the process: see `isolated`.

    Raises:
        ConfigurationError: it is not a log of ours, of another schema, or cannot be read as it is.
    """
    files = [_file(path) for path in files_of(log)]
    ticks: list[int] = []
    damaged: list[int] = []
    gaps: list[int] = []
    findings = list(_wrong_with_files(files))
    may_begin_late = files[0].is_cut_out or files[0].index > 0
    for row in rows(log):
        expected = ticks[-1] + 1 if ticks else 0
        missing = row.tick - expected - int(row.cells(_TICK).get("skipped", [0])[0])
        if row.lost_before:
            findings.append(f"{row.lost_before} ticks before tick {row.tick} could not be recorded")
        elif missing > 0 and not (may_begin_late and not ticks):
            gaps.append(row.tick)
        if not row.is_sound:
            damaged.append(row.tick)
        ticks.append(row.tick)
    findings += _about_ticks(files, ticks, damaged, gaps)
    first, last = (ticks[0], ticks[-1]) if ticks else (-1, -1)
    return Verification(len(ticks), first, last, tuple(damaged), tuple(gaps), tuple(findings))


def _file(path: Path) -> _File:
    require_log(path)
    run = read_file(path, "/run/**")
    segment, end = run.at(SEGMENT, STATIC), run.at(END, STATIC)
    return _File(
        path,
        int(segment["index"][0]) if segment else 0,
        tuple(int(index) for index in segment.get("deleted", ())),
        End(int(end["ticks"][0]), bool(end["is_last"][0]), int(end["bytes"][0]), int(end["crc32"][0])) if end else None,
        bool(run.at(CUT, STATIC)),
    )


def _wrong_with_files(files: Sequence[_File]) -> Iterator[str]:
    there = {file.index for file in files}
    deleted = {index for file in files for index in file.deleted}
    if missing := sorted(set(range(max(there))) - there - deleted):
        yield f"of its files, {_listed(missing)} are missing"
    for file in files:
        if file.end is None:
            yield f"{file.path.name} has no end: its writer was killed, or it was cut off"
        elif crc32_of(file.path, file.end.bytes) != file.end.crc32:
            yield f"{file.path.name} is not as it was written"
    end = files[-1].end
    if end is not None and not end.is_last:
        yield f"the files after {files[-1].path.name} are missing"


def _about_ticks(files: Sequence[_File], ticks: Sequence[int], damaged: Sequence[int], gaps: Sequence[int]) -> Iterator[str]:
    ends = [file.end for file in files if file.end is not None]
    written = sum(end.ticks for end in ends)
    if len(ends) == len(files) and written != len(ticks):
        yield f"of {written} ticks that were written, {len(ticks)} are there"
    if damaged:
        yield f"ticks {_listed(damaged)} are damaged: their checksum does not fit"
    if gaps:
        yield f"ticks before {_listed(gaps)} are missing"
    if not ticks:
        yield "it holds no tick"


def _listed(numbers: Sequence[int]) -> str:
    more = f" and {len(numbers) - _SHOWN} more" if len(numbers) > _SHOWN else ""
    return ", ".join(str(number) for number in numbers[:_SHOWN]) + more
