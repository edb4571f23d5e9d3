"""The layout for "why was it late": the tick on the left; the recorder, the devices and the ages of inputs on the right."""

from __future__ import annotations

import rerun.blueprint as rrb

from runtime.log.drawn import timing, views

NAME = "Why was it late"


def layout() -> rrb.Horizontal:
    """Return the layout."""
    return rrb.Horizontal(
        rrb.Vertical(
            views.plot("when each stage was done, after the tick's grid time [ms]", timing.DONE),
            views.plot("how long each stage took [ms]", timing.STAGE_TIMES),
            rrb.Vertical(views.responses(), views.words(), row_shares=[2, 3]),
            row_shares=[4, 3, 2],
        ),
        rrb.Vertical(
            rrb.Horizontal(
                views.plot("deadlines missed", timing.MISSED),
                views.plot("recorder: ticks in its queue, ticks lost", timing.QUEUE),
            ),
            rrb.Horizontal(
                views.plot("device rates over a second [% of nominal]", timing.RATES),
                views.plot("samples lost so far", timing.LOSSES),
            ),
            rrb.Horizontal(
                views.plot("age of each device's newest sample [ms]", timing.SAMPLE_AGES),
                views.plot("age of the command's oldest input, and of the plan [ms]", timing.INPUT_AGE, timing.PLAN_AGE),
            ),
        ),
        name=NAME,
    )
