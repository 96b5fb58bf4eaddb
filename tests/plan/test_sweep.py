"""Limits of a landing over tolerance, payload and depth: made-up runs whose limits are known in closed form, and the
twin."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray
from tests.plan.made_up import made_up

from stillhook.engine.lowering.summary import PEAKS, phase_numbers_of, run_numbers_of
from stillhook.plan.answer.sweep import (
    Pays,
    answer_of,
    landing_of,
    landing_sweep,
    lower_of,
    over_seabed,
    rungs_of,
    variants_of,
    where_it_governs,
)
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.file import load_plan
from stillhook.plan.report.detail import answers, in_words
from stillhook.plan.report.document import document
from stillhook.plan.table import Axes, Governed
from stillhook.plan.tiers.time_domain import cells as twin_cells
from stillhook.plan.tiers.time_domain.cells import Execution
from stillhook.plan.tiers.time_domain.lowering import Winch, course_of
from stillhook.plan.tiers.time_domain.tier import refine
from stillhook.report.document import Bullets, Table
from stillhook.winches.registry import WINCH_TYPES

TP, BETA = 9.0, math.radians(165.0)
COLUMNS = ((TP, BETA),)
TOLERANCES = ("load-motion", "control-error")
SCATTER = 0.1
"""Scale of the Gumbel distribution of the largest motion in a run, over its most probable value."""
MOTION = {"ns": (0.20, 1.0), "hs": (0.15, 1.0), "ssc": (0.05, 0.6), "none": (0.7, 1.0)}
"""Most probable motion in a run in a sea of 1 m [m], and the power of the height by which it grows."""
RIGHT, FAR = 0.15, 0.3
"""Share by which limits are off: neighbours of the ladder are 1.75 apart, and a run tells on which side it is. Share
beyond which a limit is said to be outside of the ladder."""
WINCH = WINCH_TYPES["active-passive"]
THREADS = Execution(None, None, 1)


@pytest.fixture(scope="module")
def plan():
    names = (Alternative.NONE, Alternative("ns"), Alternative("hs"), Alternative("ssc"))
    return replace(load_plan("template-to-1500m"), alternatives=names)


def made_up_runs(plan, log):
    """What stands for `simulate`: motion grows with payload and depth in proportion; every run is kept in the log."""

    def simulated(cranes, cases, **_):
        numbers = {name: np.zeros((len(cases), 6)) for name in phase_numbers_of(WINCH)}
        run = {name: np.zeros(len(cases)) for name in run_numbers_of(WINCH)}
        for i, case in enumerate(cases):
            Hs = case.sea.trains[0].spectrum.H_m0 if hasattr(case, "sea") else 0.0
            lift = getattr(case, "lift", case)
            manual = all(stage.mode.value == "manual" for stage in lift.programme)
            name = "none" if manual else str(lift.controller)
            log.append((name, Hs, lift.payload.mass, lift.depth))
            swing, power = MOTION[name]
            drawn = np.random.default_rng(case.seed).gumbel(1.0, SCATTER) if Hs else 0.0
            size = lift.payload.mass / plan.payload.mass * lift.depth / plan.depth
            numbers["load_pp"][i] = swing * size * Hs**power * drawn
            numbers["duration"][i] = 90.0
        columns = {f"phase_{name}": (("case", "phase"), values) for name, values in numbers.items()}
        columns |= {f"peak_{name}": (("case", "interval"), np.zeros((len(cases), 40))) for name in PEAKS}
        columns["peak_interval"] = (("case",), np.full(len(cases), 10.0))
        columns["status"] = (("case",), np.full(len(cases), "ok", dtype=object))
        return xarray.Dataset(columns | {name: (("case",), values) for name, values in run.items()})

    return simulated


@pytest.fixture
def runs(monkeypatch, plan):
    """Runs are made up."""
    monkeypatch.setattr(twin_cells, "simulate", made_up_runs(plan, []))


@pytest.fixture(scope="module")
def swept(plan):
    """The sweep of the plan by made-up runs, and these runs: (alternative, height, mass, depth)."""
    log = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(twin_cells, "simulate", made_up_runs(plan, log))
        return landing_sweep(plan, COLUMNS, THREADS), log


@pytest.fixture
def block(swept):
    return swept[0].copy(deep=True)


@pytest.mark.slow
def test_limits_of_known_motions_are_found_at_every_tolerance_payload_and_depth(plan, block):
    off, held = [], []
    for name, (swing, power) in MOTION.items():
        winch = Winch() if name == "none" else Winch(1.0, Alternative(name))
        times = max(course_of(plan, phase, winch).times for phase in over_seabed(plan))
        level = swing * (1.0 + SCATTER * math.log(times))
        of = block.sel(alternative=name)
        size = (of["mass"] / plan.payload.mass * of["depth"] / plan.depth).values[:, None]
        exact = (of["landing_tolerance"].values / (level * size)) ** (1.0 / power)
        found, low, high = (of[f"Hs_landing{end}"].values for end in ("", "_low", "_high"))
        rungs = rungs_of(plan)
        between = (exact > rungs[0] * (1.0 + FAR)) & (exact < rungs[-1] * (1.0 - FAR))
        off += np.log(found[between] / exact[between]).tolist()
        held += ((low <= exact) & (exact <= high))[between].tolist()
        assert np.all(low <= found)
        assert np.all(found <= high)
        assert np.all(found[exact < rungs[0] * (1.0 - FAR)] == 0.0)
        assert np.all(np.isinf(found[exact > rungs[-1] * (1.0 + FAR)]))
    assert len(off) > 40
    assert np.sqrt(np.mean(np.square(off))) < RIGHT
    assert np.mean(held) >= 0.9


@pytest.mark.slow
def test_a_controller_that_moves_less_lands_in_higher_seas_at_every_tolerance(block):
    """SSC moves less than HS in every sea of the ladder by more than the scatter."""
    answer = answer_of(block)
    own = {name: float(block[name][0]) for name in ("mass", "depth", "delay")}
    planned = [row for row in answer["pays"] if all(row[name] == x for name, x in own.items())]
    assert {row["new"] for row in planned} == {"ssc"}
    assert [row["better"] for row in planned] == [1] * len(block["landing_tolerance"])
    assert answers(block)[0].startswith(
        "120 t, 1500 m, Tp 9 s (as planned): a new controller lands in higher seas from a tolerance of 0.5 m down to 0.05 m; "
    )


@pytest.mark.slow
def test_controllers_that_move_alike_are_said_to_be_alike(plan, runs, monkeypatch):
    monkeypatch.setitem(MOTION, "ssc", MOTION["hs"])
    block = landing_sweep(plan, COLUMNS, THREADS)
    assert not any(row["better"] for row in answer_of(block)["pays"])
    assert all("at no tolerance does a new controller land in higher seas" in line for line in answers(block))


@pytest.mark.slow
def test_without_a_classic_controller_nothing_is_compared(plan, runs):
    one = replace(plan, alternatives=(Alternative.NONE, Alternative("ssc")))
    block = landing_sweep(one, COLUMNS, THREADS)
    assert answer_of(block)["pays"] == []
    assert answers(block) == ["the plan does not have a new and a classic controller side by side"]


@pytest.mark.slow
def test_runs_stay_within_their_budget(swept):
    block, runs = swept
    in_waves = [run for run in runs if run[1] > 0.0]
    assert block.attrs["n_runs"] == len(runs)
    assert len(in_waves) <= 1650  # four alternatives of six, and one period of three
    assert len({run[2:] for run in in_waves}) == block.sizes["variant"] - 1  # a late signal is of the same lift


def test_without_a_compensated_landing_there_is_no_sweep(plan):
    landing = landing_of(plan)
    manual = replace(plan, phases=(landing.model_copy(update={"mode": "manual"}),))
    others = replace(plan, phases=tuple(p for p in plan.phases if p is not landing))
    assert landing_sweep(manual, COLUMNS, THREADS) is None
    assert landing_sweep(others, COLUMNS, THREADS) is None


def test_a_landing_moves_with_the_seabed(plan):
    found, left_out = variants_of(plan, COLUMNS)
    assert not left_out
    assert [each.varied for each in found] == ["", "payload", "payload", "depth", "depth", "delay"]
    for each in found:
        for phase, planned in zip(each.plan.phases, over_seabed(plan), strict=True):
            assert phase.z_end + each.plan.depth == pytest.approx(planned.z_end + plan.depth)
            assert phase.z_start + each.plan.depth == pytest.approx(planned.z_start + plan.depth)
    assert plan.depth < found[-2].plan.depth < 2.0 * plan.depth  # where the drum's wire ends


def test_other_periods_are_of_the_plan_as_it_is(plan):
    found, _ = variants_of(plan, (*COLUMNS, (6.0, BETA), (12.0, BETA)))
    assert [each.varied for each in found] == ["", "period", "period", "payload", "payload", "depth", "depth", "delay"]
    assert [each.column[0] for each in found] == [9.0, 6.0, 12.0, 9.0, 9.0, 9.0, 9.0, 9.0]
    assert len({each.name for each in found}) == len(found)


def table_of(plan, phase: str, rule: str, columns: dict[str, list[float]]) -> Governed:
    """A table in which a rule in a phase governs alternatives at periods, and the splash zone elsewhere."""
    axes = Axes.of(plan)
    shape = len(axes.alternatives), *axes.columns
    phases, rules = np.full(shape, axes.phases.index("splash zone")), np.full(shape, axes.rules.index("slack-sling"))
    for name, periods in columns.items():
        for T in periods:
            at = axes.alternatives.index(Alternative(name)), 1, axes.periods.index(T)
            phases[at], rules[at] = axes.phases.index(phase), axes.rules.index(rule)
    return Governed(axes, *(np.ones(shape) for _ in range(3)), phases, rules, np.full(shape, 2))


def test_the_landing_is_looked_at_in_the_periods_in_which_it_limits_a_twin(plan):
    other, heading = (9.0, BETA), sorted(plan.environment.headings)[1]
    found = where_it_governs(
        plan, table_of(plan, "landing, held", "load-motion", {"ns": [5.0, 6.0, 8.0, 11.0], "ssc": [6.0]}), other
    )
    assert found == ((8.0, heading), (5.0, heading), (11.0, heading))
    one = where_it_governs(plan, table_of(plan, "landing", "control-error", {"hs": [7.0]}), other)
    assert one == ((7.0, heading),)
    for phase, rule, of in (
        ("landing, held", "load-motion", {"none": [7.0]}),
        ("landing", "landing-speed", {"ns": [7.0]}),
        ("deep", "load-motion", {"ns": [7.0]}),
    ):
        assert where_it_governs(plan, table_of(plan, phase, rule, of), other) == (other,)


def test_where_runs_allow_far_more_the_other_method_counts_and_the_interval_spans_both():
    runs = np.array([[1.0, 2.0, math.inf, 1.0], [0.8, 1.6, 4.0, 0.8], [1.3, 2.5, math.inf, 1.3]])
    found = lower_of(runs, np.array([0.9, 1.0, 2.0, math.nan]))
    assert found.tolist() == [[1.0, 1.0, 2.0, 1.0], [0.8, 1.0, 2.0, 0.8], [1.3, 2.5, math.inf, 1.3]]


def test_a_motion_signal_that_comes_late_is_tried_or_one_in_time(plan):
    late = variants_of(plan, COLUMNS)[0][-1]
    assert late.plan.sensors.delay == pytest.approx(0.2)
    assert late.name.endswith("signal 0.2 s late")
    slow = replace(plan, sensors=plan.sensors.model_copy(update={"delay": 0.05}))
    assert variants_of(slow, COLUMNS)[0][-1].plan.sensors.delay == 0.0


def test_another_payload_keeps_its_outside(plan):
    """Mass alone changes: volume, added mass and drag area are those of the plan's payload."""
    base, *others = variants_of(plan, COLUMNS)[0]
    for each in others[:2]:
        payload = each.plan.payload
        assert payload.mass != base.plan.payload.mass
        assert payload.covered(plan.rho) == base.plan.payload.covered(plan.rho)


