from types import SimpleNamespace

import pytest
from pydantic import ValidationError

from tests.benchmarks.budgets import Budget, load_budgets
from tests.benchmarks.figure import Figure, of_distribution, timed
from tests.benchmarks.run import NO_BUDGET, measured, table_of, verdict


def test_the_shipped_budgets_cover_every_stage_and_planner():
    budgets = load_budgets()
    stages = ("sense", "estimate", "route", "plan", "admit", "write", "record")
    assert {f"stage_{stage}" for stage in stages} | {"dwa_step", "point_ds_step", "resident_memory", "log_rate"} <= budgets.keys()


@pytest.mark.parametrize(
    ("budget", "figure", "wrong"),
    [
        (Budget(at_most=2.0), Figure("f", 2.0), ()),
        (Budget(at_most=2.0), Figure("f", 2.1), ("p50 over 2",)),
        (Budget(at_most=2.0, p99_at_most=3.0), Figure("f", 1.0, p99=3.5), ("p99 over 3",)),
        (Budget(p99_at_most=3.0), Figure("f", 1.0), ("p99 over 3",)),  # not measured is not met
        (Budget(at_most=2.0, mean_at_most=2.0), Figure("f", 1.0, mean=2.5), ("mean over 2",)),
        (Budget(unit="x", at_least=6.0), Figure("f", 5.0, unit="x"), ("under 6",)),
        (Budget(at_least=6.0, unit="x"), Figure("f", float("nan"), unit="x"), ("under 6",)),
        (Budget(at_most=6.0), Figure("f", float("nan")), ("p50 over 6",)),
        (Budget(ratio_at_most=1.5), Figure("f", 3.0, peer="C", peer_value=1.0), ("p50 ratio over 1.5",)),
        (Budget(ratio_at_most=1.5), Figure("f", 1.4, peer="C", peer_value=1.0), ()),
        (Budget(p99_ratio_at_most=1.5), Figure("f", 1.0, 4.0, peer="C", peer_value=1.0, peer_p99=2.0), ("p99 ratio over 1.5",)),
        (Budget(unit="MB", at_most=1.0), Figure("f", 0.5, unit="ms"), ("measured in ms, allowed in MB",)),
        (Budget(), Figure("f", 1e9), ()),
    ],
)
def test_a_figure_stands_beside_its_budget(budget, figure, wrong):
    assert verdict(figure, {"f": budget}) == wrong


def test_a_figure_without_a_budget_is_wrong():
    assert verdict(Figure("new", 1.0), {}) == (NO_BUDGET,)


def test_a_budget_with_an_unknown_key_is_refused():
    with pytest.raises(ValidationError):
        Budget.model_validate({"at_mots": 2.0})


def test_median_and_tail_are_those_of_the_sample():
    figure = of_distribution("f", [float(k) for k in range(101)], "us", "C", [2.0 * k for k in range(101)])
    assert (figure.value, figure.p99, figure.ratio, figure.p99_ratio) == (50.0, 99.0, 0.5, 0.5)
    assert of_distribution("f", [0.0, 0.0, 3.0]).mean == 1.0


def test_what_was_published_stands_beside_the_figure():
    table = table_of([Figure("manifold_solver", 0.4)], load_budgets())
    published = next(column for column in table.columns if column.header == "published")
    assert list(published.cells) == ["5.39"]


def test_a_peer_takes_turns_with_us():
    order: list[str] = []
    figure = timed("f", lambda: order.append("ours"), "theirs", lambda: order.append("theirs"))
    assert order[::2] == ["ours"] * (len(order) // 2)
    assert order[1::2] == ["theirs"] * (len(order) // 2)
    assert figure.peer == "theirs"


def test_names_choose_what_is_measured():
    module = SimpleNamespace(
        __name__="tests.benchmarks.bench_thing",
        cases=lambda: [("fast", int), ("slow", int)],
        figures=lambda: [Figure("whole", 1.0)],
    )
    assert [figure.name for figure in measured(module, [])] == ["fast", "slow", "whole"]
    assert [figure.name for figure in measured(module, ["slow"])] == ["slow"]
    assert [figure.name for figure in measured(module, ["thing"])] == ["fast", "slow", "whole"]
