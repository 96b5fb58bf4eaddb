"""Weather answers as tables for people."""

from __future__ import annotations

from typing import Any

from stillhook.report.formatting import display_number, display_unit, wrapped
from stillhook.report.terminal import print_table, print_values
from stillhook.units import number


def print_alpha(answer: dict[str, Any]) -> None:
    """Factor, forecast limit and reference period."""
    shown = {
        k: "-" if v is None else {True: "yes", False: "no"}[v] if isinstance(v, bool) else v for k, v in answer.items()
    }
    times = {k: f"{answer[k] / 3600.0:g} h" for k in ("T_POP", "T_C", "T_R")}
    print_values({k: v for k, v in shown.items() if k not in ("reason", "table", *times)})
    wrapped(", ".join(f"{k} {v}" for k, v in times.items()))
    if answer["reason"]:
        wrapped(answer["reason"])
    wrapped(answer["table"])


def print_forecast(answer: dict[str, Any]) -> None:
    """Go or no-go, and for which starts."""
    head = "GO" if answer["go"] else "NO-GO"
    later = f"; first possible start {answer['first_start']}" if answer["first_start"] and not answer["go"] else ""
    wrapped(f"{head}: {answer['file']}, {', '.join(answer['limits'])}{later}")
    if answer["reason"]:
        wrapped(answer["reason"])
    for one in answer["factors"]:
        wrapped(
            f"Hs: OP_LIM {one['hs']:.4g} m x alpha {one['alpha']:.3g} = OP_WF {one['op_wf']:.3g} m; T_R"
            f" {one['T_R'] / 3600.0:g} h"
        )
    rows = [
        [a["time"], b["time"], {True: "go", False: "no-go", None: "not covered"}[a["go"]], a["governs"], *_used(a)]
        for a, b in _stretches(answer["starts"])
    ]
    heads = ("from", "to", "start", "governed by", "most", "allowed")
    print_table(heads, rows, left=4, title="Starts, one a record; governing limit of the first of each")
    wrapped(answer["factors"][0]["table"])
    for note in answer["notes"]:
        wrapped(note)


def _stretches(starts: list[dict[str, Any]]) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """First and last of the starts that follow each other with one answer."""
    spans: list[tuple[dict[str, Any], dict[str, Any]]] = []
    for one in starts:
        if spans and spans[-1][0]["go"] is one["go"]:
            spans[-1] = (spans[-1][0], one)
        else:
            spans.append((one, one))
    return spans


def _used(start: dict[str, Any]) -> list[str]:
    return ["-" if start[key] is None else f"{start[key]:.3g}" for key in ("most", "allowed")]


def print_persistence(answer: dict[str, Any]) -> None:
    """Windows and waits, month by month."""
    from stillhook.weather.persistence import MONTHS

    every = f"a record every {answer['step'] / 3600.0:g} h"
    wrapped(f"{answer['file']}: {answer['start']} to {answer['end']}, {every}; {', '.join(answer['limits'])}")
    heads = ("", "hours", "operable\n%", "can start\n%", "windows", "mean\nh", "longest\nh", "long\nenough")
    rows = [_row(MONTHS[m["month"] - 1], m) for m in answer["months"]] + [_row("all", answer)]
    title = f"Windows of {answer['window'] / 3600.0:g} h: waits from every record, by the month in which they begin"
    waits = ("wait\nmean h", "wait\nP50 h", "wait\nP90 h", "no later\nwindow")
    print_table((*heads, *waits), rows, title=title)
    lost = f"{answer['n_missing']} of {answer['n_records']} records without a value that a limit asks for"
    wrapped(f"Gaps in time: {answer['n_gaps']}; {lost}. Both break windows.")
    if headings := answer.get("by_heading"):
        best, worst = (choose(headings, key=lambda h: h["operability"]) for choose in (max, min))
        held = [
            f"{100.0 * h['operability']:.1f} % at {display_number('ship', h['ship'], 4)} deg" for h in (best, worst)
        ]
        wrapped(
            f"The ship turns to what suits each record best. Held on one heading: {held[0]} at best, {held[1]} at"
            " worst."
        )
    if answer["n_censored"]:
        share = answer["n_censored"] / answer["n_records"]
        end = "of all records have no later window before the series ends: left out of the waits."
        wrapped(f"{answer['n_censored']} ({number(100.0 * share, 3)} %) {end}")
    for note in answer["notes"]:
        wrapped(note)


def _row(label: str, numbers: dict[str, Any]) -> list[str]:
    times = [_h(numbers[name]) for name in ("window_mean", "window_max", "wait_mean", "wait_p50", "wait_p90")]
    shares = ["-" if (x := numbers[name]) != x else f"{100.0 * x:.1f}" for name in ("operability", "start_share")]
    counts = [str(numbers[name]) for name in ("n_windows", "n_windows_long_enough", "n_censored")]
    return [label, f"{numbers['n_hours']:g}", *shares, counts[0], *times[:2], counts[1], *times[2:], counts[2]]


def _h(time: float) -> str:
    """A time in hours."""
    return "-" if time != time else f"{time / 3600.0:.1f}"


def print_show(answer: dict[str, Any]) -> None:
    """What a file holds."""
    records = f"{answer['n_records']} records, one every {answer['step'] / 3600.0:g} h"
    wrapped(f"{answer['file']}: {answer['start']} to {answer['end']}, {records}")
    rows = [
        [
            name,
            display_unit(name),
            str(c["n_missing"]),
            *("-" if c[k] is None else display_number(name, c[k], 4) for k in ("min", "mean", "p90", "max")),
        ]
        for name, c in answer["columns"].items()
    ]
    print_table(("column", "unit", "missing", "least", "mean", "P90", "most"), rows, left=2)
    wrapped(f"Gaps in time: {answer['n_gaps']}, with {answer['absent'] / 3600.0:g} h in them.")
    for note in answer["notes"]:
        wrapped(note)
