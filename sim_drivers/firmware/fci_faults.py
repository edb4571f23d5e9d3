"""Misbehaviour of an FCI controller, by script."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from drivers.interface.settings import Settings
from sim_drivers.world import SECOND_NS

Kind = Literal["lose_states", "lose_commands", "silent", "freeze", "nan", "reflex", "user_stop", "preempt", "disconnect"]


class FciFault(Settings):
    """One misbehaviour."""

    kind: Kind = Field(
        description="lose_states, lose_commands: some get lost on the way; silent: neither states nor replies; freeze: the same "
        "joints again; nan: joints that are no numbers; reflex, preempt, disconnect: once; user_stop: pressed until the end"
    )
    from_s: float = Field(default=0.0, ge=0.0, le=1e6, description="after the walkers set off")
    until_s: float = Field(default=1e6, gt=0.0, le=1e6, description="its end")
    probability: float = Field(default=0.5, ge=0.0, le=1.0, description="of lose_states and lose_commands, for each of them")

    def active(self, scene_ns: int) -> bool:
        """Whether it happens at a time of the run."""
        return self.from_s * SECOND_NS <= scene_ns < self.until_s * SECOND_NS


class FciFaults:
    """Says what happens when."""

    def __init__(self, script: tuple[FciFault, ...], rng: np.random.Generator) -> None:
        """Take the script; what is left to chance is drawn from `rng`."""
        self._script = script
        self._rng = rng
        self._done: set[int] = set()

    def on(self, kind: Kind, scene_ns: int) -> bool:
        """Whether a state of affairs holds now."""
        return any(fault.kind == kind and fault.active(scene_ns) for fault in self._script)

    def strikes(self, kind: Kind, scene_ns: int) -> bool:
        """Whether something that happens once happens now."""
        for entry, fault in enumerate(self._script):
            if fault.kind == kind and fault.active(scene_ns) and entry not in self._done:
                self._done.add(entry)
                return True
        return False

    def loses(self, kind: Kind, scene_ns: int) -> bool:
        """Whether this one gets lost."""
        lossy = [fault for fault in self._script if fault.kind == kind and fault.active(scene_ns)]
        return any(self._rng.random() < fault.probability for fault in lossy)
