"""The twin's tier: what is run of a phase, which of its numbers count, and how limits come out of runs."""

import math
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise

import numpy as np
import pytest

from stillhook.base.progress import CancelToken, Monitor
from stillhook.engine.simulate import simulate
from stillhook.errors import Cancelled
from stillhook.library import load_crane
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits, limited
from stillhook.plan.result import Failures
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution, run_numbers, seed_of, worst_heights
from stillhook.plan.tiers.time_domain.curves import ColumnRuns, curve_of, limits_of_curve
from stillhook.plan.tiers.time_domain.lowering import (
    BLOCK,
    KINDS,
    SeaState,
    Winch,
    course_of,
    in_sea,
    lowering_of,
    machine_of,
    step_of,
    winch_of,
)
from stillhook.plan.tiers.time_domain.measures import Measure, Statistic, measures
from stillhook.plan.tiers.time_domain.placing import Search, prediction_factors, usual_runs
from stillhook.plan.tiers.time_domain.search import Work
from stillhook.plan.tiers.time_domain.tier import _demand as demand_of
from stillhook.plan.tiers.time_domain.tier import chance, refine
from stillhook.spec.lift.phase import PhaseKind, WinchMode
from stillhook.spec.scenario import Mode

BETA = math.radians(165.0)
FEW = Search(seeds=16, most_seeds=16)
"""Few seeds: these tests ask how numbers hang together, not what they are."""


@pytest.fixture(scope="module")
def plan():
    return load_plan("template-to-1500m")


@pytest.fixture(scope="module")
def holding(tmp_path_factory):
    """The example with the payload held in the splash zone, as the rules ask for it."""
    text = (files("stillhook.library") / "data" / "lifts" / "template-to-1500m.toml").read_text(encoding="utf-8")
    file = tmp_path_factory.mktemp("plan") / "holding.toml"
    file.write_text(text.replace('hold = "off"', "#"), encoding="utf-8")
    return load_plan(file)


@pytest.fixture(scope="module")
def narrow(plan):
    """The example in one column of its table."""
    return in_one_column(plan)


@pytest.fixture(scope="module")
def narrow_holding(holding):
    return in_one_column(holding)


def in_one_column(plan):
    environment = plan.environment.model_copy(update={"Tp": (8.0,), "headings": (BETA,)})
    return replace(plan, environment=environment, alternatives=(Alternative.NONE, Alternative.CAP, Alternative.SSC))


def of_kind(plan, kind):
    return next(p for p in plan.phases if p.kind is kind)


def calm_of(plan, phase, winch):
    course = course_of(plan, phase, winch)
    return course, lowering_of(plan, phase, course, machine_of(plan, winch)[1])


# what is run


def test_phases_without_compensation_are_one_run_under_all_alternatives(plan):
    for kind in (PhaseKind.SPLASH, PhaseKind.IN_AIR):
        assert {winch_of(of_kind(plan, kind), a) for a in ALTERNATIVES} == {Winch()}


def test_in_a_compensated_phase_none_stands_and_the_cap_leaves_a_fifth(plan):
    deep = of_kind(plan, PhaseKind.DEEP)
    assert winch_of(deep, Alternative.NONE) == Winch()
    assert winch_of(deep, Alternative.CAP).left == pytest.approx(0.2)
    assert len({winch_of(deep, a) for a in ALTERNATIVES}) == len(ALTERNATIVES)
    modes = {a: calm_of(plan, deep, winch_of(deep, a))[1].programme[1].mode for a in ALTERNATIVES}
    assert modes[Alternative.NONE] is modes[Alternative.CAP] is WinchMode.MANUAL
    assert modes[Alternative.SSC] is WinchMode.AHC


def test_strong_ssc_is_ssc_on_a_crane_of_other_settings(plan):
    crane, mode = machine_of(plan, Winch(controller=Alternative.STRONG_SSC))
    assert mode is Mode.SSC
    assert crane.control.K_p > plan.crane.control.K_p
    assert machine_of(plan, Winch()) == (plan.crane, Mode.SSC)


