"""`stillhook tip`: motion of the crane tip in a sea, from a vessel's transfer functions or from a log."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.cranes import Json
from stillhook.cli.running_text import wrapped
from stillhook.cli.show import human, print_json, print_table, print_values, unit_of

if TYPE_CHECKING:
    from stillhook.sea.rao import Rao
    from stillhook.sea.spectrum import Sea
    from stillhook.sea.tip import TipPoint

OUT_FILES = ("tip.png", "tip.json", "tip.csv", "summary.json")
SHOWN = ("sigma_z", "sigma_v", "sigma_a", "T_z", "T_p", "T_z_counted", "bandwidth")
ALL_ROUND = "all"
EVERY = 15  # deg: headings of --heading all
WAVE_HELP = 'Waves: "jonswap Hs=2 m Tp=8 s gamma=3.3", pm, torsethaugen, ochi-hubble; sums with " + ", each may have a heading=150 deg.'
HEADING_HELP = (
    "Direction in which the waves travel, counter-clockwise from the bow: 0 following, 90 coming from starboard, 180 head sea, "
    "270 coming from port; or all."
)
LOG_HELP = "Log of a motion sensor (CSV or $PSXN,23) in place of vessel and waves; --at is then from the sensor, with z."


def register(app: typer.Typer) -> None:
    app.command("tip")(tip)


def tip(
    vessel: Annotated[str | None, typer.Option(help="Vessel: a name of the library, or a file (.re1, CSV, NetCDF, YAML).")] = None,
    at: Annotated[
        str | None, typer.Option(help='Crane tip from the RAO\'s reference point: "x=-20 m, y=-18 m", forward and to port.')
    ] = None,
    wave: Annotated[str | None, typer.Option(help=WAVE_HELP)] = None,
    heading: Annotated[str | None, typer.Option(help=HEADING_HELP)] = None,
    spread: Annotated[float | None, typer.Option(help="Short-crested waves: exponent n of cos^n about the heading.")] = None,
    pedestal: Annotated[
        str | None, typer.Option(help='In place of --at: heel of the boom, "x=-10 m, y=-6 m, z=15 m", z above water.')
    ] = None,
    slew: Annotated[str | None, typer.Option(help='Where the boom points, from the bow to port: "270 deg" is starboard.')] = None,
    main: Annotated[str | None, typer.Option(help='Main boom: length and angle above the horizontal, "25 m 50 deg".')] = None,
    knuckle: Annotated[str | None, typer.Option(help='Knuckle boom: length and angle below the main boom\'s line, "15 m 60 deg".')] = None,
    log: Annotated[Path | None, typer.Option(help=LOG_HELP)] = None,
    duration: Annotated[str, typer.Option(help="Time of the extremes, and length of the series.")] = "3 h",
    seed: Annotated[int, typer.Option(help="Seed of the series.")] = 1,
    exact: Annotated[bool, typer.Option("--exact", help="Series with the ship's rotations in full; --at then has z.")] = False,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for picture, series (tip.json, tip.csv) and summary.json.")] = None,
    json: Json = False,
) -> None:
    """Motion of the crane tip: standard deviations, periods, largest values, spectra and series.

    Example: stillhook tip --vessel FILE.re1 --at "x=-20 m, y=-18 m" --wave "jonswap Hs=1 m Tp=8 s gamma=3.3" --heading 180
    """
    from stillhook.errors import SeaError
    from stillhook.units import parse
    from stillhook.whole import check_folder

    time = parse(duration, "time", "--duration")
    if log is not None:
        _refuse_with_log(
            {
                "--vessel": vessel,
                "--wave": wave,
                "--heading": heading,
                "--spread": spread,
                "--pedestal": pedestal,
                "--out": out,
                "--exact": exact or None,
            }
        )
        _of_log(log, at, time, json=json)
        return
    for name, value in (("--vessel", vessel), ("--wave", wave)):
        if value is None:
            raise SeaError(f"{name}: missing. Give --vessel, --at and --wave, or a log with --log. See --help.")
    assert vessel is not None
    assert wave is not None
    point = _point(at, pedestal, slew, main, knuckle)
    if out is not None:
        check_folder(out, OUT_FILES)
    from stillhook.io.vessel_file import read_vessel

    if exact and (point.z is None or out is None):
        raise SeaError("--exact: is for the series, and needs --out and the tip's height z in --at.")
    if heading == ALL_ROUND:
        _all_round(read_vessel(vessel), wave, spread, point, time, json=json)
        return
    sea = _sea(wave, heading, spread)
    _in_sea(read_vessel(vessel), sea, point, time, seed, out, exact=exact, json=json)


def _refuse_with_log(options: dict[str, Any]) -> None:
    from stillhook.errors import SeaError

    for name, value in options.items():
        if value is not None:
            raise SeaError(f"{name}: belongs to a vessel in waves, and --log holds a motion already. Leave one of them out.")


def _angle(text: str, where: str) -> float:
    """An angle [rad]; a bare number is in degrees."""
    from stillhook.units import parse

    return parse(f"{text.strip()} deg" if re.fullmatch(r"\s*[+-]?[0-9.]+\s*", text) else text, "angle", where)


def _sea(wave: str, heading: str | None, spread: float | None) -> Sea:
    from stillhook.sea.sea_text import parse_sea

    return parse_sea(wave, heading=None if heading is None else _angle(heading, "--heading"), spread=spread, where="--wave")


def _point(at: str | None, pedestal: str | None, slew: str | None, main: str | None, knuckle: str | None) -> TipPoint:
    from stillhook.errors import SeaError
    from stillhook.sea.boom import Boom
    from stillhook.sea.tip import TipPoint, parse_point

    parts = {"--pedestal": pedestal, "--slew": slew, "--main": main, "--knuckle": knuckle}
    given = [name for name, value in parts.items() if value is not None]
    if at is not None:
        if given:
            raise SeaError(f"{given[0]}: the tip is given by --at already. Give --at, or --pedestal, --slew and --main.")
        return parse_point(at, "--at")
    missing = [name for name in ("--pedestal", "--slew", "--main") if parts[name] is None]
    if missing:
        need = 'a tip, --at "x=-20 m, y=-18 m"' if not given else f"{', '.join(missing)} as well"
        raise SeaError(f"{missing[0] if given else '--at'}: missing. Give {need}, or a crane with --pedestal, --slew and --main.")
    heel = parse_point(pedestal or "", "--pedestal")
    if heel.z is None:
        raise SeaError("--pedestal: z is missing. Give the height of the boom's heel above still water as well.")
    boom = Boom(
        pedestal=(f"{heel.x!r} m", f"{heel.y!r} m", f"{heel.z!r} m"),
        slew=f"{_angle(slew or '', '--slew')!r} rad",
        main=_length_and_angle(main or "", "--main"),
        knuckle=None if knuckle is None else _length_and_angle(knuckle, "--knuckle"),
    )
    return TipPoint(*boom.tip)


def _length_and_angle(text: str, where: str) -> tuple[str, str]:
    from stillhook.errors import SeaError
    from stillhook.units import came

    match = re.fullmatch(r"\s*(\S+ \S+)\s+(\S+ \S+)\s*", text)
    if match is None:
        raise SeaError(f'{where} {came(text)}: is not a length and an angle. Write "25 m 50 deg".')
    return match[1], match[2]


def _in_sea(rao: Rao, sea: Sea, point: TipPoint, duration: float, seed: int, out: Path | None, *, exact: bool, json: bool) -> None:
    from stillhook.sea.tip import tip_summary

    summary = tip_summary(rao, sea, point, duration)
    if out is not None:
        from stillhook.io.tip_files import write_tip

        summary["series"] = write_tip(out, OUT_FILES, rao, sea, point, summary, seed, exact=exact)
    if json:
        print_json(summary)
        return
    wrapped(f"{rao.name}, crane tip at {point.describe()}, in {sea.describe()}")
    _print(summary)
    if out is not None:
        wrapped(f"series: {summary['series']['report']}")
        print("written: " + ", ".join(str(out / name) for name in OUT_FILES))


def _of_log(log: Path, at: str | None, duration: float, *, json: bool) -> None:
    from stillhook.io.motion_file import read_tip_motion
    from stillhook.sea.tip import motion_statistics, parse_point

    point = None if at is None else parse_point(at, "--at")
    arm = None if point is None else (f"{point.x!r} m", f"{point.y!r} m", f"{point.z or 0.0!r} m")
    motion = read_tip_motion(log, tip=arm)
    summary = {"log": log.name, "duration": duration, **motion_statistics(motion, duration), "notes": [motion.report]}
    if json:
        print_json(summary)
        return
    wrapped(motion.describe())
    _print(summary)


def _print(summary: dict[str, Any]) -> None:
    print_values({name: summary[name] for name in SHOWN if name in summary})
    rows = []
    for name, label in (("z", "height"), ("v", "speed"), ("a", "acceleration")):
        levels = [f"{name}_{level}" for level in ("mpm", "p90", "max") if f"{name}_{level}" in summary]
        rows.append([label, *(f"{human(key, summary[key], 4)} {unit_of(key)}" for key in levels)])
    header = ["", "most probable maximum", "90 % stay below", "met in the log"][: len(rows[0])]
    print_table(header, rows, title=f"largest in {summary['duration'] / 3600.0:.4g} h")
    for note in summary["notes"]:
        wrapped(note)


def _all_round(rao: Rao, wave: str, spread: float | None, point: TipPoint, duration: float, *, json: bool) -> None:
    from stillhook.sea.tip import tip_summary

    found = {}
    for degrees in range(0, 360, EVERY):
        summary = tip_summary(rao, _sea(wave, str(degrees), spread), point, duration)
        found[degrees] = {k: v for k, v in summary.items() if isinstance(v, float) and k != "duration"}
    if json:
        rows = [{"beta": math.radians(d), **values} for d, values in found.items()]
        print_json({"vessel": rao.name, "at": summary["at"], "duration": duration, "headings": rows})
        return
    shown = ("sigma_z", "sigma_v", "sigma_a", "T_z", "z_mpm", "v_mpm", "a_mpm")
    cells = [[str(d), *(human(name, values[name], 4) for name in shown)] for d, values in found.items()]
    names = [f"{name}\n{unit_of(name)}" for name in shown]
    print_table(
        ["heading\ndeg", *names], cells, title=f"{rao.name}, crane tip at {point.describe()}, {wave}; largest in {duration / 3600.0:.4g} h"
    )
