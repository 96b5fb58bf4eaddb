"""The engine: converges, gives the same bits in a batch as alone, and marks what fails without spoiling the rest."""

import functools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from tests.engine.runs import run_many, run_one

from stillhook import Scenario, load_crane, simulate
from stillhook.engine import inputs as drive_module
from stillhook.engine.arguments import check_step, fastest_rates
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import pack
from stillhook.engine.runner import Ending
from stillhook.engine.scenario import run as case_module
from stillhook.engine.scenario.run import Ready, ScenarioBlock, first_lane
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.errors import SimulationError, SpecError
from stillhook.kernels.build import driver, interpreted
from stillhook.kernels.lanes import VL, flatten, size, unflatten
from stillhook.kernels.statistics import SIGNALS, blank_window, window_add, window_turn
from stillhook.library import changed
from stillhook.physics.friction import bristle_rate
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, PowerLoss, Sensors, Water
from stillhook.winches.records import Tick, Tip

CRANES = {"active-passive": load_crane("nov-250t"), "pure-active": load_crane("nov-100t-pure-active")}
LOADS = {"active-passive": "80 t", "pure-active": "40 t"}
SEA = "sine 1.5 m 12 s"
SECOND_ORDER = 1.9
"""Observed order from which a method counts as second order: a slope over halved steps carries the next term."""
WIRE_5_MS, PRESSURE_5_MS = 1.0e-4, 0.2e5
"""What the engine states for its coarsest default step of 5 ms: 0.1 mm of wire, 0.2 bar."""
INTERPRETED = 1.0e-9
"""Relative: the compiled exponential is a polynomial with fused operations, good to 1e-14 a call, over some thousand calls."""
STATISTICS = 1.0e-12
"""Relative: sums of some thousand numbers in another order."""

plants = pytest.mark.parametrize("plant", sorted(CRANES))


def scenario(plant: str, **case) -> Scenario:
    return Scenario(
        **({"load": LOADS[plant], "s_w": "200 m", "tip": SEA, "duration": "60 s", "warm_up": "20 s"} | case)
    )


def mixed(plant: str) -> list[Scenario]:
    """Cases of every kind: more than one block, thin and full drives, every mode."""
    out = [
        scenario(plant, mode=m, tip=f"sine {a} m 10 s")
        for m in ("ns", "hs", "ssc", "ssc-cubic", "manual")
        for a in (0.5, 1.0, 1.5)
    ]
    out += [scenario(plant, load=f"{m} t", s_w=f"{100 * m} m") for m in range(0, 20, 2)]
    out += [
        scenario(plant, friction="regularised"),
        scenario(plant, water=Water(volume="3 m^3", C_D=1.0, area="9 m^2")),
    ]
    out += [scenario(plant, sensors=Sensors(delay="0.1 s", noise_s_w="1 mm", seed=s)) for s in range(3)]
    out += [scenario(plant, modes=(("30 s", "ns"),)), scenario(plant, power_loss=PowerLoss(time="30 s"))]
    out += [scenario(plant, operator=Operator(profile=(("25 s", "0 m/min"), ("30 s", "9 m/min"), ("40 s", "0 m/min"))))]
    held = Operator(profile=(("25 s", "0 m/min"), ("30 s", "9 m/min")), alpha_m=0.7)
    out += [
        scenario(plant, mode="manual", operator=held),
        scenario(plant, mode="manual", modes=(("40 s", "ssc"),), operator=held),
    ]
    return out


# Convergence


def hoisting(n_sub: int):
    stick = Operator(profile=(("0 s", "0 m/min"), ("10 s", "30 m/min"), ("15 s", "30 m/min"), ("20 s", "20 m/min")))
    case = Scenario(
        load="80 t", s_w="200 m", tip="still", mode="manual", duration="20 s", warm_up="1 s", operator=stick
    )
    smooth = CRANES["active-passive"].model_copy(update={"brake": None})  # a brake that lets go is none
    return run_one(smooth, case, n_sub=n_sub, every=0).state


