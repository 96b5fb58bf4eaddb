"""The published reduced model of the active circuit (Moslatt 2020 paper E section 3), a reference: eigenfrequency, gain
limit, and the position loop with and without PLC. It turns on the outer diameter with a full drum, one line at constant
pressure, B_v for all friction.

`full_stability` does the same for the complete plant at one operating point. What a crane is judged by is
`stillhook.analysis.loop_stability.verdict`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.analysis.loop_stability.linearisation import (
    learned,
    linearise,
    plant_loop,
    plc_loop,
    settled_displacement,
)
from stillhook.analysis.loop_stability.loops import Loop, SampledLoop
from stillhook.analysis.loop_stability.margins import margins, strongest_up_to
from stillhook.analysis.loop_stability.transfer import (
    about_at,
    by_plc,
    command_pole,
    effective_radius,
    full_matrices,
    on_layer,
    position_loop,
)
from stillhook.analysis.steady.operating_point import OperatingPoint, operating_point
from stillhook.analysis.steady.steady_state import check_displacement, check_K_wire, motor_law, steady
from stillhook.control.commands import marginal_gain
from stillhook.control.registry import DEFAULT_MODE, USUAL
from stillhook.engine.pack.winch import drum_record, loop_record, wire_speed_max
from stillhook.errors import StillhookError
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.physics.load_path.drum import K_wire as ratio_of
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode

MARGINS = ("gain_margin", "phase_margin", "omega_gc", "delay_margin", "sensitivity_peak")
"""Margins that a `Stability` has without and with PLC."""
SHOWN = tuple(name for name in MARGINS if name != "omega_gc")
"""Those that sweeps and a verdict show."""


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

    Parameters
    ----------
    crane : Crane
        The machine; J is that of the full drum.
    alpha_m : float, default 1.0
        Displacement of the active motors over its maximum, above 0 and up to 1 [-].

    Returns
    -------
    Eigenfrequency
        omega_0 [rad/s], zeta [-], period [s], and what they are made of.

    Raises
    ------
    StillhookError
        For a displacement outside that range.

    Notes
    -----
    Source: Moslatt 2020 paper C eqs 8 and 9 (paper E eqs 10 and 11). Valid while the other line's pressure is constant
    and the wire is slack to the winch: the load's own mode is left out.
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

    Parameters
    ----------
    crane : Crane
        The machine.
    alpha_m : float, default 1.0
        Displacement of the active motors over its maximum, above 0 and up to 1 [-].
    K_wire : float, default 1.0
        Largest drum diameter over that in use, at least 1 [-].

    Returns
    -------
    GainLimit
        K_p_ms [1/m] and the frequency omega_c [rad/s] of the oscillation.

    Raises
    ------
    StillhookError
        For a displacement or a K_wire outside its range.

    Notes
    -----
    Source: Moslatt 2020 paper E eqs 14 to 20 and figure 5, with the motors standing still in their stroke. The limit
    grows with the displacement as in that figure down to about a fifth of it; far below, where no mode goes, it rises
    again.
    Differs from print: paper E calls SSC pure feedforward. u_ff holds the measured alpha_m, so the motors' own loop
    changes with the tip's speed; the pump loop, and with it this limit, does not depend on it.
    """
    check_K_wire(K_wire)
    check_displacement(alpha_m)
    K_p_ms, omega_c = marginal_gain(loop_record(crane, alpha_m, K_wire))
    return GainLimit(alpha_m, K_wire, K_p_ms, omega_c)


