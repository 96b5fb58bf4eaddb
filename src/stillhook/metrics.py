"""Figures of merit from any Dataset with the names of `stillhook.variables`: simulated runs and measured logs alike.

Series must be sampled evenly over "time" [s]. Where the Dataset has `warm_up` [s], windows start only after it. A run's
own summary is taken at every PLC cycle and so contains a little more than these functions do on a series stored at a
coarser step.

>>> import numpy as np, stillhook, xarray
>>> t = np.arange(0.0, 120.0, 0.1)
>>> run = xarray.Dataset({"e_c": ("time", 0.05 * np.sin(2.0 * np.pi * t / 10.0))}, coords={"time": t})
>>> round(float(stillhook.metrics.e_c_pp(run).max()), 3)
0.1
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stillhook.errors import StillhookError
from stillhook.sea.motion.recorded import trailing_spans
from stillhook.units import parse
from stillhook.variables import WINDOW

if TYPE_CHECKING:
    import xarray

__all__ = ["counted", "e_c_pp", "eta_c", "s_tip_pp", "settling_time", "time_step"]

__dir__ = lambda: sorted(__all__)

DEFAULT_WINDOW = f"{WINDOW:g} s"


def time_step(run: xarray.Dataset) -> float:
    """Spacing of the time series.

    Parameters
    ----------
    run : Dataset
        A run or a measured log, with the coordinate "time" [s].

    Returns
    -------
    float
        Time between two samples [s].

    Raises
    ------
    StillhookError
        Where there is no series, or it is not evenly spaced.
    """
    if "time" not in run.coords or run.sizes["time"] < 2:
        raise StillhookError("metrics: the Dataset has no time series. Run simulate with series=True.")
    steps = np.diff(run["time"].values)
    if np.ptp(steps) > 1e-6 * steps[0]:
        raise StillhookError("metrics: the time series is not evenly spaced. Resample it first.")
    return float(steps[0])


def counted(run: xarray.Dataset, name: str) -> xarray.DataArray:
    """A series of the run, NaN during the warm-up.

    Parameters
    ----------
    run : Dataset
        A run or a measured log, over "time" [s].
    name : str
        Name of the series, as in `stillhook.variables`.

    Returns
    -------
    DataArray
        The series in its unit [SI], NaN before "warm_up" [s].

    Raises
    ------
    StillhookError
        Where there is no such series, or it is not evenly spaced.
    """
    time_step(run)
    if name not in run:
        raise StillhookError(
            f"metrics: the Dataset has no {name}. Give a run, or a log with the names of the nomenclature."
        )
    start = run["time"][0] + run.get("warm_up", 0.0)
    return run[name].where(run["time"] >= start - 1e-9)


def peak_to_peak(series: xarray.DataArray, dt: float, window: float = WINDOW) -> xarray.DataArray:
    """Largest less smallest value over a trailing window [s] with both ends; NaN where the window is not full of
    numbers."""
    n = _samples(window, dt, series.sizes["time"])
    x, axis = series.values, series.get_axis_num("time")
    assert isinstance(axis, int)
    full = series["time"] >= series["time"][0] + window - 1e-9
    return series.copy(data=trailing_spans(x, n, axis)).where(full)


def _samples(window: float, dt: float, most: int) -> int:
    """Samples in a window, both ends included; one more than there are where the window is longer than the series."""
    n = round(window / dt)
    if n < 1:
        raise StillhookError(f"metrics: window = {window:g} s: give a time, at least the {dt:g} s between two samples.")
    return min(n, most) + 1


def _window(text: str) -> float:
    return parse(text, "time", "metrics: window")


def e_c_pp(run: xarray.Dataset, *, measured: bool = False, window: str = DEFAULT_WINDOW) -> xarray.DataArray:
    """Peak-to-peak control error over the moving window.

    Parameters
    ----------
    run : Dataset
        A run or a measured log, with e_c [m] over "time" [s].
    measured : bool, default False
        Against the tip motion measured by the PLC (e_c_measured) instead of the actual one.
    window : str, default "30 s"
        Length of the moving window.

    Returns
    -------
    DataArray
        Series "e_c_pp" over "time" [m], NaN where the window is not full of numbers.

    Raises
    ------
    StillhookError
        Where there is no such series, it is not evenly spaced, or the window is shorter than the spacing of the series.
    UnitError
        For a window without its unit.

    Notes
    -----
    Source: Moslatt 2020 paper F eq. 2.
    """
    return peak_to_peak(counted(run, "e_c_measured" if measured else "e_c"), time_step(run), _window(window)).rename(
        "e_c_pp"
    )


def s_tip_pp(run: xarray.Dataset, *, window: str = DEFAULT_WINDOW) -> xarray.DataArray:
    """Peak-to-peak tip motion over the moving window.

    Parameters
    ----------
    run : Dataset
        A run or a measured log, with s_tip [m] over "time" [s].
    window : str, default "30 s"
        Length of the moving window.

    Returns
    -------
    DataArray
        Series "s_tip_pp" over "time" [m], NaN where the window is not full of numbers.

    Raises
    ------
    StillhookError
        As for `e_c_pp`.
    """
    return peak_to_peak(counted(run, "s_tip"), time_step(run), _window(window)).rename("s_tip_pp")


def eta_c(run: xarray.Dataset, *, measured: bool = False, window: str = DEFAULT_WINDOW) -> xarray.DataArray:
    """Compensation efficiency 1 - e_c_pp / s_tip_pp over the moving window.

    Parameters
    ----------
    run : Dataset
        A run or a measured log, with e_c and s_tip [m] over "time" [s].
    measured : bool, default False
        Against the tip motion measured by the PLC instead of the actual one.
    window : str, default "30 s"
        Length of the moving window.

    Returns
    -------
    DataArray
        Series "eta_c" over "time" [-], NaN where the tip does not move.

    Raises
    ------
    StillhookError
        As for `e_c_pp`.

    Notes
    -----
    Source: Moslatt 2020 paper F eq. 3.
    """
    tip = s_tip_pp(run, window=window)
    return (1.0 - e_c_pp(run, measured=measured, window=window) / tip.where(tip > 0.0)).rename("eta_c")


def settling_time(run: xarray.Dataset, *, start: str, target: str, step: str, band: float = 0.02) -> xarray.DataArray:
    """Time from `start` until the wire speed stays within a band about its target.

    Parameters
    ----------
    run : Dataset
        A run or a measured log, with v_w [m/s] over "time" [s].
    start : str
        When the step is made, such as "60 s".
    target : str
        Wire speed after the step, such as "50 m/min", hoisting positive.
    step : str
        Size of the step, such as "5 m/min".
    band : float, default 0.02
        Half width of the band over the size of the step [-].

    Returns
    -------
    DataArray
        "settling_time" [s], NaN where the speed never stays within the band.

    Raises
    ------
    StillhookError
        Where start is after the end of the run.
    UnitError
        For a quantity without its unit.

    Notes
    -----
    Source: Moslatt 2020 paper E section 4.3 (2 % of 5 m/min).
    """
    end, change = parse(target, "speed", "target"), parse(step, "speed", "step")
    return settled_after(run, start=parse(start, "time", "start"), target=end, step=change, band=band)


def settled_after(run: xarray.Dataset, *, start: float, target: float, step: float, band: float) -> xarray.DataArray:
    """The same from a start [s] to a target [m/s] after a step [m/s]; see `settling_time`."""
    if not start <= float(run["time"][-1]):
        raise StillhookError(f"metrics: start = {start:g} s is after the end of the run, {float(run['time'][-1]):g} s.")
    after = run["v_w"].where(run["time"] >= start, drop=True)
    outside = np.abs(after - target) > band * abs(step)
    last = after["time"].where(outside).max("time")
    never = after.isel(time=-1).pipe(lambda x: np.abs(x - target) > band * abs(step))
    return (last - start).fillna(0.0).where(~never).rename("settling_time")
