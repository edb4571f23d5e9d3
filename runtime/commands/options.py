"""What several commands have in common: the arguments they share, and where they print."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

console = Console()

Config = Annotated[str, typer.Argument(metavar="CONFIG", help="path of a YAML file, or the name of a shipped scenario")]
Changes = Annotated[list[str] | None, typer.Option("--set", metavar="a.b=c", help="override a value; repeatable")]
Seed = Annotated[int, typer.Option(min=0, help="seed of everything that is drawn")]
LogFile = Annotated[Path, typer.Argument(metavar="LOG", help="a recording made by trundle run")]
