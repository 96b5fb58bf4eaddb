"""`stillhook identify motor|component|friction|curve`: torque-loss models from a supplier's map, leakage, displacement
controls and line restrictions, system friction from crane tests, friction over speed of any machine that was run to and
fro in steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Columns, Json, MappingFile, Out, check_out, present, say_left_out, write_out
from stillhook.errors import IdentifyError, LogError
from stillhook.formats.table.cells import csv_of
from stillhook.report.document import Document, Table, words
from stillhook.report.formatting import counted, wrapped
from stillhook.report.terminal import (
    Answer,
    Cells,
    Line,
    answer_of,
    columns,
    print_document,
    print_table,
    progress_bar,
    say,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stillhook.identify.component.result import Component
    from stillhook.identify.curve import FrictionCurve
    from stillhook.identify.motor.identify import MotorLoss
    from stillhook.identify.system_friction.campaign import Campaign
    from stillhook.identify.system_friction.identify import Friction
    from stillhook.identify.system_friction.measure import Measured
    from stillhook.logs.log import Log

STEMS = ("ranking", "terms", "terms-over-speed", "residuals-over-speed", "residuals-over-map", "model-and-map")
MOTOR_FILES = ("motor.toml", "report.html", "models.json", *(f"{stem}.png" for stem in STEMS))
MAP_TABLE = "map.csv"
MAP_HELP = (
    "CSV, Parquet or Excel, a row a cell: D_m, n, dp, and T_f, T_shaft or eta_hm, units in square brackets in the"
    " headings."
)
LIKE_HELP = (
    "Motor (library name or file) that lends inertia, speed limits, leakage; default: the library's of the same size."
)
PER_CENT = 0.01
COMPONENT_FILES = ("crane.toml", "report.html", "component.json")
FRICTION_FILES = ("friction.toml", "report.html", "summary.json", "points.csv", "stretches.csv")
VERIFY_FILES = ("verification.html", "verification.json", "verification.csv")
LOG_DPI = 80  # pictures of complete logs in the report: a dozen of them, each a thousand points wide
CURVE_FILES = ("curve.png", "curve.csv", "curve.json")
MOST_REASONS = 8
"""Rejected stretches that are reported on the screen; all are in curve.json and in the figure."""


def motor(
    map_file: Annotated[Path, typer.Argument(metavar="MAP", help=MAP_HELP)],
    mapping: MappingFile = None,
    column: Columns = None,
    out: Out = None,
    like: Annotated[str | None, typer.Option(help=LIKE_HELP)] = None,
    model: Annotated[
        str | None,
        typer.Option(help="Model to look at, and for the motor file, instead of MJ4: wilson ... mj6, or map."),
    ] = None,
    threshold: Annotated[
        float, typer.Option(help="Error in % of nominal torque beyond which a model must not be used.")
    ] = 1.0,
    json: Json = False,
) -> None:
    """Fit and rank torque-loss models on a supplier's map, recommend one, say where it must not be used (paper A).

    The motor file holds MJ4, or what --model names (--model map: the map itself, with its table map.csv), and the
    models that fit as well, for stillhook uncertainty. Exit code 1 if no model holds on most of the map, or the map
    does not determine that of the motor file.

    Example: stillhook identify motor A6VM215.csv --out A6VM215
    """
    from stillhook.formats.table.corrections import corrections_of
    from stillhook.identify.motor.identify import identify_motor, report, to_dict
    from stillhook.identify.motor.map import read_map
    from stillhook.library.parameter_sets import load_losses

    check_out(out, (*MOTOR_FILES, MAP_TABLE))
    if not 0.0 < threshold < 100.0:
        raise IdentifyError(
            f"--threshold = {threshold:g}: give per cent of nominal torque between 0 and 100, such as 1."
        )
    D_max = None if like is None else f"{load_losses(like).motor.D_max!r} m^3/rad"
    m = read_map(map_file, mapping=mapping, D_max=D_max, columns=corrections_of(column or ()))
    if m.synthetic and not json:
        say("SYNTHETIC map: made by a formula, measured on no motor.")
    result = identify_motor(m, model=model, threshold=threshold * PER_CENT, like=like)
    document = report(result, {})
    step = "--out FOLDER, for the motor file and the report" if out is None else f"read {out / MOTOR_FILES[1]}"
    brief = lambda: answer_of(document, step, "models, parameters, where they must not be used")
    present(to_dict(result), brief=brief, json=json, show=lambda: print_document(document))
    if out is not None:
        write_out(out, dict(sorted(_motor_files(result).items())), quiet=json)
        say_left_out()
    raise typer.Exit(0 if result.usable else 1)


def _motor_files(result: MotorLoss) -> dict[str, Any]:
    """Motor file, report, all models and figures by file. A motor file that must not be used is left out."""
    from stillhook.identify.motor.figures import figures
    from stillhook.identify.motor.identify import loss_set, map_table, report, to_dict
    from stillhook.library.parameter_sets import set_toml

    chosen, page, numbers = MOTOR_FILES[:3]
    files = _report_files(page, lambda: figures(result), lambda pictures: report(result, pictures))
    files[numbers] = to_dict(result)
    if not result.drops_in:
        say(f"{chosen} is not written: {result.law.upper()} is not determined by this map, or wrong on most of it.")
    elif result.like is None:
        say(
            f"{chosen} is not written: no motor of the library has this size. Give --like MOTOR, which lends inertia"
            " and speed limits."
        )
    else:
        files[chosen] = set_toml(loss_set(result, chosen.removesuffix(".toml")))
    if result.law == "map":
        files[MAP_TABLE] = map_table(result)
    return files


def component(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="motor-leakage, pump-leakage, servo (pump or motor), or lines.")
    ],
    data: Annotated[
        Path, typer.Argument(metavar="DATA", help="Table of a leakage (CSV, Excel), or log of command and response.")
    ],
    mapping: MappingFile = None,
    column: Columns = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Identify a component from data of its own, with 95 % intervals, held-out errors and a crane file that takes it.

    motor-leakage and pump-leakage read D_m, omega_m, dp_m and one of C_leak, Q_leak, Q, eta_v, with Q_case where the
    drain was measured; servo reads u_p and alpha_p, or u_m and alpha_m; lines reads p_a_pump, p_a_motor, p_b_pump,
    p_b_motor and a flow. The table [component] of the mapping file has base (crane that takes the result), circuit,
    D_max, V_dead and bulk_modulus.

    Exit code 1 if the data do not determine the component.

    Example: stillhook identify component servo swivel-test.csv --mapping servo.toml --out results
    """
    from stillhook.identify.component.identify import identify_component
    from stillhook.identify.component.report import report
    from stillhook.identify.component.result import base_crane, crane_file, interval, to_dict

    check_out(out, COMPONENT_FILES)
    with progress_bar(data.name) as bar:
        result = identify_component(kind, data, mapping=mapping, columns=column, progress=bar)
    crane = base_crane(result.settings)
    text = "" if crane is None or not result.usable else crane_file(result, crane)
    document = report(result, {})
    numbers = "; ".join(
        f"{p.name} {value} ({low} to {high})" for p in result.parameters for value, low, high in [interval(p)]
    )
    step = "--out FOLDER, for the crane file and the report" if out is None else f"read {out / COMPONENT_FILES[1]}"
    brief = lambda: answer_of(document, step, "held-out data, notes, what the twin does with it", [f"{numbers}."])
    present(to_dict(result), brief=brief, json=json, show=lambda: print_document(document))
    if out is not None:
        write_out(out, _component_files(result, text), quiet=json, cranes=[] if crane is None else [crane])
        say_left_out()
    raise typer.Exit(0 if result.usable else 1)


