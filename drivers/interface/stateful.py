"""Snapshots: estimator, router, planner and shield can be stopped at one tick and continued identically from it."""

import io
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray


@runtime_checkable
class Stateful(Protocol):
    """Anything whose next answer depends on earlier ones."""

    def snapshot(self) -> bytes:
        """Return the whole state; a copy, never a view."""
        ...

    def restore(self, snapshot: bytes) -> None:
        """Take over a state that `snapshot` gave; from here on the answers are the same, bit for bit."""
        ...


def pack(**arrays: ArrayLike) -> bytes:
    """Pack named arrays and numbers into bytes, exactly (an uncompressed .npz, no pickle).

    >>> unpack(pack(tick=3, pose=[0.1, 0.2]))["pose"].tolist()
    [0.1, 0.2]
    """
    buffer = io.BytesIO()
    np.savez(buffer, **{name: np.asarray(value) for name, value in arrays.items()})  # type: ignore[arg-type]
    return buffer.getvalue()


def unpack(snapshot: bytes) -> dict[str, NDArray[Any]]:
    """Return what `pack` was given, by name."""
    with np.load(io.BytesIO(snapshot), allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files}