def test_a_piece_of_a_long_way_lies_on_the_way_and_about_its_worst_place(plan):
    phase = next(p for p in plan.phases if p.kind is PhaseKind.LOWERING and p.compensated)
    for z in (phase.z_start, 0.5 * (phase.z_start + phase.z_end), phase.z_end):
        course = course_of(plan, phase, Winch(controller=Alternative.SSC), z, 600.0)
        *settle, counted = course.programme
        assert course.counts == len(settle)
        top = course.z_0 - sum(stage.speed * stage.time for stage in settle)
        bottom = top - counted.speed * course.counted
        assert phase.z_start >= course.z_0 >= top > bottom >= phase.z_end - 1e-6
        assert top + 1e-6 >= z >= bottom - 1e-6
        assert course.swings == pytest.approx(600.0 / BLOCK)
        assert course.times == pytest.approx(phase.duration / BLOCK)


def test_a_held_payload_stands_at_its_worst_submergence_as_often_as_blocks_go_into_half_an_hour(holding):
    held = next(p for p in holding.phases if p.held)
    cells, covered = Cells(holding, Execution()), -holding.payload.reach(holding.rho)
    for Tp in (5.0, 14.0):
        course = cells.course(held, Winch(), SeaState(0.0, Tp, BETA))
        assert all(stage.speed == 0.0 for stage in course.programme)
        assert covered <= course.z_0 <= 0.0  # neither dry nor deep: where the surface cuts it
        assert course.times == course.swings == pytest.approx(1800.0 / BLOCK)


def test_waves_reach_a_payload_that_is_held_above_still_water(holding):
    held = next(p for p in holding.phases if p.held)
    course = course_of(holding, held, Winch(), 0.3)
    calm = lowering_of(holding, held, course, machine_of(holding, Winch())[1])
    assert in_sea(holding, held, Winch(), course, calm, SeaState(2.0, 8.0, BETA), 1).water


def test_a_search_for_a_held_payload_begins_below_the_closed_form(holding):
    """One wave of the simplified method is not the largest of half an hour: a hold may be limited below it."""
    passage, held = (
        next(p for p in holding.phases if p.kind is PhaseKind.SPLASH and p.held is on) for on in (False, True)
    )
    of_passage, of_held = (prediction_factors(phase, Tier.CLOSED_FORM) for phase in (passage, held))
    assert of_held[0] > of_passage[0] == 1.0
    assert of_held[1] < 1.0 < of_passage[1]


def test_a_plan_steps_as_its_plc_does_where_crane_and_soil_allow_it(plan):
    hard = plan.payload.model_copy(update={"seabed": plan.payload.seabed.model_copy(update={"settlement": 1e-4})})
    stiff = replace(plan, crane=load_crane("nov-150t"), payload=load_plan("manifold-recovery").payload)
    assert step_of(plan) == plan.crane.control.t_cycle == 10e-3
    assert step_of(replace(plan, payload=hard)) == 2.5e-3  # a bed of rock
    assert step_of(stiff) == 5e-3  # its boost valve asks for 7.4 ms


def test_a_payload_comes_up_where_its_phase_goes_up(plan):
    down = of_kind(plan, PhaseKind.SPLASH)
    up = down.model_copy(update={"start_depth": down.depth, "depth": down.start_depth})
    course = course_of(plan, up, Winch())
    assert course.z_0 == down.z_end
    assert course.programme[1].speed == -down.speed
    assert course.z_top == down.z_start


def test_waves_are_left_out_where_they_do_not_reach_and_in_the_air(plan):
    felt = {}
    for phase in plan.phases:
        if phase.kind in KINDS:
            winch = winch_of(phase, Alternative.SSC)
            course, calm = calm_of(plan, phase, winch)
            felt[phase.kind] = in_sea(plan, phase, winch, course, calm, SeaState(2.0, 14.0, BETA), 1).water
    assert {kind for kind, water in felt.items() if water} <= {PhaseKind.SPLASH, PhaseKind.LOWERING}
    assert felt[PhaseKind.SPLASH]


