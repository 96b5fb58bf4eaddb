"""The electric winch against closed forms, mostly in the running twin: torque and voltage, losses, cascade, heating, limits, store."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.engine.runs import run_one

from stillhook import Scenario, load_crane
from stillhook.analysis.steady.limits import Direction, top_of_drive
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.summary import ScenarioRun, limits_passed
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.library import changed
from stillhook.physics.electric import machine, supply
from stillhook.physics.electric.machine import Body, time_to_limit
from stillhook.physics.scalar import G
from stillhook.sea.motion.motion import Sine
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase
from stillhook.spec.scenario import Operator
from stillhook.winches.types import electric

FINE = 5
"""Steps per PLC cycle."""
LOWERING = 1.0e-3
"""The same of a lowering, as in tests/conservation/test_lowering_energy.py."""
ROUNDING = 1.0e-9
"""Relative; the same equation written in another order."""
STATICS = 1.0e-3
"""Relative: the load hangs still but for the last of its swing."""
POLE = 1.0e-4
"""Relative: derivatives by central differences."""
RMS = 2.0e-3
"""Relative: the set-points are 10 ms late and the tension follows what is left of the motion."""
REGENERATED = 1.0e-3
"""Relative, as the specification asks."""
CYCLE = 0.01
"""Cycle of the PLC [s], in which a time is seen."""
SAME_LAYERS = 0.02
"""Relative: the drum fills or empties while a speed of the envelope, that of the start, is held."""
LAG = 3.0e-3
"""Of the torque: the limit of power falls with the speed, and the current follows it by its lag of 2 ms."""

CRANE = load_crane("nov-100t-electric")
WINCH = CRANE.plant.type
MOTOR = CRANE.electric.motor
STILL = {"load": "100 t", "s_w": "10 m", "tip": "still", "duration": "60 s", "warm_up": "10 s"}
WAVE = {"load": "47 t", "s_w": "200 m", "tip": "sine 1 m 10 s", "duration": "100 s", "warm_up": "40 s"}
NO_FRICTION = {
    "friction": {
        "system": {"Y_1": 0.0, "Y_2": "0 N m", "Y_3": "0 N m", "Y_5": "0 N m s/rad", "Y_6": 0.0},
        "sigma_1_ratio": 0.0,
    }
}


def edited(**electric_tables: dict[str, str]) -> Crane:
    return changed(CRANE, {"electric": electric_tables})


def run(crane: Crane = CRANE, n_sub: int = FINE, **case: Any) -> ScenarioRun:
    return run_one(crane, Scenario(**({"mode": "position"} | case)), n_sub=n_sub)


def steady(speed: float, duration: float = 60.0) -> dict[str, Any]:
    """A steady wire speed by the operator, hoisting positive [m/s]."""
    profile = (("0 s", "0 m/s"), ("5 s", f"{speed} m/s"), (f"{duration} s", f"{speed} m/s"))
    return {"mode": "manual", "tip": "still", "operator": Operator(profile=profile), "duration": f"{duration} s"}


def joules(result: ScenarioRun, name: str) -> float:
    return float(getattr(result.stats.power, name) * result.t_cycle)


def counted(result: ScenarioRun, name: str) -> np.ndarray:
    """A signal after the warm-up."""
    return result.column(name)[round(result.warm_up / result.t_cycle) :]


def weight(load: float) -> float:
    return (load + CRANE.hook_mass) * G


@cache
def params() -> electric.Params:
    return pack(CRANE, Scenario(load="47 t", s_w="100 m")).params


currents, speeds = st.floats(-2000.0, 2000.0), st.floats(-300.0, 300.0)


@settings(deadline=None)
@given(currents, speeds)
def test_voltage_constant_and_torque_constant_are_one_number(i, omega_m):
    """What reverses with the current is the power of the shaft: electrical power less losses is torque times speed."""
    M = params().drive.machines
    reversed_part = 0.5 * (machine.link_power(i, omega_m, M) - machine.link_power(-i, omega_m, M))
    size = machine.link_power(abs(i), abs(omega_m), M)
    assert reversed_part == pytest.approx(machine.torque(i, M) * omega_m, abs=ROUNDING * size)


@settings(deadline=None)
@given(speeds, st.floats(0.0, 2.0e6), st.floats(0.0, 2.0e6))
def test_within_its_torque_limits_the_drive_takes_no_more_and_feeds_back_no_more_than_the_link_allows(
    omega_m, P_supply, P_back
):
    M = params().drive.machines
    idle = machine.iron_loss(omega_m, M) + machine.inverter_loss(0.0, M)
    for sign in (1.0, -1.0):
        T = sign * machine.torque_limit(sign * omega_m, P_supply, P_back, M)
        P = machine.link_power(machine.current(T, M), omega_m, M)
        rounding = ROUNDING * (P_supply + P_back + 1.0e7)
        assert -P_back - rounding <= P <= max(P_supply, idle) + rounding


@settings(deadline=None)
@given(speeds)
def test_torque_is_full_up_to_the_corner_speed_and_falls_as_power_over_speed_beyond(omega_m):
    M = params().drive.machines
    corner = 6 * 260.0e3 / 12000.0
    T = machine.torque_limit(omega_m, 1.0e9, 1.0e9, M)
    assert pytest.approx(12000.0 * min(1.0, corner / max(abs(omega_m), 1e-9)), rel=ROUNDING) == T


def test_a_published_overload_time_follows_from_the_thermal_time_constant():
    """Siemens, 1FW6 configuration manual 05/2009, section 5.3: 47 A on a machine of 26 A and 180 s lasts 66 s."""
    winding = Body(theta_c=300.0, R_th=1.0, i_tau=1.0 / 180.0, theta_max=400.0)
    assert round(time_to_limit(300.0, 100.0 * (47.0 / 26.0) ** 2, winding)) == 66


def test_holding_a_load_costs_the_copper_loss_of_its_torque():
    result = run(**STILL)
    d = CRANE.drum.d + (2 * CRANE.drum.layers - 1) * CRANE.wire.d
    T = weight(100.0e3) * 0.5 * d / CRANE.i_hD / MOTOR.count
    assert joules(result, "copper") / 50.0 == pytest.approx(MOTOR.count * MOTOR.R * (T / MOTOR.K_t) ** 2, rel=STATICS)
    assert joules(result, "friction") == pytest.approx(0.0, abs=1.0)


def test_windings_reach_their_limit_when_a_first_order_body_does():
    crane = edited(motor={"tau_th": "60 s", "theta_max": "60 degC"})
    result = run(crane, **(STILL | {"warm_up": "0 s"}))
    T = weight(100.0e3) * 0.5 * (CRANE.drum.d_max - CRANE.wire.d) / CRANE.i_hD / MOTOR.count
    end = 100.0 * (T / 1000.0) ** 2  # rise at this torque, as the rated torque gives 100 K
    expected = 60.0 * math.log(end / (end - 30.0))
    assert 20.0 < expected < 40.0
    crossed = CYCLE * int(np.argmax(result.column("theta") > 273.15 + 60.0))
    assert crossed == pytest.approx(expected, rel=STATICS, abs=2 * CYCLE)
    assert limits_passed(WINCH, result.stats) == ["temperature"]
    assert result.stats.limits.temperature * CYCLE == pytest.approx(60.0 - expected, abs=0.1)


def test_torque_of_a_compensated_sine_is_that_of_load_and_inertia():
    crane = changed(CRANE, NO_FRICTION)
    result = run(crane, **WAVE)
    T = counted(result, "T_m")[: 6 * 1000]
    p = pack(crane, Scenario(load="47 t", s_w="200 m"))
    geo = electric.geometry(200.0, p.params)
    A, omega = 1.0 / geo.r_eff, 2.0 * math.pi / 10.0
    expected = math.hypot(A * omega**2 / geo.i_J / math.sqrt(2.0), weight(47.0e3) * geo.r_eff)
    assert math.sqrt(np.mean(T * T)) == pytest.approx(expected, rel=RMS)
    assert np.std(T) == pytest.approx(A * omega**2 / geo.i_J / math.sqrt(2.0), rel=0.02)


def cascade_poles() -> tuple[np.ndarray, np.ndarray]:
    """Of the linearised rates with the position loop closed, and of the polynomial of the cascade."""
    crane = changed(CRANE, NO_FRICTION)
    p = pack(crane, Scenario(load="47 t", s_w="100 m")).params
    geo, F = electric.geometry(100.0, p), p.hoist.load.W
    q = electric.load.Point(v_w=0.0, F_w=F, a_load=0.0, k=1.0, stretch=0.0, stretch_rate=0.0)
    T = F * geo.r_eff
    names = ("i", "omega_m", "omega_ref", "T_n")
    middle = electric.start(100.0, None, p)._replace(i=machine.current(T, p.drive.machines), T_ff=T)

    def rate(v: np.ndarray) -> np.ndarray:
        """Deviations of i, speed, set-point, integral part, wire taken in [m]; K_p closes the loop on the wire."""
        x = middle._replace(**{n: getattr(middle, n) + d for n, d in zip(names, v[:4], strict=True)})
        u = electric.Command(u_p=-p.plc.gains.K_p * v[4], T_ff=0.0, brake=0.0)
        c = electric.circuit(x, q, u, geo, p)
        r = electric.rates(c, x, q, u, geo, p)
        return np.array([*(getattr(r, n) for n in names), x.omega_m * geo.r_eff])

    step = np.array([1.0, 0.1, 0.1, 10.0, 1e-3])
    J = np.column_stack([(rate(e * h) - rate(-e * h)) / (2.0 * h) for e, h in zip(np.eye(5), step, strict=True)])
    K, T_i, inertia, tau_i, tau_r = (
        CRANE.electric.speed.K,
        CRANE.electric.speed.T_i,
        1.0 / geo.i_J,
        1.0 / p.drive.rate_i,
        0.01,
    )
    loop = np.polymul([inertia * tau_i, inertia, K, K / T_i], [tau_r, 1.0, 0.0])
    position = CRANE.control.K_p * MOTOR.n_full * geo.r_eff
    return np.linalg.eigvals(J), np.roots(np.polyadd(loop, position * np.array([K, K / T_i])))


def test_friction_adds_its_own_square_to_the_torque_of_a_compensated_sine():
    """T_f changes sign with the speed, as the inertia's torque does not: their product is nothing over a period."""
    result = run(**WAVE)
    T, omega_m = counted(result, "T_m")[: 6 * 1000], counted(result, "omega_m")[: 6 * 1000]
    T_f = joules(result, "friction") / 60.0 / float(np.mean(np.abs(omega_m)))
    geo = electric.geometry(200.0, pack(CRANE, Scenario(load="47 t", s_w="200 m")).params)
    inertial = (2.0 * math.pi / 10.0) ** 2 / geo.r_eff / geo.i_J / math.sqrt(2.0)
    closed = math.sqrt(inertial**2 + (weight(47.0e3) * geo.r_eff) ** 2 + T_f**2)
    assert math.sqrt(np.mean(T * T)) == pytest.approx(closed, rel=RMS)
    assert T_f > 100.0


