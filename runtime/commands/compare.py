"""`trundle compare`: two recordings, distribution by distribution."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from runtime.commands.options import console
from runtime.outputs import log_path, require_writable, write_text


def compare(
    log_a: Annotated[Path, typer.Argument(metavar="LOG_A", help="a recording, for instance of the simulation")],
    log_b: Annotated[Path, typer.Argument(metavar="LOG_B", help="another, for instance of the real robot")],
    log: Annotated[Path | None, typer.Option(help="write the distributions as a recording")] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing recording")] = False,
    json: Annotated[Path | None, typer.Option(help="write the figures here")] = None,
    markdown: Annotated[Path | None, typer.Option(help="write the table here as Markdown")] = None,
) -> None:
    """Compare two runs: latency, age, time, effort, odometry error and clearance."""
    from runtime import compare as comparing
    from runtime.log.drawn.comparison import write_comparison

    out = None if log is None else log_path(log, "compare", force=force)
    require_writable(json, "--json")
    require_writable(markdown, "--markdown")
    found, values = comparing.compare(log_a, log_b)
    console.print(comparing.table(found, log_a, log_b))
    if json is not None:
        write_text(json, comparing.as_json(found, log_a, log_b))
    text = comparing.markdown(found, log_a, log_b)
    if markdown is not None:
        write_text(markdown, text)
    if out is not None:
        units = {comparison.name: comparison.unit for comparison in found}
        pairs = {f"{name} [{units[name]}]": (a.values if a else None, b.values if b else None) for name, (a, b) in values.items()}
        write_comparison(out, pairs, text)
