"""`stillhook weather persistence|alpha|forecast|lift|show`: when the weather lets work be done, and what a forecast
must promise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.base.choice import nearest
from stillhook.base.gateway.guard import guarded
from stillhook.cli.parser import FACTORS_HELP, Columns, Json, MappingFile, Out, Spread, check_out, present, refuse
from stillhook.cli.sea.response import waves_of_file
from stillhook.cli.weather import answers
from stillhook.errors import PlanError, WeatherError
from stillhook.report.terminal import progress_bar
from stillhook.units import parse, quote

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from stillhook.plan.definition.rules import Alternative
    from stillhook.weather.limit_text import Limit
    from stillhook.weather.series import Weather

    When = tuple[np.datetime64 | None, float, np.datetime64 | None]
    """First start, the time within which starts are examined [s], and the issue of the forecast."""
    Heading = tuple[float | None, bool]

PICTURE, NUMBERS = "weather.png", "weather.json"
FILE_HELP = (
    "Table of weather (CSV and its kin, gz too), a file of NDBC, a name of the library, or a description (TOML): file,"
    " and what that leaves open (sense of directions, columns, time, date_order, time_zone, step)."
)
LIMIT_HELP = (
    'Limit, inclusive; as often as needed, all must hold: "Hs <= 1.5 m", "wind <= 10 m/s", "Tp 5..12 s", '
    '"Hs <= 3 m for beta 150..210 deg".'
)
SHIP_HELP = (
    'Where the bow points, clockwise from north, "315 deg", or "free" to keep the best heading in each window; for'
    " limits on beta."
)
PLAN_HELP = (
    "Folder of a saved lift plan (stillhook plan --out): its OP_WF by period and direction is the limit, its T_R the"
    " time."
)
WINDOW_HELP = "How long the operation needs the weather without a break."
JSON_HELP = (
    'Print JSON in SI (times in s; in hours under "hours"). n_hours: records x step. operability: workable share of'
    " valid records. Windows: longest unbroken runs, a record counts one step, gaps and missing values break them."
    " Waits: from every record, by the clock, to the first from which a window of the requested length is left; 0 where"
    " one"
    " starts; percentiles linear; starts without one are n_censored and left out."
)

File = Annotated[str, typer.Argument(help=FILE_HELP, metavar="FILE")]
Limits = Annotated[list[str], typer.Option("--limit", help=LIMIT_HELP)]
Ship = Annotated[str | None, typer.Option("--ship", help=SHIP_HELP)]


def persistence(
    file: File,
    limit: Limits,
    window: Annotated[str, typer.Option(help=WINDOW_HELP)],
    ship: Ship = None,
    mapping: MappingFile = None,
    column: Columns = None,
    out: Out = None,
    json: Annotated[bool, typer.Option("--json", help=JSON_HELP)] = False,
) -> None:
    """Workable share, windows and waiting of a weather series, in all and by month.

    A record counts one step. Windows break at gaps in time and at records with missing values. Waits are taken from
    every record to the first at or after it from which a window of the requested length is left.

    Exit code 0 in any weather, also where no window is ever long enough.

    Example: stillhook weather persistence SYNTHETIC-norwegian-sea --limit "Hs <= 1.5 m" --limit "wind <= 10 m/s"
    --window "24 h"
    """
    from stillhook.formats.table.corrections import corrections_of
    from stillhook.formats.weather.description import weather_of_file
    from stillhook.weather.limit_text import parse_limit
    from stillhook.weather.persistence import persistence_answer

    limits = [parse_limit(text) for text in limit]
    length = parse(window, "hours", "--window")
    if length <= 0.0:
        raise WeatherError(f"--window {quote(window)}: is not above 0 h. Give the duration of the operation.")
    heading, free = _heading(ship, limits)
    check_out(out, (PICTURE, NUMBERS))
    result = weather_of_file(file, mapping, corrections_of(column or ()))
    answer = persistence_answer(result, limits, length, ship=heading, free=free)

    def pictures() -> dict[str, Any]:
        from stillhook.report.plots.sea import persistence_figure

        return {PICTURE: persistence_figure(answer)}

    brief = partial(answers.persistence, answer)
    present(answer, out, {NUMBERS: answer}, brief=brief, json=json, pictures=pictures)


def alpha(
    hs: Annotated[str, typer.Option("--hs", help="Limiting significant wave height of the operation (OP_LIM).")],
    t_pop: Annotated[str, typer.Option("--t-pop", help="Planned operation period from its start.")],
    t_c: Annotated[str | None, typer.Option("--t-c", help="Contingency time; without it T_R is twice T_POP.")] = None,
    lead: Annotated[str, typer.Option("--lead", help="Time from the issue of the forecast to the start.")] = "0 h",
    table: Annotated[str, typer.Option("--forecast-factors", help=FACTORS_HELP)] = "dnv-os-h101",
    json: Json = False,
) -> None:
    """Alpha factor, the wave height that a forecast must stay within, reference period, and whether the operation is
    weather restricted. T_POP counts from the issue of the forecast: the lead time and the planned period.

    Exit code 1 where the table has no factor: below its lowest height it is decided case by case.

    Example: stillhook weather alpha --hs "2 m" --t-pop "24 h"
    """
    from stillhook.formats.weather.alpha_table import read_alpha_table
    from stillhook.weather.alpha import alpha_of

    contingency = None if t_c is None else parse(t_c, "hours", "--t-c")
    lead_time, planned = parse(lead, "hours", "--lead"), parse(t_pop, "hours", "--t-pop")
    if lead_time < 0.0:
        raise WeatherError(f"--lead {quote(lead)}: is below 0 h. Give the time from the issue of the forecast.")
    result = alpha_of(read_alpha_table(table), parse(hs, "length", "--hs"), lead_time + planned, contingency)
    answer = result.numbers() | {"lead": lead_time}
    present(answer, brief=partial(answers.alpha, answer), json=json)
    raise typer.Exit(1 if result.case_by_case else 0)


def forecast(
    file: File,
    limit: Annotated[list[str] | None, typer.Option("--limit", help=LIMIT_HELP)] = None,
    t_pop: Annotated[str | None, typer.Option("--t-pop", help="Planned operation period from its start.")] = None,
    t_c: Annotated[str | None, typer.Option("--t-c", help="Contingency time; without it T_R is twice T_POP.")] = None,
    start: Annotated[
        str | None, typer.Option(help="First start (UTC), 2026-05-01T06:00; default: the forecast's first record.")
    ] = None,
    horizon: Annotated[str, typer.Option(help="Time within which starts are examined.")] = "72 h",
    issue: Annotated[
        str | None,
        typer.Option(help="Issue of the forecast (UTC), from which T_POP counts; default: its first record."),
    ] = None,
    table: Annotated[str | None, typer.Option("--forecast-factors", help=FACTORS_HELP)] = None,
    plan: Annotated[Path | None, typer.Option("--plan", help=PLAN_HELP)] = None,
    alternative: Annotated[
        str | None, typer.Option(help="With --plan: the one whose go counts; default: the plan's own.")
    ] = None,
    uncredited: Annotated[
        bool, typer.Option("--twin", help="With --plan: limits as simulated by the twin, not as credited.")
    ] = False,
    ship: Ship = None,
    mapping: MappingFile = None,
    column: Columns = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Go or no-go from a forecast: operation and contingency from the start must stay within the limits, wave heights
    times alpha of the time from the issue of the forecast.

    With --plan the limits are those of a saved lift plan, by period and direction, under each alternative side by side.

    Exit code 0 for go at the first start, 1 for no-go there (a later start may be reported).

    Example: stillhook weather forecast forecast.csv --limit "Hs <= 2 m" --limit "wind <= 12 m/s" --t-pop "24 h" --t-c
    "12 h"

    Example: stillhook weather forecast forecast.csv --plan plan --limit "wind <= 12 m/s"
    """
    from stillhook.formats.table.corrections import corrections_of
    from stillhook.formats.weather.description import weather_of_file
    from stillhook.formats.weather.times import read_times
    from stillhook.weather.limit_text import parse_limit

    limits = [parse_limit(text) for text in limit or ()]
    times = [
        None if text is None else read_times([text], [1], option, "dmy")[0]
        for option, text in (("--start", start), ("--issue", issue))
    ]
    when = (times[0], parse(horizon, "hours", "--horizon"), times[1])
    if when[1] <= 0.0:
        raise WeatherError(
            f"--horizon {quote(horizon)}: is not above 0 h. Give the time within which starts are examined."
        )
    heading = _heading(ship, limits, plan is not None)
    check_out(out, (PICTURE, NUMBERS))

    read = partial(weather_of_file, file, mapping, corrections_of(column or ()))
    if plan is not None:
        refuse(
            {"--t-pop": t_pop, "--t-c": t_c, "--forecast-factors": table, "--out": out},
            "does not apply with --plan. Leave it out.",
        )
        raise typer.Exit(by_plan(plan, read, limits, when, heading, alternative, twin=uncredited, json=json))
    refuse({"--alternative": alternative, "--twin": uncredited or None}, "belongs to --plan. Give it as well.")
    answer, figure = by_limits(read, limits, t_pop, t_c, table or "dnv-os-h101", when, heading)
    pictures = lambda: {PICTURE: figure()}
    brief = partial(answers.forecast, answer)
    present(answer, out, {NUMBERS: answer}, brief=brief, json=json, pictures=pictures)
    raise typer.Exit(0 if answer["go"] else 1)