def _component_files(result: Component, text: str) -> dict[str, Any]:
    """Crane file, report, numbers and figures by file. A result that must not be used gives no crane file."""
    from stillhook.identify.component.report import report
    from stillhook.identify.component.result import to_dict

    chosen, page, numbers = COMPONENT_FILES
    files = _report_files(page, result.figures, lambda pictures: report(result, pictures)) | {numbers: to_dict(result)}
    if text:
        files[chosen] = text
    else:
        reason = "give component.base in the mapping." if result.usable else "not determined."
        say(f"{chosen} is not written: {reason}")
    return dict(sorted(files.items()))


def _report_files(
    page: str, figures: Callable[[], Mapping[str, Figure]], report: Callable[[Mapping[str, bytes]], Document]
) -> dict[str, Any]:
    """A report as a page of this name, and its figures by file."""
    from stillhook.report.html import html
    from stillhook.report.kit import draw_if_possible, pngs

    pictures = draw_if_possible(lambda: pngs(figures()))
    return {f"{stem}.png": picture for stem, picture in pictures.items()} | {page: html(report(pictures))}


def friction(
    campaign: Annotated[
        Path, typer.Argument(metavar="CAMPAIGN.toml", help="Campaign file: crane, signals, and one test a log.")
    ],
    out: Out = None,
    verify: Annotated[
        bool, typer.Option("--verify", help="Repeat the tests in the twin and compare pressures (table [verify]).")
    ] = False,
    json: Json = False,
) -> None:
    """Identify system friction from the logs of crane tests (thesis section 2.3, paper D).

    The campaign's table [fit] has like (set of a similar winch, for what the tests cannot determine), loops of the
    second loop, map (supplier's, to compare with the fitted motor), keep_Y_2, variant, seed and proposals. With
    --verify the logged commands drive the twin, also those of tests with ahc = true; [verify] has friction (identified,
    second-loop, crane, or a set, which needs no fit) and the limits pressure and torque.

    Exit code 1 if the data cannot determine what a winch model needs, or a verified pressure is over its limit.

    Example: stillhook identify friction my-tests/campaign.toml --verify --out results
    """
    from stillhook.identify.system_friction.campaign import OWN_FRICTIONS, load_campaign
    from stillhook.identify.system_friction.identify import friction as identify
    from stillhook.identify.system_friction.report import report
    from stillhook.identify.system_friction.result import to_dict

    check_out(out, FRICTION_FILES + VERIFY_FILES * verify)
    tests = load_campaign(campaign)
    if verify and tests.verify.friction not in OWN_FRICTIONS:
        raise typer.Exit(_verified(tests, None, {}, out, json=json))
    with progress_bar("reading the logs") as bar:
        result = identify(tests, progress=bar)
    document = report(result, {})
    numbers = "; ".join(f"{name} {value} ({low} to {high})" for name, value, low, high, _ in parameters(document))
    step = "--out FOLDER, for the friction set and the report" if out is None else f"read {out / FRICTION_FILES[1]}"
    more = "tests, what the data cannot determine, methods, proposed tests"
    brief = lambda: answer_of(document, step, more, [f"Parameters with 95 % intervals: {numbers}."])
    answer = to_dict(result)
    if not (verify and json):
        present(answer, brief=brief, json=json, show=lambda: print_document(document))
    if out is not None:
        write_out(out, dict(sorted(_friction_files(result).items())), quiet=json, cranes=[tests.crane])
        say_left_out()
    exceeded = _verified(tests, result, answer, out, json=json) if verify else 0
    raise typer.Exit(exceeded if result.usable else 1)


