"""The bundle of devices: opening, stopping and closing work whatever single devices do."""

from collections.abc import Callable

import pytest

from drivers.interface.commands import BodyTwist, Command
from drivers.interface.devices import DeviceHealth, DeviceState
from drivers.interface.errors import DeviceError
from drivers.interface.geometry import SE2
from drivers.interface.mission import Goal, Mission
from drivers.interface.samples import NewGoal, OperatorEvent, ResetFaults, Stamp
from drivers.interface.sensed import Tick
from runtime.mission import MissionTracker
from runtime.robot import Devices, Robot


class Fake:
    """A device that writes down what happens to it, and fails where it is told to."""

    def __init__(self, name: str, diary: list[str], fails_at: str = "") -> None:
        self.name, self.diary, self.fails_at = name, diary, fails_at

    def _do(self, what: str) -> None:
        self.diary.append(f"{self.name} {what}")
        if self.fails_at and what.startswith(self.fails_at):
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
        return self._read("drain", ())

    def latest(self) -> None:
        return self._read("latest", None)

    def health(self) -> DeviceHealth:
        return self._read("health", DeviceHealth(self.name, DeviceState.OPEN))

    def _read(self, what: str, answer: object) -> object:
        if what == self.fails_at:
            raise OSError(f"{self.name} has been unplugged")
        return answer


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


def test_whatever_a_device_raises_when_it_is_opened_the_sentence_names_it() -> None:
    class Odd(Fake):
        def open(self) -> None:
            raise ValueError("unsupported firmware")

    diary: list[str] = []
    with pytest.raises(DeviceError, match="the imu cannot open: ValueError: unsupported firmware"):
        robot(diary, lambda name: (Odd if name == "imu" else Fake)(name, diary)).open()
    assert "camera close" in diary


@pytest.mark.parametrize(("broken", "what"), [("camera", "latest"), ("imu", "drain"), ("base", "drain"), ("base", "health")])
def test_a_device_that_dies_is_a_fault_of_its_own_and_the_others_are_read(broken: str, what: str) -> None:
    bundle = robot([], lambda name: Fake(name, [], what if name == broken else ""))
    for _ in range(2):  # as long as it goes on
        sensed = bundle.read(Tick(0, 0, 1))
        states = {health.device: (health.state, health.fault) for health in sensed.health}
        assert states.pop(broken) == (DeviceState.FAULTED, f"OSError: {broken} has been unplugged")
        assert set(states.values()) == {(DeviceState.OPEN, "")}
        assert len(sensed.operator) == 1


def test_a_base_that_takes_no_command_is_faulted_at_the_next_tick() -> None:
    bundle = robot([], lambda name: Fake(name, [], "command" if name == "base" else ""))
    bundle.write(Command(BodyTwist(0.5, 0, 0), None, 7, 0))
    faults = [[health.fault for health in bundle.read(Tick(k, 0, 1)).health] for k in range(2)]
    assert faults == [["", "", "base cannot command 0.5 until 7", ""], ["", "", "", ""]]


def test_only_what_is_commanded_is_written() -> None:
    diary: list[str] = []
    bundle = robot(diary, lambda name: Fake(name, diary))
    bundle.write(Command(None, None, 5, 0))
    bundle.write(Command(BodyTwist(0.5, 0, 0), None, 7, 0))
    assert diary == ["base command 0.5 until 7"]


class Latching(Fake):
    """A device that latches its own fault until it is reset."""

    fault = "axis 2 has tripped"

    def clear_faults(self) -> None:
        self._do("clear_faults")
        self.fault = ""

    def health(self) -> DeviceHealth:
        return DeviceHealth(self.name, DeviceState.FAULTED if self.fault else DeviceState.OPEN, self.fault)


class Resetting(Fake):
    asks = False

    def drain(self) -> tuple[OperatorEvent, ...]:
        return (OperatorEvent(Stamp(0, 0, 0), ResetFaults()),) if self.asks else ()


def test_the_operators_reset_reaches_the_devices_before_they_say_how_they_stand() -> None:
    diary: list[str] = []
    base, camera = Latching("base", diary), Latching("camera", diary, "clear_faults")
    operator = Resetting("operator", diary)
    devices = Devices(base=base, camera=camera, imu=Fake("imu", diary), operator=operator)
    robot = Robot(devices, MissionTracker(Mission(SE2(), ())))
    assert {h.device: h.state for h in robot.read(Tick(0, 0, 1)).health}["base"] is DeviceState.FAULTED
    operator.asks = True
    health = {h.device: h for h in robot.read(Tick(1, 1, 1)).health}
    assert health["base"].state is DeviceState.OPEN
    assert health["camera"].fault == "camera cannot clear_faults"
    assert diary == ["camera clear_faults", "base clear_faults"]