class Stability(NamedTuple):
    """The position loop of one crane at one displacement, SI.

    alpha_m [-], K_wire [-], J_m [kg m^2], v_tip [m/s]: where; K_p, K_p_ms [1/m], omega_c [rad/s]: the crane's gain,
    that of marginal stability and the frequency there; omega_0 [rad/s], zeta [-], period [s] of the active circuit;
    gain_margin, phase_margin [rad], omega_gc [rad/s], delay_margin [s], sensitivity_peak of the continuous loop (see
    `margins.Margins`); t_cycle, delay [s] and the same with PLC and delay, ending in _plc; K_p_strong [1/m] the largest
    gain that keeps a gain margin of 2, 45 degrees and a sensitivity peak of 2 with PLC and delay; poles of the whole
    closed loop [1/s]; stable, stable_plc.
    """

    alpha_m: float
    K_wire: float
    J_m: float
    v_tip: float
    K_p: float
    K_p_ms: float
    omega_c: float
    omega_0: float
    zeta: float
    period: float
    gain_margin: float
    phase_margin: float
    omega_gc: float
    delay_margin: float
    sensitivity_peak: float
    t_cycle: float
    delay: float
    K_p_ms_plc: float
    omega_c_plc: float
    gain_margin_plc: float
    phase_margin_plc: float
    omega_gc_plc: float
    delay_margin_plc: float
    sensitivity_peak_plc: float
    K_p_strong: float
    poles: tuple[complex, ...]
    stable: bool
    stable_plc: bool

    @property
    def ok(self) -> bool:
        """Whether the loop dies out, as published and with PLC and delay, with positive margins."""
        return self.stable and self.stable_plc and self.gain_margin > 1.0 and self.gain_margin_plc > 1.0

    def table(self) -> dict[str, Any]:
        """Name -> value in SI; poles as pairs of real and imaginary part."""
        return self._asdict() | {"poles": [[p.real, p.imag] for p in self.poles]}


def stability(
    crane: Crane,
    alpha_m: float | None = None,
    *,
    layer: int | None = None,
    v_tip: float = 0.0,
    delay: float = 0.0,
    strong: bool = True,
) -> Stability:
    """Margins of the published position loop.

    Parameters: alpha_m displacement of the motors [-], default the displacement of SSC at v_tip: 1 at rest; layer that
    the drum turns on, with the inertia of a drum that is full up to it, default the published outer diameter and full
    drum; v_tip steady speed of the tip [m/s], which closes the motors' own loop through the measured displacement (it
    moves two poles and no limit); delay [s] of the position feedback's complete path around the loop, for the values
    that end in _plc. It is not the delay of the motion unit, which is outside the loop and affects the error, not
    stability; strong False leaves out K_p_strong, which takes most of the time.

    Errors: StillhookError for a number outside its range, K_p = 0, or a tip so fast that the pumps are full, which have
    no feedback.
    Source: Moslatt 2020 paper E eqs 12 to 21, corrected (`stillhook.analysis.loop_stability.transfer`); PLC and
    delay are not in print.
    """
    machine, K_wire = (crane, 1.0) if layer is None else on_layer(crane, layer)
    _check(v_tip, delay)
    alpha = steady(machine, -v_tip, DEFAULT_MODE, K_wire=K_wire).alpha_m if alpha_m is None else alpha_m
    e, limit = eigenfrequency(machine, alpha), gain_limit(machine, alpha, K_wire)
    plain = position_loop(machine, alpha, K_wire=K_wire)
    with_plc = by_plc(crane, plain, delay)
    at = about_at(machine, v_tip, alpha, -v_tip / effective_radius(machine, K_wire), K_wire=K_wire)
    v_full = wire_speed_max(crane, alpha) / K_wire
    if abs(v_tip) > v_full:
        raise StillhookError(
            f"v_tip = {v_tip:g} m/s: the pumps are full at {v_full:.3g} m/s with the motors at {alpha:.3g}. Give a"
            " slower tip."
        )
    A = full_matrices(machine, at, K_wire=K_wire)[0]
    values = {
        "alpha_m": alpha,
        "K_wire": K_wire,
        "J_m": e.J_m,
        "v_tip": v_tip,
        "K_p_ms": limit.K_p_ms,
        "omega_c": limit.omega_c,
        "omega_0": e.omega_0,
        "zeta": e.zeta,
        "period": e.period,
    }
    result = _stability(crane, values, (plain, with_plc), delay, np.linalg.eigvals(A), strong=strong)
    settles = abs(command_pole(machine, at, K_wire=K_wire)) < 1.0
    return result._replace(stable_plc=result.stable_plc and settles)


