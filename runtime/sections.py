"""The sections of the configuration that belong to the runtime itself."""

from __future__ import annotations

from pydantic import Field, model_validator

from drivers.interface.settings import Settings


class DeadlineLadder(Settings):
    """What consecutive missed deadlines lead to; each rung is the number of misses that reaches it."""

    hold: int = Field(default=2, ge=1, description="repeat the last command while it is valid")
    decelerate: int = Field(default=4, ge=1, description="lower the speed limits")
    stop: int = Field(default=6, ge=1, description="stand down until the loop is on time again")
    latch: int = Field(default=40, ge=1, description="stop until the operator resets")

    @model_validator(mode="after")
    def _ascends(self) -> DeadlineLadder:
        if not self.hold <= self.decelerate <= self.stop <= self.latch:
            raise ValueError("the rungs must ascend: hold <= decelerate <= stop <= latch")
        return self


class SupervisorSection(Settings):
    """When the supervisor intervenes."""

    command_lifetime_s: float = Field(default=0.25, gt=0.0, le=2.0, description="a command expires after this")
    startup_grace_s: float = Field(default=2.0, ge=0.0, le=60.0, description="devices may take so long to their first sample")
    silent_after_periods: float = Field(default=6.0, ge=2.0, description="no sample for so many of its periods: silent")
    silent_after_s: float = Field(default=0.25, gt=0.0, description="and at least this long")
    stale_after_s: float = Field(default=0.4, gt=0.0, description="a newest sample captured longer ago is stale")
    lowest_rate_ratio: float = Field(default=0.6, ge=0.0, le=1.0, description="of the expected rate, over two seconds")
    lowest_battery_fraction: float = Field(default=0.15, ge=0.0, le=1.0)
    slow_factor: float = Field(default=0.5, gt=0.0, le=1.0, description="speed limits while decelerating are times this")
    give_up_after_s: float = Field(default=3.0, gt=0.0, description="a latched stop that nobody resets ends the run")
    deadline_ladder: DeadlineLadder = DeadlineLadder()
    most_missed_share: float = Field(
        default=0.25, ge=0.0, le=1.0, description="of the deadlines of two seconds; more, and the speed limits are lowered"
    )


class RealtimeSection(Settings):
    """What to ask of the operating system; what it refuses is reported, not fatal."""

    priority: int | None = Field(default=None, ge=1, le=98, description="SCHED_FIFO priority; none: leave the scheduler alone")
    lock_memory: bool = Field(default=False, description="mlockall: no page of ours is swapped out")
    cpus: tuple[int, ...] = Field(default=(), description="CPU affinity; empty: leave it")
    freeze_garbage: bool = Field(default=True, description="in real time: collect once, then keep the collector out of the loop")


class LoopSection(Settings):
    """The beat of the loop."""

    rate_hz: float = Field(default=20.0, gt=0.0, le=1000.0)
    realtime: bool = Field(default=False, description="pace a simulated world by the host's clock")
    work_ms: float = Field(default=0.0, ge=0.0, description="in lockstep: how long a tick's work is taken to last")
    plan_ms: float = Field(default=0.0, ge=0.0, description="in lockstep: how long the planner is taken to last")
    system: RealtimeSection = RealtimeSection()

    @property
    def period_ns(self) -> int:
        """The control period [ns]."""
        return round(1e9 / self.rate_hz)


class GoalSection(Settings):
    """A place in the map to reach."""

    x_m: float
    y_m: float
    yaw_rad: float | None = None
    tolerance_m: float = Field(default=0.35, gt=0.0)


class StartSection(Settings):
    """The pose in the map that the robot starts at."""

    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0


class MissionSection(Settings):
    """What to do; empty values are the scenario's."""

    goals: tuple[GoalSection, ...] | None = Field(default=None, description="none: the scenario's; empty: only observe")
    start: StartSection | None = None
    time_limit_s: float | None = Field(default=None, gt=0.0)
