"""What is not known about a winch, carried into its error and pressure."""

import json
import math

import numpy as np
import pytest

from stillhook import Scenario, Sine, load_crane, simulate
from stillhook.analysis.maps.monte_carlo import monte_carlo_map
from stillhook.analysis.maps.operability import operability_map
from stillhook.analysis.uncertainty.draws import Uncertainty, draws, load_uncertainty
from stillhook.analysis.uncertainty.monte_carlo import monte_carlo, pair_of_draw
from stillhook.analysis.uncertainty.report import (
    Limit,
    band,
    bands,
    chance,
    paired_difference,
    troubles,
)
from stillhook.engine.scenario.summary import numbers_of
from stillhook.errors import SpecError, StillhookError
from stillhook.formats.results import load_run, origin, save_run
from stillhook.library import FrictionSet, load_friction
from stillhook.library.parameter_sets import Evidence, save_set

pytestmark = pytest.mark.slow

CRANE = load_crane("nov-250t")
CASE = Scenario(load="100 t", s_w="100 m", tip="sine 2 m 12 s", duration="32 s", warm_up="20 s")
N = 32
MODES = [CASE.with_mode(m) for m in ("hs", "ssc")]
NUMBERS = [name for name in numbers_of(CRANE) if name not in ("status", "notes")]
STORED = 1e-12
"""Relative: a drawn number written to a crane file and read again."""
COVER = 0.9


def known(**table):
    return Uncertainty.of(table)


@pytest.fixture(scope="module")
def run():
    return monte_carlo(CRANE, MODES, n=N, seed=1)


def test_the_same_seed_gives_the_same_draws_and_another_seed_others():
    a, b, c = (draws(Uncertainty.default(), N, seed) for seed in (3, 3, 4))
    assert np.array_equal(a.values, b.values)
    assert not np.any(a.values == c.values)


def test_more_draws_keep_the_first_ones():
    few, many = (draws(Uncertainty.default(), n).values for n in (20, 100))
    assert np.array_equal(many[:20], few)


def test_a_factor_keeps_its_draws_whatever_is_drawn_beside_it():
    alone = draws(known(leakage="default"), N)
    among = draws(Uncertainty.default(), N)
    assert np.array_equal(alone.values[:, 0], among.values[:, among.columns.index("leakage")])


def test_draws_fill_every_distribution_evenly():
    """Of 256 scrambled Sobol points exactly one lies in every 256th part."""
    found = draws(known(friction={"uniform": [0.5, 1.5]}), 256).values[:, 0]
    assert np.array_equal(np.sort(np.floor((found - 0.5) * 256)), np.arange(256))


def test_fixed_factors_give_the_single_run_bit_for_bit():
    fixed = known(friction=1.0, leakage=1.0, inertia=1.0, pump_servo=1.0, boost=1.0, delay="0 s", load=1.0)
    run = monte_carlo(CRANE, CASE, fixed, n=2)
    single = simulate(CRANE, [CASE])
    for name in NUMBERS:
        np.testing.assert_array_equal(run[name][0], [single[name][0]] * 2, err_msg=name)  # NaN where nothing oscillates


def test_what_is_told_as_described_is_the_single_run(run):
    single = simulate(CRANE, MODES)
    at_values = json.loads(run.attrs["at_values"])
    for i, label in enumerate(run["case"].values):
        assert at_values[label]["e_c_pp"] == float(single["e_c_pp"][i])
        assert at_values[label]["p_max"] == float(single["p_max"][i])


def test_more_friction_never_lowers_the_peak_pressure():
    run = monte_carlo(CRANE, MODES, known(friction={"uniform": [0.5, 2.0]}), n=16)
    order = np.argsort(run["factor_value"].values[:, 0])
    for label in run["case"].values:
        assert np.all(np.diff(run["p_max"].sel(case=label).values[order]) > 0.0)


