"""`trundle calibrate`: what the data sheet does not know."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drivers.interface.errors import ConfigurationError
from runtime.commands.options import Changes, Config, Seed, console
from runtime.outputs import require_writable

app = typer.Typer(help="Identify what the data sheet does not know, and write it back as YAML.", no_args_is_help=True)

Logs = Annotated[list[Path] | None, typer.Option("--log", metavar="LOG", help="a recording made by trundle run; repeatable")]


@app.command("base")
def base(
    config: Config,
    output: Annotated[Path, typer.Option(help="the configuration to write, which extends CONFIG")] = Path("calibrated.yaml"),
    changes: Changes = None,
    seed: Seed = 0,
    log: Logs = None,
    closure: Annotated[
        bool, typer.Option("--closure", help="each recording begins and ends on the same mark; drive loops in both senses")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing file")] = False,
) -> None:
    """Identify wheels, gyro and delays: by recordings, or driving around slowly (2 m of free floor on every side)."""
    from runtime import calibrate

    if output.exists() and not force:
        raise ConfigurationError(f"--output {output} exists already; --force overwrites it")
    require_writable(output, "--output")
    with console.status("reading" if log else "driving"):
        calibration = calibrate.calibrate(config, tuple(changes or ()), seed, logs=tuple(log or ()), closure=closure)
    console.print(calibrate.table_of(calibration))
    calibrate.write(calibration, config, output)
    console.print(f"written to {output}")


@app.command("camera")
def camera(
    config: Config,
    output: Annotated[Path, typer.Option(help="the configuration to write, which extends CONFIG")] = Path("calibrated.yaml"),
    changes: Changes = None,
    seed: Seed = 0,
    log: Annotated[Path | None, typer.Option("--log", metavar="LOG", help="a recording made by trundle run")] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing file")] = False,
) -> None:
    """Identify the camera's height, pitch and roll from the floor in front of the robot, which stands."""
    from runtime import calibrate_camera

    if output.exists() and not force:
        raise ConfigurationError(f"--output {output} exists already; --force overwrites it")
    require_writable(output, "--output")
    with console.status("looking"):
        calibration = calibrate_camera.calibrate(config, tuple(changes or ()), seed, log)
    console.print(calibrate_camera.table_of(calibration))
    calibrate_camera.write(calibration, config, tuple(changes or ()), output)
    console.print(f"written to {output}")
