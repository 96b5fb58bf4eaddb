"""`stillhook tip`: motion of the crane tip in a sea, from a vessel's transfer functions or from a log.

What `stillhook tip` is given: a place or a crane, waves in words or measured, and what does not go together.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import (
    Columns,
    Json,
    MappingFile,
    Out,
    Record,
    Ship,
    Spread,
    announce,
    check_out,
    present,
    refuse,
    say_left_out,
    typed_position,
)
from stillhook.errors import MotionError, SeaError
from stillhook.report.formatting import display_number, display_unit, variable, wrapped
from stillhook.report.terminal import Answer, Cells, Line, print_table, print_values
from stillhook.units import parse, quote

if TYPE_CHECKING:
    from stillhook.formats.lift.place import Place
    from stillhook.sea.motion.motion import Motion
    from stillhook.sea.spectra.spectrum import Sea
    from stillhook.sea.vessel.boom import TipPoint
    from stillhook.sea.vessel.rao import Rao, VerticalMotion
    from stillhook.sea.vessel.relative import RelativeMotion


OUT_FILES = ("tip.png", "tip.json", "tip.csv", "summary.json")
AGAINST = ("sigma_v", "v_mpm")
"""Numbers of the motion against another vessel that a table of headings has."""
ALONE = ["Each vessel is alone in the waves: shielding and gap resonance between the two are left out."]
SHOWN = ("sigma_z", "sigma_v", "sigma_a", "T_z", "T_p", "T_z_counted", "bandwidth")
LARGEST = (("z", "height"), ("v", "speed"), ("a", "acceleration"))
ALL_ROUND = "all"
EVERY = 15  # deg: headings of --heading all
WAVE_HELP = (
    'Waves: "jonswap Hs=2 m Tp=8 s gamma=3.3", pm, torsethaugen, ochi-hubble; sums with " + ", each may have a'
    " heading=150 deg; or a file of measured spectra (NDBC)."
)
HEADING_HELP = (
    'Direction in which the waves travel, counter-clockwise from the bow: "180 deg" is a head sea, "0 deg" '
    'following, "90 deg" from starboard, "270 deg" from port; or all.'
)
AT_HELP = 'Crane tip from the RAO\'s reference point: "x=-20 m, y=-18 m", forward and to port.'
AT_POSITION = '--at "x=%s, y=%s, z=%s"'
BOOM_HELP = (
    "In place of --at: heel of the boom, where it points from the bow to port, length and angle of main and knuckle"
    ' boom: "x=-10 m, y=-6 m, z=15 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg".'
)
LOG_HELP = (
    "Log of a motion sensor (CSV or $PSXN,23) in place of vessel and waves, --at then from the sensor, with z; or a"
    " case file whose scenario.tip says how a log is read."
)
VESSEL_HELP = (
    "Name of the library, or a file, as stillhook vessel reads it; or a lift file, with its crane tip and its"
    " [other_vessel], against which the tip moves as well."
)
SEEDS_HELP = "Realisations of the sea whose largest values are met and fitted (Gumbel, 95 % intervals); use 20 or more."


def tip(
    vessel: Annotated[
        str | None,
        typer.Argument(metavar="VESSEL", help=VESSEL_HELP),
    ] = None,
    at: Annotated[str | None, typer.Option(help=AT_HELP)] = None,
    boom: Annotated[str | None, typer.Option(help=BOOM_HELP)] = None,
    wave: Annotated[str | None, typer.Option(help=WAVE_HELP)] = None,
    heading: Annotated[str | None, typer.Option(help=HEADING_HELP)] = None,
    spread: Spread = None,
    record: Record = None,
    ship: Ship = None,
    log: Annotated[Path | None, typer.Option(help=LOG_HELP)] = None,
    mapping: MappingFile = None,
    column: Columns = None,
    duration: Annotated[str, typer.Option(help="Time of the extremes, and length of the series.")] = "3 h",
    seed: Annotated[int, typer.Option(help="Seed of the series, or the first of --seeds.")] = 1,
    seeds: Annotated[int | None, typer.Option(help=SEEDS_HELP)] = None,
    amplitudes: Annotated[
        str, typer.Option(help="Of the series: fixed (the variance of the spectrum in every seed) or rayleigh.")
    ] = "fixed",
    exact: Annotated[
        bool, typer.Option("--exact", help="Series with the ship's rotations in full; --at then has z.")
    ] = False,
    out: Out = None,
    json: Json = False,
) -> None:
    """Motion of the crane tip: standard deviations, periods, largest values, spectra and series.

    Example: stillhook tip FILE.re1 --at "x=-20 m, y=-18 m" --wave "jonswap Hs=1 m Tp=8 s gamma=3.3" --heading "180 deg"
    """
    length = parse(duration, "time", "--duration")
    if length <= 0.0:
        raise SeaError(
            f"--duration {duration}: is not longer than 0 s. Give the duration for which the largest values are"
            " requested."
        )
    if log is not None:
        from stillhook.formats.table.corrections import corrections

        unused: dict[str, Any] = {"VESSEL": vessel, "--wave": wave, "--heading": heading, "--spread": spread}
        unused["--record"] = record
        unused |= {"--ship": ship, "--boom": boom, "--seeds": seeds, "--exact": exact, "--out": out}
        refuse(unused, "belongs to a vessel in waves, and --log holds a motion already. Leave it out.")
        _of_log(log, at, length, corrections(mapping, column), json=json)
        return
    refuse({"--mapping": mapping, "--column": column or None}, "describes the log of --log. Give it as well.")
    from stillhook.formats.lift_file import is_lift, place_in

    known = place_in(vessel) if vessel is not None and is_lift(vessel) else None
    if vessel is None or (wave is None and (known is None or known.sea is None)):
        missing = "VESSEL" if vessel is None else "--wave"
        raise SeaError(f"{missing}: missing. Give a vessel, --at and --wave, or a log with --log. See --help.")
    if known is None or known.at is None or at is not None or boom is not None:
        point = place(at, boom)
    else:
        point = known.at
    check_out(out, OUT_FILES)
    if exact and (point.z is None or out is None):
        raise SeaError("--exact: is for the series, and needs --out and the tip's height z in --at.")
    from stillhook.formats.vessel.open import read_vessel

    rao, against = (read_vessel(vessel), None) if known is None else _of_lift(vessel, known)
    if heading is not None and heading.strip().lower() == ALL_ROUND:
        refuse(
            {"--seeds": seeds, "--out": out, "--ship": ship}, "is for one heading. Leave it out, or give one --heading."
        )
        if wave is None:
            raise SeaError("--heading all: turns the waves of --wave. Give --wave as well.")
        if "heading" in wave:
            raise SeaError(f"--heading all: the waves of {wave!r} already have a heading. Leave that out.")
        _all_round(rao, against, wave, spread, record, point, length, json=json)
        return
    series = {"seed": seed, "amplitudes": amplitudes, "exact": exact}
    if wave is not None:
        sea = sea_of(wave, heading, spread, record, ship)
    else:
        reason = f"belongs to --wave, and the waves are those of {vessel}. Leave it out, or give --wave."
        refuse({"--heading": heading, "--spread": spread, "--record": record, "--ship": ship}, reason)
        assert known is not None
        assert known.sea is not None
        sea = known.sea
    _in_sea(rao, against, sea, point, length, seeds, out, series, json=json)


def _of_lift(name: str, known: Place) -> tuple[Rao, RelativeMotion | None]:
    """The vessel of a lift file, and its motion against another."""
    if known.vessel is None:
        raise SeaError(f"{name}: names no vessel. Give vessel in the file, or name a vessel in place of the file.")
    return known.vessel, known.against


def _in_sea(
    rao: Rao,
    against: RelativeMotion | None,
    sea: Sea,
    point: TipPoint,
    duration: float,
    seeds: int | None,
    out: Path | None,
    series: dict[str, Any],
    *,
    json: bool,
) -> None:
    from stillhook.sea.vessel.tip import tip_numbers, tip_response, tip_summary

    summary = tip_summary(rao, sea, point, duration)
    if seeds is not None:
        from stillhook.sea.vessel.tip import seed_extremes

        summary["maxima"] = seed_extremes(rao, sea, point.x, point.y, duration, seeds, series["seed"])
    if against is not None:
        moved = tip_numbers(tip_response(against, sea, point.x, point.y), duration)
        summary["against"] = {"vessel": against.other.describe(), "duration": duration, **moved, "notes": ALONE}
        if seeds is not None:
            of = (against, sea, point.x, point.y, duration, seeds, series["seed"])
            summary["against"]["maxima"] = seed_extremes(*of)
    if out is not None:
        from stillhook.report.save import write_tip

        summary["series"] = write_tip(out, OUT_FILES, rao, sea, point, summary, against=against, **series)
    title = f"{rao.name}, crane tip at {point.describe()}, in {sea.describe()}"

    lines: list[Line] = _lines(summary)
    if against is not None:
        of = summary["against"]
        words = ", ".join(f"{n} {variable(n, of[n])}" for n in ("sigma_z", "sigma_v", "z_mpm", "v_mpm"))
        lines += [f"Against {of['vessel']}: {words}.", partial(_print, of), *of["notes"]]
    if out is not None:
        lines.append(partial(wrapped, f"series: {summary['series']['report']}"))
    step = "" if out is None else f"stillhook compare CRANE --motion {out / OUT_FILES[-1]}"
    answer = Answer(title, lines, step, "meanings, 90 % levels", summary["notes"], shown=2)
    present(summary, brief=lambda: answer, json=json)
    if out is not None and not json:
        from stillhook.report.kit import can_draw

        announce(out, OUT_FILES if can_draw() else OUT_FILES[1:])
        say_left_out()


def _of_log(log: Path, at: str | None, duration: float, columns: Mapping[str, Any], *, json: bool) -> None:
    from stillhook.sea.vessel.tip import motion_statistics

    motion = _logged(log, at, columns)
    report = getattr(motion, "report", "")
    notes = [report] if report else []
    summary = {"log": log.name, "duration": duration, **motion_statistics(motion, duration), "notes": notes}

    answer = Answer(motion.describe(), _lines(summary), more="meanings, 90 % levels", notes=notes)
    present(summary, brief=lambda: answer, json=json)


def _logged(log: Path, at: str | None, columns: Mapping[str, Any]) -> Motion:
    """Motion of a tip in a log, at a place from its sensor; of a case file that of its scenario."""
    from stillhook.formats.case_file import load_subject
    from stillhook.formats.motion.open import read_tip_motion, stored_motion
    from stillhook.sea.vessel.boom import parse_point

    case = log.suffix == ".toml"
    known = load_subject(str(log)).scenario.get("tip") if case else stored_motion(log)
    if known is not None:
        refuse(
            {"--at": at, "--column": columns or None}, f"{log.name} holds the motion of a tip already. Leave it out."
        )
        return known
    if case:
        raise MotionError(f"{log.name}: scenario.tip: missing. Write the log there, and how it is read.")
    point = None if at is None else parse_point(at, "--at")
    if point is not None and point.z is None:
        raise SeaError("--at: z is missing. Give the tip's height above the motion sensor as well.")
    try:
        return read_tip_motion(
            log,
            tip=None if point is None else (f"{point.x!r} m", f"{point.y!r} m", f"{point.z!r} m"),
            columns=columns,
        )
    except MotionError as e:
        raise typed_position(e, AT_POSITION) from None


def _lines(summary: dict[str, Any]) -> list[Line]:
    """Standard deviations, periods and most probable largest motion, speed and acceleration of the tip."""

    def texts(names: Iterable[str]) -> str:
        return ", ".join(f"{n} {variable(n, summary[n])}" for n in names if n in summary)

    largest = ", ".join(f"{label} {texts([f'{n}_mpm'])}" for n, label in LARGEST)
    met = ", ".join(f"{label} {texts([f'{n}_max'])}" for n, label in LARGEST if f"{n}_max" in summary)
    brief = [f"{texts(SHOWN)}.", f"Most probable largest in {summary['duration'] / 3600.0:.4g} h: {largest}."]
    brief += [f"Largest in the log: {met}."] if met else []
    return [*map(Cells, brief), partial(_print, summary)]


def _print(summary: dict[str, Any]) -> None:
    print_values({name: summary[name] for name in SHOWN if name in summary})
    columns = {"mpm": "most probable maximum", "p90": "90 % stay below", "max": "met in the log"}
    levels = [level for level in columns if f"z_{level}" in summary]
    header, rows = ["", *(columns[level] for level in levels)], []
    maxima = summary.get("maxima")
    if maxima is not None:
        header += [f"{columns[level]}\nof {maxima['seeds']} seeds (95 %)" for level in ("mpm", "p90")]
    for name, label in LARGEST:
        cells = [
            f"{display_number(key, summary[key], 4)} {display_unit(key)}"
            for key in (f"{name}_{level}" for level in levels)
        ]
        if maxima is not None:
            cells += [_interval(maxima.get(key), key) for key in (f"{name}_mpm", f"{name}_p90")]
        rows.append([label, *cells])
    print_table(header, rows, title=f"largest in {summary['duration'] / 3600.0:.4g} h")


def _interval(limits: dict[str, float] | None, key: str) -> str:
    if limits is None:
        return "-"
    value, low, high = (display_number(key, limits[part], 3) for part in ("value", "low", "high"))
    return f"{value} ({low} to {high}) {display_unit(key)}"


def _all_round(
    rao: Rao,
    against: RelativeMotion | None,
    wave: str,
    spread: float | None,
    record: str | None,
    point: TipPoint,
    duration: float,
    *,
    json: bool,
) -> None:
    import numpy as np

    from stillhook.sea.vessel.tip import tip_numbers, tip_responses

    turns = range(0, 360, EVERY)
    sea = sea_of(wave, "0 deg", spread, record, None)

    def of(moved: VerticalMotion) -> dict[int, dict[str, float]]:
        responses = tip_responses(moved, sea, point.x, point.y, np.radians(turns))
        return {degrees: tip_numbers(response, duration) for degrees, response in zip(turns, responses, strict=True)}

    numbers, relative = of(rao), None if against is None else of(against)
    rows: list[dict[str, Any]] = [{"beta": math.radians(d), **values} for d, values in numbers.items()]
    data = {"vessel": rao.name, "at": {"x": point.x, "y": point.y}, "duration": duration, "headings": rows}
    shown = ("sigma_z", "sigma_v", "sigma_a", "T_z", "z_mpm", "v_mpm", "a_mpm")
    cells = [[str(d), *(display_number(name, values[name], 4) for name in shown)] for d, values in numbers.items()]
    names = [f"{name}\n{display_unit(name)}" for name in shown]
    title = f"{rao.name}, crane tip at {point.describe()}, {wave}; largest in {duration / 3600.0:.4g} h"
    if against is not None and relative is not None:
        data["against"] = {"vessel": against.other.describe(), "notes": ALONE}
        for row, d in zip(rows, numbers, strict=True):
            row["against"] = relative[d]
        title += f". Last two columns: against {against.other.describe()}"
        names += [f"{name}\n{display_unit(name)}" for name in AGAINST]
        cells = [
            [*c, *(display_number(n, relative[d][n], 4) for n in AGAINST)] for c, d in zip(cells, numbers, strict=True)
        ]

    ends = (
        (word, choose(numbers, key=lambda d: numbers[d]["z_mpm"])) for word, choose in (("Worst", max), ("Best", min))
    )
    lines: list[Line] = [
        partial(print_table, ["heading\ndeg", *names], cells),
        *(
            f"{word} heading {d} deg: most probable largest {display_number('z_mpm', numbers[d]['z_mpm'], 4)} m,"
            f" {display_number('v_mpm', numbers[d]['v_mpm'], 4)} {display_unit('v_mpm')}."
            for word, d in ends
        ),
    ]
    if relative is not None:
        d = max(relative, key=lambda d: relative[d]["v_mpm"])
        speed = f"{display_number('v_mpm', relative[d]['v_mpm'], 4)} {display_unit('v_mpm')}"
        lines += [f"Against the other vessel: worst heading {d} deg, most probable largest {speed}.", *ALONE]
    present(data, brief=lambda: Answer(title, lines, more=f"every heading ({len(numbers)})"), json=json)


def sea_of(wave: str, heading: str | None, spread: float | None, record: str | None, ship: str | None) -> Sea:
    """The sea that a text describes, or a record of a file of measured waves."""
    from stillhook.sea.spectra.directions import parse_direction

    if Path(wave).is_file():
        return _measured(wave, None if heading is None else parse_direction(heading, "--heading"), spread, record, ship)
    from stillhook.sea.spectra.text import parse_sea

    if "=" not in wave and re.search(r"[./\\]", wave):
        raise SeaError(
            f'--wave {quote(wave)}: no such file, and not waves such as "jonswap Hs=2 m Tp=8 s". Check the path.'
        )
    refuse(
        {"--record": record, "--ship": ship},
        f"belongs to a file of measured waves, and --wave {quote(wave)} names no file. Leave it out.",
    )
    if heading is not None:
        parse_direction(heading, "--heading")  # so that the line names the option
    sea = parse_sea(wave, heading=heading, spread=spread, where="--wave")
    for name, value in (("heading", heading), ("spread", spread)):
        if wave.lower().count(name) == len(sea.trains):
            refuse({f"--{name}": value}, f"all waves of --wave {quote(wave)} already have a {name}. Leave it out.")
    return sea


def _measured(wave: str, beta: float | None, spread: float | None, record: str | None, ship: str | None) -> Sea:
    from stillhook.formats.waves.wavespectra import read_sea
    from stillhook.sea.spectra.directions import parse_direction
    from stillhook.sea.spectra.measured import SpectrumSeries
    from stillhook.sea.spectra.spectrum import Sea, Train

    series = read_sea(wave)
    if not isinstance(series, SpectrumSeries):
        raise SeaError(
            f'{series.source}: holds heights and periods, no spectra. Give them as --wave "jonswap Hs=2 m Tp=8 s".'
        )
    if record is None:
        raise SeaError(
            f"{series.source}: holds {len(series)} records. Choose one with --record, by number from 0 or by time."
        )
    i = series.index(record)
    if beta is None and series.directional is not None:
        if ship is None:
            raise SeaError(
                f"{series.source}: has directions. Give --ship, where the bow points from north, or --heading in place"
                " of them."
            )
        refuse({"--spread": spread}, f"{series.source} already has directions. Leave it out, or give --heading.")
        return series.sea(i, parse_direction(ship, "--ship"))
    refuse({"--ship": ship}, f"{series.source}: no directions are taken from it. Give --heading alone.")
    if beta is None:
        raise SeaError(f'{series.source}: has no directions. Give --heading, such as "180 deg" for a head sea.')
    return Sea((Train(series.spectrum(i), beta, spread),))


def place(at: str | None, boom: str | None) -> TipPoint:
    """The crane tip, given as such or by the crane's geometry."""
    from stillhook.sea.vessel.boom import TipPoint, parse_boom, parse_point

    if at is not None:
        refuse({"--boom": boom}, "the tip is given by --at already. Give one of them.")
        return parse_point(at, "--at")
    if boom is None:
        raise SeaError('--at: missing. Give a tip, --at "x=-20 m, y=-18 m", or a crane with --boom.')
    return TipPoint(*parse_boom(boom, "--boom").tip)
