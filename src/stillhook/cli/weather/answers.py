"""What the weather commands answer: lines and small tables, and with --verbose full tables."""

from __future__ import annotations

from functools import partial
from typing import Any

from stillhook.report.formatting import days, display_number, display_unit, percent, wrapped
from stillhook.report.terminal import Answer, Line, columns, print_table, print_values
from stillhook.units import number

CREDITS = {"twin": "as simulated", "credited": "as credited", "claimable": "as may be claimed"}
VERDICTS = {True: "go", False: "no-go", None: "not covered"}
WAITS = ("wait_mean", "wait_p50", "wait_p90")


def _go(answer: dict[str, Any], subject: str) -> str:
    """Go or no-go at the first start, and the first start that may be one."""
    later = f"; first possible start {answer['first_start']}" if answer["first_start"] and not answer["go"] else ""
    return f"{'GO' if answer['go'] else 'NO-GO'}{subject}{later}"


def planned(answer: dict[str, Any]) -> Answer:
    """A forecast by a plan, under each alternative."""
    rows = []
    for one in answer["alternatives"]:
        start, many = one["starts"][0], f"{one['n_go']} of {one['n_starts']}"
        verdict, first_start = VERDICTS[start["go"]], one["first_start"] or "-"
        rows.append([one["alternative"], verdict, first_start, many, start["governs"], *_used(start)])
    first = answer["alternatives"][0]["starts"][0]["time"]
    heads = ("winch", f"start {first}", "first start", "starts that go", "governed by", "most", "allowed")
    within, credit = f"{answer['horizon'] / 3600.0:g} h, T_R {answer['T_R'] / 3600.0:g} h", CREDITS[answer["credit"]]
    lines: list[Line] = [
        answer["reason"] or "",
        *columns(
            ["winch", "first start", "first possible", "starts that are go"], [row[:4] for row in rows], (0, 1, 2)
        ),
        partial(print_table, heads, rows, left=3, texts=(4,), title=f"Starts within {within}, OP_WF {credit}"),
    ]
    title = _go(answer, f" with {answer['alternative']}: {answer['plan']}, {answer['file']}, OP_WF {credit}")
    return Answer(title, lines, more="what governs each", notes=answer["notes"], shown=0)


def lift(answer: dict[str, Any]) -> Answer:
    """Windows and waiting of every alternative."""
    of = answer["alternatives"]
    rows = [
        [one["alternative"], *(percent(one[n]) for n in ("operability", "start_share")), *(days(one[n]) for n in WAITS)]
        for one in of
    ]
    counts = [[str(one[n]) for n in ("n_windows_long_enough", "n_censored")] for one in of]
    heads = ["winch", "operability", "can start", "mean wait", "P50", "P90"]
    full = [[*row, *count] for row, count in zip(rows, counts, strict=True)]
    lines: list[Line] = [
        *columns(heads, rows),
        partial(print_table, [*heads, "windows\nlong enough", "no later\nwindow"], full),
        f"{answer['n_valid']} of {answer['n_records']} records, {answer['start']} to {answer['end']}.",
        partial(wrapped, answer["table"]),
    ]
    title = f"{answer['plan']}: windows of {answer['window'] / 3600.0:g} h in {answer['waves']},"
    title += f" T_R {answer['T_R'] / 3600.0:g} h"
    return Answer(title, lines, more="number of windows, forecast factors", notes=answer["notes"], shown=0)


def alpha(answer: dict[str, Any]) -> Answer:
    """Factor, forecast limit and reference period."""
    times = ", ".join(f"{k} {answer[k] / 3600.0:g} h" for k in ("T_POP", "T_C", "T_R") if answer[k] is not None)
    lead = f" (of which lead time {answer['lead'] / 3600.0:g} h)" if answer["lead"] else ""
    left_out = ("table", "lead", "reason", "short_contingency", "T_POP", "T_C", "T_R")
    shown = {
        k: "-" if v is None else {True: "yes", False: "no"}[v] if isinstance(v, bool) else v
        for k, v in answer.items()
        if k not in left_out
    }
    lines: list[Line] = [
        _factor(answer) if answer["alpha"] is not None else "No forecast factor applies.",
        partial(print_values, shown),
        f"{times}{lead}.",
        answer["reason"] or "",
        answer["short_contingency"],
        partial(wrapped, answer["table"]),
    ]
    return Answer("Forecast limit of the operation", lines, more="meanings, source of the table")


def _factor(of: dict[str, Any]) -> str:
    return f"OP_LIM Hs {of['hs']:.4g} m x alpha {of['alpha']:.3g} = OP_WF Hs {of['op_wf']:.3g} m."


def forecast(answer: dict[str, Any]) -> Answer:
    """Go or no-go, and for which starts."""
    spans = _stretches(answer["starts"])
    rows = [[a["time"], b["time"], VERDICTS[a["go"]], a["governs"], *_used(a)] for a, b in spans]
    heads = ["from", "to", "start", "governing", "largest", "allowed"]
    title = "Starts, one a record; governing limit of the first of each"
    lines: list[Line] = [
        answer["reason"] or "",
        *(f"{_factor(one)[:-1]}; T_R {one['T_R'] / 3600.0:g} h." for one in answer["factors"]),
        *columns(heads, rows[:3], left=(0, 1, 2, 3)),
        partial(print_table, heads, rows, left=4, title=title),
        partial(wrapped, answer["factors"][0]["table"]),
    ]
    more = f"all {len(spans)} periods of starts, source of alpha"
    subject = _go(answer, f": {answer['file']}, {', '.join(answer['limits'])}")
    return Answer(subject, lines, more=more, notes=answer["notes"], shown=0)


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


