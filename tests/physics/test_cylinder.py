"""The compensating cylinder: closed forms against the running twin, and an ideal compensator beside it."""

import math

import numpy as np
import pytest
from tests.physics.slopes import jacobian

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack, wire_speed_max
from stillhook.errors import ScenarioError, SpecError
from stillhook.library.crane_file import changed
from stillhook.physics.hydraulics import cylinder as phys
from stillhook.physics.scalar import G
from stillhook.spec.scenario import Operator
from stillhook.winches.load_path.load import Point
from stillhook.winches.types import cylinder as winch

CRANE = load_crane("nov-100t-cylinder")
TABLE = CRANE.cylinder
CASE = {"load": "50 t", "s_w": "100 m", "tip": "sine 1 m 10 s", "duration": "60 s", "warm_up": "20 s"}
FREQUENCY = 1.0e-3
"""The gas adds a thousandth to the oil's stiffness, which is half of that in the frequency."""
FULL = 3.0e-3
"""Of the speed: what boost and flushing valves add and take meanwhile, and the oil that the gas compresses."""
LIMIT = 1.0e-2
"""Of the speed: the limit is that of mid stroke and of a load that does not swing."""
LOSSLESS = {
    "pump": {"C_leak": "0 L/min/bar"},
    "friction": {"F_c": "1e-3 N", "mu": 0.0, "b": "0 N s/m", "sigma_1_ratio": 0.0},
    "passive": {"accumulator": {"R_piston": "0 bar/(L/min)"}},
}
HARMONIC = 0.05
"""Of what is left over: the pumps' lag, and higher harmonics that harmonic balance leaves out."""
FOLLOWS = 0.02
"""Of the tip's motion, peak to peak: what friction, oil and pumps keep of it beside a compensator without internals."""


def with_cylinder(**changes):
    return changed(CRANE, {"cylinder": changes})


def series(crane=CRANE, every="10 ms", **case):
    return simulate(crane, Scenario(**(CASE | {"mode": "position"} | case)), every=every)