@pytest.mark.slow
def test_halving_the_step_quarters_the_error_where_the_motion_is_smooth():
    """Runge-Kutta with the bristle split off symmetrically: second order, from steps that resolve the wire's hardly damped swing."""
    fine = hoisting(512)
    errors = {n: hoisting(n) for n in (8, 16, 32)}
    for name in ("s_w", "omega_m", "p_a", "v_load"):
        e = [abs(field(errors[n], name) - field(fine, name)) for n in (8, 16, 32)]
        orders = np.log2(np.array(e[:-1]) / np.array(e[1:]))
        assert np.all(orders > SECOND_ORDER), (name, orders)


@pytest.mark.slow
@plants
@pytest.mark.parametrize("mode", ["hs", "ssc"])
def test_default_steps_are_within_what_they_state_through_stick_and_reversal(plant, mode):
    case = scenario(plant, mode=mode)
    fine = run_one(CRANES[plant], case, n_sub=50, every=1)
    for n_sub in (2, 5):
        here = run_one(CRANES[plant], case, n_sub=n_sub, every=1)
        assert np.abs(here.column("s_w") - fine.column("s_w")).max() < WIRE_5_MS
        assert abs(here.stats.extremes.p_a_max - fine.stats.extremes.p_a_max) < PRESSURE_5_MS


def test_stored_rows_do_not_change_with_how_often_they_are_stored():
    one, ten = (run_one(CRANES["active-passive"], scenario("active-passive"), n_sub=2, every=n) for n in (1, 10))
    assert np.array_equal(one.series[::10], ten.series)
    assert one.stats == ten.stats


@pytest.mark.thorough
@plants
def test_the_engine_solves_the_same_equations_as_a_stiff_solver_of_a_library(plant):
    """From rest through break-away and reversal: plant, friction and PLC of the run, stepped by scipy with the bristle as a state."""
    crane, case = (
        CRANES[plant],
        scenario(plant, tip="sine 0.4 m 5 s -90 deg", ramp="0 s", duration="4 s", warm_up="1 s", mode="ns"),
    )
    ours = run_one(crane, case, n_sub=20, every=1)
    theirs = library_solution(crane, case, 400)
    for name, tolerance in (("s_w", 2e-5), ("omega_m", 2e-3), ("p_a", 0.02e5), ("p_b", 0.02e5), ("s_load", 2e-5)):
        mine = ours.column(name)
        assert np.ptp(mine) > 100.0 * tolerance
        assert np.max(np.abs(mine - [field(x, name) for x in theirs])) < tolerance, name


def library_solution(crane: Crane, case: Scenario, cycles: int) -> list:
    """States at the start of every PLC cycle, between them by LSODA, under the commands that were calculated in the cycle before."""
    assert crane.control.computing == crane.control.t_cycle
    packed, drive = pack(crane, case), CycleInputs(crane, case)
    plant, p, d = packed.plant, packed.params, driver(packed.name, 1)
    rows = drive.rows(0, cycles + 1)
    ticks = [Tick(*drive.first_row())._replace(s=s, v=v, a=a, s_m=s, v_m=v, a_m=a) for s, v, a in rows]
    lane = np.array(flatten(first_lane(d, packed, ticks[0])))
    d.at_rest(lane)
    rest = unflatten(d.Lane, iter(lane.tolist()))
    x, m, u, laws = rest.x, rest.m, rest.u, rest.laws
    out = [x]
    for k in range(cycles):
        geo = plant.geometry(x.path.s_w, p)
        in_force = u
        u, m, laws, _ = d.control(x, m, laws, ticks[k], Tip(ticks[k].s, ticks[k].v), geo, p)

        def slope(t, y, u=in_force, geo=geo):
            here = unflatten(d.State, iter(y.tolist()))
            s, v, _ = drive.motion.sample(np.array([t]))
            tip, w = Tip(float(s[0]), float(v[0])), here.winch
            c = plant.circuit(w, d.path_point(here, geo, tip, p), u, geo, p)
            z = bristle_rate(w.omega_m, w.z, c.g, c.held, p.hoist.bristle)
            rates = d.rates(here, u, geo, tip, p)
            return flatten(rates._replace(winch=rates.winch._replace(z=z)))

        t = k * drive.t_cycle
        solved = solve_ivp(slope, (t, t + drive.t_cycle), flatten(x), method="LSODA", rtol=1e-8, atol=1e-9)
        x = unflatten(d.State, iter(solved.y[:, -1].tolist()))
        out.append(x)
    return out


