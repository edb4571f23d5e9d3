"""The dead man at the last hop and the back-off, by the clock of the test."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drivers.io.backoff import Backoff, BackoffSettings
from drivers.io.command_slot import Order
from drivers.io.health import HealthRecord
from drivers.io.last_hop import LastHop


class Wire:
    """Notes what was sent."""

    def __init__(self):
        self.sent = []

    def send(self, values, now_ns):
        self.sent.append((now_ns, float(values[0])))

    def rest(self):
        self.sent.append("rest")


def hop(last=0):
    wire, health = Wire(), HealthRecord()
    return LastHop(wire, health, last), wire.sent, health


def order(sequence, expires_ns, value=None):
    return Order(sequence, expires_ns, np.zeros(0) if value is None else np.array([value]))


def test_an_order_is_sent_once_and_rests_at_its_end():
    last_hop, sent, health = hop()
    for now_ns in range(0, 100, 10):
        last_hop.step(order(1, 50, 0.3), now_ns)
    assert sent == [(0, 0.3), "rest"]
    assert health.expired_commands == 1


def test_a_fresh_order_in_time_is_no_expiry():
    last_hop, sent, health = hop()
    last_hop.step(order(1, 50, 0.3), 0)
    last_hop.step(order(2, 90, 0.4), 40)
    assert last_hop.ends_ns == 90
    assert sent == [(0, 0.3), (40, 0.4)]
    assert health.expired_commands == 0


def test_an_order_that_comes_too_late_is_not_sent():
    last_hop, sent, health = hop()
    last_hop.step(order(1, 50, 0.3), 50)
    assert sent == ["rest"]
    assert health.expired_commands == 1


def test_an_order_without_values_rests_and_is_no_expiry():
    last_hop, sent, health = hop()
    last_hop.step(order(1, 50, 0.3), 0)
    last_hop.step(order(2, 0), 10)
    last_hop.step(order(2, 0), 60)
    assert sent == [(0, 0.3), "rest"]
    assert health.expired_commands == 0


def test_what_another_process_was_told_or_passed_while_the_wire_was_down_is_never_sent():
    last_hop, sent, _ = hop(last=7)
    last_hop.step(order(7, 1000, 0.3), 0)
    last_hop.forget(order(8, 1000, 0.4))
    last_hop.step(order(8, 1000, 0.4), 1)
    assert sent == []


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(0, 60), st.booleans()), max_size=40))
def test_whatever_comes_nothing_is_sent_late_or_twice(steps):
    last_hop, sent, _ = hop()
    now_ns, sequence, ends_ns = 0, 0, {}
    for pause_ns, lifetime_ns, fresh in steps:
        now_ns += pause_ns
        if fresh or not sequence:
            sequence += 1
            ends_ns[sequence] = now_ns - 20 + lifetime_ns
        last_hop.step(order(sequence, ends_ns[sequence], float(sequence)), now_ns)
        moving = bool(sent) and sent[-1] != "rest"
        assert moving == (now_ns < ends_ns[sequence])
    numbers = [entry[1] for entry in sent if entry != "rest"]
    assert len(set(numbers)) == len(numbers)
    assert all(entry[0] < ends_ns[int(entry[1])] for entry in sent if entry != "rest")


def test_pauses_double_up_to_the_longest_and_end_when_told():
    backoff = Backoff(BackoffSettings(first_s=0.1, longest_s=0.5, tries=5))
    assert [backoff.failed() for _ in range(6)] == [0.1, 0.2, 0.4, 0.5, 0.5, None]
    backoff.succeeded()
    assert backoff.failed() == 0.1
    patient = Backoff(BackoffSettings(first_s=0.1, longest_s=60.0, tries=0))
    assert [patient.failed() for _ in range(2000)][-1] == 60.0
