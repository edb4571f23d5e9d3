"""Depth to labels the slow and obvious way, with sets of cells; written from appendix D.3, not from the kernels."""

import math

import numpy as np

from estimators.belief import FREE, OCCUPIED, UNKNOWN

NEIGHBOURS = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if (r, c) != (0, 0)]


def line(start, end):
    """Bresenham's line from cell to cell, both included."""
    (row, column), (rows, columns) = start, (abs(end[0] - start[0]), abs(end[1] - start[1]))
    up, right = (1 if end[0] > start[0] else -1), (1 if end[1] > start[1] else -1)
    error, cells = columns - rows, [start]
    while (row, column) != end:
        twice = 2 * error
        if twice > -rows:
            error, column = error - rows, column + right
        if twice < columns:
            error, row = error + columns, row + up
        cells.append((row, column))
    return cells


def rays(frame, pose, settings):
    """For each pixel that says something about the slab: where its ray ends in odom, and whether at a surface."""
    k, camera = frame.intrinsics, frame.base_from_optical
    for v in range(k.height):
        for u in range(k.width):
            z = frame.depth[v, u] * frame.depth_unit_m
            if frame.depth[v, u] == 65535 or not settings.range_min_m <= z <= settings.depth_max_m:
                continue
            direction = camera.rotation @ [(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0]
            low, high = settings.slab_low_m, settings.slab_high_m
            in_slab = math.inf
            if direction[2] != 0.0:
                in_slab = (high if direction[2] > 0.0 else low) / direction[2]
            if in_slab < settings.range_min_m:
                continue
            in_range = settings.range_max_m / math.hypot(*direction[:2])
            reach = min(in_slab, in_range)
            point = camera.translation + direction * min(z, reach)
            yield pose.apply(point[:2]), z <= reach


def components(cells):
    cells = set(cells)
    while cells:
        group, open_cells = set(), [cells.pop()]
        while open_cells:
            r, c = open_cells.pop()
            group.add((r, c))
            near = {(r + dr, c + dc) for dr, dc in NEIGHBOURS} & cells
            cells -= near
            open_cells.extend(near)
        yield group


def free_part(cells, occupied, with_end):
    """The cells of a line before the first occupied one; the last only `with_end`."""
    free = set()
    for before, cell in zip([None, *cells[:-1]], cells, strict=True):
        slips = before is not None and (before[0], cell[1]) in occupied and (cell[0], before[1]) in occupied
        if cell in occupied or (slips and before[0] != cell[0] and before[1] != cell[1]):
            return free
        if with_end or cell != cells[-1]:
            free.add(cell)
    return free


def behind(cells, occupied):
    """Whether a line meets a surface and clearly leaves it again before its last cell."""
    met = False
    for row, column in cells[:-1]:
        met = met or (row, column) in occupied
        touching = (row, column) in occupied or any((row + r, column + c) in occupied for r, c in NEIGHBOURS)
        if met and not touching:
            return True
    return False


def labels(frame, pose, settings, lattice):
    """The labels on a lattice, (rows, columns) uint8."""
    ends = list(rays(frame, pose, settings))
    row, column = lattice.cell_of(np.array([end for end, _ in ends] + [pose.apply(frame.base_from_optical.translation[:2])]))
    cells = [(int(r), int(c)) for r, c in zip(row, column, strict=True)]
    start = cells.pop()
    hits = [cell for cell, (_, hit) in zip(cells, ends, strict=True) if hit]
    enough = {cell for cell in hits if hits.count(cell) >= settings.hits_min}
    occupied = {cell for group in components(enough) if len(group) >= settings.component_cells_min for cell in group}
    traced = set()
    for cell, hit in {(cell, hit) for cell, (_, hit) in zip(cells, ends, strict=True)}:
        traced |= free_part(line(start, cell), occupied, with_end=not hit)
    hidden = {cell for cell in traced | occupied if behind(line(start, cell), occupied)}
    label = np.full((lattice.rows, lattice.columns), UNKNOWN, dtype=np.uint8)
    for cells_of, value in ((traced - occupied - hidden, FREE), (occupied - hidden, OCCUPIED)):
        for cell in cells_of:
            label[cell] = value
    return label