def _verified(tests: Campaign, result: Friction | None, answer: dict[str, Any], out: Path | None, *, json: bool) -> int:
    """Verify a friction in the twin, print and write it; the exit code. answer: what JSON holds besides."""
    from stillhook.report.html import html
    from stillhook.report.kit import draw_if_possible, pngs
    from stillhook.validate.dynamics.friction import report
    from stillhook.validate.dynamics.friction.verify import verify_friction

    with progress_bar("tests in the twin") as bar:
        verified = verify_friction(tests, result, progress=bar)
    document, numbers = report.verification_report(verified, {}), report.verification_dict(verified)
    step = "--out FOLDER, for the report" if out is None else f"read {out / VERIFY_FILES[0]}"
    brief = lambda: answer_of(document, step, "deviation by test, direction, speed and displacement")
    present({**answer, "verification": numbers}, brief=brief, json=json, show=lambda: print_document(document))
    if out is not None:
        pictures = draw_if_possible(lambda: pngs(report.verification_figures(verified), LOG_DPI))
        page = html(report.verification_report(verified, pictures))
        table = csv_of(report.stretches_table(verified))
        files = dict(zip(VERIFY_FILES, (page, numbers, table), strict=True))
        write_out(out, files, quiet=json, cranes=[tests.crane])
    return 0 if verified.passed else 1


