"""Strangers' lifts: draws are legal and always the same, every check finds a fault that was made, and what holds for the
library holds for them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray
from tests.plan.made_up import made_up
from trials.strangers import checks, run, run_checks
from trials.strangers.draw import CRANE, LIFT, LOOSE, PLAN, Place, draw, files_of
from trials.strangers.seas import barge, motions, vessel

from stillhook import load_crane, load_lift, load_plan
from stillhook.formats.vessel.csv import read_rao_csv
from stillhook.formats.vessel.open import read_vessel
from stillhook.plan.definition.rules import Alternative, Demand, Seas, Tier
from stillhook.plan.limits import limited
from stillhook.plan.result import FAILED, PlanResult, cause
from stillhook.sea.vessel.floating_body import long_wave_test, verdict_of

DRAWS = 20
SEEDS = range(1, 7)
NOV = load_crane("nov-250t")
TABLE_DIGITS = 2e-6
"""Of motions [m/m], seven digits in the table."""


def found(texts) -> list[str]:
    return [text for text in texts if text]


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_a_draw_is_what_a_user_may_write(seed, tmp_path):
    drawn = draw(seed, tmp_path)
    plan, loose, lift = load_plan(tmp_path / PLAN), load_plan(tmp_path / LOOSE), load_lift(tmp_path / LIFT)
    assert lift.crane == load_crane(tmp_path / CRANE)
    assert plan.crane.model_copy(update={"certified": None}) == lift.crane
    assert plan.alternatives == loose.alternatives
    assert 0.05 * plan.crane.SWL < plan.payload.mass < 0.65 * plan.crane.SWL
    ship = read_vessel(tmp_path / "vessel.csv")
    assert verdict_of(ship, long_wave_test(ship))[0] == "fits"
    assert drawn.compare[:2] == ("compare", str(tmp_path / CRANE))
    assert len(drawn.places) == 2


@pytest.mark.slow
def test_a_seed_always_gives_the_same_files_and_another_one_others(tmp_path):
    for name, seed in (("one", 7), ("two", 7), ("three", 8)):
        draw(seed, tmp_path / name)
    one, two, three = (json.loads(files_of(tmp_path / name)) for name in ("one", "two", "three"))
    assert one == two
    assert not [name for name in one.keys() & three.keys() if one[name] == three[name]]


@pytest.mark.parametrize("seed", range(12))
def test_no_convention_changes_how_a_strangers_vessel_moves(seed, tmp_path):
    read = read_rao_csv(tmp_path / "vessel.csv", vessel(np.random.default_rng(seed), "Barge"))
    H = motions(barge(np.random.default_rng(seed)), read.omega, read.beta)
    np.testing.assert_allclose(read.H, H, atol=TABLE_DIGITS)


@pytest.mark.parametrize(
    ("code", "err"), [(3, "internal error"), (2, "one\ntwo"), (2, ""), (1, "Traceback (most recent call last)")]
)
def test_a_command_that_ends_badly_is_found(code, err):
    assert found(checks.exit_code("plan", code, err))
    assert not found(checks.exit_code("plan", 2, "compiling ...\nplan.toml: what to do."))


def with_numbers(**tables) -> PlanResult:
    """The made-up result with some of its numbers changed: name -> function of the array."""
    result = made_up()
    data = result.data.copy(deep=True)
    for name, change in tables.items():
        data[name] = data[name].copy(data=change(data[name].values.copy()))
    return PlanResult(data, result.facts, result.blocks)


def raised(credit: int, by: float, alternative: int = -1):
    """Limits of a credit and an alternative, raised."""

    def change(values):
        values[credit, alternative] += by
        return values

    return change


def test_faults_of_limits_are_found_and_only_they():
    fine = made_up()
    for check in (checks.ordered, checks.credited, checks.least_of_rules, checks.computed, checks.more_is_more):
        texts = list(check(fine))
        assert texts
        assert not found(texts), check
    low = with_numbers(Hs_limit_low=lambda x: x + 1.0)
    assert "low" in found(checks.ordered(low))[0]
    assert found(checks.ordered(with_numbers(Hs_limit=lambda x: -x)))
    assert "credited" in found(checks.credited(with_numbers(Hs_limit=raised(1, 3.0))))[0]
    assert found(checks.credited(with_numbers(Hs_limit=raised(1, -1.0))))
    assert found(checks.least_of_rules(with_numbers(Hs_limit=raised(1, 0.1))))
    assert found(checks.least_of_rules(with_numbers(op_wf=lambda x: x + 2.0)))
    assert found(checks.more_is_more(with_numbers(op_wf=raised(0, -1.0))))
    failed = replace(fine, facts={**fine.facts, "remarks": [cause(FAILED, what="landing", reason="singular")]})
    assert found(checks.computed(failed)) == ["landing: singular"]
    assert found(checks.answered(fine, 1))
    assert not found(checks.answered(fine, 0))


def test_fewer_hours_and_longer_waits_with_higher_limits_are_found():
    for name, factor in (("operability", 0.5), ("wait_mean", 3.0)):
        result = made_up()
        weather = result.blocks["weather"].copy(deep=True)
        weather["n_censored"] = weather["operability"] * 0.0
        best = {"credit": "twin", "alternative": "strong-ssc", "month": 0}
        weather[name].loc[best] = weather[name].loc[best] * factor
        wrong = replace(result, blocks={**result.blocks, "weather": weather})
        assert found(checks.more_is_more(wrong)), name


@pytest.mark.long
def test_a_limit_that_falls_with_a_more_lenient_rule_is_found():
    strict = made_up()
    lower = with_numbers(Hs_rule=lambda x: x - 0.01)
    assert not found(checks.looser_is_no_lower(strict, strict))
    assert found(checks.looser_is_no_lower(strict, lower))
    assert not found(checks.looser_is_no_lower(lower, strict))


PLAN_OF_RUNS = load_plan("template-to-1500m")


def runs_of(used: tuple[float, ...], limit: float) -> list[str]:
    """What the check of limits says of a column that was run at 1 m, 2 m ... with parts of a limit used."""
    phase, alternative = PLAN_OF_RUNS.phase("deep"), Alternative.SSC
    rule = next(each for each in limited(PLAN_OF_RUNS, phase, alternative) if each.rule.key == "rigging-daf-subsea")
    Hs, n = np.arange(1.0, len(used) + 1.0), len(used)
    values = {rule.rule.quantity: rule.limit * np.array(used)}
    seas = Seas(Hs, np.full(n, 8.0), np.full(n, math.pi))
    demand = Demand(phase.name, alternative, Tier.TIME, seas, values, values, values)
    dims = {"credit": ["twin"], "tier": ["time"], "alternative": ["ssc"], "phase": ["deep"], "rule": [rule.rule.key]}
    coords = {**dims, "heading": [math.pi], "period": [8.0]}
    table = xarray.DataArray(np.full([1] * 7, limit), coords, tuple(coords))
    result = SimpleNamespace(data=xarray.Dataset({"Hs_rule": table}))
    return found(checks.agrees_with_runs(result, PLAN_OF_RUNS, [demand]))


def test_limits_that_their_own_runs_contradict_are_found():
    assert "below a sea well inside" in runs_of((0.2, 0.5, 0.8), 2.4)[0]
    assert "above a sea beyond" in runs_of((0.2, 0.5, 1.3), 3.2)[0]
    assert not runs_of((0.2, 0.5, 1.3), 2.6)
    assert not runs_of((0.2, 1.1, 0.5), 1.9)  # a demand that falls again opens no higher sea
    assert not runs_of((0.2, 0.5, 0.9), 2.4)


WINCH = NOV.plant.type
NO_TIME = dict.fromkeys((*run_checks.WORDS.values(), *(f"{k}_time" for k in WINCH.causes)), 0.0)


def test_a_status_that_hides_or_makes_up_a_limit_is_found():
    assert not found(run_checks.times(WINCH, "ok", NO_TIME))
    assert "relief" in found(run_checks.times(WINCH, "ok", {**NO_TIME, "relief_time": 0.1}))[0]
    assert found(run_checks.times(WINCH, "slack", NO_TIME))
    assert found(run_checks.times(WINCH, "audit", NO_TIME))
    assert found(run_checks.times(WINCH, "diverged", NO_TIME))
    assert not found(run_checks.times(WINCH, "cavitation", {**NO_TIME, "cavitation_time": 1.0}))


def series(**values: float) -> xarray.Dataset:
    """Signals that stand, of a winch that does nothing wrong unless told."""
    usual = {"p_a": 200e5, "p_b": 25e5, "omega_m": 10.0, "Q_relief": 0.0, "P_hpu": 1e5, "F_w": 1e6} | values
    return xarray.Dataset({k: ("time", np.full(5, v)) for k, v in usual.items()}, {"time": np.arange(5.0)})


@pytest.mark.parametrize(
    ("signal", "word"),
    [
        ({"p_a": 450e5}, "relief"),
        ({"p_b": -1e5}, "cavitation"),
        ({"omega_m": -1e3}, "overspeed"),
        ({"Q_relief": 1e-3}, "relief"),
        ({"P_hpu": 1e8}, "power"),
        ({"F_w": 2e7}, "peak load"),
        ({"F_w": 0.0}, "slack"),
    ],
)
def test_a_signal_beyond_a_limit_without_its_word_is_found(signal, word):
    assert not found(run_checks.signals(NOV, "ok", series(), 0.0))
    assert len(found(run_checks.signals(NOV, "ok", series(**signal), 0.0))) == 1
    assert not found(run_checks.signals(NOV, word, series(**signal), 0.0))


def test_a_winch_that_does_not_compensate_and_says_nothing_is_found():
    assert found(run_checks.compensates("ok", {"e_c_pp": 1.0, "s_tip_pp": 1.0}))
    assert found(run_checks.compensates("uncompensated", {"e_c_pp": 0.1, "s_tip_pp": 1.0}))
    assert not found(run_checks.compensates("ok", {"e_c_pp": 0.1, "s_tip_pp": 1.0}))


def test_energy_from_nothing_is_found():
    fine = {"energy_through": 1e7, "energy_unaccounted": 1e-4, "slack_time": 0.0, "status": "ok"}
    assert not found(run_checks.energy(fine, {"friction": 1e5, "pump": -1e5}))
    assert found(run_checks.energy({**fine, "energy_unaccounted": -0.02}))
    assert "friction gives" in found(run_checks.energy(fine, {"friction": -1e5}))[0]


def lowering(**values: float) -> xarray.Dataset:
    """A lowering by 100 m on wire of nothing, whose numbers are right unless told."""
    usual = {"t_landed": math.nan, "sling_slack_time": 0.0, "programme_time": 100.0, "z_load_end": -100.0}
    usual |= {"work_gravity": -(100e3 + NOV.hook_mass) * 9.80665 * 100.0, "F_sling": 1e5} | values
    data = {k: ("time", np.full(5, v)) if k == "F_sling" else v for k, v in usual.items()}
    return xarray.Dataset({**data, "s_w": ("time", np.full(5, 50.0))}, {"time": np.arange(5.0)})


LOWERING = SimpleNamespace(
    z_0=0.0, payload=SimpleNamespace(mass=100e3), programme=[SimpleNamespace(landed=False, mode="ahc")]
)


def test_faults_of_a_lowering_are_found():
    assert not found(run_checks.lowered(LOWERING, "ok", lowering()))
    assert found(run_checks.lowered(LOWERING, "ok", lowering(F_sling=0.0)))
    assert found(run_checks.lowered(LOWERING, "ok", lowering(sling_slack_time=2.0)))
    assert found(run_checks.lowered(LOWERING, "ok", lowering(t_landed=50.0)))
    assert found(run_checks.lowered(LOWERING, "ok", lowering(programme_time=math.nan)))
    assert found(run_checks.lowered(LOWERING, "unfinished", lowering()))
    assert not found(run_checks.weight_by_way(NOV, LOWERING, lowering()))
    assert found(run_checks.weight_by_way(NOV, LOWERING, lowering(work_gravity=-5e7)))


@pytest.mark.slow
def test_a_place_that_is_called_stable_and_swings_is_found():
    """A gain far beyond the limit, and an answer that says that it is stable."""
    place = Place(50e3, 200.0, 0.3)
    hot = NOV.model_copy(update={"control": NOV.control.model_copy(update={"K_p": 6.0})})
    answer = {"stable": True, "gain_margin_plc": 2.0, "omega_c_plc": 2.0 * math.pi}
    assert found(run_checks.dies_out(hot, answer, place))
    assert not found(run_checks.dies_out(NOV, answer, place))
    assert not list(run_checks.dies_out(hot, {**answer, "stable": False}, place))
    limit = {**answer, "least_at": {"K_p_low": 0.0}}
    assert found(run_checks.near_the_limit(NOV, {**limit, "K_p_ms_plc": 8.0}, place))
    assert not found(run_checks.near_the_limit(NOV, {**limit, "K_p_ms_plc": 0.2}, place))


def test_lines_of_draws_are_kept_and_a_cut_one_is_run_again(tmp_path):
    outcome = run.Outcome({"seed": 3, "winch": "electric"})
    outcome.check("sums", iter(["", "one of them is wrong"]))
    outcome.check("cannot look", (1 / 0 for _ in range(1)))
    file = tmp_path / run.LINES
    run.append(file, run.as_line(outcome))
    with open(file, "a") as stream:
        stream.write('{"drawn": {"seed": 4')
    (row,) = run.known(file)
    total = run.totals([row])
    assert (total["sums"].checked, total["sums"].violated) == (2, 1)
    assert total["sums"].lines == ["seed 3 (electric): one of them is wrong"]
    assert "ZeroDivisionError" in total["cannot look"].lines[0]


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(1001, 1001 + DRAWS))
def test_what_must_hold_holds_for_strangers(seed, tmp_path):
    outcome = run.run_draw(draw(seed, tmp_path))
    assert not [f"{name}: {line}" for name, tally in outcome.checks.items() for line in tally.lines]
