"""Components and their cells against NumPy's counting and indexing."""

import numpy as np

from estimators.tracks.components import cells_of, extents, sizes


def test_components_are_counted_and_chosen_as_numpy_does():
    rng = np.random.default_rng(0)
    component = rng.integers(0, 7, (23, 31)).astype(np.int32)
    cells, chosen = rng.random(component.shape) < 0.3, rng.random(9) < 0.5  # the last two have no cell
    assert np.array_equal(sizes(component, cells, 9), np.bincount(component[cells], minlength=9))
    assert np.array_equal(cells_of(component, chosen), chosen[component])


def test_a_component_spans_the_columns_and_rows_between_its_outermost_cells():
    rng = np.random.default_rng(1)
    component = np.where(rng.random((9, 13)) < 0.15, rng.integers(1, 6, (9, 13)), 0).astype(np.int32)
    spans = extents(component, 6)
    for one in np.unique(component[component > 0]):
        rows, columns = np.nonzero(component == one)
        assert spans[one].tolist() == [np.ptp(columns) + 1, np.ptp(rows) + 1]
    assert spans[0].tolist() == [0, 0]
