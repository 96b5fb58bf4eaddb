"""Figures of analyses: maps, envelopes, stability, uncertainty, drives."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook.analysis.drives.figures import bars_figure, sankey_figure
from stillhook.analysis.loop_stability.sweeps import bode_figure, root_locus_figure
from stillhook.analysis.maps.figures import change_figure, value_figure
from stillhook.analysis.maps.result import SHOWN, Map
from stillhook.analysis.steady.figures import layer_figure, load_speed_figure, setting_figure
from stillhook.analysis.uncertainty.report import band_figure, index_figure
from stillhook.errors import StillhookError
from stillhook.units import quote

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from stillhook.analysis.drives.comparison import DriveComparison

envelope = load_speed_figure
layers = layer_figure
settings = setting_figure
bode = bode_figure
root_locus = root_locus_figure
indices = index_figure
energy = sankey_figure


def map(  # noqa: A001  # the field's noun
    data: xarray.Dataset, value: str | None = None, *, layer: int = 0, period: int = 0
) -> Figure:
    """One number of a map over load and speed, a panel for each controller; hatched where it is not applicable.

    Parameters
    ----------
    data : Dataset
        From `stillhook.analysis.operability_map` or `settling_map`.
    value : str, optional
        Name of the number: "e_c_pp", "eta_c", "p_max", "alpha_m_min", "settling_time" or "alpha_m_end"; default the
        first of these that the map has.
    layer : int, default 0
        Place along the dimension "layer", where the map has one.
    period : int, default 0
        Place along the dimension "period", where the map has one.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, for a number that the map does not have.
    """
    of = Map.from_dataset(data)
    available = [name for name in SHOWN if name in of.values]
    if value is not None and value not in available:
        raise StillhookError(f"plot.map: value = {quote(value)}: choose one of {', '.join(available)}.")
    return value_figure(of, value or available[0], layer=layer, period=period)


def change(data: xarray.Dataset, *, layer: int = 0, period: int = 0) -> Figure:
    """Change of error and pressure, or of settling time, against the best classic controller [%].

    Parameters
    ----------
    data : Dataset
        As of `map`.
    layer : int, default 0
        Place along the dimension "layer", where the map has one.
    period : int, default 0
        Place along the dimension "period", where the map has one.

    Returns
    -------
    Figure
        Of matplotlib.

    Raises
    ------
    StillhookError
        One line, where the map has no classic controller next to another one.
    """
    figure = change_figure(Map.from_dataset(data), layer=layer, period=period)
    if figure is None:
        raise StillhookError("plot.change: the map compares no controller with NS or HS. Map one of each.")
    return figure


def uncertainty(data: xarray.Dataset) -> Figure:
    """Every draw of every case, with median, 5 to 95 % band and the crane as described.

    Parameters
    ----------
    data : Dataset
        From `stillhook.analysis.monte_carlo`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    return band_figure(data, str(data.attrs.get("title", "")))


def drives(comparison: DriveComparison) -> Figure:
    """Control error and net energy of each drive, with the band of what is uncertain.

    Parameters
    ----------
    comparison : DriveComparison
        What `stillhook compare --drives` computes.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    return bars_figure(comparison, title=comparison.reference.name)
