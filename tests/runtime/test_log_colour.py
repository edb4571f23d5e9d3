"""Pictures for the human eye: in the log as they came, and no part of what is replayed."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from drivers.interface.samples import ColourFrame, Stamp
from runtime.log.drawn.scene import COLOUR
from runtime.log.exact.part import consumed_schemas
from runtime.log.reading.read import read
from runtime.log.reading.verify import damaged_ticks, sensed_at
from runtime.log.recorder import Recorder
from runtime.log.settings import LogSettings
from tests.runtime.log_cycles import header, make_cycles


def test_a_picture_is_in_the_log_and_not_in_what_is_replayed(tmp_path: Path) -> None:
    jpeg = cv2.imencode(".jpg", np.full((24, 32, 3), 90, np.uint8))[1].tobytes()
    cycles = make_cycles(6)
    picture = ColourFrame(Stamp(1, 2, 0), jpeg)
    cycles[3] = replace(cycles[3], sensed=replace(cycles[3].sensed, colour=picture))
    recorder = Recorder(tmp_path / "a.rrd", LogSettings(), header, lockstep=True)
    recorder.open()
    for cycle in cycles:
        recorder.record(cycle)
    recorder.close()
    found = read(tmp_path / "a.rrd")
    assert damaged_ticks(found) == []
    assert sensed_at(found, cycles[3].sensed.tick.index).colour is None
    assert "colour" not in consumed_schemas()
    entity = read(tmp_path / "a.rrd", f"{COLOUR}/**")
    cells = entity.at(COLOUR, cycles[3].sensed.tick.index)
    (blob,) = (values for name, values in cells.items() if name.endswith("blob"))
    assert np.asarray(blob[0], dtype=np.uint8).tobytes() == jpeg
