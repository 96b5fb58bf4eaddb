"""The published linear models: active circuit, position loop, complete controller about a steady tip speed.

Source: Moslatt 2020 paper C eqs 1 to 9 and paper E eqs 12 to 21, corrected. One line holds its pressure, B_v represents
all friction (never together with the friction models), one conductance for all leakage, and the drum turns on its
published outer diameter. Hoisting is positive.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.analysis.loop_stability.loops import ContinuousLoop, SampledLoop, balanced, sampled
from stillhook.analysis.steady.steady_state import check_displacement, layer_row, motor_law, steady
from stillhook.base.arrays import FloatArray
from stillhook.control.registry import DEFAULT_MODE
from stillhook.engine.pack.winch import gains
from stillhook.errors import StillhookError
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.winches.circuits.tables import ServoVariant

SLOPE_STEP = 1.0e-6
"""Half width of the differences of a controller's law by the feedforward [-]."""
LOOP = ("alpha_p", "alpha_p_dot", "dp", "omega_m", "s_hoisted")
FULL_LOOP = ("alpha_m", "alpha_m_dot", *LOOP[:4], "e_c")
"""Names of states: those of `stillhook.variables`, their rates [1/s], s_hoisted = -s_w [m], dp = p_a - p_b [Pa]."""


class About(NamedTuple):
    """Steady operation that the complete model is linearised about: v_tip [m/s]; alpha_m [-]; u_ff feedforward [-],
    omega_m [rad/s], dp = p_a - p_b [Pa]; slope of the motors' command by |u_ff| [-], 0 where SSC does not move them."""

    v_tip: float
    alpha_m: float
    u_ff: float
    omega_m: float
    dp: float
    slope: float


def effective_radius(crane: Crane, K_wire: float = 1.0) -> float:
    """Wire per motor angle on the published outer diameter over K_wire [m/rad]."""
    return crane.drum.d_max / (2.0 * crane.i_hD * K_wire)


def on_layer(crane: Crane, layer: int) -> tuple[Crane, float]:
    """The crane with the inertia of a drum whose outermost full layer is `layer`, and K_wire there.

    Errors: ScenarioError for a layer that the drum does not have.
    """
    row = layer_row(crane, layer)
    inertia = crane.inertia.model_copy(update={"J_m_eff": float(row["J_m"])})
    return crane.model_copy(update={"inertia": inertia}), float(row["K_wire"])


def circuit_matrices(crane: Crane, alpha_m: float = 1.0) -> tuple[FloatArray, FloatArray]:
    r"""Active circuit: A (2, 2) and B (2, 1); states dp [Pa], omega_m [rad/s]; input alpha_p [-].

    .. math:: C_h \dot{\Delta p} = D_p \omega_p \alpha_p - C_1 \Delta p - D_m \omega_m, \qquad J \dot\omega_m = D_m
    \Delta p - B_v \omega_m

    Source: Moslatt 2020 paper C eqs 1 to 4 with C_h = V_1 / beta; load and Coulomb friction are disturbances and left
    out. Differs from print: C eq. 8 makes the damping B_v/J + C_1 beta/J of these equations; it is B_v/J + C_1
    beta/V_1.
    """
    check_displacement(alpha_m)
    a, J, B_v = crane.active, crane.inertia.J_m_eff, crane.control.B_v
    C_h, D_m = capacitance(a.line.V, a.line.bulk_modulus), a.motor.D_total * alpha_m
    A = np.array([[-a.C_leak / C_h, -D_m / C_h], [D_m / J, -B_v / J]])
    return A, np.array([[a.pump.D_total * a.pump.omega_p / C_h], [0.0]])


