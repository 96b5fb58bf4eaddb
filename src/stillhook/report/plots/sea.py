"""Pictures of waves, of motions of vessels and crane tips, and of weather."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.spectra.measured import Measured, SeaStates, SpectrumSeries
from stillhook.sea.spectra.spectrum import Sea, WaveSpectrum
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import DOFS, Rao, long_wave_limits, long_wave_scales
from stillhook.sea.vessel.tip import TipResponse, tip_response, tip_responses
from stillhook.weather.limit_text import KIND, Limit
from stillhook.weather.persistence import MONTHS
from stillhook.weather.series import HOUR, Weather

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

UPPER = 4.0
"""Where the picture of a spectrum in closed form ends, over its peak frequency."""
SHOWN, STEP = 60.0, 0.1
"""Of the series: what is shown either side of its fastest moment, and the spacing of its points [s]."""
WAVES = 0.985
"""Part of the sea's variance that the spectra show."""


def spectrum_figure(wave: WaveSpectrum) -> Figure:
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
    figure, ax = kit.panel((8.0, 4.5), wave.describe())
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
    kit.axis(ax, "angular frequency [rad/s]", "density S [m² s/rad]", zero="y")
    kit.legend(ax, title=f"H_m0 = {wave.H_m0:.3g} m")
    return figure


def series_figure(series: SpectrumSeries | SeaStates) -> Figure:
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
    spectral = isinstance(series, SpectrumSeries)
    title = f"{series.source}: {series.n_valid} of {len(series)} records valid"
    figure, grid = kit.panels(3 if spectral else 2, 1, (10.0, 8.0 if spectral else 5.5), title)
    height, period, *rest = grid[:, 0]
    height.plot(series.time, series.H_m0, color=COLOURS[0], lw=0.8)
    kit.axis(height, y="H_m0 [m]", zero="y")
    period.plot(series.time, series.T_p, ".", ms=1.5, color=GREY, label="T_p")
    period.plot(series.time, series.T_m02, color=COLOURS[2], lw=0.8, label="T_m02")
    kit.axis(period, "time (UTC)", "period [s]", zero="y")
    kit.legend(period, markerscale=6.0)
    if isinstance(series, SpectrumSeries) and series.n_valid:
        _quantiles(rest[0], series)
    figure.align_ylabels(grid[:, 0])
    return figure


def _quantiles(ax: Axes, series: SpectrumSeries) -> None:
    """Mean density of all records, and the band of 10 % to 90 % of them."""
    S = series.S[series.valid]
    low, high = np.quantile(S, (0.1, 0.9), axis=0)
    kit.band(ax, series.omega, S.mean(axis=0), low, high, label="mean, 10 % to 90 % of the records", alpha=0.25)
    kit.axis(ax, "angular frequency [rad/s]", "density S [m² s/rad]", zero="y")
    kit.legend(ax)


HEADINGS = ((0, "following"), (45, ""), (90, "from starboard"), (135, ""), (180, "head"))
LONGEST = 30.0  # s: shown of longer tables


