"""`trundle evaluate`: an experiment over its seeds, as a table."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import Progress
from rich.table import Table

from drivers.interface.errors import ConfigurationError
from runtime.commands.options import console
from runtime.outputs import require_writable, write_text

if TYPE_CHECKING:
    from runtime.evaluations.journal import Journal


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
    journal: Annotated[
        Path | None, typer.Option(help="keep each result here as it comes; given again, go on from what is there")
    ] = None,
) -> None:
    """Run an experiment over its seeds and print its table beside the published figures."""
    from runtime.evaluations.evaluation import load_evaluation
    from runtime.evaluations.side_by_side import Workers

    evaluation = load_evaluation(experiment, seeds, tuple(changes or ()), tuple(only or ()))
    require_writable(json, "--json")
    require_writable(markdown, "--markdown")
    require_writable(journal, "--journal")
    kept = None if journal is None else _opened(journal, evaluation.title)
    with Progress(console=console) as progress:
        task = progress.add_task(evaluation.title, total=evaluation.steps)
        found = evaluation.run(Workers(jobs, lambda: progress.advance(task), kept))
    for one in (found, *found.further):
        table = Table(*one.head, title=one.title or evaluation.title)
        for row in one.rows:
            table.add_row(*row)
        console.print(table)
    if json is not None:
        write_text(json, found.json)
    if markdown is not None:
        write_text(markdown, found.markdown())


def _opened(path: Path, title: str) -> Journal:
    """Open a journal of this code's results."""
    from runtime.evaluations.journal import Journal
    from runtime.log.header import code_version

    version, modified = code_version()
    if modified and path.exists():
        raise ConfigurationError(f"--journal {path} is there already, but this code has changes that its results may lack")
    return Journal(path, f"'{title}' at {version}")