def test_what_the_crane_cannot_carry_or_reach_is_left_out_with_its_reason(plan):
    heavy = plan.payload.model_copy(update={"mass": 200e3})
    found, left_out = variants_of(replace(plan, payload=heavy), COLUMNS)
    assert "300 t" not in " ".join(each.name for each in found)
    assert "Payload 300 t exceeds the SWL 250 t" in left_out[0]
    deep = variants_of(plan, COLUMNS)[0][-2].plan
    again, reasons = variants_of(deep, COLUMNS)
    assert all(each.plan.depth <= deep.depth for each in again)
    assert any("the drum's wire ends at" in line for line in reasons)


def test_a_wire_beyond_the_swl_is_left_out(plan):
    """240 t hang at 500 m, and the wire to the deepest place weighs more than what is left of the SWL."""
    found, left_out = variants_of(replace(plan, payload=plan.payload.model_copy(update={"mass": 240e3})), COLUMNS)
    assert "500 m" in " ".join(each.name for each in found)
    assert any("beyond the SWL and hook" in line for line in left_out)


def test_in_shallow_water_a_landing_that_would_begin_in_the_waves_is_left_out(plan):
    landing = landing_of(plan)
    shallow = landing.model_copy(update={"start_depth": 40.0, "depth": 60.0})
    found, left_out = variants_of(replace(plan, depth=60.0, phases=(shallow,)), COLUMNS)
    assert all(each.plan.depth >= 60.0 for each in found)
    assert any("before the payload is covered" in line for line in left_out)


