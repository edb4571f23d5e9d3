"""What came of a replay."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from json import dumps

from runtime.replay.comparison import Difference


@dataclass(frozen=True, slots=True)
class ReplayReport:
    """How far a log was replayed, and where it came to something else."""

    log: str
    planner: str
    counterfactual: bool
    tolerance: float | None  # None: every bit
    elsewhere: bool  # recorded on another processor
    ticks: int  # replayed
    beginnings: tuple[int, ...]  # the tick that each stretch began with
    passed_over: int  # ticks that could not be replayed, as what they go on from is not known
    damaged: tuple[int, ...]  # of these, those whose checksum does not fit
    differing_ticks: int
    first_difference: Difference | None
    recorded_s: float  # from the first to the last tick replayed
    took_s: float

    @property
    def identical(self) -> bool:
        """Whether all that was replayed came to the same."""
        return self.first_difference is None

    @property
    def exit_code(self) -> int:
        """Return 0 when all ticks came to the same, else 1."""
        return 0 if self.identical and not self.damaged else 1

    def sentences(self) -> list[str]:
        """Return it in words, the verdict last."""
        said = []
        if self.elsewhere:
            said.append("recorded on another processor, whose last bits differ")
        if len(self.beginnings) > 1 or self.beginnings[0] > 0:
            said.append(f"replayed from tick {', '.join(map(str, self.beginnings))}")
        if self.passed_over:
            said.append(f"{self.passed_over} ticks could not be replayed: no key frame, or ticks before them are missing")
        if self.damaged:
            said.append(f"{len(self.damaged)} damaged, the first tick {self.damaged[0]}")
        if self.first_difference is not None:
            said.append(str(self.first_difference))
            said.append(f"different: {self.differing_ticks} of {self.ticks} ticks")
            return said
        within = "" if self.tolerance is None else f", each from its recorded belief, within {self.tolerance:g}"
        return [*said, f"identical: {self.ticks} ticks{within}"]

    def json(self) -> str:
        """Return it as JSON."""
        return dumps(asdict(self) | {"identical": self.identical}, indent=2)
