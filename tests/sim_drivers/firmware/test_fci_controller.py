"""The emulated FCI controller against packets packed by hand from the protocol, and its limits by closed forms; no libfranka."""

import socket
import struct
from contextlib import contextmanager, suppress

import numpy as np
import pytest

from drivers.interface.arm_motion import PANDA
from drivers.interface.geometry import SE2
from sim_drivers.arm_model import READY_RAD
from sim_drivers.firmware.fci_motion import MOST_LOST, SetPoint
from sim_drivers.firmware.fci_protocol import Error
from sim_drivers.scene import Scene, Shape, StaticObstacle
from tests.sim_drivers.firmware.fcibench import controller_of, free_host

MS = 1_000_000
READY = np.array(READY_RAD)
# Offsets in the state, counted by hand: 8 bytes of id, then 4 for each number before.
Q, Q_D, DQ_D = 8 + 4 * 147, 8 + 4 * 154, 8 + 4 * 168
GENERATOR, CONTROLLER, ERRORS, REFLEX_REASON, MODE, SUCCESS_RATE = 1288, 1289, 1290, 1331, 1372, 1373


class Client:
    """A client by bytes."""

    def __init__(self, world, controller, host):
        self.world, self.controller = world, controller
        self.udp = socket.socket(type=socket.SOCK_DGRAM)
        self.udp.bind(("127.0.0.1", 0))
        self.udp.setblocking(False)  # a datagram on loopback is there as soon as it was sent
        self.tcp = socket.create_connection((host, 1337), timeout=5.0)
        self.states = []
        self.source = None

    def cycle(self, count=1):
        for _ in range(count):
            self.world.step_to(self.world.now_ns + MS)

    def state(self):
        """Let a cycle pass and return the newest state."""
        self.cycle()
        data, self.source = self.udp.recvfrom(4096)
        with suppress(BlockingIOError):
            while True:
                data = self.udp.recv(4096)
        assert len(data) == 1377
        return data

    def ask(self, data):
        self.tcp.sendall(data)

    def reply(self, size):
        data = b""
        while len(data) < size:
            data += self.tcp.recv(size - len(data))
        return data

    def connect(self, version=10):
        self.ask(struct.pack("<IIIHH", 0, 7, 16, version, self.udp.getsockname()[1]))
        self.cycle()
        return self.reply(15)

    def move(self, identity=9, controller=0, generator=0):
        deviations = struct.pack("<6d", *[0.0] * 6)
        self.ask(
            struct.pack("<IIIII", 1, identity, 125, controller, generator) + deviations + b"\0" + struct.pack("<7d", *[0.0] * 7)
        )
        self.cycle()
        return self.reply(13)

    def command(self, state, position, finished=False):
        """Answer a state."""
        head = state[:8] + struct.pack("<7d", *position) + bytes(8 * (7 + 16 + 6 + 2))
        self.udp.sendto(head + b"\0" + bytes((finished,)) + bytes(57), self.source)


@contextmanager
def client(**settings):
    host = free_host()
    world, controller = controller_of(host, **settings)
    controller.open()
    one = Client(world, controller, host)
    try:
        one.cycle()
        yield one
    finally:
        one.tcp.close()
        one.udp.close()
        controller.close()


def floats(state, offset, count=7):
    return np.array(struct.unpack_from(f"<{count}f", state, offset))


def test_connecting_is_answered_with_the_version_and_states_flow():
    with client() as one:
        assert one.connect() == struct.pack("<IIIBH", 0, 7, 15, 0, 10)
        first, second = (one.state() for _ in range(2))
        assert struct.unpack_from("<Q", second)[0] == struct.unpack_from("<Q", first)[0] + 1
        assert floats(second, Q) == pytest.approx(READY, abs=1e-3)
        assert floats(second, Q_D) == pytest.approx(READY, abs=1e-6)
        assert (second[GENERATOR], second[MODE]) == (0, 1)
        assert not any(second[ERRORS:MODE])


def test_another_version_is_refused():
    with client() as one:
        assert one.connect(version=9) == struct.pack("<IIIBH", 0, 7, 15, 1, 10)


def test_the_model_is_the_urdf_that_the_world_is_made_of():
    with client() as one:
        one.connect()
        one.ask(struct.pack("<III", 11, 3, 12))
        one.cycle()
        command, identity, size, status = struct.unpack("<IIIB", one.reply(13))
        assert (command, identity, status) == (11, 3, 0)
        text = one.reply(size - 13).decode()
        assert text.rstrip().endswith("</robot>")
        assert text.count("position_based_velocity_limits velocity_offset") == 7


