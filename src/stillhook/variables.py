"""One row per variable: name, symbol, SI unit, kind (for display), sign, meaning, source.

Results, JSON output and the nomenclature page use it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

WINDOW = 30.0
"""Moving window of the peak-to-peak error [s]. Source: Moslatt 2020 paper F table 2."""


class Variable(NamedTuple):
    """kind is a key of `stillhook.units.KINDS`, or "" for a pure number or text."""

    name: str
    symbol: str
    unit: str
    kind: str
    sign: str
    meaning: str
    source: str


def _v(name: str, symbol: str, unit: str, kind: str, sign: str, meaning: str, source: str = "") -> Variable:
    return Variable(name, symbol, unit, kind, sign, meaning, source)


UP = "up positive"
HOIST = "hoisting positive"
OUT = "paid out positive"

SERIES = (
    _v("s_tip", "s_tip", "m", "length", UP, "crane tip height", "paper F"),
    _v("v_tip", "v_tip", "m/s", "speed", UP, "crane tip speed", "paper E eq. 4"),
    _v("a_tip", "a_tip", "m/s^2", "acceleration", UP, "crane tip acceleration", "paper E eq. 4"),
    _v("s_w", "s_w", "m", "length", OUT, "wire paid out", "paper F eq. 1"),
    _v("v_w", "v_w", "m/s", "speed", HOIST, "wire speed; ds_w/dt = -v_w", "paper E eq. 9"),
    _v("e_c", "e_c", "m", "length", "too little wire out positive", "control error s_w_ref - s_w against the true tip", "paper F eq. 1"),
    _v("e_c_measured", "e_c,m", "m", "length", "as e_c", "control error against the measured (delayed) tip, as the PLC sees it", "paper F eq. 1"),
    _v("u_p", "u_p", "1", "", HOIST, "pump command, held in [-1, 1]", "paper E eq. 6"),
    _v("u_m", "u_m", "1", "", "", "motor displacement command", "eq. 2.9"),
    _v("u_ff", "u_ff", "1", "", HOIST, "feedforward in the pump command", "paper C eq. 12"),
    _v("u_raw", "u_p,raw", "1", "", HOIST, "pump command before its limit"),
    _v("alpha_p", "alpha_p", "1", "", HOIST, "pump displacement over its maximum", "paper E eq. 8"),
    _v("alpha_m", "alpha_m", "1", "", "", "motor displacement over its maximum", "paper E eq. 7"),
    _v("p_a", "p_a", "Pa", "pressure", "gauge", "pressure of the hoisting side", "eq. 2.1"),
    _v("p_b", "p_b", "Pa", "pressure", "gauge", "pressure of the lowering side", "eq. 2.1"),
    _v("omega_m", "omega_m", "rad/s", "rotation", HOIST, "motor shaft speed", "eq. 2.12"),
    _v("F_w", "F_w", "N", "force", "tension", "wire tension", "eq. 2.16"),
    _v("s_load", "s_L", "m", "length", UP, "height of the load above its unstretched start"),
    _v("v_load", "v_L", "m/s", "speed", UP, "speed of the load"),
    _v("Q_relief", "Q_r", "m^3/s", "flow", "out of the circuit", "flow through the relief valves of the active circuit"),
    _v("T_f", "T_f", "N m", "torque", "against hoisting positive", "friction torque of the whole winch at the motor shaft", "eq. 2.5"),
    _v("layer", "k", "1", "", "", "layers of wire filled, as a real number", "section 2.5.2.3"),
    _v("p_hp", "p_hp", "Pa", "pressure", "gauge", "pressure of the passive circuit's high side", "paper F"),
    _v("alpha_pp", "alpha_pp", "1", "", "into the accumulator", "passive pump displacement over its maximum"),
    _v("alpha_pm", "alpha_pm", "1", "", "", "passive motor displacement over its maximum"),
    _v("V_acc", "V_acc", "m^3", "volume", "from the oil end", "oil in the accumulator", "paper C"),
    _v("f_pump", "f_p", "1", "", "", "share of the active pumps that run"),
    _v("mode", "", "1", "", "", "0 manual, 1 level-1, 2 level-2, 3 ns, 4 hs, 5 ssc, 6 ssc-cubic", "section 2.4"),
    _v("v_op", "v_op", "m/s", "speed", HOIST, "wire speed that the operator asks for"),
)  # fmt: skip

SUMMARY = (
    _v("status", "", "", "", "", '"ok", or what went beyond its limit: saturated, relief, overspeed, accumulator, cavitation, slack, wire (last turns, or hook at the crane tip), offset (the hook never passes its place), unstable (K_p above the gain of marginal stability), uncompensated (error about as large as the tip motion), audit (energy does not add up: do not trust the numbers), diverged'),
    _v("e_c_pp", "e_c,pp", "m", "length", "", "largest peak-to-peak of e_c over a moving 30 s window (both ends included)", "paper F eq. 2"),
    _v("e_c_pp_measured", "e_c,m,pp", "m", "length", "", "the same of e_c_measured", "paper F eq. 2"),
    _v("s_tip_pp", "s_tip,pp", "m", "length", "", "largest peak-to-peak of s_tip over the window", "paper F eq. 3"),
    _v("eta_c", "eta_c", "1", "", "", "compensation efficiency 1 - e_c_pp / s_tip_pp", "paper F eq. 3"),
    _v("e_c_max", "max|e_c|", "m", "length", "", "largest magnitude of e_c"),
    _v("e_c_mean", "mean e_c", "m", "length", "as e_c", "mean of e_c: the standing offset"),
    _v("e_c_std", "std e_c", "m", "length", "", "standard deviation of e_c"),
    _v("p_a_max", "max p_a", "Pa", "pressure", "gauge", "highest pressure of the hoisting side"),
    _v("p_b_max", "max p_b", "Pa", "pressure", "gauge", "highest pressure of the lowering side"),
    _v("p_max", "max p", "Pa", "pressure", "gauge", "highest pressure of both sides"),
    _v("p_min", "min p", "Pa", "pressure", "gauge", "lowest pressure of both sides"),
    _v("alpha_p_max", "max|alpha_p|", "1", "", "", "largest pump displacement used"),
    _v("alpha_m_min", "min alpha_m", "1", "", "", "smallest motor displacement used"),
    _v("u_p_max", "max|u_p|", "1", "", "", "largest pump command, held in [0, 1]"),
    _v("omega_m_max", "max|omega_m|", "rad/s", "rotation", "", "highest motor speed"),
    _v("v_w_max", "max|v_w|", "m/s", "speed", "", "highest wire speed"),
    _v("v_tip_max", "max|v_tip|", "m/s", "speed", "", "highest tip speed"),
    _v("F_w_max", "max F_w", "N", "force", "", "highest wire tension"),
    _v("F_w_min", "min F_w", "N", "force", "", "lowest wire tension"),
    _v("saturation_time", "t_sat", "s", "time", "", "time with the pump command beyond its limit"),
    _v("relief_time", "t_relief", "s", "time", "", "time with a relief valve of the active or passive circuit open"),
    _v("overspeed_time", "t_over", "s", "time", "", "time with the active or passive motors above their speed limit"),
    _v("stroke_time", "t_stroke", "s", "time", "", "time with the accumulator piston at an end"),
    _v("slack_time", "t_slack", "s", "time", "", "time with a slack wire"),
    _v("cavitation_time", "t_cav", "s", "time", "", "time with a line of the active circuit at or below zero gauge"),
    _v("wire_time", "t_wire", "s", "time", "", "time with the last turns of wire leaving the drum, or the hook pulled into the crane tip"),
    _v("energy_pumps", "E_p", "J", "energy", "", "energy through active and passive pumps, both directions added up"),
    _v("energy_unaccounted", "", "1", "", "", "energy not found again, over energy_pumps (audit of the whole winch)"),
    _v("counted_time", "", "s", "time", "", "length of the part of the run that counts (after the warm-up)"),
    _v("warm_up", "t_w", "s", "time", "", "start of the run that metrics leave out"),
    _v("notes", "", "", "", "", "limits that were foreseen before the run"),
)  # fmt: skip

QUANTITIES = (
    _v("T_fm", "T_fm", "N m", "torque", "never negative", "torque loss of one motor shaft (MJ4)", "eq. 2.12"),
    _v("T_fs", "T_fs", "N m", "torque", "never negative", "system friction per motor shaft", "eq. 2.7"),
    _v("T_d", "T_d", "N m", "torque", "load positive", "drum torque", "eq. 2.7"),
    _v("D_m", "D_m", "m^3/rad", "displacement", "", "motor displacement now", "eq. 2.5"),
    _v("dp_m", "dp_m", "Pa", "pressure", "p_a - p_b", "pressure drop over the motors", "eq. 2.1"),
    _v("dp_F", "dp_F", "Pa", "pressure", "never negative in a sound test", "friction as pressure: half the difference of hoisting and lowering", "eq. 2.4"),
    _v("dp_L", "dp_L", "Pa", "pressure", "load positive", "load as pressure: half the sum of hoisting and lowering", "eqs 2.2, 2.3"),
    _v("Y_1", "Y_1", "1", "", "never negative", "break-away part of the drum torque", "eq. 2.7"),
    _v("Y_2", "Y_2", "N m", "torque", "never negative", "constant system friction", "eq. 2.7"),
    _v("Y_3", "Y_3", "N m", "torque", "never negative", "break-away system friction", "eq. 2.7"),
    _v("Y_4", "Y_4", "rad/s", "rotation", "positive", "motor speed over which break-away friction fades", "eq. 2.7"),
    _v("Y_5", "Y_5", "N m s/rad", "viscous_torque", "never negative", "system friction per motor speed", "eq. 2.7"),
    _v("Y_6", "Y_6", "1", "", "never negative", "friction part of the drum torque", "eq. 2.7"),
    _v("X_1", "X_1", "N m s/rad", "viscous_torque", "never negative", "motor loss per shaft speed (MJ4)", "eq. 2.12"),
    _v("X_2", "X_2", "N m s^2/rad^2/(m^3/rad)^3", "torque_loss_turbulent", "never negative", "turbulent motor loss (MJ4)", "eq. 2.12"),
    _v("X_3", "X_3", "1", "", "never negative", "motor loss per pressure and displacement (MJ4)", "eq. 2.12"),
    _v("X_4", "X_4", "N m", "torque", "never negative", "constant motor loss (MJ4)", "eq. 2.12"),
    _v("X_5", "X_5", "m^5/N", "torque_loss_pressure", "never negative", "motor loss per pressure squared (MJ4)", "eq. 2.12"),
    _v("K_wire", "K_wire", "1", "", "", "largest drum diameter over that of the layer in use, at least 1", "paper E eq. 5"),
    _v("layer_diameter", "d", "m", "length", "", "diameter of the wire centre on a layer"),
    _v("d_wire_centre", "d", "m", "length", "", "diameter of the wire centre on the layer"),
    _v("wire_length", "L", "m", "length", "", "wire on this layer when full"),
    _v("wire_left", "L", "m", "length", "", "wire on the drum with this layer and all below it full"),
    _v("wire_out", "L", "m", "length", "", "wire paid out when this layer is the full outermost one"),
    _v("J_m", "J", "kg m^2", "inertia", "", "inertia at the motor shaft", "figure 2.19"),
    _v("J_motor", "J", "kg m^2", "inertia", "", "share of all motors, at the motor shaft", "figure 2.19"),
    _v("J_gear", "J", "kg m^2", "inertia", "", "share of the gears, at the motor shaft", "figure 2.19"),
    _v("J_drum", "J", "kg m^2", "inertia", "", "share of the bare drum, at the motor shaft", "figure 2.19"),
    _v("J_wire", "J", "kg m^2", "inertia", "", "share of the wire on the drum, at the motor shaft", "figure 2.19"),
    _v("v_w_max_alpha", "v_w", "m/s", "speed", "", "wire speed with the pumps full and no leakage"),
    _v("omega_0", "omega_0", "rad/s", "frequency", "", "undamped eigenfrequency of the active circuit, p_b held", "paper C eq. 9"),
    _v("period", "T", "s", "time", "", "period 2 pi / omega_0"),
    _v("zeta", "zeta", "1", "", "", "damping ratio of the active circuit", "paper C eq. 8"),
    _v("C_h", "C_h", "m^3/Pa", "", "", "hydraulic capacitance of a line", "eq. 2.14"),
    _v("C_leak", "C_leak", "m^3/s/Pa", "leakage", "", "leak conductance", "eq. 2.17"),
    _v("K_p", "K_p", "1/m", "gain_per_length", "", "position gain", "paper E eq. 6"),
    _v("K_p_ms", "K_p^(ms)", "1/m", "gain_per_length", "", "position gain at marginal stability", "paper E figure 5"),
    _v("omega_c", "omega_c", "rad/s", "frequency", "", "frequency of the oscillation at marginal stability"),
    _v("K_1", "K_1", "s/m", "time_per_length", "", "speed feedforward", "paper C eq. 12"),
    _v("K_2", "K_2", "s^2/m", "time_squared_per_length", "", "acceleration feedforward", "paper C eq. 12"),
    _v("k_red", "k_red", "1", "", "", "share of the allowed motor reduction in use", "eq. 2.10"),
    _v("u_thr", "u_thr", "1", "", "", "feedforward at which SSC starts to reduce the motors", "eq. 2.10"),
    _v("t_lead", "t_lead", "s", "time", "ahead positive", "time by which the PLC extrapolates the tip's motion"),
    _v("alpha_min", "alpha_m,min", "1", "", "", "least displacement of the active motors: D_abs_min over D_m_max", "eq. 2.11"),
    _v("alpha_swl", "alpha_swl", "1", "", "", "displacement that SSC keeps for the safe working load: scale of D_calc_min", "eq. 2.11"),
    _v("alpha_ns", "alpha_ns", "1", "", "", "motor displacement in normal-speed mode on the outermost layer", "section 2.4"),
    _v("alpha_hs", "alpha_hs", "1", "", "", "motor displacement in high-speed mode on the outermost layer", "section 2.4"),
    _v("v_w_capacity", "v_w,max", "m/s", "speed", "", "wire speed with the pumps full in a mode, the least over the loads of a tuning", "figure 2.17"),
    _v("e_c_pp_mean", "mean e_c,pp", "m", "length", "", "mean of e_c_pp over the scenarios of a tuning"),
    _v("e_c_pp_worst", "max e_c,pp", "m", "length", "", "largest e_c_pp over the scenarios of a tuning"),
    _v("score", "f", "1", "", "", "objective of a tuning: error, worst-error and pressure over those of the start, or their weighted sum"),
    _v("evaluations", "", "1", "", "", "settings that a tuning has tried, each in all its scenarios"),
    _v("applicable", "", "", "", "", "whether the controller can be used here: no rule of the table in how-to/map-a-crane.md speaks against it"),
    _v("cause", "", "", "", "", "why the controller is not applicable here, the worst cause first; empty where it is"),
    _v("e_c_pp_change", "", "1", "", "less error negative", "e_c_pp over that of the best classic controller, less 1; only where both are applicable"),
    _v("p_max_change", "", "1", "", "less pressure negative", "p_max over that of the best classic controller, less 1; only where both are applicable"),
    _v("settling_time", "t_s", "s", "time", "", "time from a step of the wire speed until v_w stays within 2 % of the step of the new speed", "paper E section 4.3"),
    _v("settling_time_change", "", "1", "", "faster negative", "settling_time over that of the best classic controller, less 1; only where both are applicable"),
    _v("overshoot", "", "1", "", "", "highest wire speed beyond the new one, over the step"),
    _v("alpha_m_end", "alpha_m", "1", "", "", "motor displacement over its maximum at the end of a test", "paper E figure 11"),
    _v("u_p_end", "|u_p|", "1", "", "", "magnitude of the pump command at the end of a test"),
    _v("wire_step", "", "m/s", "speed", "", "step of the wire speed in a settling test", "paper E section 4.3"),
    _v("lowering", "", "", "", "", "whether the wire is paid out in a settling test; hoisted otherwise"),
    _v("speed_is", "", "", "", "", "what the axis speed of a map stands for"),
    _v("applicable_share", "", "1", "", "", "share of a map's cells in which the controller is applicable"),
    _v("causes", "", "", "", "", "cells of a map in which the controller is not applicable, by cause"),
    _v("e_c_pp_change_median", "", "1", "", "less error negative", "median of e_c_pp_change over the cells where it exists"),
    _v("p_max_change_median", "", "1", "", "less pressure negative", "median of p_max_change over the cells where it exists"),
    _v("settling_time_change_median", "", "1", "", "faster negative", "median of settling_time_change over the cells where it exists"),
    _v("load", "m", "kg", "mass", "", "payload on the hook"),
    _v("speed", "v", "m/s", "speed", "", "axis of a map: peak speed of the tip, or wire speed before a step"),
    _v("motion", "", "", "", "", "tip motion in words"),
    _v("duration", "", "s", "time", "", "length of a run"),
    _v("controllers", "", "", "", "", "results by controller; \"best classic\" is cell by cell the better one of NS and HS that is applicable"),
    _v("direction", "", "", "", "", "hoisting or lowering: which way the wire goes"),
    _v("v_w_top", "U_max", "m/s", "speed", "", "highest steady wire speed of a mode at a load and layer, compensating", "paper C figure 4"),
    _v("binds", "", "", "", "", "the limit that stops the winch at v_w_top"),
    _v("limit", "", "", "", "", "what may stop a winch: pump flow, relief pressure, torque reserve, speed of active or passive motors, load of the mode"),
    _v("v_w_limit", "", "m/s", "speed", "", "steady wire speed that one limit alone would allow; infinite where it never binds, NaN where it allows none"),
    _v("alpha_m_top", "alpha_m", "1", "", "", "motor displacement over its maximum at v_w_top"),
    _v("alpha_p_top", "|alpha_p|", "1", "", "", "pump setting at v_w_top, with the motion positive"),
    _v("dp_m_top", "dp_m", "Pa", "pressure", "with the motion positive", "pressure drop over the active motors at v_w_top"),
    _v("omega_m_top", "|omega_m|", "rad/s", "rotation", "", "motor shaft speed at v_w_top"),
    _v("alpha_least", "D_m,min / D_m,max", "1", "", "", "least motor displacement that SSC takes at a load and layer", "eq. 2.11"),
    _v("alpha_reserve", "", "1", "", "", "least motor displacement with the reserve of torque at relief pressure", "paper C"),
    _v("alpha_pm_hold", "alpha_pm", "1", "", "", "passive motor displacement that holds the load at mid stroke"),
    _v("v_w_power", "", "m/s", "speed", "", "hyperbola of constant power: full pumps at alpha_reserve, no leakage"),
    _v("v_w_power_rule", "", "m/s", "speed", "", "the same at D_calc_min: at the pressure at which alpha_swl holds the reserve of the SWL", "paper C figure 4"),
    _v("load_most", "", "kg", "mass", "", "largest payload that a mode may carry: the SWL, in high-speed mode a share of it", "paper C"),
    _v("reserve", "", "1", "", "", "part of the static load that the active motors must be able to deliver on top of what they hold", "paper C"),
    _v("hs_share", "", "1", "", "", "part of the SWL up to which the high-speed mode may be used", "paper C"),
    _v("gain_over_ns", "", "1", "", "faster positive", "v_w_top over that of the normal-speed mode, less 1"),
    _v("gain_over_hs", "", "1", "", "faster positive", "v_w_top over that of the high-speed mode, less 1"),
    _v("alpha_m_ideal", "alpha_m", "1", "", "", "motor setting at a steady wire speed without leakage", "figure 2.17"),
    _v("alpha_p_ideal", "alpha_p", "1", "", "with the motion positive", "pump setting at a steady wire speed without leakage; beyond 1 not reached", "figure 2.17"),
    _v("v_w_cross", "", "m/s", "speed", "", "wire speed at which a mode's motors come down to those of a classic mode, by the plant's layer"),
    _v("v_w_cross_ideal", "", "m/s", "speed", "", "the same on the published outer diameter", "paper E figure 4"),
    _v("classic", "", "", "", "", "classic mode that others are compared with: ns or hs"),
)  # fmt: skip

VARIABLES: tuple[Variable, ...] = SERIES + SUMMARY + QUANTITIES
BY_NAME: Mapping[str, Variable] = {v.name: v for v in VARIABLES}
