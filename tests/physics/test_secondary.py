"""Secondary control: the rail keeps the energy, the setting makes the torque, and a lost load does not run away."""

import ctypes
import math
import types
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.ctypeslib import ndpointer
from scipy.signal import lsim
from tests.engine.runs import run_many, run_one
from tests.engine.test_c99 import compile_c

from stillhook import Scenario, Sine, cli, load_crane, simulate
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.problem import Ready, ScenarioBlock, energy_unaccounted
from stillhook.errors import SpecError, UnitError
from stillhook.kernels.build import c_source, driver
from stillhook.kernels.lanes import VL, flatten
from stillhook.library import changed
from stillhook.library.catalogue import read_payload
from stillhook.physics.scalar import G
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import Phase
from stillhook.spec.scenario import Operator, PowerLoss
from stillhook.winches.records import Tick
from stillhook.winches.types import secondary

AUDIT = 1.0e-4
"""Of the energy through pumps and accumulator; the worst seen is 2e-5, the specification asks for 1e-3."""
OVER_A_PERIOD = 1.0e-3
"""Pump energy against losses, from the specification."""
ONE_PERCENT = 0.01
"""Swings of oil and pressure, from the specification: the pressure changes by some per cent while the oil moves."""
STEADY = 1.0e-3
"""Torques of a steady speed, relative: layers and swings of the load are left out."""
NUMERIC = 1.0e-5
"""Poles from differences of the rates, relative."""
FIRST_ORDER = 0.01
"""Poles where a displacement control with a damping ratio of 5 stands for one of first order."""
LINEAR = 0.02
"""Response of the running twin against the linear loop, of the step: cycles of 10 ms hold the set-point."""
GUARD = 1.15
"""Peak of the speed without the guard over that with it, with the speed control of the first file (15 1/s): at SWL a fifth more, with
less load two thirds; the rest is the time that the swash plates take. A stiffer control leaves the guard less."""
INTERPRETED = 1.0e-9
"""Relative: exp of the kernels differs from the library's in the last digits."""
SAME_IN_C = 1.0e-9
"""Relative: the compilers fuse different operations; a minute of feedback keeps the difference near 1e-11."""
HALVED = (0.15, 0.35)
"""Error after half the step over that before: a quarter, for a method of second order."""

BASE = {
    "load": "125 t",
    "s_w": "200 m",
    "tip": "sine 1 m 10 s",
    "mode": "position",
    "duration": "60 s",
    "warm_up": "30 s",
}
IDEAL = {
    "secondary": {
        "unit": {
            "C_1": "0 L/min/bar",
            "loss": {
                "X_1": "0 N m s/rad",
                "X_2": "0 N m s^2/rad^2/(m^3/rad)^3",
                "X_3": 0.0,
                "X_4": "0 N m",
                "X_5": "0 m^5/N",
            },
        },
        "pump": {"C_leak": "0 L/min/bar"},
        "accumulator": {"R_piston": "0 bar/(L/min)", "C_leak": "0 L/min/bar"},
    },
    "friction": {"system": {"Y_1": 0.0, "Y_3": "0 N m", "Y_5": "0 N m s/rad", "Y_6": 0.0}},
    "control": {"K_acc": "0 1/bar"},
}
"""No friction, no leak, and pumps that stand."""


@cache
def crane(ideal: bool = False):
    found = load_crane("nov-250t-secondary")
    return changed(found, IDEAL) if ideal else found


def run(ideal: bool = False, every: str | None = None, **case: Any):
    options = {} if every is None else {"every": every}
    return simulate(crane(ideal), Scenario(**(BASE | case)), **options)


def moves(speed: str) -> dict[str, Any]:
    """A speed of the operator's from 10 s on, with the tip still."""
    profile = (("0 s", "0 m/min"), ("10 s", speed), ("100 s", speed), ("105 s", "0 m/min"))
    return {
        "mode": "manual",
        "tip": "still",
        "operator": Operator(profile=profile),
        "s_w": "400 m",
        "duration": "110 s",
        "warm_up": "0 s",
    }


