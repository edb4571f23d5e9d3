"""A script of misbehaviour: when it goes on, whom it concerns, what happens once, what is left to chance."""

import numpy as np

from sim_drivers.firmware.fault_script import Fault, FaultScript
from sim_drivers.firmware.frame_faults import FrameFault, FrameFaults

MS = 1_000_000


def script(*faults: Fault) -> FaultScript[Fault]:
    return FaultScript(faults, np.random.default_rng(3))


def test_goes_on_from_its_beginning_and_no_longer_at_its_end():
    faults = script(Fault(kind="nan", from_s=1.0, until_s=2.0))
    seen = {time_ms: faults.active("nan", time_ms * MS) is not None for time_ms in (999, 1000, 1999, 2000)}
    assert seen == {999: False, 1000: True, 1999: True, 2000: False}
    assert faults.active("freeze", 1500 * MS) is None


def test_what_happens_once_happens_once_for_each_entry():
    faults = script(Fault(kind="reflex", from_s=1.0), Fault(kind="reflex", from_s=3.0))
    assert [faults.strikes("reflex", second * 1000 * MS) for second in range(6)] == [False, True, False, True, False, False]


def test_chance_follows_the_probability():
    faults = script(Fault(kind="drop", from_s=1.0, probability=0.3))
    assert not any(faults.hits("drop", 0) for _ in range(100))
    assert 0.25 < np.mean([faults.hits("drop", 2000 * MS) for _ in range(4000)]) < 0.35


def test_one_axis_may_misbehave_alone():
    faults = FrameFaults((FrameFault(kind="estop", node=1),), np.random.default_rng(3))
    assert [faults.strikes("estop", 0, node) for node in (0, 1, 2, 1)] == [False, True, False, False]
    everyone = FrameFaults((FrameFault(kind="reboot"),), np.random.default_rng(3))
    assert [everyone.strikes("reboot", 0, node) for node in (0, 1, 2, 1)] == [True, True, True, False]
