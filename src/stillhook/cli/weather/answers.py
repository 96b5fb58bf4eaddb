"""Answers of weather commands: limits in words or of a saved lift plan, and their tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.base.choice import nearest
from stillhook.errors import WeatherError
from stillhook.report.formatting import display_number, display_unit, wrapped
from stillhook.report.terminal import print_json, print_table, print_values
from stillhook.units import number, parse, quote

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from stillhook.plan.definition.rules import Alternative
    from stillhook.plan.result import Credit
    from stillhook.weather.limit_text import Limit
    from stillhook.weather.series import Weather

    When = tuple[np.datetime64 | None, float]
    """First start, and over which time starts are looked for [s]."""
    Heading = tuple[float | None, bool]


VERDICTS = {True: "go", False: "no-go", None: "not covered"}


def by_limits(
    read: Callable[[], Weather],
    limits: Sequence[Limit],
    t_pop: str | None,
    t_c: str | None,
    table: str,
    when: When,
    heading: Heading,
    *,
    picture: bool,
) -> tuple[dict[str, Any], Callable[[], Figure] | None]:
    """The answer for limits in words, and what draws its picture where one is wanted."""
    from stillhook.formats.weather.alpha_table import read_alpha_table
    from stillhook.report.plots.sea import forecast_figure
    from stillhook.weather.forecast import check_forecast, numbers

    for option, value in (("--limit", limits), ("--t-pop", t_pop)):
        if not value:
            instead = 'Give --limit "Hs <= 2 m" and --t-pop "24 h", or the folder of a saved plan with --plan'
            raise WeatherError(f"{option}: missing. {instead}.")
    T_POP, T_C = parse(t_pop, "hours", "--t-pop"), None if t_c is None else parse(t_c, "hours", "--t-c")
    factors, weather = read_alpha_table(table), read()
    checked = check_forecast(
        weather, limits, factors, T_POP, T_C, start=when[0], horizon=when[1], ship=heading[0], free=heading[1]
    )
    answer: dict[str, Any] = {"file": weather.source, "limits": [one.text for one in limits], "horizon": when[1]}
    answer |= numbers(checked) | {"notes": [*checked.notes, *weather.notes]}
    return answer, partial(forecast_figure, weather, list(limits), answer) if picture else None


def by_plan(
    folder: Path,
    read: Callable[[], Weather],
    limits: Sequence[Limit],
    when: When,
    heading: Heading,
    alternative: str | None,
    *,
    twin: bool,
    json: bool,
) -> int:
    """Go or no-go of every alternative of a saved plan; the exit code is that of one of them."""
    from stillhook.plan.result import load_plan_result
    from stillhook.plan.weather.forecast import plan_forecast

    result = load_plan_result(folder)
    chosen = str(result.facts["shown"]) if alternative is None else alternative
    chosen_alternatives([chosen], result.alternatives)
    credit: Credit = "twin" if twin else "credited"
    answer = plan_forecast(
        result, read(), limits=limits, credit=credit, start=when[0], horizon=when[1], ship=heading[0]
    )
    leading = next(a for a in answer["alternatives"] if a["alternative"] == chosen)
    answer = {
        "go": leading["go"],
        "first_start": leading["first_start"],
        "reason": leading["reason"],
        "alternative": chosen,
    } | answer
    if json:
        print_json(answer)
    else:
        _print(answer)
    return 0 if leading["go"] else 1


def _print(answer: dict[str, Any]) -> None:
    later = f"; first possible start {answer['first_start']}" if answer["first_start"] and not answer["go"] else ""
    wrapped(
        f"{'GO' if answer['go'] else 'NO-GO'} with {answer['alternative']}: {answer['plan']}, {answer['file']}{later}"
    )
    if answer["reason"]:
        wrapped(answer["reason"])
    first = answer["alternatives"][0]["starts"][0]["time"]
    rows = []
    for one in answer["alternatives"]:
        start = one["starts"][0]
        many = f"{one['n_go']} of {one['n_starts']}"
        verdict, first_start = VERDICTS[start["go"]], one["first_start"] or "-"
        rows.append([one["alternative"], verdict, first_start, many, start["governs"], *_used(start)])
    heads = ("winch", f"start {first}", "first start", "starts that go", "governed by", "most", "allowed")
    credit = "as simulated by the twin" if answer["credit"] == "twin" else "as credited"
    title = f"Starts within {answer['horizon'] / 3600.0:g} h, T_R {answer['T_R'] / 3600.0:g} h, OP_WF {credit}"
    print_table(heads, rows, left=3, texts=(4,), title=title)
    for note in answer["notes"]:
        wrapped(note)


def chosen_alternatives(names: Sequence[str], of: Sequence[Alternative]) -> tuple[Alternative, ...]:
    """Those of a plan's alternatives that were named; all without any. Errors: WeatherError."""
    for name in names:
        if name not in of:
            raise WeatherError(
                f"--alternative {quote(name)}: is not one of the plan's {', '.join(of)}{nearest(name, of)}"
            )
    return tuple(a for a in of if a in names) if names else tuple(of)


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
    print_table(heads, rows, title=f"Windows of T_R {answer['T_R'] / 3600.0:g} h")
    wrapped(answer["table"])
    for note in answer["notes"]:
        wrapped(note)


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
        fixed = [
            f"{100.0 * h['operability']:.1f} % at {display_number('ship', h['ship'], 4)} deg" for h in (best, worst)
        ]
        wrapped(
            f"The ship turns to what suits each record best. Held on one heading: {fixed[0]} at best, {fixed[1]} at"
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
