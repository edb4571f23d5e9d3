"""What a log is, in a few lines: where it comes from, what it holds, what happened."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from runtime.log.drawn.events import EVENTS
from runtime.log.exact.keyframes import KEY_FRAME
from runtime.log.exact.part import CHECK
from runtime.log.exact.times import starts_ns
from runtime.log.files.marks import END
from runtime.log.files.paths import files_of
from runtime.log.reading.cut import CUT
from runtime.log.reading.opening import schema_of
from runtime.log.reading.origin import header_of
from runtime.log.reading.read import STATIC, Log, read

_SHOWN = 20  # lines of what happened


@dataclass(frozen=True, slots=True)
class Description:
    """Lines of a name and what is to be said."""

    lines: tuple[tuple[str, str], ...]


def describe(log: Path) -> Description:
    """Read what a log says of itself; not its ticks, which `verify` reads.

    Raises:
        ConfigurationError: it is not a log of ours, of another schema, or cannot be read as it is.
    """
    files, run = files_of(log), read(log, "/run/**")
    return Description((*_files(files, run), *_origin(log), *_contents(log), *_events(log)))


def _files(files: tuple[Path, ...], run: Log) -> list[tuple[str, str]]:
    names = files[0].name if len(files) == 1 else f"{files[0].name} to {files[-1].name}, {len(files)} files"
    size = f"{sum(file.stat().st_size for file in files) / 1e6:.1f} MB"
    ended = "" if run.at(END, STATIC) else "; without an end: its writer was killed, or it was cut off"
    cut = run.at(CUT, STATIC)
    lines = [("log", f"{names}, {size}, schema {schema_of(files[0])}{ended}")]
    if cut:
        lines.append(("cut from", f"{cut['log'][0]}, around tick {cut['around'][0]}; {cut['command'][0]}"))
    return lines


def _origin(log: Path) -> list[tuple[str, str]]:
    header = header_of(log)
    code = f"{header.code_version}, modified" if header.code_modified else header.code_version
    return [
        ("run", f"{header.scenario}, {header.planner}, seed {header.seed}"),
        ("code", code),
        ("machine", header.machine),
        ("libraries", ", ".join(header.libraries)),
        ("doctor", header.doctor or "not asked"),
    ]


def _contents(log: Path) -> list[tuple[str, str]]:
    times, key_frames = starts_ns(log, CHECK), starts_ns(log, KEY_FRAME)
    if not times:
        return [("ticks", "none")]
    first, last = min(times), max(times)
    lost = sum(int(cell[0]) for cell in read(log, CHECK).history(CHECK, "lost_before").values())
    span = f"{first} to {last}, {(times[last] - times[first]) * 1e-9:.1f} s"
    return [
        ("ticks", f"{len(times)}: {span}" + (f"; {lost} could not be recorded" if lost else "")),
        ("key frames", f"{len(key_frames)}" + (f", the first at tick {min(key_frames)}" if key_frames else "")),
    ]


def _events(log: Path) -> list[tuple[str, str]]:
    said = [(tick, text) for tick, cell in read(log, EVENTS).history(EVENTS, "TextLog:text").items() for text in cell]
    lines = [(f"tick {tick}", text) for tick, text in said[:_SHOWN]]
    return [*lines, ("", f"and {len(said) - _SHOWN} more events")] if len(said) > _SHOWN else lines