def test_a_hoist_that_is_asked_for_more_goes_with_full_torque_to_the_corner_speed_and_with_full_power_beyond():
    crane = edited(motor={"T_max": "1040 N m", "P_max": "110 kW"})
    profile = (("0 s", "0 m/s"), ("10 s", "0 m/s"), ("10.2 s", "1 m/s"), ("30 s", "1 m/s"))
    case = {"mode": "manual", "tip": "still", "operator": Operator(profile=profile), "duration": "30 s"}
    result = run(crane, load="97 t", s_w="200 m", warm_up="1 s", **case)
    turns = result.column("omega_m") > 3.0
    T, omega_m = result.column("T_m")[turns] / MOTOR.count, result.column("omega_m")[turns]
    corner = 110.0e3 / 1040.0
    below, beyond = omega_m < corner, omega_m > corner
    assert np.max(np.abs(T[below] / 1040.0 - 1.0)) < LAG
    assert np.max(np.abs(T[beyond] * omega_m[beyond] / 110.0e3 - 1.0)[1:]) < LAG
    assert min(below.sum(), beyond.sum()) > 100
    assert limits_passed(WINCH, result.stats) == ["torque", "power"]


def test_what_the_link_gives_a_hoist_and_a_lowering_differs_by_voltage_times_current():
    """The same losses either way: half of the difference is K_e i omega, with the machine's torque constant as K_e."""
    crane = changed(CRANE, NO_FRICTION)
    hoist, down = (run(crane, **(WAVE | steady(v))) for v in (0.6, -0.6))
    P = [float(np.mean(counted(r, "P_dc")[-500:])) for r in (hoist, down)]
    i_omega = [float(np.mean(counted(r, "i")[-500:] * counted(r, "omega_m")[-500:])) for r in (hoist, down)]
    assert (P[0] - P[1]) / (i_omega[0] - i_omega[1]) / MOTOR.count == pytest.approx(MOTOR.K_t, rel=1e-5)


