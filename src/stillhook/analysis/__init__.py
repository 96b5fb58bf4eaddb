"""Analyses of a crane with the twin: stability, envelopes, maps, tuning, uncertainty, comparisons.

>>> import stillhook
>>> crane = stillhook.load_crane("nov-250t")
>>> round(stillhook.analysis.stability(crane).K_p_ms, 6)
2.026039
"""

from typing import TYPE_CHECKING

from stillhook.base.lazy import attached

if TYPE_CHECKING:
    from stillhook.analysis.controllers import Controller, controller
    from stillhook.analysis.loop_stability.models.eigenfrequency import eigenfrequency, gain_limit
    from stillhook.analysis.loop_stability.models.linearisation import linearise
    from stillhook.analysis.loop_stability.stability import Stability
    from stillhook.analysis.maps.monte_carlo import monte_carlo_map
    from stillhook.analysis.maps.operability import operability_map
    from stillhook.analysis.maps.result import Map
    from stillhook.analysis.maps.settling import settling_map
    from stillhook.analysis.operating_envelope.load_speed import envelope, setting_curves
    from stillhook.analysis.steady.operating_point import OperatingPoint
    from stillhook.analysis.surface import (
        full_stability,
        operating_point,
        simulate_reduced,
        stability,
        strong_ssc,
        strongest_gain,
        sweep,
    )
    from stillhook.analysis.tuning.tune import Tuned, tune
    from stillhook.analysis.uncertainty.attribution import Alternative, Attribution, Figure, attribute
    from stillhook.analysis.uncertainty.factors_file import Uncertainty, load_uncertainty
    from stillhook.analysis.uncertainty.monte_carlo import monte_carlo
    from stillhook.analysis.uncertainty.sobol import sensitivity

_HOMES = {
    "Alternative": "analysis.uncertainty.attribution",
    "Attribution": "analysis.uncertainty.attribution",
    "Controller": "analysis.controllers",
    "Figure": "analysis.uncertainty.attribution",
    "Map": "analysis.maps.result",
    "OperatingPoint": "analysis.steady.operating_point",
    "Stability": "analysis.loop_stability.stability",
    "Tuned": "analysis.tuning.tune",
    "Uncertainty": "analysis.uncertainty.factors_file",
    "attribute": "analysis.uncertainty.attribution",
    "controller": "analysis.controllers",
    "eigenfrequency": "analysis.loop_stability.models.eigenfrequency",
    "envelope": "analysis.operating_envelope.load_speed",
    "full_stability": "analysis.surface",
    "gain_limit": "analysis.loop_stability.models.eigenfrequency",
    "linearise": "analysis.loop_stability.models.linearisation",
    "load_uncertainty": "analysis.uncertainty.factors_file",
    "monte_carlo": "analysis.uncertainty.monte_carlo",
    "monte_carlo_map": "analysis.maps.monte_carlo",
    "operability_map": "analysis.maps.operability",
    "operating_point": "analysis.surface",
    "sensitivity": "analysis.uncertainty.sobol",
    "setting_curves": "analysis.operating_envelope.load_speed",
    "settling_map": "analysis.maps.settling",
    "simulate_reduced": "analysis.surface",
    "stability": "analysis.surface",
    "strong_ssc": "analysis.surface",
    "strongest_gain": "analysis.surface",
    "sweep": "analysis.surface",
    "tune": "analysis.tuning.tune",
}
__all__ = [
    "Alternative",
    "Attribution",
    "Controller",
    "Figure",
    "Map",
    "OperatingPoint",
    "Stability",
    "Tuned",
    "Uncertainty",
    "attribute",
    "controller",
    "eigenfrequency",
    "envelope",
    "full_stability",
    "gain_limit",
    "linearise",
    "load_uncertainty",
    "monte_carlo",
    "monte_carlo_map",
    "operability_map",
    "operating_point",
    "sensitivity",
    "setting_curves",
    "settling_map",
    "simulate_reduced",
    "stability",
    "strong_ssc",
    "strongest_gain",
    "sweep",
    "tune",
]

__getattr__, __dir__ = attached(__name__, _HOMES)
