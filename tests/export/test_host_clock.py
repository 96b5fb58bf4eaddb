"""The clock that tests of long runs give is that of a host."""

import math

import pytest
from tests.export.host_clock import added_up, one_by_one


@pytest.mark.parametrize("h", [0.01, 0.1, 0.03, 0.25])
def test_additions_made_together_are_those_made_one_by_one(h):
    for n in (1, 7, 1000, 999_983, 3_000_000):
        assert added_up(n, h) == one_by_one(n, h)


@pytest.mark.slow
def test_a_hundred_million_additions_of_ten_milliseconds_are_off_by_a_twelfth_of_a_cycle():
    t = one_by_one(10**8, 0.01)
    assert t == added_up(10**8, 0.01)
    assert 0.05 < abs(t - 1e6) / 0.01 < 0.5


def test_a_clock_of_years_is_off_by_many_cycles():
    n = 20 * 366 * 86400 * 100
    assert abs(added_up(n, 0.01) - math.fsum([n * 0.01])) > 1.0
