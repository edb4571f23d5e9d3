"""Verifies damaged copies of logs and says of each whether that was noticed: `DAMAGED [DAMAGED ...]`.

A process of its own, because Rerun's reader may end the process on some damage; that, too, is being noticed.
"""

import sys
from pathlib import Path

from drivers.interface.errors import ConfigurationError
from runtime.log.reading.verification import verify


def said_of(path: Path) -> str:
    try:
        found = verify(path)
    except ConfigurationError:
        return "noticed"
    return "noticed" if found.findings else "not noticed"


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(said_of(Path(name)), flush=True)
