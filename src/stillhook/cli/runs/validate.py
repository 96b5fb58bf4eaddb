"""`stillhook validate` and `stillhook certificate`."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.groups import VERBOSE
from stillhook.cli.parser import Json, Out, announce, present, refuse, say_left_out
from stillhook.errors import ValidateError
from stillhook.report.formatting import wrapped
from stillhook.report.terminal import Answer, Line, answer_of, print_document, progress_bar
from stillhook.units import number, quote

if TYPE_CHECKING:
    from stillhook.validate.certificate.recheck import Check
    from stillhook.validate.criteria.results import StepNumber
    from stillhook.validate.validation import Validation


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
    if out is not None:
        from stillhook.validate.certificate.certificate import check_out

        check_out(todo, out)
    if criteria is not None:
        todo = replace(todo, criteria=load_criteria(criteria))
    with progress_bar("validating") as bar:
        result = check(todo, steps=numbers, progress=bar)
    from stillhook.validate.report.document import summary, to_dict

    parts = numbers is not None
    in_full = lambda: print_document(summary(result, tables=parts, everything=all_ or parts))
    if all_ or parts:  # what was asked for is the detail
        VERBOSE.set(True)
    certified = "" if out is None else f"stillhook certificate {out / 'certificate.json'} --check"
    step = certified if result.passed else "correct what is refuted or not shown: --steps N prints the tables of a step"
    more = "every criterion, load cases, steps, what is not judged"
    brief = lambda: answer_of(summary(result), step or "--out FOLDER, for report, figures and certificate", more)
    present(to_dict(result), brief=brief, json=json, show=in_full)
    if out is not None:
        from stillhook.validate.certificate.certificate import save_validation

        written = save_validation(result, out, certificate=criteria is None)
        if not json:
            _print_written(out, written)
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


def certificate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="certificate.json that stillhook validate wrote.")],
    check: Annotated[bool, typer.Option("--check", help="Verify it, recomputing everything from the logs.")] = False,
    campaign: Annotated[
        Path | None, typer.Option(help="With --check: campaign file, if it is not next to the certificate.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="With --check: compare hashes only.")] = False,
    json: Json = False,
) -> None:
    """Summary of a certificate; with --check whether it still holds: logs, campaign, criteria, crane and code are
    compared, and everything is recomputed from the logs.

    Exit code 1 where the validation was not passed; with --check where it is not valid or inputs are missing. 2 if the
    file is not a certificate or was changed.

    Example: stillhook certificate validation/certificate.json

    Example: stillhook certificate validation/certificate.json --check
    """
    from stillhook.validate.certificate.certificate import load_certificate

    if check:
        raise typer.Exit(0 if _checked(file, campaign, quick=quick, json=json) else 1)
    refuse({"--campaign": campaign, "--quick": quick}, "belongs to --check. Give it, or leave this out.")
    read = load_certificate(file)
    step, document = f"stillhook certificate {file} --check", read.summary()
    brief = lambda: answer_of(document, step, "every criterion, signature")
    present(read.data, brief=brief, json=json, show=lambda: print_document(document))
    raise typer.Exit(0 if read.passed else 1)


def _checked(file: Path, campaign: Path | None, *, quick: bool, json: bool) -> bool:
    """Print whether a certificate still holds, and return it."""
    from stillhook.validate.certificate.certificate import load_certificate
    from stillhook.validate.certificate.recheck import check

    read = load_certificate(file)
    with progress_bar("checking") as bar:
        result = check(file, read, campaign=campaign, quick=quick, progress=bar)
    present(result.to_dict(), brief=lambda: _answer_of_check(file, result), json=json)
    return bool(result.holds)


def _answer_of_check(file: Path, result: Check) -> Answer:
    """Whether it holds, and the first of what changed, is missing or differs."""
    from stillhook.spec.validity import UNSIGNED

    lines: list[Line] = [result.verdict]
    if result.computed:
        same = "identical to the byte" if result.same_bytes else "not identical to the byte; no number differs"
        if result.where and not result.same_bytes:
            most = number(100.0 * result.largest, 2)
            same = f"not identical to the byte; numbers differ by up to {most} % ({result.where})"
        lines.append(f"Recomputed from the logs: {same}.")
    if result.certificate.data["synthetic"]:
        lines.append("SYNTHETIC: a certificate of simulated logs, not of a real crane")
    found = {"changed": result.changed, "missing": result.missing, "otherwise": result.lines}
    lines += [f"{title}: {line}" for title, of in found.items() for line in of]
    if result.computed and result.same_pdf is not None and result.same_bytes:
        same = "the same to the byte" if result.same_pdf else "not the same: edited, or set with other libraries"
        lines.append(partial(wrapped, f"PDF in the same folder: {same}"))
    lines.append(partial(wrapped, UNSIGNED))
    return Answer(f"{file}", lines, more="signature, PDF")
