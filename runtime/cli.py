"""The command line.  An error is one readable sentence; a traceback comes only with --debug."""

from __future__ import annotations

import math
import os
import signal
import sys
from json import dumps
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

from drivers.interface.errors import ConfigurationError, TrundleError
from runtime import registry, yaml_files
from runtime.outputs import log_path, require_writable, write_text

app = typer.Typer(
    name="trundle",
    help="Hardware-in-the-loop deployment runtime for mobile robots and arms.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
console = Console()
errors = Console(stderr=True, soft_wrap=True)

Config = Annotated[str, typer.Argument(metavar="CONFIG", help="path of a YAML file, or the name of a shipped scenario")]


@app.callback()
def _debug(debug: Annotated[bool, typer.Option("--debug", help="show the traceback of an error")] = False) -> None:
    """Options of all commands; `main` reads --debug."""


@app.command()
def run(
    config: Config,
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="a.b=c", help="override a value; repeatable")] = None,
    seed: Annotated[int, typer.Option(min=0, help="seed of everything that is drawn")] = 0,
    duration: Annotated[float | None, typer.Option(metavar="SECONDS", help="end after so much of the run's time")] = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="pace a simulated world by the host's clock")] = False,
    live: Annotated[bool, typer.Option("--live", help="also stream to a Rerun viewer on loopback")] = False,
    log: Annotated[Path | None, typer.Option(help="where to record; default: a new file in runs/")] = None,
    no_log: Annotated[bool, typer.Option("--no-log", help="record nothing")] = False,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing log")] = False,
    json: Annotated[Path | None, typer.Option(help="write the run report here")] = None,
) -> None:
    """Run a mission: 0 accomplished, 1 not, 2 bad configuration, 3 device missing, 130 interrupted."""
    # Imported here: `trundle list` and `--help` must not wait for MuJoCo, numba and Rerun.
    import runtime.run as running  # noqa: PLC0415
    from runtime import configuration  # noqa: PLC0415
    from runtime.progress import RunProgress  # noqa: PLC0415

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


@app.command()
def evaluate(
    experiment: Annotated[str, typer.Argument(metavar="EXPERIMENT", help="path, or the name of a shipped experiment")],
    seeds: Annotated[int | None, typer.Option(min=1, help="run seeds 0 to N - 1; default: the experiment's")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="runs side by side")] = os.cpu_count() or 1,
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="a.b=c", help="override a value in every run")] = None,
    json: Annotated[Path | None, typer.Option(help="write every run's report here")] = None,
    markdown: Annotated[Path | None, typer.Option(help="write the table here as Markdown")] = None,
) -> None:
    """Run an experiment over its seeds and print its table beside the published figures."""
    from runtime.evaluation import load_evaluation  # noqa: PLC0415 - imported here, as above

    evaluation = load_evaluation(experiment, seeds, tuple(changes or ()))
    require_writable(json, "--json")
    require_writable(markdown, "--markdown")
    with Progress(console=console) as progress:
        task = progress.add_task(evaluation.title, total=evaluation.steps)
        found = evaluation.run(jobs, lambda: progress.advance(task))
    table = Table(*found.head, title=evaluation.title)
    for row in found.rows:
        table.add_row(*row)
    console.print(table)
    if json is not None:
        write_text(json, found.json)
    if markdown is not None:
        write_text(markdown, found.markdown())


@app.command(name="list")
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


@app.command()
def schema(
    out: Annotated[Path | None, typer.Option(help="write it here instead of printing it")] = None,
) -> None:
    """Print the JSON schema of a configuration, with the settings of every part, for editors that check YAML."""
    from runtime import schema as schemas  # noqa: PLC0415 - imported here, as above

    require_writable(out, "--out")
    text = dumps(schemas.schema(), indent=2)
    if out is None:
        typer.echo(text)
    else:
        write_text(out, text + "\n")


calibrate_app = typer.Typer(help="Identify what the data sheet does not know, and write it back as YAML.", no_args_is_help=True)
app.add_typer(calibrate_app, name="calibrate")


@calibrate_app.command("base")
def calibrate_base(
    config: Config,
    output: Annotated[Path, typer.Option(help="the configuration to write, which extends CONFIG")] = Path("calibrated.yaml"),
    changes: Annotated[list[str] | None, typer.Option("--set", metavar="a.b=c", help="override a value; repeatable")] = None,
    seed: Annotated[int, typer.Option(min=0, help="seed of everything that is drawn")] = 0,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing file")] = False,
) -> None:
    """Drive around slowly (2 m of free floor on every side) and identify wheels, gyro and delays."""
    from runtime import calibrate  # noqa: PLC0415 - imported here, as above

    if output.exists() and not force:
        raise ConfigurationError(f"--output {output} exists already; --force overwrites it")
    require_writable(output, "--output")
    with console.status("driving"):
        calibration = calibrate.calibrate(config, tuple(changes or ()), seed)
    console.print(calibrate.table_of(calibration))
    calibrate.write(calibration, config, output)
    console.print(f"written to {output}")


@app.command()
def review(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="a recording made by trundle run")],
    at: Annotated[int | None, typer.Option(metavar="TICK", min=0, help="open at this tick")] = None,
    screenshot: Annotated[Path | None, typer.Option(help="write a picture instead of opening a window")] = None,
) -> None:
    """Open a recording in the Rerun viewer, on loopback only."""
    from runtime.log import review as reviewing  # noqa: PLC0415 - imported here, as above

    reviewing.review(log, at, screenshot)


def main() -> None:
    """Run the command line and exit with its code."""
    os.environ.setdefault("RUST_LOG", "error")  # Rerun warns of what is meant: logs without a footer (see runtime/log/sink.py)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # being asked to end is Ctrl-C, whoever asks
    sys.exit(run_command(sys.argv[1:]))


def run_command(arguments: list[str]) -> int:
    """Run one command line; return the exit code.  Errors are printed on standard error."""
    debug = "--debug" in arguments
    plain = [argument for argument in arguments if argument != "--debug"]  # it may stand anywhere
    try:
        code = typer.main.get_command(app).main(plain, prog_name="trundle", standalone_mode=False)
    except (typer.Abort, KeyboardInterrupt):
        errors.print("interrupted", style="red")
        return 130
    except typer.TyperException as error:  # wrong usage
        if error.format_message():  # empty where the help was printed instead
            _complain(error.format_message())
        return ConfigurationError.exit_code
    except Exception as error:
        if debug:
            raise
        if isinstance(error, TrundleError):
            _complain(str(error))
            return error.exit_code
        _complain(f"{type(error).__name__}: {error} (--debug shows where)")  # somebody's part is broken
        return TrundleError.exit_code
    return code if isinstance(code, int) else 0


def _complain(sentence: str) -> None:
    errors.print(f"error: {sentence}", style="red", markup=False, highlight=False)
