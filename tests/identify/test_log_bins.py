"""Means over bins of a log."""

import numpy as np
import pytest

from stillhook.logs.resample import on_stretches

NAN = float("nan")


@pytest.mark.parametrize(
    ("values", "starts", "means"),
    [
        ([5.0, 1.0, 3.0], [0, 1], [5.0, 2.0]),
        ([5.0, NAN, 3.0, 7.0], [0, 2], [5.0, 5.0]),
        ([NAN, NAN, 4.0], [0, 2], [NAN, 4.0]),
        ([1.0, 2.0, 6.0, 9.0], [0, 3], [3.0, 9.0]),
    ],
)
def test_a_bin_has_the_mean_of_the_samples_that_it_knows(values, starts, means):
    """One sample is its own mean; a bin without any has none."""
    found = on_stretches(np.array(values), np.array(starts, dtype=np.intp))
    assert found == pytest.approx(np.array(means), nan_ok=True)