def lift(
    plan: Annotated[str, typer.Argument(metavar="PLAN.toml", help="Plan file, or one of the library's.")],
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="Measured waves, record by record: NDBC spectra or standard meteorology."),
    ],
    heading: Annotated[
        str | None, typer.Option(help="Direction of travel from the bow in every record: 180 deg is a head sea.")
    ] = None,
    ship: Annotated[
        str | None, typer.Option("--ship", help='Where the bow points from north, by measured directions: "250 deg".')
    ] = None,
    spread: Spread = None,
    alternative: Annotated[
        list[str] | None, typer.Option(help="Alternative of the winch, such as ssc; default: all of the plan.")
    ] = None,
    table: Annotated[str | None, typer.Option("--forecast-factors", help=FACTORS_HELP)] = None,
    json: Json = False,
) -> None:
    """Windows and waiting of a lift plan in a hindcast with full spectra: every record by the frequency-domain method,
    under every alternative.

    The window is the plan's operation and contingency, the forecast factor is in the limits. What the method does not
    cover (the splash zone) is judged by the plan's table in closed form. A year of hourly spectra takes about 20 s.
    Exit code 0 in any weather.

    Example: stillhook weather lift template-to-1500m 46042w1996.txt.gz --heading "180 deg"
    """
    from stillhook.formats.weather.alpha_table import read_alpha_table
    from stillhook.plan.file import load_plan
    from stillhook.plan.weather.spectral import spectral_persistence
    from stillhook.weather.alpha import DEFAULT

    lift_plan = load_plan(plan)
    factors = read_alpha_table(table or lift_plan.forecast_factors or DEFAULT)
    wanted = chosen_alternatives(alternative or (), lift_plan.alternatives)
    waves = waves_of_file(file, heading, spread, ship)
    with progress_bar(f"{lift_plan.crane.name}: judging {file.name}") as bar:
        answer = spectral_persistence(lift_plan, waves, factors, wanted, bar)
    present(answer, brief=partial(answers.lift, answer), json=json)


