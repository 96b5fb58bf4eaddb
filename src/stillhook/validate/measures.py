"""Names of the measures that steps find and criteria may judge, and of the settings that a set of criteria hands to the steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from stillhook.validate.lines import StepNumber


@dataclass(frozen=True)
class Named:
    """A measure or setting: quantity a key of `stillhook.units.KINDS`, "" for a pure number; meaning in words."""

    quantity: str
    meaning: str


@dataclass(frozen=True)
class NamedMeasure(Named):
    """step: the one that finds it."""

    step: StepNumber


def _m(step: StepNumber, quantity: str, meaning: str) -> NamedMeasure:
    return NamedMeasure(quantity, meaning, step)


_DATA = {
    "wire_lengths": _m(StepNumber.DATA, "", "different wire lengths in the tests with heave compensation"),
    "loads": _m(StepNumber.DATA, "", "different winch loads in the tests with heave compensation"),
    "load_share": _m(StepNumber.DATA, "", "highest winch load over the safe working load"),
    "s_tip_pp_low": _m(StepNumber.DATA, "length", "smallest peak-to-peak tip motion over a window"),
    "s_tip_pp_high": _m(StepNumber.DATA, "length", "largest peak-to-peak tip motion over a window"),
    "data_length": _m(StepNumber.DATA, "time", "length of the tests with heave compensation"),
    "samples_lost": _m(StepNumber.DATA, "", "share of the samples of a log that its rate promises and that are not there"),
    "longest_gap": _m(StepNumber.DATA, "time", "longest time between two samples of a log"),
    "samples_doubtful": _m(StepNumber.DATA, "", "share of a test's samples at an end of a sensor, bridged or not known, worst signal"),
    "wire_lag": _m(StepNumber.DATA, "time", "time by which the wire follows the tip in heave compensation"),
    "clock_drift": _m(StepNumber.DATA, "", "drift of another clock of a log against the main one, which is taken out"),
}
_PARAMETERS = {
    "lever_error": _m(StepNumber.PARAMETERS, "", "wire per turn of the motors, implied over the twin's, less 1"),
    "clock_error": _m(StepNumber.PARAMETERS, "", "by which the time stamps of the log run too fast"),
    "v_w_error": _m(StepNumber.PARAMETERS, "", "by which the wire speed reads too much against the wire paid out"),
    "v_tip_error": _m(StepNumber.PARAMETERS, "", "by which the tip speed reads too much against the tip position"),
    "a_tip_error": _m(StepNumber.PARAMETERS, "", "by which the tip acceleration reads too much against the tip speed"),
    "length_jump": _m(StepNumber.PARAMETERS, "length", "largest jump of wire out or tip position that its speed does not explain"),
    "motor_offset_error": _m(StepNumber.PARAMETERS, "", "offset of the motors' setting above their command, less the twin's"),
    "pump_gain_error": _m(StepNumber.PARAMETERS, "", "pumps' setting over their servo's answer to the command, less 1"),
    "displacement_ratio_error": _m(
        StepNumber.PARAMETERS, "", "motor flow over pump flow with leakage apart, implied over the twin's, less 1"
    ),
    "leakage_error": _m(StepNumber.PARAMETERS, "", "leakage of the active circuit, implied by the flows over the twin's, less 1"),
    "load_cell_error": _m(StepNumber.PARAMETERS, "", "mean of the load cell over hook and payload, less 1"),
    "friction_error": _m(StepNumber.PARAMETERS, "", "friction that the torques at the motors leave, over the twin's, less 1"),
    "tip_delay_error": _m(
        StepNumber.PARAMETERS, "time", "delay of the logged tip behind the true one by the load cell, less the stated one"
    ),
    "reference_lag": _m(StepNumber.PARAMETERS, "time", "by which the tip in the PLC's own error comes later than the logged tip"),
    "reference_spread": _m(StepNumber.PARAMETERS, "length", "standard deviation of the PLC's reference from error, wire and tip"),
    "boost_error": _m(StepNumber.PARAMETERS, "pressure", "mean pressure of the lower line, less the twin's boost pressure"),
    "p_max_over_relief": _m(StepNumber.PARAMETERS, "", "highest pressure over the relief setting, less 1"),
}
_CONTROLLER = {
    "u_p_deviation": _m(StepNumber.CONTROLLER, "", "|pump command measured - simulated| below which 95 % of the samples of a test are"),
    "u_m_deviation": _m(StepNumber.CONTROLLER, "", "the same of the motor command"),
    "u_p_deviation_mean": _m(StepNumber.CONTROLLER, "", "mean |pump command measured - simulated| of a test"),
    "u_m_deviation_mean": _m(StepNumber.CONTROLLER, "", "the same of the motor command"),
    "u_p_deviation_manual": _m(StepNumber.CONTROLLER, "", "u_p_deviation in manual mode"),
    "u_m_deviation_manual": _m(StepNumber.CONTROLLER, "", "u_m_deviation in manual mode"),
    "command_lag": _m(StepNumber.CONTROLLER, "time", "time by which the logged pump commands come after the simulated ones"),
    "K_1_deviation": _m(StepNumber.CONTROLLER, "", "K_1 in the logged commands over the crane file's, less 1"),
    "K_2_deviation": _m(StepNumber.CONTROLLER, "", "K_2 in the logged commands over the crane file's, less 1"),
    "K_p_deviation": _m(StepNumber.CONTROLLER, "", "K_p in the logged commands over the crane file's, less 1"),
    "u_thr_difference": _m(StepNumber.CONTROLLER, "", "u_thr in the logged motor commands, less the crane file's"),
}
_LIMITS = {
    "saturation_time": _m(StepNumber.LIMITS, "time", "time with the pumps at their end in the logs"),
    "limit_speed_error": _m(StepNumber.LIMITS, "", "wire speed there, twin driven by the measured commands over the crane, less 1"),
    "limit_speed_error_whole": _m(StepNumber.LIMITS, "", "the same of the whole twin on measured tip motion and joystick"),
    "saturation_overlap": _m(StepNumber.LIMITS, "", "time with the pumps at their end in log and whole twin at once, over that in either"),
}
_DYNAMICS = {
    "pressure_gradient_error": _m(StepNumber.DYNAMICS, "", "pressure gradient in a turn of the winch, simulated over measured, less 1"),
    "pressure_gradient_error_tuned": _m(StepNumber.DYNAMICS, "", "the same with the tuned crane"),
    "swing_period_error": _m(StepNumber.DYNAMICS, "", "period between significant pressure peaks, simulated over measured, less 1"),
    "swing_period_error_tuned": _m(StepNumber.DYNAMICS, "", "the same with the tuned crane"),
    "swing_damping_error": _m(StepNumber.DYNAMICS, "", "damping ratio of these swings, simulated over measured, less 1"),
    "swing_damping_error_tuned": _m(StepNumber.DYNAMICS, "", "the same with the tuned crane"),
    "dynamics_misfit": _m(StepNumber.DYNAMICS, "", "rms of simulated less measured over the signal's own deviation, one a signal"),
    "dynamics_misfit_tuned": _m(StepNumber.DYNAMICS, "", "the same with the tuned crane"),
    "C_h_error": _m(StepNumber.DYNAMICS, "", "capacitance of the lines, tuned over the crane file's, less 1"),
    "C_leak_error": _m(StepNumber.DYNAMICS, "", "leakage of the active circuit, tuned over the crane file's, less 1"),
    "J_m_eff_error": _m(StepNumber.DYNAMICS, "", "inertia at the motor shaft, tuned over the crane file's, less 1"),
}
_AHC = {
    "e_c_pp_deviation": _m(StepNumber.AHC, "length", "mean deviation of the peak-to-peak control error over all windows"),
    "e_c_pp_deviation_case": _m(StepNumber.AHC, "length", "the same over the windows of one load case, one a load case"),
    "e_c_pp_deviation_s": _m(StepNumber.AHC, "length", "standard deviation of that deviation"),
    "e_c_pp_below_5cm": _m(StepNumber.AHC, "", "share of windows with a deviation below 5 cm, counted"),
    "e_c_pp_below_6cm": _m(StepNumber.AHC, "", "share of windows with a deviation below 6 cm, counted"),
    "e_c_pp_bias": _m(StepNumber.AHC, "length", "mean of the peak-to-peak control error, simulated less measured"),
    "e_c_max_difference": _m(StepNumber.AHC, "length", "largest |e_c| simulated less largest |e_c| measured, one a load case"),
    "e_c_deviation_max": _m(StepNumber.AHC, "length", "largest |e_c simulated - e_c measured| at any one moment"),
    "eta_c_deviation_high": _m(StepNumber.AHC, "", "mean deviation of the compensation efficiency at high tip motion"),
    "e_c_correlation": _m(StepNumber.AHC, "", "correlation of simulated and measured control error"),
    "e_c_lag": _m(StepNumber.AHC, "time", "time by which the measured control error comes after the simulated one"),
    "e_c_band_ratio": _m(StepNumber.AHC, "", "rms of the control error in the wave band, simulated over measured"),
    "e_c_spectral_distance": _m(StepNumber.AHC, "", "rms difference of the spectra of the control error in the wave band, in dB"),
}
MEASURES: Mapping[str, NamedMeasure] = _DATA | _PARAMETERS | _CONTROLLER | _LIMITS | _DYNAMICS | _AHC
"""Every measure that a criterion may name."""

SETTINGS: Mapping[str, Named] = {
    "window": Named("time", "window of the peak-to-peak control error"),
    "layers_apart": Named("", "layers of the drum by which two wire lengths are apart that count as different"),
    "load_apart": Named("", "part of the SWL by which two loads are apart that count as different"),
    "eta_above": Named("length", "peak-to-peak tip motion from which the compensation efficiency is judged"),
}
"""Numbers that steps compute their measures with. Every set of criteria gives all of them."""