def test_long_waves_reach_deeper_than_short_ones(plan):
    phase = of_kind(plan, PhaseKind.DEEP).model_copy(update={"start_depth": 120.0, "depth": 120.0})
    course, calm = calm_of(plan, phase, Winch())
    reach = {T: in_sea(plan, phase, Winch(), course, calm, SeaState(1.0, T, BETA), 1).water for T in (5.0, 14.0)}
    assert reach == {5.0: False, 14.0: True}


def test_every_alternative_sees_the_same_waves(plan):
    deep = of_kind(plan, PhaseKind.DEEP)
    tips = []
    for winch in (Winch(), Winch(left=0.2), Winch(controller=Alternative.NS)):
        course, calm = calm_of(plan, deep, winch)
        tips.append(in_sea(plan, deep, winch, course, calm, SeaState(2.0, 8.0, BETA), 3).lowering().tip.amplitudes)
    np.testing.assert_array_equal(tips[0], tips[2])
    np.testing.assert_allclose(tips[1], 0.2 * tips[0], rtol=1e-12)


def test_every_sea_has_waves_of_its_own():
    """Runs of neighbouring cells then add to each other; the same sea is the same to all alternatives."""
    spots = [SeaState(Hs, T, BETA) for Hs in (1.0, 1.05, 2.0) for T in (8.0, 9.0)]
    seeds = {seed_of(spot, k) for spot in spots for k in range(1, 100)}
    assert len(seeds) == len(spots) * 99
    assert seed_of(SeaState(1.0, 8.0, BETA), 3) == seed_of(SeaState(1.0, 8.0, BETA + 1e-12), 3)


def test_a_seed_of_the_plan_gives_other_waves_in_every_sea():
    """All runs of a cell with it, of a swell alone too; runs of two seeds are never the same waves."""
    spots = [*(SeaState(Hs, T, BETA) for Hs in (1.0, 2.0) for T in (8.0, 9.0)), SeaState(0.0, 8.0, BETA)]
    seeds = [seed_of(spot, k, seed) for spot in spots for k in range(1, 100) for seed in (0, 1, 2)]
    assert len(set(seeds)) == len(spots) * 99 * 3
    assert seed_of(SeaState(0.0, 8.0, BETA), 3, 5) == seed_of(SeaState(0.0, 9.0, BETA), 3, 5)


# from runs to quantities


def numbers(n=20, **changed):
    """Made-up numbers of n runs that scatter a little."""
    wiggle = 1.0 + 0.02 * np.random.default_rng(1).random(n)
    base = {
        "duration": 300.0,
        "s_tip_pp": 1.0,
        "e_c_pp": 0.1,
        "load_pp": 0.3,
        "F_w_max": 1.5e6,
        "DAF": 1.0,
        "F_sling_min": 8e5,
        "sling_slack_time": 0.0,
        "snap": 0.0,
        "v_tip_max": 0.5,
        "v_w_max": 0.5,
        "p_a_max": 2e7,
        "saturation_time": 3.0,
        "oscillation_time": 6.0,
        "relief_time": 0.0,
        "power_time": 0.0,
        "stroke_time": 0.0,
        "v_landed": 0.2,
    }
    exact = ("duration", "snap")
    return {
        name: np.full(n, value) * (1.0 if name in exact or name.endswith("_time") else wiggle)
        for name, value in (base | changed).items()
    }


STILL = {"s_tip_pp": 0.0, "e_c_pp": 0.0, "load_pp": 0.0, "F_w_max": 1.3e6, "DAF": 0.9, "v_tip_max": 0.0, "v_w_max": 0.0}
STILL |= {"F_sling_min": 9.6e5, "p_a_max": 1e7, "saturation_time": 0.0, "oscillation_time": 0.0}


