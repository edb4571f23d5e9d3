"""What decides: estimator, router, planner, shield and supervisor, put together alike for a robot and for a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from drivers.interface.commands import Command
from drivers.interface.devices import Mounted
from drivers.interface.geometry import SE2
from drivers.interface.sensed import Sensed, Tick
from estimators.estimator import Estimator, EstimatorSetup
from planners.planner import Planner, PlannerSetup
from planners.router import Router, RouterSetup
from planners.shield import Shield, ShieldSetup
from runtime.budget import Budget, fixed, within
from runtime.configuration import Configuration
from runtime.cycle import Cycle
from runtime.fault_board import FaultBoard
from runtime.guards import guarded_route, guarded_update
from runtime.loop import Stages
from runtime.planning import PlannerRunner, Ready
from runtime.robot import Devices
from runtime.supervisor import Supervisor, SupervisorSetup


@dataclass(frozen=True, slots=True)
class Parts:
    """The parts between what was sensed and what is commanded."""

    estimator: Estimator
    router: Router
    planner: Planner
    runner: PlannerRunner
    shield: Shield
    supervisor: Supervisor
    board: FaultBoard

    def warm_up(self) -> None:
        """Compile every kernel, so that none is compiled inside a tick."""
        self.estimator.warm_up()
        self.router.warm_up()
        self.planner.warm_up()
        self.shield.warm_up()

    def stages(
        self, sense: Callable[[Tick], Sensed], write: Callable[[Command], None], record: Callable[[Cycle], None]
    ) -> Stages:
        """Return what the loop calls, between a robot's `sense` and `write`."""
        return Stages(
            sense=sense,
            estimate=guarded_update(self.estimator, self.board),
            route=guarded_route(self.router, self.board),
            plan=self.runner.plan,
            admit=self.supervisor.admit,
            write=write,
            record=record,
        )


def build_parts(
    configuration: Configuration, seed: int, devices: Devices, map_from_start: SE2, ready: Ready, budget: Budget
) -> Parts:
    """Build every part for a robot of these devices, of which only what they say of themselves is read.

    `budget` is of a planner that is called within the tick; one in the background has its latency.

    Raises:
        ConfigurationError: parts that do not fit together; the sentence says which.
    """
    board = FaultBoard()
    period_s = configuration.loop.period_ns * 1e-9
    radius_m = configuration.robot.radius_m
    limits = devices.base.limits if devices.base else None
    kinematics = devices.base.kinematics if devices.base else None
    arm_limits = devices.arm.limits if devices.arm else None
    imu_in_base_m = devices.imu.place_in_base_m if isinstance(devices.imu, Mounted) else (0.0, 0.0)

    planning = configuration.planner
    plan_period_s = period_s * planning.common.period_ticks
    shield = configuration.shield.build(ShieldSetup(period_s, radius_m, limits))
    told = PlannerSetup(plan_period_s, radius_m, limits, seed, arm_limits, shield.kept_clear_m)
    planner = planning.choice.build(told)
    budget_ns = configuration.loop.period_ns if planning.common.budget_ms is None else round(planning.common.budget_ms * 1e6)
    if latency := planning.common.latency_ticks:
        budget = fixed(latency * configuration.loop.period_ns)
    supervisor_setup = SupervisorSetup(period_s, limits, budget_ns, devices.operator is not None, arm_limits)
    return Parts(
        estimator=configuration.estimator.build(EstimatorSetup(period_s, radius_m, map_from_start, kinematics, imu_in_base_m)),
        router=configuration.router.build(RouterSetup(period_s, radius_m)),
        planner=planner,
        runner=PlannerRunner(
            planner,
            board,
            period_ticks=planning.common.period_ticks,
            latency_ticks=planning.common.latency_ticks,
            ready=ready,
            budget=within(budget, budget_ns),
        ),
        shield=shield,
        supervisor=Supervisor(configuration.supervisor, supervisor_setup, shield, board),
        board=board,
    )
