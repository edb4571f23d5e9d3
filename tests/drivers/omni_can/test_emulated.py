"""The session against emulated wheel controllers, which speak the protocol from tables of their own; in lockstep, no process."""

import math
from contextlib import contextmanager

import can
import numpy as np
import pytest

from drivers.interface.commands import BodyTwist
from drivers.interface.devices import DeviceState
from drivers.omni_can.can_wire import BusChoice, CanWire
from drivers.omni_can.settings import OmniCanSettings
from tests.drivers.omni_can.fake_bus import Driven
from tests.sim_drivers.firmware.canbench import BASE, NODES, can_bench

TURN = 2 * math.pi
FORWARD = BASE.wheel_rates(BodyTwist(0.3, 0.0, 0.0)) / TURN


class Lockstep:
    """A session and emulated controllers on one virtual bus and one clock."""

    def __init__(self, bench, **settings):
        channel = bench.firmware._port.place.removeprefix("virtual ")
        chosen = OmniCanSettings(bus={"interface": "virtual", "channel": channel})
        self.bench = bench
        self.wire = CanWire(BusChoice("base", chosen.place, chosen.bus_arguments))
        self.driven = Driven(bus=self.wire, node_ids=NODES, begin_ns=bench.world.now_ns, **settings)

    def wait(self, seconds, turns_s=None):
        """Let time pass; command at 50 Hz."""
        for step in range(round(seconds / 0.005)):
            self.bench.world.step_to(self.bench.world.now_ns + 5_000_000)
            self.driven.now_ns = self.bench.world.now_ns
            if turns_s is not None and step % 4 == 0:
                self.driven.command(turns_s)
            else:
                self.driven.poll()

    @property
    def health(self):
        return self.driven.health


@contextmanager
def lockstep(version="0.6", settings=None, **firmware):
    with can_bench(version=version, encoder_ms=10, **firmware) as bench:
        both = Lockstep(bench, **({"firmware": "auto"} | (settings or {})))
        try:
            yield both
        finally:
            both.wire.close()


@pytest.mark.parametrize("version", ["0.5", "0.6"])
def test_it_opens_verifies_the_watchdogs_drives_and_rests(version):
    with lockstep(version) as both:
        both.wait(1.2)
        assert both.health.state is DeviceState.OPEN, both.health.fault
        assert both.health.protocol == f"CANSimple {version}"
        assert [axis.watchdog_trips for axis in both.bench.firmware.axes] == [1, 1, 1]
        both.driven.samples()
        before = both.bench.world.data.body("base").xpos.copy()
        both.wait(2.0, FORWARD)
        moved = both.bench.world.data.body("base").xpos - before
        assert 0.4 < moved[0] < 0.6
        assert both.health.state is DeviceState.OPEN
        samples = both.driven.samples()
        assert len(samples) == pytest.approx(200, abs=6)
        turned = samples["turns"][-1] - samples["turns"][0]
        assert BASE.twist(turned * TURN).vx == pytest.approx(moved[0], abs=0.02)
        assert (np.diff(samples["captured_ns"]) > 0).all()
        both.wait(0.7)  # the last command has expired
        assert both.health.expired_commands == 1
        assert both.bench.speed() < 0.02


def test_without_a_watchdog_it_does_not_open():
    with lockstep(axis={"watchdog_s": None}) as both:
        both.wait(1.5)
        assert both.health.state is DeviceState.FAULTED
        assert "the watchdog of axis 1 (node 4) did not trip" in both.health.fault
        assert not any(axis.armed for axis in both.bench.firmware.axes)


def test_when_the_commands_end_the_watchdogs_disarm_and_the_reset_brings_it_back():
    with lockstep() as both:
        both.wait(1.2)
        both.wait(0.5, FORWARD)
        both.wait(1.2)
        assert both.health.state is DeviceState.FAULTED
        assert both.health.fault.startswith("base: axis 1 (node 4) has disarmed: WATCHDOG_TIMER_EXPIRED")
        both.wait(0.3, FORWARD)
        assert both.bench.speed() < 0.02
        both.driven.session.clear_faults()
        both.wait(0.5, FORWARD)
        assert both.health.state is DeviceState.OPEN
        assert both.bench.speed() > 0.3


@pytest.mark.parametrize("version", ["0.5", "0.6"])
def test_an_estop_on_the_bus_is_named(version):
    with lockstep(version) as both:
        both.wait(1.2)
        both.wait(0.5, FORWARD)
        both.bench.send(NODES[1] << 5 | 2)
        both.wait(0.3, FORWARD)
        assert both.health.fault == "base: axis 2 (node 5) has disarmed: ESTOP_REQUESTED"
        both.wait(0.4)
        assert both.bench.speed() < 0.1


def test_the_measured_load_is_what_goes_over_the_bus():
    with lockstep() as both:
        both.wait(1.2)
        both.wait(2.2, FORWARD)
        per_axis = 100 + 10 + 10 + 1 + 50
        assert both.health.bus_load == pytest.approx(3 * per_axis * 135 / 500_000, rel=0.05)


def test_a_flood_of_foreign_frames_changes_nothing():
    with lockstep() as both:
        both.wait(1.2)
        received = both.health.foreign
        for _ in range(25):
            for identifier in (0x7F1, 0x123, 9 << 5 | 1):
                both.bench.bus.send(can.Message(arbitration_id=identifier, data=bytes(8), is_extended_id=False))
            both.wait(0.02, FORWARD)
        assert both.health.foreign - received == 75
        assert both.health.state is DeviceState.OPEN