def parameters(document: Document) -> list[list[str]]:
    """Name, value, low, high and meaning of each parameter in a report of friction."""
    table = next(part for part in document.sections[0].parts if isinstance(part, Table))
    return [list(map(words, row)) for row in table.rows]


def _friction_files(result: Friction) -> dict[str, Any]:
    """Set, report, numbers, tables and figures by file. A set that must not be used is left out."""
    from stillhook.identify.system_friction.report import figures, report
    from stillhook.identify.system_friction.result import (
        friction_set,
        points_table,
        second_loop_sets,
        stretches_table,
        to_dict,
        warnings,
    )
    from stillhook.library.parameter_sets import set_toml
    from stillhook.report.kit import draw_if_possible, pngs

    chosen, page, numbers, points, stretches = FRICTION_FILES
    logs = draw_if_possible(lambda: pngs({m.test.name: _log_figure(m) for m in result.measured}, LOG_DPI))
    files = _report_files(page, lambda: figures(result), lambda pictures: report(result, pictures, logs))
    files |= {
        numbers: to_dict(result),
        points: csv_of(points_table(result)),
        stretches: csv_of(stretches_table(result)),
    }
    if not result.usable:
        say(f"{chosen} is not written: the data cannot determine what a winch model needs.")
        return files
    files[chosen] = warnings(result) + set_toml(friction_set(result))
    for item in second_loop_sets(result) if result.second is not None else ():
        files[f"{item.name}.toml"] = set_toml(item)
    return files


def _log_figure(m: Measured) -> Figure:
    from stillhook.identify.curve import window_figure

    return window_figure(m.log, "omega_m", "dp_m", m.steady, m.pairs.unpaired, f"test {m.test.name}: {m.log.source}")


