"""`stillhook validate`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.groups import VERBOSE
from stillhook.cli.parser import Json, Out, announce, present, say_left_out
from stillhook.errors import ValidateError
from stillhook.report.formatting import argument, wrapped
from stillhook.report.terminal import answer_of, print_document, progress_bar, say
from stillhook.units import quote

if TYPE_CHECKING:
    from stillhook.validate.criteria.results import StepNumber
    from stillhook.validate.validation import Validation


NOT_SIGNED = "certificate: unsigned, so that no plan credits it; to sign: stillhook certificate key new --name NAME"


def validate(
    campaign: Annotated[
        Path, typer.Argument(metavar="CAMPAIGN.toml", help="Campaign file: crane, signals, and one test a log.")
    ],
    out: Out = None,
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
    from stillhook.validate.criteria.criteria import load_criteria
    from stillhook.validate.data_set.campaign import load_campaign
    from stillhook.validate.validation import validate as check

    numbers = _numbers(steps)
    todo = load_campaign(campaign)
    key = None
    if out is not None:
        from stillhook.cli.runs.certificate import users_key
        from stillhook.validate.certificate.certificate import check_out

        check_out(todo, out)
        key = users_key()
    if criteria is not None:
        todo = replace(todo, criteria=load_criteria(criteria))
    with progress_bar("validating") as bar:
        result = check(todo, steps=numbers, progress=bar)
    from stillhook.validate.report.document import summary, to_dict

    parts = numbers is not None
    in_full = lambda: print_document(summary(result, tables=parts, everything=all_ or parts))
    if all_ or parts:  # what was asked for is the detail
        VERBOSE.set(True)
    certified = "" if out is None else f"stillhook certificate {argument(out / 'certificate.json')} --check"
    step = certified if result.passed else "correct what is refuted or not shown: --steps N prints the tables of a step"
    more = "every criterion, load cases, steps, what is not judged"
    brief = lambda: answer_of(summary(result), step or "--out FOLDER, for report, figures and certificate", more)
    present(to_dict(result), brief=brief, json=json, show=in_full)
    if out is not None:
        from stillhook.validate.certificate.certificate import save_validation

        written = save_validation(result, out, certificate=criteria is None, key=key)
        if not json:
            _print_written(out, written)
            if result.passed and criteria is None and result.complete:
                say(f"certificate: signed by {key.name}" if key is not None else NOT_SIGNED)
        say_left_out(pdf=True)
    if VERBOSE.get() and not json:
        _print_missing(result, out, criteria)
    raise typer.Exit(0 if result.passed else 1)


def _numbers(text: str | None) -> list[StepNumber] | None:
    from stillhook.validate.criteria.results import StepNumber

    if text is None:
        return None
    available = {str(int(n)): n for n in StepNumber}
    wanted = [part.strip() for part in text.split(",")]
    if unknown := [part for part in wanted if part not in available]:
        raise ValidateError(
            f"--steps = {quote(text)}: {quote(unknown[0])} is not one of {', '.join(available)}. Write numbers such as"
            " 1,2."
        )
    return [available[part] for part in wanted]


def _print_written(out: Path, written: tuple[str, ...]) -> None:
    from stillhook.validate.certificate.certificate import REPORT

    pictures = [name for name in written if name.endswith(".png")]
    rest = [name for name in written if name not in pictures and name != REPORT]
    figures = [f"{len(pictures)} figures"] if pictures else []
    names = [f"{REPORT} (read this)", *rest, *figures]
    if VERBOSE.get():
        wrapped(f"written to {out}: {', '.join(names)}")
    else:
        announce(out, names)


def _print_missing(validation: Validation, out: Path | None, criteria: str | None) -> None:
    """Outputs not written, and how to get them."""
    if out is None and validation.complete:
        wrapped("every line in full: --all; report, figures and certificate: --out FOLDER; tables of a step: --steps 4")
    elif criteria is not None and validation.complete:
        wrapped(
            "no certificate with --criteria: name the criteria in the campaign file, so that it can be checked later"
        )
