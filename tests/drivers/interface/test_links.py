"""Devices that share a wire: opened once, closed once, whoever comes and goes in whatever order."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.interface.errors import DeviceError
from drivers.interface.links import Links


class Wire:
    def __init__(self, fails=False):
        self.fails, self.is_open, self.opened = fails, False, 0

    def open(self):
        if self.fails:
            raise DeviceError("the wire is not there")
        assert not self.is_open
        self.is_open, self.opened = True, self.opened + 1

    def close(self):
        assert self.is_open
        self.is_open = False


@given(st.lists(st.tuples(st.integers(0, 2), st.booleans()), max_size=30))
def test_it_is_open_as_long_as_anyone_holds_it(steps):
    links = Links()
    leases = [links.get("can0", Wire) for _ in range(3)]
    held = set()
    for who, opens in steps:
        (leases[who].open if opens else leases[who].close)()
        (held.add if opens else held.discard)(who)
        assert leases[0].it.is_open == bool(held)
        assert [lease.held for lease in leases] == [index in held for index in range(3)]


def test_other_keys_other_wires():
    links = Links()
    assert links.get("a", Wire).it is not links.get("b", Wire).it


def test_one_that_could_not_be_opened_is_held_by_no_one():
    links = Links()
    first, second = (links.get("can0", lambda: Wire(fails=True)) for _ in range(2))
    with pytest.raises(DeviceError):
        first.open()
    first.close()
    first.it.fails = False
    second.open()
    second.close()
    assert (first.it.opened, first.it.is_open) == (1, False)
