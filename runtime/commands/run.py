"""`trundle run`: a mission from start to report."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from drivers.interface.errors import ConfigurationError
from runtime.commands.options import Changes, Config, Seed, console
from runtime.outputs import log_path, require_writable


def run(
    config: Config,
    changes: Changes = None,
    seed: Seed = 0,
    duration: Annotated[float | None, typer.Option(metavar="SECONDS", help="end after so much of the run's time")] = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="pace a simulated world by the host's clock")] = False,
    live: Annotated[bool, typer.Option("--live", help="also stream to a Rerun viewer on loopback")] = False,
    log: Annotated[Path | None, typer.Option(help="where to record; default: a new file in runs/")] = None,
    no_log: Annotated[bool, typer.Option("--no-log", help="record nothing")] = False,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing log")] = False,
    json: Annotated[Path | None, typer.Option(help="write the run report here")] = None,
) -> None:
    """Run a mission: 0 accomplished, 1 not, 2 bad configuration, 3 device missing, 130 interrupted."""
    import runtime.run as running
    from runtime import configuration
    from runtime.progress import RunProgress

    overrides = [*(changes or ())]
    if realtime:
        overrides.append("loop.realtime=true")
    if duration is not None:
        if not 0.0 < duration < math.inf:
            raise ConfigurationError(f"--duration takes seconds, more than 0 and finite, not {duration:g}")
        overrides.append(f"mission.time_limit_s={duration}")
    loaded = configuration.load(config, tuple(overrides))
    require_writable(json, "--json")
    path = None if no_log else log_path(log, f"{loaded.scenario}-{loaded.planner.choice.name}-{seed}", force=force)
    with RunProgress(console, loaded.scenario) as progress:
        options = running.RunOptions(seed, path, live, progress.update, progress.ready)
        result = running.run(loaded, options)
    console.print(result.report.table())
    if json is not None:
        result.report.write(json)
    if isinstance(result.failure, Exception):
        raise result.failure
    raise typer.Exit(running.exit_code(result))
