"""`stillhook validate`: logs of a crane's tests and its twin in, a verdict line by line out, and a certificate where it passes."""

from __future__ import annotations

import shutil
import sys
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.cranes import Json
from stillhook.cli.show import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from stillhook.validate.lines import Step, StepNumber
    from stillhook.validate.validation import Validation

REPORT, NUMBERS, SEGMENTS = "report.html", "summary.json", "segments.csv"
NARROW, WIDE = 60, 120
"""Columns of running text: not fewer, not more."""


def register(app: typer.Typer) -> None:
    app.command("validate")(validate)


def validate(
    campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN.toml", help="Campaign file: crane, signals, and one test a log.")],
    out: Annotated[Path | None, typer.Option("--out", help="Folder for report, certificate, figures, tables (default: none).")] = None,
    steps: Annotated[str | None, typer.Option(help="Only these of the steps 0 to 5, such as 1,2; no certificate then.")] = None,
    criteria: Annotated[str | None, typer.Option(help="Criteria file, or name of a set, in place of the campaign's.")] = None,
    json: Json = False,
) -> None:
    """Does a crane file represent a crane? Logs of its tests against the twin, in five steps, judged line by line (paper F).

    Exit code 1 if a criterion failed, or could not be shown.

    Example: stillhook validate sea-trial/campaign.toml --out validation
    """
    from dataclasses import replace

    from stillhook.validate.campaign import load_campaign
    from stillhook.validate.criteria import load_criteria
    from stillhook.validate.validation import validate as check
    from stillhook.whole import check_folder

    if out is not None:
        check_folder(out, (REPORT, NUMBERS, SEGMENTS))
    numbers = _numbers(steps)
    todo = load_campaign(campaign)
    if criteria is not None:
        todo = replace(todo, criteria=load_criteria(criteria))
    with progress_bar("validating") as bar:
        found = check(todo, steps=numbers, progress=bar)
    if json:
        from stillhook.validate.report_data import to_dict

        print_json(to_dict(found))
    else:
        _print(found)
    if out is not None:
        written = _write(found, out)
        if not json:
            print(f"written to {out}: {', '.join(written)}")
    raise typer.Exit(0 if found.passed else 1)


def _numbers(text: str | None) -> list[StepNumber] | None:
    from stillhook.errors import ValidateError
    from stillhook.units import came
    from stillhook.validate.lines import StepNumber

    if text is None:
        return None
    known = {str(int(n)): n for n in StepNumber}
    wanted = [part.strip() for part in text.split(",")]
    if unknown := [part for part in wanted if part not in known]:
        raise ValidateError(f"--steps = {came(text)}: {came(unknown[0])} is not one of {', '.join(known)}. Write numbers such as 1,2.")
    return [known[part] for part in wanted]


def _print(found: Validation) -> None:
    from stillhook.validate.report_texts import SEGMENT_HEAD, segment_cells, segments, sentence, title

    print_table(SEGMENT_HEAD, [list(segment_cells(s)) for s in segments(found)], title=title(found))
    for record in found.records:
        for text in record.statements:
            _item(f"test {record.test.name}: {text}")
    for step in found.steps:
        _print_step(found, step)
    _print_verdict(found)
    print()
    _wrapped(sentence(found))


def _print_step(found: Validation, step: Step) -> None:
    from stillhook.validate.report_texts import columns_of_words, step_verdict

    print(f"\nstep {int(step.number)}, {step.title}: {step_verdict(found, step)}")
    for text in step.statements:
        _item(text)
    for table in step.tables:
        print_table(table.header, [list(row) for row in table.rows], title=table.title, texts=columns_of_words(table))


def _print_verdict(found: Validation) -> None:
    """Every criterion as a short paragraph: a table of them would be wider than a terminal."""
    from stillhook.validate.report_texts import MEANING, lines_of, verdict_word

    print("\nverdict")
    for step in found.steps:
        lines = lines_of(found, step)
        if lines:
            print(f"step {int(step.number)}, {step.title}")
        for line in lines:
            _wrapped(f"{verdict_word(line):<10}{line.key}  {line.said} [{line.source}]", " " * 10)
    there = {line.verdict for line in found.lines}
    print()
    for verdict, text in MEANING.items():
        if verdict in there:
            _wrapped(f"{verdict.value}: {text}")


def _item(text: str) -> None:
    _wrapped(f"- {text}", "  ")


def _wrapped(text: str, indent: str = "") -> None:
    """Running text, folded to the terminal; in a file or a pipe every line stays one."""
    if sys.stdout.isatty():
        width = min(max(shutil.get_terminal_size().columns - 1, NARROW), WIDE)
        text = textwrap.fill(text, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
    print(text)


def _write(found: Validation, out: Path) -> list[str]:
    """Report, numbers, tables and figures, all or nothing."""
    from stillhook.io.page import png
    from stillhook.io.results import save_json
    from stillhook.validate.figures import figures
    from stillhook.validate.report import report
    from stillhook.validate.report_data import segments_table, to_dict
    from stillhook.whole import whole_folder

    with whole_folder(out) as part:
        pictures = {stem: png(figure) for stem, figure in figures(found).items()}
        for stem, data in pictures.items():
            (part / f"{stem}.png").write_bytes(data)
        (part / REPORT).write_text(report(found, pictures), encoding="utf-8")
        save_json(to_dict(found), part / NUMBERS)
        segments_table(found).write_csv(part / SEGMENTS)
        return sorted(p.name for p in part.iterdir())
