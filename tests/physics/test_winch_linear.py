"""Runs of winches within their limits against linear closed forms: oil that rings, the loop of a cylinder.

Where oil rings the wire is long, and soft beside it: it adds its stiffness to the closed form, and the load hardly moves.
"""

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import curve_fit

from stillhook import Profile, Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack, wire_speed_max
from stillhook.library import changed
from stillhook.spec.scenario import Operator
from stillhook.winches.types import open_circuit

FREQUENCY = 5.0e-3
"""Relative: the spool moves by a tenth of its opening and the closed form takes the mean; the load swings at 4 rad/s."""
DAMPING = 0.03
"""Of the damping ratio: what is left of the swing after four periods, of which the load's is taken away by a fit."""
ROD = 1.0e-3
"""Relative: nothing but the oil, the gas and the wire holds the rod; the fit is good to 1e-4."""
LOOP = 0.01
"""Of the error: the oil's compression, and the gas as a spring beside the pumps."""
NO_LOSS = {
    "X_1": "0 N m s/rad",
    "X_2": "0 N m s^2/rad^2/(m^3/rad)^3",
    "X_3": 0.0,
    "X_4": "0 N m",
    "X_5": "0 m^5/N",
}


def swing(t: np.ndarray, y: np.ndarray, omega: float, slow: float) -> tuple[float, float]:
    """Frequency [rad/s] and decay [1/s] of the swing in y that is near omega; beside it a mean and one near `slow`."""

    def model(t: np.ndarray, *x: float) -> Any:
        mean, a, phase, w, decay, b, lag, w_2, decay_2 = x
        return mean + a * np.exp(-decay * t) * np.cos(w * t + phase) + b * np.exp(-decay_2 * t) * np.cos(w_2 * t + lag)

    first = [y.mean(), np.ptp(y), 0.0, omega, 0.05 * omega, np.ptp(y), 0.0, slow, 0.1]
    fitted, _ = curve_fit(model, t - t[0], y, p0=first, maxfev=40000)
    assert np.std(y - model(t - t[0], *fitted)) < 1e-3 * np.ptp(y)
    return math.hypot(fitted[3], fitted[4]), float(fitted[4])


def matched() -> Any:
    """The open-circuit winch between a constant supply and an empty tank line, without friction and leak."""
    tables = {
        "motor": {"C_1": "0 L/min/bar", "C_2": "0 L/min/bar/(rev/min)", "loss": NO_LOSS},
        "valve": {"Q_N": "80 L/min", "dp_laminar": "0.5 bar"},
        "counterbalance": {"Q_N": "5000 L/min", "p_check": "0 bar"},
        "tank": {"p": "0 bar", "conductance": "0 L/min/bar"},
        "pump": {"p_standby": "200 bar", "p_max": "200 bar", "C_leak": "0 L/min/bar", "dp_droop": "0.2 bar"},
        "supply": {"V": "2000 L"},
        "drive": {"share": 0.0},
    }
    system = {"Y_1": 0.0, "Y_2": "0 N m", "Y_3": "0 N m", "Y_5": "0 N m s/rad", "Y_6": 0.0}
    return changed(load_crane("utility-20t-open-circuit"), {"open": tables, "friction": {"system": system}})


@pytest.mark.parametrize("speed", [6.0, 12.0])
def test_the_shaft_of_a_valve_controlled_winch_rings_as_merritt_says(speed: float) -> None:
    """omega_h = sqrt(4 beta D^2/(V_t J)) and zeta = (K_ce/D) sqrt(beta J/V_t), after the operator asks for 1 m/min more."""
    steps = (("0 s", 0.0), ("3 s", speed), ("30 s", speed), ("30.05 s", speed + 1.0), ("60 s", speed + 1.0))
    case = Scenario(
        load="10 t", s_w="600 m", tip="still", mode="manual", duration="34 s", warm_up="0 s", ramp="0 s",
        operator=Operator(profile=tuple((t, f"{v} m/min") for t, v in steps)),
    )  # fmt: skip
    crane = matched()
    run = simulate(crane, case, every="10 ms", step="1 ms")
    p = pack(crane, case).params
    late = (run.time.values > 30.25) & (run.time.values < 33.0)
    mean = {name: float(run[name].values[late].mean()) for name in ("p_a", "p_b", "p_s", "omega_m", "s_w")}
    geo = open_circuit.geometry(mean["s_w"], p)
    J, C_t = 1.0 / geo.i_J, 2.0 / p.A.i_C_h
    K_ce = p.A.D_m * mean["omega_m"] / (2.0 * (mean["p_s"] - mean["p_a"] + mean["p_b"]))
    k_wire = p.hoist.wire.EA / (p.hoist.wire.L_0 + mean["s_w"]) * geo.r_eff**2
    omega_h = math.sqrt(4.0 * p.A.D_m**2 / (C_t * J) + k_wire / J)
    omega, decay = swing(run.time.values[late], run.omega_m.values[late], omega_h, 4.0)
    assert omega == pytest.approx(omega_h, rel=FREQUENCY)
    assert decay == pytest.approx(2.0 * K_ce / C_t, rel=DAMPING)  # zeta times omega_h