def field(x: Any, name: str) -> float:
    """A state of the winch or of its load path."""
    return float(getattr(x.path if name in x.path._fields else x.winch, name))


# The same bits, however a case is run


def same(a: ScenarioRun, b: ScenarioRun) -> bool:
    return flatten(a.stats) == flatten(b.stats) and a.state == b.state and a.memory == b.memory and a.span == b.span


@pytest.mark.slow
@plants
def test_a_case_in_a_batch_equals_the_same_case_alone_bit_for_bit(plant):
    cases = mixed(plant)
    together = run_many(CRANES[plant], cases, n_sub=2)
    assert len(cases) > 2 * VL
    for i in range(0, len(cases), 3):
        alone = run_one(CRANES[plant], cases[i], n_sub=2, every=0)
        assert same(alone, together[i]), cases[i]


@plants
def test_a_run_that_is_stopped_and_taken_up_again_equals_one_that_was_not(plant, monkeypatch):
    """The engine hands its state from piece to piece: many pieces are many restarts."""
    case = scenario(plant, modes=(("31 s", "ns"),))
    whole = run_one(CRANES[plant], case, n_sub=2)
    monkeypatch.setattr(drive_module, "CHUNK", 137)
    pieces = run_one(CRANES[plant], case, n_sub=2)
    assert same(whole, pieces)
    assert np.array_equal(whole.series, pieces.series)


@pytest.mark.skipif(interpreted(), reason="NUMBA_DISABLE_JIT: everything is interpreted")
@plants
@pytest.mark.parametrize("friction", ["lugre", "regularised"])
def test_compiled_physics_is_the_physics_that_python_runs(plant, friction):
    case = scenario(plant, duration="0.6 s", warm_up="0.1 s", ramp="0.2 s", mode="ssc", friction=friction)
    compiled, interpreted = (_short(CRANES[plant], case, python=p) for p in (False, True))
    scale = np.max(np.abs(interpreted), axis=0) + 1e-6
    assert np.max(np.abs(compiled - interpreted) / scale) < INTERPRETED
    p_a = driver(plant, 1).Signals._fields.index("p_a")
    assert np.ptp(interpreted[:, p_a]) > 1e5  # something happened


def _short(crane: Crane, case: Scenario, *, python: bool) -> np.ndarray:
    """Series of a run through the compiled driver, or through the same source as plain Python."""
    block = ScenarioBlock([Ready.of(crane, case)], lanes=1, n_sub=2, every=1)
    if python:
        block.d = replace(block.d, run=block.d.run.py_func)
    for _ in block.steps():
        pass
    series = block.results()[0].series
    assert series is not None
    return series


def test_records_survive_the_flat_array():
    p = pack(CRANES["active-passive"], scenario("active-passive")).params
    flat = flatten(p)
    assert len(flat) == size(type(p))
    assert unflatten(type(p), iter(flat)) == p


# Failures


PARACHUTE = {"load": "1 t", "water": Water(volume="0.05 m^3", C_D=10.0, area="100000 m^2")}
"""A drag so large that explicit steps of milliseconds cannot follow it. The step's check is left out here, whatever it knows."""


@pytest.fixture
def unchecked(monkeypatch):
    monkeypatch.setattr(case_module, "check_step", lambda packed, step: None)