def vessel_figure(rao: Rao, point: tuple[float, float] | None = None) -> Figure:
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
    title = f"{rao.name}, reference point: {rao.origin or 'not stated'}"
    figure, axes = kit.panels(2 if point is None else 3, 3, (11.0, 8.0 if point is None else 10.5), title)
    period = np.linspace(2.0 * math.pi / rao.omega[-1], min(LONGEST, 2.0 * math.pi / rao.omega[0]), 800)
    omega = 2.0 * math.pi / period
    for d, (dof, ax) in enumerate(zip(DOFS, axes.flat, strict=False)):
        scale, unit = (1.0, "m/m") if d < 3 else (180.0 / math.pi, "deg/m")
        _curves(ax, rao, period, scale * np.abs(rao.at(omega, _beta())[d]))
        _dots(ax, rao, scale, d)
        limit = scale * float(np.abs(long_wave_limits(np.array([_STEEPEST[dof]]))[d, 0]))
        top = ax.get_ylim()[1]
        water = limit * long_wave_scales(omega, rao.depth)[d]
        ax.plot(period, water, color=GREY, lw=0.8, ls=":", label="body that follows the surface")
        ax.set_ylim(top=top)
        kit.axis(ax, title=f"{dof} [{unit}]")
    if point is not None:
        _points(axes[2], rao, period, point)
    for ax in axes.flat:
        ax.set_ylim(bottom=0.0)
    for ax in [*axes[:2].flat, *axes[2:, :2].flat]:
        ax.set_xlim(period[0], period[-1])
    for ax in axes[-1, : 3 if point is None else 2]:
        kit.axis(ax, "wave period [s]")
    kit.legend_below(figure, [axes[0, 0]])
    return figure


_STEEPEST = {
    "surge": 0.0,
    "sway": math.pi / 2.0,
    "heave": 0.0,
    "roll": math.pi / 2.0,
    "pitch": 0.0,
    "yaw": math.pi / 4.0,
}
"""Heading of the largest limit [rad]."""


def _beta() -> FloatArray:
    return np.radians([float(h) for h, _ in HEADINGS])


def _curves(ax: Any, rao: Rao, period: FloatArray, sizes: FloatArray) -> None:
    for (heading, word), size, colour in zip(HEADINGS, sizes, COLOURS, strict=False):
        ax.plot(period, size, color=colour, lw=1.3, label=f"{heading} deg{' ' + word if word else ''}")


def _dots(ax: Any, rao: Rao, scale: float, d: int) -> None:
    for (heading, _), colour in zip(HEADINGS, COLOURS, strict=False):
        near = np.flatnonzero(np.abs(rao.beta - math.radians(heading)) < 1e-3)
        if len(near):
            ax.plot(2.0 * math.pi / rao.omega, scale * np.abs(rao.H[d, near[0]]), ".", color=colour, ms=3.5)


def _points(axes: Any, rao: Rao, period: FloatArray, point: tuple[float, float]) -> None:
    """Vertical motion of the point with waves from starboard, along, and from port."""
    x, y = point
    omega = 2.0 * math.pi / period
    for ax, side, title in (
        (axes[0], 1.0, "from starboard (0 to 180 deg)"),
        (axes[1], -1.0, "from port (360 to 180 deg)"),
    ):
        _curves(ax, rao, period, np.abs(rao.vertical(omega, side * _beta(), x, y)))
        kit.axis(ax, title=f"point x {x:g} m, y {y:g} m, waves\n{title} [m/m]")
    angles = np.radians(np.arange(0.0, 361.0, 5.0))
    for T, colour in ((6.0, COLOURS[0]), (8.0, COLOURS[1]), (10.0, COLOURS[2]), (14.0, COLOURS[3])):
        sizes = np.abs(rao.vertical([2.0 * math.pi / T], angles, x, y)[:, 0])
        axes[2].plot(np.degrees(angles), sizes, color=colour, lw=1.3, label=f"{T:g} s")
    kit.axis(axes[2], "waves travel, ccw from the bow [deg]", title="the same over the heading [m/m]")
    axes[2].set_xticks(range(0, 361, 90))
    kit.legend(axes[2])


DAY = 24.0 * HOUR
NAMES = {"H_m0": "Hs [m]", "wind": "wind [m/s]", "T_p": "Tp [s]", "T_m02": "Tz [s]", "current": "current [m/s]"}