def test_poles_are_those_of_a_position_loop_over_a_speed_loop_over_a_current_loop():
    ours, theirs = cascade_poles()
    for pole in theirs:
        assert np.min(np.abs(ours - pole)) < POLE * abs(pole)
    assert np.all(theirs.real < 0.0)


def test_a_step_of_the_wire_dies_out_at_the_slowest_pole_of_the_cascade():
    """The PLC's hold and computing time, 15 ms, are taken with the pole: s + kappa exp(-s T) = 0 for small kappa T."""
    operator = Operator(steps=(("20 s", "0.05 m"),))
    result = run(
        changed(CRANE, NO_FRICTION),
        **(WAVE | {"tip": "still", "operator": operator, "duration": "30 s", "warm_up": "5 s"}),
    )
    e = np.abs(result.column("e_c"))
    from_1, to = round(21.0 / CYCLE), round(22.5 / CYCLE)
    seen = -math.log(e[to] / e[from_1]) / 1.5
    _, poles = cascade_poles()
    slow = float(np.min(np.abs(poles)))
    assert seen == pytest.approx(slow * (1.0 + slow * 0.015), rel=0.01)


def test_what_a_lowered_load_feeds_back_is_its_energy_less_the_losses():
    result = run(**(WAVE | steady(-0.6)))
    s_w = counted(result, "s_w")
    P = counted(result, "P_dc")
    fed_back = -CYCLE * float(np.sum(P) - 0.5 * (P[0] + P[-1]))
    given_up = weight(47.0e3) * float(s_w[-1] - s_w[0])
    losses = sum(joules(result, name) for name in ("copper", "iron", "inverter", "friction"))
    assert fed_back > 0.8 * given_up > 0.0
    assert fed_back == pytest.approx(given_up - losses, rel=REGENERATED)


