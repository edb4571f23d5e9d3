"""Snapshots: estimator, router, planner and shield can be stopped at one tick and continued identically from it."""

import ast
import math
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.lib.format import descr_to_dtype, dtype_to_descr
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
    """Pack named arrays and numbers into bytes, exactly: a line that names and describes each, then their bytes.

    The loop waits for it: a .npz of the same takes longer than all else about a snapshot together.

    >>> unpack(pack(tick=3, pose=[0.1, 0.2]))["pose"].tolist()
    [0.1, 0.2]
    """
    held = {name: np.ascontiguousarray(value).reshape(np.shape(value)) for name, value in arrays.items()}
    if odd := [name for name, array in held.items() if array.dtype.hasobject]:
        raise TypeError(f"a snapshot holds numbers and texts, not the objects of {', '.join(odd)}")
    head = [(name, dtype_to_descr(array.dtype), array.shape) for name, array in held.items()]
    return b"".join((repr(head).encode(), b"\n", *(array.reshape(-1).view(np.uint8).data for array in held.values())))


def unpack(snapshot: bytes) -> dict[str, NDArray[Any]]:
    """Return what `pack` was given, by name.

    Raises:
        ValueError: it was not packed so, or is cut.
    """
    head, _, _ = snapshot.partition(b"\n")
    arrays: dict[str, NDArray[Any]] = {}
    at = len(head) + 1
    for name, description, shape in _described(head):
        dtype, count = descr_to_dtype(description), math.prod(shape)
        arrays[name] = np.frombuffer(snapshot, dtype, count, at).reshape(shape).copy() if count else np.zeros(shape, dtype)
        at += arrays[name].nbytes
    return arrays


def _described(head: bytes) -> list[tuple[str, Any, tuple[int, ...]]]:
    try:
        described: list[tuple[str, Any, tuple[int, ...]]] = ast.literal_eval(head.decode())
    except (SyntaxError, ValueError) as error:
        raise ValueError("a snapshot is damaged") from error
    return described
