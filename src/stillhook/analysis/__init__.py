"""What an engineer asks of the twin: stability, envelopes, maps, tuning, uncertainty, comparisons.

>>> import stillhook
>>> crane = stillhook.load_crane("nov-250t")
>>> round(stillhook.analysis.stability(crane).K_p_ms, 6)
2.026039
"""

from typing import TYPE_CHECKING

from stillhook._lazy import attached

if TYPE_CHECKING:
    from stillhook.analysis.attribution import Alternative, Attribution, Figure, attribute
    from stillhook.analysis.controllers import Controller, controller
    from stillhook.analysis.linear import eigenfrequency, gain_limit
    from stillhook.analysis.linearisation import linearise
    from stillhook.analysis.load_speed import envelope, setting_curves
    from stillhook.analysis.loop_stability import Stability
    from stillhook.analysis.many_draws import monte_carlo
    from stillhook.analysis.map_draws import monte_carlo_map
    from stillhook.analysis.map_result import Map
    from stillhook.analysis.maps import operability_map
    from stillhook.analysis.operation import OperatingPoint
    from stillhook.analysis.settling import settling_map
    from stillhook.analysis.sobol import sensitivity
    from stillhook.analysis.surface import (
        full_stability,
        operating_point,
        simulate_reduced,
        stability,
        strong_ssc,
        strongest_gain,
        sweep,
    )
    from stillhook.analysis.tuning import Tuned, tune
    from stillhook.analysis.uncertainty import Uncertainty, load_uncertainty

_HOMES = {
    "Alternative": "analysis.attribution",
    "Attribution": "analysis.attribution",
    "Controller": "analysis.controllers",
    "Figure": "analysis.attribution",
    "Map": "analysis.map_result",
    "OperatingPoint": "analysis.operation",
    "Stability": "analysis.loop_stability",
    "Tuned": "analysis.tuning",
    "Uncertainty": "analysis.uncertainty",
    "attribute": "analysis.attribution",
    "controller": "analysis.controllers",
    "eigenfrequency": "analysis.linear",
    "envelope": "analysis.load_speed",
    "full_stability": "analysis.surface",
    "gain_limit": "analysis.linear",
    "linearise": "analysis.linearisation",
    "load_uncertainty": "analysis.uncertainty",
    "monte_carlo": "analysis.many_draws",
    "monte_carlo_map": "analysis.map_draws",
    "operability_map": "analysis.maps",
    "operating_point": "analysis.surface",
    "sensitivity": "analysis.sobol",
    "setting_curves": "analysis.load_speed",
    "settling_map": "analysis.settling",
    "simulate_reduced": "analysis.surface",
    "stability": "analysis.surface",
    "strong_ssc": "analysis.surface",
    "strongest_gain": "analysis.surface",
    "sweep": "analysis.surface",
    "tune": "analysis.tuning",
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
