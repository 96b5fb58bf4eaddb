"""Figures of waves, vessels, payloads and responses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stillhook.report.payload_sheet import payload_figure
from stillhook.report.plots.run import sea_figure, year_figure
from stillhook.report.plots.sea import series_figure, spectrum_figure, vessel_figure
from stillhook.response.lift import spectra
from stillhook.spec.scenario import RHO_SEA

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stillhook.response.lift import LiftResponse
    from stillhook.sea.spectra.measured import SeaStates, SpectrumSeries
    from stillhook.sea.spectra.spectrum import WaveSpectrum
    from stillhook.sea.vessel.rao import Rao
    from stillhook.spec.lift.payload import Payload


def spectrum(wave: WaveSpectrum) -> Figure:
    """Density of a wave spectrum over angular frequency, with its mean and zero-crossing periods.

    Parameters
    ----------
    wave : WaveSpectrum
        Such as that of a train of `stillhook.parse_sea`.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    return spectrum_figure(wave)


def sea_states(series: SpectrumSeries | SeaStates) -> Figure:
    """Height and periods of measured or hindcast waves over time, and the mean spectrum where there are spectra.

    Parameters
    ----------
    series : SpectrumSeries or SeaStates
        Read from a file of spectra or sea states.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    return series_figure(series)


def vessel(rao: Rao, point: tuple[float, float] | None = None) -> Figure:
    """Amplitudes of the six motions of a vessel over period; dots: the table, curves: what is used.

    Parameters
    ----------
    rao : Rao
        From `stillhook.read_vessel`.
    point : tuple of float, optional
        Forward and to port of the reference point [m]: its vertical motion as well.

    Returns
    -------
    Figure
        Of matplotlib.
    """
    return vessel_figure(rao, point)


def payload(of: Payload, *, rho: float = RHO_SEA) -> Figure:
    """Displaced volume, added mass, slamming at 1 m/s and drag of a payload over its submergence.

    Parameters
    ----------
    of : Payload
        From `stillhook.read_payload`.
    rho : float, default 1025.0
        Density of the water [kg/m^3].

    Returns
    -------
    Figure
        Of matplotlib.
    """
    return payload_figure(of, rho)


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
