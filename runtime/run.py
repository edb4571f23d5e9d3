"""Runs a mission from start to report; whatever happens, the robot is stopped, the recording closed and the report made."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from drivers.interface.errors import DeviceError, TrundleError
from runtime.assembly import Assembly, assemble
from runtime.configuration import Configuration
from runtime.cycle import Cycle
from runtime.fault_board import FaultBoard
from runtime.faults import Fault, FaultReport
from runtime.interrupt import Interrupts, Phase, interruptible
from runtime.keyframes import KeyFrames
from runtime.log.recorder import Recorder, RecorderReport
from runtime.loop import run_loop
from runtime.pacer import Pacer
from runtime.provenance import run_header
from runtime.realtime import realtime
from runtime.referee import Outcome, Referee
from runtime.report import FaultCount, RecordingFigures, RunReport, finite_or_none, stage_times
from runtime.stopwatch import Stopwatch

LARGEST_LAG = 0.02  # of the wall time: a real-time factor of 0.98


@dataclass(frozen=True, slots=True)
class RunOptions:
    """What the command line adds to the configuration."""

    seed: int = 0
    log: Path | None = None
    live: bool = False
    progress: Callable[[Cycle], None] = lambda _: None
    ready: Callable[[Assembly], None] = lambda _: None  # called once, just before the first tick


@dataclass(frozen=True, slots=True)
class RunResult:
    """The report, and what broke the run if something did."""

    report: RunReport
    failure: BaseException | None = None


def run(configuration: Configuration, options: RunOptions) -> RunResult:
    """Run the configured mission.

    Raises:
        ConfigurationError: parts do not fit together; nothing was opened.
        DeviceError: a device cannot be opened; everything is closed again.
        KeyboardInterrupt: Ctrl-C or SIGTERM before the first tick; everything is closed again.
    """
    with interruptible() as interrupts:
        assembly = assemble(configuration, options.seed)
        assembly.warm_up()
        recorder = Recorder(
            options.log,
            configuration.log,
            partial(run_header, assembly.configuration, assembly.scene, options.seed),
            lockstep=assembly.lockstep,
            live=options.live,
        )
        return _Run(assembly, options, recorder, interrupts).result()


class _Run:
    """One run; its methods are its phases."""

    def __init__(self, assembly: Assembly, options: RunOptions, recorder: Recorder, interrupts: Interrupts) -> None:
        self._assembly = assembly
        self._options = options
        self._recorder = recorder
        self._interrupts = interrupts
        self._stopwatch = Stopwatch()
        self._refused: tuple[str, ...] = ()
        self._wall_s = 0.0

    def result(self) -> RunResult:
        failure: BaseException | None = None
        with ExitStack() as closing:
            closing.callback(self._assembly.parts.runner.close)
            closing.callback(self._let_go)
            self._assembly.robot.open()  # before the recorder: a device that is not there leaves no empty log behind
            closing.callback(self._recorder.close)
            self._recorder.open()
            self._interrupts.phase = Phase.DRIVING
            pacer, referee = self._assembly.pacer(), self._referee()
            try:
                self._drive(pacer, referee)
            except BaseException as error:  # noqa: BLE001 - the report must be made; it is raised after that
                failure = error
            self._interrupts.phase = Phase.CLOSING
            failure = self._stopped() or failure
        return RunResult(self._report(pacer, referee, self._recorder.close(), failure), failure)

    def _stopped(self) -> DeviceError | None:
        """Stop and close the robot; return what a device had against it, as that matters more than what ended the run."""
        failures = []
        for end in (self._assembly.robot.stop, self._assembly.robot.close):
            try:
                end()
            except DeviceError as error:
                failures.append(error)
        return failures[0] if failures else None

    def _let_go(self) -> None:
        with suppress(DeviceError):  # after a run it has been closed already, and the failure was kept
            self._assembly.robot.close()

    def _referee(self) -> Referee:
        return Referee(
            self._assembly.mission,
            time_limit_s=self._assembly.time_limit_s,
            give_up_after_s=self._assembly.configuration.supervisor.give_up_after_s,
            interrupted=lambda: self._interrupts.asked,
            progress=self._options.progress,
        )

    def _drive(self, pacer: Pacer, referee: Referee) -> None:
        assembly = self._assembly
        required = assembly.configuration.log.on_unwritable == "stop"
        unwritable = Fault.REQUIRED_LOG_UNWRITABLE if required else Fault.LOG_UNWRITABLE
        pacer.measured_plan_ns = self._stopwatch.plan_ns
        recorded = recording(self._recorder, self._key_frames(), assembly.parts.board, unwritable)
        stages = assembly.parts.stages(assembly.robot.read, assembly.robot.write, recorded)
        system = assembly.configuration.loop.system
        if assembly.lockstep:  # a tick that waits for the collector loses no time
            system = system.model_copy(update={"freeze_garbage": False})
        with realtime(system) as self._refused:
            self._options.ready(assembly)
            start_s = time.perf_counter()
            try:
                run_loop(pacer, stages, self._stopwatch, referee.is_over)
            finally:
                self._wall_s = time.perf_counter() - start_s

    def _key_frames(self) -> KeyFrames | None:
        """Return what takes key frames; None where nothing is recorded."""
        interval_s = self._assembly.configuration.log.keyframe_interval_s
        return None if self._options.log is None else KeyFrames(self._assembly.parts, interval_s)

    def _report(self, pacer: Pacer, referee: Referee, recorded: RecorderReport, failure: BaseException | None) -> RunReport:
        assembly, tally = self._assembly, referee.tally
        outcome = referee.outcome or Outcome.STOPPED
        if isinstance(failure, KeyboardInterrupt):
            outcome = Outcome.INTERRUPTED
        factor = (tally.duration_s - assembly.world_late_s) / self._wall_s if self._wall_s else 0.0
        return RunReport(
            outcome=outcome.value,
            planner=assembly.configuration.planner.choice.name,
            scenario=assembly.configuration.scenario,
            seed=self._options.seed,
            ticks=tally.ticks,
            missed_deadlines=pacer.missed,
            min_clearance_m=finite_or_none(tally.min_clearance_m),
            path_length_m=tally.path_length_m,
            duration_s=tally.duration_s,
            odometry_error_m=finite_or_none(tally.odometry_error_m),
            odometry_error_rad=finite_or_none(tally.odometry_error_rad),
            stage_ms=stage_times(self._stopwatch.durations),
            faults=tuple(
                FaultCount(fault.value, count.ticks, count.first_tick, device, count.first.detail)
                for (fault, device), count in tally.faults.items()
            ),
            realtime_factor=factor,
            realtime_void=assembly.world_late_s > LARGEST_LAG * self._wall_s,
            realtime_refused=self._refused,
            recording=_figures(self._options.log, recorded, tally.duration_s),
            error=_error(failure),
            hit_while_standing=tally.hit_while_standing,
        )


def _error(failure: BaseException | None) -> str:
    if failure is None or isinstance(failure, KeyboardInterrupt):
        return ""
    return str(failure) if isinstance(failure, TrundleError) else f"{type(failure).__name__}: {failure}"


def recording(recorder: Recorder, key_frames: KeyFrames | None, board: FaultBoard, unwritable: Fault) -> Callable[[Cycle], None]:
    """Return `recorder.record` that adds the key frames and leaves word on the fault board when the log has become unwritable."""

    def record(cycle: Cycle) -> None:
        recorder.record(cycle, None if key_frames is None else key_frames.after(cycle))
        sentence = recorder.fault()
        if sentence:
            board.post(FaultReport(unwritable, "recorder", sentence), given=True)
        elif key_frames is not None and key_frames.fault:  # the log is written, and replays from its first tick only
            board.post(FaultReport(Fault.LOG_UNWRITABLE, "recorder", key_frames.fault), given=True)

    return record


def _figures(path: Path | None, recorded: RecorderReport, duration_s: float) -> RecordingFigures | None:
    if path is None:
        return None
    return RecordingFigures(
        path=str(path),
        ticks=recorded.written_ticks,
        dropped_ticks=recorded.dropped_ticks,
        dropped_views=recorded.dropped_views,
        bytes=recorded.bytes_written,
        bytes_per_s=recorded.bytes_written / duration_s if duration_s else 0.0,
        queue_high_water=recorded.queue_high_water,
        files=len(recorded.files),
        deleted_files=recorded.deleted_files,
        longest_sync_s=recorded.longest_sync_s,
        incidents=tuple(str(path) for path in recorded.incidents),
        fault=recorded.fault,
    )


def exit_code(result: RunResult) -> int:
    """Return what the command line exits with."""
    report = result.report
    if isinstance(result.failure, TrundleError):
        return result.failure.exit_code
    if report.outcome == Outcome.STOPPED.value and any(count.fault == Fault.DEVICE_FAULT.value for count in report.faults):
        return DeviceError.exit_code
    return {Outcome.REACHED.value: 0, Outcome.INTERRUPTED.value: 130}.get(report.outcome, 1)
