"""`trundle list`: everything that a name can choose."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from runtime import registry, yaml_files
from runtime.commands.options import console


def list_() -> None:
    """List everything that a name can choose, with one line each, and the shipped configurations, robots and experiments."""
    table = Table.grid(padding=(0, 2), expand=False)
    for part in registry.Part:
        table.add_row(f"[bold]{part.noun}s")
        for name in registry.names(part):
            table.add_row(f"  {name}", Text(registry.first_line(part, name)))
    table.add_row("[bold]shipped files")
    for folder in ("scenarios", "robots", "experiments"):
        table.add_row(f"  configs/{folder}", ", ".join(yaml_files.shipped(folder)))
    console.print(table)