def test_the_store_carries_the_wave_and_the_grid_the_mean():
    result = run(**WAVE)
    P_dc, P_el = counted(result, "P_dc"), counted(result, "P_el")
    assert np.ptp(P_dc) > 500.0e3
    assert np.ptp(P_el) < 0.12 * np.ptp(P_dc)
    assert result.span[0] < 2.0e-3
    assert limits_passed(WINCH, result.stats) == []


def test_a_store_gives_and_takes_nothing_at_its_ends():
    s = params().drive.store
    assert supply.store_gives(s.E_low, s) == supply.store_takes(s.E_high, s) == 0.0
    assert supply.store_gives(s.E_set, s) == supply.store_takes(s.E_set, s) == s.P_max
    assert supply.resistor_power(0.0, s.E_high, 0.0, s, params().drive.grid) == params().drive.grid.P_resistor


def test_a_long_hoist_ends_at_the_power_of_the_grid():
    """With the store exhausted the speed is that at which torque, friction and losses take what the grid gives."""
    crane = edited(supply={"P_max": "300 kW"})
    result = run(crane, **({"load": "97 t", "s_w": "200 m"} | steady(1.0, 120.0)))
    p = pack(crane, Scenario(load="97 t", s_w="200 m")).params
    geo = electric.geometry(float(result.column("s_w")[-1]), p)
    expected, cause = electric.speed_limit(p, geo, p.hoist.load.W)
    assert cause == "power"
    assert result.column("omega_m")[-1] == pytest.approx(expected, rel=5e-3)
    assert result.column("P_el")[-1] == pytest.approx(300.0e3, rel=STATICS)
    assert limits_passed(WINCH, result.stats) == ["power", "store empty"]