def persistence(answer: dict[str, Any]) -> Answer:
    """Windows and waits, and month by month."""
    from stillhook.weather.persistence import MONTHS

    months = [m for m in answer["months"] if m["operability"] == m["operability"]]
    ends = ", ".join(f"{MONTHS[m['month'] - 1]} {percent(m['operability'])}" for m in _ends(months, "operability"))
    waits = ", ".join(f"{head} {days(answer[name])}" for head, name in zip(("mean", "P50", "P90"), WAITS, strict=True))
    heads = ["", "hours", "operable\n%", "can start\n%", "windows", "mean\nh", "longest\nh", "long\nenough"]
    heads += ("wait\nmean h", "wait\nP50 h", "wait\nP90 h", "no later\nwindow")
    rows = [_row(MONTHS[m["month"] - 1], m) for m in answer["months"]] + [_row("all", answer)]
    title = f"Windows of {answer['window'] / 3600.0:g} h: waits from every record, by the month in which they begin"
    lost = f"{answer['n_missing']} of {answer['n_records']} records without a value that a limit needs"
    share = number(100.0 * answer["n_censored"] / answer["n_records"], 3)
    end = "of all records have no later window before the series ends: left out of the waits."
    lines: list[Line] = [
        f"Operability {percent(answer['operability'])} of the time; month by month {ends}.",
        f"A window of {answer['window'] / 3600.0:g} h can start in {percent(answer['start_share'])} of the records.",
        f"Waiting for it: {waits}.",
        f"{answer['n_windows_long_enough']} windows are long enough; the longest lasts {days(answer['window_max'])}.",
        f"{answer['n_censored']} ({share} %) {end}" if answer["n_censored"] else "",
        partial(print_table, heads, rows, title=title),
        partial(wrapped, f"Gaps in time: {answer['n_gaps']}; {lost}. Both break windows."),
        partial(wrapped, f"A record every {answer['step'] / 3600.0:g} h."),
        *(partial(wrapped, text) for text in _by_heading(answer.get("by_heading"))),
    ]
    subject = f"{answer['file']}, {answer['start'][:10]} to {answer['end'][:10]}: {', '.join(answer['limits'])}"
    return Answer(subject, lines, more="every month, gaps", notes=answer["notes"], shown=2)


def _ends(of: list[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    """The least and the largest by a number."""
    return [choose(of, key=lambda one: one[name]) for choose in (min, max)]


def _by_heading(headings: list[dict[str, Any]] | None) -> list[str]:
    if not headings:
        return []
    worst, best = (
        f"{100.0 * h['operability']:.1f} % at {display_number('ship', h['ship'], 4)} deg"
        for h in _ends(headings, "operability")
    )
    return [
        "The ship keeps one heading through each window of that length; operable: records within one. Held on one"
        f" heading throughout, share of records inside all limits: {best} at best, {worst} at worst."
    ]


def _row(label: str, numbers: dict[str, Any]) -> list[str]:
    times = [_h(numbers[name]) for name in ("window_mean", "window_max", *WAITS)]
    shares = ["-" if (x := numbers[name]) != x else f"{100.0 * x:.1f}" for name in ("operability", "start_share")]
    counts = [str(numbers[name]) for name in ("n_windows", "n_windows_long_enough", "n_censored")]
    return [label, f"{numbers['n_hours']:g}", *shares, counts[0], *times[:2], counts[1], *times[2:], counts[2]]


def _h(time: float) -> str:
    """A time in hours."""
    return "-" if time != time else f"{time / 3600.0:.1f}"


def show(answer: dict[str, Any]) -> Answer:
    """What a file holds."""

    def row(name: str, c: dict[str, Any], digits: int, shown: tuple[str, ...]) -> list[str]:
        numbers = ("-" if c[k] is None else display_number(name, c[k], digits) for k in shown)
        return [name, display_unit(name), *numbers, str(c["n_missing"])]

    heads, of = ("column", "unit", "mean", "P90", "largest", "missing"), answer["columns"].items()
    short = [row(name, c, 3, ("mean", "p90", "max")) for name, c in of]
    full = [row(name, c, 4, ("mean", "p90", "max", "min")) for name, c in of]
    lines: list[Line] = [
        *columns(heads, short, left=(0, 1)),
        partial(print_table, (*heads[:-1], "least", "missing"), full, left=2),
        f"{answer['n_gaps']} gaps in time, {answer['absent'] / 3600.0:g} h in all.",
    ]
    records = f"{answer['n_records']} records, one every {answer['step'] / 3600.0:g} h"
    title = f"{answer['file']}: {answer['start']} to {answer['end']}, {records}"
    step = f'stillhook weather persistence {answer["file"]} --limit "Hs <= 2 m" --window "24 h"'
    return Answer(title, lines, step, "least values", answer["notes"])
