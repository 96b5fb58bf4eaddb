"""Tuning: never worse than the start, limits kept when re-run independently, same seed same answer, impossible limits
told."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import stillhook.analysis.tuning.search as tuning
from stillhook import load_crane
from stillhook.analysis.controllers import Controller, controller, controller_toml
from stillhook.analysis.loop_stability.loops import sampled
from stillhook.analysis.loop_stability.margins import margins
from stillhook.analysis.loop_stability.transfer import position_loop
from stillhook.analysis.steady.steady_state import speed_limit
from stillhook.analysis.tuning.comparison import front, outcomes, pareto, trials_dataset, variations
from stillhook.analysis.tuning.objective import (
    SPEEDS,
    Limits,
    Objective,
    gain_allowed,
    hold_out,
    parse_limits,
    scenarios,
    usual_speeds,
)
from stillhook.analysis.tuning.parameters import (
    of_vector,
    present,
    space,
    to_vector,
    tunable,
    tuned_controller,
    with_settings,
)
from stillhook.analysis.tuning.search import Search
from stillhook.analysis.tuning.tune import Tuned, result, tune
from stillhook.engine.simulate import run_cases
from stillhook.errors import StillhookError, UnitError
from stillhook.library import changed
from stillhook.spec.scenario import Mode
from stillhook.units import parse

SEARCH = 0.03
"""Of the error: what a search of so few evaluations leaves to find. Two searches with other limits end at other
places."""
CRANE = load_crane("nov-250t")
CASES = scenarios(CRANE, loads=["40 %"], speeds=["30 m/min", "70 m/min"], periods=["10 s"])
BUDGET = 20
EMPTY = Limits(load=0.0)
"""Margins of the empty hook alone, for speed, where they are not the question."""
AGAIN = 1e-12
"""A re-run gives the same bits but for the block of lanes that it shares [-]."""
ON_THE_EDGE = 1e-3
"""Margins that a tuned K_p may miss: its displacement is cut down to a whole step on the safe side, so there is nothing
to miss [-]."""


@pytest.fixture(scope="module")
def tuned() -> Tuned:
    return tune(CRANE, controller("ssc"), objective="error", cases=CASES, budget=BUDGET)


@pytest.mark.thorough
def test_the_best_is_never_worse_than_the_start_on_its_own_objective(tuned: Tuned) -> None:
    assert tuned.met
    assert tuned.before.score == pytest.approx(1.0)
    assert tuned.after.score < tuned.before.score
    assert tuned.after.e_c_pp_mean < tuned.before.e_c_pp_mean
    assert tuned.evaluations == BUDGET
    assert tuned.after.score == pytest.approx(tuned.after.e_c_pp_mean / tuned.before.e_c_pp_mean)


@pytest.mark.thorough
def test_the_numbers_of_the_best_come_out_again_from_its_file(tuned: Tuned, tmp_path: object) -> None:
    path = f"{tmp_path}/best.toml"
    with open(path, "w", encoding="utf-8") as file:
        file.write(controller_toml(tuned.controller, CRANE, "best"))
    found = run_cases(controller(path).on(CRANE), [c.with_mode("ssc") for c in CASES])
    assert [s["e_c_pp"] for s in found] == pytest.approx(tuned.after.e_c_pp, rel=AGAIN)
    assert max(s["p_max"] for s in found) == pytest.approx(tuned.after.p_max, rel=AGAIN)


@pytest.mark.thorough
def test_limits_hold_when_the_best_is_looked_at_independently(tuned: Tuned) -> None:
    crane = tuned.controller.on(CRANE)
    loop = position_loop(crane, crane.active.motor.alpha_min)
    for computing in (0.0, crane.control.computing):  # a quicker PLC allows less gain
        m = margins(sampled(loop, crane.control.t_cycle, computing), crane.control.K_p)
        assert m.gain_margin >= 2.0 * (1.0 - ON_THE_EDGE)
        assert m.phase_margin >= math.radians(45.0)
        assert m.sensitivity_peak <= 2.0 * (1.0 + ON_THE_EDGE)
    for case in CASES:
        assert speed_limit(crane, "ssc", case.load) >= speed_limit(CRANE, "ssc", case.load) * (1.0 - 1e-6)
    assert {s["status"] for s in run_cases(crane, CASES)} == {"ok"}


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_settings_and_another_seed_tries_others(tuned: Tuned) -> None:
    again = tune(CRANE, controller("ssc"), objective="error", cases=CASES, budget=BUDGET, threads=1)
    other = tune(CRANE, controller("ssc"), objective="error", cases=CASES, budget=BUDGET, seed=1)
    assert again.controller == tuned.controller
    assert [t.values for t in again.trials] == [t.values for t in tuned.trials]
    assert [t.values for t in other.trials] != [t.values for t in tuned.trials]


@pytest.mark.thorough
def test_a_pressure_limit_is_kept_and_named_when_it_is_leant_on() -> None:
    free = tune(CRANE, controller("ns"), objective="error", cases=CASES, budget=BUDGET)
    bound = Limits(p_max=0.5 * (free.before.p_max + free.after.p_max))
    held = tune(CRANE, controller("ns"), objective="error", cases=CASES, budget=BUDGET, limits=bound)
    assert free.after.p_max > bound.p_max
    assert held.met
    assert held.after.p_max <= bound.p_max
    assert "p_max" in held.active or held.after.p_max < 0.99 * bound.p_max
    assert held.after.e_c_pp_mean >= free.after.e_c_pp_mean * (1.0 - SEARCH)


@pytest.mark.thorough
def test_a_limit_that_cannot_be_met_is_told() -> None:
    tight = tune(CRANE, controller("ssc"), cases=CASES, budget=20, limits=Limits(p_max=50e5))
    assert not tight.met
    assert any("p_max" in s and "50 bar" in s for s in tight.stops)


@pytest.mark.thorough
def test_a_start_that_breaks_the_margins_is_led_back_to_them() -> None:
    wild = Controller("wild", Mode.SSC, {"control": {"K_p": "0.9 1/m"}})
    found = tune(CRANE, wild, cases=CASES, budget=20)
    assert found.before.broken
    assert "gain margin" in found.before.broken[0]
    assert found.met
    assert found.controller.on(CRANE).control.K_p <= gain_allowed(CRANE, Mode.SSC, Limits())


@pytest.mark.thorough
def test_speed_capacity_that_was_there_stays_there() -> None:
    slow = tune(CRANE, controller("ns"), cases=CASES, budget=BUDGET, free=["alpha_ns", "K_p"], objective="error")
    assert slow.controller.on(CRANE).control.alpha_ns <= CRANE.control.alpha_ns * (1.0 + 1e-6)
    loose = replace(Limits(), v_w_capacity=parse("75 m/min", "speed"))
    # K_p stays: it moves the pressure of a load that rings on its wire, too, which hides the displacement from a search
    # of 20
    freed = tune(
        CRANE, controller("ns"), cases=CASES[:1], budget=BUDGET, free=["alpha_ns"], objective="pressure", limits=loose
    )
    assert freed.controller.on(CRANE).control.alpha_ns > CRANE.control.alpha_ns
    assert freed.after.v_w_capacity >= parse("75 m/min", "speed") * (1.0 - 1e-6)


@pytest.mark.thorough
def test_an_interrupt_keeps_the_best_found(monkeypatch: pytest.MonkeyPatch) -> None:
    real, calls = tuning.run_cases, []

    def stopping(*args: object, **kwargs: object) -> object:
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return real(*args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(tuning, "run_cases", stopping)
    stopped = tune(CRANE, controller("ssc"), cases=CASES, budget=60)
    assert stopped.interrupted
    assert stopped.met
    assert stopped.after.score <= 1.0


def test_settings_go_into_a_crane_as_a_crane_file_would_put_them() -> None:
    values = {"K_p": 0.25, "K_1": 0.84, "K_2": 0.05, "t_lead": 0.02, "u_thr": 0.5, "alpha_min": 0.7, "alpha_swl": 0.75}
    quick = with_settings(CRANE, values)
    by_file = tuned_controller(CRANE, controller("ssc"), values, "x").on(CRANE)
    assert quick.control == by_file.control
    assert quick.active.motor == by_file.active.motor
    assert (
        changed(CRANE, {"control": {"alpha_hs": 0.7}, "active": {"motor": {"alpha_min": 0.7}}}).control.alpha_hs
        == quick.control.alpha_hs
    )


def test_a_tuned_lead_of_the_feedforward_is_written_down_even_where_it_is_that_of_the_crane() -> None:
    """Else it would follow the other lead where that was tuned too."""
    values = {"t_lead": 0.02, "t_lead_ff": present(CRANE)["t_lead_ff"]}
    control = tuned_controller(CRANE, controller("ssc"), values, "x").on(CRANE).control
    assert (control.t_lead, control.t_lead_ff) == (0.02, 0.0)
    assert with_settings(CRANE, values).control == control
    later = tuned_controller(CRANE, controller("ssc"), {"t_lead": 0.02}, "x").on(CRANE).control
    assert later.feedforward_lead == 0.02


def test_the_lead_of_the_feedforward_is_tuned_where_it_is_named_alone() -> None:
    assert "t_lead_ff" not in {s.name for s in space(CRANE, Mode("ssc"))}
    (setting,) = space(CRANE, Mode("ssc"), ["t_lead_ff"], delay=0.05)
    assert (setting.low, setting.high) == (0.0, pytest.approx(0.15))


@pytest.mark.parametrize("mode", ["ns", "hs", "ssc", "level-1"])
def test_the_unit_cube_and_the_settings_are_one_to_one(mode: str) -> None:
    settings = space(CRANE, Mode(mode))
    assert {s.name for s in settings} <= set(tunable(Mode(mode)))
    start = present(CRANE)
    assert of_vector(settings, to_vector(settings, start)) == pytest.approx({s.name: start[s.name] for s in settings})
    lows, highs = of_vector(settings, [0.0] * len(settings)), of_vector(settings, [1.0] * len(settings))
    assert all(lows[s.name] == s.low < s.high == highs[s.name] for s in settings)


def test_scenarios_have_the_speeds_asked_for_and_hold_out_waves_are_others() -> None:
    cases = scenarios(CRANE, loads=["50 t", "20 %"], speeds=["30 m/min"], periods=["8 s", "12 s"])
    assert len(cases) == 4
    assert {c.load for c in cases} == {50e3, 0.2 * CRANE.SWL}
    for case in [*cases, *hold_out(CRANE, speeds=["30 m/min"])]:
        t = np.arange(0.0, case.duration, 0.01)
        assert np.max(np.abs(case.tip.sample(t)[1])) == pytest.approx(0.5, rel=1e-3)
    a, b = hold_out(CRANE, seed=0), hold_out(CRANE, seed=1)
    assert a[0].tip != b[0].tip
    assert hold_out(CRANE, seed=0) == a


@pytest.mark.slow
def test_the_winch_may_differ_while_the_controller_stays_what_it_is() -> None:
    found = variations(CRANE, [controller("ns"), controller("ssc")], CASES[:1])
    less, more = found["friction 30 % less"], found["friction 30 % more"]
    assert all(a.p_max < b.p_max for a, b in zip(less, more, strict=True))
    late = found["motion signal 0.1 s later"]
    assert all(a.e_c_pp_mean > b.e_c_pp_mean for a, b in zip(late, found["as it should be"], strict=True))
    assert found["as it should be"] == outcomes(CRANE, [controller("ns"), controller("ssc")], CASES[:1])


@pytest.mark.thorough
def test_no_point_of_a_front_is_beaten_by_any_trial_that_keeps_the_limits() -> None:
    points, done = pareto(CRANE, controller("ns"), free=["K_1", "K_p"], cases=CASES[1:], budget=20, points=1)
    kept = [t.score for d in done for t in d.trials if not t.score.broken]
    assert points
    assert not any(s.p_max <= p.p_max and s.e_c_pp_mean < p.e_c_pp_mean for s in kept for p in points)
    assert [p.p_max for p in points] == sorted(p.p_max for p in points)
    assert front([t for d in done for t in d.trials], ["K_1", "K_p"]) == points
    data = trials_dataset(done)
    assert data.sizes["trial"] == sum(len(d.trials) for d in done)
    assert data["K_p"].attrs["units"] == "1/m"


REFUSED = (
    ({"free": ["alpha_ns"]}, "is not a setting of ssc"),
    ({"free": ["K_p", "K_p"]}, "named twice"),
    ({"budget": 40.0}, "whole number"),
)


def test_a_limit_of_pressure_is_refused_for_a_winch_that_has_none() -> None:
    with pytest.raises(StillhookError, match=r'limit p_max: winch type "electric" has no p_max. Leave it out.'):
        tune(load_crane("nov-100t-electric"), controller("position"), limits=["p_max <= 300 bar"])


@pytest.mark.slow
@pytest.mark.parametrize(("wrong", "what"), REFUSED)
def test_what_cannot_be_asked_is_refused_in_one_line(wrong: dict[str, object], what: str) -> None:
    with pytest.raises(StillhookError) as refused:
        tune(CRANE, controller("ssc"), **({"cases": CASES} | wrong))  # type: ignore[arg-type]
    assert what in str(refused.value)
    assert "\n" not in str(refused.value)


def test_limits_are_read_with_their_units() -> None:
    limits = parse_limits(
        ["p_max <= 300 bar", "phase_margin >= 60 deg", "gain_margin >= 3", "v_w_capacity >= 60 m/min"]
    )
    assert limits == Limits(300e5, 3.0, math.radians(60.0), v_w_capacity=1.0)
    for text in ("p_max >= 300 bar", "speed <= 3", "gain_margin >= 0.5", "sensitivity_peak <= much"):
        with pytest.raises(StillhookError, match="limit"):
            parse_limits([text])
    with pytest.raises(UnitError):
        parse_limits(["p_max <= 300"])


@pytest.mark.parametrize("wrong", [{"loads": ["x %"]}, {"speeds": ["0 m/min"]}, {"loads": []}, {"periods": ["8 m"]}])
def test_scenarios_that_are_none_are_refused(wrong: dict[str, list[str]]) -> None:
    with pytest.raises(StillhookError):
        scenarios(CRANE, **wrong)


@pytest.mark.slow
def test_a_threshold_that_leaves_the_motors_no_time_breaks_the_fast_run() -> None:
    """Slow scenarios alone would let u_thr be 0.97; in a fast sine the pumps then fill before the motors have
    stroked."""
    late = Controller("late", Mode.SSC, {"control": {"u_thr": 0.97}})
    settings = space(CRANE, Mode.SSC, ["u_thr"])
    search = Search(late.on(CRANE), Mode.SSC, CASES[:1], settings, Objective.ERROR, EMPTY, BUDGET, 2, None)
    search.begin(CRANE)
    assert any("saturated in a fast run" in b for b in search.before.broken)
    assert not search.exact(CRANE).broken


def test_usual_speeds_are_those_that_a_slower_winch_can_follow():
    fast, slow = (usual_speeds(load_crane(name)) for name in ("nov-250t", "nov-100t-pure-active"))
    assert fast == SPEEDS
    top = parse(slow[-1], "speed", "speed")
    assert (
        0.8 * speed_limit(load_crane("nov-100t-pure-active"), "ns")
        < top
        < speed_limit(load_crane("nov-100t-pure-active"), "ns")
    )
    assert len(scenarios(load_crane("nov-100t-pure-active"))) == len(scenarios(load_crane("nov-250t")))


def test_digits_of_a_file_do_not_break_a_limit_that_the_search_kept() -> None:
    """SSC keeps 0.6 of the displacement for 150 t just below alpha_swl = 0.99216, which five digits would make of it:
    3e-6 less speed, and a refusal of what was found."""
    start, name, found = controller("ssc"), "alpha_swl", 0.992156
    cases = scenarios(CRANE, loads=["60 %"], speeds=["30 m/min"], periods=["10 s"])
    settings = tuple(s for s in space(CRANE, start.mode) if s.name == name)
    search = Search(CRANE, start.mode, cases, settings, Objective.ERROR, EMPTY, BUDGET, 2, None)
    search.begin(CRANE)
    short = tuned_controller(CRANE, start, {name: found}, "short").on(CRANE)
    assert search.exact(short).broken
    search.ranks(np.array([to_vector(settings, {name: found})]).T)
    search.trials[0] = search.trials[0]._replace(score=search.before._replace(score=math.inf))
    tuned = result(search, CRANE, start, 0)
    assert tuned.met
    assert present(tuned.controller.on(CRANE))[name] == pytest.approx(found, rel=1e-9)
