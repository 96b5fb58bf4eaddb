"""What `stillhook weather forecast` is asked: limits in words, or a saved lift plan."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.base.choice import nearest
from stillhook.errors import WeatherError
from stillhook.report.formatting import wrapped
from stillhook.report.terminal import print_json, print_table
from stillhook.units import parse, quote

if TYPE_CHECKING:
    import numpy as np

    from stillhook.plan.definition.rules import Alternative
    from stillhook.plan.result import Credit
    from stillhook.weather.limit_text import Limit
    from stillhook.weather.series import Weather

    When = tuple[np.datetime64 | None, float]
    """First start, and over which time starts are looked for [s]."""
    Heading = tuple[float | None, bool]


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
) -> tuple[dict[str, Any], Any]:
    """The answer for limits in words, and its picture where one is wanted."""
    from stillhook.report.plots.sea import forecast_figure
    from stillhook.weather.alpha import load_alpha_table
    from stillhook.weather.forecast import check_forecast, numbers

    for option, value in (("--limit", limits), ("--t-pop", t_pop)):
        if not value:
            instead = 'Give --limit "Hs <= 2 m" and --t-pop "24 h", or the folder of a saved plan with --plan'
            raise WeatherError(f"{option}: missing. {instead}.")
    T_POP, T_C = parse(t_pop, "hours", "--t-pop"), None if t_c is None else parse(t_c, "hours", "--t-c")
    factors, weather = load_alpha_table(table), read()
    checked = check_forecast(
        weather, limits, factors, T_POP, T_C, start=when[0], horizon=when[1], ship=heading[0], free=heading[1]
    )
    answer: dict[str, Any] = {"file": weather.source, "limits": [one.text for one in limits], "horizon": when[1]}
    answer |= numbers(checked) | {"notes": [*checked.notes, *weather.notes]}
    return answer, forecast_figure(weather, list(limits), answer) if picture else None


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
    """Tell go or no-go of every alternative of a saved plan; the exit code is that of one of them."""
    from stillhook.plan.answer.dataset import load_plan_result
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
        worst = ["-" if start[key] is None else f"{start[key]:.3g}" for key in ("most", "allowed")]
        verdict = {True: "go", False: "no-go", None: "not covered"}[start["go"]]
        many = f"{one['n_go']} of {one['n_starts']}"
        rows.append([one["alternative"], verdict, one["first_start"] or "-", many, start["governs"], *worst])
    heads = ("winch", f"start {first}", "first start", "starts that go", "governed by", "most", "allowed")
    credit = "as the twin tells them" if answer["credit"] == "twin" else "as credited"
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
