"""The recording of a comparison: of each quantity the values of A and B over their quantiles, in one plot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from drivers.interface.errors import ConfigurationError
from runtime.log.drawn import colours
from runtime.log.files.recording import new_recording
from runtime.log.header import SCHEMA_VERSION

Pair = tuple[NDArray[np.float64] | None, NDArray[np.float64] | None]  # of A and B; None: not in that log
TIMELINE = "permille"
_COLUMNS = 4
_STEPS = np.arange(0, 1001, 5)


def write_comparison(path: Path, pairs: Mapping[str, Pair], text: str) -> None:
    """Write the recording; `pairs` are values by name and unit, `text` is shown as Markdown.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    stream = new_recording()
    entities = {name: f"/compare/{index}" for index, name in enumerate(pairs)}
    try:
        stream.save(path, default_blueprint=_layout(entities))
        for name, pair in pairs.items():
            for which, values, colour in zip("AB", pair, (colours.SENT, colours.ASKED), strict=True):
                if values is not None:
                    entity = f"{entities[name]}/{which}"
                    stream.log(entity, rr.SeriesLines(names=which, colors=[colour], widths=[2.0]), static=True)
                    quantiles = np.percentile(values, _STEPS / 10)
                    stream.send_columns(entity, [rr.TimeColumn(TIMELINE, sequence=_STEPS)], rr.Scalars.columns(scalars=quantiles))
        stream.log("/run", rr.AnyValues(schema_version=SCHEMA_VERSION), static=True)
        stream.log("/compare/table", rr.TextDocument(text, media_type="text/markdown"), static=True)
        stream.flush(timeout_sec=10.0)
        stream.disconnect()
    except (RuntimeError, OSError) as error:
        raise ConfigurationError(f"--log {path} cannot be written: {error}") from error


def _layout(entities: Mapping[str, str]) -> rrb.Blueprint:
    plots = [
        rrb.TimeSeriesView(name=f"{name} over its quantile [‰]", origin=entity, plot_legend=rrb.PlotLegend("LeftTop"))
        for name, entity in entities.items()
    ]
    table = rrb.TextDocumentView(name="Table", origin="/compare/table")
    return rrb.Blueprint(
        rrb.Tabs(rrb.Grid(*plots, grid_columns=_COLUMNS, name="Distributions"), table, active_tab=0),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        collapse_panels=True,
    )
