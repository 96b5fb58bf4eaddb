"""Figures of waves, vessels, payloads and responses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook.report.payload_sheet import payload_figure
from stillhook.report.plots.run import sea_figure, year_figure
from stillhook.report.plots.sea import series_figure, spectrum_figure, vessel_figure
from stillhook.response.lift import spectra

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stillhook.response.lift import LiftResponse

spectrum = spectrum_figure
sea_states = series_figure
vessel = vessel_figure
payload = payload_figure


def response(result: LiftResponse, *, title: str | None = None) -> Figure:
    """Spectra of tip, wire and load in one sea; of records over time the motion of tip and load, and over wave height.

    Parameters
    ----------
    result : LiftResponse
        From `stillhook.response.lift_response`.
    title : str, optional
        Above the figure; default controller and depth.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    words = f"{result.mode}, payload at {result.depth:.5g} m" if title is None else title
    if "time" in result.data.dims:
        return year_figure(result.data, words)
    return sea_figure(result.forcing.omega, spectra(result), float(result.T_wire[0]), words)
