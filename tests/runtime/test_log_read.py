from pathlib import Path

import pytest
import rerun as rr

from drivers.interface.errors import ConfigurationError
from runtime.log.reading.read import read, texts, ticks
from runtime.log.reading.repair import repair
from runtime.log.reading.review import review
from tests.runtime.log_cycles import make_cycles
from tests.runtime.test_log_recorder import record

CYCLES = make_cycles(12)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "a.rrd"
    record(path, CYCLES)
    return path


def test_the_words_tell_what_happened_and_when_it_was_over(log: Path) -> None:
    assert ticks(log) == list(range(12))
    assert texts(log).splitlines() == [
        "goal: 7 m, 0 m",
        "planner: reason: clear",
        "response: RUN",
        "operator: jog 0.1 m/s, 0 m/s, -0 rad/s",
        "operator: new goal at 1 m, 2 m",
        "fault: silent_device of camera: nothing for 210 ms",
        "response: STAND_DOWN",
        "over: silent_device of camera",
        "response: RUN",
        "operator: jog 0.1 m/s, 0 m/s, -0 rad/s",
    ]


def foreign(path: Path) -> None:
    with rr.RecordingStream("somebody_else") as stream:
        stream.save(path)
        stream.log("a", rr.Scalars(1.0))
        stream.disconnect()


@pytest.mark.parametrize("use", [read, review])
def test_what_is_no_log_of_ours_is_refused_with_one_sentence(tmp_path: Path, use) -> None:  # type: ignore[no-untyped-def]
    empty, text, other = tmp_path / "empty.rrd", tmp_path / "text.rrd", tmp_path / "other.rrd"
    empty.touch()
    text.write_text("not a recording")
    foreign(other)
    expected = {
        tmp_path / "none.rrd": f"there is no log {tmp_path / 'none.rrd'}",
        tmp_path: f"there is no log {tmp_path}: it is a folder",
        empty: f"the log {empty} is empty",
        text: f"{text} is not a Rerun recording",
        other: f"{other} was not recorded by trundle but by somebody_else",
    }
    for path, sentence in expected.items():
        with pytest.raises(ConfigurationError) as caught:
            use(path)
        assert str(caught.value) == sentence


def test_a_tick_that_was_not_recorded_is_refused_with_those_that_were(log: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"--at 99: the log .* holds ticks 0 to 11, not this one"):
        review(log, at_tick=99)


def test_without_a_display_a_picture_is_offered(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(ConfigurationError, match="no display to open the viewer on; --screenshot PATH"):
        review(log)


def test_a_repair_never_overwrites_and_says_when_nothing_is_left(log: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match="exists already"):
        repair(log, log)
    (tmp_path / "text.rrd").write_text("not a recording")
    with pytest.raises(ConfigurationError, match=r"text\.rrd is not a Rerun recording"):
        repair(tmp_path / "text.rrd", tmp_path / "b.rrd")