def params(ideal: bool = False, **case: Any) -> Any:
    return pack(crane(ideal), Scenario(**(BASE | case))).params


def weight(load: str = "125 t") -> float:
    return (Scenario(**(BASE | {"load": load})).load + crane().hook_mass) * G


# Energy and oil


@pytest.mark.parametrize(
    "case",
    [
        {},
        {"load": "250 t", "tip": "sine 3 m 8 s"},
        {"load": "0 t"},
        moves("-20 m/min"),
        moves("55 m/min"),
        moves("-55 m/min"),
        {"power_loss": PowerLoss(time="40 s", unit=3)},
        {"friction": "regularised"},
        {"gas_held": True},
    ],
    ids=["half", "overload", "hook", "lowering", "emptied", "overfilled", "unit-lost", "regularised", "gas-held"],
)
def test_no_joule_is_lost(case):
    result = run_one(crane(), Scenario(**(BASE | case)), n_sub=5, every=0)
    assert abs(energy_unaccounted(crane().plant.type, result)) < AUDIT


def test_over_a_period_the_pumps_give_what_is_lost_and_no_more():
    """In a steady swell gas, shaft and load come back to where they were: what pumps, boost and tip give is lost."""
    result = run_one(crane(), Scenario(**(BASE | {"warm_up": "700 s", "duration": "800 s"})), n_sub=2, every=0)
    power = result.stats.power._asdict()
    lost = sum(power[name] for name in ("friction", "leakage", "relief", "piston", "wire", "drag"))
    given = power["pump"] + power["boost"] + power["tip"]
    assert power["pump"] > 0.0
    assert given == pytest.approx(lost, rel=OVER_A_PERIOD)


def test_a_swell_moves_weight_times_motion_over_pressure_of_oil_in_and_out():
    result = run(ideal=True, warm_up="50 s", duration="100 s")
    rail = crane().secondary
    V = weight() * 2.0 / (rail.accumulator.gas.p_0 - rail.p_lp)  # 2 m from trough to crest
    late = result.time.values > 50.0
    assert np.ptp(result.V_acc.values[late]) == pytest.approx(V, rel=ONE_PERCENT)


def test_the_rail_breathes_along_the_gas_law():
    """Isentropic swing of the gas for the oil that a swell moves."""
    result = run(ideal=True, warm_up="50 s", duration="100 s")
    rail = crane().secondary
    gas, late = rail.accumulator.gas, result.time.values > 50.0
    V = weight() * 2.0 / (gas.p_0 - rail.p_lp)
    mean = float(result.V_acc.values[late].mean()) - 0.5 * rail.accumulator.V_stroke
    high, low = (gas.p_0 * (gas.V_0 / (gas.V_0 - mean - sign * 0.5 * V)) ** gas.n for sign in (1.0, -1.0))
    assert np.ptp(result.p_r.values[late]) == pytest.approx(high - low, rel=ONE_PERCENT)


def test_without_losses_the_pumps_give_nothing():
    result = run_one(crane(ideal=True), Scenario(**BASE), n_sub=2, every=0)
    assert result.stats.power.pump == 0.0


# Torque and speed


def test_the_torque_of_a_setting_does_not_depend_on_speed():
    """On a rail of constant pressure two hoisting speeds differ in setting by their friction alone."""
    D, dp = crane().secondary.unit.D_total, crane().secondary.accumulator.gas.p_0 - crane().secondary.p_lp
    settings, frictions = [], []
    for speed in ("5 m/min", "30 m/min"):
        result = run(**moves(speed), gas_held=True)
        steady = (result.time.values > 50.0) & (result.time.values < 55.0)
        settings.append(float(result.alpha_s.values[steady].mean()))
        frictions.append(float(result.T_f.values[steady].mean()))
    T = D * dp * settings[0]
    assert abs(D * dp * (settings[1] - settings[0]) - (frictions[1] - frictions[0])) < STEADY * T
    assert frictions[1] > 0.0