def pays(tolerance: float, new: tuple[float, float, float], classic: tuple[float, float, float]) -> Pays:
    return Pays(tolerance, "ssc", "hs", np.array(new), np.array(classic))


def test_words_say_where_a_new_controller_pays_and_where_the_classic_one_is_better():
    rows = [
        pays(0.05, (0.5, 0.4, 0.6), (0.8, 0.7, 0.9)),
        pays(0.1, (2.0, 1.5, 2.5), (1.0, 0.9, 1.1)),
        pays(0.2, (math.inf, 3.0, math.inf), (1.5, 1.2, 1.8)),
        pays(0.5, (math.inf, math.inf, math.inf), (math.inf, math.inf, math.inf)),
    ]
    text = in_words(rows, (0.4, 5.0))
    assert "a new controller lands in higher seas from a tolerance of 0.2 m down to 0.1 m" in text
    assert "at 0.2 m: SSC > 5 m (3.00 to > 5) against HS 1.50 m (1.20 to 1.80)" in text
    assert text.endswith("The classic controller lands in higher seas at a tolerance of 0.05 m")


@pytest.mark.slow
def test_the_report_shows_the_sweep_or_says_why_there_is_none(block):
    base = made_up()
    without = document(
        replace(base, facts={**base.facts, "not_computed": {"sweep": {"cause": "no-compensated-landing"}}}), {}
    )
    (section,) = (s for s in without.sections[-1].parts if "Landing tolerance" in s.title)
    assert "no landing is compensated" in section.parts[0].text
    result = replace(base, blocks={**base.blocks, "sweep": block})
    (section,) = (s for s in document(result, {}).sections[-1].parts if "Landing tolerance" in s.title)
    assert answers(block)[0][1:] in next(p for p in section.parts if isinstance(p, Bullets)).lines[0]
    table = next(p for p in section.parts if isinstance(p, Table))
    steps = [f"{x:.3g}" for x in sorted(float(x) for x in block["landing_tolerance"].values)]
    ends = [row[1].split(" to ") for row in table.rows]
    shown = [step for low, *high in ends for step in steps[steps.index(low) : steps.index((high or [low])[0]) + 1]]
    assert shown == steps * block.sizes["variant"]  # tolerances with one answer are one row, and none is left out