def curve(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of the test: CSV, Parquet, MDF4, TDMS or MAT.")],
    mapping: MappingFile = None,
    column: Columns = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Friction over speed from a staircase log, with 95 % intervals: half the difference of both directions.

    A table [curve] of the mapping file has speed (signal whose sign is the direction), effort (signal that friction
    shows in), position (signal on which the load depends: compares place by place), command (set signal whose changes
    begin new steps), and what counts as steady: least_length, least_speed and more.

    Example: stillhook identify curve bench.csv --mapping bench.toml --out results
    """
    from stillhook.identify.curve import CurveSettings, curve_figure, curve_settings, friction_curve
    from stillhook.logs.log import describe, read_log
    from stillhook.logs.understood import signals_of

    settings = CurveSettings() if mapping is None else curve_settings(mapping)
    speed, effort, position, command = settings.speed, settings.effort, settings.position, settings.command
    check_out(out, CURVE_FILES)
    with progress_bar(log.name) as bar:
        try:
            read = read_log(log, signals_of(log, mapping, column), progress=bar)
        except LogError as problem:
            line, mark, _ = str(problem).partition(" Give a mapping")
            if mapping is None and mark and "no heading names a signal" in line:
                raise LogError(f"{line} {_needed(speed, effort, position, command)}") from None
            raise
    _signals(read, speed, effort, position, command)
    result = friction_curve(
        read, speed=speed, effort=effort, position=position, command=command, settings=settings.steady
    )
    picture, table, numbers = CURVE_FILES
    answer = {**result.to_dict(), "findings": [asdict(f) for f in read.findings]}
    files = {table: _csv(result), numbers: result.to_dict()}
    pictures = lambda: {picture: curve_figure(result, read, effort)}
    brief = lambda: _answer_of_curve(result, describe(read))
    present(answer, out, files, brief=brief, json=json, pictures=pictures)


def _signals(log: Log, speed: str, effort: str, position: str | None, command: str | None) -> None:
    """Refuse a log without the signals that the options name. Errors: LogError that names all of them."""
    requested = {"curve.speed": speed, "curve.effort": effort, "curve.position": position, "curve.command": command}
    available = {*log.signals, *(("dp_m",) if {"p_a", "p_b"} <= set(log.signals) else ())}
    missing = [f"{name} ({option})" for option, name in requested.items() if name is not None and name not in available]
    if missing:
        have, way = ", ".join(sorted(available)), _needed(speed, effort, position, command)
        raise LogError(
            f"{log.source}: no signal {', '.join(missing)}. It has {have}: name one of these in the mapping. {way}"
        )


def _needed(speed: str, effort: str, position: str | None, command: str | None) -> str:
    """Columns that a mapping must name, with a row to write."""
    names = ["time", speed, effort, *(n for n in (position, command) if n is not None)]
    row = f'{speed} = {{ column = "...", quantity = "speed", unit = "m/s" }}'
    return (
        f"Give a mapping (--mapping file.toml) with the columns of {', '.join(names)} under [signals], such as {row}."
    )


def _answer_of_curve(curve: FrictionCurve, log: Sequence[str]) -> Answer:
    """Friction of each speed, with what was left out; log: what its file holds."""
    rows = []
    for p in curve.points:
        way = "-" if p.way is None else " to ".join(curve.text("position", x, 3) for x in p.way)
        half, load = curve.text("effort", p.estimate.half, 2), curve.text("effort", p.load)
        friction = curve.text("effort", p.friction)
        rows.append([curve.text("speed", p.speed), friction, half, load, str(p.up.n), str(p.down.n), way])
    heads = ["speed", "friction", "+- (95 %)"]
    lines: list[Line] = [
        *(partial(wrapped, line) for line in log),
        *columns(heads, [row[:3] for row in rows]),
        partial(print_table, [*heads, "load", "bins up", "bins down", "way"], rows),
    ]
    if curve.adapted:
        lines.append(
            f"No speed was held for 2 s: stretches from {curve.least_length:g} s on are used"
            " (curve.least_length of the mapping sets it)."
        )
    rejected = [*curve.steady.rejected, *curve.unpaired]
    if rejected:
        lines.append(Cells(f"Not used: {counted(len(rejected), 'stretch')}; the first: {rejected[0].reason}."))
    shown = [f"not used, {r.start:.1f} to {r.end:.1f} s: {r.reason}" for r in rejected[:MOST_REASONS]]
    if len(rejected) > MOST_REASONS:
        shown.append(f"not used: {len(rejected) - MOST_REASONS} more stretches (see --json or --out)")
    lines += [partial(wrapped, line) for line in shown]
    return Answer(f"{curve.source}: friction, half the difference of both directions", lines, more="load, bins, log")


def _csv(curve: FrictionCurve) -> str:
    names = ("speed", "friction", "u_friction", "load", "u_load", "speed up", "speed down")
    rows = [(p.speed, p.friction, p.u_friction, p.load, p.u_load, p.up.speed, p.down.speed) for p in curve.points]
    lines = [",".join(f"{name} [SI]" for name in names), *(",".join(repr(float(x)) for x in row) for row in rows)]
    return "".join(f"{line}\r\n" for line in lines)
