"""The frequency-domain method from a sea to the load: exact rod, winch residual, linearised drag, statistics.

>>> import stillhook
>>> from stillhook import response
>>> file = stillhook.load_lift("anchor-to-3000m")
>>> result = response.lift_response(file, response.Waves(file.sea), z="-2900 m", duration="1 h")  # doctest: +SKIP
>>> float(result.data.sigma_load[0])  # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook.base.lazy import attached

if TYPE_CHECKING:
    from stillhook.response.forcing import Forcing, forcing_of_seas, forcing_of_series
    from stillhook.response.lift import LiftResponse, Waves, compensated_depth, lift_response
    from stillhook.response.winch.grid import identify_grid
    from stillhook.response.wire_rod import End, Rod, natural_periods, static_stretch, transfers

_HOMES = {
    "End": "response.wire_rod",
    "Forcing": "response.forcing",
    "LiftResponse": "response.lift",
    "Rod": "response.wire_rod",
    "Waves": "response.lift",
    "compensated_depth": "response.lift",
    "forcing_of_seas": "response.forcing",
    "forcing_of_series": "response.forcing",
    "identify_grid": "response.winch.grid",
    "lift_response": "response.lift",
    "natural_periods": "response.wire_rod",
    "static_stretch": "response.wire_rod",
    "transfers": "response.wire_rod",
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
