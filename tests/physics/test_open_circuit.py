"""The open-circuit winch: what its valves let through, closed forms of valve-controlled motors against runs, where its
energy goes, and its limits by name."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.engine.runs import run_one
from tests.physics.slopes import jacobian

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack
from stillhook.library import changed
from stillhook.physics.hydraulics.pump import load_pressure, pressure_wanted
from stillhook.physics.hydraulics.valves import (
    counterbalance_opening,
    in_series,
    make_up_flow,
    orifice_flow,
    share_of_drop,
    spool_for_opening,
    spool_opening,
)
from stillhook.physics.scalar import G
from stillhook.spec.scenario import Operator, PowerLoss
from stillhook.winches.load_path.load import shaft_inertia_without_wire
from stillhook.winches.types import open_circuit

NAME = "utility-20t-open-circuit"
BAR = 1.0e5
CLOSED = 5.0e-3
"""Closed forms are for sharp edges: with the laminar zone of the tests, 0.5 bar at drops of more than 5 bar, the flow
is less by 0.3 %."""
STEADY = 2.0e-3
"""Relative: what is left of the start's swing in the last seconds of a steady hoist or lowering."""
LIMIT = 0.02
"""Of the speed: the worked-out limit takes the pumps' droop in one step, and the run ends within its swing."""
AUDIT = 1.0e-4
"""Of the energy through pumps and counterbalance valve, as in the conservation tests; the specification asks for
1e-3."""
EIGEN = 1.0e-3
"""Relative: the slope of an edge with its laminar zone, which is taken over a step of 0.01 bar."""
CLOSE = {"share": 0.9}
"""A drive that follows the load closely, for what valve and pumps can do: the library's leaves more to its valve."""
SEA = {"s_w": "100 m", "tip": "sine 1 m 10 s", "mode": "position", "duration": "60 s", "warm_up": "20 s"}

pressure = st.floats(-20.0 * BAR, 400.0 * BAR)
opening = st.floats(-1.0, 1.0)


@cache
def crane() -> Any:
    return load_crane(NAME)


@cache
def A() -> Any:
    return pack(crane(), Scenario(load="10 t", s_w="100 m", mode="position")).params.A


def circuit_with(**tables: dict[str, object]) -> Any:
    """The library's winch with changes in tables of its open circuit."""
    return changed(crane(), {"open": tables})


MATCHED: dict[str, Any] = {
    "motor": {"C_1": "0 L/min/bar", "C_2": "0 L/min/bar/(rev/min)"},
    "valve": {"Q_N": "80 L/min", "dp_laminar": "0.5 bar"},
    "counterbalance": {"Q_N": "5000 L/min", "p_check": "0 bar"},
    "tank": {"p": "0 bar", "conductance": "0 L/min/bar"},
    "pump": {"p_standby": "200 bar", "p_max": "200 bar", "C_leak": "0 L/min/bar"},
}
"""Two equal edges between a constant supply and an empty tank line, and nothing else: what closed forms are for."""


@cache
def matched() -> Any:
    return circuit_with(**MATCHED)


def steadily(speed: str, load: str, winch: Any = None, step: str | None = None, **case: Any) -> Any:
    """The last second of a steady hoist (or lowering, below zero) over still water, mean of each signal."""
    operator = Operator(profile=(("0 s", "0 m/min"), ("3 s", speed), ("40 s", speed)))
    tip = {"s_w": "150 m", "tip": "still", "mode": "manual", "duration": "40 s", "warm_up": "0 s", "ramp": "0 s"}
    winch = winch or circuit_with(drive=CLOSE)
    run = simulate(winch, Scenario(load=load, operator=operator, **(tip | case)), every="10 ms", step=step)
    late = run.time > 39.0
    return run.where(late, drop=True).mean("time"), run


# Valves


