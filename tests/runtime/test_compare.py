import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.interface.errors import ConfigurationError
from drivers.interface.seeds import stream
from runtime.cli import run_command
from runtime.compare import block_medians, compare, compared, difference, summary
from runtime.cycle import Cycle
from runtime.log.reading.opening import reader_of
from runtime.quantities import Quantity, quantities
from tests.runtime.log_cycles import make_cycles
from tests.runtime.test_log_recorder import record

CYCLES = make_cycles(60)


def slowed(cycle: Cycle, by_ns: int) -> Cycle:
    stages = (cycle.stage_ns[0] + by_ns, *cycle.stage_ns[1:])
    return replace(cycle, stage_ns=stages)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("log")
    record(folder / "a.rrd", CYCLES)
    record(folder / "b.rrd", [slowed(cycle, 2_000_000) for cycle in CYCLES])
    return folder / "a.rrd", folder / "b.rrd"


def test_the_quantities_are_those_of_the_cycles(logs: tuple[Path, Path]) -> None:
    found = quantities(logs[0])
    assert found["camera latency"].values == pytest.approx(20.1)
    assert found["oldest input's age"].values == pytest.approx(21.0)
    assert found["true clearance"].values == pytest.approx(0.9)
    sent = [cycle.verdict.command.base for cycle in CYCLES]
    assert found["speed"].values == pytest.approx([twist.speed_m_s for twist in sent if twist])
    step = np.diff([[twist.vx, twist.vy] for twist in sent if twist], axis=0) / 0.05
    assert found["acceleration"].values == pytest.approx(np.hypot(*step.T))
    assert found["jerk"].values == pytest.approx(np.hypot(*np.diff(step, axis=0).T) / 0.05)
    apart = [(c.sensed.truth.map_from_base.inverse() @ c.belief.map_from_base) for c in CYCLES if c.sensed.truth]
    assert found["position error"].values == pytest.approx([np.hypot(pose.x, pose.y) for pose in apart])
    assert found["heading error"].values == pytest.approx([abs(pose.yaw) for pose in apart])


def test_what_differs_is_found_and_what_does_not_is_zero(logs: tuple[Path, Path]) -> None:
    found = {comparison.name: comparison for comparison in compare(*logs)[0]}
    sense = found["sense time"].difference
    assert sense is not None
    assert sense.median == pytest.approx(2.0)
    assert sense.interval == pytest.approx((2.0, 2.0))
    assert sense.gap == 1.0
    for name in ("camera latency", "speed", "position error", "true clearance", "estimate time"):
        same = found[name].difference
        assert same is not None
        assert (same.median, same.gap) == (0.0, 0.0)
    assert found["position error"].difference.interval is None  # one path, not many draws


def test_the_statistics_of_uniform_values_have_their_closed_forms() -> None:
    a, b = np.linspace(0.0, 1.0, 1001), np.linspace(0.25, 1.25, 1001)
    high = summary(Quantity("s", a))
    low = summary(Quantity("s", a, low_is_bad=True))
    assert high is not None
    assert low is not None
    assert (high.values, high.median, high.worst) == (1001, 0.5, 1.0)
    assert (high.worst_5_percent, high.worst_1_percent) == pytest.approx((0.95, 0.99))
    assert (low.worst_5_percent, low.worst_1_percent, low.worst) == pytest.approx((0.05, 0.01, 0.0))
    apart = difference("x", Quantity("s", a), Quantity("s", b))
    assert apart.median == pytest.approx(0.25)
    assert apart.gap == pytest.approx(0.25, abs=2e-3)


def test_the_interval_of_independent_normal_values_is_as_wide_as_theory_says() -> None:
    """The median of n normal values has the standard deviation sqrt(pi / 2n)."""
    values = stream(5, "test.values").normal(size=4000)
    spread = float(np.std(block_medians(values, "test")))
    assert spread == pytest.approx(np.sqrt(np.pi / 2 / 4000), rel=0.25)


def test_the_interval_widens_where_neighbours_resemble_each_other() -> None:
    independent = stream(6, "test.values").normal(size=1000)
    sticky = np.repeat(independent[:200], 5)
    assert np.std(block_medians(sticky, "test")) > 1.3 * np.std(block_medians(independent, "test"))


def test_a_quantity_of_one_log_only_stands_alone() -> None:
    alone = compared("x", None, Quantity("m", np.arange(3.0)))
    assert alone.a is None
    assert alone.difference is None
    assert alone.rows()[0][2] == "none"


def test_the_command_writes_table_figures_and_recording(
    logs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = {name: tmp_path / f"out.{name}" for name in ("json", "md", "rrd")}
    a, b = (str(log) for log in logs)
    options = ["--json", str(paths["json"]), "--markdown", str(paths["md"]), "--log", str(paths["rrd"])]
    assert run_command(["compare", a, b, *options]) == 0
    assert "sense time [ms]" in capsys.readouterr().out
    figures = {quantity["name"]: quantity for quantity in json.loads(paths["json"].read_text())["quantities"]}
    assert figures["sense time"]["difference"]["median"] == pytest.approx(2.0)
    assert "| sense time [ms] | A | 0.4 |" in paths["md"].read_text()
    drawn = {chunk.entity_path for chunk in reader_of(paths["rrd"]).stream()}
    plots = [entity for entity in drawn if entity.startswith("/compare/") and entity[-2:] in {"/A", "/B"}]
    assert len(plots) == 2 * len(figures)
    assert run_command(["compare", a, b, "--log", str(paths["rrd"])]) == 2
    assert "exists already" in capsys.readouterr().err


def test_bad_input_is_one_sentence(logs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["compare", str(logs[0]), str(tmp_path / "none.rrd")]) == 2
    assert capsys.readouterr().err == f"error: there is no log {tmp_path / 'none.rrd'}\n"
    record(tmp_path / "empty.rrd", [])
    with pytest.raises(ConfigurationError, match=r"holds no tick"):
        quantities(tmp_path / "empty.rrd")
