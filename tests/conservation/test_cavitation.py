"""Runs that cavitate, on every hydraulic winch: no oil is pulled, and litres and joules are all there."""

import functools

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.engine.runs import run_many, run_one

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.run import ScenarioType
from stillhook.library.crane_file import changed
from stillhook.physics.hydraulics.lines import P_VAPOUR
from stillhook.winches.circuits.active import active_flows

AUDIT = 1.0e-3
"""Of the energy through the drive: what the specification asks for, also where voids open and close."""
OIL = 1.0e-3
"""Of the oil that pumps and motors moved; flows are summed by trapezoids over 10 ms across the closing of voids."""
HALVED = 2.0e-3
"""Of the value: what halving the step changes where voids close with a jump of the line's stiffness."""
SUDDEN = {"s_w": "100 m", "duration": "40 s", "warm_up": "0 s", "ramp": "0 s"}
CASES = {
    "active-passive": ("nov-250t", {"load": "100 t", "tip": "sine 2 m 10 s"}),
    "pure-active": ("nov-100t-pure-active", {"load": "45 t", "tip": "sine 3 m 6 s"}),
    "open-circuit": ("utility-20t-open-circuit", {"load": "15 t", "tip": "sine 3 m 5 s", "s_w": "30 m"}),
    "cylinder": ("nov-100t-cylinder", {"load": "80 t", "tip": "sine 4 m 8 s"}),
    "secondary": ("nov-250t-secondary", {"load": "200 t", "tip": "sine 2 m 8 s"}),
}
SMALL = {"secondary": {"accumulator": {"V_stroke": "60 L"}}}
"""A rail that the motion empties."""
PRESSURES = ("p_a", "p_b", "p_s", "p_hp", "p_r")
each = pytest.mark.parametrize("winch", sorted(CASES))


@functools.cache
def crane_of(winch: str):
    crane = load_crane(CASES[winch][0])
    return changed(crane, SMALL) if winch == "secondary" else crane


def scenario(winch: str, **more) -> Scenario:
    mode = crane_of(winch).plant.type.default_mode
    return Scenario(**(SUDDEN | CASES[winch][1] | {"mode": mode} | more))


def steps(winch: str) -> int:
    """Steps per PLC cycle of a run with its series."""
    return ScenarioType().default_steps([crane_of(winch)], [scenario(winch)], series=True)


@functools.cache
def run(winch: str):
    return simulate(crane_of(winch), scenario(winch), every="10 ms")


@each
def test_oil_is_not_pulled_but_a_void_opens(winch):
    data = run(winch)
    lowest = min(float(data[name].min()) for name in PRESSURES if name in data)
    assert lowest == P_VAPOUR
    assert float(data["void_max"]) > 1.0e-5
    assert "cavitation" in str(data["status"].values)
    assert float(data["cavitation_time"]) > 0.0


@each
def test_there_is_a_void_only_where_a_pressure_is_that_of_vapour(winch):
    data = run(winch)
    lowest = np.min([data[name].values for name in PRESSURES if name in data], axis=0)
    assert np.all(lowest[data["V_void"].values > 0.0] == P_VAPOUR)
    assert np.all(data["V_void"].values >= 0.0)


@each
def test_the_energy_of_voids_is_found_again(winch):
    result = run_one(crane_of(winch), scenario(winch), n_sub=steps(winch), every=0)
    assert result.stats.extremes.void_max > 1.0e-5
    assert abs(result.energy_unaccounted) < AUDIT


