"""`stillhook weather persistence|alpha|forecast|show`: when the weather lets work be done, and what a forecast must promise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.cranes import Json
from stillhook.cli.running_text import wrapped
from stillhook.cli.show import print_json, print_table, print_values

if TYPE_CHECKING:
    from stillhook.sea.weather import Weather

app = typer.Typer(no_args_is_help=True, help="Weather: workable windows and waiting, alpha factors, go or no-go from a forecast.")

FILE_HELP = "Table of weather (CSV and its kin, gz too), a file of NDBC, or a name of the library; a wrong name lists them."
LIMIT_HELP = (
    'Limit, inclusive; as often as needed, all must hold: "Hs <= 1.5 m", "wind <= 10 m/s", "Tp 5..12 s", '
    '"Hs <= 3 m for beta 150..210 deg".'
)
DIRECTION_HELP = (
    "What the file's wave directions mean, where it does not say: coming-from or going-to (clockwise from north), cartesian (going to, "
    "counter-clockwise from east), cartesian-from."
)
COLUMN_HELP = 'Which heading is what: "Hs=waveheight", "wind=ws [kn]"; for Hs, Tp, Tz, wind, come_from, wind_from, current.'
ORDER_HELP = "mdy, dmy or ymd, where the file's dates leave it open."
SHIP_HELP = 'Where the bow points, clockwise from north, "315 deg", or "free" to turn to what suits best; for limits on beta.'
WINDOW_HELP = "How long the operation needs the weather without a break."
JSON_HELP = (
    'Print JSON in SI (times in s; in hours under "hours"). n_hours: records x step. operability: workable share of valid records. '
    "Windows: longest unbroken runs, a record counts one step, gaps and missing values break them. Waits: from every record, by the "
    "clock, to the first from which a window of the asked length is left; 0 where one starts; percentiles linear; starts without one "
    "are n_censored and left out."
)

Direction = Annotated[str | None, typer.Option("--direction", help=DIRECTION_HELP)]
Columns = Annotated[list[str] | None, typer.Option("--column", help=COLUMN_HELP)]
TimeColumn = Annotated[str | None, typer.Option("--time", help="Heading of the times, where it is not recognised.")]
Order = Annotated[str | None, typer.Option("--date-order", help=ORDER_HELP)]
Step = Annotated[str | None, typer.Option("--step", help="What a record stands for, where that is not the usual spacing.")]
Limits = Annotated[list[str], typer.Option("--limit", help=LIMIT_HELP)]
Ship = Annotated[str | None, typer.Option("--ship", help=SHIP_HELP)]


@app.command("persistence")
def persistence(
    file: Annotated[str, typer.Argument(help=FILE_HELP, metavar="FILE")],
    limit: Limits,
    window: Annotated[str, typer.Option(help=WINDOW_HELP)],
    ship: Ship = None,
    direction: Direction = None,
    column: Columns = None,
    time: TimeColumn = None,
    date_order: Order = None,
    step: Step = None,
    json: Annotated[bool, typer.Option("--json", help=JSON_HELP)] = False,
) -> None:
    """Workable share, windows and waiting of a weather series, in all and by month.

    A record counts one step. Windows break at gaps in time and at records with missing values. Waits are taken from every record to the
    first at or after it from which a window of the asked length is left.

    Example: stillhook weather persistence hindcast.csv --limit "Hs <= 1.5 m" --limit "wind <= 10 m/s" --window "24 h"
    """
    from stillhook.units import parse
    from stillhook.weather.answer import persistence_answer
    from stillhook.weather.limit_text import parse_limit

    limits = [parse_limit(text) for text in limit]
    length = parse(window, "time", "--window")
    heading, free = _heading(ship)
    found = _read(file, direction, column, time, date_order, step)
    answer = persistence_answer(found, limits, length, ship=heading, free=free)
    if json:
        print_json(answer)
        return
    _print_persistence(answer)


@app.command("alpha")
def alpha(
    hs: Annotated[str, typer.Option("--hs", help="Limiting significant wave height of the operation (OP_LIM).")],
    t_pop: Annotated[str, typer.Option("--t-pop", help="Planned operation period.")],
    t_c: Annotated[str | None, typer.Option("--t-c", help="Contingency time; without it T_R is twice T_POP.")] = None,
    table: Annotated[str, typer.Option("--table", help="Table of alpha factors: a name, or a TOML file of your own.")] = "dnv-os-h101",
    json: Json = False,
) -> None:
    """Alpha factor, the wave height that a forecast must stay within, reference period, and whether the operation is weather restricted.

    Exit code 1 where the limiting height is below the table, which leaves it to be decided case by case.

    Example: stillhook weather alpha --hs "2 m" --t-pop "24 h"
    """
    from stillhook.units import parse
    from stillhook.weather.alpha import alpha_of, load_alpha_table

    contingency = None if t_c is None else parse(t_c, "time", "--t-c")
    found = alpha_of(load_alpha_table(table), parse(hs, "length", "--hs"), parse(t_pop, "time", "--t-pop"), contingency)
    if json:
        print_json(found.numbers())
    else:
        _print_alpha(found.numbers())
    raise typer.Exit(1 if found.case_by_case else 0)


def _print_alpha(answer: dict[str, Any]) -> None:
    shown = {k: "-" if v is None else {True: "yes", False: "no"}[v] if isinstance(v, bool) else v for k, v in answer.items()}
    times = {k: f"{answer[k] / 3600.0:g} h" for k in ("T_POP", "T_C", "T_R")}
    print_values({k: v for k, v in shown.items() if k not in ("why", "table", *times)})
    wrapped(", ".join(f"{k} {v}" for k, v in times.items()))
    if answer["why"]:
        wrapped(answer["why"])
    wrapped(answer["table"])


def _heading(ship: str | None) -> tuple[float | None, bool]:
    """Heading of the ship [rad], and whether it is free."""
    from stillhook.cli.tip_inputs import angle

    if ship is None or ship.strip().lower() == "free":
        return None, ship is not None
    return angle(ship, "--ship"), False


def _read(
    file: str, direction: str | None, column: list[str] | None, time: str | None, date_order: str | None, step: str | None
) -> Weather:
    """The weather that was named, with what was said about it."""
    from stillhook.errors import WeatherError
    from stillhook.io.weather_file import SENSES, read_weather
    from stillhook.library.files import nearest
    from stillhook.units import came, parse
    from stillhook.weather.limit_text import SPELT

    if direction is not None and direction not in SENSES:
        raise WeatherError(f"--direction {came(direction)}: is not one of {', '.join(SENSES)}{nearest(direction, SENSES)}")
    named = {}
    for text in column or ():
        name, sign, heading = text.partition("=")
        key = SPELT.get(name.strip().lower())
        if not sign or key in (None, "beta") or not heading.strip():
            raise WeatherError(f'--column {came(text)}: write a name and a heading, "Hs=waveheight"; names: {", ".join(NAMED)}.')
        named[str(key)] = heading.strip()
    every = None if step is None else parse(step, "time", "--step")
    if every is not None and every <= 0.0:
        raise WeatherError(f"--step {came(step)}: is not above 0 s.")
    sense = None if direction is None else SENSES[direction]
    return read_weather(file, sense=sense, columns_as=named, time_column=time, date_order=date_order, step=every)


NAMED = ("Hs", "Tp", "Tz", "wind", "come_from", "wind_from", "current")


def _print_persistence(answer: dict[str, Any]) -> None:
    from stillhook.weather.answer import MONTHS

    every = f"a record every {answer['step'] / 3600.0:g} h"
    wrapped(f"{answer['file']}: {answer['start']} to {answer['end']}, {every}; {', '.join(answer['limits'])}")
    heads = ("", "hours", "operable\n%", "can start\n%", "windows", "mean\nh", "longest\nh", "long\nenough")
    rows = [_row(MONTHS[m["month"] - 1], m) for m in answer["months"]] + [_row("all", answer)]
    title = f"Windows of {answer['window'] / 3600.0:g} h: waits from every record, by the month in which they begin"
    waits = ("wait\nmean h", "wait\nP50 h", "wait\nP90 h", "no later\nwindow")
    print_table((*heads, *waits), rows, title=title)
    missing = f"{answer['n_missing']} records miss a value that a limit asks for" if answer["n_missing"] else "no value missing"
    wrapped(f"{answer['n_gaps']} gaps in time, {missing}; both break windows.")
    if answer["n_censored"]:
        share = answer["n_censored"] / answer["n_records"]
        end = "have no later window before the series ends: left out of the waits."
        wrapped(f"{answer['n_censored']} records ({100.0 * share:.2g} %) {end}")
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
