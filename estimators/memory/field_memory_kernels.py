"""How one frame's labels change the two layers of evidence, and what is still believed of cells that it did not see."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from drivers.interface.kernel import kernel
from estimators.belief import FREE, OCCUPIED, U8, UNKNOWN

I64 = NDArray[Any]
Flags = NDArray[Any]  # bool
Evidence = NDArray[Any]  # float32, 0 to 1


@kernel()
def _look(label: U8, seen: U8, blind: Flags, corner: tuple[int, int], at: tuple[int, int], scale: int) -> tuple[bool, ...]:
    """Overwrite the labels of one cell of the layers as they were seen.

    Returns whether any part of it was seen occupied, any seen free, any is occupied and in the blind zone, any is occupied
    at all.
    """
    hit, cleared, held, stands = False, False, False, False
    for row in range(at[0] * scale, (at[0] + 1) * scale):
        for column in range(at[1] * scale, (at[1] + 1) * scale):
            cell = corner[0] + row, corner[1] + column
            what = seen[row, column]
            if what == OCCUPIED:
                label[cell] = OCCUPIED
                hit, stands = True, True
            elif label[cell] == OCCUPIED and blind[row, column]:
                held, stands = True, True  # a ray may graze what is too near to give returns: it takes nothing away
            elif what == FREE:
                label[cell] = FREE
                cleared = True
            elif label[cell] == OCCUPIED:
                stands = True
    return hit, cleared, held, stands


@kernel()
def _forget(label: U8, row0: int, column0: int, scale: int) -> None:
    for row in range(row0, row0 + scale):
        for column in range(column0, column0 + scale):
            if label[row, column] == OCCUPIED:
                label[row, column] = UNKNOWN


@kernel()
def fold_layers(
    label: U8,  # (rows * scale, columns * scale), as last seen; all of these change in place
    static: Evidence,  # (rows, columns), as of stamp_ns
    dynamic: Evidence,  # (rows, columns), as of stamp_ns
    free_ns: I64,  # (rows, columns), when last seen free
    stamp_ns: I64,  # (rows, columns), when the evidence was last touched
    seen: U8,  # (m * scale, n * scale), the frame's labels on a block of the layers' cells
    blind: Flags,  # as `seen`: where an obstacle may be too near to give returns
    block: tuple[int, int],  # row and column of the block's corner among the layers' cells
    scale: int,
    now_ns: int,
    recent_ns: int,
    retention: tuple[float, float],  # static and dynamic, per step
    step_ns: int,
    gain: float,  # of the static layer in this frame
    clearing: float,  # what is left of the static layer of a cell seen free
    threshold: float,
) -> None:
    """Fold one frame into the layers and forget the unseen cells of the block whose evidence has faded.

    Evidence is kept as of the moment it was last touched and faded when it is looked at, so that a frame costs what its
    block does, however large the layers are.
    """
    corner = block[0] * scale, block[1] * scale
    for row in range(seen.shape[0] // scale):
        for column in range(seen.shape[1] // scale):
            at = block[0] + row, block[1] + column
            hit, cleared, held, stands = _look(label, seen, blind, corner, (row, column), scale)
            age = (now_ns - stamp_ns[at]) / step_ns
            if hit:
                came = now_ns - free_ns[at] <= recent_ns
                faded = static[at] * retention[0] ** age
                static[at] = faded + (1.0 - faded) * gain if came else 1.0
                dynamic[at], stamp_ns[at] = 1.0, now_ns
            elif held:
                stamp_ns[at] = now_ns
            elif stands:
                if max(static[at] * retention[0] ** age, dynamic[at] * retention[1] ** age) < threshold:
                    _forget(label, at[0] * scale, at[1] * scale, scale)
            elif cleared:
                static[at] *= clearing * retention[0] ** age
                dynamic[at], stamp_ns[at], free_ns[at] = 0.0, now_ns, now_ns
