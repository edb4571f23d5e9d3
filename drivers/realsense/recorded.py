"""A recording of librealsense, played at the pace in which it was made."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drivers.realsense.library import librealsense


class RecordedSource:
    """A `.bag` file."""

    def __init__(self, path: Path) -> None:
        """Open the file."""
        self._rs = librealsense()
        self._device = self._rs.context().load_device(str(path))

    @property
    def device(self) -> Any:
        """The recorded camera."""
        return self._device

    @property
    def is_over(self) -> bool:
        """Whether the last frame has been played."""
        return bool(self._device.current_status() == self._rs.playback_status.stopped)

    def pump(self) -> None:
        """Do nothing: librealsense has threads."""

    def close(self) -> None:
        """Do nothing more: its sensors are closed."""