@pytest.mark.slow
@pytest.mark.usefixtures("unchecked")
def test_a_case_that_loses_its_numbers_is_marked_and_spoils_no_other():
    crane = CRANES["active-passive"]
    good, bad = scenario("active-passive"), scenario("active-passive", **PARACHUTE)
    data = simulate(crane, [good, bad, good], on_failure="mark")
    assert data.status.values.tolist() == ["ok", "diverged", "ok"]
    assert math.isnan(float(data.e_c_pp[1]))
    assert math.isnan(float(data.energy_unaccounted[1]))
    alone = simulate(crane, good, series=False)
    for name in ("e_c_pp", "p_max", "energy_through"):
        assert data[name].values[0] == data[name].values[2] == alone[name].item()


@pytest.mark.usefixtures("unchecked")
def test_a_failure_in_a_batch_stops_it_with_the_case_and_the_way_out():
    cases = [scenario("active-passive"), scenario("active-passive", **PARACHUTE)]
    with pytest.raises(SimulationError) as e:
        simulate(CRANES["active-passive"], cases)
    text = str(e.value)
    assert text.startswith("1 of 2 cases failed. First: case 1 ")
    assert text.endswith('or keep the rest with on_failure="mark".')
    assert "\n" not in text


@pytest.mark.usefixtures("unchecked")
def test_a_single_run_that_fails_raises_too():
    with pytest.raises(SimulationError, match=r"^1 of 1 cases failed\. First: case 0 "):
        simulate(CRANES["active-passive"], scenario("active-passive", **PARACHUTE))


@pytest.mark.usefixtures("unchecked")
def test_when_every_case_fails_the_batch_still_ends():
    results = run_many(CRANES["active-passive"], [scenario("active-passive", **PARACHUTE)] * 3, n_sub=2)
    assert {r.ending for r in results} == {Ending.DIVERGED}
    assert all(r.t_end <= 60.0 for r in results)


def test_a_step_that_the_crane_is_too_stiff_for_is_refused_before_anything_runs():
    stiff = changed(CRANES["active-passive"], {"wire": {"L_0": "1 m"}})
    with pytest.raises(SpecError) as e:
        simulate(stiff, Scenario(load="0 t", s_w="0 m", tip=SEA), step="5 ms")
    text = str(e.value)
    assert text.startswith("step 5 ms is too long for this crane: wire with its damping has ")
    assert "(allowed 2.6). Use a step of " in text


@pytest.mark.parametrize("name", ["nov-250t", "nov-150t", "nov-100t-pure-active"])
def test_library_cranes_take_both_default_steps_with_an_empty_hook_at_the_tip(name):
    packed = pack(load_crane(name), Scenario(load="0 t", s_w="0 m"))
    check_step(packed, 5e-3)
    assert all(math.isfinite(r) and r >= 0.0 for r in fastest_rates(packed).values())


# Statistics


@functools.cache
def counted_run(plant: str):
    """A run with every cycle stored, and the part of it that counts."""
    result = run_one(CRANES[plant], scenario(plant, duration="100 s", sensors=Sensors(delay="0.1 s")), n_sub=2, every=1)
    assert result.series is not None
    return result, {n: result.column(n)[2000:] for n in result.signals}, result.series


