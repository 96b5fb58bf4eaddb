"""The published reduced model of the active circuit, integrated as a reference: paper E equations 1 to 11 with one line
at constant pressure, by an explicit solver of order 8."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy

from stillhook.analysis.loop_stability.transfer import effective_radius
from stillhook.analysis.steady.steady_state import motor_law
from stillhook.base.arrays import FloatArray
from stillhook.control.commands import feedback, feedforward
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.pack.winch import gains
from stillhook.errors import SimulationError, StillhookError
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.hydraulics.swash import Servo, displacement, swash_acceleration
from stillhook.physics.scalar import clip
from stillhook.sea.motion.motion import Motion
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.winches.circuits.tables import NO_LIMIT

RTOL = 1e-9
LONGEST_STEP = 0.05
"""Longest step of the solver [s]: shorter than the pump servo's and the circuit's time constants, so that no kink is
stepped over."""


class Reduced(NamedTuple):
    """Series over time t [s]: e_c [m], p_a and p_b [Pa], omega_m [rad/s], v_w [m/s], alpha_p and alpha_m [-]."""

    t: FloatArray
    e_c: FloatArray
    p_a: FloatArray
    p_b: FloatArray
    omega_m: FloatArray
    v_w: FloatArray
    alpha_p: FloatArray
    alpha_m: FloatArray

    def e_c_pp(self, start: float = 0.0) -> float:
        """Peak-to-peak control error from `start` [s] on [m]."""
        return float(np.ptp(self.e_c[self.t >= start]))

    def dp_max(self, start: float = 0.0) -> float:
        """Largest magnitude of p_a - p_b from `start` [s] on [Pa]."""
        return float(np.max(np.abs((self.p_a - self.p_b)[self.t >= start])))


def simulate_reduced(
    crane: Crane,
    tip: Motion,
    *,
    mode: Mode | str = DEFAULT_MODE,
    duration: float = 72.0,
    every: float = 0.002,
    K_wire: float = 1.0,
) -> Reduced:
    r"""Heave compensation with the reduced model, from rest with full motor displacement.

    .. math:: J \dot\omega_m = D_m (p_a - p_b) - B_v \omega_m, \qquad
              \frac{V}{\beta} \dot p_a = D_p \omega_p \alpha_p - D_m \omega_m - C_{leak} (p_a - p_b), \qquad p_b =
              p_{boost}

    with both displacement controls of second order, the feedforward and feedback of the PLC, and the mode's own law for
    the motors.

    Parameters: tip motion, not ramped; mode (the load cell demands nothing); duration and spacing of the series [s];
    K_wire largest drum diameter over that in use [-]. K_1 and K_2 are the crane's: derived (ideal) unless its file
    gives them.
    Errors: StillhookError for times that make no series, SimulationError where the solver gives up.
    Source: Moslatt 2020 paper E eqs 1 to 11, table 2.
    Differs from print: hoisting counts positive (paper E prints the mirror image); the pump command is held in [-1, 1]
    and the displacements within their stroke; p_b is constant, without which E eq. 11 does not hold.
    """
    rates = _rates(crane, tip, Mode(mode), K_wire)
    if not (duration >= every > 0.0):
        raise StillhookError(
            f"duration {duration:g} s, every {every:g} s: give times above 0, the spacing not longer than the duration."
        )
    times = np.asarray(np.arange(round(duration / every) + 1) * every, dtype=np.float64)
    scale = np.array([1.0, 1.0, 1.0, 1.0, 1e3, 1e8, 1.0])  # of alpha_m, alpha_p and their rates, omega_m, dp, e_c
    start = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    end = float(times[-1])
    run = scipy.integrate.solve_ivp(
        rates, (0.0, end), start, method="DOP853", t_eval=times, rtol=RTOL, atol=1e-10 * scale, max_step=LONGEST_STEP
    )
    if not run.success:
        raise SimulationError(f"reduced model: {run.message}")
    alpha_m, _, alpha_p, _, omega_m, dp, e_c = run.y
    p_b = np.full_like(times, crane.active.boost.p)
    return Reduced(
        t=times,
        e_c=e_c,
        p_a=dp + p_b,
        p_b=p_b,
        omega_m=omega_m,
        v_w=omega_m * effective_radius(crane, K_wire),
        alpha_p=alpha_p,
        alpha_m=alpha_m,
    )


def _rates(crane: Crane, tip: Motion, mode: Mode, K_wire: float) -> Callable[[float, Any], list[float]]:
    """Time derivatives of alpha_m, its rate, alpha_p, its rate, omega_m, dp = p_a - p_b, e_c."""
    a, J_m, B_v, r_eff = crane.active, crane.inertia.J_m_eff, crane.control.B_v, effective_radius(crane, K_wire)
    C_h = capacitance(a.line.V, a.line.bulk_modulus)
    Q_p_max = a.pump.D_total * a.pump.omega_p
    pump = Servo(
        omega_n=a.pump.servo.omega_n, zeta=a.pump.servo.zeta, lo=-1.0, hi=1.0, rate=NO_LIMIT, rate_down=NO_LIMIT
    )
    motor = Servo(
        omega_n=a.motor.servo.omega_n,
        zeta=a.motor.servo.zeta,
        lo=a.motor.alpha_min,
        hi=1.0,
        rate=NO_LIMIT,
        rate_down=NO_LIMIT,
    )
    ahc, law = gains(crane), motor_law(crane, mode, K_wire=K_wire)

    def rates(t: float, x: Any) -> list[float]:
        _, v, acc = tip.sample(t)
        v_tip = float(v)
        alpha_m, alpha_p = displacement(float(x[0]), motor), displacement(float(x[2]), pump)
        D_m, omega_m, dp = a.motor.D_total * alpha_m, float(x[4]), float(x[5])
        u_ff = feedforward(v_tip, float(acc), K_wire, alpha_m, ahc)
        u_p = clip(u_ff + feedback(float(x[6]), ahc), -1.0, 1.0)
        return [
            float(x[1]),
            swash_acceleration(float(x[0]), float(x[1]), law(u_ff), motor),
            float(x[3]),
            swash_acceleration(float(x[2]), float(x[3]), u_p, pump),
            (motor_torque(D_m, dp) - B_v * omega_m) / J_m,
            (Q_p_max * alpha_p - D_m * omega_m - a.C_leak * dp) / C_h,
            v_tip + omega_m * r_eff,
        ]

    return rates