@given(st.floats(0.0, 1.0e-5), pressure)
def test_an_edge_lets_oil_through_towards_the_lower_pressure_and_never_more_than_a_sharp_one(K, dp):
    Q = orifice_flow(K, dp, 6.0 * BAR)
    assert Q == -orifice_flow(K, -dp, 6.0 * BAR)
    assert Q * dp >= 0.0
    assert abs(Q) <= K * math.sqrt(abs(dp)) * (1.0 + 1e-12)


def test_an_edge_without_a_pressure_drop_has_a_finite_slope():
    slope = orifice_flow(1.0e-5, 1.0, BAR)
    assert slope == pytest.approx(orifice_flow(1.0e-5, 100.0, BAR) / 100.0, rel=1e-5)


@given(st.floats(1.0e-9, 1.0e-4), st.floats(1.0e-9, 1.0e-4), st.floats(BAR, 300.0 * BAR))
def test_two_edges_in_series_let_the_same_oil_through_at_their_shares_of_the_drop(K_1, K_2, dp):
    share = share_of_drop(K_1, K_2)
    first, second = (orifice_flow(K, part * dp, 0.0) for K, part in ((K_1, share), (K_2, 1.0 - share)))
    assert first == pytest.approx(orifice_flow(in_series(K_1, K_2), dp, 0.0), rel=1e-6)
    assert second == pytest.approx(first, rel=1e-3)


def test_a_closed_edge_lets_nothing_through_and_takes_the_whole_drop():
    assert in_series(0.0, 1.0e-5) == in_series(0.0, 0.0) == 0.0
    assert share_of_drop(0.0, 1.0e-5) == share_of_drop(0.0, 0.0) == 1.0


@given(opening)
def test_a_drive_that_knows_the_overlap_gets_the_opening_that_it_asks_for(wanted):
    edges, jump = A().edges, A().law.jump
    got = spool_opening(spool_for_opening(wanted, edges.deadband, jump), edges)
    assert got * wanted >= 0.0
    assert abs(got) <= abs(wanted) + 1e-12
    assert abs(wanted) <= jump or got == pytest.approx(wanted, abs=1e-12)


@given(st.floats(-1.0, 1.0))
def test_nothing_passes_a_spool_within_its_overlap(share):
    assert spool_opening(share * A().edges.deadband, A().edges) == 0.0


def test_the_counterbalance_valve_holds_the_swl_and_opens_wider_with_pilot_and_load():
    cb, p_swl = A().cb, 196.0 * BAR
    assert counterbalance_opening(p_swl, 0.0, cb) == 0.0
    pilots = [counterbalance_opening(p_swl, p * BAR, cb) for p in (20.0, 40.0, 60.0, 200.0)]
    assert 0.0 < pilots[0] < pilots[1] < pilots[2] < pilots[3] == 1.0
    assert counterbalance_opening(0.5 * p_swl, 40.0 * BAR, cb) < pilots[1]


@given(pressure)
def test_make_up_valves_only_feed(p):
    tank = A().tank
    assert (make_up_flow(p, tank) > 0.0) == (p < tank.p_T - tank.p_make_up)


@given(opening, st.floats(0.0, 300.0 * BAR), st.floats(0.0, 300.0 * BAR))
def test_the_pumps_are_asked_for_the_load_and_a_margin_between_standby_and_their_largest_pressure(x, p_a, p_b):
    pump = A().pump
    p_load = load_pressure(x, p_a, p_b)
    assert 0.0 <= p_load <= max(p_a, p_b)
    assert pump.p_standby <= pressure_wanted(p_load, pump) <= pump.p_max
    assert load_pressure(0.0, p_a, p_b) == 0.0


# Closed forms