def test_a_brake_that_cannot_hold_a_heaving_load_slips():
    crane = changed(CRANE, {"brake": {"T": "5560 N m"}})
    result = run(crane, load="100 t", s_w="10 m", mode="manual", tip="sine 3 m 5 s", duration="60 s")
    assert "brake slipping" in limits_passed(WINCH, result.stats)
    held = run(load="100 t", s_w="10 m", mode="manual", tip="sine 1 m 10 s", duration="60 s")
    assert limits_passed(WINCH, held.stats) == []


def test_a_load_that_runs_away_is_caught_by_the_brake():
    result = run(edited(motor={"T_max": "800 N m"}), **(WAVE | {"load": "97 t", "warm_up": "1 s"}))
    assert "overspeed" in limits_passed(WINCH, result.stats)
    assert np.max(np.abs(result.column("omega_m"))) < 1.2 * MOTOR.n_max
    assert abs(result.column("omega_m")[-1]) < 0.1


@pytest.mark.thorough
def test_a_lowering_into_the_water_loses_no_energy_unseen():
    levels = tuple({"h": f"{h} m", "V": f"{2 * h} m^3", "A33": f"{8 * h} t", "A_p": "20 m^2"} for h in (0.0, 5.0))
    case = Lowering(
        payload=Payload(name="box", mass="60 t", height="5 m", C_D=2.0, levels=levels),
        tip=Sine(amplitude="1 m", period="8 s"),
        h_tip="20 m",
        depth="60 m",
        start_depth="-2 m",
        controller="position",
        programme=(
            Phase(mode="splash", speed="15 m/min", depth="12 m"),
            Phase(mode="ahc", speed="30 m/min", depth="40 m"),
        ),
        duration="200 s",
    )
    result = run_cases(CRANE, [case], step=2, lanes=1, keep=unchanged)[0]
    assert abs(result.energy_unaccounted) < LOWERING


def test_before_a_run_it_says_what_the_load_means():
    hot = edited(motor={"theta_max": "60 degC"})
    parts: Any = None
    held = type("Held", (), {"W": weight(100.0e3), "d": 3.4, "s_tip_pp": 10.0, "compensates": True})
    lines = electric.notes(hot, held, parts)
    assert any("60 degC after" in line for line in lines)
    assert any("through the store" in line for line in lines)
    weak = edited(motor={"T_max": "800 N m"})
    assert any("the load will sink" in line for line in electric.notes(weak, held, parts))


def test_the_highest_steady_speed_is_that_of_the_power_that_goes_in_or_comes_back():
    """A light load is stopped by the full command, SWL by the grid when it goes up and by what can be taken back when it goes down."""
    light, heavy = (pack(CRANE, Scenario(load=load, s_w="100 m")).params for load in ("0 t", "100 t"))
    geo = electric.geometry(100.0, heavy)
    assert electric.speed_limit(light, geo, light.hoist.load.W) == (MOTOR.n_full, "full command")
    W = heavy.hoist.load.W
    (up, grid), (down, back) = (electric.speed_limit(heavy, geo, W, lowering) for lowering in (False, True))
    assert (grid, back) == ("power", "store full")
    assert up * W * geo.r_eff < CRANE.electric.supply.P_max
    assert down * W * geo.r_eff > CRANE.electric.supply.P_back + CRANE.electric.supply.P_rated


PROMISED = {"lowering": (Direction.LOWERING, 100.0, 300.0), "hoisting": (Direction.HOISTING, 500.0, 300.0)}


