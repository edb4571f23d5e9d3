"""Misbehaviour of an FCI controller, by script."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from sim_drivers.firmware.fault_script import Fault

Kind = Literal["lose_states", "lose_commands", "silent", "freeze", "nan", "reflex", "user_stop", "preempt", "disconnect"]


class FciFault(Fault):
    """One misbehaviour."""

    kind: Kind = Field(
        description="lose_states, lose_commands: some get lost on the way; silent: neither states nor replies; freeze: the same "
        "joints again; nan: joints that are no numbers; reflex, preempt, disconnect: once; user_stop: pressed until the end"
    )
