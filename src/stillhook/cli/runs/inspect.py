"""`stillhook inspect`: what a file holds as Stillhook reads it, and the mapping file that says so."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import Columns, Json, MappingFile, present
from stillhook.errors import CommandError, StillhookError
from stillhook.library.toml.kinds import FileKind, kind_of_toml
from stillhook.library.toml.tree import toml_text
from stillhook.report.formatting import argument
from stillhook.report.terminal import Answer, Cells, Line, print_table
from stillhook.units import quote

if TYPE_CHECKING:
    from stillhook.formats.table.understood import Understood

FORM_HELP = "What to read it as: motion, log, weather, chart, map, vessel, spectra; default: by its content."


def inspect(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A file of motion, a log, weather, a chart, a vessel.")],
    form: Annotated[str | None, typer.Option("--format", help=FORM_HELP)] = None,
    mapping: MappingFile = None,
    column: Columns = None,
    save: Annotated[Path | None, typer.Option("--save", help="Mapping file to write, with remarks.")] = None,
    json: Json = False,
) -> None:
    """What a file holds as Stillhook reads it: columns, units, signs, ranges, and what is not read.

    The mapping file of --save says the same. Correct it, and give it to the command that reads the file, by --mapping.

    Exit code 1 where a command would refuse the file as it is understood.

    Example: stillhook inspect mru.csv --column "heave=MRU_Heave_m [m] down" --save mapping.toml
    """
    from stillhook.formats.table.corrections import corrections

    rows = corrections(mapping, column)
    if form is not None and form not in READERS:
        raise CommandError(f"--format {quote(form)}: is not one of {', '.join(READERS)}.")
    result = _read(form, file, rows) if form is not None else _by_content(file, rows)
    if save is not None:
        _save(result, file, save)
    present(result.facts(), brief=lambda: _answer(result, file), json=json)
    if save is not None and not json:
        print(f"written: {save}")
    raise typer.Exit(1 if result.problem else 0)


def _save(result: Understood, file: Path, save: Path) -> None:
    from stillhook.base.atomic import atomic_file
    from stillhook.formats.table.understood import mapping_text

    if result.fixed or not result.rows:
        raise CommandError(
            f"--save: a {result.noun} names its own columns, and takes no mapping file. Leave --save out."
        )
    with atomic_file(save) as part:
        part.write_text(mapping_text(result), encoding="utf-8")


def _answer(result: Understood, file: Path) -> Answer:
    read = "; ".join(
        f"{row.name} = {row.heading}{f' [{row.unit}]' if row.unit else ''}{' down' if row.sign < 0 else ''}"
        for row in result.rows
    )
    lines: list[Line] = [
        f"Refused as it is: {result.problem}" if result.problem else "",
        Cells(f"Read: {read}.") if read else "",
        f"Not read: {', '.join(result.unused)}." if result.unused else "",
        *result.notes,
    ]
    if result.rows:
        cells = [[row.name, row.text, row.range, row.remark] for row in result.rows]
        lines.insert(1, partial(print_table, ["read as", "column", "values", "remark"], cells, left=2, texts=(3,)))
    step = "" if result.fixed or not result.rows else f"stillhook inspect {argument(file)} --save mapping.toml"
    return Answer(f"{result.source}: {result.noun}", lines, step, "ranges and remarks of every column")


def _vessel(name: str, columns: Mapping[str, Any]) -> Understood:
    from stillhook.formats.table.understood import Understood
    from stillhook.formats.vessel.open import read_untested
    from stillhook.sea.vessel.floating_body import long_wave_test, remarks, verdict_of

    file = Path(name)
    _no_rows(file, columns, "a vessel file declares its conventions itself, or a vessel description does")
    rao = read_untested(file)
    tests = long_wave_test(rao)
    word, line = verdict_of(rao, tests)
    notes = tuple(dict.fromkeys((rao.origin, *rao.notes, *remarks(rao, tests), line)))
    return Understood(rao.source, "vessel file", notes=notes, problem="" if word != "wrong" else line, fixed=True)


def _spectra(name: str, columns: Mapping[str, Any]) -> Understood:
    from stillhook.formats.table.understood import Understood
    from stillhook.formats.waves.wavespectra import read_sea

    file = Path(name)
    _no_rows(file, columns, "a file of spectra names its own variables")
    sea = read_sea(file)
    return Understood(file.name, "file of measured waves", notes=(f"{len(sea.time)} records", *sea.notes), fixed=True)


def _no_rows(file: Path, rows: Mapping[str, Any], reason: str) -> None:
    if rows:
        raise CommandError(f"{file.name}: --column: {reason}. Leave it out.")


READERS = {
    "motion": "stillhook.formats.motion.open:understood_motion",
    "log": "stillhook.logs.understood:understood_log",
    "weather": "stillhook.formats.weather.description:understood_weather",
    "chart": "stillhook.plan.definition.load_chart:understood_chart",
    "map": "stillhook.identify.motor.map:understood_map",
    "vessel": f"{__name__}:_vessel",
    "spectra": f"{__name__}:_spectra",
}
"""What a file may be read as, and what reads it so, loaded when it is used."""


def _read(form: str, file: Path, rows: Mapping[str, Any]) -> Understood:
    module, _, function = READERS[form].partition(":")
    understood: Understood = getattr(import_module(module), function)(str(file), columns=rows)
    return understood


def _by_content(file: Path, rows: Mapping[str, Any]) -> Understood:
    """What a file holds, by the first reader that finds in it what it looks for."""

    if file.suffix.lower() == ".toml" and file.is_file():
        kind = kind_of_toml(toml_text(file))
        if kind not in (FileKind.WEATHER, FileKind.VESSEL):
            known = "" if kind is None else f" is {kind.noun}: {kind.read_by}"
            raise CommandError(f"{file.name}{known or ': is TOML'}. Give inspect a table, a log, weather or a vessel.")
    refusals: dict[str, StillhookError] = {}
    best: Understood | None = None
    forms = _order(file, rows)
    likeliest = forms[0] if len(forms) == 1 or forms[0] != "log" else ""
    for form in forms:
        try:
            result = _read(form, file, rows)
        except StillhookError as problem:
            refusals[form] = problem
            continue
        if not result.problem:
            return result
        best = best or result
    if best is None or likeliest in refusals:
        raise refusals.get(likeliest, next(iter(refusals.values())))
    return best


def _order(file: Path, rows: Mapping[str, Any]) -> list[str]:
    """Readers to try, likeliest first: by the names of the rows that are given, then by the first bytes."""
    from stillhook.base.gateway.access import first_bytes, unpacked
    from stillhook.base.gateway.budget import RECORDS
    from stillhook.formats.waves.ndbc import is_ndbc

    _, head = first_bytes(file, HEAD, "file", CommandError)
    if head.startswith(b"\x1f\x8b"):
        head = unpacked(file, "file", CommandError, RECORDS)[:HEAD]
    text = head.decode("latin-1").lower()
    named = {"motion": {"heave", "roll", "pitch", "tip"}, "chart": {"radius", "SWL"}, "map": {"D_m"}}
    asked = [form for form, names in named.items() if names & rows.keys()]
    if asked:
        return asked
    if file.suffix.lower() == ".toml":
        return ["weather", "vessel"] if "file" in text.split("=")[0] else ["vessel", "weather"]
    if head.startswith((b"\x89HDF", b"CDF")):
        return ["spectra", "weather", "vessel"]
    if "vesseltypes:" in text or "transfer function" in text or "omega [rad/s]" in text or file.suffix in VESSELS:
        return ["vessel"]
    if is_ndbc(text.upper()):
        return ["spectra", "weather"]
    if file.suffix.lower() in WORKBOOKS:
        return ["chart", "map"]
    if "$psxn" in text:
        return ["motion"]
    if not head.isascii() and b"\0" in head:
        return ["log"]
    first = text[:4096]
    likely = [
        ("chart", ("swl", "capacity", "traglast", "(t)", "[t]"), ("radi", "outreach", "ausladung")),
        ("map", ("d_m", "displacement"), ("t_f", "t_shaft", "eta_hm")),
        ("motion", ("heave", "tip [", "tip;", "tip,"), ("",)),
        ("weather", ("hs", "hm0", "swh", "wvht", "waveheight", "wave height"), ("",)),
    ]
    order = [form for form, one, other in likely if any(w in first for w in one) and any(w in first for w in other)]
    return [*order, *(form for form in ("log", "weather", "motion") if form not in order)]


WORKBOOKS = (".xlsx", ".xlsm")
HEAD = 1 << 16
"""Bytes by which a reader is chosen."""
VESSELS = (".re1", ".lis", ".4", ".rao", ".yml")
"""Endings of vessel files."""