@pytest.mark.parametrize("way", sorted(PROMISED))
def test_what_the_envelope_promises_a_run_holds_and_a_twentieth_more_is_named(way):
    """The slower of the envelope's speeds at the start and at the end of the run. Down, all of P_back goes to the grid
    and the resistor burns what it may for ever, until 5 % more are too hot; up, the grid gives all it can, until 5 %
    more empty the store. A resistor that warms in 30 s, for a short run."""
    direction, start, duration = PROMISED[way]
    crane, s, g = edited(supply={"tau_th": "30 s"}), CRANE.electric.store, CRANE.electric.supply
    v = top_of_drive(crane, 100.0e3, start, direction).v_w
    v = min(v, top_of_drive(crane, 100.0e3, start - direction.sign * v * duration, direction).v_w)
    held, more = (
        run(crane, 2, load="100 t", s_w=f"{start} m", warm_up="10 s", **steady(direction.sign * x * v, duration))
        for x in (1.0, 1.05)
    )
    assert limits_passed(WINCH, held.stats) == []
    assert s.V_min < held.stats.extremes.V_dc_min < held.stats.extremes.V_dc_max < s.V_max
    named = set(limits_passed(WINCH, more.stats))
    assert s.V_min * (1.0 - STATICS) < more.stats.extremes.V_dc_min < more.stats.extremes.V_dc_max < s.V_max
    if direction is Direction.LOWERING:
        assert held.column("P_el")[-1] == pytest.approx(-g.P_back, rel=ROUNDING)
        assert held.column("P_resistor")[-1] == pytest.approx(g.P_rated, rel=SAME_LAYERS)
        assert {"resistor temperature", "power"} <= named
    else:
        assert held.column("P_el")[-1] == pytest.approx(g.P_max, rel=SAME_LAYERS)
        assert {"power", "store empty"} <= named


energies_of_a_store = st.floats(0.2, 1.1).map(lambda x: x * params().drive.store.E_high)
powers_of_a_winch = st.floats(-6.0e6, 6.0e6)
heats = st.floats(0.0, 1.2)


@settings(deadline=None)
@given(powers_of_a_winch, energies_of_a_store, heats)
def test_whatever_the_winch_takes_within_its_limits_store_grid_and_resistor_stay_within_theirs(P_dc, E, heat):
    s, g = params().drive.store, params().drive.grid
    P_dc = min(max(P_dc, -supply.take_limit(E, heat, s, g)), supply.supply_limit(E, heat, s, g))
    P_resistor = supply.resistor_power(P_dc, E, heat, s, g)
    P_el = supply.grid_power(P_dc, P_resistor, E, s, g)
    P_store = P_el - P_dc - P_resistor
    I = supply.store_current(P_store, E, s)
    V = supply.open_voltage(E, s)
    rounding = ROUNDING * 1.0e7
    assert -g.P_back <= P_el <= g.P_max
    assert 0.0 <= P_resistor <= g.P_resistor
    assert abs(P_store) <= s.P_max + rounding
    assert abs(I) <= s.I_max + rounding
    if I > rounding:
        assert V + s.R * I <= s.V_high + rounding
    elif I < -rounding:
        assert V + s.R * I >= s.V_low - rounding
    assert P_store == pytest.approx((V + s.R * I) * I, abs=rounding)


@pytest.mark.parametrize("tau", ["5 s", "20 s", "200 s"])
def test_the_grid_takes_all_it_takes_before_the_resistor_burns_and_gives_all_before_the_store_ends(tau):
    """However slowly the grid refills the store."""
    p = pack(edited(store={"tau": tau}), Scenario(load="47 t", s_w="100 m")).params
    s, g = p.drive.store, p.drive.grid
    band = 1.0 / s.i_band
    for P_dc in (-200.0e3, 0.0, 200.0e3):
        assert supply.resistor_power(P_dc, s.E_high - band, 0.0, s, g) == pytest.approx(0.0, abs=ROUNDING * g.P_back)
        for E in (s.E_high - band, s.E_high):
            assert supply.grid_power(P_dc, 0.0, E, s, g) == pytest.approx(-g.P_back)
        assert supply.grid_power(P_dc, 0.0, s.E_low + band, s, g) == pytest.approx(g.P_max)