def full_stability(
    crane: Crane,
    *,
    load: float,
    s_w: float,
    v_tip: float,
    alpha_m: float | None = None,
    mode: Mode | str = DEFAULT_MODE,
    delay: float = 0.0,
) -> tuple[Stability, OperatingPoint]:
    """The same of the complete plant while it compensates a steady tip speed, by numeric linearisation, and the
    operating point.

    Parameters: load payload [kg]; s_w wire paid out [m]; v_tip steady speed of the tip, up positive [m/s]; alpha_m [-],
    default where the mode's law holds the motors; mode; delay [s] of the position feedback.
    K_p_ms is that of the plant with motors and passive circuit standing, as in paper E; with PLC all loops are closed,
    poles as well, with what a controller that learns remembers after a sea. omega_0 and zeta are those of the mode in
    which the winch oscillates on the oil of its lines.
    Errors: StillhookError for a point that the winch cannot reach, or a winch at rest, which sticks.
    """
    _check(v_tip, delay)
    if v_tip == 0.0:
        raise StillhookError(
            "v_tip = 0: a winch at rest sticks, and its loop has no limit until it slides. Give a speed, such as 10"
            " m/min."
        )

    def at(alpha: float) -> OperatingPoint:
        return operating_point(crane, -v_tip, alpha, load=load, s_w=s_w, v_tip=v_tip)

    point = settled_displacement(crane, at, mode) if alpha_m is None else at(alpha_m)
    linear, law_memory = linearise(point), learned(crane, Mode(mode), [(load, s_w)])[load, s_w]
    plain = plant_loop(linear)
    with_plc = plc_loop(crane, point, mode=mode, delay=delay, law_memory=law_memory)
    swing = max((m for m in linear.modes() if m.pole.imag > 0.0), key=lambda m: m.share("p_a", "p_b", "omega_m"))
    limit = margins(plain, crane.control.K_p)
    values = {
        "alpha_m": point.alpha_m,
        "K_wire": float(ratio_of(point.geometry.d, drum_record(crane))),
        "J_m": 1.0 / point.geometry.i_J,
        "v_tip": v_tip,
        "K_p_ms": limit.gain_margin * crane.control.K_p,
        "omega_c": limit.omega_c,
        "omega_0": swing.omega_0,
        "zeta": swing.zeta,
        "period": 2.0 * math.pi / swing.omega_0,
    }
    z = with_plc.closed_poles(crane.control.K_p)
    poles = np.log(z[np.abs(z) > 1e-6]) / with_plc.t_cycle
    return _stability(crane, values, (plain, with_plc), delay, poles), point


def _check(v_tip: float, delay: float) -> None:
    if not math.isfinite(v_tip):
        raise StillhookError(f"v_tip = {v_tip:g} m/s: give a finite speed.")
    if not 0.0 <= delay < 10.0:
        raise StillhookError(f"delay = {delay:g} s: allowed is 0 up to 10 s.")


def _stability(
    crane: Crane,
    values: Mapping[str, float],
    loops: tuple[Loop, SampledLoop],
    delay: float,
    poles: Any,
    *,
    strong: bool = True,
) -> Stability:
    K_p = crane.control.K_p
    plain, with_plc = (margins(loop, K_p) for loop in loops)
    return Stability(
        **values,
        **{f"{name}{end}": getattr(m, name) for end, m in (("", plain), ("_plc", with_plc)) for name in MARGINS},
        K_p=K_p,
        t_cycle=crane.control.t_cycle,
        delay=delay,
        K_p_ms_plc=with_plc.gain_margin * K_p,
        omega_c_plc=with_plc.omega_c,
        K_p_strong=strongest_up_to(loops[1].proportional) if strong else math.nan,
        poles=tuple(complex(p) for p in sorted(poles, key=lambda p: (abs(p), p.imag))),
        stable=plain.stable,
        stable_plc=with_plc.stable,
    )


def range_of_modes(crane: Crane) -> dict[str, tuple[float, float]]:
    """Least and largest displacement that each mode takes on the outermost layer [-]; under SSC with a load that asks
    for no more."""
    laws = {mode.value: motor_law(crane, mode) for mode in reversed(USUAL)}
    ends = {name: (law(0.0), law(1.0)) for name, law in laws.items()}
    return {name: (min(both), max(both)) for name, both in ends.items()}