def moving(p: Any, omega_m: float, **state: float) -> tuple[Any, Any, Any, Any]:
    """State, point, command and drum of a steady speed with the hook's weight."""
    geo = secondary.geometry(200.0, p)
    q = types.SimpleNamespace(F_w=p.hoist.load.W)
    D, dp = p.rail.settings.D_m_max, p.rail.settings.p_set - p.rail.settings.p_lp
    alpha = q.F_w * geo.r_eff / (D * dp)
    V_o = 0.5 * p.rail.accumulator.V_stroke
    values = {"alpha_s": alpha, "V_o": V_o, "omega_m": omega_m} | state
    x = secondary.State(**(dict.fromkeys(secondary.State._fields, 0.0) | values))
    u = secondary.Command(omega_ref=omega_m, T_ahead=q.F_w * geo.r_eff, u_rp=0.0, f_pump=1.0, brake=0.0)
    return x, q, u, geo


def poles(p: Any) -> np.ndarray:
    """Eigenvalues of the speed loop at 50 rad/s, from differences of the twin's own rates."""
    x, q, u, geo = moving(p, 50.0)
    loop, step = (
        ("alpha_s", "alpha_s_dot", "T_I", "omega_m"),
        {"alpha_s": 1e-6, "alpha_s_dot": 1e-6, "T_I": 1.0, "omega_m": 1e-4},
    )

    def rate(x: Any) -> np.ndarray:
        found = secondary.rates(secondary.circuit(x, q, u, geo, p), x, q, u, geo, p)
        return np.array([getattr(found, name) for name in loop])

    columns = []
    for name in loop:
        h, at = step[name], getattr(x, name)
        columns.append((rate(x._replace(**{name: at + h})) - rate(x._replace(**{name: at - h}))) / (2.0 * h))
    return np.linalg.eigvals(np.array(columns).T)


def test_the_speed_loop_has_the_poles_of_an_inertia_behind_its_displacement_control():
    p = params(ideal=True, load="0 t", gas_held=True)
    w, zeta = crane().secondary.unit.servo.omega_n, crane().secondary.unit.servo.zeta
    K, T_i = crane().secondary.drive.K, crane().secondary.drive.T_i
    expected = np.roots([1.0, 2.0 * zeta * w, w * w, K * w * w, K * w * w / T_i])
    found = poles(p)
    for pole in expected:
        assert np.min(np.abs(found - pole)) < NUMERIC * abs(pole)
    assert np.max(found.real) < 0.0


def test_the_natural_frequency_of_the_speed_loop_is_that_of_gain_pressure_and_inertia():
    """omega_n^2 = K_alpha D p omega_swash / J, for a displacement control of first order and no integral."""
    quick = {"secondary": {"unit": {"servo": {"omega_n": "200 rad/s", "zeta": 5.0}}, "drive": {"T_i": "1000 s"}}}
    p = pack(changed(crane(ideal=True), quick), Scenario(**(BASE | {"load": "0 t", "gas_held": True}))).params
    x, q, u, geo = moving(p, 50.0)
    more = u._replace(omega_ref=u.omega_ref + 0.1)
    K_alpha = (secondary.circuit(x, q, more, geo, p).u_s - secondary.circuit(x, q, u, geo, p).u_s) / 0.1
    D, dp = p.rail.settings.D_m_max, p.rail.settings.p_set - p.rail.settings.p_lp
    closed = math.sqrt(K_alpha * D * dp * 20.0 * geo.i_J)  # omega_swash = omega_n/(2 zeta) = 20 rad/s
    swings = [abs(pole) for pole in poles(p) if pole.imag > 1.0]
    assert swings == [pytest.approx(closed, rel=FIRST_ORDER)]


