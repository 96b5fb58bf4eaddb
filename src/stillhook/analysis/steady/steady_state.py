"""Where pumps and motors are at a constant wire speed: no leakage, no friction, the published outer drum diameter.

What each layer of wire means for the winch.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import scipy

from stillhook.engine.pack.winch import MotorLaw, drum_record, gains, inertia_record, plc_record, wire_speed_max
from stillhook.engine.pack.winch import motor_law as law_of_plc
from stillhook.errors import ScenarioError, StillhookError
from stillhook.physics.load_path.drum import (
    K_wire,
    layer_diameter,
    layers_filled,
    shaft_inertia,
    wire_inertia,
    wire_to_layer,
)
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.units import quote


class Steady(NamedTuple):
    """Operation at constant speed: alpha_m motors [-]; u_p pumps, hoisting positive, held in [-1, 1] [-]; omega_m
    [rad/s] and v_w [m/s] as reached; saturated: the pumps are full and the speed that was requested is not reached."""

    alpha_m: float
    u_p: float
    omega_m: float
    v_w: float
    saturated: bool


def steady(crane: Crane, v_w: float, mode: Mode | str, load: float | None = None, *, K_wire: float = 1.0) -> Steady:
    r"""Displacements at constant wire speed.

    The pumps deliver the flow of the motors, u_p = v_w alpha_m K_wire / v_w(1, 1); the motors are where the mode
    wants them for the feedforward u_ff = K_1 v_w alpha_m K_wire, which holds alpha_m itself. For linear SSC that is

    .. math:: \alpha_m = \frac{(1 - u_{thr}) + (1 - \alpha_{min}) u_{thr}}{(1 - u_{thr}) + (1 - \alpha_{min}) K_1 v_w
    K_{wire}}
              \quad \text{within}\ [\alpha_{min}, 1]

    and every law is solved for it.

    Parameters: v_w wire speed, hoisting positive [m/s]; mode; load payload without hook [kg], None: the load cell asks
    for nothing, as in the published figures; K_wire largest drum diameter over that in use [-].
    Errors: StillhookError for a number outside its range, or no number.
    Source: Moslatt 2020 eqs 2.9 to 2.11 and figure 2.17 (paper E eqs 1 to 4 and figure 4).
    Valid: ideal machine without leakage, which takes a few per cent of the pumps; K_1 of the crane, which is the ideal
    one unless its file gives another. Then u_p is still what the motors take: the position loop makes up the
    difference.
    """
    F = 0.0 if load is None else (load + crane.hook_mass) * G
    if not (math.isfinite(v_w) and math.isfinite(F) and F >= 0.0):
        raise StillhookError(
            f"v_w = {v_w:g} m/s, load = {load} kg: give a finite speed, and a load that is not negative."
        )
    check_K_wire(K_wire)
    x = gains(crane).K_1 * abs(v_w) * K_wire
    alpha_m = settled(motor_law(crane, Mode(mode), F, K_wire), x)
    v_full = wire_speed_max(crane, alpha_m) / K_wire
    u_p = v_w / v_full
    clipped = max(-1.0, min(u_p, 1.0))
    reached = clipped * v_full
    return Steady(
        alpha_m=alpha_m,
        u_p=clipped,
        omega_m=reached * 2.0 * crane.i_hD * K_wire / crane.drum.d_max,
        v_w=reached,
        saturated=abs(u_p) > 1.0,
    )


def speed_limit(crane: Crane, mode: Mode | str, load: float | None = None) -> float:
    """Highest wire speed of a mode with the pumps full [m/s]. Parameters, source and validity as `steady`."""
    fastest = wire_speed_max(crane, crane.active.motor.alpha_min)
    return steady(crane, 2.0 * fastest, mode, load).v_w


def reduction_lead(crane: Crane, v_peak: float, period: float) -> float:
    """Time from the start of the motors' reduction to the fastest moment of a sine [s]: what the motors have to stroke
    in.

    Parameters: v_peak highest speed of the tip [m/s]; period [s]. Zero where the motion never calls for a reduction.
    Source: Moslatt 2020 paper E section 5.1.1: 1.1 s at 110 m/min on the outermost layer (its period is not printed; 6
    s gives it). Valid without K_2, whose share of the feedforward is left out as in the paper.
    """
    if not (v_peak > 0.0 and 0.0 < period < math.inf):
        raise StillhookError(f"v_peak = {v_peak:g} m/s, period = {period:g} s: give numbers above 0.")
    start = crane.control.u_thr / (gains(crane).K_1 * v_peak)
    return period * math.acos(min(start, 1.0)) / (2.0 * math.pi)


def motor_law(crane: Crane, mode: Mode, F: float = 0.0, K_wire: float = 1.0) -> MotorLaw:
    """A controller's command to the motors, with F on the load cell [N].

    As in the published numbers: the outermost layer has the printed outer diameter, NS and HS settings hold at K_wire =
    1. That of the plant, for which they hold on the centre of its outermost wire, is
    `stillhook.engine.pack.winch.motor_law`.
    """
    plc = plc_record(crane)
    return law_of_plc(crane, mode, F, K_wire, plc=plc._replace(motors=plc.motors._replace(K_outer=1.0)))


def check_displacement(alpha_m: float) -> None:
    """Errors: StillhookError for a displacement that motors do not have."""
    if not 0.0 < alpha_m <= 1.0:
        raise StillhookError(f"alpha_m = {alpha_m:g}: the displacement over its maximum must be above 0 and at most 1.")


def check_K_wire(K_wire: float) -> None:
    """Errors: StillhookError for a diameter in use that is larger than the largest."""
    if not 1.0 <= K_wire < math.inf:
        raise StillhookError(f"K_wire = {K_wire:g}: the largest drum diameter over the present one is at least 1.")


def moves(crane: Crane, mode: Mode) -> bool:
    """Whether a controller moves the motors with the feedforward."""
    law = motor_law(crane, mode)
    return law(0.0) != law(1.0)


def settled(law: MotorLaw, x: float) -> float:
    """Displacement at which law and feedforward x alpha_m agree [-]; x = K_1 |v_w| K_wire. The law does not rise with
    the displacement, so there is one such point."""

    def gap(alpha_m: float) -> float:
        return alpha_m - law(x * alpha_m, alpha_m)

    return 1.0 if gap(1.0) <= 0.0 else float(scipy.optimize.brentq(gap, 0.0, 1.0, xtol=1e-14, rtol=1e-14))


def layer_row(crane: Crane, layer: int) -> dict[str, Any]:
    """Layer number, diameter of its wire's centre [m], K_wire, wire on it [m], wire on the drum with it full [m], wire
    paid out then [m], inertia at the motor shaft then [kg m^2]. Errors: ScenarioError for a layer that the drum does
    not have."""
    if isinstance(layer, bool) or not isinstance(layer, int) or not 1 <= layer <= crane.drum.layers:
        raise ScenarioError(
            f'layer = {quote(layer)}: "{crane.name}" has layers 1 to {crane.drum.layers}. Choose one of them.'
        )
    drum, n = drum_record(crane), float(layer)
    d, remaining = layer_diameter(n, drum), wire_to_layer(n, drum)
    return {
        "layer": layer,
        "d_wire_centre": d,
        "K_wire": K_wire(d, drum),
        "wire_length": remaining - wire_to_layer(n - 1.0, drum),
        "wire_left": remaining,
        "wire_out": drum.L_full - remaining,
        "J_m": shaft_inertia(remaining, n, drum, inertia_record(crane)),
    }


def wire_out_on(crane: Crane, layer: int) -> float:
    """Wire paid out that leaves half of a layer on the drum [m]: room for the waves on both sides."""
    row = layer_row(crane, layer)
    return float(row["wire_out"] + 0.5 * row["wire_length"])


def inertia_parts(crane: Crane, s_w: float) -> dict[str, float]:
    """Inertia at the motor shaft by where it sits, with s_w paid out [m]: motors, gears, drum, wire left, all [kg m^2].

    Source: the split of Moslatt 2020 figure 2.19, whose bars are not printed as numbers.
    """
    drum, part, remaining = drum_record(crane), inertia_record(crane), drum_record(crane).L_full - s_w
    wire = wire_inertia(remaining, layers_filled(remaining, drum), drum) * part.i_i2
    shares = {"J_motor": part.J_motor, "J_gear": part.J_gear, "J_drum": part.J_drum * part.i_i2, "J_wire": wire}
    return {"s_w": s_w, **shares, "J_m": sum(shares.values())}
