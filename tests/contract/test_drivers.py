"""Every driver: delivers honest samples while it is open and nothing else, and stops in whatever state it is."""

import inspect
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from drivers.interface.devices import Device, DeviceHealth, DeviceState
from drivers.interface.errors import DeviceError, TrundleError
from runtime.registry import Part, load, names
from tests.contract.devices import ROLE, Bench, bench
from tests.contract.facts import arrays, facts, forget_kernels, signatures
from tests.contract.rigs import RIGS

DRIVERS = names(Part.DRIVER)
IN_LOCKSTEP = [name for name in DRIVERS if name not in RIGS]
STILL = 1e-3  # m or rad in half a second


@pytest.fixture(params=DRIVERS)
def driver(request) -> str:
    return request.param


@pytest.fixture
def tested(driver):
    with bench(driver) as built:
        yield built


@pytest.fixture(params=[name for name in DRIVERS if hasattr(load(Part.DRIVER, name), "command")])
def moving(request) -> Iterator[Bench]:
    """A base or an arm, open and at rest."""
    with bench(request.param) as built:
        built.wait(0.2)  # whatever settles on the floor
        built.open()
        yield built


def test_stands_behind_the_contract_of_what_it_delivers(tested):
    tested.open()
    (role,) = {ROLE[type(sample)] for sample in tested.run(1.0)}
    for contract in (Device, role):
        assert isinstance(tested.device, contract)
    for name, method in inspect.getmembers(role, inspect.isfunction):
        if not name.startswith("_"):
            assert list(inspect.signature(getattr(tested.device, name)).parameters) == [*inspect.signature(method).parameters][1:]


def test_reads_nothing_unless_open(tested):
    tested.wait(0.3)
    assert tested.read() == ()
    tested.open()
    tested.wait(0.3)
    tested.device.close()
    assert tested.read() == ()
    tested.wait(0.3)
    assert tested.read() == ()


@pytest.mark.parametrize("state", ["never opened", "half open", "open", "running", "stopped", "failed", "closed", "opened again"])
def test_stops_closes_and_says_how_it_stands_in_every_state(tested, state):
    device = tested.device
    if state == "half open":
        tested.clock_fails = True
        with suppress(TrundleError):
            device.open()
    if state not in {"never opened", "half open"}:
        tested.open()
    if state in {"running", "opened again"}:
        tested.run(0.2)
    if state == "stopped":
        device.stop()
    if state == "failed":
        tested.fail()
    if state in {"closed", "opened again"}:
        device.close()
    if state == "opened again":
        tested.open()
    for act in (device.stop, device.stop, device.close, device.close, device.stop, device.close):
        assert isinstance(device.health(), DeviceHealth)
        act()
        assert device.health().device == "tested"
    assert device.health().state is DeviceState.CLOSED


def test_what_failed_to_open_can_be_opened_later(tested):
    tested.clock_fails = True
    with suppress(TrundleError):
        tested.device.open()
    tested.clock_fails = False
    tested.open()
    assert tested.device.health().state is DeviceState.OPEN
    assert tested.run(1.0)


def test_says_in_one_sentence_why_it_cannot_open(driver, monkeypatch):
    nowhere = {"path": Path("no/such/place")} if driver.startswith("recorded") else {}
    with bench(driver, missing=True, **nowhere) as tested:
        monkeypatch.setattr(sys, "stdin", None)
        try:
            tested.device.open()
        except TrundleError as error:
            sentence = str(error)
        else:
            assert driver not in RIGS
            return  # it always opens
        for act in (tested.device.stop, tested.device.stop, tested.device.close, tested.device.close):
            act()
    assert "tested" in sentence or "no/such/place" in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize("driver", IN_LOCKSTEP)
def test_counters_run_from_open(tested):
    tested.open()
    fresh = tested.device.health()
    tested.run(0.5)
    tested.device.close()
    tested.wait(0.3)
    tested.open()
    assert tested.device.health() == fresh


