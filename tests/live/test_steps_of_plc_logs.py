"""To what the numbers in a PLC's log are rounded, and when that can be said."""

from __future__ import annotations

import numpy as np
import pytest

from stillhook.live.hil.plc_log import _step

FACTOR = 0.01
"""Unit of the column [SI], such as per cent."""


def rounded(decimals: int, different: int) -> np.ndarray:
    """So many different numbers with so many decimals, each several times."""
    return np.repeat(np.round(np.arange(1, 3 * different, 3) * 10.0**-decimals, decimals), 4)


@pytest.mark.parametrize(
    ("decimals", "different", "known"),
    [(0, 49, False), (0, 50, True), (2, 49, False), (2, 50, True), (3, 5, True), (4, 2, True), (9, 5, True)],
)
def test_few_decimals_say_something_where_many_numbers_have_them(decimals: int, different: int, known: bool) -> None:
    """Of 49 whole numbers it may be chance; three decimals are none."""
    step = _step(rounded(decimals, different), FACTOR)
    assert (step is not None) is known
    if step is not None:
        assert step.size == pytest.approx(FACTOR * 10.0**-decimals)
        assert step.share == 0.0


def test_hundreds_are_rounded_to_hundreds() -> None:
    step = _step(100.0 * rounded(0, 60), FACTOR)
    assert step is not None
    assert step.size == pytest.approx(100.0 * FACTOR)


def test_single_precision_is_recognised_and_double_is_none() -> None:
    exact = np.random.default_rng(1).uniform(1.0, 2.0, 100)
    step = _step(exact.astype(np.float32).astype(float), FACTOR)
    assert step is not None
    assert (step.size, step.share) == (0.0, 2.0**-24)
    assert _step(exact, FACTOR) is None
