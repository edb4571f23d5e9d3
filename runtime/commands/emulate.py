"""`trundle emulate`: world and emulated devices for another process to drive."""

from __future__ import annotations

import math
from typing import Annotated

import typer

from drivers.interface.errors import ConfigurationError
from runtime.commands.options import Changes, Config, Seed, console


def emulate(
    config: Config,
    changes: Changes = None,
    seed: Seed = 0,
    duration: Annotated[float | None, typer.Option(metavar="SECONDS", help="end after so much of the world's time")] = None,
) -> None:
    """Run world and emulated devices in real time for `trundle run` with the same CONFIG in another process; ends with Ctrl-C."""
    from runtime import configuration
    from runtime import emulate as emulating

    if duration is not None and not 0.0 < duration < math.inf:
        raise ConfigurationError(f"--duration takes seconds, more than 0 and finite, not {duration:g}")

    def ready(emulation: emulating.Emulation) -> None:
        for place in emulation.places:
            _say(place)
        _say(f"ready: {emulation.scenario}, physics step {emulation.world.step_ns / 1e6:g} ms; Ctrl-C ends it")

    def slow(factor: float) -> None:
        _say(f"too slow: {factor:.3f} of real time over the last seconds; below {emulating.LOWEST_FACTOR} a run is void")

    report = emulating.emulate(configuration.load(config, tuple(changes or ())), seed, duration, ready, slow)
    _say(f"ended after {report.emulated_s:.1f} s at {report.realtime_factor:.3f} of real time, {report.worlds} world(s)")


def _say(line: str) -> None:
    console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.file.flush()