@pytest.mark.parametrize("load", ["5 t", "10 t", "15 t"])
def test_a_matched_symmetric_valve_turns_the_motors_as_merritt_says(load):
    """omega = K_v x / D sqrt((p_s - dp_L) / 2) with x = 1, and the two lines share the supply: p_a + p_b = p_s."""
    y, run = steadily("42 m/min", load, matched(), step="1 ms")
    a = pack(matched(), Scenario(load=load, s_w="100 m", mode="manual")).params.A
    assert "valve" in run.status.item()
    assert float(y.x_v) == pytest.approx(1.0, abs=1e-6)
    closed = a.edges.K_v / a.D_m * math.sqrt((float(y.p_s) - float(y.p_a - y.p_b)) / 2.0)
    assert float(y.omega_m) == pytest.approx(closed, rel=CLOSED)
    assert float(y.p_a + y.p_b) == pytest.approx(float(y.p_s), rel=CLOSED)


def test_a_valve_gives_most_power_at_two_thirds_of_the_supply_pressure():
    powers = {}
    for load in ("9 t", "11 t", "12 t", "13 t", "15 t"):
        y, _ = steadily("42 m/min", load, matched(), step="1 ms")
        dp, p_s = float(y.p_a - y.p_b), float(y.p_s)
        powers[dp / p_s] = dp * float(y.omega_m) / p_s**1.5  # of one supply pressure: the pumps droop a little
    ratio, power = np.array(sorted(powers.items())).T
    turns = np.roots(np.polyder(np.polyfit(ratio, power**2, 3)))  # of a cubic, which the square of the power is
    assert ratio[0] < 0.55 < 0.75 < ratio[-1]
    assert max(turns.real) == pytest.approx(2.0 / 3.0, rel=CLOSED)


def test_throttling_leaves_the_load_pressure_over_the_supply_pressure():
    """Efficiency of a constant supply with one valve: what reaches the shaft over what the pumps give is dp_L/p_s."""
    y, _ = steadily("20 m/min", "10 t", matched(), step="1 ms")
    D = pack(matched(), Scenario(load="10 t", s_w="100 m", mode="manual")).params.A.D_m
    shaft = float(y.p_a - y.p_b) * D * float(y.omega_m)
    assert shaft / float(y.P_hpu) == pytest.approx(float(y.p_a - y.p_b) / float(y.p_s), rel=STEADY)


def ringing(opened: float) -> tuple[complex, complex]:
    """Pole of the two lines and the shaft at a steady hoist with a constant supply, from the winch's own rates and from
    Merritt's closed form; the tension at the top is constant."""
    leaks = {"C_1": "0.05 L/min/bar", "C_2": "0 L/min/bar/(rev/min)"}
    no_loss = {"X_1": "0 N m s/rad", "X_2": "0 N m s^2/rad^2/(m^3/rad)^3"}
    winch = changed(
        circuit_with(**{**MATCHED, "motor": {**leaks, "loss": no_loss}}),
        {"friction": {"system": {"Y_5": "0 N m s/rad"}}},
    )
    p = pack(winch, Scenario(load="10 t", s_w="100 m", mode="manual")).params
    a, geo = p.A, open_circuit.geometry(100.0, p)
    u = open_circuit.Command(x_v=opened, f_pump=1.0, brake=0.0)
    dp, p_s = 100.0 * BAR, 200.0 * BAR
    omega = a.edges.K_v * float(spool_opening(opened, a.edges)) / a.D_m * math.sqrt((p_s - dp) / 2.0)
    at = open_circuit.start(100.0, None, p)._replace(
        x_v=opened, p_a=(p_s + dp) / 2, p_b=(p_s - dp) / 2, p_s=p_s, omega_m=omega, z=0.0
    )
    point = open_circuit.PATH.Point(v_w=0.0, F_w=1.0e5, a_load=0.0, k=0.0, stretch=0.0, stretch_rate=0.0)

    def rates(x: Any) -> Any:
        return open_circuit.rates(open_circuit.circuit(x, point, u, geo, p)._replace(g=1.0e-9), x, point, u, geo, p)

    J = jacobian(rates, at, {"p_a": 1.0e3, "p_b": 1.0e3, "omega_m": 1.0e-3})
    pole = max(np.linalg.eigvals(J), key=lambda each: each.imag)
    C_t, J_m = 2.0 / a.i_C_h, 1.0 / geo.i_J  # V_t / beta, V_t being both lines
    K_c = a.D_m * omega / (2.0 * (p_s - dp))  # - d Q_L / d p_L of Q_L = K_v x sqrt((p_s - p_L)/2)
    K_ce = K_c + a.motors.count * a.motors.C_1 * (2.0 / 3.0 + 1.0 / 6.0)  # internal, and half of the external leak
    omega_h = math.sqrt(4.0 * a.D_m**2 / (C_t * J_m))
    zeta = K_ce / a.D_m * math.sqrt(J_m / C_t)
    return pole, omega_h * complex(-zeta, math.sqrt(1.0 - zeta**2))