def test_samples_are_stamped_in_order(tested):
    tested.open()
    stamps = []
    for _ in range(40):
        tested.wait(0.05)
        new = [sample.stamp for sample in tested.read()]
        assert all(s.captured_ns <= s.received_ns <= tested.now_ns() for s in new)
        stamps += [s for s in new if s not in stamps]
    assert stamps
    assert all(a.captured_ns < b.captured_ns for a, b in pairwise(stamps))
    assert all(a.sequence < b.sequence for a, b in pairwise(stamps))
    assert len({s.clock for s in stamps}) == 1


def test_samples_own_their_arrays(tested):
    tested.open()
    samples = tested.run(0.5)
    seen = [facts(sample) for sample in samples]
    held = [array for sample in samples for array in arrays(sample)]
    assert not any(array.flags.writeable for array in held)
    for index, array in enumerate(held):
        assert not any(np.shares_memory(array, other) for other in held[index + 1 : index + 8])
    tested.run(0.5)
    assert [facts(sample) for sample in samples] == seen


@pytest.mark.parametrize("driver", IN_LOCKSTEP)
def test_nothing_is_new_when_no_time_passes(tested):
    tested.open()
    tested.wait(0.3)
    before = {sample.stamp.sequence for sample in tested.read()}
    for _ in range(3):
        assert {sample.stamp.sequence for sample in tested.read()} <= before


@pytest.mark.parametrize("driver", IN_LOCKSTEP)
def test_equal_worlds_and_seeds_give_equal_samples(driver):
    runs = []
    for _ in range(2):
        with bench(driver) as tested:
            tested.open()
            runs.append([*tested.run(2.0), tested.device.health()])
    assert facts(runs[0]) == facts(runs[1])


def test_nothing_is_compiled_once_the_world_stands(driver):
    forget_kernels()
    with bench(driver) as tested:
        ready = signatures()
        tested.open()
        tested.run(0.5)
        assert signatures() == ready


def test_health_says_what_was_delivered(tested):
    tested.open()
    samples = tested.run(1.0)
    health = tested.device.health()
    assert health.state is DeviceState.OPEN
    assert health.fault == ""
    assert health.received >= len(samples)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_refuses_what_is_not_finite(moving, bad):
    order = moving.order()
    for name in (field.name for field in fields(order) if field.type != "int"):
        with pytest.raises(DeviceError) as refusal:
            moving.command(replace(order, **{name: getattr(order, name) + bad}), lifetime_s=1.0)
        assert "tested" in str(refusal.value)
        assert "\n" not in str(refusal.value)
    assert moving.displacement(0.5) < STILL


def test_does_not_move_before_the_first_command(moving):
    assert moving.displacement(0.5) < STILL


def test_follows_a_command_as_long_as_it_is_valid(moving):
    moving.command(moving.order(), lifetime_s=1.0)
    assert moving.displacement(0.8) > 0.1 or not moving.is_in_world
    assert moving.device.health().expired_commands == 0


@pytest.mark.parametrize("lifetime_s", [-1.0, 0.0, 0.3])
def test_rests_once_its_command_has_expired_and_counts_it(moving, lifetime_s):
    moving.command(moving.order(), lifetime_s)
    moving.wait(max(lifetime_s, 0.0) + 2.0)  # a rover's brakes take more than one second
    assert moving.displacement(0.5) < STILL
    assert moving.device.health().expired_commands == int(moving.is_in_world)


@pytest.mark.parametrize("how", ["stop", "close"])
def test_rests_after_stop_and_after_close(moving, how):
    """Also when it was told something just before, which has not taken effect yet."""
    moving.run(0.5)
    moving.command(moving.order(), lifetime_s=10.0)
    getattr(moving.device, how)()
    moving.wait(2.0)
    assert moving.displacement(0.5) < STILL
    assert moving.device.health().expired_commands == 0


def test_a_closed_one_takes_no_commands(moving):
    order = moving.order()
    moving.device.close()
    with suppress(DeviceError):
        moving.command(order, lifetime_s=1.0)
    assert moving.displacement(0.5) < STILL


def test_what_it_was_told_does_not_outlive_its_closing(moving):
    moving.command(moving.order(), lifetime_s=10.0)
    moving.wait(0.3)
    moving.device.close()
    moving.wait(1.0)
    moving.open()
    assert moving.displacement(0.5) < STILL
