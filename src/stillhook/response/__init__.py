"""The frequency-domain road from a sea to the load: exact rod, winch residual, linearised drag, statistics.

>>> import stillhook
>>> from stillhook import response
>>> file = stillhook.load_lift("anchor-to-3000m")
>>> found = response.lift_response(file, response.Waves(file.sea), z="-2900 m", duration="1 h")  # doctest: +SKIP
>>> float(found.data.sigma_load[0])  # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook._lazy import attached

if TYPE_CHECKING:
    from stillhook.response.forcing import Forcing, forcing_of_seas, forcing_of_series
    from stillhook.response.of_lift import LiftResponse, Waves, compensated_depth, lift_response
    from stillhook.response.residual_grid import identify_grid
    from stillhook.response.rod import End, Rod, natural_periods, static_stretch, transfers

_HOMES = {
    "End": "response.rod",
    "Forcing": "response.forcing",
    "LiftResponse": "response.of_lift",
    "Rod": "response.rod",
    "Waves": "response.of_lift",
    "compensated_depth": "response.of_lift",
    "forcing_of_seas": "response.forcing",
    "forcing_of_series": "response.forcing",
    "identify_grid": "response.residual_grid",
    "lift_response": "response.of_lift",
    "natural_periods": "response.rod",
    "static_stretch": "response.rod",
    "transfers": "response.rod",
}
__all__ = [
    "End",
    "Forcing",
    "LiftResponse",
    "Rod",
    "Waves",
    "compensated_depth",
    "forcing_of_seas",
    "forcing_of_series",
    "identify_grid",
    "lift_response",
    "natural_periods",
    "static_stretch",
    "transfers",
]

__getattr__, __dir__ = attached(__name__, _HOMES)