@pytest.mark.parametrize("winch", ["pure-active", "active-passive"])
def test_oil_that_leaves_both_lines_is_their_fall_in_pressure_and_their_void(winch):
    data = run(winch)
    A = pack(crane_of(winch), scenario(winch)).params.active
    D = A.motors.count * A.motors.D_max
    names = ("alpha_p", "alpha_m", "omega_m", "p_a", "p_b", "f_pump")
    rows = zip(*(data[n].values.tolist() for n in names), strict=True)
    flows = [active_flows(a_p, D * a_m, w, p_a, p_b, f, A) for a_p, a_m, w, p_a, p_b, f in rows]
    into = np.array([f.Q_a + f.Q_b for f in flows])
    moved = sum(abs(f.Q_p) for f in flows) * 0.01
    held = ((data["p_a"] + data["p_b"]) / A.i_C_h - data["V_void"]).values
    assert float(data["V_void"].max()) > 1.0e-4
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (into[1:] + into[:-1]) * 0.01)])
    assert np.max(np.abs(summed - (held - held[0]))) < OIL * moved


@each
def test_sixteen_runs_side_by_side_are_the_single_ones_to_the_bit(winch):
    cases = [scenario(winch, s_w=f"{30 + 10 * i} m", duration="20 s") for i in range(4)]
    side_by_side = run_many(crane_of(winch), cases, n_sub=steps(winch))
    for case, result in zip(cases, side_by_side, strict=True):
        assert result.stats == run_one(crane_of(winch), case, n_sub=steps(winch), every=0).stats
    assert max(r.stats.extremes.void_max for r in side_by_side) > 0.0


@each
def test_halving_the_step_changes_nothing_that_matters(winch):
    coarse, fine = (run_one(crane_of(winch), scenario(winch), n_sub=k * steps(winch), every=0) for k in (1, 2))
    assert coarse.span[0] == pytest.approx(fine.span[0], rel=HALVED)
    assert coarse.stats.extremes.void_max == pytest.approx(fine.stats.extremes.void_max, rel=10.0 * HALVED)


@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    winch=st.sampled_from(sorted(CASES)),
    share=st.floats(0.1, 0.95),
    height=st.floats(0.5, 3.0),
    period=st.floats(4.0, 12.0),
    s_w=st.floats(20.0, 300.0),
)
def test_no_start_pulls_oil_or_loses_energy(winch, share, height, period, s_w):
    crane = crane_of(winch)
    load = share * crane.SWL
    case = scenario(
        winch, load=f"{load!r} kg", tip=f"sine {height!r} m {period!r} s", s_w=f"{s_w!r} m", duration="15 s"
    )
    data = simulate(crane, case, every="10 ms", threads=1)
    assert min(float(data[name].min()) for name in PRESSURES if name in data) >= P_VAPOUR
    assert abs(float(data["energy_unaccounted"])) < AUDIT or "slack" in str(data["status"].values)


class TestWarmUp:
    """What a run goes beyond before it counts is reported."""

    def summary(self, winch="active-passive", **more):
        case = scenario(winch, warm_up="15 s", **more)
        return run_one(crane_of(winch), case, n_sub=steps(winch), every=0).summary

    def test_cavitation_of_a_sudden_start_is_named_with_its_time_and_void(self):
        summary = self.summary()
        assert summary["status"] == "ok"
        assert summary["void_max"] == 0.0
        (note,) = (n for n in summary["notes"] if n.startswith("during the warm-up"))
        data = simulate(crane_of("active-passive"), scenario("active-passive", warm_up="15 s"), every="10 ms")
        low = np.minimum(data["p_a"].values, data["p_b"].values) <= 0.0
        assert (
            f"cavitation for {0.01 * low.sum():.3g} s, vapour up to {1e3 * data['V_void'].values.max():.3g} L" in note
        )
        assert "relief for " in note

    def test_a_gentle_start_has_none(self):
        notes = self.summary(ramp="10 s")["notes"]
        assert not [n for n in notes if n.startswith("during the warm-up")]

    def test_the_counted_numbers_are_those_of_one_piece(self):
        summary = self.summary()
        data = simulate(crane_of("active-passive"), scenario("active-passive", warm_up="15 s"), every="10 ms")
        counted = data["e_c"].values[data["time"].values >= 15.0 - 1e-9]
        assert max(abs(counted.min()), abs(counted.max())) == pytest.approx(summary["e_c_max"], rel=1e-12)