def test_the_running_twin_answers_a_speed_command_as_the_linear_loop_does():
    """An empty hook on the wire adds its mass to the shaft's inertia."""
    result = run(
        ideal=True, **(moves("10 m/min") | {"load": "0 t", "gas_held": True, "duration": "40 s"}), every="0.01 s"
    )
    p = params(ideal=True, load="0 t")
    geo = secondary.geometry(400.0, p)
    J = 1.0 / geo.i_J
    K = crane().secondary.drive.K * J / (J + p.hoist.load.m * geo.r_eff**2)
    w, zeta, T_i = crane().secondary.unit.servo.omega_n, crane().secondary.unit.servo.zeta, crane().secondary.drive.T_i
    held = np.append(0.0, result.omega_ref.values[:-1])  # commands take effect a cycle later
    loop = ([K * w * w, K * w * w / T_i], [1.0, 2.0 * zeta * w, w * w, K * w * w, K * w * w / T_i])
    _, expected, _ = lsim(loop, held, result.time.values, interp=False)
    size = np.max(np.abs(expected))
    assert size > 20.0
    assert np.max(np.abs(result.omega_m.values - expected)) < LINEAR * size


@pytest.mark.thorough
def test_the_library_crane_is_stable_and_the_gain_of_a_damped_bare_loop_is_not(capsys, tmp_path):
    """Friction that falls with speed takes damping from the speed control at SWL."""
    soft = tmp_path / "soft.toml"
    soft.write_text('base = "nov-250t-secondary"\n[secondary.drive]\nK = "8.6 1/s"\n')
    told = []
    for name in ("nov-250t-secondary", str(soft)):
        cli.run(["stability", name])
        told.append(capsys.readouterr().out)
    assert ": STABLE at all" in told[0]
    assert "UNSTABLE" in told[1]
    assert "UNSTABLE" not in told[0]


# A lost load


def after(seconds: float, p: Any, F: float, F_read: float) -> tuple[Any, float]:
    """State, and highest hoisting and lowering speed, after the tension has become F and the cell reads F_read: rates
    of the twin in steps of 1 ms, and what its PLC feeds forward each cycle and one cycle late."""
    x, q, u, geo = moving(p, 0.0)
    q = types.SimpleNamespace(F_w=F)
    h, t_cycle, F_mean, highest = 1e-3, p.plc.t_cycle, p.hoist.load.W, 0.0
    tick = Tick(*[0.0] * len(Tick._fields))
    waiting = u
    for k in range(round(seconds / h)):
        if k % round(t_cycle / h) == 0:
            u = waiting
            F_mean += (F_read - F_mean) * t_cycle / (p.plc.tau_F + t_cycle)
            r = types.SimpleNamespace(F=F_read, p_hp=p.rail.settings.p_set)
            m = types.SimpleNamespace(F=F_mean, mode=0.0)
            waiting = u._replace(omega_ref=0.0, T_ahead=secondary.torque_ahead(0.0, 0.0, r, x, m, 0.0, tick, geo, p))
        u = u._replace(omega_ref=0.0)
        c = secondary.circuit(x, q, u, geo, p)
        rate = secondary.rates(c, x, q, u, geo, p)
        x = secondary.State(*(a + h * b for a, b in zip(x, rate, strict=True)))._replace(
            z=secondary.bristle_after(c, x, p, h)
        )
        highest = max(highest, abs(x.omega_m))
    return x, highest


def unguarded(p: Any) -> Any:
    return p._replace(drive=p.drive._replace(most=1e9))


@pytest.mark.parametrize("load", ["60 t", "125 t", "250 t"])
def test_a_winch_that_loses_its_load_does_not_run_away(load):
    """The setting goes back as soon as the load cell says so, and the speed control stops the drum."""
    p = params(load=load, mode="manual", tip="still")
    x, highest = after(3.0, p, 0.0, 1.0)
    assert highest < p.rail.n_full
    assert abs(x.omega_m) < 0.02 * p.drive.n_full
    soft = p._replace(drive=p.drive._replace(K=15.0))
    assert after(3.0, unguarded(soft), 0.0, 1.0)[1] > GUARD * after(3.0, soft, 0.0, 1.0)[1]


