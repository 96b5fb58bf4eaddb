"""The frequency tier of a lift plan: limits, symmetries, other roads to the same numbers, and one cell beside the time domain."""

import math
from dataclasses import replace

import numpy as np
import pytest

from stillhook.engine.simulate import simulate
from stillhook.errors import PlanError
from stillhook.plan.answer.reference_cell import depth_profile
from stillhook.plan.definition.capacities import calm
from stillhook.plan.definition.rules import Alternative, Seas, Tier
from stillhook.plan.file import load_plan
from stillhook.plan.tiers.frequency import frequency, winches_of
from stillhook.plan.tiers.situations import looked_at, situations, thinned
from stillhook.plan.weather.spectral import utilisations
from stillhook.response import Forcing, Waves
from stillhook.response.frequency_domain import sigmas
from stillhook.sea.spectra.measured import SeaStates
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.spec.lift.phase import Phase, PhaseKind
from stillhook.statistics.extremes import MPM, P90, largest, largest_of_parts, share_beyond, speed_at_crossing

NONE, CAP, SSC = Alternative.NONE, Alternative.CAP, Alternative.SSC
EXACT = 1e-6  # a level found by halving
DRAWN = 0.02  # some thousand draws of a largest value
MILD = 0.05  # the agreement of significant values that the tiers owe one another in mild cells


@pytest.fixture(scope="module")
def plan():
    """The library's example in a small table of head seas."""
    whole = load_plan("template-to-1500m")
    small = {"Hs": (1.0, 2.0, 3.0), "Tp": (7.0, 9.0), "headings": (math.pi,)}
    return replace(whole, alternatives=(NONE, CAP), environment=whole.environment.model_copy(update=small))


@pytest.fixture(scope="module")
def found(plan):
    return {(d.phase, d.alternative): d for d in frequency(plan, (NONE, CAP), plan.environment.table())}


def test_a_phase_in_two_halves_has_the_largest_value_of_the_whole():
    whole = largest_of_parts(0.0, [[2.0]], [[300.0]], P90)
    halves = largest_of_parts(0.0, [[2.0], [2.0]], [[150.0], [150.0]], P90)
    assert whole == pytest.approx(largest(2.0, 300.0, P90), rel=EXACT)
    assert halves == pytest.approx(whole, rel=EXACT)


def test_parts_that_differ_share_the_chance_of_the_largest_value():
    """Beside draws of Rayleigh maxima about the means of two parts."""
    rng = np.random.default_rng(3)
    maxima = [m + s * rng.rayleigh(size=(6000, n)).max(axis=1) for m, s, n in ((10.0, 1.0, 200), (8.0, 1.8, 40))]
    for q in (MPM, P90):
        level = largest_of_parts([[10.0], [8.0]], [[1.0], [1.8]], [[200.0], [40.0]], q)[0]
        assert level == pytest.approx(np.quantile(np.max(maxima, axis=0), q), rel=DRAWN)


def test_what_stands_still_has_its_mean_for_largest_value_and_an_unknown_part_none():
    assert largest_of_parts([[3.0], [5.0]], [[0.0], [0.0]], [[0.0], [0.0]], P90)[0] == pytest.approx(5.0)
    assert np.isnan(largest_of_parts([[3.0], [5.0]], [[math.nan], [1.0]], [[10.0], [10.0]], P90)[0])
    assert share_beyond(1.0, [0.0, 1e9]) == pytest.approx([0.0, 1.0], abs=1e-6)


def test_a_load_lands_at_its_drift_in_a_calm_and_faster_the_more_it_swings():
    speeds = speed_at_crossing(0.1, [0.0, 0.05, 0.3], 0.9)
    assert speeds[0] == pytest.approx(0.1)
    assert np.all(np.diff(speeds) > 0.0)
    w = np.random.default_rng(5).normal(0.1, 0.05, 400_000)
    w = np.sort(w[w > 0.0])
    passed = np.cumsum(w) / w.sum()  # of many passages at speed w there are as many as w is large
    assert speeds[1] == pytest.approx(w[np.searchsorted(passed, 0.9)], rel=DRAWN)


@pytest.mark.slow
def test_every_phase_but_the_splash_zone_is_told_for_every_alternative(plan, found):
    names = [p.name for p in plan.phases if p.kind is not PhaseKind.SPLASH]
    assert list(found) == [(name, a) for name in names for a in (NONE, CAP)]
    assert all(d.tier is Tier.FREQUENCY and len(v) == 6 for d in found.values() for v in d.values.values())


@pytest.mark.slow
def test_phases_without_compensation_are_the_same_for_all_and_the_cap_leaves_a_fifth_in_the_others(found):
    for name in ("lift-off", "over the side", "upper water"):
        assert found[name, NONE].values is found[name, CAP].values
    none, cap = (found["deep", a].values for a in (NONE, CAP))
    assert cap["e_c_pp"] == pytest.approx(0.2 * none["s_tip_pp"], rel=1e-3)
    assert none["e_c_pp"] == pytest.approx(none["s_tip_pp"], rel=1e-3)
    assert np.all(cap["load_pp"] < 0.5 * none["load_pp"])


def test_a_higher_sea_asks_more_of_everything(plan, found):
    seas = plan.environment.table()
    for demand in found.values():
        for name, values in demand.values.items():
            rising = -values if name == "sling_ratio" else values
            for _, _, rows in seas.columns:
                assert np.all(np.diff(rising[rows]) >= -1e-9 * np.abs(values[rows[0]])), (demand.phase, name)


