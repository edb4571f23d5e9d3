"""Every shield: whatever is asked, what comes out can be reached and is otherwise the same command."""

from dataclasses import replace

import pytest

from drivers.interface.commands import Command
from planners.shield import ShieldSetup
from runtime.registry import Part, load, names
from tests.contract.streams import BASES, PERIOD_S, RADIUS_M, beliefs, stream
from tests.contract.subjects import Subject, subjects


def built(name: str, base: str | None):
    cls = load(Part.SHIELD, name)
    return cls(cls.Settings(), ShieldSetup(PERIOD_S, RADIUS_M, stream(base).limits if base else None))


@pytest.mark.parametrize("subject", subjects(Part.SHIELD), ids=str)
def test_the_twist_is_inside_the_reachable_set_whatever_was_asked(subject: Subject):
    shield = subject.build()
    for command, belief, reachable in subject.inputs:
        filtered = shield.filter(command, belief, reachable)
        sent, low, high = filtered.command.base, reachable.lowest, reachable.highest
        if command.base is None:
            assert sent is None
            continue
        assert low.vx <= sent.vx <= high.vx
        assert low.vy <= sent.vy <= high.vy
        assert low.wz <= sent.wz <= high.wz


@pytest.mark.parametrize("subject", subjects(Part.SHIELD), ids=str)
def test_only_the_twist_is_touched_and_that_is_said(subject: Subject):
    shield = subject.build()
    for command, belief, reachable in subject.inputs:
        filtered = shield.filter(command, belief, reachable)
        assert replace(filtered.command, base=command.base) == command
        nearest = None if command.base is None else reachable.clip(command.base)
        assert filtered.intervened == (filtered.command.base != nearest)


@pytest.mark.parametrize("name", names(Part.SHIELD))
def test_a_robot_without_a_base_needs_no_shielding(name):
    belief, command = beliefs(next(iter(BASES)))[0], Command(None, None, 1, 0)
    reachable = subjects(Part.SHIELD)[0].inputs[0][2]
    assert built(name, None).filter(command, belief, reachable).command == command
