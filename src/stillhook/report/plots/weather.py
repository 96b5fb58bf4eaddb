"""Pictures of weather answers: workable time and waiting by month, and a forecast under its lowered limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.report.plots.run import COLOURS, GREY
from stillhook.weather.answer import MONTHS
from stillhook.weather.limit_text import KIND, Limit
from stillhook.weather.series import HOUR, Weather

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DAY = 24.0 * HOUR
NAMES = {"H_m0": "Hs [m]", "wind": "wind [m/s]", "T_p": "Tp [s]", "T_m02": "Tz [s]", "current": "current [m/s]"}


def persistence_figure(answer: dict[str, Any]) -> Figure:
    """Shares of the time and waits, month by month, of what `answer.persistence_answer` gives."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    figure = Figure(figsize=(8.0, 6.5), layout="constrained")
    top, low = figure.subplots(2, 1, sharex=True)
    months = answer["months"]
    place = np.array([m["month"] for m in months])
    window = f"{answer['window'] / HOUR:g} h"
    top.bar(place, [100.0 * m["operability"] for m in months], 0.7, color=COLOURS[5], label="inside all limits")
    top.bar(place, [100.0 * m["start_share"] for m in months], 0.4, color=COLOURS[0], label=f"{window} can start")
    waits = (
        ("wait_p50", -0.27, COLOURS[2], "P50"),
        ("wait_mean", 0.0, COLOURS[0], "mean"),
        ("wait_p90", 0.27, COLOURS[1], "P90"),
    )
    for name, shift, colour, label in waits:
        low.bar(place + shift, [m[name] / DAY for m in months], 0.25, color=colour, label=label)
    top.set_ylabel("share of the time [%]")
    low.set_ylabel(f"wait for {window} [days]")
    low.set_xticks(range(1, 13), MONTHS)
    for ax in (top, low):
        ax.grid(alpha=0.3, axis="y")
        ax.set_axisbelow(True)
        ax.legend(frameon=False, ncols=3, fontsize="small")
        ax.set_ylim(0.0, ax.get_ylim()[1] * 1.12)
    span = f"{answer['start'][:10]} to {answer['end'][:10]}"
    figure.suptitle(f"{answer['file']}, {span}: {', '.join(answer['limits'])}", fontsize="medium", wrap=True)
    return figure


def forecast_figure(weather: Weather, limits: list[Limit], answer: dict[str, Any]) -> Figure:
    """What is forecast, the limits as written and times alpha, and when the operation may start, of what
    `forecast.numbers` gives."""
    from matplotlib.figure import Figure  # heavy: only where pictures are wanted

    bounded = [limit for limit in limits if KIND[limit.range.name] != "angle" and np.isfinite(limit.range.high)]
    columns = list(dict.fromkeys(limit.range.name for limit in bounded))
    figure = Figure(figsize=(9.0, 1.5 + 2.4 * len(columns)), layout="constrained")
    first = np.datetime64(answer["starts"][0]["time"].rstrip("Z"))
    last = np.datetime64(answer["starts"][-1]["time"].rstrip("Z")) + np.timedelta64(round(answer["T_R"]), "s")
    rows = (weather.time >= first) & (weather.time <= last)
    factor = {f["hs"]: f["alpha"] for f in answer["factors"]}
    for ax, name in zip(figure.subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0], columns, strict=True):
        ax.plot(
            weather.time[rows],
            weather.columns[name][rows],
            color=COLOURS[0],
            marker=".",
            ms=3,
            lw=1.2,
            label="forecast",
        )
        for limit in (b for b in bounded if b.range.name == name):
            alpha = factor.get(limit.range.high) if name == "H_m0" else None
            ax.axhline(limit.range.high, color=GREY, ls="--", lw=1, label=limit.text)
            if alpha is not None:
                ax.axhline(alpha * limit.range.high, color=COLOURS[1], lw=1.2, label=f"times alpha {alpha:.3g}")
        for start in answer["starts"]:
            if start["go"]:
                begin = np.datetime64(start["time"].rstrip("Z"))
                ax.axvspan(begin, begin + np.timedelta64(round(weather.step), "s"), color=COLOURS[2], alpha=0.25, lw=0)
        ax.set_ylabel(NAMES[name])
        ax.set_ylim(bottom=0.0)
        ax.grid(alpha=0.3)
        ax.legend(frameon=False, fontsize="small", ncols=4, loc="lower right")
    figure.autofmt_xdate(rotation=25)
    head = "GO" if answer["go"] else "NO-GO"
    green = f"green: the operation may start (T_R {answer['T_R'] / HOUR:g} h)"
    figure.suptitle(f"{head} at {answer['starts'][0]['time']}; {green}", fontsize="medium")
    return figure
