"""What the weather commands print: each answer in a dozen lines, and in full."""

from __future__ import annotations

from typing import Any

from stillhook.report.formatting import counted, days, display_number, display_unit, percent, wrapped
from stillhook.report.terminal import Answer, columns, print_table, print_values
from stillhook.units import number

CREDITS = {"twin": "as simulated", "credited": "as credited", "claimable": "as may be claimed"}
VERDICTS = {True: "go", False: "no-go", None: "not covered"}


def _go(answer: dict[str, Any]) -> list[str]:
    """Go or no-go, the first start that may be one, and the reason."""
    first = answer["first_start"]
    verdict = "GO at the first start" if answer["go"] else "NO-GO at the first start"
    later = f"; first possible start {first}" if first and not answer["go"] else ""
    return [f"{verdict}{later}.", answer["reason"] or ""]


def brief_planned(answer: dict[str, Any]) -> Answer:
    rows = [
        [
            one["alternative"],
            VERDICTS[one["starts"][0]["go"]],
            one["first_start"] or "-",
            f"{one['n_go']} of {one['n_starts']}",
        ]
        for one in answer["alternatives"]
    ]
    table = columns(["winch", "first start", "first possible", "starts that are go"], rows, left=(0, 1, 2))
    title = f"{answer['plan']}, {answer['file']}: start with {answer['alternative']}, OP_WF {CREDITS[answer['credit']]}"
    return Answer(title, [*_go(answer), *table], more=f"what governs each, {counted(len(answer['notes']), 'note')}")


def brief_lift(answer: dict[str, Any]) -> Answer:
    rows = [
        [one["alternative"], *(percent(one[n]) for n in ("operability", "start_share")), *(days(one[n]) for n in WAITS)]
        for one in answer["alternatives"]
    ]
    heads = ["winch", "operability", "can start", "mean wait", "P50", "P90"]
    title = f"{answer['plan']}: windows of {answer['window'] / 3600.0:g} h in {answer['waves']}"
    records = f"{answer['n_valid']} of {answer['n_records']} records, {answer['start']} to {answer['end']}."
    more = f"number of windows, forecast factors, {counted(len(answer['notes']), 'note')}"
    return Answer(title, [*columns(heads, rows), records], more=more)


def brief_alpha(answer: dict[str, Any]) -> Answer:
    times = ", ".join(f"{k} {answer[k] / 3600.0:g} h" for k in ("T_POP", "T_C", "T_R") if answer[k] is not None)
    numbers = "No forecast factor applies."
    if answer["alpha"] is not None:
        numbers = f"OP_LIM Hs {answer['hs']:.4g} m x alpha {answer['alpha']:.3g} = OP_WF Hs {answer['op_wf']:.3g} m."
    lead = f" (of which lead time {answer['lead'] / 3600.0:g} h)" if answer["lead"] else ""
    lines = [numbers, f"{times}{lead}.", answer["reason"] or "", answer["short_contingency"]]
    return Answer("Forecast limit of the operation", lines, more="meanings, source of the table")


def brief_forecast(answer: dict[str, Any]) -> Answer:
    limits = [
        f"OP_LIM Hs {one['hs']:.4g} m x alpha {one['alpha']:.3g} = OP_WF Hs {one['op_wf']:.3g} m;"
        f" T_R {one['T_R'] / 3600.0:g} h."
        for one in answer["factors"]
    ]
    spans = list(_stretches(answer["starts"]))
    rows = [[a["time"], b["time"], VERDICTS[a["go"]], a["governs"], *_used(a)] for a, b in spans[:3]]
    table = columns(["from", "to", "start", "governing", "largest", "allowed"], rows, left=(0, 1, 2, 3))
    title = f"{answer['file']}: {', '.join(answer['limits'])}"
    more = f"all {len(spans)} periods of starts, source of alpha, {counted(len(answer['notes']), 'note')}"
    return Answer(title, [*_go(answer), *limits, *table], more=more)


def brief_persistence(answer: dict[str, Any]) -> Answer:
    from stillhook.weather.persistence import MONTHS

    months = [m for m in answer["months"] if m["operability"] == m["operability"]]
    worst, best = (choose(months, key=lambda m: m["operability"]) for choose in (min, max))
    ends = ", ".join(f"{MONTHS[m['month'] - 1]} {percent(m['operability'])}" for m in (worst, best))
    waits = ", ".join(f"{head} {days(answer[name])}" for head, name in zip(("mean", "P50", "P90"), WAITS, strict=True))
    lines = [
        f"Operability {percent(answer['operability'])} of the time; month by month {ends}.",
        f"A window of {answer['window'] / 3600.0:g} h can start in {percent(answer['start_share'])} of the records.",
        f"Waiting for it: {waits}.",
        f"{answer['n_windows_long_enough']} windows are long enough; the longest lasts {days(answer['window_max'])}.",
        f"{answer['n_censored']} records have no later window: left out of the waiting."
        if answer["n_censored"]
        else "",
        *answer["notes"][:2],
    ]
    span = f"{answer['start'][:10]} to {answer['end'][:10]}"
    more = f"every month, gaps, {counted(len(answer['notes']), 'note')}"
    return Answer(f"{answer['file']}, {span}: {', '.join(answer['limits'])}", lines, more=more)


