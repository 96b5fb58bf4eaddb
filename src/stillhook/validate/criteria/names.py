"""Names of the measures that the steps compute and criteria judge, and of the settings that a set of criteria passes to
the steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from stillhook.validate.criteria.results import StepNumber


@dataclass(frozen=True)
class Named:
    """A measure or setting: quantity a key of `stillhook.units.KINDS`, "" for a pure number; meaning in words."""

    quantity: str
    meaning: str


@dataclass(frozen=True)
class NamedMeasure(Named):
    """step that computes it; signals: logged signals that it depends on, and so judges; kinds of tests that it covers
    where it covers several at once, () all."""

    step: StepNumber
    signals: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()


def _m(step: StepNumber, quantity: str, meaning: str) -> NamedMeasure:
    return NamedMeasure(quantity, meaning, step)


_DATA = {
    "wire_lengths": _m(StepNumber.DATA, "", "different wire lengths in the tests with heave compensation"),
    "loads": _m(StepNumber.DATA, "", "different winch loads in the tests with heave compensation"),
    "load_share": _m(StepNumber.DATA, "", "highest winch load over the safe working load"),
    "s_tip_pp_low": _m(StepNumber.DATA, "length", "smallest peak-to-peak tip motion over a window"),
    "s_tip_pp_high": _m(StepNumber.DATA, "length", "largest peak-to-peak tip motion over a window"),
    "data_length": _m(StepNumber.DATA, "time", "length of the tests with heave compensation"),
    "samples_lost": _m(StepNumber.DATA, "", "share of the expected samples of a log (by its rate) that are missing"),
    "longest_gap": _m(StepNumber.DATA, "time", "longest time between two samples of a log"),
    "samples_doubtful": _m(
        StepNumber.DATA, "", "share of a test's samples at a sensor limit, bridged or unknown, worst signal"
    ),
    "wire_lag": _m(StepNumber.DATA, "time", "time by which the wire follows the tip in heave compensation"),
    "clock_drift": _m(StepNumber.DATA, "", "drift of another clock of a log against the main one (corrected)"),
}
_PARAMETERS = {
    "lever_error": _m(
        StepNumber.PARAMETERS, "", "wire per turn of the motors (effective radius), implied over the twin's, less 1"
    ),
    "clock_error": _m(StepNumber.PARAMETERS, "", "rate error of the time stamps of the log, positive if fast"),
    "v_w_error": _m(StepNumber.PARAMETERS, "", "gain error of the wire speed against the wire paid out"),
    "v_tip_error": _m(StepNumber.PARAMETERS, "", "gain error of the tip speed against the tip position"),
    "a_tip_error": _m(StepNumber.PARAMETERS, "", "gain error of the tip acceleration against the tip speed"),
    "length_jump": _m(
        StepNumber.PARAMETERS, "length", "largest jump of wire out or tip position that its speed does not explain"
    ),
    "motor_offset_error": _m(
        StepNumber.PARAMETERS, "", "offset of the motors' setting above their command, less the twin's"
    ),
    "pump_gain_error": _m(
        StepNumber.PARAMETERS, "", "pumps' setting over their servo's response to the command, less 1"
    ),
    "displacement_ratio_error": _m(
        StepNumber.PARAMETERS, "", "motor flow over pump flow with leakage apart, implied over the twin's, less 1"
    ),
    "leakage_error": _m(
        StepNumber.PARAMETERS,
        "",
        "leakage of the active circuit, implied by the flows over the twin's, less 1; at the crane file's point where"
        " its form is refuted",
    ),
    "leakage_here_error": _m(
        StepNumber.PARAMETERS, "", "leakage at the working point of the data, implied over the twin's, less 1"
    ),
    "load_cell_error": _m(StepNumber.PARAMETERS, "", "mean of the load cell over hook and payload, less 1"),
    "friction_error": _m(
        StepNumber.PARAMETERS, "", "friction from the torque balance at the motors over the twin's, less 1"
    ),
    "tip_delay_error": _m(
        StepNumber.PARAMETERS,
        "time",
        "delay of the logged tip behind the true one by the load cell, less the stated one",
    ),
    "reference_lag": _m(StepNumber.PARAMETERS, "time", "lag of the tip in the PLC's own error behind the logged tip"),
    "reference_spread": _m(
        StepNumber.PARAMETERS, "length", "standard deviation of the PLC's reference from error, wire and tip"
    ),
    "boost_error": _m(
        StepNumber.PARAMETERS, "pressure", "mean pressure of the lower line, less the twin's boost pressure"
    ),
    "p_max_over_relief": _m(StepNumber.PARAMETERS, "", "highest pressure over the relief setting, less 1"),
}
_CONTROLLER = {
    "u_p_deviation": _m(
        StepNumber.CONTROLLER, "", "|pump command measured - simulated| below which 95 % of the samples of a test are"
    ),
    "u_m_deviation": _m(StepNumber.CONTROLLER, "", "the same of the motor command"),
    "u_p_deviation_mean": _m(StepNumber.CONTROLLER, "", "mean |pump command measured - simulated| of a test"),
    "u_m_deviation_mean": _m(StepNumber.CONTROLLER, "", "the same of the motor command"),
    "u_p_deviation_manual": _m(StepNumber.CONTROLLER, "", "u_p_deviation in manual mode"),
    "u_m_deviation_manual": _m(StepNumber.CONTROLLER, "", "u_m_deviation in manual mode"),
    "command_lag": _m(StepNumber.CONTROLLER, "time", "lag of the logged pump commands behind the simulated ones"),
    "K_1_deviation": _m(StepNumber.CONTROLLER, "", "K_1 in the logged commands over the crane file's, less 1"),
    "K_2_deviation": _m(StepNumber.CONTROLLER, "", "K_2 in the logged commands over the crane file's, less 1"),
    "K_p_deviation": _m(StepNumber.CONTROLLER, "", "K_p in the logged commands over the crane file's, less 1"),
    "u_thr_difference": _m(StepNumber.CONTROLLER, "", "u_thr in the logged motor commands, less the crane file's"),
}
_LIMITS = {
    "saturation_time": _m(StepNumber.LIMITS, "time", "time with the pumps saturated in the logs"),
    "limit_speed_error": _m(
        StepNumber.LIMITS, "", "wire speed at saturation, twin driven by the measured commands over the crane, less 1"
    ),
    "limit_speed_error_whole": _m(
        StepNumber.LIMITS, "", "the same for the complete twin on measured tip motion and joystick"
    ),
    "saturation_overlap": _m(
        StepNumber.LIMITS, "", "time with the pumps saturated in log and complete twin at once, over that in either"
    ),
}
_DYNAMICS = {
    "pressure_gradient_error": _m(
        StepNumber.DYNAMICS, "", "pressure gradient in a turn of the winch, simulated over measured, less 1"
    ),
    "pressure_gradient_error_tuned": _m(StepNumber.DYNAMICS, "", "the same with the tuned crane"),
    "swing_period_error": _m(
        StepNumber.DYNAMICS, "", "period between significant pressure peaks, simulated over measured, less 1"
    ),
    "swing_period_error_tuned": _m(StepNumber.DYNAMICS, "", "the same with the tuned crane"),
    "swing_damping_error": _m(
        StepNumber.DYNAMICS, "", "damping ratio of these swings, simulated over measured, less 1"
    ),
    "swing_damping_error_tuned": _m(StepNumber.DYNAMICS, "", "the same with the tuned crane"),
    "dynamics_misfit": _m(
        StepNumber.DYNAMICS, "", "rms of simulated less measured over the signal's own deviation, one a signal"
    ),
    "dynamics_misfit_tuned": _m(StepNumber.DYNAMICS, "", "the same with the tuned crane"),
    "C_h_error": _m(StepNumber.DYNAMICS, "", "capacitance of the lines, tuned over the crane file's, less 1"),
    "C_leak_error": _m(StepNumber.DYNAMICS, "", "leakage of the active circuit, tuned over the crane file's, less 1"),
    "J_m_eff_error": _m(StepNumber.DYNAMICS, "", "inertia at the motor shaft, tuned over the crane file's, less 1"),
}
_AHC = {
    "e_c_pp_deviation": _m(
        StepNumber.AHC, "length", "mean deviation of the peak-to-peak control error over all windows"
    ),
    "e_c_pp_deviation_case": _m(
        StepNumber.AHC, "length", "the same over the windows of one load case, one a load case"
    ),
    "e_c_pp_deviation_s": _m(StepNumber.AHC, "length", "standard deviation of that deviation"),
    "e_c_pp_below_5cm": _m(StepNumber.AHC, "", "share of windows with a deviation below 5 cm, counted"),
    "e_c_pp_below_6cm": _m(StepNumber.AHC, "", "share of windows with a deviation below 6 cm, counted"),
    "e_c_pp_bias": _m(StepNumber.AHC, "length", "mean of the peak-to-peak control error, simulated less measured"),
    "e_c_max_difference": _m(
        StepNumber.AHC, "length", "largest |e_c| simulated less largest |e_c| measured, one a load case"
    ),
    "e_c_deviation_max": _m(StepNumber.AHC, "length", "largest |e_c simulated - e_c measured| at any one moment"),
    "eta_c_deviation_high": _m(StepNumber.AHC, "", "mean deviation of the compensation efficiency at high tip motion"),
    "e_c_correlation": _m(StepNumber.AHC, "", "correlation of simulated and measured control error"),
    "e_c_lag": _m(StepNumber.AHC, "time", "lag of the measured control error behind the simulated one"),
    "e_c_band_ratio": _m(StepNumber.AHC, "", "rms of the control error in the wave band, simulated over measured"),
    "e_c_spectral_distance": _m(
        StepNumber.AHC, "", "rms difference of the spectra of the control error in the wave band, in dB"
    ),
}
_REST = {
    "rest_pressure_difference": _m(StepNumber.PARAMETERS, "pressure", "p_a less p_b while the winch is on its brake"),
}
_PASSIVE = {
    "precharge_error": _m(StepNumber.PASSIVE, "", "passive pressure at mid stroke over the twin's precharge, less 1"),
    "gas_volume_error": _m(
        StepNumber.PASSIVE, "", "gas volume by the stiffness, at the file's index n, over the twin's, less 1"
    ),
    "piston_loss_difference": _m(
        StepNumber.PASSIVE, "pressure", "pressure lost at the flow of all active pumps, less the twin's"
    ),
    "stroke_used": _m(
        StepNumber.PASSIVE, "", "largest excursion of the accumulator piston over half of the twin's stroke"
    ),
    "stroke_end_time": _m(
        StepNumber.PASSIVE,
        "time",
        "time with the stiffness of a piston at its end although the twin's stroke leaves room",
    ),
    "passive_motors_error": _m(StepNumber.PASSIVE, "", "torque of the passive motors over that of the twin's, less 1"),
    "passive_torque_error": _m(
        StepNumber.PASSIVE, "", "constant torque that the balance does not explain over that of the load, one per test"
    ),
    "passive_flow_error": _m(
        StepNumber.PASSIVE, "", "oil displaced by the passive motors, by V_acc, over the twin's, less 1"
    ),
    "passive_setting_error": _m(
        StepNumber.PASSIVE, "", "passive motors' setting over that implied by load cell and pressure, less 1"
    ),
    "make_up_error": _m(StepNumber.PASSIVE, "", "passive pumps' setting over that of the make-up law, less 1"),
}
_RESTS_ON: Mapping[str, str] = {
    "wire_lengths": "s_w",
    "s_tip_pp_low": "s_tip",
    "s_tip_pp_high": "s_tip",
    "data_length": "s_tip s_w",
    "lever_error": "omega_m v_w s_w",
    "clock_error": "s_w v_w s_tip v_tip",
    "v_w_error": "v_w s_w",
    "v_tip_error": "v_tip s_tip",
    "a_tip_error": "a_tip v_tip",
    "length_jump": "s_w v_w s_tip v_tip",
    "motor_offset_error": "u_m alpha_m",
    "pump_gain_error": "u_p alpha_p",
    "displacement_ratio_error": "p_a p_b omega_m alpha_m alpha_p",
    "leakage_error": "p_a p_b omega_m alpha_m alpha_p",
    "leakage_here_error": "p_a p_b omega_m alpha_m alpha_p",
    "load_cell_error": "F_w",
    "friction_error": "p_a p_b F_w p_hp alpha_pm alpha_m omega_m",
    "tip_delay_error": "F_w s_tip s_w",
    "reference_lag": "e_c_measured s_w s_tip",
    "reference_spread": "e_c_measured s_w s_tip",
    "boost_error": "p_a p_b",
    "p_max_over_relief": "p_a p_b",
    "rest_pressure_difference": "p_a p_b",
    "u_p_deviation": "u_p s_tip v_tip a_tip s_w e_c_measured v_op mode",
    "u_m_deviation": "u_m v_tip mode",
    "u_p_deviation_mean": "u_p s_tip v_tip a_tip s_w e_c_measured v_op mode",
    "u_m_deviation_mean": "u_m v_tip mode",
    "u_p_deviation_manual": "u_p v_op mode",
    "u_m_deviation_manual": "u_m v_op mode",
    "command_lag": "u_p",
    "K_1_deviation": "u_p v_tip",
    "K_2_deviation": "u_p a_tip",
    "K_p_deviation": "u_p e_c_measured",
    "u_thr_difference": "u_m v_tip",
    "saturation_time": "u_p",
    "limit_speed_error": "u_p u_m v_w omega_m",
    "limit_speed_error_whole": "v_op v_w omega_m",
    "saturation_overlap": "u_p v_op",
    "pressure_gradient_error": "p_a p_b",
    "pressure_gradient_error_tuned": "p_a p_b",
    "swing_period_error": "p_a p_b",
    "swing_period_error_tuned": "p_a p_b",
    "swing_damping_error": "p_a p_b",
    "swing_damping_error_tuned": "p_a p_b",
    "dynamics_misfit": "p_a p_b omega_m",
    "dynamics_misfit_tuned": "p_a p_b omega_m",
    "C_h_error": "p_a p_b omega_m",
    "C_leak_error": "p_a p_b omega_m",
    "J_m_eff_error": "p_a p_b omega_m",
    **dict.fromkeys(_AHC, "e_c_measured s_tip s_w"),
    "precharge_error": "p_hp V_acc",
    "gas_volume_error": "p_hp alpha_pm omega_m",
    "piston_loss_difference": "p_hp alpha_pm omega_m",
    "stroke_used": "V_acc",
    "stroke_end_time": "V_acc",
    "passive_motors_error": "p_a p_b F_w p_hp alpha_pm alpha_m omega_m",
    "passive_torque_error": "p_a p_b F_w p_hp alpha_pm alpha_m omega_m",
    "passive_setting_error": "alpha_pm F_w p_hp",
    "passive_flow_error": "V_acc alpha_pm omega_m",
    "make_up_error": "alpha_pp p_hp",
}
"""Signals by measure. Sampling, and loads stated in the campaign, depend on no signal's content."""
_BY_KIND = {
    StepNumber.CONTROLLER: ("ahc",),
    StepNumber.LIMITS: ("limits",),
    StepNumber.DYNAMICS: ("dynamics",),
    StepNumber.AHC: ("ahc",),
}
_OF_AHC = (
    "displacement_ratio_error",
    "leakage_error",
    "leakage_here_error",
    "friction_error",
    "tip_delay_error",
    "precharge_error",
    "gas_volume_error",
    "piston_loss_difference",
    "passive_motors_error",
    "passive_flow_error",
    "make_up_error",
)


def _resting(measures: Mapping[str, NamedMeasure]) -> dict[str, NamedMeasure]:
    """The measures with the signals and kinds of tests that they depend on."""
    kinds = {**dict.fromkeys(_OF_AHC, ("ahc",)), "passive_setting_error": ("ahc", "limits")}
    return {
        name: replace(
            m, signals=tuple(_RESTS_ON.get(name, "").split()), kinds=kinds.get(name, _BY_KIND.get(m.step, ()))
        )
        for name, m in measures.items()
    }


MEASURES: Mapping[str, NamedMeasure] = _resting(
    _DATA | _PARAMETERS | _REST | _CONTROLLER | _LIMITS | _DYNAMICS | _AHC | _PASSIVE
)
"""Every measure that a criterion may name."""

SETTINGS: Mapping[str, Named] = {
    "window": Named("time", "window of the peak-to-peak control error"),
    "layers_apart": Named("", "difference of two wire lengths that count as different, in layers of the drum"),
    "load_apart": Named("", "difference of two loads that count as different, as a share of the SWL"),
    "eta_above": Named("length", "least peak-to-peak tip motion for which the compensation efficiency is judged"),
}
"""Settings that the steps compute their measures with. Every set of criteria states all of them."""
