"""`stillhook identify curve`: friction over speed of any machine that was run to and fro in steps."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.parser import Json, Out, check_out, write_out
from stillhook.errors import LogError
from stillhook.report.terminal import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from stillhook.identify.curve import FrictionCurve
    from stillhook.logs.log import Log

OUT_FILES = ("curve.png", "curve.csv", "curve.json")
MOST_REASONS = 8
"""Rejected stretches that are reported on the screen; all are in curve.json and in the figure."""


def curve(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of the test: CSV, Parquet, MDF4, TDMS or MAT.")],
    mapping: Annotated[
        Path | None, typer.Option(help="Mapping file (TOML): which column is which signal, unit, sign.")
    ] = None,
    speed: Annotated[str, typer.Option(help="Signal whose sign is the direction.")] = "speed",
    effort: Annotated[
        str, typer.Option(help="Signal that friction shows in: force, torque, pressure drop.")
    ] = "effort",
    out: Out = None,
    json: Json = False,
) -> None:
    """Friction over speed from a staircase log, with 95 % intervals: half the difference of both directions.

    A table [curve] of the mapping file has position (signal on which the load depends: compares place by place),
    command (set signal whose changes begin new steps), and what counts as steady: least_length, least_speed and more.

    Example: stillhook identify curve bench.csv --mapping bench.toml --out results
    """
    from stillhook.identify.curve import CurveSettings, curve_settings, friction_curve
    from stillhook.logs.log import describe, read_log, read_mapping

    settings = CurveSettings() if mapping is None else curve_settings(mapping)
    position, command = settings.position, settings.command
    check_out(out, OUT_FILES)
    with progress_bar(log.name) as bar:
        try:
            read = read_log(log, None if mapping is None else read_mapping(mapping), progress=bar)
        except LogError as problem:
            if mapping is None and "no heading names a signal" in str(problem):
                raise LogError(
                    f"{str(problem).split(' Give a mapping')[0]} {_needed(speed, effort, position, command)}"
                ) from None
            raise
    _signals(read, speed, effort, position, command)
    result = friction_curve(
        read, speed=speed, effort=effort, position=position, command=command, settings=settings.steady
    )
    if json:
        print_json({**result.to_dict(), "findings": [asdict(f) for f in read.findings]})
    else:
        for line in describe(read):
            print(line)
        _print(result)
    if out is not None:
        from stillhook.identify.curve import curve_figure

        picture, table, numbers = OUT_FILES
        files = {table: _csv(result), numbers: result.to_dict()}
        write_out(out, files, pictures=lambda: {picture: curve_figure(result, read, effort)}, quiet=json)


def _needed(speed: str, effort: str, position: str | None, command: str | None) -> str:
    """Which columns a mapping must name, with a row to write."""
    names = ["time", speed, effort, *(n for n in (position, command) if n is not None)]
    row = f'{speed} = {{ column = "...", quantity = "speed", unit = "m/s" }}'
    return (
        f"Give a mapping (--mapping file.toml) with the columns of {', '.join(names)} under [signals], such as {row}."
    )


def _signals(log: Log, speed: str, effort: str, position: str | None, command: str | None) -> None:
    """Refuse a log without the signals that the options name. Errors: LogError that names all of them."""
    requested = {"--speed": speed, "--effort": effort, "--position": position, "--command": command}
    available = {*log.signals, *(("dp_m",) if {"p_a", "p_b"} <= set(log.signals) else ())}
    missing = [f"{name} ({option})" for option, name in requested.items() if name is not None and name not in available]
    if missing:
        have = ", ".join(sorted(available))
        way = _needed(speed, effort, position, command)
        raise LogError(
            f"{log.source}: no signal {', '.join(missing)}. It has {have}: name one of these with the option. {way}"
        )


def _print(curve: FrictionCurve) -> None:
    rows = []
    for p in curve.points:
        way = "-" if p.way is None else " to ".join(curve.text("position", x, 3) for x in p.way)
        friction, half = curve.text("effort", p.friction), curve.text("effort", p.estimate.half, 2)
        rows.append(
            [
                curve.text("speed", p.speed),
                friction,
                half,
                curve.text("effort", p.load),
                str(p.up.n),
                str(p.down.n),
                way,
            ]
        )
    if curve.adapted:
        print(
            f"no speed was held for 2 s: stretches from {curve.least_length:g} s on are used"
            " (curve.least_length of the mapping sets it)"
        )
    head = ["speed", "friction", "+- (95 %)", "load", "bins up", "bins down", "way"]
    print_table(head, rows, title=f"{curve.source}: half the difference of both directions")
    rejected = [*curve.steady.rejected, *curve.unpaired]
    for r in rejected[:MOST_REASONS]:
        print(f"not used, {r.start:.1f} to {r.end:.1f} s: {r.reason}")
    if len(rejected) > MOST_REASONS:
        print(f"not used: {len(rejected) - MOST_REASONS} more stretches (see --json or --out)")


def _csv(curve: FrictionCurve) -> str:
    names = ("speed", "friction", "u_friction", "load", "u_load", "speed up", "speed down")
    lines = [",".join(f"{name} [SI]" for name in names)]
    for p in curve.points:
        row = (p.speed, p.friction, p.u_friction, p.load, p.u_load, p.up.speed, p.down.speed)
        lines.append(",".join(repr(float(x)) for x in row))
    return "".join(f"{line}\r\n" for line in lines)
