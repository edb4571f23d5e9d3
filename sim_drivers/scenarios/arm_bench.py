"""Arm bench: a conveyor carries boxes past an arm that is bolted to the floor.

Source: Brudermueller et al., CC-VPSTO: Chance-constrained via-point-based stochastic trajectory optimisation, section 6.3 (a
Franka arm beside a conveyor whose belt runs at 0.05 m/s with a box on it).  The paper gives no sizes; they are ours.
"""

from __future__ import annotations

import math

from pydantic import Field

from drivers.interface.geometry import SE2, SE3
from drivers.interface.seeds import stream
from drivers.interface.settings import Settings
from sim_drivers.scene import Conveyor, MarkerPlate, Scene, Shape, StaticObstacle

BOX = Shape.box(0.08, 0.08, 0.10)
MARKER_SIDE_M = 0.05  # on top of a box, its margin of 8 mm inside the edges
END_M = 0.15  # from the belt's beginning to the first box


class ArmBenchSettings(Settings):
    """Where the belt runs and how fast; it passes in front of the arm, along the map's y."""

    boxes: int = Field(3, ge=0, le=20, description="how many the belt carries")
    spacing_m: float = Field(0.3, ge=0.15, le=2.0, description="from one box to the next, at the start")
    belt_speed_m_s: float = Field(0.05, ge=-1.0, le=1.0, description="of the belt; the paper's figure")
    belt_x_m: float = Field(0.55, ge=0.35, le=2.0, description="from the arm's foot to the middle of the belt")
    belt_length_m: float = Field(2.0, ge=0.5, le=20.0, description="of the belt, half of it on either side of the arm")
    belt_width_m: float = Field(0.3, ge=0.1, le=1.0, description="of the belt")
    belt_height_m: float = Field(0.15, ge=0.05, le=1.5, description="of the belt's top over the floor")
    lateral_m: float = Field(0.05, ge=0.0, le=0.5, description="largest offset from the belt's middle that is drawn")
    time_limit_s: float = Field(10.0, gt=0.0, le=600.0, description="how long the run is")


class ArmBench:
    """A conveyor with boxes in front of an arm; there is nowhere to go, the arm's planner knows what to do.

    On top of each box its number is printed as an ArUco marker.
    """

    Settings = ArmBenchSettings

    def __init__(self, settings: ArmBenchSettings) -> None:
        """Take the settings."""
        self._settings = settings

    def draw(self, seed: int) -> Scene:
        """Return the scene of this seed, which draws how the boxes lie on the belt."""
        s, rng = self._settings, stream(seed, "arm_bench")
        map_from_belt = SE2(s.belt_x_m, 0.0, math.copysign(math.pi / 2, s.belt_speed_m_s))  # its x axis is the way it runs
        first_m = END_M - s.belt_length_m / 2
        boxes = tuple(
            StaticObstacle(
                f"box_{index}",
                BOX,
                map_from_belt @ SE2(first_m + index * s.spacing_m, float(rng.uniform(-s.lateral_m, s.lateral_m))),
                base_z_m=s.belt_height_m,
            )
            for index in range(s.boxes)
        )
        belt = Shape.box(s.belt_length_m, s.belt_width_m, s.belt_height_m)
        conveyor = Conveyor("conveyor", belt, map_from_belt, abs(s.belt_speed_m_s), boxes)
        top = SE3(0.0, 0.0, BOX.half_extents_m[2])
        markers = tuple(MarkerPlate(box.name, top, MARKER_SIDE_M, number) for number, box in enumerate(boxes))
        return Scene("arm_bench", SE2(), (), s.time_limit_s, (), conveyors=(conveyor,), markers=markers)
