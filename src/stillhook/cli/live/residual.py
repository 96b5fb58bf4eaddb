"""`stillhook live residual`: a model of what adaptation leaves over, learned from logs, or tested by them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Columns, Json, MappingFile, present
from stillhook.errors import CommandError
from stillhook.report.terminal import Answer, Line, columns, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stillhook.live.residual import HeldOut, Model


def residual(
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="[MODEL] LOG...", help="Logs, each in the folder of its campaign; before them a model."),
    ],
    crane: Annotated[str, typer.Option(metavar="CRANE|CASE", help="Crane, or case file that names it.")],
    mapping: MappingFile = None,
    column: Columns = None,
    out: Annotated[Path | None, typer.Option(help="File for the model (JSON).")] = None,
    json: Json = False,
) -> None:
    """Learn what adaptation of the friction leaves over of the shaft torque (level 4), tested on campaigns and seas
    that were held out; or test a model by logs that it has not seen.

    A model (a file *.json before the logs) is tested. A campaign is a folder. Exit code 1 if level 4 does not pay.

    Example: stillhook live residual day1/a.csv day2/b.csv day3/c.csv day4/d.csv --crane nov-250t --out model.json
    """
    from stillhook.formats.case_file import load_subject
    from stillhook.live.residual import learning_log, read_model, test_model, train, write_model
    from stillhook.logs.understood import signals_of

    of = load_subject(crane).crane
    file, paths = (logs[0], logs[1:]) if logs[0].suffix == ".json" else (None, logs)
    if not paths or (file is not None and out is not None):
        raise CommandError("live residual: give logs; with a model before them they test it, and --out has no meaning.")
    model = None if file is None else read_model(file, of)
    read = [learning_log(path, of, signals_of(path, mapping, column)) for path in paths]
    if model is None:
        model, held = train(of, read)
        if out is not None:
            write_model(out, model)
    else:
        held = test_model(model, read)
    present(_data(model, held), brief=lambda: _answer(model, held), json=json)
    if out is not None and not json:
        print(f"written: {out}. It is never part of a certificate.")
    raise typer.Exit(0 if model.pays else 1)


def _data(model: Model, held: Sequence[HeldOut]) -> dict[str, Any]:
    names = ("log", "campaign", "adapted", "linear", "learned", "outside", "without")
    return {
        "level": 4,
        "pays": model.pays,
        "ratio": model.ratio.to_dict(),
        "linear": model.linear.to_dict(),
        "confidence": model.confidence,
        "half": model.half,
        "terms": dict(zip(*_terms(model), strict=True)),
        "logs": [{name: getattr(one, name) for name in names} for one in held],
    }


def _terms(model: Model) -> tuple[tuple[str, ...], list[list[float]]]:
    from stillhook.live.residual import TERMS

    f = model.fitted
    return TERMS, [[float(b), float(u)] for b, u in zip(f.coefficients, f.errors, strict=True)]


def _answer(model: Model, held: Sequence[HeldOut]) -> Answer:
    """Whether level 4 pays, and what is left over of the shaft torque on held-out logs."""
    rows = [[o.log, *(f"{x:.1f}" for x in (o.adapted, o.linear, o.learned))] for o in held]
    shares = [[o.campaign, *(f"{100.0 * x:.0f} %" for x in (o.outside, o.without))] for o in held]
    heads = ["log", "adapted", "and linear terms", "and trees"]
    full = [[*row, *share] for row, share in zip(rows, shares, strict=True)]
    table = [[name, f"{b:.1f}", f"{u:.1f}"] for name, (b, u) in zip(*_terms(model), strict=True)]
    terms = ["term", "coefficient [N m]", "standard error"]
    lines: list[Line] = [
        model.verdict[0].upper() + model.verdict[1:],
        f"{100.0 * model.confidence:.0f} % interval of what is left over: +-{model.half:.0f} N m.",
        *columns(heads, rows),
        partial(print_table, [*heads, "campaign", "not seen", "no correction"], full),
        partial(print_table, terms, table, title="Linear part, learned from all logs"),
        partial(print, f"Trees: {len(model.fitted.trees)}."),
    ]
    return Answer("Shaft torque left over on held-out logs, rms in N m (level 4)", lines, more="terms, campaigns")
