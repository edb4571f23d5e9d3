"""Opens a log in the Rerun viewer, or takes a picture of it without a display; never beyond loopback, without analytics."""

from __future__ import annotations

import os
import socket
import subprocess
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from rerun.experimental import ViewerClient

from drivers.interface.errors import ConfigurationError
from runtime.log.drawn.layout import Question
from runtime.log.files.paths import files_of
from runtime.log.reading.opening import require_log
from runtime.log.reading.read import ticks
from runtime.log.reading.repair import quiet_environment, rerun_program

WINDOW = "1920x1080"
_START_TIMEOUT_S = 60.0
_POLL_S = 0.2
_SETTLE_S = 15.0  # until the viewer's notices about itself have faded and everything is drawn
_PACKAGES = "mesa-vulkan-drivers libxkbcommon-x11-0 libxcursor1 libxi6 libxrandr2 libx11-xcb1"


def review(
    log: Path,
    at_tick: int | None = None,
    screenshot: Path | None = None,
    question: Question | None = None,
    window: str = WINDOW,
) -> None:
    """Open a log at a tick and at a question's tab, if they are given; with `screenshot`, only write a picture of it.

    Raises:
        ConfigurationError: the log, the tick or this machine's graphics will not do; says why.
    """
    for file in files_of(log):
        require_log(file)
    if at_tick is not None:
        _require_tick(log, at_tick)
    if screenshot is None and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ConfigurationError("there is no display to open the viewer on; --screenshot PATH takes a picture without one")
    with _Viewer(log, window, headless=screenshot is not None) as viewer:
        if at_tick is not None or question is not None or screenshot is not None:
            client = _connect(viewer)
            if question is not None:
                _turn_to(client, question)
            if at_tick is not None:
                client.set_time("tick", sequence=at_tick, play_state="paused")
            if screenshot is not None:
                _take(client, screenshot)
                return
        if viewer.process.wait() != 0:
            raise viewer.failure()


def question_named(name: str) -> Question:
    """Return the question of this name.

    Raises:
        ConfigurationError: there is none.
    """
    known = [question.value for question in Question]
    if name not in known:
        raise ConfigurationError(f"--question takes {' or '.join(known)}, not '{name}'")
    return Question(name)


def _turn_to(client: ViewerClient, question: Question) -> None:
    """Bring the tab of a question to the front.

    Raises:
        ConfigurationError: the log's layout has no such tab.
    """
    layout = client.get_blueprint("recording").blueprint
    containers = {entity: parts["ContainerBlueprint"] for entity, parts in layout.items() if "ContainerBlueprint" in parts}
    wanted = [entity for entity, container in containers.items() if container.get("display_name") == question.tab]
    tabs = [container for container in containers.values() if wanted and wanted[0] in container["contents"]]
    if not tabs:
        raise ConfigurationError(f"--question {question.value}: the log's layout has no tab '{question.tab}'")
    tabs[0]["active_tab"] = wanted[0]
    client.set_blueprint(layout, "recording")


def _require_tick(log: Path, tick: int) -> None:
    held = ticks(log)
    if tick not in held:
        span = f"ticks {held[0]} to {held[-1]}" if held else "no tick"
        raise ConfigurationError(f"--at {tick}: the log {log} holds {span}, not this one")


class _Viewer:
    """A viewer process; what it says goes to a file, as a pipe that nobody reads would stall it."""

    def __init__(self, log: Path, window: str, *, headless: bool) -> None:
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed in __exit__
        port = _free_port()
        self.url = f"rerun+http://127.0.0.1:{port}/proxy"
        command = [rerun_program(), "--bind", "127.0.0.1", "--port", str(port), "--window-size", window]
        command += [str(file) for file in files_of(log)]  # segments are one recording to the viewer
        command += ["--headless"] if headless else []
        self.process = subprocess.Popen(command, env=quiet_environment(), stdout=subprocess.DEVNULL, stderr=self._said)

    def __enter__(self) -> _Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()  # it holds nothing that a friendlier end would save
        self.process.wait()
        self._said.close()

    def failure(self) -> ConfigurationError:
        """Return why the viewer ended by itself."""
        self._said.seek(0)
        said = self._said.read().decode(errors="replace").strip()
        if any(word in said.lower() for word in ("graphics adapter", "vulkan", "wgpu", "libx", "winit")):
            return ConfigurationError(f"the viewer finds no graphics; on Debian or Ubuntu: apt-get install {_PACKAGES}")
        return ConfigurationError(f"the viewer ended: {said.splitlines()[-1] if said else 'it said nothing'}")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _connect(viewer: _Viewer) -> ViewerClient:
    """Return a connection to the viewer once it shows the whole log."""
    deadline = time.monotonic() + _START_TIMEOUT_S
    while time.monotonic() < deadline:
        if viewer.process.poll() is not None:
            raise viewer.failure()
        with suppress(ConnectionError, RuntimeError):  # not listening yet
            client = ViewerClient.connect(viewer.url)
            state = client.get_state()
            if state.views and not state.loading:
                return client
        time.sleep(_POLL_S)
    raise ConfigurationError(f"the viewer did not show the log within {_START_TIMEOUT_S:g} s")


def _take(client: ViewerClient, screenshot: Path) -> None:
    time.sleep(_SETTLE_S)
    try:
        screenshot.parent.mkdir(parents=True, exist_ok=True)
        screenshot.write_bytes(client.take_screenshot())
    except OSError as error:
        raise ConfigurationError(f"--screenshot {screenshot} cannot be written: {error.strerror}") from error