def test_a_motion_is_begun_obeyed_and_ended_and_the_replies_come_in_order():
    with client() as one:
        one.connect()
        assert one.move() == struct.pack("<IIIB", 1, 9, 13, 1)
        while (state := one.state())[MODE] != 2:
            pass
        assert (state[GENERATOR], state[CONTROLLER]) == (1, 0)
        target = READY + 1e-6 * np.eye(7)[0]
        one.command(state, target)
        state = one.state()
        assert floats(state, Q_D)[0] == pytest.approx(target[0], abs=1e-7)
        assert floats(state, DQ_D)[0] == pytest.approx(1e-3, rel=1e-3)
        assert struct.unpack_from("<f", state, SUCCESS_RATE)[0] == 1.0
        one.command(state, target, finished=True)
        state = one.state()
        assert (state[GENERATOR], state[MODE]) == (0, 1)
        assert one.reply(13) == struct.pack("<IIIB", 1, 9, 13, 0)


def test_an_old_command_is_a_lost_one_and_twenty_in_a_row_are_a_reflex():
    with client() as one:
        one.connect()
        one.move()
        while (state := one.state())[MODE] != 2:
            pass
        one.command(state, READY)
        stale = one.state()
        for lost in range(MOST_LOST):
            state = one.state()
            assert state[MODE] == (4 if lost == MOST_LOST - 1 else 2)
            one.command(stale, READY)
        assert state[ERRORS + 25] == state[REFLEX_REASON + 25] == 1
        assert sum(state[ERRORS:REFLEX_REASON]) == 1
        assert one.reply(13) == struct.pack("<IIIB", 1, 9, 13, 8)
        one.ask(struct.pack("<III", 10, 4, 12))
        one.cycle(49)
        for _ in range(3):
            one.cycle()
        assert one.reply(13) == struct.pack("<IIIB", 10, 4, 13, 0)


def test_a_second_client_is_turned_away():
    with client() as one:
        one.connect()
        with socket.create_connection(one.tcp.getpeername(), timeout=5.0) as other:
            one.cycle(2)
            assert other.recv(1) == b""
        assert len(one.state()) == 1377


@pytest.mark.parametrize("junk", [b"GET / HTTP/1.1\r\n\r\n", struct.pack("<III", 99, 1, 12), struct.pack("<III", 1, 1, 2**31)])
def test_who_does_not_speak_the_protocol_is_hung_up_on(junk):
    with client() as one:
        one.ask(junk)
        one.cycle(3)
        assert one.tcp.recv(1) == b""


@pytest.mark.parametrize(
    ("positions", "error"),
    [
        ([1.1e-6 * 7.5], Error.ACCELERATION_DISCONTINUITY),
        ([16e-6], Error.VELOCITY_DISCONTINUITY),
        ([2.3e-3 - 1e-5], Error.VELOCITY_LIMITS_VIOLATION),
        ([3.0], Error.POSITION_LIMITS_VIOLATION),
        ([np.nan], Error.POSITION_LIMITS_VIOLATION),
    ],
)
def test_which_limit_makes_which_error(positions, error):
    point = SetPoint(np.array([0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0]))
    start = point.position_rad
    for position in positions:
        wrong = point.take(start + position * np.eye(7)[0], first=False)
    assert wrong is error
    assert (point.position_rad == start).all()


def test_what_is_lost_is_extrapolated_with_constant_acceleration_and_a_brake_keeps_the_limits():
    point = SetPoint(READY)
    step = 6e-6 * np.eye(7)[0]  # 6 rad/s^2
    assert point.take(READY + step, first=True) is None
    for _ in range(19):
        point.extrapolate()
    assert point.position_rad[0] - READY[0] == pytest.approx(6e-6 * 20 * 21 / 2)
    assert point.velocity_rad_s[0] == pytest.approx(0.12)
    before = point.acceleration_rad_s2
    for _ in range(300):
        point.brake()
        assert (np.abs(point.acceleration_rad_s2 - before) <= 1.001e-3 * PANDA.jerk_rad_s3 + 0.02).all()
        before = point.acceleration_rad_s2
    assert not point.velocity_rad_s.any()


def test_an_arm_that_runs_into_something_stops_by_a_reflex():
    wall = StaticObstacle("wall", Shape.box(0.2, 0.4, 1.5), SE2(0.35, 0.0))
    with client(scene=Scene("wall", SE2(), (), 60.0, (wall,))) as one:
        one.cycle(20)
        assert one.connect()[12] == 0
        assert one.move()[12] == 1
        one.cycle(2)
        assert one.state()[ERRORS + 6] == 1