def test_controllers_see_the_same_draws_so_their_difference_is_sharper_than_either(run):
    difference = paired_difference(run, "ssc", "hs", "p_max")
    single = [b["p_max"] for b in bands(run, ["p_max"]).values()]
    width = difference.relative.high - difference.relative.low
    apart = math.hypot(*((b.high - b.low) / b.median for b in single))  # of draws that are not the same for both
    assert width < 0.25 * apart
    assert difference.lower.value == 1.0


@pytest.mark.thorough
def test_a_draw_is_rebuilt_from_the_record_alone(run, tmp_path):
    stored = load_run(save_run(run, tmp_path / "run.nc"))
    crane, case = pair_of_draw(stored, "ssc", 5)
    again = simulate(crane, [case])
    assert float(again["e_c_pp"][0]) == pytest.approx(float(run["e_c_pp"].sel(case="ssc")[5]), rel=1e-9)
    assert crane.sources["active.boost.p"].text == "draw 5 (seed 1)"
    cranes, cases = origin(stored)
    assert [c.mode for c in cases] == [c.mode for c in MODES]
    assert cranes[0].inertia == CRANE.inertia


def test_a_friction_set_with_evidence_is_drawn_with_its_correlation(tmp_path):
    base = load_friction("nov-250t")
    cov = ((1e-13, -3e-14), (-3e-14, 1e-14))
    item = FrictionSet(
        "mine",
        "mine",
        base.system,
        base.sources,
        Evidence(names=("Y_1", "Y_6"), covariance=cov, dof=9.0, data="made up"),
    )
    save_set(item, tmp_path / "mine.friction.toml")
    (tmp_path / "factors.toml").write_text(
        '[factors]\nfriction = { set = "mine.friction.toml" }\ninertia = "default"\n'
    )
    found = draws(load_uncertainty(tmp_path / "factors.toml"), 2000)
    assert found.columns == ("friction.Y_1", "friction.Y_6", "inertia")
    assert found.groups["friction"] == (0, 1)
    assert np.corrcoef(found.values[:, 0], found.values[:, 1])[0, 1] == pytest.approx(-0.95, abs=0.02)
    run = monte_carlo(CRANE, CASE, load_uncertainty(tmp_path / "factors.toml"), n=16)
    crane, _ = pair_of_draw(run, "ssc", 3)
    assert crane.friction.system.Y_1 == pytest.approx(
        float(run["factor_value"].sel(factor="friction.Y_1")[3]), rel=STORED
    )
    assert crane.friction.system.Y_2 == base.system.Y_2


def test_defaults_leave_out_what_changes_nothing_and_named_factors_are_refused():
    pure = load_crane("nov-100t-pure-active")
    case = CASE.model_copy(update={"load": 0.0})
    assert {"gas_pressure", "motor_offset", "load"}.isdisjoint(Uncertainty.default().on((pure, case)).factors)
    for name, words in (
        ("gas_pressure", "no passive circuit"),
        ("motor_offset", "closed-loop"),
        ("load", "only the hook"),
    ):
        with pytest.raises(SpecError, match=f"factor {name}: it has no effect here: .*{words}"):
            known(**{name: "default"}).on((pure, case))
    with pytest.raises(SpecError, match="count the same leaks twice"):
        known(leakage="default", pump_leakage="default").on((CRANE, CASE))


def test_bands_of_known_numbers():
    b = band(np.concatenate([np.arange(101.0), [np.nan]]))
    assert (b.low, b.median, b.high) == pytest.approx((5.0, 50.0, 95.0))
    assert (b.n, b.failed) == (101, 1)
    assert b.median_error == pytest.approx(
        5.05, rel=0.1
    )  # of 101 even values: a standard deviation of the rank of sqrt(101) / 2
    assert np.isnan(band(np.full(3, np.nan)).median)


def test_a_draw_without_numbers_is_beyond_every_limit():
    limit = Limit.of("e_c_pp <= 10 cm")
    assert limit.beyond(np.array([0.05, 0.1, 0.11, np.nan])).tolist() == [False, False, True, True]
    assert Limit.of("eta_c >= 0.95").beyond(np.array([0.9, 0.99, np.nan])).tolist() == [True, False, True]


