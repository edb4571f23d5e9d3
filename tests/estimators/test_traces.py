"""Ground that was left tells what moves from what only came into sight."""

import cv2
import numpy as np
import pytest

from drivers.interface.seeds import stream
from estimators.belief import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from estimators.memory.rolling import lattice_around
from estimators.tracks.traces import Traces

FRAME_NS = 66_000_000
SIDE = 120
LATTICE = lattice_around(0.0, 0.0, 0.05, SIDE, SIDE)


def frame(x_m: float, y_m: float, radius_m: float = 0.25, jitter: np.random.Generator | None = None) -> OccupancyGrid:
    """The near edge of a disc that a sensor in the middle sees, its shadow, and free ground elsewhere."""
    label = np.full((SIDE, SIDE), FREE, dtype=np.uint8)
    bearing, far = np.arctan2(y_m, x_m), np.hypot(x_m, y_m)
    half = np.arcsin(radius_m / far)
    for angle in np.arange(bearing - half, bearing + half, 0.004):
        cosine = far * np.cos(angle - bearing)
        surface = cosine - np.sqrt(max(radius_m**2 - far**2 + cosine**2, 0.0))
        surface += 0.0 if jitter is None else 0.012 * jitter.standard_normal()
        ranges = np.arange(surface, 3.0, 0.02)
        rows, columns = LATTICE.cell_of(np.stack((ranges * np.cos(angle), ranges * np.sin(angle)), axis=1))
        behind = label[rows, columns]
        label[rows, columns] = np.where(behind == OCCUPIED, OCCUPIED, UNKNOWN)
        label[rows[0], columns[0]] = OCCUPIED
    return OccupancyGrid(LATTICE, label)


def watch(grids: list[OccupancyGrid], traces: Traces | None = None, first: int = 0) -> list[bool]:
    """Return, frame by frame, whether anything has left ground."""
    kept, found = traces or Traces(), []
    for index, grid in enumerate(grids, start=first):
        joined = cv2.dilate((grid.label == OCCUPIED).astype(np.uint8), np.ones((3, 3), np.uint8))
        count, component, boxes, _ = cv2.connectedComponentsWithStats(joined, connectivity=8)
        across_m = LATTICE.cell_m * np.hypot(boxes[:, cv2.CC_STAT_WIDTH] - 2, boxes[:, cv2.CC_STAT_HEIGHT] - 2)
        moving = kept.moving(grid, component, across_m, index * FRAME_NS)
        assert moving.shape == (count,)
        assert not moving[0]
        found.append(bool(moving.any()))
    return found


@pytest.mark.parametrize("velocity", [(0.4, 0.0), (-0.4, 0.0), (0.0, 0.4), (0.3, -0.3)])
def test_who_walks_leaves_ground_within_half_a_second_whichever_way(velocity: tuple[float, float]) -> None:
    way = [(1.8 + velocity[0] * t, velocity[1] * t) for t in np.arange(12) * FRAME_NS / 1e9]
    found = watch([frame(x, y) for x, y in way])
    assert any(found[:9])
    assert found[-1]


def test_what_stands_leaves_none_though_its_image_trembles() -> None:
    rng = stream(4, "jitter")
    assert not any(watch([frame(1.8, 0.31, jitter=rng) for _ in range(40)]))


def test_a_wall_that_comes_into_range_leaves_none() -> None:
    grids = []
    for step in range(30):
        label = np.full((SIDE, SIDE), FREE, dtype=np.uint8)
        label[90, 40 : 60 + step] = OCCUPIED
        label[91:, 40 : 60 + step] = UNKNOWN
        grids.append(OccupancyGrid(LATTICE, label))
    assert not any(watch(grids))


def test_what_is_wider_than_a_person_is_no_mover_unless_it_may_be() -> None:
    grids = [frame(1.9, 0.4 * t, radius_m=0.6) for t in np.arange(12) * FRAME_NS / 1e9]
    assert not any(watch(grids))
    assert any(watch(grids, Traces(widest_m=1.5)))


def test_who_has_stopped_is_soon_no_mover_any_more() -> None:
    way = [1.8 + 0.4 * min(t, 0.5) for t in np.arange(45) * FRAME_NS / 1e9]
    found = watch([frame(x, 0.0) for x in way])
    assert any(found[:12])
    assert not any(found[30:])


def test_restored_it_goes_on_identically() -> None:
    grids = [frame(1.8 + 0.4 * t, 0.0) for t in np.arange(12) * FRAME_NS / 1e9]
    one, other = Traces(), Traces()
    watch(grids[:5], one)
    other.restore(one.snapshot())
    assert watch(grids[5:], one, 5) == watch(grids[5:], other, 5)
    assert one.snapshot() == other.snapshot()
