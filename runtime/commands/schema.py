"""`trundle schema`: what an editor needs to check a configuration."""

from __future__ import annotations

from json import dumps
from pathlib import Path
from typing import Annotated

import typer

from runtime.outputs import require_writable, write_text


def schema(
    out: Annotated[Path | None, typer.Option(help="write it here instead of printing it")] = None,
) -> None:
    """Print the JSON schema of a configuration, with the settings of every part, for editors that check YAML."""
    from runtime import schema as schemas

    require_writable(out, "--out")
    text = dumps(schemas.schema(), indent=2)
    if out is None:
        typer.echo(text)
    else:
        write_text(out, text + "\n")