def asked(plan, kind, alternative, **changed):
    """Level of every quantity in one sea of 2 m."""
    phase = of_kind(plan, kind)
    winch = winch_of(phase, alternative)
    told = {}
    for name, measure in measures(plan, phase, alternative, winch, course_of(plan, phase, winch)).items():
        if measure.statistic is not Statistic.CHANCE:
            column = ColumnRuns(
                8.0, BETA, measure, 2.0, float(measure.values(numbers(1, **STILL))[0]), ((2.0, numbers(**changed)),)
            )
            told[name] = float(measure.of_x(np.array([curve_of([column]).level(0, 2.0)[0]]))[0])
    return told


def test_only_what_the_winch_of_an_alternative_has_is_determined(plan):
    told = {a: asked(plan, PhaseKind.DEEP, a) for a in (Alternative.NONE, Alternative.CAP, Alternative.SSC)}
    assert not {"p_a_max", "saturation_share", "v_w_demand"} & set(told[Alternative.NONE])
    assert not {"p_a_max", "saturation_share"} & set(told[Alternative.CAP])
    assert told[Alternative.CAP]["v_w_demand"] > 0.0
    assert told[Alternative.SSC]["saturation_share"] == pytest.approx(0.01)
    assert told[Alternative.SSC]["oscillation_share"] == pytest.approx(0.02)


def test_the_tip_moves_as_far_under_a_cap_as_without_it(plan):
    """The cap's runs have a fifth of the motion: what they say of the tip is five times that, what they leave is theirs."""
    none = asked(plan, PhaseKind.DEEP, Alternative.NONE)
    cap = asked(plan, PhaseKind.DEEP, Alternative.CAP, s_tip_pp=0.2, v_tip_max=0.1)
    assert cap["s_tip_pp"] == pytest.approx(none["s_tip_pp"])
    assert cap["e_c_pp"] == pytest.approx(0.2 * none["e_c_pp"])


def test_slings_that_hang_slack_have_no_tension_left(plan):
    ratio = asked(plan, PhaseKind.SPLASH, Alternative.NONE, F_sling_min=0.0)["sling_ratio"]
    assert ratio == pytest.approx(0.0, abs=np.finfo(float).eps)  # 1 less a tension over itself


def test_nothing_in_twenty_runs_is_not_never():
    slack = Measure("F_sling_min", Statistic.CHANCE, times=2.0, end=9.6e5, falls=True)
    none, every = (chance(slack, numbers(F_sling_min=F)) for F in (8e5, 0.0))
    assert none.value == 0.0
    assert 0.1 < none.high < 0.4
    assert every.value == 1.0


@pytest.mark.parametrize(
    ("kind", "failed", "sound"),
    [("deep", 0, True), ("deep", 1, False), ("splash-zone", 1, True), ("splash-zone", 2, False)],
)
def test_a_sea_is_beyond_by_failed_runs_that_a_tenth_of_its_phases_would_meet(plan, kind, failed, sound):
    """One run of 20 in a passage that happens once is 5 % of them; in half an hour of 7.5 runs it is a third."""
    phase = of_kind(plan, PhaseKind(kind))
    winch = winch_of(phase, Alternative.SSC)
    higher = numbers(DAF=1.1)
    for values in higher.values():
        values[:failed] = np.nan
    measure = measures(plan, phase, Alternative.SSC, winch, course_of(plan, phase, winch))["DAF"]
    column = ColumnRuns(8.0, BETA, measure, 1.5, STILL["DAF"], ((1.0, numbers()), (2.0, higher)))
    limits = limits_of_curve(curve_of([column]), np.array([1.06]), 6.0)
    assert (limits.Hs[0] > 1.0) == sound


def test_a_landing_takes_the_same_time_under_every_winch(plan):
    """A seed is then the same sea to all of them."""
    landing = of_kind(plan, PhaseKind.LANDING)
    assert len({course_of(plan, landing, winch_of(landing, a)).duration for a in ALTERNATIVES}) == 1