@pytest.mark.parametrize("opened", [0.2, 0.5, 0.9])
def test_the_oil_swings_with_merritts_frequency_and_damping(opened):
    pole, closed = ringing(opened)
    assert abs(pole) == pytest.approx(abs(closed), rel=EIGEN)
    assert -pole.real / abs(pole) == pytest.approx(-closed.real / abs(closed), rel=EIGEN)


@pytest.mark.parametrize("load", ["2 t", "10 t", "20 t"])
def test_lowering_holds_the_load_up_by_the_counterbalance_valve(load):
    """p_b = (p_crack + y dp_open - dp_L)/(1 + psi) while lowering, p_T + (Q/K_v x)^2 while hoisting."""
    (down, _), (up, _) = steadily("-20 m/min", load), steadily("20 m/min", load)
    cb, e, tank = A().cb, A().edges, A().tank
    dp = float(down.p_a - down.p_b)
    p_b = (cb.p_crack + float(down.y_cb) / cb.i_dp_open - dp) / (1.0 + cb.psi)
    assert float(down.p_b) == pytest.approx(p_b, rel=STEADY)
    # the return edge while hoisting, with its laminar zone, by the flow that the motors take
    K = e.K_v * float(spool_opening(float(up.x_v), e))
    leak = A().motors.count * A().motors.C_1 * float(up.p_a - up.p_b)
    back = tank.p_T + ((A().D_m * float(up.omega_m) + leak) / K) ** 2
    difference = float(down.p_a - up.p_a)
    assert difference == pytest.approx((p_b + dp) - (back + float(up.p_a - up.p_b)), abs=1.0 * BAR)


@pytest.mark.parametrize(("load", "speed"), [("2 t", "-30 m/min"), ("20 t", "-30 m/min"), ("20 t", "30 m/min")])
def test_a_valve_controlled_winch_never_returns_energy(load, speed):
    _, run = steadily(speed, load)
    assert float(run.P_hpu.min()) >= 0.0
    assert float(run.alpha_p.min()) >= -1e-12


def test_lowering_a_heavier_load_takes_no_more_from_the_pumps():
    """The pumps only pilot the counterbalance valve: the weight's energy is throttled there."""
    heavy, light = (steadily("-20 m/min", load)[0] for load in ("20 t", "2 t"))
    assert float(heavy.P_hpu) == pytest.approx(float(light.P_hpu), rel=0.1)


@pytest.mark.parametrize("load", [5.0, 20.0])
def test_what_a_lowered_load_gives_up_is_throttled_and_the_pumps_add_to_it(load):
    operator = Operator(profile=(("0 s", "0 m/min"), ("3 s", "-20 m/min"), ("60 s", "-20 m/min")))
    case = SEA | {"load": f"{load} t", "tip": "still", "mode": "manual", "operator": operator}
    result = run_one(crane(), Scenario(**case), n_sub=5)
    s_w = result.column("s_w")[round(result.warm_up / result.t_cycle) :]
    given = (1.0e3 * load + crane().hook_mass) * G * float(s_w[-1] - s_w[0])
    P = result.stats.power
    lost = result.t_cycle * (P.friction + P.valve + P.counterbalance + P.leakage + P.relief + P.tank)
    pumped = result.t_cycle * P.pump
    assert pumped > 0.4 * given > 0.0
    assert lost == pytest.approx(pumped + given, rel=AUDIT)


