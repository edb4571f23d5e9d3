"""What the configuration refuses, and what the loop sees of the base."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from drivers.interface.commands import BodyTwist
from drivers.omni_can.settings import OmniCanSettings


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"node_ids": (1, 1, 2)}, "every wheel needs a node of its own"),
        ({"node_ids": (1, 2, 64)}, "less than or equal to 63"),
        ({"signs": (1, 0, 1)}, "Input should be -1 or 1"),
        ({"dbc": "own.dbc"}, "firmware: with a dbc of your own it must be told"),
        ({"bus": {"bit_rate": 100_000}}, "at most 50 % may be"),
        ({"battery_full_v": 18.0}, "must be above battery_empty_v"),
    ],
)
def test_refuses_what_does_not_fit_together(settings, sentence):
    with pytest.raises(ValidationError, match=sentence):
        OmniCanSettings(**settings)


def test_the_planned_load_by_hand():
    """Three axes, 100 + 10 + 10 + 1 frames a second each and 50 commands, of 135 bits at worst."""
    assert OmniCanSettings().planned_bus_load == pytest.approx(3 * 171 * 135 / 500_000)


def test_a_multicast_bus_never_leaves_the_machine():
    assert OmniCanSettings(bus={"interface": "udp_multicast", "channel": "239.74.163.2"}).bus_arguments["hop_limit"] == 0


def test_what_is_believed_covers_what_may_be_asked():
    settings = OmniCanSettings(gear_ratio=5.0)
    fastest = BodyTwist(settings.max_vx_m_s, settings.max_vy_m_s, settings.max_wz_rad_s)
    motor_turns_s = np.abs(settings.nominal.wheel_rates(fastest)) * 5.0 / (2 * math.pi)
    assert motor_turns_s.max() <= settings.fastest_turns_s + 1e-12