@pytest.mark.thorough
def test_the_twin_lands_more_closely_with_a_new_controller_and_less_so_with_more_wire():
    """Its sweep agrees with the search of the plan's own tier where both give a limit."""
    names = (Alternative.CAP, Alternative("ns"), Alternative.STRONG_SSC)
    template = replace(load_plan("template-to-1500m"), alternatives=names)
    found = landing_sweep(template, COLUMNS, Execution(None, None, 2))
    Hs = found["Hs_landing"]
    assert bool((np.diff(np.nan_to_num(Hs.values, posinf=1e3), axis=2) >= 0.0).all())
    planned, deep = Hs.isel(variant=0), Hs.isel(variant=-2)
    assert bool((deep.sel(alternative="cap-80") <= planned.sel(alternative="cap-80")).all())
    at = found.sel(landing_tolerance=found.attrs["own"]).isel(variant=0)
    assert float(at["Hs_landing_low"].sel(alternative="strong-ssc")) > float(
        at["Hs_landing_high"].sel(alternative="ns")
    )

    environment = template.environment.model_copy(update={"Tp": (TP,), "headings": (BETA,)})
    both = (Alternative.CAP, Alternative("ns"))
    one = replace(template, environment=environment, alternatives=both, phases=over_seabed(template))
    limits = refine(one, []).limits
    for a in both:
        of = [x for x in limits if x.alternative is a]
        low, high = (
            min(
                float(np.nan_to_num(side[key][0], nan=math.inf))
                for x in of
                for side in (getattr(x, end),)
                for key in TOLERANCES
            )
            for end in ("low", "high")
        )
        assert float(at["Hs_landing_low"].sel(alternative=a.value)) <= high
        assert low <= float(at["Hs_landing_high"].sel(alternative=a.value))