def test_a_standing_offset_is_no_limit_of_the_winch():
    """A pure active winch holds its load against leakage with one; full pumps are a limit."""
    pure, case = load_crane("nov-100t-pure-active"), CASE.model_copy(update={"load": 40e3})
    fast = case.model_copy(update={"tip": Sine(amplitude="4 m", period="8 s")})
    run = monte_carlo(pure, [case, fast], known(leakage="default"), n=4, labels=["slow", "fast"])
    assert set(run["status"].sel(case="slow").values) == {"offset"}
    assert {name: round(c.value * c.n) for name, c in troubles(run).items()} == {"slow": 0, "fast": 4}


def test_the_interval_of_a_chance_covers_it_as_often_as_it_says():
    rng = np.random.default_rng(0)
    covered = [c.low <= 0.1 <= c.high for c in (chance(rng.random(100) < 0.1) for _ in range(200))]
    assert np.mean(covered) > COVER  # Wilson's 95 % interval of 100 draws covers between 0.93 and 0.97


@pytest.mark.parametrize(
    ("kwargs", "words"),
    [
        ({"n": 0}, "a whole number from 1"),
        ({"n": 2.5}, "a whole number from 1"),
        ({"seed": -1}, "0 or more"),
        ({"labels": ["a", "a"]}, "2 different names"),
        ({"uncertainty": known(boost={"uniform": [1.0, 20.0]})}, "factor boost = .*relief.p"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_one_line_before_anything_runs(kwargs, words):
    with pytest.raises(StillhookError, match=words) as caught:
        monte_carlo(CRANE, MODES, **{"n": 4} | kwargs)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text", ["e_c_pp < 10 cm", "e_c_pp 10 cm", "e_pp <= 10 cm", "e_c_pp <= 10", "eta_c >= much", "status <= 1"]
)
def test_bad_limits_are_refused(text):
    with pytest.raises(StillhookError) as caught:
        Limit.of(text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("[factor]\n", 'unknown field; did you mean "factors"\\? Allowed: defaults'),
        ("defaults = 1\n", "true or false"),
        ("factors = 3\n", "a table"),
        ("[factors]\nboost = 1..2\n", "not valid TOML"),
        ("[factors]\n", "none. Name at least one"),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path, text, words):
    path = tmp_path / "factors.toml"
    path.write_text(text)
    with pytest.raises(SpecError, match=words) as caught:
        load_uncertainty(path).on((CRANE, CASE))
    assert "\n" not in str(caught.value)


def test_a_file_may_begin_with_the_defaults(tmp_path):
    path = tmp_path / "factors.toml"
    path.write_text("defaults = true\n[factors]\nboost = 1.0\nmotor_offset = { uniform = [0.0, 0.1] }\n")
    found = load_uncertainty(path)
    assert set(found.factors) == set(Uncertainty.default().factors) | {"motor_offset"}
    assert found.factors["boost"].values == (1.0,)
    assert "boost" not in found.optional


GRID = {"loads": "50 t, 150 t", "speeds": "40 m/min, 120 m/min"}


def test_a_map_with_nothing_drawn_is_the_map():
    plain = operability_map(CRANE, **GRID)
    drawn = monte_carlo_map(CRANE, uncertainty=known(friction=1.0), n=1, **GRID)
    for label in drawn["controller"].values:
        at = {"controller": label}
        for q in range(3):
            assert np.array_equal(drawn["e_c_pp"].sel(at)[..., q], plain["e_c_pp"].sel(at))
        assert np.array_equal(
            drawn["applicable_chance"].sel(controller=label, interval="share"), plain["applicable"].sel(at)
        )


@pytest.mark.thorough
def test_a_map_says_how_sure_each_cell_is():
    drawn = monte_carlo_map(CRANE, n=16, **GRID)
    assert np.all(np.diff(drawn["p_max"].values, axis=-1) > 0.0)
    chance = drawn["applicable_chance"]
    assert np.all(np.diff(chance.values, axis=-1) >= 0.0)
    assert float(chance.sel(controller="ssc", interval="share")[0, 0]) == 1.0
    assert int(drawn["failed"].sum()) == 0
