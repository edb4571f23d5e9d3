"""The files of a log: `name.rrd` while there is one, `name.000.rrd`, `name.001.rrd` and so on when there are several."""

from __future__ import annotations

import re
from pathlib import Path

_NUMBER = re.compile(r"\.(\d{3,})$")


def numbered(path: Path, index: int) -> Path:
    """Return the name of a file of the log.

    >>> numbered(Path("runs/a.rrd"), 7).name
    'a.007.rrd'
    """
    return path.with_name(f"{path.stem}.{index:03d}{path.suffix}")


def index_of(path: Path) -> int:
    """Return the number in a file's name; 0 where there is none.

    >>> index_of(Path("a.012.rrd")), index_of(Path("a.rrd"))
    (12, 0)
    """
    found = _NUMBER.search(path.stem)
    return int(found[1]) if found else 0


def stem_of(path: Path) -> Path:
    """Return the name of the log that a file belongs to, with the suffix.

    >>> stem_of(Path("runs/a.012.rrd")), stem_of(Path("runs/a"))
    (PosixPath('runs/a.rrd'), PosixPath('runs/a.rrd'))
    """
    plain = path if path.suffix == ".rrd" else path.with_name(f"{path.name}.rrd")
    return plain.with_name(_NUMBER.sub("", plain.stem) + plain.suffix)


def files_of(path: Path) -> tuple[Path, ...]:
    """Return all files of a log in their order, by the name of any of them or of the log; none: (`path`,).

    A writer that was killed while it renamed the first file leaves `name.rrd` beside `name.001.rrd`; both count.
    """
    stem = stem_of(path)
    if path.is_file() and path.suffix != ".rrd":
        return (path,)
    named_so = (file for file in stem.parent.glob(f"{_escaped(stem.stem)}.*.rrd") if _NUMBER.search(file.stem))
    numbers = [file for file in named_so if stem_of(file) == stem]
    plain = [stem] if stem.is_file() else []
    return (*plain, *sorted(numbers, key=index_of)) or (path,)


def _escaped(name: str) -> str:
    return re.sub(r"([*?[])", r"[\1]", name)
