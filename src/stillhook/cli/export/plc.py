"""`stillhook plc ...`: a controller as text for a PLC, and whether such a text is still as it was written."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.parser import CraneArgument, Json, check_out, write_out
from stillhook.report.terminal import print_json
from stillhook.units import quote

LANGUAGES = ("st",)


def export(
    crane: CraneArgument,
    controller: Annotated[
        str | None, typer.Option(help="Controller, such as ssc or position (default: the usual one of the drive).")
    ] = None,
    language: Annotated[str, typer.Option(help="st: IEC 61131-3 Structured Text, with PLCopen XML beside it.")] = "st",
    out: Annotated[Path, typer.Option("--out", help="Folder for the files.")] = Path(),
    json: Json = False,
) -> None:
    """Write a controller for a PLC: text, PLCopen XML, settings, and a test sequence with its expected outputs.

    Example: stillhook plc export nov-250t --controller ssc --language st --out plc
    """
    from stillhook.control.registry import default_of
    from stillhook.export.plc.block import PlcError, controller_block
    from stillhook.export.plc.sequence import sequence_csv
    from stillhook.export.plc.text import plcopen_xml, settings, structured_text
    from stillhook.library import load_crane

    if language not in LANGUAGES:
        raise PlcError(f"--language {quote(language)}: unknown. Choose {' or '.join(LANGUAGES)}.")
    machine = load_crane(crane)
    chosen = controller if controller is not None else default_of(machine.plant.type.control).value
    block = controller_block(machine, chosen)
    stem = re.sub(r"[^\w.-]+", "-", f"{machine.name}-{block.controller}")
    names = (f"{stem}.st", f"{stem}.xml", f"{stem}-settings.json", f"{stem}-test.csv")
    check_out(out, names)
    text = structured_text(block)
    facts = settings(block, text)
    write_out(out, dict(zip(names, (text, plcopen_xml(block), facts, sequence_csv(block)), strict=True)), quiet=json)
    if json:
        print_json({**facts, "files": [str(out / name) for name in names]})
    else:
        print(f"function block {block.block.name}, mode {block.code:g}, every {block.t_cycle:g} s")
        print(f"SHA-256 {facts['sha256']}")


def check(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Text that stillhook plc export wrote.")],
    json: Json = False,
) -> None:
    """Check whether a text is still as it was written: the checksum that it names against that of its lines.

    Exit code 1 if they differ, such as after a setting was changed in the text.

    Example: stillhook plc check plc/nov-250t-ssc.st
    """
    from stillhook.export.plc.text import verify

    named, found = verify(file)
    if json:
        print_json({"sha256": found, "sha256_named": named, "holds": named == found})
    elif named == found:
        print(f"{file}: the checksum holds, SHA-256 {found}")
    else:
        print(f"{file}: changed since it was written: it names SHA-256 {named} and has {found}")
    if named != found:
        raise typer.Exit(1)