def test_a_resistor_is_hot_when_a_first_order_body_is_and_burns_its_rating_from_then_on():
    """At twice its rating from cold: h = 2 (1 - exp(-t/tau)) reaches the last tenth at tau ln(2/1.1)."""
    crane = edited(supply={"P_back": "0 kW", "tau_th": "60 s"}, store={"C": "10 F"})
    M, geo = pack(crane, Scenario(load="80 t", s_w="700 m")).params.drive, electric.geometry(700.0, params())
    result = run(crane, load="80 t", s_w="700 m", warm_up="1 s", **steady(-0.48, 80.0))
    P, grid = result.column("P_resistor"), M.grid
    assert geo.r_eff * MOTOR.n_full > 0.48
    burns = P > 1.0
    heat = np.zeros(len(P))
    for k in range(1, len(P)):  # by the trapezoidal rule from the series itself
        mean = 0.5 * (P[k] + P[k - 1]) / grid.P_rated
        heat[k] = mean + (heat[k - 1] - mean) * math.exp(-CYCLE / 60.0)
    assert burns.sum() * CYCLE > 20.0
    assert result.state.winch.heat == pytest.approx(heat[-1], rel=REGENERATED)
    hot = heat > 1.0 - supply.COOLING
    assert hot.any()
    assert np.all(P[hot] <= supply.resistor_most(heat[hot].min(), grid) + 1.0)
    assert "resistor temperature" in limits_passed(WINCH, result.stats)
    assert result.state.winch.heat <= 1.0


def test_a_store_is_hot_when_a_first_order_body_is():
    """In a heavy wave: 40 K at the loss of 300 A, delayed by tau_th."""
    crane = edited(store={"tau_th": "30 s", "P_loss": "1350 W"})
    result = run(crane, **(WAVE | {"load": "97 t", "tip": "sine 1.5 m 10 s"}))
    I = result.column("I_store")
    theta = np.full(len(I), 298.15)
    for k in range(1, len(I)):
        end = 298.15 + 40.0 * 0.5 * (I[k] ** 2 + I[k - 1] ** 2) / 300.0**2
        theta[k] = end + (theta[k - 1] - end) * math.exp(-CYCLE / 30.0)
    assert np.max(theta) > 338.15
    np.testing.assert_allclose(result.column("theta_store"), theta, rtol=REGENERATED)
    crossed = [CYCLE * int(np.argmax(x > 338.15)) for x in (result.column("theta_store"), theta)]
    assert crossed[0] == pytest.approx(crossed[1], abs=10 * CYCLE)
    assert "store temperature" in limits_passed(WINCH, result.stats)


def test_a_link_with_hardly_a_store_goes_over_its_voltage_by_the_lag_of_the_current_and_says_so():
    tables = {
        "supply": {"P_back": "50 kW", "P_resistor": "0 kW", "P_rated": "0 kW"},
        "store": {"C": "0.02 F", "R": "0 ohm", "P_max": "50 kW"},
    }
    result = run(edited(**tables), n_sub=20, **(WAVE | {"load": "80 t", "warm_up": "1 s", "tip": "sine 2 m 6 s"}))
    assert {"overvoltage", "store full"} <= set(limits_passed(WINCH, result.stats))
    assert result.stats.extremes.V_dc_max > CRANE.electric.store.V_max


def test_the_link_is_above_the_store_by_its_resistance_while_it_charges():
    result = run(**(WAVE | {"load": "97 t", "tip": "sine 1.5 m 10 s"}))
    V, I, E = (counted(result, name) for name in ("V_dc", "I_store", "E_store"))
    np.testing.assert_allclose(V - 0.015 * I, np.sqrt(2.0 * E / 66.0), rtol=ROUNDING)
    P = counted(result, "P_el") - counted(result, "P_dc") - counted(result, "P_resistor")
    np.testing.assert_allclose(V * I, P, atol=ROUNDING * 1.0e6)
    assert joules(result, "store") == pytest.approx(float(np.sum(0.015 * I * I)) * CYCLE, rel=REGENERATED)