def persistence_figure(answer: dict[str, Any]) -> Figure:
    """Shares of the time and waits, month by month, of what `answer.persistence_answer` gives."""
    span = f"{answer['start'][:10]} to {answer['end'][:10]}"
    title = f"{answer['file']}, {span}: {', '.join(answer['limits'])}"
    figure, grid = kit.panels(2, 1, (8.0, 6.5), title, grid="y", sharex=True)
    top, low = grid[:, 0]
    months, window = answer["months"], f"{answer['window'] / HOUR:g} h"
    place = np.array([m["month"] for m in months])
    shares = (
        ("operability", 0.7, COLOURS[5], "inside all limits"),
        ("start_share", 0.4, COLOURS[0], f"{window} can start"),
    )
    for name, width, colour, label in shares:
        kit.bars(top, place, [100.0 * m[name] for m in months], width=width, color=colour, label=label)
    waits = (("wait_p50", COLOURS[2], "P50"), ("wait_mean", COLOURS[0], "mean"), ("wait_p90", COLOURS[1], "P90"))
    for i, (name, colour, label) in enumerate(waits):
        kit.bars(low, place + 0.27 * (i - 1), [m[name] / DAY for m in months], width=0.25, color=colour, label=label)
    kit.axis(top, y="share of the time [%]")
    kit.axis(low, y=f"wait for {window} [days]")
    low.set_xticks(range(1, 13), MONTHS)
    for ax in (top, low):
        kit.legend(ax, ncols=3)
        ax.set_ylim(0.0, ax.get_ylim()[1] * 1.12)
    return figure


def forecast_figure(weather: Weather, limits: list[Limit], answer: dict[str, Any]) -> Figure:
    """What is forecast, the limits as written and times alpha, and when the operation may start, of what
    `forecast.numbers` gives."""
    bounded = [limit for limit in limits if KIND[limit.range.name] != "angle" and np.isfinite(limit.range.high)]
    columns = list(dict.fromkeys(limit.range.name for limit in bounded))
    head, T_R = "GO" if answer["go"] else "NO-GO", answer["T_R"]
    title = f"{head} at {answer['starts'][0]['time']}; green: the operation may start (T_R {T_R / HOUR:g} h)"
    figure, grid = kit.panels(len(columns), 1, (9.0, 1.5 + 2.4 * len(columns)), title, sharex=True)
    first = np.datetime64(answer["starts"][0]["time"].rstrip("Z"))
    last = np.datetime64(answer["starts"][-1]["time"].rstrip("Z")) + np.timedelta64(round(T_R), "s")
    rows = (weather.time >= first) & (weather.time <= last)
    factor = {f["hs"]: f["alpha"] for f in answer["factors"]}
    for ax, name in zip(grid[:, 0], columns, strict=True):
        style: dict[str, Any] = {"color": COLOURS[0], "marker": ".", "ms": 3, "lw": 1.2, "label": "forecast"}
        ax.plot(weather.time[rows], weather.columns[name][rows], **style)
        for limit in (b for b in bounded if b.range.name == name):
            alpha = factor.get(limit.range.high) if name == "H_m0" else None
            kit.threshold(ax, limit.range.high, limit.text)
            if alpha is not None:
                ax.axhline(alpha * limit.range.high, color=COLOURS[1], lw=1.2, label=f"times alpha {alpha:.3g}")
        for start in answer["starts"]:
            if start["go"]:
                begin = np.datetime64(start["time"].rstrip("Z"))
                ax.axvspan(begin, begin + np.timedelta64(round(weather.step), "s"), color=COLOURS[2], alpha=0.25, lw=0)
        kit.axis(ax, y=NAMES[name], zero="y")
        kit.legend(ax, "lower right", ncols=4)
    figure.autofmt_xdate(rotation=25)
    return figure


