"""`trundle doctor`: what must be known before motion is allowed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivers.interface.errors import DeviceError
from runtime.commands.options import Changes, Config, console
from runtime.outputs import require_writable, write_text


def doctor(
    config: Config,
    changes: Changes = None,
    json: Annotated[Path | None, typer.Option(help="write the findings here too")] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="hardware may be armed: its wheels are off the floor, its arm has room")
    ] = False,
) -> None:
    """Check this machine and these devices: 0 motion is allowed, 3 it is not.  The next run's recording holds the findings."""
    from runtime import configuration
    from runtime.doctor.doctor import examine
    from runtime.doctor.findings import examination_path

    def permitted(name: str) -> bool:
        question = f"The {name} will be armed and told to stand still. Are its wheels off the floor, has it room?"
        return yes or (console.is_terminal and typer.confirm(question))

    loaded = configuration.load(config, tuple(changes or ()))
    kept = examination_path(loaded.robot.name)
    for path, option in ((json, "--json"), (kept, "the examination")):
        require_writable(path, option)
    examination = examine(loaded, permitted)
    for path in (json, kept):
        if path is not None:
            write_text(path, examination.as_json())
    console.print(examination.table())
    raise typer.Exit(0 if examination.motion_allowed else DeviceError.exit_code)