def test_beyond_its_speed_limit_a_unit_may_brake_and_no_longer_drive():
    p = params()
    for way in (1.0, -1.0):
        x, q, u, geo = moving(p, way * 1.01 * p.rail.n_full)
        for T in (1e6, -1e6):
            c = secondary.circuit(x, q, u._replace(T_ahead=T), geo, p)
            assert c.u_s == pytest.approx(0.0 if T * way > 0.0 else math.copysign(1.0, T))
        assert secondary.limits(c, x, q, u, p).overspeed == 1.0


def test_a_load_cell_that_reads_nothing_lets_the_load_sag_and_the_integral_takes_it():
    p = params(load="60 t", mode="manual", tip="still")
    x, highest = after(6.0, p, p.hoist.load.W, 0.0)
    assert 5.0 < highest < p.drive.n_full  # it sags
    assert abs(x.omega_m) < 1.0  # and stands again
    _, q, u, geo = moving(p, 0.0)
    T = q.F_w * geo.r_eff
    assert T - secondary.circuit(x, q, u, geo, p).g < x.T_I < T  # friction holds the rest


# Limits


def words(result: Any) -> set[str]:
    return set(result.status.item().split(", "))


def test_half_the_swl_on_a_sine_of_one_metre_passes_no_limit():
    result = run()
    assert words(result) == {"ok"}
    assert float(result.eta_c) > 0.97


@pytest.mark.parametrize(
    ("limit", "case"),
    [
        ("torque", {"load": "250 t", "tip": "sine 4 m 8 s"}),
        ("overspeed", {"tip": "sine 4 m 8 s"}),
        ("power", moves("55 m/min")),
        ("rail pressure", moves("55 m/min")),
        ("accumulator", moves("55 m/min")),
        ("relief", moves("-55 m/min")),
        ("cavitation", {"load": "200 t", "tip": "sine 4 m 12 s", "s_w": "100 m", "ramp": "0 s", "warm_up": "0 s"}),
        ("brake", moves("0 m/min") | {"tip": "sine 4 m 4.5 s", "load": "250 t"}),
    ],
)
def test_what_is_passed_is_named(limit, case):
    assert limit in words(run(**case))


def test_every_limit_has_a_case_above():
    assert set(crane().plant.type.causes.values()) == {
        "torque",
        "overspeed",
        "power",
        "rail pressure",
        "accumulator",
        "relief",
        "cavitation",
        "brake",
    }


def test_the_units_hold_the_swl_on_the_lowest_pressure_of_the_rail():
    rail, T = crane().secondary, (crane().SWL + crane().hook_mass) * G * 0.5 * crane().drum.d_max / crane().i_hD
    assert T < rail.unit.D_total * (rail.p_min - rail.p_lp)


@pytest.mark.parametrize("lowering", [False, True])
def test_the_steady_speed_limit_is_where_a_run_passes_the_power_units(lowering):
    p = params(load="200 t")
    geo = secondary.geometry(380.0, p)
    omega, cause = secondary.speed_limit(p, geo, p.hoist.load.W, lowering=lowering)
    assert cause == "power"
    sign = "-" if lowering else ""
    for share, passed in ((0.9, False), (1.1, True)):
        v = f"{sign}{share * omega * geo.r_eff * 60.0:.4f} m/min"
        assert ("power" in words(run(**(moves(v) | {"load": "200 t"})))) is passed


def test_more_load_is_never_faster_and_a_load_beyond_the_units_does_not_move():
    p = params()
    geo = secondary.geometry(200.0, p)
    for lowering in (False, True):
        speeds = [secondary.speed_limit(p, geo, m * 1e3 * G, lowering)[0] for m in range(0, 300, 25)]
        assert all(a >= b for a, b in pairwise(speeds))
    assert secondary.speed_limit(p, geo, 600e3 * G) == (0.0, "torque")


