"""The verb: tiers, limits, credit, weather and facts put together, on small tables."""

import json
from dataclasses import replace

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.errors import PlanError
from stillhook.formats.weather.file import read_weather
from stillhook.plan.answer.metadata import answer_digest, winch_remarks, without_runs
from stillhook.plan.definition.lift_plan import Environment, WeatherUse
from stillhook.plan.definition.rules import Alternative, Demand, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import limited, limits_of
from stillhook.plan.planning import plan
from stillhook.plan.result import load_plan_result, save_plan
from stillhook.plan.table import Axes, chosen, credited_of, gathered, governed
from stillhook.weather.alpha import load_alpha_table

pytestmark = pytest.mark.long

ENVIRONMENT = Environment(
    Hs=("0.5 m", "1 m", "2 m", "4 m"), Tp=("7 s", "12 s"), headings=("165 deg", "180 deg", "195 deg"), spread=4
)
UNMODELLED = (Alternative.NONE, Alternative.CAP)
"""Alternatives that no run of the twin is needed for."""


@pytest.fixture(scope="module")
def asked():
    """The example of the library on a small table, without and with the flat cap."""
    return replace(load_plan("template-to-1500m"), environment=ENVIRONMENT, alternatives=UNMODELLED)


@pytest.fixture(scope="module")
def shares():
    """Of the work of `found` that was reported as done."""
    return []


@pytest.fixture(scope="module")
def found(asked, shares):
    weather = WeatherUse("SYNTHETIC-norwegian-sea")
    return plan(replace(asked, weather=weather), tier="frequency", progress=shares.append)


def test_progress_rises_from_nothing_to_all(found, shares):
    assert found.facts
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)


@pytest.mark.thorough
def test_every_cell_has_a_limit_and_names_what_it_is_by(found):
    data = found.data
    assert not np.isnan(data["Hs_limit"]).any()
    told = np.isfinite(data["Hs_limit"]) & (data["Hs_limit"] > 0.0)
    for name, axis in (("governing_phase", "phase"), ("governing_rule", "rule"), ("governing_tier", "tier")):
        assert set(data[name].values[told.values].tolist()) <= set(data[axis].values.tolist())


def test_the_limit_of_a_cell_is_that_of_the_rule_that_governs_it(found):
    data = found.data.sel(credit="twin", alternative="none")
    for heading in data["heading"].values:
        for period in data["period"].values:
            cell = data.sel(heading=heading, period=period)
            names = {axis: str(cell[f"governing_{axis}"].item()) for axis in ("phase", "rule", "tier")}
            assert float(cell["Hs_rule"].sel(names)) == float(cell["Hs_limit"])


def test_compensation_never_makes_a_limit_lower_in_this_lift_and_raises_it_somewhere(found):
    none, cap = (found.data["Hs_limit"].sel(credit="twin", alternative=a).values for a in ("none", "cap-80"))
    assert (cap >= none).all()
    assert (cap > 1.5 * none).any()


def test_phases_without_compensation_limit_all_alternatives_alike(found):
    rules = found.data["Hs_rule"].sel(credit="twin", phase="splash zone")
    np.testing.assert_array_equal(rules.sel(alternative="none"), rules.sel(alternative="cap-80"))


def test_the_closed_form_stands_beside_the_road_and_counts_where_the_road_tells_nothing(found):
    counts = found.data["counts"]
    assert (counts.sel(phase="splash zone") == "closed-form").all()
    assert (counts.sel(phase="deep") == "frequency").all()
    beside = found.data["Hs_rule"].sel(credit="twin", tier="closed-form", phase="landing")
    assert np.isfinite(beside).any()


def test_what_is_no_twin_is_credited_as_it_is(found):
    twin, credited = (found.data["Hs_limit"].sel(credit=c) for c in ("twin", "credited"))
    np.testing.assert_array_equal(twin, credited)


def test_the_weather_says_what_compensation_gains(found):
    year = found["weather"].sel(credit="twin", month=0)
    assert float(year["operability"].sel(alternative="cap-80")) > float(year["operability"].sel(alternative="none"))
    assert found["weather"].attrs["synthetic"] == 1
    assert found.workable


@pytest.mark.thorough
def test_a_result_on_disk_is_the_result(found, tmp_path):
    save_plan(found, tmp_path / "plan")
    again = load_plan_result(tmp_path / "plan")
    assert again.data.identical(found.data)
    assert set(again.blocks) == set(found.blocks)
    assert all(again[name].equals(found[name]) for name in found.blocks)
    assert again.facts["summary"]["shown"] == found.facts["summary"]["shown"]
    assert again.workable == found.workable


@pytest.mark.thorough
def test_numbers_and_facts_of_two_plans_are_not_put_together(found, tmp_path):
    save_plan(found, tmp_path)
    facts = json.loads((tmp_path / "plan.json").read_text()) | {"digest": "another"}
    del facts["facts_sha256"]
    (tmp_path / "plan.json").write_text(json.dumps(facts))
    with pytest.raises(PlanError, match=r"plan.nc and plan.json are of two plans"):
        load_plan_result(tmp_path)


def test_a_folder_without_a_plan_is_refused_with_what_to_do(tmp_path):
    with pytest.raises(PlanError, match=r"no plan.nc there. Give the folder that stillhook plan --out wrote"):
        load_plan_result(tmp_path)


