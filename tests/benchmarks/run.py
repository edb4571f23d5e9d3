"""Measures every figure and prints it beside its budget, what was published and its peer.

`python -m tests.benchmarks.run [NAME ...]`, or `make bench`.

Each `bench_*.py` here offers `cases()` (names and calls to be timed), `figures()` (what it measured itself), or both.  With
`cases()` may come `peers()` (calls of the same names, of someone else's code on the same input) and their common name `PEER`.
Exit code 1: a figure without a budget, or outside of it.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from types import ModuleType

from rich.console import Console
from rich.table import Table

from tests.benchmarks.budgets import Budget, load_budgets
from tests.benchmarks.figure import Figure, timed

HERE = Path(__file__).parent
NO_BUDGET = "no budget"
COLUMNS = (
    "figure", "p50", "mean", "p99", "unit", "budget", "published",
    "peer", "peer p50", "peer p99", "ratio", "p99 ratio", "verdict",
)  # fmt: skip


def modules() -> list[ModuleType]:
    """Import every benchmark, in the order of their names."""
    return [importlib.import_module(f"tests.benchmarks.{path.stem}") for path in sorted(HERE.glob("bench_*.py"))]


def measured(module: ModuleType, wanted: list[str]) -> Iterator[Figure]:
    """Measure a module's figures: all if its own name is wanted, else the cases whose names are."""
    whole = not wanted or any(name in module.__name__ for name in wanted)
    peers = dict(module.peers()) if hasattr(module, "peers") else {}
    for name, call in module.cases() if hasattr(module, "cases") else ():
        if whole or any(part in name for part in wanted):
            yield timed(name, call, getattr(module, "PEER", "peer"), peers.get(name))
    if whole and hasattr(module, "figures"):
        yield from module.figures()


def verdict(figure: Figure, budgets: Mapping[str, Budget]) -> tuple[str, ...]:
    """Return what is wrong with a figure; nothing, if it is well."""
    return budgets[figure.name].broken_by(figure) if figure.name in budgets else (NO_BUDGET,)


def table_of(figures: list[Figure], budgets: Mapping[str, Budget]) -> Table:
    """Lay the figures out beside budget and peer."""
    table = Table(*COLUMNS)
    for figure in figures:
        wrong, budget = verdict(figure, budgets), budgets.get(figure.name)
        table.add_row(
            figure.name,
            *(_number(value) for value in (figure.value, figure.mean, figure.p99)),
            figure.unit,
            "none" if budget is None else str(budget),
            _number(None if budget is None else budget.published),
            figure.peer,
            *(_number(value) for value in (figure.peer_value, figure.peer_p99, figure.ratio, figure.p99_ratio)),
            f"[red]{'; '.join(wrong)}[/red]" if wrong else "[green]ok[/green]",
        )
    return table


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"


def main(arguments: list[str] | None = None) -> int:
    """Run from the command line; return the exit code."""
    parser = argparse.ArgumentParser(prog="make bench", description="Measure figures beside their budgets.")
    parser.add_argument("names", nargs="*", help="parts of the names of benchmarks or figures; all if none is given")
    parser.add_argument("--json", type=Path, help="also write the figures here")
    options = parser.parse_args(arguments)
    budgets = load_budgets()
    console = Console(width=None if sys.stdout.isatty() else 200)
    gc.collect()
    gc.freeze()  # as the loop's real-time set-up does
    figures: list[Figure] = []
    for module in modules():
        console.print(f"[dim]{module.__name__.rpartition('.')[2]} ...[/dim]")
        figures += measured(module, options.names)
    console.print(table_of(figures, budgets))
    if options.json is not None:
        rows = [{**asdict(figure), "ratio": figure.ratio, "wrong": verdict(figure, budgets)} for figure in figures]
        options.json.write_text(json.dumps(rows, indent=2) + "\n")
    unmeasured = sorted(budgets.keys() - {figure.name for figure in figures})
    if unmeasured and not options.names:
        console.print(f"Budgets without a figure: {', '.join(unmeasured)}")
    wrong = [f"{figure.name}: {'; '.join(found)}" for figure in figures if (found := verdict(figure, budgets))]
    for line in wrong:
        console.print(f"[red]{line}[/red]")
    return 1 if wrong or not figures else 0


if __name__ == "__main__":
    sys.exit(main())