def test_a_passage_that_is_planned_to_take_longer_counts_more_often(plan):
    splash = of_kind(plan, PhaseKind.SPLASH)
    assert course_of(plan, splash, Winch()).times == 1.0
    slow = splash.model_copy(update={"planned": 10.0 * splash.duration})
    assert course_of(plan, slow, Winch()).times == pytest.approx(10.0)


# runs


@pytest.mark.thorough
def test_runs_of_every_phase_tell_what_its_rules_ask(narrow):
    """One sea, few seeds, all phases and winches in one go; tensions rise with the sea, and the calm is what hangs at rest."""
    cells = Cells(narrow, Execution())
    phases = [p for p in narrow.phases if p.kind in KINDS and p.kind is not PhaseKind.LOWERING]
    asks = {}
    for phase in phases:
        for a in narrow.alternatives:
            for Hs, seeds in ((0.0, 1), (1.5, 5)):
                asks[phase.name, a, Hs] = CellRequest(phase.name, winch_of(phase, a), SeaState(Hs, 8.0, BETA), seeds)
    cells.request(list({ask.cell: ask for ask in asks.values()}.values()))
    for phase in phases:
        for a in narrow.alternatives:
            calm, sea = (_told(narrow, cells, phase, a, asks[phase.name, a, Hs]) for Hs in (0.0, 1.5))
            wanted = {r.rule.quantity for r in limited(narrow, phase, a)} - {"F_top_static"}
            wanted -= {"load_pp"} if phase.kind is PhaseKind.LANDING and not a.twin else set()
            assert wanted <= set(sea), (phase.name, a)
            assert sea["F_top_max"] > calm["F_top_max"]
            assert sea["DAF"] > calm["DAF"]
            if phase.kind is PhaseKind.LANDING:
                assert 0.0 < calm["v_landed"] < phase.speed  # water that has to leave from under it brakes it
            if phase.kind is PhaseKind.DEEP:
                assert calm["sling_ratio"] == pytest.approx(1.0, abs=2e-3)
    deep = of_kind(narrow, PhaseKind.DEEP)
    left = {a: _told(narrow, cells, deep, a, asks[deep.name, a, 1.5])["load_pp"] for a in narrow.alternatives}
    assert left[Alternative.SSC] < left[Alternative.CAP] < left[Alternative.NONE]


def _told(plan, cells, phase, alternative, ask):
    """Largest x of every measure."""
    course = cells.course(phase, ask.winch, ask.spot)
    runs = cells.runs[ask.cell]
    found = measures(plan, phase, alternative, ask.winch, course)
    return {name: float(m.of_x(m.values(runs).max(keepdims=True))[0]) for name, m in found.items() if m.x in runs}


STEPPED = 0.01
"""Part by which the mean of largest values may differ from those of a fine step: a fifth of what 16 seeds scatter."""


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["splash zone", "splash zone, held", "deep", "landing"])
def test_the_step_of_a_plan_does_not_show_in_its_numbers(narrow_holding, name):
    phase, spot = narrow_holding.phase(name), SeaState(1.5, 8.0, BETA)
    winch = winch_of(phase, Alternative.SSC)
    course = Cells(narrow_holding, Execution()).course(phase, winch, spot)
    crane, mode = machine_of(narrow_holding, winch)
    calm = lowering_of(narrow_holding, phase, course, mode)
    runs = [in_sea(narrow_holding, phase, winch, course, calm, spot, seed) for seed in range(1, 17)]
    coarse, fine = (
        run_numbers(simulate([crane] * 16, runs, on_failure="mark", step=step), [course.counts] * 16)
        for step in (f"{step_of(narrow_holding)!r} s", "1 ms")
    )
    for number in ("F_w_max", "DAF", "load_pp", "v_landed"):
        np.testing.assert_allclose(np.mean(coarse[number]), np.mean(fine[number]), rtol=STEPPED, err_msg=number)


