"""Columns of the balances of a half wave: oil of the active circuit, gas of the accumulators, settings behind their
commands."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.live.estimate.balance import Balance
from stillhook.physics.hydraulics.accumulator import piston_loss
from stillhook.physics.hydraulics.lines import external_leakage, internal_leakage
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.pump import LEAK_KNOTS, pump_flow
from stillhook.spec.crane import passive_of

FLOW = (
    "motors",  # what the motors swallow by their reading [m^3/s]
    "full",  # the same at full displacement [m^3/s]
    "rate",  # rate of the first [m^3/s^2]
    "leak",  # leakage of the crane file [m^3/s]
    "one",  # 1e-2
    "pumps",  # what the pumps give by their setting [m^3/s]
    "storage",  # what compression takes [m^3/s]
    "slip",  # what SLIP of the pumps' drives takes [m^3/s]
    "p_a",  # leakage per error of each transmitter [m^3/s/Pa]
    "p_b",
    "head",  # leakage per conductance [Pa],
    "stroke",  # per conductance at full stroke [Pa],
    "speed",  # per conductance and speed [Pa rad/s],
    "pressure",  # per conductance that is added up to SLIP_PRESSURE [Pa]
    "side",  # sign of the pressure drop
)
"""Oil of the line under pressure."""
GAS = (
    "gas",  # what the crane file's gas makes of the oil that comes in [Pa]
    "flow",  # what the passive motors swallow [m^3/s]
    "time",  # [s]
    "p_hp",  # pressure as read [Pa]
    "setting",  # what the file's gas makes of an error of the motors' setting [Pa]
    "make_up",  # of the make-up [Pa]
    "piston",  # and of the piston's resistance, by the pressure of the gas behind it [Pa]
)
"""Pressure of the gas; each about the half wave's mean."""
DELAY = ("setting", "rate", "one", "reading")
"""Setting of the crane file's control under the logged command, its rate [1/s], 1, and the reading."""
BINS = 0.02
"""Width of the means that flows are compared by [s]: longer ones damp the ringing of the circuit in the rate of its
pressure more than in its flow, which looked like 6 ms of the clock."""
CLEAR_SIDE = 5e5
"""Pressure drop from which it is clear which line is under pressure [Pa]: ten times the drift of a transmitter."""
SLIP, SLIP_PRESSURE = 0.01, 250e5
"""Slip of asynchronous drives, and where it is [Pa] (as `stillhook.validate.parameters.leak_laws`; assumed)."""
MOVED = 0.03
"""Least motion of a setting within a half wave [-]: sixty times the noise of a reading."""
COMMANDS = {"pump_delay": ("follow_p", "alpha_p"), "motor_delay": ("follow_m", "alpha_m")}
"""Balances of delay: settings that follow the commands, as `FrictionEstimator` completes them, and readings."""

Rows = Mapping[str, FloatArray]


def balances(x: Rows, t: FloatArray, omega: FloatArray, of: Balance) -> dict[str, FloatArray]:
    """Sums of products by balance of the samples x (n,) of a half wave at times t [s], with the motor speed at the same
    moments [rad/s]; without those whose signals are not there."""
    out = {"flow": flow(x, t, omega, of), "gas": gas(x, t, omega, of)}
    for name, (follows, reading) in COMMANDS.items():
        both = (
            np.stack([x[n] for n in (follows, reading)]) if follows in x and reading in x else np.full((2, 1), np.nan)
        )
        if np.isfinite(both).all() and np.ptp(both[0]) > MOVED:
            Z = np.column_stack([both[0], np.gradient(both[0], t), np.ones(len(t)), both[1]])
            out[name] = Z.T @ Z
    return {name: G for name, G in out.items() if G is not None}


