"""`stillhook validate` and `stillhook certificate`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.parser import Json, say_left_out
from stillhook.errors import ValidateError
from stillhook.report.formatting import wrapped
from stillhook.report.terminal import print_document, print_json, progress_bar
from stillhook.units import number, quote

if TYPE_CHECKING:
    from stillhook.validate.certificate.recheck import Check
    from stillhook.validate.criteria.results import StepNumber
    from stillhook.validate.validation import Validation


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
        from stillhook.validate.report.document import to_dict

        print_json(to_dict(result))
    else:
        from stillhook.validate.report.document import summary

        parts = numbers is not None
        print_document(summary(result, tables=parts, everything=all_ or parts))
    if out is not None:
        from stillhook.validate.certificate.save import save_validation

        written = save_validation(result, out, certificate=criteria is None)
        if not json:
            _print_written(out, written)
        say_left_out(pdf=True)
    if not json:
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
    from stillhook.validate.certificate.save import REPORT

    pictures = [name for name in written if name.endswith(".png")]
    rest = [name for name in written if name not in pictures and name != REPORT]
    figures = [f"{len(pictures)} figures"] if pictures else []
    wrapped(f"written to {out}: {REPORT} (read this), {', '.join([*rest, *figures])}")


def _print_missing(validation: Validation, out: Path | None, criteria: str | None) -> None:
    """Outputs not written, and how to get them."""
    if out is None and validation.complete:
        wrapped("every line in full: --all; report, figures and certificate: --out FOLDER; tables of a step: --steps 4")
    elif criteria is not None and validation.complete:
        wrapped(
            "no certificate with --criteria: name the criteria in the campaign file, so that it can be checked later"
        )


app = typer.Typer(no_args_is_help=True)
File = Annotated[Path, typer.Argument(metavar="FILE", help="certificate.json that stillhook validate wrote.")]


@app.command("show")
def show(file: File, json: Json = False) -> None:
    """Summary of a certificate. Exit code 1 where the validation was not passed.

    Example: stillhook certificate show validation/certificate.json
    """
    from stillhook.validate.certificate.certificate import load_certificate

    certificate = load_certificate(file)
    if json:
        print_json(certificate.data)
    else:
        print_document(certificate.summary())
    raise typer.Exit(0 if certificate.passed else 1)


@app.command("check")
def check(
    file: File,
    campaign: Annotated[
        Path | None, typer.Option(help="Campaign file, if it is not found next to the certificate.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Compare hashes only, without recomputation.")] = False,
    json: Json = False,
) -> None:
    """Verify a certificate: compare logs, campaign, criteria, crane and code, and recompute everything from the
    logs.

    Exit code 1 if it is not valid or inputs are missing; 2 if the file is not a certificate or was changed.

    Example: stillhook certificate check validation/certificate.json
    """
    from stillhook.validate.certificate.certificate import load_certificate
    from stillhook.validate.certificate.recheck import check as check_again

    certificate = load_certificate(file)
    with progress_bar("checking") as bar:
        result = check_again(file, certificate, campaign=campaign, quick=quick, progress=bar)
    if json:
        print_json(result.to_dict())
    else:
        _say(result)
    raise typer.Exit(0 if result.holds else 1)


def _say(result: Check) -> None:
    from stillhook.spec.validity import UNSIGNED

    wrapped(result.verdict)
    if result.certificate.data["synthetic"]:
        wrapped("SYNTHETIC: a certificate of simulated logs, not of a real crane")
    for title, lines in (("changed", result.changed), ("missing", result.missing), ("otherwise", result.lines)):
        for line in lines:
            wrapped(f"{title}: {line}", "  ")
    wrapped(UNSIGNED)
    if not result.computed:
        return
    if result.same_bytes:
        print("recomputed: identical to the byte")
    elif result.where:
        print(
            f"recomputed: not identical to the byte; numbers differ by up to {number(100.0 * result.largest, 2)} %"
            f" ({result.where})"
        )
    else:
        print("recomputed: not identical to the byte; no number differs")
    if result.same_pdf is not None and result.same_bytes:
        print(
            "PDF in the same folder:"
            f" {'the same to the byte' if result.same_pdf else 'not the same: edited, or set with other libraries'}"
        )


@app.command("example-campaign")
def example_campaign(
    out: Annotated[Path, typer.Argument(help="Folder for campaign.toml, the logs and truth.toml.")],
    seed: Annotated[int, typer.Option(min=0, help="Each seed gives another crane, sea and noise.")] = 0,
    defect: Annotated[str | None, typer.Option(help="Name of one defect to include.")] = None,
    size: Annotated[
        str | None, typer.Option(help='Size of the defect, in place of its usual one: 0.03, or "0.2 s" of a time.')
    ] = None,
    crane: Annotated[str, typer.Option(help="Twin under test: library crane, or path of a crane file.")] = "nov-250t",
    apart: Annotated[
        bool, typer.Option("--apart", help="Capacitance, leakage and inertia deviate by 10 to 30 %, for tuning.")
    ] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="Logs as Parquet instead of CSV.")] = False,
    json: Json = False,
) -> None:
    """Write validation tests of a simulated crane that differs in detail from its twin. Everything is marked
    SYNTHETIC.

    Example: stillhook certificate example-campaign my-tests --defect leakage
    """
    from stillhook.library import cranes, load_crane
    from stillhook.validate.synthetic import defect_of, trials, write_campaign
    from stillhook.validate.synthetic.defects import defect_text, size_of

    named = defect_of(defect) if defect is not None else None
    if named is None and size is not None:
        raise ValidateError(f"--size = {quote(size)}: a size needs a defect. State the defect.")
    large = size_of(named, size, "--size") if named is not None and size is not None else None
    plan = trials(crane if crane in cranes() else load_crane(crane))
    with progress_bar(f"{len(plan.tests)} tests") as bar:
        written = write_campaign(
            out, plan=plan, seed=seed, defect=named, size=large, apart=apart, parquet=parquet, progress=bar
        )
    text = defect_text(named, large) if named is not None else "well matched by its twin"
    if json:
        logs, notes = [str(p) for p in written.logs], list(written.notes)
        print_json(
            {
                "campaign": str(written.campaign),
                "logs": logs,
                "reference": str(written.reference),
                "crane": text,
                "notes": notes,
            }
        )
        return
    print(f"SYNTHETIC crane, seed {seed}: {text}; {len(written.logs)} tests")
    for note in written.notes:
        print(note)
    print(
        f"written: {written.campaign}, {written.folder / 'logs'}; parameters of the simulated crane:"
        f" {written.reference}"
    )
    print(f"next: stillhook validate {written.campaign} --out {written.folder / 'validation'}")
