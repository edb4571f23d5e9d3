"""`trundle review`: a recording in the Rerun viewer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from runtime.commands.options import LogFile


def review(
    log: LogFile,
    at: Annotated[int | None, typer.Option(metavar="TICK", min=0, help="open at this tick")] = None,
    question: Annotated[str | None, typer.Option(metavar="NAME", help="open at this tab: happened or late")] = None,
    screenshot: Annotated[Path | None, typer.Option(help="write a picture instead of opening a window")] = None,
) -> None:
    """Open a recording in the Rerun viewer, on loopback only."""
    from runtime.log.reading import review as reviewing

    reviewing.review(log, at, screenshot, None if question is None else reviewing.question_named(question))