def test_a_brake_opens_only_when_the_units_carry_the_load():
    result = run(**(moves("10 m/min") | {"load": "200 t"}))
    opens = int(np.argmax(result.brake.values < 1.0))
    D, dp = crane().secondary.unit.D_total, crane().secondary.accumulator.gas.p_0 - crane().secondary.p_lp
    load = float(result.F_w[opens]) * secondary.geometry(400.0, params()).r_eff
    assert float(result.T_s[opens]) == pytest.approx(load, abs=1e6 * D)  # PROVED: 10 bar over the units
    assert float(result.s_w.values[: opens + 200].max()) < 400.0 + 0.01
    assert dp > 0.0


def test_a_lost_power_unit_does_not_slow_the_winch():
    """The accumulator carries the swell; the pumps that are left make up for what leaks."""
    whole, less = run(), run(power_loss=PowerLoss(time="10 s", unit=3))
    assert words(less) == {"ok"}
    assert float(less.e_c_pp) == pytest.approx(float(whole.e_c_pp), rel=0.01)


# The kernels


def mixed(n: int = VL) -> list[Scenario]:
    return [
        Scenario(**(BASE | {"load": f"{10 + 14 * i} t", "tip": f"sine {0.5 + 0.1 * i:.1f} m {7 + i % 5} s"}))
        for i in range(n)
    ]


def test_sixteen_lanes_give_the_bits_of_one():
    together = run_many(crane(), mixed(), n_sub=2)
    for i in (0, 5, 15):
        alone = run_one(crane(), mixed()[i], n_sub=2, every=0)
        assert flatten(alone.stats) == flatten(together[i].stats)
        assert alone.state == together[i].state


def test_half_the_step_makes_a_quarter_of_the_error():
    case = Scenario(**(BASE | {"duration": "12 s", "warm_up": "5 s"}))
    s_w = [run_one(crane(), case, n_sub=n, every=0).state.path.s_w for n in (2, 4, 64)]
    assert HALVED[0] * abs(s_w[0] - s_w[2]) < abs(s_w[1] - s_w[2]) < HALVED[1] * abs(s_w[0] - s_w[2])


@pytest.mark.thorough
@pytest.mark.parametrize("lanes", [1, VL])
def test_c_runs_the_same_physics(lanes, tmp_path):
    library = compile_c(c_source(secondary.NAME), tmp_path)
    run = getattr(library, f"run_{lanes}")
    array, n = ndpointer(np.float64, flags="C_CONTIGUOUS"), ctypes.c_int64
    run.argtypes, run.restype = [array, array, n, array, array, array, *[n] * 7, ctypes.c_double], None
    rows = []
    for c in (False, True):
        ready = [Ready(pack(crane(), case), CycleInputs(crane(), case)) for case in mixed(lanes)]
        block = ScenarioBlock(ready, lanes=lanes, n_sub=2, every=1)
        if c:
            block.d = types.SimpleNamespace(**(vars(driver(secondary.NAME, lanes)) | {"run": run}))
        for _ in block.steps():
            pass
        rows.append(block.out)
    scale = np.maximum(np.max(np.abs(rows[0]), axis=0), 1e-9)
    assert np.max(np.abs(rows[1] - rows[0]) / scale) < SAME_IN_C


@pytest.mark.thorough
def test_a_payload_is_lowered_set_down_and_left_without_losing_a_joule():
    stages = (
        Phase(mode="manual", speed="30 m/min", depth="20 m"),
        Phase(mode="landing", speed="6 m/min", tension="150 kN", landed=True),
        Phase(mode="manual", speed="6 m/min", time="10 s"),
    )
    tip = Sine(amplitude="0.3 m", period="10 s")
    case = Lowering(
        payload=read_payload("suction-anchor-85t"),
        h_tip="40 m",
        depth="40 m",
        start_depth="-3 m",
        duration="400 s",
        programme=stages,
        controller="position",
        tip=tip,
    )
    result = simulate(crane(), case)
    assert abs(float(result.energy_unaccounted)) < AUDIT
    assert float(result.omega_m_max) < crane().secondary.unit.n_max_full  # the guard: set down, it does not run away


