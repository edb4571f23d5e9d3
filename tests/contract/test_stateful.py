"""What DESIGN promises of everything that decides, whichever it is: same answers, from anywhere on, at any time, to itself."""

import pytest

from drivers.interface.errors import ConfigurationError
from drivers.interface.stateful import Stateful
from estimators.estimator import Estimator
from planners.planner import Planner
from planners.router import Router
from planners.shield import Shield
from runtime.registry import Part
from tests.contract.facts import facts, forget_kernels, signatures
from tests.contract.subjects import Subject, subjects

CONTRACTS = {Part.ESTIMATOR: Estimator, Part.ROUTER: Router, Part.PLANNER: Planner, Part.SHIELD: Shield}


@pytest.fixture(params=subjects(*CONTRACTS), ids=str)
def subject(request) -> Subject:
    try:
        request.param.build()
    except ConfigurationError as error:
        pytest.skip(str(error))  # test_planners.py says who may refuse a base, and how
    return request.param


def test_stands_behind_its_contract(subject):
    instance = subject.build()
    assert isinstance(instance, Stateful)
    assert [part for part, contract in CONTRACTS.items() if isinstance(instance, contract)] == [subject.part]


def test_same_inputs_give_the_same_answers_to_the_bit(subject):
    warm, cold = subject.build(), subject.build()
    warm.warm_up()  # which must not change what is answered
    assert facts(subject.answers(warm, subject.inputs)) == facts(subject.answers(cold, subject.inputs))


@pytest.mark.parametrize("at", [1, 23, 56, 95])  # the last two: torn between two ways; stuck and looking around
def test_a_restored_one_continues_identically(subject, at):
    at %= len(subject.inputs)
    before, after = subject.inputs[:at], subject.inputs[at:]
    first, second = subject.build(), subject.build()
    subject.answers(first, before)
    snapshot = first.snapshot()
    subject.answers(second, subject.inputs[:7])  # a past of its own, which must be forgotten
    second.restore(snapshot)
    assert facts(subject.answers(second, after)) == facts(subject.answers(first, after))


def test_a_snapshot_neither_changes_nor_is_changed(subject):
    watched, alone = subject.build(), subject.build()
    snapshots, copies = [], []
    for arguments in subject.inputs:
        assert facts(subject.answer(watched, arguments)) == facts(subject.answer(alone, arguments))
        snapshots.append(watched.snapshot())
        copies.append(bytes(bytearray(snapshots[-1])))
    assert snapshots == copies


def test_inputs_are_left_alone(subject):
    inputs = subject.inputs
    before = facts(list(inputs))
    subject.answers(subject.build(), inputs)
    assert facts(list(inputs)) == before


def test_answers_do_not_change_afterwards(subject):
    instance, given, seen = subject.build(), [], []
    for arguments in subject.inputs:
        given.append(subject.answer(instance, arguments))
        seen.append(facts(given[-1]))
    assert [facts(answer) for answer in given] == seen


def test_nothing_is_compiled_after_warm_up(subject):
    inputs = subject.inputs  # made with kernels of their own
    instance = subject.build()
    forget_kernels()
    instance.warm_up()
    ready = signatures()
    subject.answers(instance, inputs)
    assert signatures() - ready == set()
