"""The published reduced model of the active circuit: its eigenfrequency, its integration as a reference, and the
one that belongs to an operating point of the complete plant."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import scipy

from stillhook.analysis.loop_stability.linear.linearisation import Linear, linearise
from stillhook.analysis.loop_stability.transfer import effective_radius
from stillhook.analysis.steady.operating_point import OperatingPoint
from stillhook.analysis.steady.steady_state import check_displacement, check_K_wire, motor_law
from stillhook.base.arrays import FloatArray
from stillhook.control.commands import feedback, feedforward, marginal_gain
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.pack.winch import NO_LIMIT, drum_record, gains, loop_record
from stillhook.errors import SimulationError, StillhookError
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.hydraulics.swash import Servo, displacement, swash_acceleration
from stillhook.physics.load_path.drum import K_wire as ratio_of
from stillhook.physics.scalar import clip
from stillhook.sea.motion.motion import Motion
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode

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
    pump = Servo(omega_n=a.pump.servo.omega_n, zeta=a.pump.servo.zeta, lo=-1.0, hi=1.0, rate=NO_LIMIT)
    motor = Servo(omega_n=a.motor.servo.omega_n, zeta=a.motor.servo.zeta, lo=a.motor.alpha_min, hi=1.0, rate=NO_LIMIT)
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


class Eigenfrequency(NamedTuple):
    """Undamped eigenfrequency omega_0 [rad/s], damping ratio zeta [-] and period [s] at displacement alpha_m [-];
    what they come from: C_h capacitance of one line [m^3/Pa], C_leak [m^3/s/Pa], J_m inertia at the motor shaft [kg
    m^2].
    """

    alpha_m: float
    omega_0: float
    zeta: float
    period: float
    C_h: float
    C_leak: float
    J_m: float


class GainLimit(NamedTuple):
    """Position gain of marginal stability K_p_ms [1/m] and the frequency omega_c at which the winch then oscillates
    [rad/s]."""

    alpha_m: float
    K_wire: float
    K_p_ms: float
    omega_c: float


def eigenfrequency(crane: Crane, alpha_m: float = 1.0) -> Eigenfrequency:
    r"""Eigenfrequency of the motors' inertia on the oil of one line.

    .. math:: \omega_0^2 = \frac{\beta D_m^2}{J V} + \frac{B_v C_1 \beta}{J V}, \qquad
              2 \zeta \omega_0 = \frac{B_v}{J} + \frac{C_1 \beta}{V}, \qquad D_m = D_{m,max}\,\alpha_m

    Parameters: crane; alpha_m displacement of the active motors over its maximum, above 0 and up to 1 [-].
    Errors: StillhookError for a displacement outside that range.
    Source: Moslatt 2020 paper C eqs 8 and 9 (paper E eqs 10 and 11). Valid while the other line's pressure is constant
    and the wire is slack to the winch: the load's own mode is left out. J is that of the full drum.
    Differs from print: C eq. 8 prints C_1 beta / J in the damping; it is C_1 beta / V.
    """
    check_displacement(alpha_m)
    a, loop = crane.active, loop_record(crane, alpha_m)
    omega_0 = math.sqrt(loop.a_0)
    return Eigenfrequency(
        alpha_m=alpha_m,
        omega_0=omega_0,
        zeta=loop.a_1 / (2.0 * omega_0),
        period=2.0 * math.pi / omega_0,
        C_h=capacitance(a.line.V, a.line.bulk_modulus),
        C_leak=a.C_leak,
        J_m=crane.inertia.J_m_eff,
    )


def gain_limit(crane: Crane, alpha_m: float = 1.0, K_wire: float = 1.0) -> GainLimit:
    r"""The position gain with which the winch is marginally stable: pump servo, hydraulics and integration in one loop.

    .. math:: s (s^2 + a_1 s + a_0)(s^2 + b_1 s + b_0) + K_p\,b_0\,g = 0, \qquad
              g = \frac{\beta D_m}{J V} D_p \omega_p \frac{d_{max}}{2 i_{hD} K_{wire}}

    with a_0 = omega_0^2, a_1 = 2 zeta omega_0 of the hydraulics and b_0, b_1 of the pump servo
    (`stillhook.control.commands`).

    Parameters: crane; alpha_m displacement of the active motors [-]; K_wire largest drum diameter over that in use, at
    least 1 [-].
    Errors: StillhookError for a displacement or a K_wire outside its range.
    Source: Moslatt 2020 paper E eqs 14 to 20 and figure 5, with the motors standing still in their stroke. The limit
    grows with the displacement as in that figure down to about a fifth of it; far below, where no mode goes, it rises
    again. Differs from print: paper E calls SSC pure feedforward. u_ff holds the measured alpha_m, so the motors' own
    loop changes with the tip's speed; the pump loop, and with it this limit, does not depend on it.
    """
    check_K_wire(K_wire)
    check_displacement(alpha_m)
    K_p_ms, omega_c = marginal_gain(loop_record(crane, alpha_m, K_wire))
    return GainLimit(alpha_m, K_wire, K_p_ms, omega_c)


class Equivalent(NamedTuple):
    """B_v slope of all torques against the motion by motor speed, wire rigid [N m s/rad], of which B_low is from the
    low line; C_leak leakage of the line at pressure [m^3/s/Pa]; J_m with the load hanging rigidly on the wire [kg m^2];
    K_wire [-]; omega_0 [rad/s], zeta [-], K_p_ms [1/m] of the reduced model with these."""

    B_v: float
    B_low: float
    C_leak: float
    J_m: float
    K_wire: float
    omega_0: float
    zeta: float
    K_p_ms: float


def equivalent(crane: Crane, point: OperatingPoint, linear: Linear | None = None) -> Equivalent:
    """The reduced model with the plant's own numbers at a point where the winch slides; linear: `linearise(point)`,
    where it is at hand.

    B_v holds the slope of the friction (Stribeck curve, with the bristle in its steady state), of the motors' turbulent
    and viscous losses, and of the passive circuit (piston friction, leakage), and what the low line adds: boost holds
    its pressure through the conductance G of its check valve, so that the line is a damper of D_m^2 / G and not a
    constant pressure. Valid for wires so short that the load follows the winch.
    """
    linear_point = linearise(point) if linear is None else linear
    A, n = _without_bristle(linear_point), {name: i for i, name in enumerate(linear_point.states)}
    J = 1.0 / point.geometry.i_J
    by_speed = A[n["omega_m"], n["omega_m"]] + A[n["omega_m"], n["v_load"]] * point.geometry.r_eff
    pressed, low = ("p_a", "p_b") if point.p_a >= point.p_b else ("p_b", "p_a")
    C_leak, G_low = (-float(A[n[p], n[p]]) / point.params.active.i_C_h for p in (pressed, low))
    B_low = (crane.active.motor.D_total * point.alpha_m) ** 2 / G_low
    B_v = -J * float(by_speed) + B_low
    J_m = J + point.params.hoist.load.m * point.geometry.r_eff**2
    K_wire = float(ratio_of(point.geometry.d, drum_record(crane)))
    hydraulic = crane.model_copy(
        update={
            "inertia": crane.inertia.model_copy(update={"J_m_eff": J_m}),
            "control": crane.control.model_copy(update={"B_v": B_v}),
            "active": crane.active.model_copy(update={"C_leak": C_leak}),
        }
    )
    e = eigenfrequency(hydraulic, point.alpha_m)
    return Equivalent(
        B_v=B_v,
        B_low=B_low,
        C_leak=C_leak,
        J_m=J_m,
        K_wire=K_wire,
        omega_0=e.omega_0,
        zeta=e.zeta,
        K_p_ms=gain_limit(hydraulic, point.alpha_m, K_wire).K_p_ms,
    )


def _without_bristle(linear: Linear) -> FloatArray:
    """A with the bristle in its steady state, where it is far faster than all else."""
    A, z = linear.A, linear.states.index("z")
    if A[z, z] == 0.0:
        return A
    return np.asarray(A - np.outer(A[:, z], A[z]) / A[z, z])
