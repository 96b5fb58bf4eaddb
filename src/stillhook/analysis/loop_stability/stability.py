"""The published position loop (Moslatt 2020 paper E section 3) as a reference, with and without PLC: it turns on the
outer diameter with a full drum, one line at constant pressure, B_v for all friction.

`full_stability` does the same for the complete plant at one operating point. What a crane is judged by is
`stillhook.analysis.loop_stability.verdict`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import scipy

from stillhook.analysis.loop_stability.linear.linearisation import linearise, plant_loop, plc_loop, settled_displacement
from stillhook.analysis.loop_stability.margins import Margins, margins, strongest_up_to
from stillhook.analysis.loop_stability.reduced import eigenfrequency, gain_limit
from stillhook.analysis.loop_stability.transfer import (
    Loop,
    SampledLoop,
    about_at,
    command_pole,
    effective_radius,
    full_matrices,
    on_layer,
    position_loop,
    sampled,
)
from stillhook.analysis.steady.operating_point import OperatingPoint, operating_point
from stillhook.analysis.steady.steady_state import motor_law, steady
from stillhook.control.registry import DEFAULT_MODE, USUAL
from stillhook.engine.pack.winch import drum_record, wire_speed_max
from stillhook.errors import StillhookError
from stillhook.physics.load_path.drum import K_wire as ratio_of
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode


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
    crane: Crane, alpha_m: float | None = None, *, layer: int | None = None, v_tip: float = 0.0, delay: float = 0.0
) -> Stability:
    """Margins of the published position loop.

    Parameters: alpha_m displacement of the motors [-], default the displacement of SSC at v_tip: 1 at rest; layer that
    the drum turns on, with the inertia of a drum that is full up to it, default the published outer diameter and full
    drum; v_tip steady speed of the tip [m/s], which closes the motors' own loop through the measured displacement (it
    moves two poles and no limit); delay [s] of the position feedback's complete path around the loop, for the values
    that end in _plc. It is not the delay of the motion unit, which is outside the loop and affects the error, not
    stability.

    Errors: StillhookError for a number outside its range, K_p = 0, or a tip so fast that the pumps are full, which have
    no feedback.
    Source: Moslatt 2020 paper E eqs 12 to 21, corrected (`stillhook.analysis.loop_stability.transfer`); PLC and
    delay are not in print.
    """
    return published_stability(crane, alpha_m, layer, v_tip, delay, strong=True)


def published_stability(
    crane: Crane, alpha_m: float | None, layer: int | None, v_tip: float, delay: float, *, strong: bool
) -> Stability:
    machine, K_wire = (crane, 1.0) if layer is None else on_layer(crane, layer)
    _check(v_tip, delay)
    alpha = steady(machine, -v_tip, DEFAULT_MODE, K_wire=K_wire).alpha_m if alpha_m is None else alpha_m
    e, limit = eigenfrequency(machine, alpha), gain_limit(machine, alpha, K_wire)
    plain = position_loop(machine, alpha, K_wire=K_wire)
    with_plc = sampled(plain, crane.control.t_cycle, delay + crane.control.computing)
    at = about_at(machine, v_tip, alpha, -v_tip / effective_radius(machine, K_wire), K_wire=K_wire)
    v_full = wire_speed_max(crane, alpha) / K_wire
    if abs(v_tip) > v_full:
        raise StillhookError(
            f"v_tip = {v_tip:g} m/s: the pumps are full at {v_full:.3g} m/s with the motors at {alpha:.3g}. Give a"
            " slower tip."
        )
    A = full_matrices(machine, at, K_wire=K_wire)[0]
    where = {"alpha_m": alpha, "K_wire": K_wire, "J_m": e.J_m, "v_tip": v_tip}
    values = {
        "K_p_ms": limit.K_p_ms,
        "omega_c": limit.omega_c,
        "omega_0": e.omega_0,
        "zeta": e.zeta,
        "period": e.period,
    }
    result = _stability(crane, where, values, (plain, with_plc), delay, np.linalg.eigvals(A), strong=strong)
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
    poles as well. omega_0 and zeta are those of the mode in which the winch oscillates on the oil of its lines.
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
    linear = linearise(point)
    plain, with_plc = plant_loop(linear), plc_loop(crane, point, mode=mode, delay=delay)
    swing = max((m for m in linear.modes() if m.pole.imag > 0.0), key=lambda m: m.share("p_a", "p_b", "omega_m"))
    limit = margins(plain, crane.control.K_p)
    where = {
        "alpha_m": point.alpha_m,
        "K_wire": float(ratio_of(point.geometry.d, drum_record(crane))),
        "J_m": 1.0 / point.geometry.i_J,
        "v_tip": v_tip,
    }
    values = {
        "K_p_ms": limit.gain_margin * crane.control.K_p,
        "omega_c": limit.omega_c,
        "omega_0": swing.omega_0,
        "zeta": swing.zeta,
        "period": 2.0 * math.pi / swing.omega_0,
    }
    z = with_plc.closed_poles(crane.control.K_p)
    poles = np.log(z[np.abs(z) > 1e-6]) / with_plc.t_cycle
    return _stability(crane, where, values, (plain, with_plc), delay, poles), point


def _check(v_tip: float, delay: float) -> None:
    if not math.isfinite(v_tip):
        raise StillhookError(f"v_tip = {v_tip:g} m/s: give a finite speed.")
    if not 0.0 <= delay < 10.0:
        raise StillhookError(f"delay = {delay:g} s: allowed is 0 up to 10 s.")


def _stability(
    crane: Crane,
    where: Mapping[str, float],
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
        **where,
        **values,
        **_named(plain, ""),
        **_named(with_plc, "_plc"),
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


def _named(m: Margins, end: str) -> dict[str, Any]:
    names = ("gain_margin", "phase_margin", "omega_gc", "delay_margin", "sensitivity_peak")
    return {f"{n}{end}": getattr(m, n) for n in names}


def least_limit(crane: Crane) -> tuple[float, float]:
    """Displacement at which the gain limit is lowest [-], and that limit [1/m]: below, where no mode goes, it rises
    again.

    There the winch oscillates so slowly that the decay of the circuit alone, which does not depend on the displacement,
    holds it.
    """
    minimum = scipy.optimize.minimize_scalar(
        lambda a: gain_limit(crane, a).K_p_ms, bounds=(1e-3, 1.0), method="bounded", options={"xatol": 1e-9}
    )
    return float(minimum.x), float(minimum.fun)


def range_of_modes(crane: Crane) -> dict[str, tuple[float, float]]:
    """Least and largest displacement that each mode takes on the outermost layer [-]; under SSC with a load that asks
    for no more."""
    laws = {mode.value: motor_law(crane, mode) for mode in reversed(USUAL)}
    ends = {name: (law(0.0), law(1.0)) for name, law in laws.items()}
    return {name: (min(both), max(both)) for name, both in ends.items()}