@pytest.mark.slow
def test_in_a_calm_a_phase_asks_what_hangs_at_rest(plan):
    still = Seas(np.zeros(1), np.full(1, 8.0), np.full(1, math.pi))
    for demand in frequency(plan, (CAP,), still):
        rest = calm(plan, plan.phase(demand.phase))
        for name in {"v_w_demand", "v_tip_max", "e_c_pp", "load_pp", "v_landed"} & set(demand.values):
            assert demand.values[name][0] == pytest.approx(rest[name], rel=1e-3), (demand.phase, name)
        sinks = demand.phase in ("upper water", "lower water", "landing")  # drag carries a part of it
        F = demand.values["F_top_max"][0]
        assert F < rest["F_top_max"] if sinks else F == pytest.approx(rest["F_top_max"], rel=1e-3)


@pytest.mark.slow
def test_a_payload_that_sinks_hangs_lighter_by_its_drag_and_one_that_rises_heavier(plan):
    still = Seas(np.zeros(1), np.full(1, 8.0), np.full(1, math.pi))
    down = plan.phase("upper water")
    up = down.model_copy(update={"start_depth": down.depth, "depth": down.start_depth})
    sling = [frequency(replace(plan, phases=(p,)), (NONE,), still)[0].values["sling_ratio"][0] for p in (down, up)]
    assert sling[0] < 1.0
    assert sling[1] == pytest.approx(2.0 - sling[0], rel=1e-3)


@pytest.mark.slow
def test_on_the_brake_significant_values_agree_with_runs_in_time_in_a_mild_cell(plan):
    phase, length, settled = plan.phase("deep"), 900.0, 200.0
    (s,) = situations(plan, phase)
    sea = Sea((Train(plan.environment.spectrum(2.5, 9.0), math.radians(165.0)),))
    tips, power = [], []
    for seed in range(3):
        waves = realise(sea, length, seed)
        tips.append(tip_motion(waves, plan.vessel, s.x, s.y))
        power.append(np.abs(tips[-1].amplitudes[waves.harmonic]) ** 2 / 2.0)
    nothing = np.zeros((1, len(waves.omega)))
    forcing = Forcing(
        waves.omega,
        np.full(len(waves.omega), 2.0 * math.pi / length),
        np.mean(power, axis=0)[None, :],
        nothing,
        nothing + 0j,
    )
    hangs = plan.hanging(s.z, plan.tip_of(phase).z)
    stand = {"programme": (Phase(mode="manual", time=f"{length} s"),), "duration": length}
    run = simulate(plan.crane, [hangs.model_copy(update={"tip": tip, **stand}) for tip in tips], series=True).sel(
        time=slice(settled, None)
    )
    t = np.linspace(-1.0, 1.0, run.sizes["time"])
    computed = sigmas(forcing, s.load, winches_of(plan, [(phase, (s,))], (NONE,))[NONE].at(s.load.s_w))
    for name, column in (("load", "s_load"), ("top", "F_w"), ("sling", "F_sling")):
        in_time = math.sqrt(np.mean([np.var(y - np.polynomial.Polynomial.fit(t, y, 1)(t)) for y in run[column].values]))
        assert getattr(computed, name)[0] == pytest.approx(in_time, rel=MILD), name


@pytest.mark.slow
def test_the_profile_tells_longer_periods_deeper_down_and_where_they_meet_the_sea(plan):
    profile = depth_profile(plan, (NONE, CAP), 2.0, 5.0, math.pi)
    assert np.all(np.diff(profile["T_0"].values) < 0.0) == (profile["z"].values[0] < profile["z"].values[-1])
    at = np.interp(5.0, profile["T_0"].values, profile["z"].values)
    assert profile.attrs["z_resonance"] == pytest.approx(at, abs=15.0)  # places of the profile are 75 m apart
    assert np.all(profile["F_top_max"].values > profile["F_top_static"].values)


@pytest.mark.slow
def test_a_hindcast_is_judged_record_by_record_and_a_missing_one_is_not_known(plan):
    hours = np.array(["2020-01-01T00", "2020-01-01T01", "2020-01-01T02", "2020-01-01T03"], dtype="datetime64[s]")
    H, unknown = np.array([0.5, 2.0, math.nan, 6.0]), np.full(4, math.nan)
    states = SeaStates(hours, np.isfinite(H), H, np.full(4, 8.0), unknown, unknown)
    used = utilisations(plan, (NONE, CAP), Waves(states, beta="180 deg"))[1]
    assert used[0] < used[1] < used[3]
    assert np.isnan(used[2])
    elsewhere = {CAP: np.array([1.0, 1.0, 1.0, 0.0])}
    (closed,) = utilisations(plan, (CAP,), Waves(states, beta="180 deg"), elsewhere=elsewhere)
    assert (closed <= 1.0).tolist() == [True, False, False, False]
    assert closed[3] == math.inf
    with pytest.raises(PlanError, match="one sea is not a hindcast"):
        utilisations(plan, (NONE,), Waves(plan.environment.sea(2.0, 8.0, math.pi)))


@pytest.mark.slow
def test_fewer_places_stand_for_the_same_time(plan):
    for _, parts in looked_at(plan):
        assert sum(p.time for p in thinned(parts)) == pytest.approx(sum(p.time for p in parts))
        assert {thinned(parts)[0].z, thinned(parts)[-1].z} == {parts[0].z, parts[-1].z}


@pytest.mark.slow
def test_the_twin_is_not_asked_of_a_controller_that_the_load_is_too_heavy_for(plan):
    heavy = replace(plan, payload=plan.payload.model_copy(update={"mass": 235e3}), phases=(plan.phase("deep"),))
    one = Seas(np.ones(1), np.full(1, 8.0), np.full(1, math.pi))
    none, ssc = frequency(heavy, (NONE, SSC), one)
    assert "F_top_max" not in ssc.values
    assert ssc.values["v_tip_max"] == pytest.approx(none.values["v_tip_max"])