# Its tables


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"p_min": "300 bar"}, "p_lp 15 bar, p_min 300 bar, accumulator.gas.p_0 280 bar, relief.p 350 bar must rise"),
        ({"drive": {"n_full": "2100 rev/min"}}, "drive.n_full 2100 rev/min is not below unit.n_max_full 2000 rev/min"),
        ({"drive": {"K": "60 1/s"}}, "drive.K 60 1/s makes the speed control unstable"),
        ({"drive": {"T_i": "0.05 s"}}, "drive.T_i 0.05 s makes the speed control unstable with every drive.K"),
        ({"drive": {"T_i": "0.07 s"}}, "Lower drive.K or raise drive.T_i"),
        ({"unit": {"D_max": "355 cm^3"}}, 'secondary.unit.D_max = "355 cm^3": unit "cm^3" is not one of m^3/rad'),
        ({"unit": {"count": 0}}, "secondary.unit.count = 0: it must be greater than or equal to 1"),
        ({"drive": {"load_ahead": 0.5}}, "secondary.drive.load_ahead = 0.5: it must be greater than or equal to 1"),
        ({"accumulator": {"V_stroke": "11 m^3"}}, "gas.V_0 5000 L is not above half of V_stroke"),
        ({"accumulator": {"V_strok": "9 m^3"}}, "unknown field"),
    ],
)
def test_a_table_that_cannot_be_is_refused_in_one_line(changes, text):
    with pytest.raises((SpecError, UnitError)) as refused:
        changed(crane(), {"secondary": changes})
    assert text in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_accumulator_that_the_gas_law_is_not_fitted_for_is_refused_with_its_own_name():
    tight = changed(crane(), {"secondary": {"accumulator": {"gas": {"V_0": "0.65 m^3"}}}})
    with pytest.raises(SpecError, match=r"^secondary\.accumulator: V_stroke 1\.2 m\^3 is too large"):
        simulate(tight, Scenario(**BASE))


def test_the_largest_speed_gain_is_where_the_loop_begins_to_swing():
    """Routh's criterion against the eigenvalues of the twin."""
    from stillhook.physics.hydraulics.secondary import largest_speed_gain

    servo, T_i = crane().secondary.unit.servo, crane().secondary.drive.T_i
    K = largest_speed_gain(servo.omega_n, servo.zeta, T_i)
    p = params(ideal=True, load="0 t", gas_held=True)
    for share, stable in ((0.99, True), (1.01, False)):
        found = poles(p._replace(drive=p.drive._replace(K=share * K)))
        assert bool(np.max(found.real) < 0.0) is stable


def test_compiled_physics_is_the_physics_that_python_runs():
    case = Scenario(**(BASE | {"duration": "0.5 s", "warm_up": "0.1 s", "ramp": "0.2 s"}))
    found = []
    for python in (False, True):
        block = ScenarioBlock([Ready(pack(crane(), case), CycleInputs(crane(), case))], lanes=1, n_sub=2, every=1)
        if python:
            block.d = types.SimpleNamespace(**(vars(block.d) | {"run": block.d.run.py_func}))
        for _ in block.steps():
            pass
        series = block.results()[0].series
        assert series is not None
        found.append(series)
    scale = np.max(np.abs(found[1]), axis=0) + 1e-6
    assert np.max(np.abs(found[0] - found[1]) / scale) < INTERPRETED


def notes(**case: Any) -> str:
    return str(run(**case).notes.values)


def test_units_too_small_for_the_load_and_a_stroke_too_short_for_the_motion_are_said_before_a_run():
    weak = changed(crane(), {"secondary": {"unit": {"count": 7}}, "inertia": {"J_m_eff": "4.27 kg m^2"}})
    case = Scenario(**(BASE | {"load": "250 t"}))
    assert "of the secondary units at 280 bar: the load will sink" in str(simulate(weak, case).notes.values)
    assert "the piston will run into its ends" in notes(load="250 t", tip="sine 8 m 30 s")
    assert "the piston" not in notes(load="250 t", tip="sine 8 m 30 s", gas_held=True)
