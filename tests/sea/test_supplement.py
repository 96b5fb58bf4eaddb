"""Rows of motions in any order become a grid, and a row too few or too many is named."""

import numpy as np
import pytest

from stillhook.errors import SeaError
from stillhook.formats.vessel.supplement import gridded

WAVES, HEADINGS = [0.4, 0.8, 1.2], [0.0, 1.5]
ROWS = [(w, b, dof) for dof in range(6) for b in HEADINGS for w in WAVES]


def grid(rows):
    """The value of a row tells where it belongs."""
    w, b, dof = (np.array(column) for column in zip(*rows, strict=True))
    place = lambda wave, heading, d: f"{wave:g} at {heading:g} of motion {d}"
    return gridded("hull.csv", place, w, b, dof.astype(np.intp), w + 10.0 * b + 1j * dof)


def test_rows_in_any_order_are_the_same_grid():
    w, b, H = grid(ROWS)
    assert (w.tolist(), b.tolist(), H.shape) == (WAVES, HEADINGS, (6, 2, 3))
    assert H[4, 1, 2] == 1.2 + 15.0 + 4j
    np.testing.assert_array_equal(grid(ROWS[::-1])[2], H)


@pytest.mark.parametrize("row", [ROWS[0], ROWS[17], ROWS[-1]])
def test_the_one_row_that_is_missing_or_given_twice_is_named(row):
    named = f"{row[0]:g} at {row[1]:g} of motion {row[2]}"
    with pytest.raises(SeaError, match=rf"hull\.csv.*{named} is missing: every heading has every frequency and motion"):
        grid([each for each in ROWS if each != row])
    with pytest.raises(SeaError, match=rf"hull\.csv.*{named} is given twice"):
        grid([*ROWS, row])


def test_of_several_the_first_by_motion_heading_and_wave_is_named():
    with pytest.raises(SeaError, match=r"0\.8 at 0 of motion 2 is missing"):
        grid([each for each in ROWS if each not in ((0.8, 0.0, 2), (0.4, 1.5, 2), (0.4, 0.0, 3))])