def brief_show(answer: dict[str, Any]) -> Answer:
    shown = ("mean", "p90", "max")
    rows = [
        [
            name,
            display_unit(name),
            *("-" if c[k] is None else display_number(name, c[k], 3) for k in shown),
            str(c["n_missing"]),
        ]
        for name, c in answer["columns"].items()
    ]
    records = f"{answer['n_records']} records, one every {answer['step'] / 3600.0:g} h"
    title = f"{answer['file']}: {answer['start']} to {answer['end']}, {records}"
    lines = [*columns(["column", "unit", "mean", "P90", "largest", "missing"], rows, left=(0, 1))]
    lines.append(f"{answer['n_gaps']} gaps in time, {answer['absent'] / 3600.0:g} h in all.")
    step = f'stillhook weather persistence {answer["file"]} --limit "Hs <= 2 m" --window "24 h"'
    return Answer(title, [*lines, *answer["notes"][:1]], step, f"least values, {counted(len(answer['notes']), 'note')}")


WAITS = ("wait_mean", "wait_p50", "wait_p90")


def _print_go(answer: dict[str, Any], subject: str) -> None:
    """Go or no-go, the first start that may be one, and the reason."""
    later = f"; first possible start {answer['first_start']}" if answer["first_start"] and not answer["go"] else ""
    wrapped(f"{'GO' if answer['go'] else 'NO-GO'}{subject}{later}")
    if answer["reason"]:
        wrapped(answer["reason"])


def print_planned(answer: dict[str, Any]) -> None:
    _print_go(answer, f" with {answer['alternative']}: {answer['plan']}, {answer['file']}")
    first = answer["alternatives"][0]["starts"][0]["time"]
    rows = []
    for one in answer["alternatives"]:
        start = one["starts"][0]
        many = f"{one['n_go']} of {one['n_starts']}"
        verdict, first_start = VERDICTS[start["go"]], one["first_start"] or "-"
        rows.append([one["alternative"], verdict, first_start, many, start["governs"], *_used(start)])
    heads = ("winch", f"start {first}", "first start", "starts that go", "governed by", "most", "allowed")
    within, credit = f"{answer['horizon'] / 3600.0:g} h, T_R {answer['T_R'] / 3600.0:g} h", CREDITS[answer["credit"]]
    title = f"Starts within {within}, OP_WF {credit}"
    print_table(heads, rows, left=3, texts=(4,), title=title)
    for note in answer["notes"]:
        wrapped(note)


def print_lift(answer: dict[str, Any]) -> None:
    """Windows and waiting of every alternative."""
    every = f"{answer['n_records']} records, {answer['n_valid']} of them valid"
    wrapped(f"{answer['plan']}: {answer['waves']}, {answer['start']} to {answer['end']}, {every}")
    rows = [
        [
            one["alternative"],
            *(f"{100.0 * one[name]:.1f}" for name in ("operability", "start_share")),
            str(one["n_windows_long_enough"]),
            *(
                "never" if one[name] != one[name] else f"{one[name] / 86400.0:.1f}"
                for name in ("wait_mean", "wait_p50", "wait_p90")
            ),
            str(one["n_censored"]),
        ]
        for one in answer["alternatives"]
    ]
    waits = ("wait\nmean d", "wait\nP50 d", "wait\nP90 d", "no later\nwindow")
    heads = ("winch", "workable\n%", "can start\n%", "windows\nlong enough", *waits)
    print_table(heads, rows, title=f"Windows of {answer['window'] / 3600.0:g} h, T_R {answer['T_R'] / 3600.0:g} h")
    wrapped(answer["table"])
    for note in answer["notes"]:
        wrapped(note)


def print_alpha(answer: dict[str, Any]) -> None:
    """Factor, forecast limit and reference period."""
    shown = {
        k: "-" if v is None else {True: "yes", False: "no"}[v] if isinstance(v, bool) else v for k, v in answer.items()
    }
    times = {k: f"{answer[k] / 3600.0:g} h" for k in ("T_POP", "T_C", "T_R")}
    lines = ("reason", "short_contingency")
    print_values({k: v for k, v in shown.items() if k not in ("table", "lead", *lines, *times)})
    lead = f", of T_POP lead time {answer['lead'] / 3600.0:g} h" if answer["lead"] else ""
    wrapped(", ".join(f"{k} {v}" for k, v in times.items()) + lead)
    for line in filter(None, map(answer.get, lines)):
        wrapped(line)
    wrapped(answer["table"])


def print_forecast(answer: dict[str, Any]) -> None:
    """Go or no-go, and for which starts."""
    _print_go(answer, f": {answer['file']}, {', '.join(answer['limits'])}")
    for one in answer["factors"]:
        wrapped(
            f"Hs: OP_LIM {one['hs']:.4g} m x alpha {one['alpha']:.3g} = OP_WF {one['op_wf']:.3g} m; T_R"
            f" {one['T_R'] / 3600.0:g} h"
        )
    rows = [[a["time"], b["time"], VERDICTS[a["go"]], a["governs"], *_used(a)] for a, b in _stretches(answer["starts"])]
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
    lost = f"{answer['n_missing']} of {answer['n_records']} records without a value that a limit needs"
    wrapped(f"Gaps in time: {answer['n_gaps']}; {lost}. Both break windows.")
    if headings := answer.get("by_heading"):
        best, worst = (choose(headings, key=lambda h: h["operability"]) for choose in (max, min))
        best, worst = (
            f"{100.0 * h['operability']:.1f} % at {display_number('ship', h['ship'], 4)} deg" for h in (best, worst)
        )
        wrapped(
            "The ship keeps one heading through each window of that length; operable: records within one. Held on one"
            f" heading throughout, share of records inside all limits: {best} at best, {worst} at worst."
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
