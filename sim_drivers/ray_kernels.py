"""Where rays meet primitive solids.

Every solid is convex, so a ray is inside it for one interval [enter, leave] of its parameter t; an empty interval is
(inf, -inf).  Solids stand in their own frame, as in MuJoCo: size is (radius, half height) of a cylinder or capsule along z,
half lengths of a box, semi-axes of an ellipsoid (radius thrice for a sphere), half lengths of a plane (inf where endless).
Sources: Ericson, Real-Time Collision Detection, section 5.3 (slabs, cylinder, capsule); MuJoCo documentation, mj_ray, whose
conventions hold: a solid seen from inside is hit on its far side, a plane is hit from its upper side only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
Triple = tuple[float, float, float]  # numba keeps tuples in registers, arrays not

# The values of mujoco.mjtGeom.
PLANE, SPHERE, CAPSULE, ELLIPSOID, CYLINDER, BOX = 0, 2, 3, 4, 5, 6
_SLACK_M = 1e-6  # by which a sphere around a solid is larger than need be, so that rounding loses no ray
_TINY = 1e-15  # MuJoCo's mjMINVAL: a direction shorter than this is parallel


@kernel(inline=True)
def _slab(o: float, d: float, half: float) -> tuple[float, float]:
    """Interval of |o + t d| <= half."""
    if abs(d) < _TINY:
        return (-np.inf, np.inf) if abs(o) <= half else (np.inf, -np.inf)
    middle, reach = -o / d, half / abs(d)
    return middle - reach, middle + reach


@kernel(inline=True)
def _quadratic(a: float, b: float, c: float) -> tuple[float, float]:
    """Interval of a t^2 + 2 b t + c <= 0, for a >= 0."""
    if a < _TINY:
        return (-np.inf, np.inf) if c <= 0.0 else (np.inf, -np.inf)
    under_root = b * b - a * c
    if under_root < 0.0:
        return np.inf, -np.inf
    root = np.sqrt(under_root)
    return (-b - root) / a, (-b + root) / a


@kernel(inline=True)
def _box(size: Triple, o: Triple, d: Triple) -> tuple[float, float]:
    in_x, out_x = _slab(o[0], d[0], size[0])
    in_y, out_y = _slab(o[1], d[1], size[1])
    in_z, out_z = _slab(o[2], d[2], size[2])
    return max(in_x, in_y, in_z), min(out_x, out_y, out_z)


@kernel(inline=True)
def _cylinder(size: Triple, o: Triple, d: Triple) -> tuple[float, float]:
    flat, across = d[0] * d[0] + d[1] * d[1], o[0] * d[0] + o[1] * d[1]
    side_in, side_out = _quadratic(flat, across, o[0] * o[0] + o[1] * o[1] - size[0] * size[0])
    cap_in, cap_out = _slab(o[2], d[2], size[1])
    return max(side_in, cap_in), min(side_out, cap_out)


@kernel(inline=True)
def _ellipsoid(size: Triple, o: Triple, d: Triple) -> tuple[float, float]:
    """A sphere too: the space is scaled until it is the unit sphere."""
    ox, oy, oz = o[0] / size[0], o[1] / size[1], o[2] / size[2]
    dx, dy, dz = d[0] / size[0], d[1] / size[1], d[2] / size[2]
    interval: tuple[float, float] = _quadratic(
        dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz, ox * ox + oy * oy + oz * oz - 1.0
    )
    return interval


@kernel()
def _capsule(size: Triple, o: Triple, d: Triple) -> tuple[float, float]:
    """The cylinder's side; where the ray passes that beyond an end, the end's sphere."""
    radius, half = size[0], size[1]
    flat, across = d[0] * d[0] + d[1] * d[1], o[0] * d[0] + o[1] * d[1]
    c = o[0] * o[0] + o[1] * o[1] - radius * radius
    enter, leave = _quadratic(flat, across, c)
    if enter > leave:
        return enter, leave
    z_in = o[2] + enter * d[2] if flat >= _TINY else -d[2] * np.inf
    z_out = o[2] + leave * d[2] if flat >= _TINY else d[2] * np.inf
    if abs(z_in) > half:
        z = o[2] - np.copysign(half, z_in)
        enter, end = _quadratic(flat + d[2] * d[2], across + z * d[2], c + z * z)
        if enter > end:
            return enter, end
    if abs(z_out) > half:
        z = o[2] - np.copysign(half, z_out)
        leave = _quadratic(flat + d[2] * d[2], across + z * d[2], c + z * z)[1]
    return enter, leave


@kernel(inline=True)
def _plane(size: Triple, o: Triple, d: Triple) -> tuple[float, float]:
    if d[2] > -_TINY:
        return np.inf, -np.inf
    t = -o[2] / d[2]
    inside = abs(o[0] + t * d[0]) <= size[0] and abs(o[1] + t * d[1]) <= size[1]
    return (t, t) if inside else (np.inf, -np.inf)


@kernel()
def first_hit(kind: int, size: Triple, o: Triple, d: Triple) -> float:
    """Return t of the nearest surface ahead, from local origin and direction; inf when the ray misses."""
    if kind == BOX:
        enter, leave = _box(size, o, d)
    elif kind == CYLINDER:
        enter, leave = _cylinder(size, o, d)
    elif kind == CAPSULE:
        enter, leave = _capsule(size, o, d)
    elif kind == PLANE:
        enter, leave = _plane(size, o, d)
    else:
        enter, leave = _ellipsoid(size, o, d)
    if enter > leave or leave < 0.0:
        return np.inf
    nearest: float = enter if enter >= 0.0 else leave
    return nearest


@kernel()
def cast_rays(
    kinds: I64,
    sizes: F64,
    extents: F64,
    centres: F64,
    rotations: F64,
    origin: F64,
    directions: F64,
    far: float,
    ranges: F64,
) -> None:
    """Cast single rays: unit directions (m, 3) from one origin (3,), ranges (m,) [m] written, inf beyond `far`."""
    ranges[:] = np.inf
    for i in range(len(kinds)):
        offset = centres[i] - origin
        bounded, away_squared, reach = kinds[i] != PLANE, np.sum(offset**2), np.sqrt(np.sum(extents[i] ** 2)) + _SLACK_M
        if bounded and np.sqrt(away_squared) - reach > far:
            continue
        r = rotations[i]
        o = -(np.ascontiguousarray(r.T) @ offset)
        local, size = (o[0], o[1], o[2]), (sizes[i, 0], sizes[i, 1], sizes[i, 2])
        for ray in range(len(directions)):
            d = directions[ray]
            along = offset[0] * d[0] + offset[1] * d[1] + offset[2] * d[2]
            if bounded and (along < -reach or away_squared - along * along > reach * reach):
                continue  # it passes the sphere around the solid
            dx = r[0, 0] * d[0] + r[1, 0] * d[1] + r[2, 0] * d[2]
            dy = r[0, 1] * d[0] + r[1, 1] * d[1] + r[2, 1] * d[2]
            dz = r[0, 2] * d[0] + r[1, 2] * d[1] + r[2, 2] * d[2]
            t = first_hit(kinds[i], size, local, (dx, dy, dz))
            if t < ranges[ray] and t <= far:
                ranges[ray] = t
