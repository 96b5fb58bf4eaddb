"""Commands of the active motors' displacement: classic levels 1 to 3 and semi-secondary control (SSC)."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, scalar


class MotorSettings(NamedTuple):
    """alpha_min absolute minimum, alpha_ns and alpha_hs settings on the outermost layer [-]; alpha_swl displacement
    that SSC keeps for the SWL on the outermost layer [-]; u_thr threshold of SSC [-];
    i_F_swl inverse of the weight of the safe working load and the hook [1/N]; K_outer K_wire of the outermost layer;
    alpha_hold displacement that the operator holds in manual mode [-], 0 where he leaves it to the PLC."""

    alpha_min: float
    alpha_ns: float
    alpha_hs: float
    alpha_swl: float
    u_thr: float
    i_F_swl: float
    K_outer: float
    alpha_hold: float


@scalar
def reduction_linear(u_ff, u_thr):
    """k_red of the linear SSC, 0..1. Source: Moslatt 2020 eq. 2.10 (E eq. 2). Differs from print: |u_ff| is held at
    1."""
    return clip((abs(u_ff) - u_thr) / (1.0 - u_thr), 0.0, 1.0)


@scalar
def reduction_cubic(u_ff, u_thr):
    """k_red of the cubic SSC, 0..1. Source: Moslatt 2020 C eq. 13, whose coefficients are s^2 (3 - 2 s) for u_thr =
    0.6."""
    s = reduction_linear(u_ff, u_thr)
    return s * s * (3.0 - 2.0 * s)


@scalar
def displacement_ssc(k_red, alpha_min):
    """u_m = 1 - k_red (D_m_max - D_m_min) / D_m_max. Source: Moslatt 2020 eq. 2.9; alpha_min = D_m_min / D_m_max."""
    return 1.0 - k_red * (1.0 - alpha_min)


@scalar
def displacement_calc_min(F_load, K_wire, settings):
    """D_calc_min / D_m_max that the load cell asks for [-]: the displacement for the SWL in proportion to the actual
    load.

    alpha_swl is that of NS unless the crane file gives another.

    Source: Moslatt 2020 eq. 2.11 and paper C ("30 % of the actual load rather than of the SWL"); the rule itself is not
    printed. F_load [N]; the torque of a given wire force shrinks with the layer, hence K_wire.
    """
    return clip(settings.alpha_swl * F_load * settings.i_F_swl * settings.K_outer / K_wire, 0.0, 1.0)


@scalar
def displacement_min(F_load, K_wire, settings):
    """D_m_min / D_m_max = max(D_abs_min, D_calc_min) / D_m_max [-]. Source: Moslatt 2020 eq. 2.11."""
    return fmax(settings.alpha_min, displacement_calc_min(F_load, K_wire, settings))


@scalar
def displacement_by_layer(alpha_outer, K_wire, settings):
    """Fixed displacement for constant wire force on every layer (classic levels 2 and 3) [-].

    alpha_outer is the setting on the outermost layer; the displacement shrinks with the diameter of the layer in use.
    """
    return clip(alpha_outer * settings.K_outer / K_wire, settings.alpha_min, 1.0)
