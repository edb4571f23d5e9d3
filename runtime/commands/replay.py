"""`trundle replay`: the loop again over a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivers.interface.errors import ConfigurationError
from runtime.commands.options import Changes, LogFile, console


def replay(
    log: LogFile,
    first: Annotated[int | None, typer.Option("--from", metavar="TICK", min=0, help="begin at or before this tick")] = None,
    last: Annotated[int | None, typer.Option("--to", metavar="TICK", min=0, help="end with this tick")] = None,
    planner: Annotated[str | None, typer.Option(metavar="NAME", help="what would this planner have commanded?")] = None,
    changes: Changes = None,
    output: Annotated[Path | None, typer.Option("--log", help="record both sides here")] = None,
    tolerance: Annotated[
        float | None, typer.Option(min=0.0, help="compare numbers within this, tick by tick from recorded beliefs")
    ] = None,
    json: Annotated[Path | None, typer.Option(help="write the result here")] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing log")] = False,
) -> None:
    """Run the loop again over a recording: 0 it comes to the same, 1 it does not, 2 it cannot be replayed."""
    from runtime.outputs import log_path, require_writable, write_text
    from runtime.replay.damage import damage_of
    from runtime.replay.recording import Recording
    from runtime.replay.replay import ReplayOptions
    from runtime.replay.replay import replay as run_again

    require_writable(json, "--json")
    damage = damage_of(log)  # before Rerun's reader meets it, and before anything is overwritten
    for sentence in damage.sentences:
        console.print(sentence, markup=False, highlight=False, soft_wrap=True)
    if not damage.is_readable:
        raise typer.Exit(1)
    if output is not None and output.resolve() == log.resolve():
        raise ConfigurationError(f"--log {output} is the log that is to be replayed")
    path = None if output is None else log_path(output, "", force=force)
    with Recording(path) as recording:
        options = ReplayOptions(first, last, planner, tuple(changes or ()), tolerance, recording.opened)
        report = run_again(log, options)
    for sentence in report.sentences():
        console.print(sentence, markup=False, highlight=False, soft_wrap=True)
    if json is not None:
        write_text(json, report.json())
    raise typer.Exit(1 if damage.is_altered else report.exit_code)
