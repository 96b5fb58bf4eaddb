"""The search of the twin's tier over made-up runs whose limits are known in closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray

from stillhook.engine.lowering.summary import PEAKS, phase_numbers_of, run_numbers_of
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.limits import Limits
from stillhook.plan.tiers.time_domain import cells as twin_cells
from stillhook.plan.tiers.time_domain.crossings import crosses
from stillhook.plan.tiers.time_domain.lowering import Winch, course_of
from stillhook.plan.tiers.time_domain.placing import Search
from stillhook.plan.tiers.time_domain.tier import refine
from stillhook.spec.lift.phase import PhaseKind
from stillhook.winches.registry import WINCH_TYPES

BETA = math.radians(165.0)
PERIODS = (6.0, 9.0, 12.0)
SWING, SCATTER = 0.25, 0.03
"""Most probable largest motion of the payload in a run per metre of wave, and the scale of its Gumbel distribution [-]."""
SHARE = {0.2: 0.4}
"""Part of it under the flat cap; the twin leaves next to nothing."""
RIGHT = 0.12
"""Share by which a limit may be off: half of its 95 % interval is 5 to 14 % by `Search.width` and the share of weather."""
WINCH = WINCH_TYPES["active-passive"]


@pytest.fixture(scope="module")
def plan():
    found = load_plan("template-to-1500m")
    environment = found.environment.model_copy(update={"Tp": PERIODS, "headings": (BETA,)})
    phases = tuple(phase.model_copy(update={"limits": {}}) for phase in found.phases)
    alternatives = (Alternative.NONE, Alternative.CAP, Alternative.SSC)
    one_case = {"weight": None}  # the low case is a search of its own (test_weights_and_rigging.py)
    return replace(found, environment=environment, phases=phases, alternatives=alternatives, **one_case)


@pytest.fixture
def asked(monkeypatch):
    """Runs are made up; what was asked is kept: (lift, height, seed, left)."""
    log = []

    def made_up(cranes, cases, **_):
        numbers = {name: np.zeros((len(cases), 6)) for name in phase_numbers_of(WINCH)}
        peaks = {name: np.zeros((len(cases), 40)) for name in PEAKS}
        run = {name: np.zeros(len(cases)) for name in run_numbers_of(WINCH)}
        for i, case in enumerate(cases):
            Hs = case.sea.trains[0].spectrum.H_m0 if hasattr(case, "sea") else 0.0
            seed, left = getattr(case, "seed", 0), getattr(case, "left", 1.0)
            lift = getattr(case, "lift", case)
            drawn = np.random.default_rng(seed).gumbel(SWING, SCATTER) if Hs else 0.0
            by_hand = all(stage.mode.value == "manual" for stage in lift.programme)
            log.append((lift.name, Hs, seed, left))
            for name, value in (
                ("duration", 90.0),
                ("F_w_max", 1.2e6),
                ("DAF", 0.9),
                ("F_sling_max", 0.9),
                ("F_sling_min", 9e5),
                ("v_tip_max", 0.05 * Hs),
            ):
                numbers[name][i] = value
            numbers["s_tip_pp"][i] = 0.5 * Hs * left
            numbers["load_pp"][i] = Hs * drawn * (SHARE.get(round(left, 3), 1.0) if by_hand else 0.01)
            run["v_landed"][i] = 0.08
            for name in PEAKS:
                peaks[name][i] = 0.9 if name == "F_sling_max" else numbers[name].max()
        columns = {f"phase_{name}": (("case", "phase"), values) for name, values in numbers.items()}
        columns |= {f"peak_{name}": (("case", "interval"), values) for name, values in peaks.items()}
        columns["peak_interval"] = (("case",), np.full(len(cases), 10.0))
        columns["status"] = (("case",), np.full(len(cases), "ok", dtype=object))
        return xarray.Dataset(columns | {name: (("case",), values) for name, values in run.items()})

    monkeypatch.setattr(twin_cells, "simulate", made_up)
    return log


def predicted(plan, heights):
    beta = np.full(len(PERIODS), BETA)
    return [
        Limits(name, a, Tier.FREQUENCY, np.array(PERIODS), beta, {"load-motion": np.full(len(PERIODS), Hs)})
        for (name, a), Hs in heights.items()
    ]


@pytest.mark.long
def test_limits_of_known_maxima_are_found_for_every_alternative(plan, asked):
    landing = next(p for p in plan.phases if p.kind is PhaseKind.LANDING)
    guesses = {(p.name, a): math.inf for p in plan.phases for a in plan.alternatives}
    guesses |= {(landing.name, Alternative.NONE): 1.2, (landing.name, Alternative.CAP): 3.2}
    found = refine(plan, predicted(plan, guesses))
    times = course_of(plan, landing, Winch()).times
    by = {x.alternative: x for x in found.limits if x.phase == landing.name}
    for alternative, share in ((Alternative.NONE, 1.0), (Alternative.CAP, SHARE[0.2])):
        exact = 0.5 / (share * (SWING + SCATTER * math.log(times)))
        Hs, low, high = (getattr(by[alternative], part)["load-motion"] for part in ("Hs", "low", "high"))
        np.testing.assert_allclose(Hs, exact, rtol=RIGHT)
        assert np.all(low <= Hs)
        assert np.all(Hs <= high)
    assert Alternative.SSC not in by  # nothing was predicted that would limit it


@pytest.mark.long
def test_no_limit_over_the_seabed_is_below_runs_that_are_well_inside(plan, asked):
    """The motion stays at a third of its limit up to 2 m, and the prediction says 0.6 m."""
    one = replace(plan, alternatives=(Alternative.CAP,))
    guesses = {(p.name, Alternative.CAP): 0.6 if crosses(p) else math.inf for p in plan.phases}
    found = refine(one, predicted(one, guesses))
    checked = 0
    for limits in (x for x in found.limits if crosses(one.phase(x.phase))):
        demand = next(d for d in found.demands if d.phase == limits.phase)
        for i, T in enumerate(limits.Tp):
            used = sorted(
                (demand.seas.Hs[k], demand.values["load_pp"][k] / 0.5) for k in np.flatnonzero(demand.seas.Tp == T)
            )
            least, inside = limits.Hs["load-motion"][i], 0.0
            for Hs, part in used:
                if part > 1.0:
                    break
                inside = Hs if part < 0.85 else inside
            checked += inside > 1.0
            assert math.isnan(least) or least >= inside
    assert checked > 3


@pytest.mark.slow
def test_what_is_one_run_under_all_alternatives_is_run_once(plan, asked):
    splash = next(p for p in plan.phases if p.kind is PhaseKind.SPLASH)
    guesses = {(p.name, a): math.inf for p in plan.phases for a in plan.alternatives}
    guesses |= {(splash.name, a): 1.0 for a in plan.alternatives}
    refine(plan, predicted(plan, guesses))
    runs = [run for run in asked if run[0] == splash.name and run[1] > 0.0]
    assert runs
    assert len(set(runs)) == len(runs)


@pytest.mark.slow
def test_a_phase_that_another_one_hides_is_looked_at_no_higher(plan, asked):
    """The landing limits none at 2 m; the deep phase, which may limit at 1.8 m by its prediction, is inside everywhere."""
    landing, deep = (next(p for p in plan.phases if p.kind is k) for k in (PhaseKind.LANDING, PhaseKind.DEEP))
    one = replace(plan, alternatives=(Alternative.NONE,))
    guesses = {(p.name, Alternative.NONE): math.inf for p in plan.phases}
    guesses |= {(landing.name, Alternative.NONE): 1.9, (deep.name, Alternative.NONE): 2.2}
    found = refine(one, predicted(one, guesses))
    limits = {x.phase: x for x in found.limits}
    top = float(np.max(limits[landing.name].Hs["load-motion"]))
    assert max(run[1] for run in asked if run[0] == deep.name) <= 1.3 * top  # what the first runs let it seem
    assert not any(np.isfinite(Hs).any() for Hs in limits[deep.name].Hs.values())


@pytest.mark.long
def test_runs_are_added_until_the_interval_is_narrow_enough(plan, asked):
    one = replace(plan, alternatives=(Alternative.NONE,))
    landing = next(p for p in plan.phases if p.kind is PhaseKind.LANDING)
    guesses = {(p.name, Alternative.NONE): math.inf for p in plan.phases} | {(landing.name, Alternative.NONE): 1.7}
    runs = {}
    for width in (0.5, 0.01):
        tier = refine(one, predicted(one, guesses), search=Search(width=width))
        runs[width] = tier.runs["n"]
        limits = next(x for x in tier.limits if x.phase == landing.name)
        half = 0.5 * (limits.high["load-motion"] - limits.low["load-motion"]) / limits.Hs["load-motion"]
        assert np.all(
            half <= max(width, 0.15)
        )  # of the height that 12 % of runs pass, which know nothing of their waves
    assert runs[0.01] > 1.5 * runs[0.5]


@pytest.mark.slow
def test_runs_go_where_the_weather_is(plan, asked):
    """An error of a limit costs days where there is weather about it."""
    one = replace(plan, alternatives=(Alternative.NONE,))
    landing = next(p for p in plan.phases if p.kind is PhaseKind.LANDING)
    guesses = {(p.name, Alternative.NONE): math.inf for p in plan.phases} | {(landing.name, Alternative.NONE): 1.7}
    often = {PERIODS[0]: 2.5, PERIODS[1]: 0.25, PERIODS[2]: 0.25}
    tier = refine(
        one, predicted(one, guesses), search=Search(width=0.15), occurrence=lambda column, _: often[column[0]]
    )
    demand = next(d for d in tier.demands if d.phase == landing.name)
    runs = {T: int(demand.seeds[(demand.seas.Tp == T) & (demand.seas.Hs > 0.0)].max()) for T in PERIODS}
    assert runs[PERIODS[0]] >= 1.5 * max(runs[PERIODS[1]], runs[PERIODS[2]])