def loop_matrices(
    crane: Crane, alpha_m: float = 1.0, *, K_wire: float = 1.0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position loop at K_p = 1, cut at the gain: A (5, 5), B (5,), C (5,); states `LOOP`, input u_p [-], output wire
    hoisted [m].

    Source: Moslatt 2020 paper E eqs 14, 15, 17 to 20 with the motors standing still.
    """
    servo = crane.active.pump.servo
    A, B = np.zeros((5, 5)), np.zeros(5)
    circuit, from_pump = circuit_matrices(crane, alpha_m)
    A[0, 1], A[1, 0], A[1, 1], B[1] = 1.0, -(servo.omega_n**2), -2.0 * servo.zeta * servo.omega_n, servo.omega_n**2
    A[2:4, 2:4], A[2:4, 0:1] = circuit, from_pump
    A[4, 3] = effective_radius(crane, K_wire)
    return A, B, np.array([0.0, 0.0, 0.0, 0.0, 1.0])


def about(crane: Crane, v_tip: float, *, mode: Mode | str = DEFAULT_MODE, K_wire: float = 1.0) -> About:
    """Steady operation at a constant tip speed [m/s, up positive], which the winch follows exactly.

    Errors: StillhookError where the pumps cannot follow: a linear model about a full pump has no feedback.
    """
    s = steady(crane, -v_tip, mode, K_wire=K_wire)
    if s.saturated:
        raise StillhookError(
            f"v_tip = {v_tip:g} m/s: the pumps are full at {abs(s.v_w):.3g} m/s in mode {Mode(mode)}. Give a slower"
            " tip."
        )
    return about_at(crane, v_tip, s.alpha_m, s.omega_m, mode=mode, K_wire=K_wire)


def about_at(
    crane: Crane, v_tip: float, alpha_m: float, omega_m: float, *, mode: Mode | str = DEFAULT_MODE, K_wire: float = 1.0
) -> About:
    """Steady operation at a displacement [-] and motor speed [rad/s] that need not be those of the mode."""
    u_ff = -gains(crane).K_1 * v_tip * K_wire * alpha_m
    dp = crane.control.B_v * omega_m / (crane.active.motor.D_total * alpha_m)
    return About(v_tip, alpha_m, u_ff, omega_m, dp, slope=motor_slope(crane, mode, alpha_m, u_ff))


def motor_slope(crane: Crane, mode: Mode | str, alpha_m: float, u_ff: float) -> float:
    """Slope of the motors' command by |u_ff| where the load cell demands nothing [-], as the measured displacement
    moves at a constant speed, by differences of the controller's own law; 0 beyond the pumps' full command.

    Source: Moslatt 2020 paper E eq. 12 for SSC, for which this is -(1 - alpha_min) / (1 - u_thr) beyond u_thr.
    Differs from print: E eq. 12 takes the magnitude of a Laplace variable; it is sign(u_ff) U_ff about the steady u_ff.
    """
    if not abs(u_ff) < 1.0:
        return 0.0
    law, u = motor_law(crane, Mode(mode)), abs(u_ff)
    ends = (max(u - SLOPE_STEP, 0.0), u + SLOPE_STEP)
    down, up = (law(end, alpha_m * end / u if u > SLOPE_STEP else alpha_m) for end in ends)
    return (up - down) / (ends[1] - ends[0])


def full_matrices(
    crane: Crane, at: About, *, K_wire: float = 1.0, K_p: float | None = None
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    r"""The complete controller and circuit about steady operation: A (7, 7), B (7, 2), C (4, 7), D (4, 2).

    States `FULL_LOOP`; inputs v_tip [m/s] and a_tip [m/s^2], up positive; outputs v_w, e_c, u_ff, alpha_m.

    .. math:: U_{ff} = -K_{wire}\left[K_1 v_{tip}^{ss} A_m + \alpha_m^{ss} (K_1 V_{tip} + K_2 A_{tip})\right], \qquad
              U_m = k\,\mathrm{sign}(u_{ff}^{ss})\,U_{ff}

    with k the slope of the motors' law. The motors follow the tip alone, so A is block triangular: its poles are those
    of the motors' own loop and those of the position loop at the steady displacement. Motors whose displacement is
    measured; for others see `command_pole`.
    Source: Moslatt 2020 paper E eqs 12 to 20.
    Differs from print: signs (hoisting positive); sign(u_ff) for |U_ff|; the acceleration feedforward K_2 stays,
    because an a_tip of zero in the steady state does not make its variation zero (it changes the zeros of G_v, not its
    poles).
    """
    ahc, motor = gains(crane), crane.active.motor
    K_p = ahc.K_p if K_p is None else K_p
    A, B = np.zeros((7, 7)), np.zeros((7, 2))
    loop, from_u_p, _ = loop_matrices(crane, at.alpha_m, K_wire=K_wire)
    A[2:6, 2:6] = loop[:4, :4]
    by_alpha_m = -ahc.K_1 * at.v_tip * K_wire
    by_tip = -at.alpha_m * K_wire * np.array([ahc.K_1, ahc.K_2])
    w_2, side = motor.servo.omega_n**2, math.copysign(1.0, at.u_ff)
    A[0, 1], A[1, 0], A[1, 1] = (
        1.0,
        w_2 * (at.slope * side * by_alpha_m - 1.0),
        -2.0 * motor.servo.zeta * motor.servo.omega_n,
    )
    B[1] = w_2 * at.slope * side * by_tip
    A[3, 0], B[3] = from_u_p[1] * by_alpha_m, from_u_p[1] * by_tip
    A[3, 6] = -from_u_p[1] * K_p
    C_h = capacitance(crane.active.line.V, crane.active.line.bulk_modulus)
    A[4, 0] = -motor.D_total * at.omega_m / C_h
    A[5, 0] = motor.D_total * at.dp / crane.inertia.J_m_eff
    A[6, 5], B[6, 0] = effective_radius(crane, K_wire), 1.0
    C, D = np.zeros((4, 7)), np.zeros((4, 2))
    C[0, 5], C[1, 6], C[2, 0], C[3, 0] = effective_radius(crane, K_wire), 1.0, by_alpha_m, 1.0
    D[2] = by_tip
    return A, B, C, D


def motor_poles(crane: Crane, v_tip: float, *, mode: Mode | str = DEFAULT_MODE) -> NDArray[np.complex128]:
    """The two poles of the motors' own loop, closed through the measured alpha_m in the feedforward [1/s].

    The faster the tip, the stiffer: omega^2 = omega_nm^2 (1 + |k| K_1 |v_tip|), with the same decay zeta_nm
    omega_nm.
    """
    A = full_matrices(crane, about(crane, v_tip, mode=mode))[0]
    return np.linalg.eigvals(A[:2, :2]).astype(np.complex128)


def command_pole(crane: Crane, at: About, *, K_wire: float = 1.0) -> float:
    """Pole in the z-plane of SSC on motors without displacement feedback: each command follows from the last one, with
    this factor [-].

    There the PLC calculates with its last command: u_m(k) = 1 - k_red(K_1 |v_tip| K_wire u_m(k - 1)) .... Beyond -1,
    which is at K_1 |v_tip| K_wire (1 - alpha_min) > 1 - u_thr, the command jumps from stop to stop every cycle. 0 where
    the displacement is measured.
    Source: the PLC of `stillhook.control.plc`; the thesis names the variant (paper E section 5.1.1) and not this.
    """
    if crane.active.motor.variant is not ServoVariant.OPEN_LOOP:
        return 0.0
    return at.slope * gains(crane).K_1 * abs(at.v_tip) * K_wire


def position_loop(crane: Crane, alpha_m: float = 1.0, *, K_wire: float = 1.0) -> ContinuousLoop:
    """The published position loop, without PLC and delay (Moslatt 2020 paper E eqs 14 to 20)."""
    return balanced(*loop_matrices(crane, alpha_m, K_wire=K_wire))


def by_plc(crane: Crane, loop: ContinuousLoop, delay: float = 0.0) -> SampledLoop:
    """The published loop as the crane's PLC closes it; delay of the position feedback [s], to which computing time and
    the dead time of the pumps' control are added."""
    dead_time = crane.plant.type.dead_times(crane)["u_p"]
    return sampled(loop, crane.control.t_cycle, delay + crane.control.computing + dead_time)
