"""How ground truth crosses from an emulated world to a run: datagrams, one a look, in JSON.

A client asks with one of three words and repeats it so that the server knows that it is still there: `RUN` (one client at a time:
the scene's walkers set off for it, and the world is made anew once it has left), `WATCH` (any number, they only look) and `BYE`.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from drivers.interface.commands import BodyTwist
from drivers.interface.geometry import SE2
from drivers.interface.samples import ObstacleTruth, Stamp, TruthSample

RUN, WATCH, BYE, REFUSED = b"RUN", b"WATCH", b"BYE", b"REFUSED"
REPEAT_S = 0.25  # how often a client says that it is still there
LARGEST_DATAGRAM = 65_507  # UDP over IPv4


@dataclass(frozen=True, slots=True)
class TruthLook:
    """A sample and for how long its world has stood still so far, its machine being too slow."""

    sample: TruthSample
    late_ns: int


def encode(look: TruthLook) -> bytes:
    """Return the datagram; numbers are exact (shortest round trip), no obstacle at all is `Infinity`."""
    truth = look.sample
    moving = [[o.name, *_pose(o.map_from_obstacle), *o.velocity_m_s, o.radius_m] for o in truth.obstacles]
    content = {
        "captured_ns": truth.stamp.captured_ns,
        "sequence": truth.stamp.sequence,
        "pose": _pose(truth.map_from_base),
        "twist": [truth.twist.vx, truth.twist.vy, truth.twist.wz],
        "obstacles": moving,
        "clearance_m": truth.clearance_m,
        "contacts": truth.contacts,
        "late_ns": look.late_ns,
    }
    return json.dumps(content, separators=(",", ":")).encode()


def decode(datagram: bytes, received_ns: int) -> TruthLook:
    """Return what `encode` was given.

    Raises:
        ValueError: it is nothing of the kind.
    """
    try:
        content = json.loads(datagram)
        stamp = Stamp(int(content["captured_ns"]), received_ns, int(content["sequence"]))
        obstacles = tuple(_obstacle(*item) for item in content["obstacles"])
        twist = BodyTwist(*map(float, content["twist"]))
        contacts = tuple(str(name) for name in content["contacts"])
        clearance_m = float(content["clearance_m"])
        sample = TruthSample(stamp, SE2(*map(float, content["pose"])), twist, obstacles, clearance_m, contacts)
        return TruthLook(sample, int(content["late_ns"]))
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"this is no truth datagram: {error}") from error


def _pose(pose: SE2) -> list[float]:
    return [pose.x, pose.y, pose.yaw]


def _obstacle(name: Any, x: float, y: float, yaw: float, vx: float, vy: float, radius_m: float) -> ObstacleTruth:
    return ObstacleTruth(str(name), SE2(float(x), float(y), float(yaw)), (float(vx), float(vy)), float(radius_m))
