"""What several commands have in common: the arguments they share, and where they print."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

_WIDTH_OF_A_FILE = 160  # columns; a table in a file or a pipe must not be cut to 80
console = Console(width=None if sys.stdout.isatty() else _WIDTH_OF_A_FILE)

Config = Annotated[str, typer.Argument(metavar="CONFIG", help="path of a YAML file, or the name of a shipped scenario")]
Changes = Annotated[list[str] | None, typer.Option("--set", metavar="a.b=c", help="override a value; repeatable")]
Seed = Annotated[int, typer.Option(min=0, help="seed of everything that is drawn")]
LogFile = Annotated[Path, typer.Argument(metavar="LOG", help="a recording made by trundle run")]
