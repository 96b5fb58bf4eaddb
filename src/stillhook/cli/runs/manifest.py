"""`stillhook manifest`: whether a folder of results, or an FMU, is as it was written, and who vouches for it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.parser import Json, present
from stillhook.report.formatting import argument, counted
from stillhook.report.terminal import Answer, Line
from stillhook.trust.standing import Standing

if TYPE_CHECKING:
    from stillhook.trust.comparison import Comparison
    from stillhook.trust.manifest import Made

SHOWN = 3
"""Names of parts in a line."""


def manifest(
    path: Annotated[Path, typer.Argument(metavar="FOLDER|FMU", help="Folder that a command wrote, an FMU or SSP.")],
    json: Json = False,
) -> None:
    """Compare a folder of results, an FMU or a system of FMUs with its manifest: parts that are missing, changed or
    added, what made them, and who signed.

    Exit code 1 where files differ, or no trusted key signed: whoever changes a file can write a manifest for it. 2 if
    there is no manifest, or it is damaged.

    Example: stillhook manifest results
    """
    from stillhook.trust.comparison import compare
    from stillhook.trust.trust_list import users_trust

    result = compare(path, users_trust())
    present(result.to_dict(), brief=lambda: _answer(path, result), json=json)
    raise typer.Exit(0 if result.holds else 1)


def _answer(path: Path, result: Comparison) -> Answer:
    found = {"missing": result.missing, "changed": result.changed, "added, in no manifest": result.added}
    whole = "all as written" if result.complete else "not as written"
    signed = "" if result.judgement.trusted else ", UNTRUSTED"
    lines: list[Line] = [f"{title}: {_names(names)}" for title, names in found.items() if names]
    lines.append(f"Signature: {result.judgement.sentence}.")
    lines += [_made(of, len(parts)) for of, parts in sorted(result.manifest.sets.items())]
    step = "" if result.holds else "get it from its maker again, or write it again"
    if result.complete and result.judgement.standing is Standing.UNSIGNED:
        step = f"stillhook certificate sign {argument(path)}, if it is yours"
    elif result.complete and result.judgement.standing is Standing.UNKNOWN:
        step = "stillhook certificate key trust PUBLIC.pem, after its owner has confirmed the id"
    return Answer(f"{path}: {counted(len(result.manifest.parts), 'part')}, {whole}{signed}", lines, step)


def _names(names: tuple[str, ...]) -> str:
    """The first names, and how many more."""
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more


def _made(of: Made, parts: int) -> str:
    cranes = ", ".join(f"{name} ({digest[:16]})" for name, digest in of.cranes)
    inputs = _names(tuple(name for name, _ in of.inputs))
    made = f"{of.what}: {counted(parts, 'part')} by Stillhook {of.version}, code {of.code}"
    return f"{made}{f', crane {cranes}' if cranes else ''}{f', of {inputs}' if inputs else ''}"
