"""`stillhook validate`: logs of a crane's tests and its twin in, a verdict line by line out, and a certificate where it passes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.cranes import Json
from stillhook.cli.running_text import wrapped
from stillhook.cli.show import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from stillhook.validate.lines import Step, StepNumber
    from stillhook.validate.validation import Validation


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

    numbers = _numbers(steps)
    todo = load_campaign(campaign)
    if out is not None:
        from stillhook.validate.report_files import check_out

        check_out(todo, out)
    if criteria is not None:
        todo = replace(todo, criteria=load_criteria(criteria))
    with progress_bar("validating") as bar:
        found = check(todo, steps=numbers, progress=bar)
    if json:
        from stillhook.validate.report_data import to_dict

        print_json(to_dict(found))
    else:
        _print(found, tables=numbers is not None)
    if out is not None:
        from stillhook.validate.report_files import save_validation

        written = save_validation(found, out, certificate=criteria is None)
        if not json:
            _print_written(out, written)
    if not json:
        _print_missing(found, out, criteria)
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


def _print(found: Validation, *, tables: bool) -> None:
    from stillhook.validate.report_texts import SEGMENT_HEAD, found_on_the_way, segment_cells, segments, sentence, title

    print_table(SEGMENT_HEAD, [list(segment_cells(s)) for s in segments(found)], title=title(found))
    for text in found_on_the_way(found):
        _item(text)
    for step in found.steps:
        _print_step(found, step, tables=tables)
    _print_verdict(found)
    print()
    wrapped(sentence(found))


def _print_step(found: Validation, step: Step, *, tables: bool) -> None:
    from stillhook.validate.report_texts import columns_of_words, step_verdict

    print()
    wrapped(f"step {int(step.number)}, {step.title}: {step_verdict(found, step)}")
    for text in step.statements:
        _item(text)
    for table in step.tables if tables else ():
        print_table(table.header, [list(row) for row in table.rows], title=table.title, texts=columns_of_words(table))


def _print_verdict(found: Validation) -> None:
    """Every criterion as a short paragraph: a table of them would be wider than a terminal."""
    from stillhook.validate.report_texts import MEANING, lines_of, verdict_word

    for step in found.steps:
        lines = lines_of(found, step)
        if lines:
            print(f"\nverdict, step {int(step.number)}: {step.title}")
        for line in lines:
            wrapped(f"{verdict_word(line):<10}{line.key}  {line.said} [{line.source}]", " " * 10)
    there = {line.verdict for line in found.lines}
    print()
    for verdict, text in MEANING.items():
        if verdict in there:
            wrapped(f"{verdict.value}: {text}")
    _print_no(found)


def _print_no(found: Validation) -> None:
    """What stands in the way, once more and together."""
    from stillhook.validate.report_texts import line_cells, verdict_word

    no = [line for line in found.lines if line.no]
    if no:
        print("\nin the way")
    for line in no:
        key, what, figure, between, limit, *_ = line_cells(found, line)
        found_is = f"{figure} ({between})" if between else figure
        asked = f"{limit} is asked" if line.measure is None or line.measure.value is not None else line.measure.note
        wrapped(f"{verdict_word(line):<10}{key}  {what}: {found_is}, {asked}", " " * 10)


def _item(text: str) -> None:
    wrapped(f"- {text}", "  ")


def _print_written(out: Path, written: tuple[str, ...]) -> None:
    from stillhook.validate.report_files import REPORT

    pictures = [name for name in written if name.endswith(".png")]
    rest = [name for name in written if name not in pictures and name != REPORT]
    wrapped(f"written to {out}: {REPORT} (read this), {', '.join(rest)}, {len(pictures)} figures")


def _print_missing(found: Validation, out: Path | None, criteria: str | None) -> None:
    """What there is not, and how to get it."""
    if out is None and found.whole:
        wrapped("report, figures and certificate: --out FOLDER; tables of a step: --steps 4")
    elif criteria is not None and found.whole:
        wrapped("no certificate with --criteria: name the criteria in the campaign file, so that it can be checked later")
