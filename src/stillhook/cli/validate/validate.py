"""`stillhook validate`: logs of a crane's tests and its twin in, a verdict line by line out, and a certificate where it
passes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.options import Json
from stillhook.report.running_text import wrapped
from stillhook.report.terminal import print_document, print_json, progress_bar

if TYPE_CHECKING:
    from stillhook.validate.criteria.results import StepNumber
    from stillhook.validate.validation import Validation


def register(app: typer.Typer) -> None:
    app.command("validate")(validate)


def validate(
    campaign: Annotated[
        Path, typer.Argument(metavar="CAMPAIGN.toml", help="Campaign file: crane, signals, and one test a log.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for report, certificate, figures, tables (default: none).")
    ] = None,
    steps: Annotated[
        str | None, typer.Option(help="Only these steps of 0 to 6, such as 1,2; without a certificate.")
    ] = None,
    criteria: Annotated[
        str | None, typer.Option(help="Criteria file, or name of a set, in place of the campaign's.")
    ] = None,
    all_: Annotated[
        bool, typer.Option("--all", help="Every line and every finding in full, not only those not shown.")
    ] = False,
    json: Json = False,
) -> None:
    """Validate a crane file: logs of the crane's tests against the twin, in steps, judged line by line (paper F).

    Exit code 1 if a criterion is refuted, or one that must be shown is not.

    Example: stillhook validate sea-trial/campaign.toml --out validation
    """
    from dataclasses import replace

    from stillhook.validate.criteria.criteria import load_criteria
    from stillhook.validate.data_set.campaign import load_campaign
    from stillhook.validate.validation import validate as check

    numbers = _numbers(steps)
    todo = load_campaign(campaign)
    if out is not None:
        from stillhook.validate.certificate.save import check_out

        check_out(todo, out)
    if criteria is not None:
        todo = replace(todo, criteria=load_criteria(criteria))
    with progress_bar("validating") as bar:
        result = check(todo, steps=numbers, progress=bar)
    if json:
        from stillhook.validate.report.data import to_dict

        print_json(to_dict(result))
    else:
        from stillhook.validate.report.summary import summary

        parts = numbers is not None
        print_document(summary(result, tables=parts, everything=all_ or parts))
    if out is not None:
        from stillhook.validate.certificate.save import save_validation

        written = save_validation(result, out, certificate=criteria is None)
        if not json:
            _print_written(out, written)
    if not json:
        _print_missing(result, out, criteria)
    raise typer.Exit(0 if result.passed else 1)


def _numbers(text: str | None) -> list[StepNumber] | None:
    from stillhook.errors import ValidateError
    from stillhook.units import quote
    from stillhook.validate.criteria.results import StepNumber

    if text is None:
        return None
    known = {str(int(n)): n for n in StepNumber}
    wanted = [part.strip() for part in text.split(",")]
    if unknown := [part for part in wanted if part not in known]:
        raise ValidateError(
            f"--steps = {quote(text)}: {quote(unknown[0])} is not one of {', '.join(known)}. Write numbers such as 1,2."
        )
    return [known[part] for part in wanted]


def _print_written(out: Path, written: tuple[str, ...]) -> None:
    from stillhook.validate.certificate.save import REPORT

    pictures = [name for name in written if name.endswith(".png")]
    rest = [name for name in written if name not in pictures and name != REPORT]
    wrapped(f"written to {out}: {REPORT} (read this), {', '.join(rest)}, {len(pictures)} figures")


def _print_missing(validation: Validation, out: Path | None, criteria: str | None) -> None:
    """Outputs not written, and how to get them."""
    if out is None and validation.complete:
        wrapped("every line in full: --all; report, figures and certificate: --out FOLDER; tables of a step: --steps 4")
    elif criteria is not None and validation.complete:
        wrapped(
            "no certificate with --criteria: name the criteria in the campaign file, so that it can be checked later"
        )