def test_a_tier_that_is_none_is_refused(asked):
    with pytest.raises(PlanError, match=r'Unknown tier "magic". Choose closed-form, frequency or time.'):
        plan(asked, tier="magic")


@pytest.mark.thorough
def test_an_operation_too_long_for_a_forecast_is_not_reckoned_in_weather(asked):
    longer = replace(asked, T_POP=80 * 3600.0, weather=WeatherUse("SYNTHETIC-norwegian-sea"))
    told = plan(longer, tier="closed-form")
    assert "weather" not in told
    assert told.caused("not-restricted")


TWIN_AND_CAP = (Alternative.CAP, Alternative.SSC)


def credit_up_to(asked, covered_to, cap_at, twin_at):
    """Credited limit of a rule whose quantity grows with the height: cap at its limit at cap_at [m], twin at twin_at [m], seas of 0.5 m to
    4 m by 0.5 m, the certificate covering those up to covered_to [m]."""
    heights = np.arange(0.5, 4.01, 0.5)
    small = replace(
        asked,
        alternatives=TWIN_AND_CAP,
        environment=Environment(Hs=tuple(f"{h} m" for h in heights), Tp=("8 s",), headings=("180 deg",)),
    )
    axes, seas, phase = Axes.of(small), small.environment.table(), small.phase("landing")
    rule = next(each for each in limited(small, phase, Alternative.SSC) if each.rule.key == "load-motion")
    demands = [
        Demand("landing", a, Tier.FREQUENCY, seas, {rule.rule.quantity: rule.limit * seas.Hs / at})
        for a, at in ((Alternative.CAP, cap_at), (Alternative.SSC, twin_at))
    ]
    own = chosen(gathered(axes, [limits_of(d, [rule]) for d in demands]))
    covers = np.ones((2, len(axes.phases), 1, 1, len(heights)), dtype=bool)
    covers[1, axes.phases.index("landing"), ..., heights > covered_to] = False
    return governed(credited_of(small, own, heights, covers)).Hs[:, 0, 0]


def test_without_a_certificate_no_more_than_the_cap_is_credited(asked):
    assert credit_up_to(asked, 0.0, 1.7, 3.2) == pytest.approx([1.7, 1.7])


def test_inside_the_certificate_the_twin_is_credited_in_full(asked):
    assert credit_up_to(asked, 4.0, 1.7, 3.2) == pytest.approx([1.7, 3.2])


def test_credit_ends_at_the_highest_sea_that_is_covered(asked):
    assert credit_up_to(asked, 2.5, 1.7, 3.2) == pytest.approx([1.7, 2.5])
    assert credit_up_to(asked, 1.0, 1.7, 3.2) == pytest.approx([1.7, 1.7])


def test_a_twin_worse_than_the_cap_is_credited_as_it_is(asked):
    assert credit_up_to(asked, 0.0, 3.2, 1.7) == pytest.approx([3.2, 1.7])


def test_the_digest_of_an_answer_hangs_on_weather_forecast_factors_and_tier(asked):
    table, weather = load_alpha_table(), read_weather("SYNTHETIC-norwegian-sea")
    higher = replace(weather, columns={**weather.columns, "H_m0": weather.columns["H_m0"] + 1.0})
    other = replace(table, alpha=tuple(tuple(0.9 * a for a in row) for row in table.alpha))
    beside = [
        (("closed-form",), table, None),
        (("closed-form",), table, weather),
        (("closed-form",), table, higher),
        (("closed-form",), other, weather),
        (("closed-form", "frequency"), table, weather),
    ]
    assert len({answer_digest(asked, *each) for each in beside}) == len(beside)
    renamed = replace(weather, source="renamed.csv")
    assert answer_digest(asked, *beside[1]) == answer_digest(asked, ("closed-form",), table, renamed)


def test_every_input_stands_with_its_hash(found):
    inputs = {row["item"]: row["sha256"] for row in found.facts["inputs"]}
    assert {"plan", "crane", "vessel", "payload", "rules", "forecast factors", "weather"} <= set(inputs)
    assert all(len(digest) == 64 for digest in inputs.values())
    assert found.data.attrs["digest"] == found.facts["digest"]


def test_what_a_plan_did_not_compute_has_its_reason(found):
    assert found.facts["not_computed"] == {key: {"cause": "no-runs"} for key in ("landing", "sweep", "convergence")}


def test_a_planwithout_runs_says_what_the_road_levels_out():
    assert without_runs(load_plan("template-to-1500m")) == [{"cause": "mean-drag", "phases": ["upper water"]}]


def test_a_plan_with_a_pure_active_winch_tells_that_the_load_sinks_and_stands_off():
    """Its pumps hold the load against leakage: by hand it sinks without a brake, compensated it hangs low. A passive circuit carries the load
    alone."""
    recovery, pure = load_plan("manifold-recovery"), load_crane("nov-100t-pure-active")
    said = winch_remarks(replace(recovery, crane=pure.model_copy(update={"brake": None})))
    assert any("with the joystick at rest the load sinks by" in line for line in said)
    assert not any("with the joystick at rest" in line for line in winch_remarks(replace(recovery, crane=pure)))
    assert any("expect a standing offset of about" in line for line in said)
    assert winch_remarks(recovery) == []
