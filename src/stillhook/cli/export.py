"""What other programs read: a crane's winch for simulators, OrcaFlex and SIMO, without Python; a controller as text for
a PLC; runs and logs in their formats, and old lift files in the words of today."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import (
    Columns,
    CraneArgument,
    Json,
    MappingFile,
    SubjectArgument,
    check_out,
    present,
    refuse,
    write_out,
)
from stillhook.errors import CommandError, ConvertError, PlanError, StillhookError
from stillhook.report.formatting import counted
from stillhook.report.terminal import Answer, say
from stillhook.units import KINDS, quote, show

if TYPE_CHECKING:
    from stillhook.formats.out import Content
    from stillhook.formats.table.workbook import Sheet
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Scenario


def _file_name(crane: str, ending: str) -> str:
    """The name of a file or folder after a crane, whose own may have signs of a path or of an option."""
    return (re.sub(r"[^\w.-]+", "-", crane).lstrip("-.") or "crane") + ending


def say_lines(
    data: Any, title: str, lines: Sequence[str], written: Sequence[str] = (), step: str = "", *, json: bool
) -> None:
    """Print what was written in a few lines."""
    files = f"written: {', '.join(written)}" if written else ""
    present(data, brief=lambda: Answer(title, [files, *lines], step), json=json)


WIRE_OUT = 100.0
"""Wire out with which a model begins where no case says it [m], as in `stillhook compare`."""
SSP = "ssp"
"""Contents: plant and controller as two FMUs in one system (SSP)."""
CaseArgument = Annotated[
    Path | None,
    typer.Argument(metavar="CASE", help="Case file: load, wire out, water and mode that the model begins with."),
]


def case_for(crane: Crane, file: Path | None) -> Scenario:
    """The case of a file, or half the SWL on 100 m of wire with the usual controller."""
    from stillhook.spec.scenario import Scenario

    if file is None:
        load, s_w = f"{0.5 * crane.SWL!r} kg", f"{WIRE_OUT!r} m"
        return Scenario(load=load, s_w=s_w, tip="still", mode=crane.plant.type.default_mode)
    from stillhook.formats.case_file import load_case

    stored = load_case(file)
    if stored.crane.name != crane.name:
        raise CommandError(
            f'{file.name}: a case of "{stored.crane.name}", and the crane is "{crane.name}". Give one crane in both.'
        )
    return stored.case


def platforms_of(text: str) -> list[str]:
    """Platforms by name, with a message where the first library for one takes longer. Errors: CommandError for none."""
    from stillhook.export.twin import first_of

    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise CommandError(f"--platforms {quote(text)}: give at least one name, such as linux64,win64,source.")
    if first := first_of([name for name in names if name != "source"]):
        say(f"compiling for {', '.join(first)}: the first time takes a minute or two, then seconds ...")
    return names


def fmu(
    name: CraneArgument,
    case_file: CaseArgument = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write (default CRANE.fmu, or CRANE.ssp of a system).")
    ] = None,
    fmi: Annotated[str, typer.Option("--fmi", help="Version of FMI: 2 or 3.")] = "2",
    coupling: Annotated[
        str,
        typer.Option(
            help='"tip": motion of the crane tip in. "wire": also the tension in, wire out and its speed out. "vessel":'
            " heave, roll, pitch and the angles of the boom in; the case's tip then has a boom."
        ),
    ] = "tip",
    contents: Annotated[
        str, typer.Option(help="plant+controller, plant, controller; or ssp: both as two FMUs in one system.")
    ] = "plant+controller",
    platforms: Annotated[
        str | None,
        typer.Option(help="linux64,win64,macos-arm64,source (default: this machine's; the source is always there)."),
    ] = None,
    reference: Annotated[
        Path | None,
        typer.Option(help="Folder for inputs and results of the case, as in the FMI cross-check."),
    ] = None,
    json: Json = False,
) -> None:
    """Write a crane's winch as a Functional Mock-up Unit: C code without Python, with its crane file and validity.

    Without a case it begins with half the SWL on 100 m of wire and the usual controller; load, wire out, mode and gains
    are set in the host.

    Example: stillhook fmu nov-250t --fmi 2 --platforms linux64,win64
    """
    from stillhook.export.fmu import write_fmu, write_reference, write_ssp
    from stillhook.export.fmu.package import check_choice, facts
    from stillhook.export.twin import export, own_platform
    from stillhook.library import load_crane

    crane = load_crane(name)
    case = case_for(crane, case_file)
    chosen = platforms_of(f"{own_platform() or 'source'},source" if platforms is None else platforms)
    check_choice(fmi, chosen)
    if contents == SSP:
        refuse({"--reference": reference}, "a system of two FMUs has no reference results. Leave it out.")
        made = export(crane, case, "plant", coupling)
        target = out or Path(_file_name(crane.name, ".ssp"))
        files: tuple[Path, ...] = (
            write_ssp(made, export(crane, case, "controller"), target, fmi=fmi, platforms=chosen),
        )
    else:
        made = export(crane, case, contents, coupling)
        target = out or Path(_file_name(crane.name, ".fmu"))
        files = write_fmu(made, target, fmi=fmi, platforms=chosen)
        if reference is not None:
            files += write_reference(made, reference)
    title = f"{crane.name}, {made.contents}, coupled at the {made.coupling}: {len(made.ports)} variables"
    lines = [
        f"PLC cycle {show(made.t_cycle, 'time')}; begins with {show(case.load, 'mass')} on {show(case.s_w, 'length')}"
        f" of wire, mode {case.mode.value}.",
        "Steps are whole PLC cycles; inputs are those of the start of a step (input_time 1), or of its end (0).",
    ]
    data = {**facts(made), "fmi": fmi, "platforms": chosen, "files": [str(f) for f in files]}
    say_lines(data, title, lines, [str(f) for f in files], json=json)


def external(
    host: Annotated[str, typer.Argument(metavar="HOST", help="orcaflex or simo.")],
    name: CraneArgument,
    case_file: CaseArgument = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder to write (default CRANE-HOST).")] = None,
    platform: Annotated[
        str, typer.Option("--platforms", help="Libraries: win64, linux64, macos-arm64, or source for none.")
    ] = "win64",
    json: Json = False,
) -> None:
    """Write a crane's winch for OrcaFlex (external function) or SIMO (external DLL force), in a folder.

    Without a case it begins with half the SWL on 100 m of wire and the usual controller.

    Example: stillhook external orcaflex nov-250t --out winch
    """
    from stillhook.export.hosts import write_host
    from stillhook.library import load_crane

    crane = load_crane(name)
    case = case_for(crane, case_file)
    chosen = [each for each in platforms_of(platform) if each != "source"]
    files = write_host(host, crane, case, out or Path(_file_name(crane.name, f"-{host}")), platforms=chosen)
    data = {"crane": crane.name, "host": host, "platforms": chosen, "files": [str(f) for f in files]}
    begin = f"Begins with {show(case.s_w, 'length')} of wire, mode {case.mode.value}"
    lines = [f"{begin}; PLC cycle {show(crane.control.t_cycle, 'time')}."]
    say_lines(data, f"{crane.name} for {host}", lines, [str(f) for f in files], json=json)


LANGUAGES = ("st",)


def plc_export(
    crane: SubjectArgument,
    controller: Annotated[
        str | None, typer.Option(help="Controller, such as ssc or position (default: the usual one of the drive).")
    ] = None,
    language: Annotated[str, typer.Option(help="st: IEC 61131-3 Structured Text, with PLCopen XML next to it.")] = "st",
    out: Annotated[Path | None, typer.Option("--out", help="Folder to write (default CRANE-plc).")] = None,
    json: Json = False,
) -> None:
    """Write a controller for a PLC: text, PLCopen XML, settings, and a test sequence with its expected outputs.

    Of a case whose tip has a boom also the block that makes the tip's motion of the signals of motion unit and boom.

    Example: stillhook plc export nov-250t --controller ssc --language st --out plc
    """
    from stillhook.control.registry import default_of
    from stillhook.export.plc.block import PlcError, controller_block
    from stillhook.export.plc.sequence import sequence_csv
    from stillhook.export.plc.text import plcopen_xml, settings, structured_text
    from stillhook.export.plc.tip import tip_block
    from stillhook.formats.case_file import load_subject
    from stillhook.sea.vessel.vessel_tip import VesselTip, lengths

    if language not in LANGUAGES:
        raise PlcError(f"--language {quote(language)}: unknown. Choose {' or '.join(LANGUAGES)}.")
    subject = load_subject(crane)
    machine, motion = subject.crane, subject.scenario.get("tip")
    chosen = controller if controller is not None else default_of(machine.plant.type.control).value
    block = controller_block(machine, chosen)
    stem = _file_name(machine.name, f"-{block.controller}")
    target = out or Path(_file_name(machine.name, "-plc"))
    tip = None
    if isinstance(motion, VesselTip):
        tip = structured_text(tip_block(lengths(motion.boom, motion.unit.at, motion.unit.exact)))
    names: tuple[str, ...] = (f"{stem}.st", f"{stem}.xml", f"{stem}-settings.json", f"{stem}-test.csv")
    names += () if tip is None else (_file_name(machine.name, "-tip.st"),)
    check_out(target, names)
    text = structured_text(block)
    facts = settings(block, text)
    contents = (text, plcopen_xml(block), facts, sequence_csv(block), *(() if tip is None else (tip,)))
    write_out(target, dict(zip(names, contents, strict=True)), quiet=json, cranes=[machine])
    data = {**facts, "files": [str(target / name) for name in names]}
    title = f"function block {block.block.name}, mode {block.code:g}, every {block.t_cycle:g} s"
    say_lines(data, title, [f"SHA-256 {facts['sha256']}"], json=json)


def plc_check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Text that stillhook plc export wrote.")],
    json: Json = False,
) -> None:
    """Check whether a text is still as it was written: the checksum that it names against that of its lines.

    Exit code 1 if they differ, such as after a setting was changed in the text.

    Example: stillhook plc check plc/nov-250t-ssc.st
    """
    from stillhook.export.plc.text import verify

    named, computed = verify(file)
    holds = named == computed
    lines = [
        f"SHA-256 {computed}" if holds else f"SHA-256 named in it {named}",
        "" if holds else f"of its lines {computed}",
    ]
    title = f"{file}: {'the checksum holds' if holds else 'changed since it was written'}"
    say_lines({"sha256": computed, "sha256_named": named, "holds": holds}, title, lines, json=json)
    raise typer.Exit(0 if holds else 1)


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Run (NetCDF), log, crane, weather, lift, folder of a plan, or crane sheet."
        ),
    ],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="File to write; its ending says the format.")],
    signals: Annotated[str | None, typer.Option(help="Signals by name, in this order (default: all).")] = None,
    case: Annotated[str | None, typer.Option(help="A case by name, or by number from 0 (default: all).")] = None,
    every: Annotated[
        str | None, typer.Option(help='Every so much time, such as "0.1 s"; of a log the width of its means.')
    ] = None,
    form: Annotated[
        str | None,
        typer.Option("--format", help="csv, xlsx, parquet, mat, mdf, orcaflex or sima (default: by the ending)."),
    ] = None,
    mapping: MappingFile = None,
    column: Columns = None,
    json: Json = False,
) -> None:
    """Write a run or a log as CSV, Parquet, MAT, MDF 4, or as a time series that OrcaFlex and SIMA read; or a lift file
    of version 0.10 in the words of today.

    A run with series gives its series, any other its numbers with a row for each case. Numbers are SI; OrcaFlex and
    SIMA get kN and t. A lift file keeps its comments, and every change is printed.

    Tables for Excel (.xlsx or .csv): a crane's sheet, weather, the limits and rule check of a plan's folder, the rule
    check of a lift file. A crane's sheet becomes a crane file again.

    Example: stillhook convert results/runs.nc runs.mf4

    Example: stillhook convert results/runs.nc tip.txt --format orcaflex --case SSC --signals s_tip,F_w

    Example: stillhook convert old.toml new.toml

    Example: stillhook convert nov-250t crane.xlsx
    """
    from stillhook.formats.out import chosen, format_of, of_run, write_table
    from stillhook.formats.results import load_run

    if target.resolve() == source.resolve():
        raise ConvertError(f"{target}: is the source itself. Give another name.")
    if written := _sheets(source, target):
        refuse(
            {"--signals": signals, "--case": case, "--every": every, "--format": form, "--mapping": mapping},
            "belongs to a run or a log. Leave it out.",
        )
        tables = ", ".join(f"{name}: {rows} rows" for name, rows in written.items())
        say_lines({"file": str(target), "tables": written}, f"written: {target} ({tables})", [], json=json)
        return
    if source.suffix.lower() == ".toml":
        options = {
            "--signals": signals,
            "--case": case,
            "--every": every,
            "--format": form,
            "--mapping": mapping,
            "--column": column,
        }
        refuse(options, "belongs to a run or a log, and this is a lift file. Leave it out.")
        changes = _lift_file(source, target)
        data: dict[str, Any] = {"file": str(target), "format": "lift file", "changes": changes}
        say_lines(data, f"{source}: {counted(len(changes), 'change')}", changes, [str(target)], json=json)
        return
    kind = format_of(target, form)
    names = [s.strip() for s in signals.split(",") if s.strip()] if signals is not None else []
    if source.suffix.lower() == ".nc":
        refuse({"--mapping": mapping, "--column": column}, "belongs to a log, and this is a run. Leave it out.")
        content = chosen(of_run(load_run(source)), signals=names, case=case, every=every)
    else:
        refuse({"--case": case}, "belongs to a run, and this is a log. Leave it out.")
        content = chosen(_log(source, mapping, column, every), signals=names)
    write_table(content, target, kind)
    rows, columns = sum(map(len, content.tables.values())), list(content.first.columns)
    data = {"file": str(target), "format": kind, "rows": rows, "columns": columns}
    say_lines(data, f"written: {target} ({kind}, {rows} rows, {len(columns)} columns)", [], json=json)


def _sheets(source: Path, target: Path) -> dict[str, int]:
    """Write crane files, weather, plans and lifts as tables for Excel, or a crane file of a sheet; rows by table, none
    written for another source."""
    from stillhook.base.atomic import atomic_file
    from stillhook.formats.table.workbook import WRITTEN, write_sheets
    from stillhook.tables.sheet import ENDINGS, sheet_of

    sheet_file = sheet_of(source)[0].suffix.lower() in (*ENDINGS, ".csv")
    if target.suffix.lower() == ".toml" and sheet_file:
        from stillhook.formats.table.crane_sheet import crane_file_of_sheet

        if target.exists():
            raise ConvertError(f"{target}: is there already, and may be yours. Give another name.")
        text = crane_file_of_sheet(source)
        with atomic_file(target) as part:
            part.write_text(text, encoding="utf-8")
        return {"crane": text.count(" = ")}
    if target.suffix.lower() not in WRITTEN:
        return {}
    sheets = _tables_of(source)
    if not sheets:
        return {}
    write_sheets(sheets, target, ConvertError)
    return {sheet.name: len(sheet.rows) for sheet in (sheets if target.suffix.lower() != ".csv" else sheets[:1])}


def _tables_of(source: Path) -> list[Sheet]:
    """Tables of a crane, weather, a lift's rules, or the folder of a plan; none for a run or a log."""
    from stillhook.base.gateway.guard import guarded
    from stillhook.formats.table.crane_sheet import crane_sheet
    from stillhook.formats.weather.description import weather_of_file
    from stillhook.formats.weather.sheet import weather_sheet
    from stillhook.library import cranes, load_crane
    from stillhook.library.catalogue import weathers
    from stillhook.library.toml.kinds import FileKind, kind_of_toml
    from stillhook.library.toml.tree import toml_text
    from stillhook.plan.result import PLAN_FILES, load_plan_result

    name = str(source)
    if source.is_dir() or source.name in PLAN_FILES:
        from stillhook.plan.assessments.rigging.section import rigging_sheet
        from stillhook.plan.report.sheets import limits_sheet, rules_sheet

        result = load_plan_result(source)
        with guarded(f"{source.name or source}", PlanError, "Run the plan again."):
            sheets = (limits_sheet(result), rules_sheet(result.facts), rigging_sheet(result.facts))
        return [sheet for sheet in sheets if sheet is not None]
    kind = kind_of_toml(toml_text(source)) if source.suffix.lower() == ".toml" else None
    if name in cranes() or kind is FileKind.CRANE:
        return [crane_sheet(load_crane(name))]
    if name in weathers() or kind is FileKind.WEATHER:
        return [weather_sheet(weather_of_file(name))]
    if kind is FileKind.LIFT:
        from stillhook.plan.file import load_plan
        from stillhook.plan.report.checked import checked
        from stillhook.plan.report.sheets import rules_sheet

        return [rules_sheet(checked(load_plan(source)))]
    return []


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


def _log(source: Path, mapping: Path | None, column: list[str] | None, every: str | None) -> Content:
    import pandas as pd

    from stillhook.formats.out import TIME, Content
    from stillhook.logs.log import read_log
    from stillhook.logs.understood import signals_of
    from stillhook.variables import BY_NAME

    if not source.is_file():
        raise StillhookError(f"{source}: no such file. Give a run (NetCDF) or a log.")
    rows = signals_of(source, mapping, column)
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
