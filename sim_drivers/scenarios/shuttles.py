"""Shuttles: solids that go to and fro across the robot's way, on lanes of their own, and take no notice of the robot.

Source: Han, Zhu, RCSP, sections 1 and 5.1: obstacles that occupy a passage moments after a robot has entered it, on the same
seeded schedule for every planner.  The paper gives no geometry, speeds or times; all figures here are ours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from drivers.interface.settings import Settings
from sim_drivers.scene import Mover, Shape

F64 = NDArray[np.float64]


class ShuttleSettings(Settings):
    """What is drawn for every shuttle."""

    min_speed_m_s: float = Field(0.5, gt=0.0, le=2.0, description="slowest that is drawn")
    max_speed_m_s: float = Field(0.9, gt=0.0, le=2.0, description="fastest that is drawn")
    min_rest_s: float = Field(1.0, gt=0.0, le=60.0, description="shortest rest at an end of the lane that is drawn")
    max_rest_s: float = Field(3.0, gt=0.0, le=60.0, description="longest rest that is drawn")
    hesitate_probability: float = Field(
        0.25, ge=0.0, le=1.0, description="of a shuttle that stops in the robot's way, both times"
    )
    max_hesitation_s: float = Field(2.0, ge=0.2, le=60.0, description="longest stop that is drawn; the shortest is 0.2 s")

    @model_validator(mode="after")
    def _ordered(self) -> ShuttleSettings:
        for low, high in (("min_speed_m_s", "max_speed_m_s"), ("min_rest_s", "max_rest_s")):
            if getattr(self, low) > getattr(self, high):
                raise ValueError(f"{low} {getattr(self, low)} is more than {high} {getattr(self, high)}")
        return self


@dataclass(frozen=True, slots=True)
class Lane:
    """Where a shuttle goes: from one end [m] of the map to the other, and where on it (0 to 1) it is in the robot's way."""

    start: tuple[float, float]
    end: tuple[float, float]
    crossing: float = 0.5


def draw_shuttle(rng: np.random.Generator, settings: ShuttleSettings, name: str, shape: Shape, lane: Lane) -> Mover:
    """Draw one shuttle: speed, rests, whether it hesitates, and where on its round it is at time zero."""
    speed = float(rng.uniform(settings.min_speed_m_s, settings.max_speed_m_s))
    rests = rng.uniform(settings.min_rest_s, settings.max_rest_s, 2)
    hesitates = bool(rng.random() < settings.hesitate_probability)
    stop_s = float(rng.uniform(0.2, settings.max_hesitation_s)) if hesitates else 0.0
    there = _crossing_keyframes(lane, speed, stop_s)
    back = _crossing_keyframes(Lane(lane.end, lane.start, 1.0 - lane.crossing), speed, stop_s)
    back[:, 0] += there[-1, 0] + float(rests[0])
    home = np.concatenate(([back[-1, 0] + float(rests[1])], there[0, 1:]))
    round_trip = np.vstack((there, back, home))  # (n, 3)
    round_trip[:, 0] -= float(rng.uniform(0.0, home[0]))
    yaw = math.atan2(lane.end[1] - lane.start[1], lane.end[0] - lane.start[0])
    return Mover(name, shape, np.column_stack((round_trip, np.full(len(round_trip), yaw))), looped=True)


def _crossing_keyframes(lane: Lane, speed_m_s: float, stop_s: float) -> F64:
    """Return times and points, shape (n, 3), of one way along the lane from time zero, with a stop at the crossing."""
    start, end = np.array(lane.start), np.array(lane.end)
    middle = start + lane.crossing * (end - start)
    to_middle_s, to_end_s = (float(np.hypot(*leg)) / speed_m_s for leg in (middle - start, end - middle))
    rows = [(0.0, *start), (to_middle_s, *middle)]
    if stop_s > 0.0:
        rows.append((to_middle_s + stop_s, *middle))
    rows.append((to_middle_s + stop_s + to_end_s, *end))
    return np.array(rows)
