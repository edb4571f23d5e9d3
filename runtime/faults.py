"""The one table from fault to response.  Nothing else decides what a fault leads to."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from types import MappingProxyType


class Response(enum.IntEnum):
    """What the robot does, from mild to severe; the most severe of all present faults wins."""

    RUN = 0  # carry on
    HOLD = 1  # repeat the last command, as long as it has not expired
    DECELERATE = 2  # half the speed limits
    STAND_DOWN = 3  # stop; resumes by itself when healthy again
    LATCH = 4  # stop; needs a reset by the operator


class Fault(enum.Enum):
    """Everything that can go wrong, by name."""

    STARTING = "starting"  # not every device has delivered its first sample yet
    SILENT_DEVICE = "silent_device"  # nothing came for too long
    STALE_SAMPLE = "stale_sample"  # it came, but was captured too long ago
    WRONG_RATE = "wrong_rate"
    INVALID_VALUES = "invalid_values"
    DEVICE_FAULT = "device_fault"
    DEAD_MAN_TRIPPED = "dead_man_tripped"
    LOW_BATTERY = "low_battery"
    ESTIMATOR_DIVERGED = "estimator_diverged"
    ESTIMATOR_RAISED = "estimator_raised"
    ROUTER_RAISED = "router_raised"
    PLANNER_RAISED = "planner_raised"
    PLANNER_OVER_BUDGET = "planner_over_budget"
    SHIELD_RAISED = "shield_raised"
    NON_FINITE_COMMAND = "non_finite_command"
    IMPOSSIBLE_MOTION = "impossible_motion"  # along an axis that the base does not have; clipped, it would go elsewhere
    COMMAND_OUT_OF_LIMITS = "command_out_of_limits"
    DEADLINE_TOLERATED = "deadline_tolerated"
    DEADLINE_HELD = "deadline_held"
    DEADLINE_SLOWED = "deadline_slowed"
    DEADLINE_STOPPED = "deadline_stopped"
    DEADLINE_LATCHED = "deadline_latched"
    COLLISION = "collision"
    EMERGENCY_STOP = "emergency_stop"
    NOT_ENABLED = "not_enabled"
    PAUSED = "paused"
    LOG_UNWRITABLE = "log_unwritable"
    REQUIRED_LOG_UNWRITABLE = "required_log_unwritable"  # the same, where `log.on_unwritable` says stop
    EXTERNAL_STOP = "external_stop"


RESPONSE = MappingProxyType(
    {
        Fault.STARTING: Response.STAND_DOWN,
        Fault.SILENT_DEVICE: Response.STAND_DOWN,
        Fault.STALE_SAMPLE: Response.STAND_DOWN,
        Fault.WRONG_RATE: Response.DECELERATE,
        Fault.INVALID_VALUES: Response.STAND_DOWN,
        Fault.DEVICE_FAULT: Response.LATCH,
        Fault.DEAD_MAN_TRIPPED: Response.STAND_DOWN,
        Fault.LOW_BATTERY: Response.LATCH,
        Fault.ESTIMATOR_DIVERGED: Response.LATCH,
        Fault.ESTIMATOR_RAISED: Response.STAND_DOWN,
        Fault.ROUTER_RAISED: Response.STAND_DOWN,
        Fault.PLANNER_RAISED: Response.STAND_DOWN,
        Fault.PLANNER_OVER_BUDGET: Response.STAND_DOWN,
        Fault.SHIELD_RAISED: Response.STAND_DOWN,
        Fault.NON_FINITE_COMMAND: Response.STAND_DOWN,
        Fault.IMPOSSIBLE_MOTION: Response.STAND_DOWN,
        Fault.COMMAND_OUT_OF_LIMITS: Response.STAND_DOWN,
        Fault.DEADLINE_TOLERATED: Response.RUN,
        Fault.DEADLINE_HELD: Response.HOLD,
        Fault.DEADLINE_SLOWED: Response.DECELERATE,
        Fault.DEADLINE_STOPPED: Response.STAND_DOWN,
        Fault.DEADLINE_LATCHED: Response.LATCH,
        Fault.COLLISION: Response.LATCH,
        Fault.EMERGENCY_STOP: Response.LATCH,
        Fault.NOT_ENABLED: Response.STAND_DOWN,
        Fault.PAUSED: Response.STAND_DOWN,
        Fault.LOG_UNWRITABLE: Response.RUN,
        Fault.REQUIRED_LOG_UNWRITABLE: Response.LATCH,  # a log that has failed stays so: the run gives up
        Fault.EXTERNAL_STOP: Response.LATCH,
    }
)


@dataclass(frozen=True, slots=True)
class FaultReport:
    """One fault that is present at a tick."""

    fault: Fault
    device: str = ""  # which one, where it is a device's
    detail: str = ""  # one sentence

    @property
    def response(self) -> Response:
        """What the table says."""
        return RESPONSE[self.fault]