# Runs


def test_a_brake_slips_where_the_load_swings_beyond_its_torque():
    small = changed(crane(), {"brake": {"T": "1070 N m"}})
    case = {"s_w": "100 m", "mode": "manual", "duration": "30 s", "warm_up": "10 s"}
    rough, calm = (simulate(small, Scenario(load="20 t", tip=f"sine {a} m 5 s", **case)) for a in ("2", "0.01"))
    assert "brake" in rough.status.item()
    assert "brake" not in calm.status.item()


@pytest.mark.parametrize(
    ("load", "speed"), [("2 t", "60 m/min"), ("10 t", "60 m/min"), ("20 t", "60 m/min"), ("10 t", "-60 m/min")]
)
def test_the_speed_limit_is_that_of_a_run_that_is_asked_for_more(load, speed):
    y, run = steadily(speed, load)
    p = pack(crane(), Scenario(load=load, s_w="150 m", mode="manual")).params
    geo = open_circuit.geometry(float(y.s_w), p)
    omega, cause = open_circuit.speed_limit(p, geo, float(y.F_w), lowering=speed.startswith("-"))
    assert abs(float(y.omega_m)) == pytest.approx(omega, rel=LIMIT)
    assert cause in run.status.item()


def test_with_one_of_two_power_units_the_winch_has_half_its_speed():
    loss = {"power_loss": PowerLoss(time="0 s", unit=1)}
    (half, _), (both, _) = (steadily("60 m/min", "2 t", **case) for case in (loss, {}))
    assert float(half.omega_m) == pytest.approx(0.5 * float(both.omega_m), rel=LIMIT)


def test_the_brake_opens_once_the_hoisting_line_carries_the_load():
    operator = Operator(profile=(("0 s", "0 m/min"), ("20 s", "0 m/min"), ("22 s", "20 m/min"), ("30 s", "20 m/min")))
    case = Scenario(
        load="20 t", s_w="100 m", tip="still", mode="manual", operator=operator, duration="30 s", warm_up="0 s"
    )
    run = simulate(crane(), case, every="10 ms")
    closed = run.brake.values > 0.0
    opened = float(run.time.values[closed][-1])
    assert 20.0 < opened < 20.0 + crane().brake.t_prove
    assert float(run.p_a.values[run.time.values < 19.0][-1]) < 0.2 * float(run.p_a.values[-1])  # it has leaked away
    assert float(run.s_w.max() - run.s_w[0]) < 0.01  # the load does not drop


def test_the_stiffest_mode_leaves_room_for_the_usual_step():
    p = pack(crane(), Scenario(load="10 t", s_w="100 m", mode="position")).params
    assert max(open_circuit.stiffness(p).rates.values()) * 5.0e-3 < 2.6
    assert shaft_inertia_without_wire(p.hoist) > 0.0


def test_what_matters_before_a_run_is_said_in_its_notes():
    light = circuit_with(counterbalance={"p_crack": "90 bar"})
    run = simulate(light, Scenario(load="10 t", **(SEA | {"duration": "10 s", "warm_up": "1 s"})))
    assert any("will not hold the load" in note for note in run.notes.item().split("; "))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_spool_stays_within_its_stops_and_leads_more_flow_the_further_it_is_open(sign):
    """Of ten times full flow no more than all of it can be asked."""
    A = pack(load_crane(NAME), Scenario(load="8 t", s_w="50 m", mode="manual")).params.A
    dp, full = A.law.dp_nominal, A.D_m * A.n_full
    spools = [open_circuit.spool_command(sign * x * full, dp, A) for x in (0.1, 0.3, 0.6, 3.0, 10.0)]
    assert (np.diff(np.abs(spools)) >= 0.0).all()
    assert np.sign(spools).tolist() == [sign] * 5
    assert spools[-1] == sign
