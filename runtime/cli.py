"""The command line.  An error is one readable sentence; a traceback comes only with --debug."""

from __future__ import annotations

import os
import signal
import sys
from typing import Annotated

import typer
from rich.console import Console

from drivers.interface.errors import ConfigurationError, TrundleError
from runtime.commands import calibrate, log
from runtime.commands.compare import compare
from runtime.commands.doctor import doctor
from runtime.commands.emulate import emulate
from runtime.commands.evaluate import evaluate
from runtime.commands.listing import list_
from runtime.commands.replay import replay
from runtime.commands.review import review
from runtime.commands.run import run
from runtime.commands.schema import schema

app = typer.Typer(
    name="trundle",
    help="Hardware-in-the-loop deployment runtime for mobile robots and arms.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
errors = Console(stderr=True, soft_wrap=True)

app.command()(run)
app.command()(emulate)
app.command()(doctor)
app.command()(evaluate)
app.command(name="list")(list_)
app.command()(schema)
app.add_typer(calibrate.app, name="calibrate")
app.add_typer(log.app, name="log")
app.command()(replay)
app.command()(review)
app.command()(compare)


@app.callback()
def _debug(debug: Annotated[bool, typer.Option("--debug", help="show the traceback of an error")] = False) -> None:
    """Options of all commands; `main` reads --debug."""


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
