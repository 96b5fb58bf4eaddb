"""The reduced model against an independent integrator on the printed equations, and the engine against the reduced
model."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from trials.reduced_model import simulate_reduced

from stillhook import Scenario, Sine, load_crane, simulate
from stillhook.engine.pack.winch import gains, pack
from stillhook.library import changed
from stillhook.physics.load_path.drum import K_wire as ratio_of

CRANE = load_crane("nov-250t")
MICROMETRE = 1e-6  # of wire: what a reference has to be sure to
# of wire: PLC cycle of 0.1 ms at 1.5 m/s, wire leaving the drum (5.6 m: 0.5 % of inertia), a third of the motors' leak
# outwards
ENGINE = 2.5e-4
TABLE_2 = Sine(amplitude="2.8 m", period="12 s", phase="-90 deg")


@pytest.mark.thorough
@pytest.mark.parametrize("tip", [TABLE_2, Sine(amplitude="1.2 m", period="6 s", phase="-90 deg")])
def test_ssc_agrees_with_the_equations_as_printed(tip: Sine):
    """Paper E eqs 1 to 11 in their own signs (paying out positive) and their own letters, p_B constant, under LSODA."""
    a, c = CRANE.active, CRANE.control
    k_1, k_2, _ = gains(CRANE)
    C = a.line.V / a.line.bulk_modulus
    lever = CRANE.drum.d_max / (CRANE.i_hD * 2.0)
    D_max, D_min, u_thr = a.motor.D_total, a.motor.D_total * a.motor.alpha_min, c.u_thr

    def rates(t: float, x: np.ndarray) -> list[float]:
        a_m, a_m_dot, a_p, a_p_dot, w_m, p, e = x
        _, v, acc = (float(y) for y in tip.sample(t))
        alpha_m, alpha_p = min(max(a_m, D_min / D_max), 1.0), min(max(a_p, -1.0), 1.0)
        u_ff = (k_1 * v + k_2 * acc) * alpha_m
        k_red = min(max(abs(u_ff) / (1.0 - u_thr) - u_thr / (1.0 - u_thr), 0.0), 1.0)
        u_m = 1.0 - k_red * (D_max - D_min) / D_max
        u_p = min(max(u_ff + c.K_p * e, -1.0), 1.0)
        return [
            a_m_dot,
            a.motor.servo.omega_n**2 * (u_m - a_m) - 2.0 * a.motor.servo.zeta * a.motor.servo.omega_n * a_m_dot,
            a_p_dot,
            a.pump.servo.omega_n**2 * (u_p - a_p) - 2.0 * a.pump.servo.zeta * a.pump.servo.omega_n * a_p_dot,
            (D_max * p * alpha_m - c.B_v * w_m) / CRANE.inertia.J_m_eff,
            (a.pump.D_total * a.pump.omega_p * alpha_p - alpha_m * D_max * w_m - a.C_leak * p) / C,
            v - w_m * lever,
        ]

    run = simulate_reduced(CRANE, tip, duration=30.0, every=0.05)
    atol = 1e-12 * np.array([1.0, 1.0, 1.0, 1.0, 1e3, 1e8, 1.0])
    other = solve_ivp(
        rates, (0.0, 30.0), [1.0, 0, 0, 0, 0, 0, 0], method="LSODA", t_eval=run.t, rtol=1e-11, atol=atol, max_step=0.01
    )
    assert np.max(np.abs(other.y[6] - run.e_c)) < MICROMETRE
    assert np.min(run.alpha_m) < 0.95
    assert np.max(np.abs(other.y[5] + (run.p_a - run.p_b))) < 100.0  # Pa of 6e6: paying out positive turns the sign


def ideal():
    """The crane with the assumptions of the reduced model: friction B_v alone, all leakage in the motors, a low line
    that boost and flushing hold, no weight on the hook, a PLC of 0.1 ms that looks half a cycle ahead."""
    n = CRANE.active.motor.count + CRANE.passive.motor.count
    no_loss = {"X_1": "0 N m s/rad", "X_2": "0 N m s^2/rad^2/(m^3/rad)^3", "X_3": 0.0, "X_4": "0 N m", "X_5": "0 m^5/N"}
    leak = {"C_1": f"{0.4 / CRANE.active.motor.count} L/min/bar", "C_2": "0 L/min/bar/(rev/min)"}
    held = {"conductance": "2000 L/min/bar"}
    friction = {
        "Y_1": 0.0,
        "Y_2": "0 N m",
        "Y_3": "0 N m",
        "Y_4": "229 rev/min",
        "Y_5": f"{CRANE.control.B_v / n} N m s/rad",
        "Y_6": 0.0,
    }
    return changed(
        CRANE,
        {
            "hook_mass": "0.001 t",
            "active": {
                "motor": {"loss": no_loss, **leak},
                "pump": {"leak_scale": 1e-9},
                "boost": {"p": "1 bar", **held},
                "flushing": {"dp_open": "0 bar", "dp_shuttle": "0.01 bar", **held},
            },
            "passive": {"motor": {"loss": no_loss}},
            "friction": {"system": friction},
            "control": {"t_cycle": "0.1 ms", "t_lead": "0.05 ms"},
        },
    )


@pytest.mark.thorough
@pytest.mark.parametrize(("mode", "amplitude"), [("ssc", "2.8 m"), ("level-1", "1.5 m")])
def test_engine_with_the_reduced_models_assumptions_is_the_reduced_model(mode: str, amplitude: str):
    """Compiled Runge-Kutta with all its valves, bristle, passive circuit and PLC, against DOP853 on seven states."""
    crane, tip = ideal(), Sine(amplitude=amplitude, period="12 s", phase="-90 deg")
    case = Scenario(load="0 t", s_w="15 m", mode=mode, duration="24 s", ramp="0 s", warm_up="0 s", tip=tip)
    run = simulate(crane, case, every="20 ms", step="0.1 ms")
    packed = pack(crane, case)
    geo = packed.plant.geometry(15.0, packed.params)
    there = crane.model_copy(update={"inertia": crane.inertia.model_copy(update={"J_m_eff": 1.0 / geo.i_J})})
    reduced = simulate_reduced(
        there, tip, mode=mode, duration=24.0, every=0.02, K_wire=float(ratio_of(geo.d, packed.params.hoist.drum))
    )
    n = min(len(run["time"]), len(reduced.t))
    assert np.max(np.abs(run["e_c"].values[:n] - reduced.e_c[:n])) < ENGINE
    assert np.ptp(reduced.e_c) > 50.0 * ENGINE
    dp = (run["p_a"] - run["p_b"]).values[:n] - (reduced.p_a - reduced.p_b)[:n]
    assert np.max(np.abs(dp)) < 0.5e5  # half a bar of 60
