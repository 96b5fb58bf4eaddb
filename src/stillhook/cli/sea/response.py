"""`stillhook response`: response of a lift to waves by the frequency-domain method, one sea or every hour of a year.

What `stillhook response` is given in place of the lift file's own: other waves, another direction, another depth.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import (
    CONTROLLERS,
    Json,
    LiftArgument,
    Out,
    Record,
    Ship,
    Spread,
    announce,
    check_out,
    present,
    refuse,
    say_left_out,
)
from stillhook.cli.sea.tip import sea_of
from stillhook.errors import LiftError, SeaError, StillhookError
from stillhook.report.formatting import cell, display_number, wrapped
from stillhook.report.terminal import Answer, Line, columns, print_table, progress_bar, started, twin_lines
from stillhook.units import parse, show

if TYPE_CHECKING:
    from stillhook.formats.lift_file import LiftFile
    from stillhook.response.lift import LiftResponse, Waves
    from stillhook.sea.spectra.spectrum import Sea


DEPTH_HELP = (
    'Depth of the payload\'s underside below still water, "1500 m" (negative: in the air). Default: the deepest'
    " place at which a phase compensates (AHC), else 20 m above the seabed."
)
WAVE_HELP = (
    'Waves in place of the lift\'s sea: "jonswap Hs=2 m Tp=8 s gamma=3.3", pm, torsethaugen, ochi-hubble, sums with " +'
    ' "; or a file of measured waves (NDBC spectra or standard meteorology, gz too), every record of it.'
)
HEADING_HELP = (
    "Direction in which the waves travel, counter-clockwise from the bow: 0 following, 90 coming from starboard, 180"
    " head sea."
)
MODE_HELP = f"How the winch compensates: {CONTROLLERS}; the lift's controller without it."
MOTIONS = (
    ("tip, height", "sigma_z", "z_mpm"),
    ("tip, speed", "sigma_v", "v_mpm"),
    ("wire's upper end, compensated", "sigma_u", "u_mpm"),
    ("load, compensated", "sigma_load", "load_mpm"),
)
TENSIONS = ("sigma_F_top", "F_top_mpm", "sigma_F_sling", "DAF", "slack_share", "slack_chance")
YEAR = (
    ("significant wave height", "H_m0"),
    ("tip, height, sigma", "sigma_z"),
    ("tip, speed, sigma", "sigma_v"),
    ("tip, speed, most in the duration", "v_mpm"),
    ("wire's upper end, sigma", "sigma_u"),
    ("load on the brake, sigma", "braked.sigma_load"),
    ("load compensated, sigma", "sigma_load"),
    ("load compensated, most in the duration", "load_mpm"),
    ("compensation at the wire", "eta_sigma_wire"),
    ("compensation at the load", "eta_sigma_load"),
    ("top tension, most in the duration", "F_top_mpm"),
    ("DAF", "DAF"),
    ("DAF on the brake", "braked.DAF"),
    ("chance of slack slings", "slack_chance"),
)


def response(
    lift: LiftArgument,
    depth: Annotated[str | None, typer.Option(help=DEPTH_HELP)] = None,
    mode: Annotated[str | None, typer.Option("--controller", help=MODE_HELP)] = None,
    wave: Annotated[str | None, typer.Option(help=WAVE_HELP)] = None,
    heading: Annotated[str | None, typer.Option(help=HEADING_HELP)] = None,
    spread: Spread = None,
    ship: Ship = None,
    record: Record = None,
    duration: Annotated[str, typer.Option(help="Time of the largest values and chances.")] = "3 h",
    out: Out = None,
    json: Json = False,
) -> None:
    """Motion and tension of a hanging load in waves, in seconds: tip, winch residual, wire and load as spectra
    (the frequency-domain method).

    Crane, vessel, payload, rigging, wire, water and sea are those of the lift file; the programme is not run. The
    winch's residual comes from runs of its twin (some seconds) and is kept on disk for the next time.

    Exit code 1 where in one sea the pumps saturate at the tip's most probable largest speed, slings fall slack with a
    chance above 10 %, or the most probable largest sling tension is more than the SWL weighs. Of a file of records
    these are counted, and the code is 0.

    Example: stillhook response anchor-to-3000m --depth "2980 m"

    Example: stillhook response anchor-to-3000m --wave 46042w1996.txt.gz --heading "180 deg" --out year
    """
    from stillhook.formats.lift_file import load_lift
    from stillhook.report.save import RESPONSE_FILES, write_response
    from stillhook.response.lift import answer_of, check_place, lift_response, stamped
    from stillhook.spec.crane import identity

    if parse(duration, "time", "--duration") <= 0.0:
        raise LiftError(f"--duration {duration}: must be longer than 0 s. Enter the duration for the largest values.")
    if depth is not None:
        parse(depth, "length", "--depth")
    check_out(out, RESPONSE_FILES)
    file = load_lift(lift, duration="60 s", moving=False)
    check_place(file)
    waves = waves_of(file, wave, heading, spread, ship, record)
    try:
        with progress_bar(f"{file.crane.name}: running the twin") as bar:
            report = started(file.crane, bar)
            response = lift_response(file, waves, depth=depth, mode=mode, duration=duration, progress=report)
    except StillhookError as e:
        raise type(e)(f"{Path(lift).name}: {e}") from None
    answer = answer_of(response, file, waves)
    written: tuple[str, ...] = ()
    if out is not None:
        short = {name: value for name, value in answer.items() if name != "records"}
        written = write_response(
            out, stamped(response.data, answer), short, partial(_figure, response, answer), [identity(file.crane)]
        )
    present(answer, brief=lambda: _answer(file, response, answer), json=json)
    if out is not None:
        announce(out, written, quiet=json)
        say_left_out()
    raise typer.Exit(0 if answer.get("status", "ok") == "ok" else 1)


def _figure(response: LiftResponse, answer: dict[str, Any]) -> Any:
    from stillhook.plot.sea import response as response_figure

    at = f"payload at {display_number('depth', response.depth, 5)} m"
    title = f"{answer['lift']}: {answer['crane']}, {answer['mode']}, {at}\n{answer['place']}"
    return response_figure(response, title=title)


def _answer(file: LiftFile, response: LiftResponse, answer: dict[str, Any]) -> Answer:
    """Motion and tension with the winch compensating and on its brake, compensation, and the status."""
    load, of_sea = file.lift.payload, "status" in answer
    at = f"payload {show(abs(response.depth), 'length')} {'below' if response.depth > 0.0 else 'above'} still water"
    of_load = f"{load.title or load.name}, {show(load.mass, 'mass')}, on {show(response.load.s_w, 'length')} of wire"
    periods = ", ".join(f"{T:.3g} s" for T in response.T_wire)
    rest = f"{show(response.load.F_top, 'force')} at the tip, {show(response.load.F_sling, 'force')} in the slings"
    lines: list[Line] = [
        partial(wrapped, answer["place"]),
        partial(wrapped, of_load),
        partial(wrapped, f"natural periods with the top held: {periods}; at rest {rest}"),
        partial(_print_sea if of_sea else _print_year, answer),
        *(_of_sea(answer) if of_sea else _of_year(answer)),
        *twin_lines(file.crane),
    ]
    title = f"{answer['lift']}: {answer['crane']}, {answer['mode']}, {at}"
    return Answer(title, lines, more="tip, wire and sling responses, natural periods", notes=answer["notes"])


def _of_year(answer: dict[str, Any]) -> list[Line]:
    """Of a file of records the largest motion of the load, and in how many something is exceeded."""
    n, load = answer["n_valid"], answer["load_mpm"]
    return [
        f"{answer['file']}: {n} of {answer['n_records']} records, {answer['start'][:10]} to {answer['end'][:10]}.",
        f"Load compensated, most in {_hours(answer)}: mean {cell('load_mpm', load['mean'])}, worst"
        f" {cell('load_mpm', load['max'])} on {load['worst'][:16].replace('T', ' ')}.",
        f"Compensation at the load: mean {cell('eta_sigma_load', answer['eta_sigma_load']['mean'])}.",
        f"Pumps saturate in {answer['n_saturated']} records, slack slings are likely in {answer['n_slack']},"
        f" the hook load exceeds the SWL in {answer['n_overload']}.",
    ]


def _of_sea(answer: dict[str, Any]) -> list[Line]:
    """Status, load and tension, compensated and on the brake."""
    rows = [
        [words, cell(name, answer[name]), cell(name, answer["braked"][name])]
        for words, name in (("load motion", "load_mpm"), ("tension at the tip", "F_top_mpm"), ("DAF", "DAF"))
    ]
    table = columns([f"most probable largest in {_hours(answer)}", "compensated", "on the brake"], rows)
    wire, at_load = (cell(name, answer[name]) for name in ("eta_sigma_wire", "eta_sigma_load"))
    pumps = f"Pumps at their stop: {cell('saturation_share', answer['saturation_share'])} of the time."
    compensation = f"Compensation: {wire} at the wire, {at_load} at the load."
    return [f"Status: {answer['status']}.", *table, compensation, partial(wrapped, pumps)]


def _print_sea(answer: dict[str, Any]) -> None:
    braked, hours = answer["braked"], _hours(answer)
    rows = [[label, cell(sigma, answer[sigma]), cell(most, answer[most])] for label, sigma, most in MOTIONS]
    rows.insert(
        3,
        ["load, winch on its brake", cell("sigma_load", braked["sigma_load"]), cell("load_mpm", braked["load_mpm"])],
    )
    print_table(["motion", "standard\ndeviation", f"most probable\nlargest in {hours}"], rows)
    names = {
        "sigma_F_top": "tension at the tip, standard deviation",
        "F_top_mpm": f"tension at the tip, most in {hours}",
    }
    names |= {"sigma_F_sling": "slings, standard deviation", "DAF": "DAF: slings' most over the weight in air"}
    names |= {
        "slack_share": "slings slack, share of the time",
        "slack_chance": f"slings slack at all, chance in {hours}",
    }
    table = [[names[name], cell(name, answer[name]), cell(name, braked[name])] for name in TENSIONS]
    print_table(["tension", "compensated", "on the brake"], table)


def _print_year(answer: dict[str, Any]) -> None:
    rows = []
    for label, key in YEAR:
        name = key.removeprefix("braked.")
        numbers = answer["braked"][name] if key != name else answer[name]
        worst = "min" if name.startswith("eta_") else "max"
        cells = [cell(name, numbers[k]) for k in ("first", "mean", worst)]
        rows.append(
            [
                label.replace("the duration", _hours(answer)),
                *cells,
                numbers["worst"].removesuffix(":00Z").replace("T", " "),
            ]
        )
    print_table(["", "first", "mean", "worst", "when (UTC)"], rows)


def _hours(answer: dict[str, Any]) -> str:
    return f"{answer['duration'] / 3600.0:.4g} h"


def waves_of(
    file: LiftFile, wave: str | None, heading: str | None, spread: float | None, ship: str | None, record: str | None
) -> Waves:
    """The requested waves: those of the lift file, as text, or of a file. Errors: SeaError."""
    from stillhook.response.lift import Waves

    if wave is not None and (record is not None or not Path(wave).is_file()):
        return Waves(sea_of(wave, heading, spread, record, ship))
    if wave is not None:
        return waves_of_file(Path(wave), heading, spread, ship)
    refuse({"--ship": ship, "--record": record}, "belongs to a file of measured waves. Give it as --wave.")
    if file.sea is None:
        raise SeaError("sea: the lift file has none. Write [sea] there, or give --wave.")
    return Waves(_turned(file, heading, spread))


def waves_of_file(sea: Path, heading: str | None, spread: float | None, ship: str | None) -> Waves:
    """All records of a file, with one direction from the bow or their own from north. Errors: SeaError."""
    from stillhook.formats.waves.wavespectra import read_sea
    from stillhook.response.lift import Waves
    from stillhook.sea.spectra.directions import parse_direction
    from stillhook.sea.spectra.measured import SpectrumSeries
    from stillhook.sea.spectra.spectrum import check_spread

    beta, bow = (
        None if text is None else parse_direction(text, name)
        for text, name in ((heading, "--heading"), (ship, "--ship"))
    )
    waves = read_sea(sea)
    if spread is not None:
        check_spread(spread, "--spread")
    if waves.n_valid == 0:
        raise SeaError(f"{waves.source}: none of its {len(waves)} records is valid. Give another file.")
    if beta is not None:
        refuse({"--ship": ship}, "conflicts with --heading, which is from the bow. Leave one of them out.")
        return Waves.from_si(waves, beta=beta, spread=spread)
    spectral = isinstance(waves, SpectrumSeries)
    if isinstance(waves, SpectrumSeries) and waves.directional is None:
        raise SeaError(f'{waves.source}: has no directions. Give --heading, such as "180 deg" for a head sea.')
    if bow is None:
        raise SeaError(
            f"{waves.source}: has directions. Give --ship, where the bow points from north, or --heading in place of"
            " them."
        )
    if spectral:
        refuse({"--spread": spread}, f"{waves.source} already has directions. Leave it out, or give --heading.")
    return Waves.from_si(waves, ship=bow, spread=spread)


def _turned(file: LiftFile, heading: str | None, spread: float | None) -> Sea:
    """The lift file's sea, with another direction or spread where they are given."""
    from stillhook.sea.spectra.directions import parse_direction
    from stillhook.sea.spectra.spectrum import Sea, Train, check_spread

    assert file.sea is not None
    if heading is None and spread is None:
        return file.sea
    if heading is not None and len({train.beta for train in file.sea.trains}) > 1:
        raise SeaError("--heading: the lift file's waves come from several directions. Give all of them with --wave.")
    if spread is not None:
        check_spread(spread, "--spread")
    beta = None if heading is None else parse_direction(heading, "--heading")
    trains = (
        Train(t.spectrum, t.beta if beta is None else beta, t.spread if spread is None else spread)
        for t in file.sea.trains
    )
    return Sea(tuple(trains))