@pytest.mark.thorough
def test_slings_have_least_tension_at_the_worst_submergence(narrow_holding):
    """Least tension of 16 runs, beside the payload above the waves, cut by the surface elsewhere, and well covered."""
    held = next(p for p in narrow_holding.phases if p.held)
    cells, spot = Cells(narrow_holding, Execution()), SeaState(1.8, 8.0, BETA)
    worst = cells.course(held, Winch(), spot).z_0
    least = {}
    for z in (worst, 3.0, worst + 2.0, worst - 2.5, -15.0):
        course = course_of(narrow_holding, held, Winch(), z)
        calm = lowering_of(narrow_holding, held, course, machine_of(narrow_holding, Winch())[1])
        runs = [in_sea(narrow_holding, held, Winch(), course, calm, spot, seed) for seed in range(1, 17)]
        data = simulate([narrow_holding.crane] * 16, runs, on_failure="mark")
        least[z] = float(np.median(run_numbers(data, [course.counts] * 16)["F_sling_min"]))
    assert min(least, key=least.get) == worst
    assert least[worst] < 0.7 * min(F for z, F in least.items() if z != worst)


@pytest.mark.thorough
def test_half_an_hour_at_the_worst_submergence_limits_lower_than_the_passage(narrow_holding):
    plan = replace(narrow_holding, alternatives=(Alternative.NONE,))
    plan = replace(plan, phases=tuple(p for p in plan.phases if p.kind is PhaseKind.SPLASH))
    passage, held = plan.phases
    of = {}
    for phase in (passage, held):  # each alone: one that another one hides is not looked for any higher
        found = refine(replace(plan, phases=(phase,)), predicted(plan, {phase.name: 1.5}), search=FEW)
        of[phase.name] = found.limits[0]
    assert 0.5 < of[held.name].Hs["slack-sling"][0] < 0.9 * of[passage.name].Hs["slack-sling"][0]
    assert of[held.name].low["slack-sling"][0] < of[held.name].high["slack-sling"][0]


def predicted(plan, heights):
    """Limits of the frequency tier as a stand-in: phase -> height of all alternatives."""
    column = (np.array([8.0]), np.array([BETA]))
    return [
        Limits(name, a, Tier.FREQUENCY, *column, {"slack-sling": np.array([Hs])})
        for name, Hs in heights.items()
        for a in plan.alternatives
    ]


@pytest.mark.thorough
def test_phases_far_from_governing_are_not_run_and_interrupted_work_goes_on(narrow, tmp_path):
    plan = replace(narrow, alternatives=(Alternative.NONE, Alternative.SSC))
    landing, splash = of_kind(plan, PhaseKind.LANDING).name, of_kind(plan, PhaseKind.SPLASH).name
    heights = {p.name: math.inf for p in plan.phases} | {landing: 0.6, splash: 4.0}
    shares = []
    first = refine(plan, predicted(plan, heights), search=FEW, execution=Execution(tmp_path), progress=shares.append)
    assert {d.phase for d in first.demands} == {landing} | (
        {splash} if any(d.phase == splash for d in first.demands) else set()
    )
    assert first.reasons[of_kind(plan, PhaseKind.DEEP).name]["cause"] == "not-run"
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    none = next(x for x in first.limits if x.phase == landing and x.alternative is Alternative.NONE)
    assert 0.1 < np.nanmin([float(v[0]) for v in none.Hs.values()]) < 3.0
    assert all(d.tier is Tier.TIME and d.seeds is not None and d.seeds.max() >= FEW.seeds for d in first.demands)
    again = refine(plan, predicted(plan, heights), search=FEW, execution=Execution(tmp_path))
    for a, b in zip(first.demands, again.demands, strict=True):
        for name, values in a.values.items():
            np.testing.assert_array_equal(values, b.values[name])
    assert set(first.blocks) == {"landing", "convergence"}
    assert first.notes[0]["cause"] == "cushion"
    for key, Hs in none.Hs.items():
        if math.isfinite(Hs[0]) and key in none.low:
            assert none.low[key][0] <= Hs[0] <= none.high[key][0]  # without an upper end where few runs hardly grow
    speeds = first.blocks["landing"]["v_landed"]
    assert speeds.sel(alternative="none").std() > speeds.sel(alternative="ssc").std()


