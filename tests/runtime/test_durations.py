"""Statistics of stage times without keeping them: against NumPy over the whole history."""

import numpy as np

from drivers.interface.seeds import stream
from runtime.durations import BLOCK, Durations


def test_the_figures_are_those_of_the_whole_history():
    random = stream(0, "durations")
    history_ns = np.exp(random.normal((12.0, 16.0), (0.5, 2.0), size=(3 * BLOCK + 17, 2))).astype(np.int64)
    history_ns[5] = 0
    durations = Durations(2)
    for row in history_ns.tolist():
        durations.add(tuple(row))
    assert len(durations) == len(history_ns)
    np.testing.assert_allclose(durations.mean_ns, history_ns.mean(axis=0))
    np.testing.assert_array_equal(durations.max_ns, history_ns.max(axis=0))
    for percent in (50.0, 99.0):
        nearest = np.percentile(history_ns, percent, axis=0, method="inverted_cdf")
        np.testing.assert_allclose(durations.percentile_ns(percent), nearest, rtol=0.006)


def test_what_takes_longer_than_the_last_class_is_still_counted():
    durations = Durations(1)
    durations.add((10**15,))
    assert durations.max_ns[0] == 10**15
    assert durations.percentile_ns(50.0)[0] > 1e12
