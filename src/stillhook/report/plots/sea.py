"""Pictures of waves: one spectrum, and a series of records over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.report.plots.run import COLOURS, GREY
from stillhook.sea.spectra.measured import Measured, SpectrumSeries
from stillhook.sea.spectra.spectrum import WaveSpectrum
from stillhook.sea.spectra.states import SeaStates

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

UPPER = 4.0
"""Where the picture of a spectrum in closed form ends, over its peak frequency."""


def spectrum_figure(wave: WaveSpectrum) -> Figure:
    """S over omega, with the mean and zero-crossing frequencies."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    ax = figure.subplots()
    if isinstance(wave, Measured):
        edges = np.append(wave.omega - wave.width / 2.0, wave.omega[-1] + wave.width[-1] / 2.0)
        ax.stairs(wave.S, edges, color=COLOURS[0], fill=True, alpha=0.4)
        ax.stairs(wave.S, edges, color=COLOURS[0])
    else:
        omega = wave.grid()
        omega = omega[omega <= UPPER * 2.0 * np.pi / wave.peak_period] if wave.peak_period > 0.0 else omega
        ax.plot(omega, wave.density(omega), color=COLOURS[0])
    for name, T, colour in (("T_m01", wave.T_m01, COLOURS[1]), ("T_m02", wave.T_m02, COLOURS[2])):
        if T > 0.0:
            ax.axvline(2.0 * np.pi / T, color=colour, ls="--", lw=1, label=f"{name} = {T:.3g} s")
    _axes(ax, "angular frequency [rad/s]", "density S [m² s/rad]")
    ax.set_ylim(bottom=0.0)
    ax.legend(title=f"H_m0 = {wave.H_m0:.3g} m", frameon=False)
    ax.set_title(wave.describe(), fontsize="medium", wrap=True)
    return figure


def series_figure(series: SpectrumSeries | SeaStates) -> Figure:
    """Height and periods over time, and the mean spectrum where there are spectra."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    spectral = isinstance(series, SpectrumSeries)
    figure = Figure(figsize=(10.0, 8.0 if spectral else 5.5), layout="constrained")
    axes = figure.subplots(3 if spectral else 2, 1)
    axes[0].plot(series.time, series.H_m0, color=COLOURS[0], lw=0.8)
    _axes(axes[0], "", "H_m0 [m]")
    axes[0].set_ylim(bottom=0.0)
    axes[1].plot(series.time, series.T_p, ".", ms=1.5, color=GREY, label="T_p")
    axes[1].plot(series.time, series.T_m02, color=COLOURS[2], lw=0.8, label="T_m02")
    _axes(axes[1], "time (UTC)", "period [s]")
    axes[1].legend(frameon=False, markerscale=6.0)
    axes[1].set_ylim(bottom=0.0)
    if isinstance(series, SpectrumSeries) and series.n_valid:
        _quantiles(axes[2], series)
    figure.suptitle(f"{series.source}: {series.n_valid} of {len(series)} records valid", fontsize="medium")
    figure.align_ylabels(axes)
    return figure


def _quantiles(ax: Axes, series: SpectrumSeries) -> None:
    S = series.S[series.valid]
    low, high = np.quantile(S, (0.1, 0.9), axis=0)
    ax.fill_between(series.omega, low, high, color=COLOURS[0], alpha=0.25, lw=0, label="10 % to 90 % of the records")
    ax.plot(series.omega, S.mean(axis=0), color=COLOURS[0], label="mean")
    _axes(ax, "angular frequency [rad/s]", "density S [m² s/rad]")
    ax.set_ylim(bottom=0.0)
    ax.legend(frameon=False)


def _axes(ax: Axes, x: str, y: str) -> None:
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    ax.grid(alpha=0.3)
