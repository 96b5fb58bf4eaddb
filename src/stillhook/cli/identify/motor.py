"""`stillhook identify motor`: torque-loss models from a supplier's map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Json, Out, check_out, say_left_out, write_out
from stillhook.errors import IdentifyError
from stillhook.report.terminal import print_document, print_json, say

if TYPE_CHECKING:
    from stillhook.identify.motor.identify import MotorLoss

SET, REPORT, NUMBERS = "motor.toml", "report.html", "models.json"
STEMS = ("ranking", "terms", "terms-over-speed", "residuals-over-speed", "residuals-over-map", "model-and-map")
OUT_FILES = (SET, REPORT, NUMBERS, *(f"{stem}.png" for stem in STEMS))
MAP_HELP = (
    "CSV, Parquet or Excel, a row a cell: D_m, n, dp, and T_f, T_shaft or eta_hm, units in square brackets in the"
    " headings."
)
LIKE_HELP = (
    "Motor (library name or file) that lends inertia, speed limits, leakage; default: the library's of the same size."
)
PER_CENT = 0.01


def motor(
    map_file: Annotated[Path, typer.Argument(metavar="MAP", help=MAP_HELP)],
    mapping: Annotated[
        Path | None, typer.Option(help="TOML file that names columns and units, for headings of other kinds.")
    ] = None,
    out: Out = None,
    like: Annotated[str | None, typer.Option(help=LIKE_HELP)] = None,
    model: Annotated[
        str | None, typer.Option(help="Model to look at instead of the recommended one: wilson ... mj6.")
    ] = None,
    threshold: Annotated[
        float, typer.Option(help="Error in % of nominal torque beyond which a model must not be used.")
    ] = 1.0,
    json: Json = False,
) -> None:
    """Fit and rank torque-loss models on a supplier's map, recommend one, say where it must not be used (paper A).

    Exit code 1 if no model holds on most of the map, or the map does not determine MJ4, which the twin runs.

    Example: stillhook identify motor A6VM215.csv --out A6VM215
    """
    from stillhook.identify.motor.identify import identify_motor, report, to_dict
    from stillhook.identify.motor.map import read_map
    from stillhook.library.parameter_sets import load_losses

    check_out(out, OUT_FILES)
    if not 0.0 < threshold < 100.0:
        raise IdentifyError(
            f"--threshold = {threshold:g}: give per cent of nominal torque between 0 and 100, such as 1."
        )
    D_max = None if like is None else f"{load_losses(like).motor.D_max!r} m^3/rad"
    m = read_map(map_file, mapping=mapping, D_max=D_max)
    if m.synthetic and not json:
        say("SYNTHETIC map: made by a formula, measured on no motor.")
    result = identify_motor(m, model=model, threshold=threshold * PER_CENT, like=like)
    if json:
        print_json(to_dict(result))
    else:
        print_document(report(result, {}))
    if out is not None:
        write_out(out, dict(sorted(_files(result).items())), quiet=json)
        say_left_out()
    raise typer.Exit(0 if result.usable else 1)


def _files(result: MotorLoss) -> dict[str, Any]:
    """Motor file, report, all models and figures by file. A motor file that must not be used is left out."""
    from stillhook.identify.motor.figures import figures
    from stillhook.identify.motor.identify import loss_set, report, to_dict
    from stillhook.library.parameter_sets import set_toml
    from stillhook.report.html import html
    from stillhook.report.pictures import drawn, png

    pictures = drawn(lambda: {stem: png(figure) for stem, figure in figures(result).items()})
    files: dict[str, Any] = {f"{stem}.png": picture for stem, picture in pictures.items()}
    files |= {REPORT: html(report(result, pictures)), NUMBERS: to_dict(result)}
    if not result.drops_in:
        say(f"{SET} is not written: MJ4 is not determined by this map, or wrong on most of it.")
    elif result.like is None:
        say(
            f"{SET} is not written: no motor of the library has this size. Give --like MOTOR, which lends inertia"
            " and speed limits."
        )
    else:
        files[SET] = set_toml(loss_set(result, SET.removesuffix(".toml")))
    return files
