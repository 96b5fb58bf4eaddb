"""Logs of a campaign to records."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from stillhook.engine.run import Meter
from stillhook.io.log import read_log
from stillhook.metrics import peak_to_peak
from stillhook.scenario import Mode
from stillhook.validate.campaign import Campaign, CraneTest
from stillhook.validate.record import FloatArray, Record, Segment
from stillhook.variables import WINDOW

GAP = 3.0  # spacings: a longer step is a gap


def read_records(campaign: Campaign, progress: Callable[[float], None]) -> tuple[Record, ...]:
    """Every test of a campaign, read."""
    meter = Meter(float(len(campaign.tests)), progress)
    records = []
    for test in campaign.tests:
        reached = meter.part(1.0)
        records.append(_record(campaign, test, reached))
        reached(1.0)
    return tuple(records)


def _record(campaign: Campaign, test: CraneTest, progress: Callable[[float], None]) -> Record:
    log = read_log(test.log, test.mapping, every=f"{campaign.crane.control.t_cycle!r} s", progress=progress)
    use = np.flatnonzero((log.t >= test.start) & (log.t <= test.end))
    t = log.t[use]
    grid = np.arange(t[0], t[-1] + 0.5 * log.every, log.every)
    signals = {name: _on_grid(grid, t, values[use], log.every) for name, values in log.signals.items()}
    grid = grid - grid[0]
    parts = _unbroken(t - t[0], log.every)
    segments = tuple(_segment(campaign, test, grid, log.every, signals, a, b) for a, b in parts)
    return Record(test, log, grid, log.every, signals, segments, ())


def _on_grid(grid: FloatArray, t: FloatArray, values: FloatArray, step: float) -> FloatArray:
    good = np.isfinite(values)
    after = np.clip(np.searchsorted(t[good], grid), 1, max(1, int(good.sum()) - 1))
    apart = t[good][after] - t[good][after - 1]
    return np.where(apart <= GAP * step, np.interp(grid, t[good], values[good]), np.nan)


def _unbroken(t: FloatArray, step: float) -> list[tuple[int, int]]:
    breaks = np.flatnonzero(np.diff(t) > GAP * step)
    ends = [*t[breaks], t[-1]]
    begins = [t[0], *t[breaks + 1]]
    return [(round(a / step), round(b / step) + 1) for a, b in zip(begins, ends, strict=True)]


def _segment(
    campaign: Campaign, test: CraneTest, t: FloatArray, step: float, signals: dict[str, FloatArray], a: int, b: int
) -> Segment:
    import xarray

    tip, s_w = signals["s_tip"][a:b], signals["s_w"][a:b]
    series = xarray.DataArray(tip, coords={"time": t[a:b]}, dims="time")
    window = min(WINDOW, float(t[b - 1] - t[a]))
    code = round(float(np.nanmedian(signals["mode"][a:b]))) if "mode" in signals else None
    mode = test.mode or (list(Mode)[code] if code is not None else Mode.MANUAL)
    up = np.flatnonzero((tip[:-1] < tip.mean()) & (tip[1:] >= tip.mean()))
    return Segment(
        test=test.name, first=a, last=b, start=float(t[a]), duration=float(t[b - 1] - t[a]), load=test.load or 0.0, s_w=float(s_w[0]),
        s_w_min=float(np.nanmin(s_w)), s_w_max=float(np.nanmax(s_w)), s_tip_pp=float(np.nanmax(peak_to_peak(series, step, window))),
        period=float(np.diff(t[a:b][up]).mean()) if len(up) > 1 else float("nan"), mode=mode,
    )  # fmt: skip
