"""The recent past of a filter: samples in the order of their capture, with the state after each, to go back to."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable

from drivers.interface.samples import ImuSample, WheelSample
from estimators.odometry.ekf_filter import MotionFilter, Sample
from estimators.odometry.ekf_state import EkfState

Key = tuple[int, int]  # capture time [ns], kind: what is sorted by; no two samples share one


def key_of(sample: Sample) -> Key:
    """Return where a sample belongs; of samples captured together the inertial unit's comes first, an absolute pose last."""
    kind = 0 if isinstance(sample, ImuSample) else 1 if isinstance(sample, WheelSample) else 2
    return sample.stamp.captured_ns, kind


class History:
    """A sorted window of samples.  A late one is put in its place and all after it are folded again, from the state before it.

    So the order of arrival leaves no trace: the states are those of the sorted samples, bit for bit.  What lies between two
    samples of the inertial unit is folded with both; what comes after the newest is folded again when the next one is there.
    """

    def __init__(self, motion: MotionFilter, span_ns: int) -> None:
        """Begin with nothing; keep what is younger than `span_ns` before the newest sample."""
        self._motion, self._span_ns = motion, span_ns
        self.base = motion.start()  # before the first sample kept
        self.samples: list[Sample] = []
        self._keys: list[Key] = []
        self.states: list[EkfState] = []  # after each sample

    @property
    def newest(self) -> EkfState:
        """The state after every sample."""
        return self.states[-1] if self.states else self.base

    def insert(self, samples: Iterable[Sample]) -> tuple[int, int]:
        """Fold samples in; return the place of the first state that is new, and how many samples were no good.

        No good are those from before the window and those whose place is taken: a time stamp that repeats.
        """
        first, refused = len(self.samples), 0
        for sample in samples:
            key = key_of(sample)
            place = bisect_left(self._keys, key)
            taken = place < len(self._keys) and self._keys[place] == key
            if taken or (self.base.time_ns is not None and key[0] <= self.base.time_ns):
                refused += 1
                continue
            self._keys.insert(place, key)
            self.samples.insert(place, sample)
            first = min(first, self._changed_by(place))
        self._replay(first)
        return first, refused

    def forget(self) -> None:
        """Let go of what is older than the window; one state from before it stays as the base."""
        if not self._keys:
            return
        stale = bisect_right(self._keys, (self._keys[-1][0] - self._span_ns, 2))
        if stale > 0:
            self.base = self.states[stale - 1]
            del self._keys[:stale], self.samples[:stale], self.states[:stale]

    def restore(self, base: EkfState, samples: list[Sample]) -> None:
        """Take over a base and the samples after it."""
        self.base, self.samples, self._keys, self.states = base, samples, [key_of(sample) for sample in samples], []
        self._replay(0)

    def _changed_by(self, place: int) -> int:
        """Return the first place whose state a new sample changes: inertial ones tell of the time since the one before, too."""
        if not isinstance(self.samples[place], ImuSample):
            return place
        last = place - 1
        while last >= 0 and not isinstance(self.samples[last], ImuSample):
            last -= 1
        if last < 0:
            return 0
        return min(place, bisect_right(self._keys, (self._keys[last][0], 2)))  # what was captured together with it stays

    def _replay(self, first: int) -> None:
        del self.states[first:]
        state, todo = self.newest, self.samples[first:]
        ahead: list[ImuSample | None] = []
        for sample in reversed(todo):
            ahead.append(sample if isinstance(sample, ImuSample) else ahead[-1] if ahead else None)
        for sample, inertial in zip(todo, reversed(ahead), strict=True):
            state = self._motion.fold(state, sample, inertial)
            self.states.append(state)