@pytest.mark.slow
@plants
def test_statistics_are_those_of_the_stored_series_after_the_warm_up(plant):
    result, y, _ = counted_run(plant)
    st_, own = result.stats.common, result.stats.extremes
    assert st_.cycles == len(y["e_c"]) == 8001
    assert (st_.e_min, st_.e_max) == (y["e_c"].min(), y["e_c"].max())
    assert (st_.em_min, st_.em_max) == (y["e_c_measured"].min(), y["e_c_measured"].max())
    assert (st_.tip_min, st_.tip_max) == (y["s_tip"].min(), y["s_tip"].max())
    assert (own.p_a_max, own.p_b_max, own.p_min) == (
        y["p_a"].max(),
        y["p_b"].max(),
        min(y["p_a"].min(), y["p_b"].min()),
    )
    assert (st_.F_min, st_.F_max) == (y["F_w"].min(), y["F_w"].max())
    assert (own.alpha_p_max, own.alpha_m_min) == (np.abs(y["alpha_p"]).max(), y["alpha_m"].min())
    assert (st_.u_p_max, st_.u_raw_max) == (np.abs(y["u_p"]).max(), np.abs(y["u_raw"]).max())
    assert (own.omega_m_max, st_.v_w_max, st_.v_tip_max) == tuple(
        np.abs(y[n]).max() for n in ("omega_m", "v_w", "v_tip")
    )
    for name, series in (
        ("e_sum", y["e_c"]),
        ("e2_sum", y["e_c"] ** 2),
        ("tip_sum", y["s_tip"]),
        ("tip2_sum", y["s_tip"] ** 2),
    ):
        trapezoids = float(np.sum(0.5 * (series[1:] + series[:-1])))
        assert getattr(st_, name) == pytest.approx(
            trapezoids, rel=STATISTICS, abs=STATISTICS * float(np.sum(np.abs(series)))
        )


@plants
def test_counted_times_are_those_of_the_stored_series(plant):
    crane = CRANES[plant]
    result = run_one(crane, scenario(plant, tip="sine 3.5 m 9 s", mode="ns", load="10 t"), n_sub=5, every=1)
    assert result.series is not None
    y = {n: result.column(n)[2000:] for n in result.signals}
    assert result.stats.common.saturation_cycles == np.count_nonzero(np.abs(y["u_raw"]) > 1.0) > 0
    assert result.stats.limits.relief == np.count_nonzero(y["Q_relief"] > 0.0)
    assert result.stats.common.slack_cycles == np.count_nonzero(y["F_w"] <= 0.0)


@plants
def test_peak_to_peak_over_the_window_is_that_of_every_window(plant):
    result, y, _ = counted_run(plant)
    n = round(30.0 / 0.01) + 1
    assert result.full_window
    for value, name in zip(result.span, ("e_c", "e_c_measured", "s_tip"), strict=True):
        views = np.lib.stride_tricks.sliding_window_view(y[name], n)
        assert value == np.max(views.max(axis=1) - views.min(axis=1))


def test_a_run_shorter_than_the_window_reports_what_it_saw():
    result = run_one(CRANES["active-passive"], scenario("active-passive", duration="30 s"), n_sub=2, every=1)
    e_c = result.column("e_c")[2000:]
    assert not result.full_window
    assert result.span[0] == np.ptp(e_c)


def test_the_warm_up_does_not_count():
    """A pure active winch sags when it takes the load: that is over before the run counts."""
    short, long = (
        run_one(CRANES["pure-active"], scenario("pure-active", tip="still", warm_up=w), n_sub=2, every=1)
        for w in ("0 s", "20 s")
    )
    assert np.array_equal(short.series, long.series)
    assert short.stats.common.cycles == 6001
    assert long.stats.common.cycles == 4001
    assert short.span[0] > 10.0 * long.span[0]


@pytest.mark.slow
@given(st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=60), st.integers(1, 12))
@settings(max_examples=60)
def test_the_moving_window_is_exact_for_any_series_and_length(series, n):
    w = SIGNALS
    W = blank_window(n, 1)
    for k, y in enumerate(series):
        window_add(W, w, 0, k % n, n, 1.0 if k >= n - 1 else 0.0, y)
        for other in (1, 2):
            window_add(W, w, other, k % n, n, 0.0, 0.0)
        if k % n == n - 1:
            window_turn(W, w, n)
    windows = [series[i : i + n] for i in range(len(series) - n + 1)]
    assert W[2 * w] == max((max(x) - min(x) for x in windows), default=0.0)
