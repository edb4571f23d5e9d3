"""`trundle evaluate`: an experiment over its seeds, as a table."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import Progress
from rich.table import Table

from runtime.commands.options import console
from runtime.outputs import require_writable, write_text


def evaluate(
    experiment: Annotated[str, typer.Argument(metavar="EXPERIMENT", help="path, or the name of a shipped experiment")],
    seeds: Annotated[int | None, typer.Option(min=1, help="run seeds 0 to N - 1; default: the experiment's")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="runs side by side")] = os.cpu_count() or 1,
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="a.b=c", help="override a value in every run")] = None,
    only: Annotated[
        list[str] | None, typer.Option(help="of an experiment with several tables, make this one; may be repeated")
    ] = None,
    json: Annotated[Path | None, typer.Option(help="write every run's report here")] = None,
    markdown: Annotated[Path | None, typer.Option(help="write the table here as Markdown")] = None,
) -> None:
    """Run an experiment over its seeds and print its table beside the published figures."""
    from runtime.evaluations.evaluation import load_evaluation

    evaluation = load_evaluation(experiment, seeds, tuple(changes or ()), tuple(only or ()))
    require_writable(json, "--json")
    require_writable(markdown, "--markdown")
    with Progress(console=console) as progress:
        task = progress.add_task(evaluation.title, total=evaluation.steps)
        found = evaluation.run(jobs, lambda: progress.advance(task))
    for one in (found, *found.further):
        table = Table(*one.head, title=one.title or evaluation.title)
        for row in one.rows:
            table.add_row(*row)
        console.print(table)
    if json is not None:
        write_text(json, found.json)
    if markdown is not None:
        write_text(markdown, found.markdown())
