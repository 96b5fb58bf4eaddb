"""`stillhook convert`: runs and logs in formats of other programs, and old lift files in the words of today."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.parser import Json, refuse
from stillhook.errors import ConvertError, StillhookError

if TYPE_CHECKING:
    from stillhook.formats.out import Content


def convert(
    source: Annotated[
        Path, typer.Argument(metavar="RUN", help="NetCDF of a run (--out, save_run), a log, or an old lift file.")
    ],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="File to write; its ending says the format.")],
    signals: Annotated[str | None, typer.Option(help="Signals by name, in this order (default: all).")] = None,
    case: Annotated[str | None, typer.Option(help="A case by name, or by number from 0 (default: all).")] = None,
    every: Annotated[
        str | None, typer.Option(help='Every so much time, such as "0.1 s"; of a log the width of its means.')
    ] = None,
    form: Annotated[
        str | None, typer.Option("--format", help="csv, parquet, mat, mdf, orcaflex or sima (default: by the ending).")
    ] = None,
    mapping: Annotated[Path | None, typer.Option(help="Mapping of a log's columns (TOML).")] = None,
    json: Json = False,
) -> None:
    """Write a run or a log as CSV, Parquet, MAT, MDF 4, or as a time series that OrcaFlex and SIMA read; or a lift file
    of version 0.10 in the words of today.

    A run with series gives its series, any other its numbers with a row for each case. Numbers are SI; OrcaFlex and
    SIMA get kN and t. A lift file keeps its comments, and every change is printed.

    Example: stillhook convert results/runs.nc runs.mf4

    Example: stillhook convert results/runs.nc tip.txt --format orcaflex --case SSC --signals s_tip,F_w

    Example: stillhook convert old.toml new.toml
    """
    from stillhook.formats.out import chosen, format_of, write_table
    from stillhook.report.terminal import print_json

    if target.resolve() == source.resolve():
        raise ConvertError(f"{target}: is the source itself. Give another name.")
    if source.suffix.lower() == ".toml":
        options = {"--signals": signals, "--case": case, "--every": every, "--format": form, "--mapping": mapping}
        refuse(options, "belongs to a run or a log, and this is a lift file. Leave it out.")
        changes = _lift_file(source, target)
        if json:
            print_json({"file": str(target), "format": "lift file", "changes": changes})
        else:
            print("\n".join((*changes, f"written: {target}")))
        return
    kind = format_of(target, form)
    names = [s.strip() for s in signals.split(",") if s.strip()] if signals is not None else []
    if source.suffix.lower() == ".nc":
        refuse({"--mapping": mapping}, "belongs to a log, and this is a run. Leave it out.")
        content = chosen(_run(source), signals=names, case=case, every=every)
    else:
        refuse({"--case": case}, "belongs to a run, and this is a log. Leave it out.")
        content = chosen(_log(source, mapping, every), signals=names)
    write_table(content, target, kind)
    rows, columns = sum(map(len, content.tables.values())), list(content.first.columns)
    if json:
        print_json({"file": str(target), "format": kind, "rows": rows, "columns": columns})
    else:
        print(f"written: {target} ({kind}, {rows} rows, {len(columns)} columns)")


def _lift_file(source: Path, target: Path) -> tuple[str, ...]:
    """Write an old lift file in the words of today; what was changed, a line each."""
    from stillhook.base.atomic import atomic_file
    from stillhook.formats.lift.forms import converted
    from stillhook.library.toml.kinds import FileKind
    from stillhook.library.toml.tree import parsed, toml_text

    text = toml_text(source)
    parsed(text, source.name, FileKind.LIFT)
    if target.suffix.lower() != ".toml":
        raise ConvertError(f"{target}: a lift file is written as one. Give a name that ends in .toml.")
    if target.exists():
        raise ConvertError(f"{target}: is there already, and may be yours. Give another name.")
    try:
        new, changes = converted(text)
    except StillhookError as problem:
        raise ConvertError(f"{source.name}: {problem}") from None
    with atomic_file(target) as part:
        part.write_text(new, encoding="utf-8")
    moved = target.resolve().parent != source.resolve().parent
    return (*changes, *(("files that it names are seen from its new folder",) if moved else ()))


def _run(source: Path) -> Content:
    from stillhook.formats.out import of_run
    from stillhook.formats.results import load_run

    return of_run(load_run(source))


def _log(source: Path, mapping: Path | None, every: str | None) -> Content:
    import pandas as pd

    from stillhook.formats.out import TIME, Content
    from stillhook.logs.log import read_log
    from stillhook.logs.mapping import read_mapping
    from stillhook.units import KINDS
    from stillhook.variables import BY_NAME

    if not source.is_file():
        raise StillhookError(f"{source}: no such file. Give a run (NetCDF) or a log.")
    rows = read_mapping(mapping) if mapping is not None else None
    log = read_log(source, rows) if every is None else read_log(source, rows, every=every)
    kinds = {name: log.kind(name) for name in log.signals}
    units = {name: KINDS[kind].si if kind else "1" for name, kind in kinds.items()}
    meanings = {name: BY_NAME[name].meaning if name in BY_NAME else "" for name in log.signals}
    return Content(
        {"": pd.DataFrame({TIME: log.t, **log.signals})},
        {TIME: "s"} | units,
        {TIME: "time from the first sample"} | meanings,
        {"title": f"means of {log.source}"},
    )