@pytest.mark.thorough
def test_a_search_that_is_cancelled_resumes_from_its_store_with_the_same_limits(narrow, tmp_path):
    plan = replace(narrow, alternatives=(Alternative.NONE, Alternative.SSC))
    landing = of_kind(plan, PhaseKind.LANDING).name
    limits = predicted(plan, {p.name: math.inf for p in plan.phases} | {landing: 0.6})
    token, events = CancelToken(), []

    def listen(event):
        events.append(event)
        if event.done >= 16:
            token.cancel()

    with pytest.raises(Cancelled):
        refine(plan, limits, search=FEW, execution=Execution(tmp_path), progress=Monitor(listen, cancel=token))
    assert all(a.done <= b.done for a, b in pairwise(events))
    assert events[-1].cell.startswith(landing)
    more = []
    resumed = refine(plan, limits, search=FEW, execution=Execution(tmp_path), progress=Monitor(more.append))
    calms = len(plan.alternatives)  # the first round: they are stored as well
    assert next(e.done for e in more if e.done > calms) >= 16
    assert all(a.share <= b.share for a, b in pairwise(more))
    assert all(a.done <= b.done for a, b in pairwise(more) if a.stage == b.stage)
    fresh = refine(plan, limits, search=FEW, execution=Execution())
    for a, b in zip(resumed.limits, fresh.limits, strict=True):
        for rule, values in a.Hs.items():
            np.testing.assert_array_equal(values, b.Hs[rule])


def test_the_usual_number_of_runs_grows_with_alternatives(plan):
    fewer = replace(plan, alternatives=plan.alternatives[:1])
    assert usual_runs(plan) == len(plan.alternatives) * usual_runs(fewer) > 0


@pytest.mark.slow
def test_the_worst_height_of_a_long_way_is_where_its_load_resonates(plan):
    """Short waves meet the load where its natural period on the wire is theirs, which the deepest place passes already."""
    phase = plan.phases[0].model_copy(
        update={
            "kind": PhaseKind.LOWERING,
            "mode": WinchMode.AHC,
            "start_depth": 25.0,
            "depth": 1475.0,
            "speed": 0.5,
            "planned": 2900.0,
        }
    )
    environment = plan.environment.model_copy(update={"Tp": (4.0, 12.0), "headings": (BETA,), "spread": None})
    found = worst_heights(replace(plan, environment=environment), phase)
    assert found[12.0, BETA][0] == pytest.approx(-1475.0)
    assert found[4.0, BETA][0] > -1400.0
    assert all(0.0 < time <= phase.duration for _, time in found.values())


@pytest.mark.slow
def test_levels_of_runs_that_another_alternative_asked_for_are_told_too(plan):
    """Without compensation all alternatives share their runs: in a column that one of them did not start as well."""
    of_two = replace(plan, alternatives=(Alternative.NONE, Alternative.SSC))
    work, phase = Work(of_two, FEW, Cells(of_two, Execution()), None), of_kind(of_two, PhaseKind.SPLASH)
    work.prepare([])
    lines, rng = work.phases[phase.name, Alternative.SSC], np.random.default_rng(1)
    for line in lines[:2]:
        for spot in (line.spot(0.0), line.spot(1.0)):
            size = rng.uniform(0.5, 1.0, 8) if spot.Hs else np.full(1, 0.4)
            numbers = {m.x: 1e5 * size for m in work.measures(line).values()} | {"duration": np.ones(len(size))}
            work.cells.runs[phase.name, line.winch, spot] = numbers
            work.cells._heights.setdefault((phase.name, line.winch, *line.column), set()).add(spot.Hs)
    lines[0].started, failures = True, Failures()
    found = demand_of(work, phase, Alternative.SSC, failures)
    assert not failures.reasons
    assert np.isfinite(found.values["F_top_max"]).all()
    assert set(zip(found.seas.Tp, found.seas.beta, strict=True)) == {lines[0].column, lines[1].column}