def show(
    file: File,
    mapping: MappingFile = None,
    column: Columns = None,
    json: Json = False,
) -> None:
    """What a weather file holds, and what was made of it: times, gaps, columns, units, directions, missing values.

    Example: stillhook weather show SYNTHETIC-norwegian-sea
    """
    from stillhook.formats.table.corrections import corrections_of
    from stillhook.formats.weather.description import weather_of_file
    from stillhook.weather.persistence import show_answer

    answer = show_answer(weather_of_file(file, mapping, corrections_of(column or ())))
    present(answer, brief=partial(answers.show, answer), json=json)


def _heading(ship: str | None, limits: Sequence[Limit], planned: bool = False) -> tuple[float | None, bool]:
    """Heading of the ship [rad], and whether it is free; planned: a plan needs it as well as limits on beta."""
    from stillhook.sea.spectra.directions import parse_direction
    from stillhook.weather.limit_text import BETA

    if ship is not None and not planned and not any(BETA in limit.columns for limit in limits):
        raise WeatherError(
            '--ship: no limit depends on beta. Leave it out, or write a limit such as "Hs <= 3 m for beta 150..210'
            ' deg".'
        )
    if ship is None or ship.strip().lower() == "free":
        return None, ship is not None
    return parse_direction(ship, "--ship"), False


def by_limits(
    read: Callable[[], Weather],
    limits: Sequence[Limit],
    t_pop: str | None,
    t_c: str | None,
    table: str,
    when: When,
    heading: Heading,
) -> tuple[dict[str, Any], Callable[[], Figure]]:
    """The answer for limits as text, and what draws its picture."""
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
        weather,
        limits,
        factors,
        T_POP,
        T_C,
        start=when[0],
        horizon=when[1],
        ship=heading[0],
        free=heading[1],
        issue=when[2],
    )
    answer: dict[str, Any] = {"file": weather.source, "limits": [one.text for one in limits], "horizon": when[1]}
    answer |= numbers(checked) | {"notes": [*checked.notes, *weather.notes]}
    return answer, partial(forecast_figure, weather, list(limits), answer)


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
    with guarded(str(folder), PlanError, "Run the plan again."):
        chosen = str(result.facts["shown"]) if alternative is None else alternative
        chosen_alternatives([chosen], result.alternatives)
        answer = plan_forecast(
            result,
            read(),
            limits=limits,
            credit="twin" if twin else None,
            start=when[0],
            horizon=when[1],
            ship=heading[0],
            issue=when[2],
        )
        leading = next(a for a in answer["alternatives"] if a["alternative"] == chosen)
        answer = {name: leading[name] for name in ("go", "first_start", "reason")} | {"alternative": chosen} | answer
    present(answer, brief=partial(answers.planned, answer), json=json)
    return 0 if leading["go"] else 1


def chosen_alternatives(names: Sequence[str], of: Sequence[Alternative]) -> tuple[Alternative, ...]:
    """Those of a plan's alternatives that were named; all without any. Errors: WeatherError."""
    for name in names:
        if name not in of:
            raise WeatherError(
                f"--alternative {quote(name)}: is not one of the plan's {', '.join(of)}{nearest(name, of)}"
            )
    return tuple(a for a in of if a in names) if names else tuple(of)
