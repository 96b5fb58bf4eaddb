"""From demand to limiting height: crossings are exact where the growth is linear or quadratic, and nothing opens a sea that is not known."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.plan.definition.rules import Alternative, Demand, Level, Limited, Rule, Seas, Sense, Tier
from stillhook.plan.limits import first_crossing, limits_of, utilisation
from stillhook.spec.lift.phase import PhaseKind

EXACT = 1e-9  # rounding of a root
H = np.array([0.5, 1.0, 1.5, 2.5, 4.0])


def held(quantity="e_c_pp", limit=1.0, sense=Sense.AT_MOST, key="rule"):
    return Limited(Rule(key, "a rule", quantity, limit, sense, Level.MPM, (PhaseKind.DEEP,), "none"), limit)


def told(values, heights=H, quantity="e_c_pp", **more):
    n = len(heights)
    seas = Seas(np.asarray(heights, float), np.full(n, 8.0), np.full(n, math.pi))
    return Demand("deep", Alternative.SSC, Tier.TIME, seas, {quantity: np.asarray(values, float)}, **more)


def limit(values, heights=H, calm=None, **rule):
    by = held(**rule)
    found = limits_of(told(values, heights, by.rule.quantity), [by], calm)
    return float(found.Hs["rule"][0])


@pytest.mark.slow
@given(st.floats(0.0, 1.0), st.floats(0.0, 2.0), st.floats(0.0, 1.0), st.booleans())
def test_a_limit_is_exact_where_the_demand_grows_with_the_height_and_its_square(calm, slope, bend, still):
    values = calm + slope * H + bend * H**2
    least, most = calm + slope * H[0] + bend * H[0] ** 2, values[-1]
    goal = 0.5 * (least + most) if not still else 0.5 * (calm + most)
    if goal < 1e-6 or most - calm < 1e-6:
        return
    found = limit(values, limit=goal, calm={"e_c_pp": calm})
    assert calm + slope * found + bend * found**2 == pytest.approx(goal, rel=1e-6)


CALM = {"e_c_pp": 0.0}
N = np.nan
HEIGHTS = {
    "below the lowest sea it is read from the calm": (2.0 * H, {"limit": 0.5, "calm": CALM}, 0.25),
    "a lowest sea beyond without a calm leaves none": (2.0 * H, {"limit": 0.5}, 0.0),
    "a calm beyond leaves none": (3.0 + H, {"limit": 1.0, "calm": {"e_c_pp": 3.0}}, 0.0),
    "a demand at its limit is inside": (np.ones(5), {}, math.inf),
    "at its limit in one sea": ([0.2, 1.0, 3.0, 4.0, 5.0], {}, 1.0),
    "not known above one that is: beyond": ([0.2, 0.3, N, N, N], {}, 1.0),
    "not known in between is not read from neighbours": ([N, 0.5, N, 1.25, 2.0], {}, 1.0),
    "not known before it falls": ([0.1, 0.5, N, N, 0.8], {}, 1.0),
    "a crossing below what is not known": ([0.5, 1.5, N, 3.0, 4.0], {}, 0.75),
    "left out below others does no harm": ([N, 2.0, 3.0, 4.0, 5.0], {"calm": CALM}, 0.5),
    "a failed sea stops at the one below": ([0.2, 0.4, np.inf, np.inf, np.inf], {}, 1.0),
}


@pytest.mark.parametrize(("values", "more", "height"), HEIGHTS.values(), ids=HEIGHTS)
def test_the_limit_is_the_last_height_that_is_known_to_be_inside(values, more, height):
    assert limit(values, **more) == pytest.approx(height, rel=1e-6)


def test_a_table_that_stays_inside_has_no_limit_and_one_that_is_not_told_has_none_either():
    assert limit(0.1 * H) == math.inf
    assert math.isnan(limit(np.full(5, np.nan)))
    assert math.isnan(float(limits_of(told(H), [held("load_pp")]).Hs["rule"][0]))


def test_a_demand_that_falls_again_does_not_open_higher_seas():
    assert limit([0.5, 2.0, 0.5, 0.5, 0.5]) < 1.0


@pytest.mark.parametrize(
    "grow", [lambda x: np.expm1(0.6 * x), lambda x: np.sqrt(x), lambda x: x**3, lambda x: np.maximum(x, 3 * x - 3)]
)
def test_a_limit_lies_near_that_of_a_fine_table_whatever_the_growth(grow):
    coarse, fine = np.arange(0.5, 6.1, 0.5), np.linspace(0.0, 6.0, 60001)
    goal = float(grow(np.array(2.3)))
    brute = fine[np.argmax(grow(fine) > goal)]
    assert limit(grow(coarse), coarse, limit=goal, calm={"e_c_pp": 0.0}) == pytest.approx(
        brute, abs=0.05
    )  # a tenth of a step


def test_columns_are_told_apart_and_their_seas_may_come_in_any_order():
    seas = Seas(np.array([2.0, 1.0, 1.0, 2.0]), np.array([8.0, 8.0, 6.0, 6.0]), np.zeros(4))
    demand = Demand("deep", Alternative.NS, Tier.FREQUENCY, seas, {"e_c_pp": np.array([2.0, 1.0, 0.5, 1.0])})
    found = limits_of(demand, [held(limit=1.5), held(limit=0.75, key="other")], {"e_c_pp": 0.0})
    assert found.Tp.tolist() == [6.0, 8.0]
    assert found.Hs["rule"] == pytest.approx([np.inf, 1.5])
    assert found.Hs["other"] == pytest.approx([1.5, 0.75])


def test_the_interval_of_a_limit_holds_it_and_follows_the_demands():
    demand = told(H, low={"e_c_pp": 0.8 * H}, high={"e_c_pp": 1.25 * H})
    found = limits_of(demand, [held(limit=2.0)], {"e_c_pp": 0.0})
    assert [float(x["rule"][0]) for x in (found.low, found.Hs, found.high)] == pytest.approx([1.6, 2.0, 2.5])


def test_the_least_sling_tension_is_used_up_from_rest_to_its_limit():
    by = held("sling_ratio", 0.1, Sense.AT_LEAST)
    assert utilisation(by, np.array([1.0, 0.55, 0.1, -0.8]), 1.0) == pytest.approx([0.0, 0.5, 1.0, 2.0])
    falling = limits_of(told(1.0 - 0.45 * H, quantity="sling_ratio"), [by], {"sling_ratio": 1.0})
    assert float(falling.Hs["rule"][0]) == pytest.approx(2.0, rel=EXACT)


def test_utilisation_is_one_at_the_limit_and_keeps_what_is_not_known():
    assert utilisation(held(limit=4.0), np.array([0.0, 4.0, np.inf, np.nan]), 1.0) == pytest.approx(
        [0.0, 1.0, np.inf, np.nan], nan_ok=True
    )
    assert utilisation(held("v_w_demand", 2.0, Sense.AT_LEAST), np.array([4.0, 2.0, 0.0]), 1.0) == pytest.approx(
        [0.5, 1.0, np.inf]
    )


def test_where_nothing_is_tolerated_any_is_beyond():
    by = held("stroke_share", 0.0)
    assert utilisation(by, np.array([0.0, 1e-12]), 1.0).tolist() == [0.0, math.inf]
    assert limit([0.0, 0.0, 0.0, 0.1, 0.2], quantity="stroke_share", limit=0.0) == 1.5


@pytest.mark.slow
@given(st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=6))
def test_a_crossing_lies_between_the_last_sea_inside_and_the_first_beyond(y):
    y = np.array(y)
    heights = np.arange(1.0, len(y) + 1.0)
    found = first_crossing(heights, y, -1.0)
    above = np.flatnonzero(y > 1e-9)
    if len(above) == 0:
        assert found == math.inf
    else:
        assert np.r_[0.0, heights][above[0]] <= found <= heights[above[0]]
