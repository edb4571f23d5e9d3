"""`trundle log`: care of recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from runtime.commands.options import LogFile, console

app = typer.Typer(help="Care of recordings; of several files, name any.", no_args_is_help=True, pretty_exceptions_enable=False)

Output = Annotated[Path | None, typer.Option(help="where to write; default: beside the log.  Nothing is overwritten")]


@app.command()
def info(log: LogFile) -> None:
    """Say where a recording comes from and what it holds."""
    from runtime.log.reading.isolated import described

    table = Table.grid(padding=(0, 2))
    for name, text in described(log).lines:
        table.add_row(Text(name, style="bold"), Text(text))
    console.print(table)


@app.command()
def verify(log: LogFile) -> None:
    """Check that every tick is there and undamaged: 0 it is so, 1 not, 2 it cannot be read."""
    from runtime.log.reading.isolated import verified

    found = verified(log)
    for sentence in found.findings:
        console.print(sentence, style="red", markup=False, highlight=False, soft_wrap=True)
    span = f"{found.ticks} ticks, {found.first_tick} to {found.last_tick}" if found.ticks else "no tick"
    sound = found.ticks - len(found.damaged)
    console.print(f"{log}: {span}; {sound} with a checksum that fits" + ("" if found.findings else "; whole"), soft_wrap=True)
    raise typer.Exit(1 if found.findings else 0)


@app.command()
def repair(log: LogFile, output: Output = None) -> None:
    """Save what can be read of a damaged recording to another one."""
    from runtime.log.reading.isolated import verified
    from runtime.log.reading.repair import repair as save

    path = save(log, output)
    found = verified(path)
    span = f"{found.ticks} ticks, {found.first_tick} to {found.last_tick}" if found.ticks else "no tick"
    console.print(f"{path}: {span}, {len(found.damaged)} of them damaged", soft_wrap=True)


@app.command()
def cut(
    log: LogFile,
    around: Annotated[int, typer.Option(metavar="TICK", min=0, help="the tick in the middle")],
    seconds: Annotated[float, typer.Option(min=0.1, max=3600.0, help="how much, half of it before the tick")] = 10.0,
    output: Output = None,
) -> None:
    """Write the seconds around a tick to a small recording that can be replayed by itself."""
    from runtime.log.reading.cut import cut as cut_out

    path = cut_out(log, around, seconds, output)
    console.print(f"{path}: replay it with `trundle replay {path}`", soft_wrap=True)
