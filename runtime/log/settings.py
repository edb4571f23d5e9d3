"""Settings of the field log."""

from typing import Literal, Self

from pydantic import Field, model_validator

from drivers.interface.settings import Settings


class LogSettings(Settings):
    """How the recorder queues, batches and flushes, and what it draws for the eye."""

    queue_ticks: int = Field(100, ge=2, le=10_000, description="ticks that may wait for the writer")
    batch_ticks: int = Field(25, ge=1, le=1_000, description="ticks sent as one column batch, if the flush interval allows")
    flush_interval_s: float = Field(0.2, gt=0.0, le=10.0, description="what a killed process loses at most, in real time")
    draw_interval_s: float = Field(1.0, gt=0.0, le=60.0, description="the same of what is only drawn; live: flush_interval_s")
    keyframe_interval_s: float = Field(5.0, gt=0.0, le=600.0, description="how often what a replay can begin with is recorded")
    depth: bool = Field(True, description="record depth images; without them a log cannot be replayed")
    view_rate_hz: float = Field(5.0, gt=0.0, le=200.0, description="most that grid, clearance and paths are drawn per second")
    on_unwritable: Literal["continue", "stop"] = Field("continue", description="what a log that can no longer be written means")
    segment_mb: float = Field(1000.0, gt=0.0, description="size of a file of the log; at the next key frame another begins")
    disk_budget_mb: float | None = Field(
        None, gt=0.0, description="for all files of the log: the oldest are deleted, but none around a stop; none: no limit"
    )
    incidents: bool = Field(True, description="also write the ten seconds around each latched stop to a recording of their own")
    live_port: int = Field(9876, ge=1024, le=65_535, description="loopback port of the live view")

    @model_validator(mode="after")
    def _room_for_two(self) -> Self:
        if self.disk_budget_mb is not None and self.disk_budget_mb < 2 * self.segment_mb:
            raise ValueError(f"disk_budget_mb must hold two files of segment_mb, {2 * self.segment_mb:g}")
        return self