def tip_figure(rao: Rao, sea: Sea, at: TipPoint, summary: dict[str, Any], motion: IrregularTip) -> Figure:
    """Spectra of sea and tip, where speed and acceleration come from, sigma_v over the heading, and the fastest two
    minutes."""
    response = tip_response(rao, sea, at.x, at.y)
    title = (
        f"{rao.name}, crane tip at {at.describe()}\n{sea.describe()}\nsigma_z {summary['sigma_z']:.3g} m, sigma_v"
        f" {60.0 * summary['sigma_v']:.3g} m/min, sigma_a {summary['sigma_a']:.3g} m/s², T_z {summary['T_z']:.3g} s"
    )
    figure, axes = kit.panels(2, 2, (11.0, 8.5), title)
    _spectra(axes[0, 0], response)
    _origins(axes[0, 1], response)
    _headings(axes[1, 0], rao, sea, at)
    _series(axes[1, 1], motion)
    return figure


def _spectra(ax: Axes, response: TipResponse) -> None:
    ax.plot(response.omega, response.S_wave, color=COLOURS[0], lw=1.5, label="surface of the sea")
    ax.plot(response.omega, response.S, color=COLOURS[1], lw=1.5, label="height of the tip")
    kit.axis(ax, "frequency [rad/s]", "density [m² s/rad]", zero="y")
    grown = np.cumsum(response.S_wave * response.weight)
    ax.set_xlim(0.0, float(response.omega[np.searchsorted(grown, WAVES * grown[-1])]))
    kit.legend(ax)


def _origins(ax: Axes, response: TipResponse) -> None:
    ends = response.omega_table[1]
    parts = ((0, "height", COLOURS[1]), (2, "speed", COLOURS[2]), (4, "acceleration", COLOURS[3]))
    for order, label, colour in parts:
        grown = np.cumsum(response.omega**order * response.S * response.weight)
        if grown[-1] > 0.0:
            ax.plot(response.omega, 100.0 * grown / grown[-1], color=colour, lw=1.5, label=label)
    ax.axvline(ends, color=GREY, ls=":", label="end of the vessel's table")
    kit.axis(ax, "frequency [rad/s]", "variance of the tip up to there [%]")
    ax.set(xlim=(0.0, 1.1 * ends), ylim=(0.0, 103.0))
    kit.legend(ax, "center")


def _headings(ax: Axes, rao: Rao, sea: Sea, at: TipPoint) -> None:
    first = sea.trains[0].beta
    turns = np.radians(np.arange(0.0, 361.0, 10.0))
    for colour, label, y in ((COLOURS[1], "this tip", at.y), (COLOURS[5], "tip on the other side", -at.y)):
        sigma_v = [60.0 * response.sigma_v for response in tip_responses(rao, sea, at.x, y, turns - first)]
        ax.plot(np.degrees(turns), sigma_v, color=colour, lw=1.5, label=label)
    ax.axvline(math.degrees(first) % 360.0, ymax=0.85, color=GREY, ls=":", label="this heading")
    waves = "waves" if len(sea.trains) == 1 else "first waves, all of them turned"
    where = "0 following, 90 from starboard, 180 head sea, 270 from port"
    kit.axis(ax, f"heading of the {waves} [deg]\n{where}", "sigma_v [m/min]")
    ax.set(xlim=(0.0, 360.0), ylim=(0.0, 1.25 * ax.get_ylim()[1]), xticks=range(0, 361, 45))
    kit.legend(ax, "upper center", ncols=3)


def _series(ax: Axes, motion: IrregularTip) -> None:
    t = np.arange(0.0, motion.repeat, STEP)
    fastest = t[np.argmax(np.abs(motion.sample(t)[1]))]
    start = min(max(0.0, fastest - SHOWN), max(0.0, motion.repeat - 2.0 * SHOWN))
    t = np.arange(start, min(start + 2.0 * SHOWN, motion.repeat), STEP)
    s, v, _ = motion.sample(t)
    ax.plot(t, s, color=COLOURS[1], lw=1.5, label="height [m]")
    ax.plot(t, v, color=COLOURS[2], lw=1.0, label="speed [m/s]")
    kit.axis(ax, "time [s], about the fastest moment of the series")
    ax.set_xlim(t[0], t[-1])
    kit.legend(ax, "upper right")