NO_ROD_LOSS: dict[str, Any] = {
    "friction": {"F_c": "1e-3 N", "mu": 0.0, "b": "0 N s/m", "sigma_1_ratio": 0.0},
    "passive": {"accumulator": {"R_piston": "0 bar/(L/min)"}},
}


@pytest.mark.parametrize("K_p", [0.2, 0.4])
@pytest.mark.parametrize(("amplitude", "period"), [(1.0, 10.0), (0.5, 7.0), (0.3, 5.0)])
def test_a_cylinder_slower_than_its_pumps_compensates_as_well_as_its_loop(
    amplitude: float, period: float, K_p: float
) -> None:
    """e/s_tip = (1 - F)/(1 + K_p v_max H/s): H the pumps' second order behind the PLC's dead time, F = (1 + s 2 zeta /
    omega_n) H the feedforward; the dead time is a cycle of computing and half a hold."""
    cylinder = NO_ROD_LOSS | {"pump": {"C_leak": "0 L/min/bar"}}
    control = {"K_p": f"{K_p} 1/m", "position": {"K_dp": "0 1/bar"}}
    crane = changed(load_crane("nov-100t-cylinder"), {"control": control, "cylinder": cylinder})
    tip = f"sine {amplitude} m {period} s"
    case = Scenario(load="5 t", s_w="20 m", tip=tip, mode="position", duration="90 s", warm_up="20 s")
    run = simulate(crane, case, every="10 ms")
    s, servo = 2j * math.pi / period, crane.cylinder.pump.servo
    w, zeta, dead_time = servo.omega_n, servo.zeta, 1.5 * crane.control.t_cycle
    H = w * w / (s * s + 2.0 * zeta * w * s + w * w) * np.exp(-s * dead_time)
    closed = abs((1.0 - (1.0 + 2.0 * zeta / w * s) * H) / (1.0 + K_p * wire_speed_max(crane) * H / s))
    assert float(run.eta_c) == pytest.approx(1.0 - closed, abs=LOOP * closed)
    assert "pump flow" not in run.status.item()


def test_the_rod_of_a_compensating_cylinder_rings_on_its_oil() -> None:
    """sqrt(4 beta A^2/(V_t m)) at mid stroke, with wire and gas beside it, after the tip has begun to move at once."""
    crane = changed(
        load_crane("nov-100t-cylinder"),
        {
            "control": {"K_p": "0 1/m", "position": {"K_dp": "0 1/bar"}},
            "wire": {"zeta": 0.0, "zeta_low": 0.0, "zeta_high": 0.0},
            "cylinder": {
                "pump": {"C_leak": "0 L/min/bar", "servo": {"omega_n": "60 Hz", "rate_max": "50 1/s"}},
                "friction": {"F_c": "1e-3 N", "mu": 0.0, "b": "0 N s/m", "sigma_1_ratio": 0.0},
                "passive": {"accumulator": {"R_piston": "0 bar/(L/min)"}},
                "flushing": {"conductance": "0 L/min/bar"},
                "boost": {"conductance": "0.001 L/min/bar"},
            },
        },
    )
    points = (("0 s", 0.0), ("20 s", 0.0), ("20.03 s", 0.05), ("23 s", 0.05), ("23.1 s", 0.0))
    tip = Profile(points=tuple((t, f"{v} m/s") for t, v in points))
    case = Scenario(load="50 t", s_w="1800 m", tip=tip, mode="position", duration="24 s", warm_up="0 s", ramp="0 s")
    run = simulate(crane, case, every="10 ms", step="1 ms")
    table, wire = crane.cylinder, pack(crane, case).params.hoist.wire
    late = (run.time.values > 20.3) & (run.time.values < 22.3)
    V_t = 2.0 * table.line.V + table.A_a * table.x_max
    k_oil = 4.0 * table.line.bulk_modulus * table.A_a**2 / V_t
    k_wire = table.falls**2 * wire.EA / (wire.L_0 + float(run.s_w.values[late].mean()))
    gas = table.passive.accumulator.gas
    k_gas = gas.n * float(run.p_hp.values[late].mean()) * table.passive.A**2 / gas.V_0
    expected = math.sqrt((k_oil + k_wire + k_gas) / table.m)
    omega, decay = swing(run.time.values[late], run.v_rod.values[late], expected, 2.0)
    assert omega == pytest.approx(expected, rel=ROD)
    assert abs(decay) < ROD * omega  # nothing takes its energy
    assert k_oil > 25.0 * (k_wire + k_gas)