def flow(x: Rows, t: FloatArray, omega: FloatArray, of: Balance) -> FloatArray | None:
    """Flow balance of the line under pressure, in means over BINS where rows are closer; None without the pumps'
    setting. The other line is left out: boost and flushing valves feed and drain it."""
    if "alpha_p" not in x or not np.isfinite(x["alpha_p"]).all():
        return None
    A = of.params.active
    step = float(np.median(np.diff(t)))
    place = ((t - t[0]) / BINS).astype(np.intp) if step < 0.75 * BINS else np.arange(len(t))
    count = np.bincount(place)
    if (count == 0).any() or len(count) < 5:
        return None

    def binned(y: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(place, y) / count)

    D = A.motors.count * A.motors.D_max
    q, full, at = binned(D * x["alpha_m"] * omega), binned(D * omega), binned(t)
    alpha_p, p_a, p_b = binned(x["alpha_p"]), binned(x["p_a"]), binned(x["p_b"])
    dp, higher = p_a - p_b, np.maximum(p_a, p_b)
    sign, Q = np.sign(dp), pump_flow(alpha_p, A.pumps)
    C = np.interp(np.abs(alpha_p), LEAK_KNOTS, A.pumps.leak) + motor_leakage(full / D, A.motors)
    across, case = internal_leakage(C, 1.0), external_leakage(C, 1.0)
    head = internal_leakage(1.0, dp) + external_leakage(1.0, sign * higher)
    columns = (
        q,
        full,
        np.gradient(q, at),
        C * head,
        np.full(len(q), 1e-2),
        Q,
        sign / A.i_C_h * np.gradient(higher, at),
        SLIP * A.pumps.D_max * A.pumps.omega_p * alpha_p**2 * dp / SLIP_PRESSURE,
        across + case * (p_a > p_b),
        -across - case * (p_b > p_a),
        head,
        np.abs(alpha_p) * head,
        np.abs(full / D) * head,
        np.abs(dp) / SLIP_PRESSURE * head,
        sign,
    )
    clear = np.abs(dp) > CLEAR_SIDE
    clear[[0, -1]] = False  # slopes of the ends are one-sided, the last mean is of a part of its width
    Z = np.column_stack(columns)[clear]
    return np.asarray(Z.T @ Z) if len(Z) else None


def standing(x: Rows, omega: FloatArray, of: Balance) -> FloatArray:
    """Pressure of the standing piston [Pa]: p_hp less what the oil of the motors costs by the crane file."""
    P = of.params.passive
    if of.gas_side:
        return x["p_hp"]
    return np.asarray(x["p_hp"] - piston_loss(-P.motors.count * P.motors.D_max * x["alpha_pm"] * omega, P.accumulator))


def gas(x: Rows, t: FloatArray, omega: FloatArray, of: Balance) -> FloatArray | None:
    """Answer of the passive pressure to the oil that the motors move; dry friction of the piston is one number within a
    half wave, and leaves with the mean. None without a passive circuit.

    .. math:: \\Delta p = \\int \\frac{n p^2}{c\\,p_0 V_0}\\,Q\\,dt + R\\,\\Delta Q + a\\,\\Delta t
    """
    if "make_up" not in x or not np.isfinite(x["make_up"]).all():
        return None
    P, file = of.params.passive, passive_of(of.crane).accumulator.gas
    D, p = P.motors.count * P.motors.D_max, standing(x, omega, of)
    stiff = file.n * p**2 / (file.p_0 * file.V_0)
    oil = x["make_up"] - D * x["alpha_pm"] * omega

    def integral(rate: FloatArray) -> FloatArray:
        return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])

    columns = (
        integral(stiff * oil),
        D * x["alpha_pm"] * omega,  # make-up left out: where the PLC reads another pressure, its flow is out of phase
        t,
        x["p_hp"],
        integral(stiff * D * omega),
        integral(stiff * x["make_up"]),
        integral(2.0 * stiff * piston_loss(oil, P.accumulator) / p * oil),
    )
    Z = np.column_stack([y - y.mean() for y in columns])
    return np.asarray(Z.T @ Z)