def rod_jacobian(x_rod: float) -> np.ndarray:
    """d(p_a', p_b', x', v')/d(p_a, p_b, x, v) of the twin's own rates, without leak, valves and friction."""
    crane = with_cylinder(**LOSSLESS)
    p = pack(crane, Scenario(**CASE, mode="position")).params
    geo = winch.geometry(100.0, p)
    q = Point(0.0, p.hoist.load.W, 0.0, 1.0, 0.0, 0.0)
    u = winch.Command(0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    p_0 = 0.5 * (TABLE.boost.p + p.cylinder.flushing.p)  # between boost and flushing valves: both shut
    x_0 = winch.start(100.0, None, p)._replace(p_a=p_0, p_b=p_0, x_rod=x_rod)
    steps = {"p_a": 1e3, "p_b": 1e3, "x_rod": 1e-4, "v_rod": 1e-5}
    return jacobian(lambda x: winch.rates(winch.circuit(x, q, u, geo, p), x, q, u, geo, p), x_0, steps)


def test_the_rod_rings_on_its_oil_at_the_textbook_frequency():
    """sqrt(4 beta A^2 / (V_t m)) at mid stroke, V_t oil of both sides (Merritt)."""
    V_t = 2.0 * TABLE.line.V + TABLE.A_a * TABLE.x_max
    expected = math.sqrt(4.0 * TABLE.line.bulk_modulus * TABLE.A_a**2 / (V_t * TABLE.m))
    rings = np.abs(np.linalg.eigvals(rod_jacobian(0.5 * TABLE.x_max)).imag).max()
    assert rings == pytest.approx(expected, rel=FREQUENCY)


def test_mid_stroke_is_where_the_oil_is_softest():
    mid, out = (np.abs(np.linalg.eigvals(rod_jacobian(x)).imag).max() for x in (1.5, 2.5))
    assert mid < out


def test_full_command_gives_flow_over_area_times_falls():
    """Pumps full and the rod on its way, a light load that hardly swings: falls times Q / A."""
    crane = with_cylinder(pump={"C_leak": "0 L/min/bar"})
    run = series(crane, tip="sine 3 m 12 s", load="5 t")
    full = np.abs(run.alpha_p.values) == 1.0
    steady = full & np.roll(full, 50) & (np.abs(run.x_rod.values - 1.5) < 1.3)
    expected = TABLE.falls * sum(TABLE.pump.D) * TABLE.pump.omega_p / TABLE.A_a
    assert steady.sum() > 1000
    assert np.abs(run.v_w.values[steady]).mean() == pytest.approx(expected, rel=FULL)
    assert wire_speed_max(crane) == pytest.approx(expected, rel=1e-12)
    assert wire_speed_max(crane, d=2.5) == wire_speed_max(crane)  # the layer has no say


def test_wire_moved_is_falls_times_stroke_and_ends_at_the_stops():
    run = series(tip="sine 4.5 m 40 s", duration="120 s")
    x, s_w = run.x_rod.values, run.s_w.values
    np.testing.assert_allclose(s_w - s_w[0], TABLE.falls * (x[0] - x), atol=1e-6)
    pushed = TABLE.A_a * float(run.p_a.max()) + TABLE.passive.A * float(run.p_hp.max())
    give = 2.0 * pushed / TABLE.stops.k  # a sudden load on a spring: at most twice what it stands on
    assert x.max() == pytest.approx(TABLE.x_max, abs=give)
    assert x.min() == pytest.approx(0.0, abs=give)
    assert np.ptp(s_w) == pytest.approx(TABLE.falls * TABLE.x_max, abs=2.0 * TABLE.falls * give)
    assert "cylinder stroke" in run.status.item()


def first_harmonic(t, y, period):
    n = int(period / (t[1] - t[0]) + 0.5)
    last = slice(len(t) - 3 * n, len(t))
    return 2.0 * np.mean(y[last] * np.exp(-2j * math.pi * t[last] / period))


@pytest.mark.parametrize("r", [0.5, 0.7, 0.9])
def test_beyond_full_speed_the_first_harmonic_is_that_of_a_clipped_sine(r):
    """Feedforward alone clips the speed: (2/pi)(asin r + r sqrt(1 - r^2)) of the tip's, r full speed over the tip's."""
    period, v = 8.0, wire_speed_max(CRANE)
    height = v / r * period / (2.0 * math.pi)
    crane = changed(CRANE, {"control": {"K_p": "0 1/m"}, "cylinder": LOSSLESS})
    run = series(crane, tip=f"sine {height!r} m {period} s", duration="40 s", warm_up="10 s")
    t = run.time.values
    ratio = abs(first_harmonic(t, run.v_w.values, period) / first_harmonic(t, run.v_tip.values, period))
    assert ratio == pytest.approx(2.0 / math.pi * (math.asin(r) + r * math.sqrt(1.0 - r * r)), rel=0.01)
    assert "pump flow" in run.status.item()


def saturated_loop(r, K, omega):
    """Wire over tip by harmonic balance [-]: y' = N u with u = v_tip + K e, cut as a clipped sine of its amplitude."""
    s, U, N = 1j * omega, 1.0 / r, 1.0
    for _ in range(200):
        rho = min(1.0 / U, 1.0)
        N = 2.0 / math.pi * (math.asin(rho) + rho * math.sqrt(1.0 - rho * rho))
        U = abs((s + K) / (s + K * N)) / r
    return N * (s + K) / (s + K * N)


@pytest.mark.parametrize("K_p", [0.1, 0.4])
@pytest.mark.parametrize("r", [0.2, 0.6])
def test_beyond_full_speed_the_position_loop_is_late_as_a_saturated_follower(r, K_p):
    """It tries to catch up, so the rod turns round late: a clipped sine alone leaves less over than the twin."""
    period, v = 8.0, wire_speed_max(CRANE)
    omega = 2.0 * math.pi / period
    crane = changed(CRANE, {"control": {"K_p": f"{K_p} 1/m"}, "cylinder": LOSSLESS})
    run = series(crane, tip=f"sine {v / r / omega!r} m {period} s", load="5 t", duration="120 s", warm_up="40 s")
    t = run.time.values
    ours = -first_harmonic(t, run.v_w.values, period) / first_harmonic(t, run.v_tip.values, period)
    assert abs(ours - saturated_loop(r, K_p * v, omega)) < HARMONIC * abs(1.0 - ours)
    if K_p == CRANE.control.K_p:
        assert abs(1.0 - saturated_loop(r, 0.0, omega)) < 0.98 * abs(1.0 - ours)


def ideal_compensator(t, s_tip, v_tip, v_max, length, k):
    """Wire taken in by a position-controlled cylinder with limited speed and stroke and no internals [m], as SIMO's
    heave compensator is: explicit steps of the series."""
    y = np.zeros(len(t))
    for i in range(len(t) - 1):
        v = min(max(-v_tip[i] - k * (s_tip[i] - s_tip[0] + y[i]), -v_max), v_max)
        y[i + 1] = min(max(y[i] + v * (t[i + 1] - t[i]), -0.5 * length), 0.5 * length)
    return y


@pytest.mark.parametrize("tip", ["sine 1 m 10 s", "sine 2 m 9 s", "sine 4 m 40 s"], ids=["within", "speed", "stroke"])
def test_an_ideal_compensator_moves_the_wire_alike(tip):
    """Peer without oil: same law, limited speed and stroke. The twin differs by what its internals keep."""
    run = series(tip=tip, duration="80 s")
    t, s_tip, v_tip = (run[name].values for name in ("time", "s_tip", "v_tip"))
    v_max = wire_speed_max(CRANE)
    ideal = ideal_compensator(t, s_tip, v_tip, v_max, TABLE.falls * TABLE.x_max, CRANE.control.K_p * v_max)
    taken_in = run.s_w.values[0] - run.s_w.values
    assert np.abs(taken_in - ideal).max() < FOLLOWS * np.ptp(s_tip)


HOISTING = Operator(profile=(("0 s", "0 m/min"), ("10 s", "20 m/min"), ("50 s", "20 m/min"), ("55 s", "0 m/min")))


def test_in_manual_mode_the_drum_hoists_and_the_rod_stands_locked():
    run = series(mode="manual", operator=HOISTING, tip="still", s_w="200 m", duration="80 s", warm_up="0 s")
    wound = 20.0 / 60.0 * (5.0 + 40.0 + 2.5)
    assert float(run.s_w[0] - run.s_w[-1]) == pytest.approx(wound, abs=0.02)
    assert np.ptp(run.x_rod.values) < 2e-3
    assert float(run.v_drum.max()) == pytest.approx(20.0 / 60.0, rel=1e-3)


def test_while_compensating_the_drum_moves_for_the_operator_alone():
    still, hoisted = series(), series(operator=HOISTING, duration="80 s", s_w="200 m")
    assert np.all(still.v_drum.values == 0.0)
    assert abs(float(hoisted.e_c.values[-1000:].mean())) < 0.02
    assert np.ptp(hoisted.x_rod.values) < 1.3  # 2 m of wave on two falls, and what the winch lags


def test_what_the_gas_does_not_carry_is_on_line_a():
    """At rest p_a A - p_b A + p_o A_p = falls W, by hand."""
    tight = with_cylinder(passive={"accumulator": {"C_leak": "0 L/min/bar"}})
    run = series(tight, tip="still", load="100 t", duration="30 s", warm_up="0 s")
    W = (100e3 + CRANE.hook_mass) * G
    p_a, p_b, p_hp = (float(run[name][0]) for name in ("p_a", "p_b", "p_hp"))
    assert p_a * TABLE.A_a - p_b * TABLE.A_b + p_hp * TABLE.passive.A == pytest.approx(TABLE.falls * W, rel=1e-9)


def test_a_drum_without_a_brake_is_refused():
    fields = CRANE.model_copy(update={"brake": None})
    with pytest.raises((SpecError, ScenarioError), match=r"Add a table \[brake\]"):
        simulate(fields, Scenario(**CASE, mode="position"))


def test_the_speed_limit_is_the_flow_until_the_circuit_cannot_carry_the_load():
    p = pack(CRANE, Scenario(**CASE, mode="position")).params
    geo, W = winch.geometry(100.0, p), p.hoist.load.W
    for lowering in (False, True):
        v, cause = winch.speed_limit(p, geo, W, lowering=lowering)
        assert cause == "pump flow"
        assert 0.99 * wire_speed_max(CRANE) < v * geo.r_eff < wire_speed_max(CRANE)
    assert winch.speed_limit(p, geo, 2.0 * W) == (0.0, "relief")  # the gas is set to the load


def test_the_twin_reaches_the_speed_limit_of_hoisting():
    run = series(tip="sine 3 m 12 s", load="22 t")
    full = run.alpha_p.values == 1.0
    steady = full & np.roll(full, 50) & (np.abs(run.x_rod.values - 1.5) < 1.3)
    p = pack(CRANE, Scenario(**(CASE | {"load": "22 t"}), mode="position")).params
    v, _ = winch.speed_limit(p, winch.geometry(100.0, p), p.hoist.load.W)
    assert run.v_w.values[steady].mean() == pytest.approx(v * TABLE.falls, rel=LIMIT)


@pytest.mark.parametrize("v", [-0.3, 0.0, 0.3])
def test_cushions_never_push_the_rod_and_stops_never_pull_it(v):
    ends = phys.Ends(x_max=3.0, x_c=0.05, i_x_c=20.0, c=3e6, k=2e9)
    for x in np.linspace(-0.001, 3.001, 301):
        assert phys.cushion_force(x, v, ends) * v <= 0.0
        assert phys.stop_force(x, ends) * (x - 1.5) <= 0.0
    assert phys.cushion_force(0.02, 0.3, ends) == 0.0  # out of the end it moves freely


@pytest.mark.parametrize("depth", [0.0, 0.25, 0.5, 1.0, 1.5])
def test_a_cushion_damps_in_proportion_to_its_depth_and_fully_where_the_rod_meets_the_stop(depth):
    """Depth over the cushion's length, at either end alike; beyond the stop it stays what it was there."""
    ends = phys.Ends(x_max=3.0, x_c=0.05, i_x_c=20.0, c=3e6, k=2e9)
    x, v = ends.x_c * (1.0 - depth), 0.2
    full = ends.c * v
    assert phys.cushion_force(x, -v, ends) == pytest.approx(min(depth, 1.0) * full, abs=1e-6 * full)
    assert phys.cushion_force(ends.x_max - x, v, ends) == pytest.approx(-min(depth, 1.0) * full, abs=1e-6 * full)
