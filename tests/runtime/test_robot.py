"""The bundle of devices: opening, stopping and closing work whatever single devices do."""

from collections.abc import Callable

import pytest

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.devices import DeviceHealth, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal, Mission
from drivers.interface.samples import NewGoal, OperatorEvent, Stamp
from drivers.interface.sensed import Tick
from runtime.mission import MissionTracker
from runtime.robot import Devices, Robot


class Fake:
    """A device that writes down what happens to it, and fails where it is told to."""

    def __init__(self, name: str, diary: list[str], fails_at: str = "") -> None:
        self.name, self.diary, self.fails_at = name, diary, fails_at

    def _do(self, what: str) -> None:
        self.diary.append(f"{self.name} {what}")
        if what == self.fails_at:
            raise DeviceError(f"{self.name} cannot {what}")

    def open(self) -> None:
        self._do("open")

    def stop(self) -> None:
        self._do("stop")

    def close(self) -> None:
        self._do("close")

    def command(self, twist: BodyTwist, expires_ns: int) -> None:
        self._do(f"command {twist.vx} until {expires_ns}")

    def drain(self) -> tuple[()]:
        return ()

    def latest(self) -> None:
        return None

    def health(self) -> DeviceHealth:
        return DeviceHealth(self.name, DeviceState.OPEN)


class Operating(Fake):
    def drain(self) -> tuple[OperatorEvent, ...]:
        return (OperatorEvent(Stamp(0, 0, 0), NewGoal(Goal(1.0, 2.0))),)


def robot(diary: list[str], make: Callable[[str], Fake]) -> Robot:
    devices = Devices(camera=make("camera"), imu=make("imu"), base=make("base"), operator=Operating("operator", diary))
    return Robot(devices, MissionTracker(Mission(SE2(), (Goal(9.0, 9.0),))))


def test_when_one_device_cannot_be_opened_all_are_closed_and_the_sentence_is_its() -> None:
    diary: list[str] = []
    with pytest.raises(DeviceError, match="base cannot open"):
        robot(diary, lambda name: Fake(name, diary, "open" if name == "base" else "")).open()
    assert {"camera close", "imu close", "base close"} <= set(diary)


@pytest.mark.parametrize("action", ["stop", "close"])
def test_one_broken_device_does_not_keep_the_others_from_it(action: str) -> None:
    diary: list[str] = []
    broken = robot(diary, lambda name: Fake(name, diary, action if name == "camera" else ""))
    with pytest.raises(DeviceError, match="camera"):
        getattr(broken, action)()
    assert [line for line in diary if line.endswith(action)] == [f"{n} {action}" for n in ("camera", "imu", "base", "operator")]


def test_a_new_goal_of_the_operator_replaces_the_mission_at_the_same_tick() -> None:
    diary: list[str] = []
    sensed = robot(diary, lambda name: Fake(name, diary)).read(Tick(0, 0, 1))
    assert sensed.mission.goals == (Goal(1.0, 2.0),)
    assert [health.device for health in sensed.health] == ["camera", "imu", "base", "operator"]


def test_only_what_is_commanded_is_written() -> None:
    diary: list[str] = []
    bundle = robot(diary, lambda name: Fake(name, diary))
    bundle.write(Command(None, None, 5, 0))
    bundle.write(Command(BodyTwist(0.5, 0, 0), None, 7, 0))
    assert diary == ["base command 0.5 until 7"]
