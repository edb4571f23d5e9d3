"""How a base answers what is sent to it: after a latency, on a ramp, with a lag; and which headings it takes so.

The looks of a rollout are: now, the end of the latency, the end of each step, and of each longer step afterwards.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.interface.kernel import kernel

F64 = NDArray[np.float64]


class Answer(NamedTuple):
    """How the base answers, and how long it is looked ahead."""

    acceleration: F64  # (3,), with which commands change
    latency_s: float  # what was sent last holds for so long
    response_s: float  # time constant with which the velocity follows what is sent
    step_s: float
    steps: int
    after_step_s: float  # of going on, or stopping, afterwards
    after_steps: int


def times_of(answer: Answer) -> tuple[F64, NDArray[np.int64]]:
    """Return times no farther apart than a step, shape (m,) [s], and which of them are the looks.

    The looks, shape (1 + 1 + steps + after_steps,), are now, after the latency, and after each step.
    """
    parts = max(1, math.ceil(answer.after_step_s / answer.step_s - 1e-9))
    steps = np.repeat((answer.step_s, answer.after_step_s / parts), (answer.steps, answer.after_steps * parts))
    times_s = np.concatenate(((0.0,), answer.latency_s + np.concatenate(((0.0,), np.cumsum(steps)))))
    till = 2 + answer.steps
    return times_s, np.concatenate((np.arange(till), np.arange(till + parts - 1, len(times_s), parts)))


@kernel()
def approached(value: float, sent: float, target: float, most: float, share: float) -> tuple[float, float]:
    """Return a velocity and what is sent for it after a step: that changes by `most` towards the target, and is followed."""
    change = min(max(target - sent, -most), most)
    return value + (sent + 0.5 * change - value) * share, sent + change


@kernel()
def shares(answer: Answer) -> tuple[float, float, float]:
    """Return how much of what is lacking is made up for in the latency, a step, and a step afterwards."""
    if answer.response_s <= 0.0:
        return 1.0, 1.0, 1.0
    return (
        1.0 - np.exp(-answer.latency_s / answer.response_s), 1.0 - np.exp(-answer.step_s / answer.response_s),
        1.0 - np.exp(-answer.after_step_s / answer.response_s),
    )  # fmt: skip


@kernel()
def turned(
    course: F64, first: int, last: int, dt: float, state: tuple[float, float, float], target: float, most: float, share: float
) -> tuple[float, float, float]:
    """Write cosine and sine of the heading in the middle of the looks `first` to `last`; return angle, turn and what is sent."""
    angle, turn, sent = state
    for k in range(first, last):
        now, sent = approached(turn, sent, target, most, share)
        heading = angle + 0.25 * (turn + now) * dt
        course[k, 0], course[k, 1] = np.cos(heading), np.sin(heading)
        angle, turn = angle + 0.5 * (turn + now) * dt, now
    return angle, turn, sent


@kernel()
def courses(yaw: float, now: float, sent: float, turns: F64, answer: Answer) -> tuple[F64, F64, NDArray[np.int64]]:
    """Return cosine and sine of the heading of each turn kept up, and of one that ends after the steps, and their rows.

    Shapes (n, 1 + 1 + steps + after_steps, 2) twice and (n,).  They follow from the turn alone, and twists of a lattice share
    theirs: those of a turn that comes again stand in the row of the first.
    """
    first, second, third = shares(answer)
    looks, a = 2 + answer.steps + answer.after_steps, answer.acceleration[2]
    on, row = np.zeros((len(turns), looks, 2)), np.empty(len(turns), np.int64)
    off = np.zeros((len(turns), looks, 2))
    for i in range(len(turns)):
        row[i] = 0
        while row[i] < i and turns[row[i]] != turns[i]:
            row[i] += 1
        if row[i] < i:
            continue
        till = 2 + answer.steps
        state = turned(on[i], 1, 2, answer.latency_s, (yaw, now, sent), sent, 0.0, first)
        state = turned(on[i], 2, till, answer.step_s, state, turns[i], a * answer.step_s, second)
        turned(off[i], till, looks, answer.after_step_s, state, 0.0, a * answer.after_step_s, third)
        turned(on[i], till, looks, answer.after_step_s, state, turns[i], a * answer.after_step_s, third)
    return on, off, row
