"""Reads damaged copies of a log and says of each whether a wrong value came out unnoticed: `GOOD DAMAGED [DAMAGED ...]`.

A process of its own, because Rerun's reader may end the process on some damage; that, too, is being noticed.
"""

import sys
from pathlib import Path

from drivers.interface.errors import ConfigurationError
from runtime.log.read import Log, read
from runtime.log.verify import damaged_ticks
from tests.runtime.log_cycles import bits


def cells(log, entity: str, tick: int) -> object:  # type: ignore[no-untyped-def]
    return {name: bits(tuple(values)) for name, values in log.at(entity, tick).items() if ":" not in name}


def unnoticed(good: Log, path: Path) -> bool:
    try:
        found = read(path, "/replay/**")
        damaged = damaged_ticks(found)
    except ConfigurationError:
        return False
    sensed = [entity for entity in good.entities if entity.startswith("/replay/sensed")]
    return any(cells(found, e, t) != cells(good, e, t) for t in set(found.ticks) - set(damaged) for e in sensed)


if __name__ == "__main__":
    whole = read(Path(sys.argv[1]), "/replay/**")
    for name in sys.argv[2:]:
        print("unnoticed" if unnoticed(whole, Path(name)) else "noticed or harmless", flush=True)
