"""`stillhook certificate`: what a certificate says, whether it still holds, and a campaign to try the whole road on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.crane.cranes import Json
from stillhook.report.running_text import wrapped
from stillhook.report.terminal import print_json, progress_bar

if TYPE_CHECKING:
    from stillhook.validate.certificate.certificate import Certificate
    from stillhook.validate.certificate.recheck import Check

app = typer.Typer(help="Certificates of validated twins: read one, check whether it still holds.", no_args_is_help=True)
File = Annotated[Path, typer.Argument(metavar="FILE", help="certificate.json that stillhook validate wrote.")]


@app.command("show")
def show(file: File, json: Json = False) -> None:
    """What a certificate says, in short. Exit code 1 where the validation was not passed.

    Example: stillhook certificate show validation/certificate.json
    """
    from stillhook.validate.certificate.certificate import load_certificate

    found = load_certificate(file)
    if json:
        print_json(found.data)
    else:
        _show(found)
    raise typer.Exit(0 if found.passed else 1)


def _show(found: Certificate) -> None:
    from stillhook.spec.validity import UNSIGNED

    data, short = found.data, found.short
    mark = "SYNTHETIC " if data["synthetic"] and "SYNTHETIC" not in data["title"] else ""
    wrapped(f"{mark}{data['title']}")
    wrapped(data["verdict"])
    for line in data["decisive"]:
        wrapped(f"{line['verdict']:<10}{line['key']}  {line['text']}", " " * 10)
    wrapped(data["risks"])
    criteria, twin = data["criteria"], data["twin"]
    lengths = [d["duration"] for d in data["data"]]
    rows = [
        ("certificate", f"{found.digest} of {data['date']}"),
        ("crane", f"{data['crane']['name']}: {data['crane']['title']}"),
        ("twin", twin["statement"]),
        ("computed by", f"Stillhook {twin['version']}, code {twin['code']}, method {twin['method']}"),
        ("judged by", f"{criteria['name']} version {criteria['version']}, digest {criteria['digest'][:12]}"),
        ("data", f"{len(lengths)} tests, {sum(lengths):.0f} s, of {data['campaign']['file']}"),
    ]
    if short.envelope is not None:
        rows += [(f"validated: {name}", text) for name, text in short.envelope.says().items()]
    for name, text in rows:
        wrapped(f"{name}: {text}", "  ")
    wrapped(UNSIGNED, "  ")
    print("\nverdict")
    for line in data["lines"]:
        c = line["cells"]
        wrapped(f"{c['verdict']:<10}{c['key']}  {c['what']}: {c['found']}, {c['limit']}", " " * 10)


@app.command("check")
def check(
    file: File,
    campaign: Annotated[
        Path | None, typer.Option(help="Campaign file, where it is not where the certificate says.")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Compare hashes alone, compute nothing again.")] = False,
    json: Json = False,
) -> None:
    """Does a certificate still hold? Logs, campaign, criteria, crane and code compared, and everything computed again
    from the logs.

    Exit code 1 if it does not hold, or what it rests on is missing; 2 if the file is no certificate, or was changed.

    Example: stillhook certificate check validation/certificate.json
    """
    from stillhook.validate.certificate.certificate import load_certificate
    from stillhook.validate.certificate.recheck import check as check_again

    certificate = load_certificate(file)
    with progress_bar("checking") as bar:
        found = check_again(file, certificate, campaign=campaign, quick=quick, progress=bar)
    if json:
        print_json(found.to_dict())
    else:
        _say(found)
    raise typer.Exit(0 if found.holds else 1)


def _say(found: Check) -> None:
    from stillhook.spec.validity import UNSIGNED
    from stillhook.units import number

    wrapped(found.verdict)
    if found.certificate.data["synthetic"]:
        wrapped("SYNTHETIC: a certificate of simulated logs, of no real crane")
    for title, lines in (("changed", found.changed), ("missing", found.missing), ("otherwise", found.lines)):
        for line in lines:
            wrapped(f"{title}: {line}", "  ")
    wrapped(UNSIGNED)
    if not found.computed:
        return
    if found.same_bytes:
        print("computed again: the same to the byte")
    elif found.where:
        print(
            f"computed again: not the same to the byte; numbers differ by up to {number(100.0 * found.largest, 2)} %"
            f" ({found.where})"
        )
    else:
        print("computed again: not the same to the byte; no number differs")
    if found.same_pdf is not None and found.same_bytes:
        print(
            "PDF beside it:"
            f" {'the same to the byte' if found.same_pdf else 'not the same: edited, or set with other libraries'}"
        )


@app.command("example-campaign")
def example_campaign(
    out: Annotated[Path, typer.Argument(help="Folder for campaign.toml, the logs and reference.toml.")],
    seed: Annotated[int, typer.Option(min=0, help="Another seed is another crane, sea and noise.")] = 0,
    defect: Annotated[str | None, typer.Option(help="One thing that is wrong, by name, to see it caught.")] = None,
    size: Annotated[
        str | None, typer.Option(help='Size of the defect, in place of its usual one: 0.03, or "0.2 s" of a time.')
    ] = None,
    crane: Annotated[str, typer.Option(help="Twin under test: library crane, or path of a crane file.")] = "nov-250t",
    apart: Annotated[
        bool, typer.Option("--apart", help="Capacitance, leakage and inertia 10 to 30 % off, to be tuned.")
    ] = False,
    parquet: Annotated[bool, typer.Option("--parquet", help="Logs as Parquet instead of CSV.")] = False,
    json: Json = False,
) -> None:
    """Write validation tests of a simulated crane that is other in detail than its twin. Everything is marked
    SYNTHETIC.

    Example: stillhook certificate example-campaign my-tests --defect leakage
    """
    from stillhook.errors import ValidateError
    from stillhook.library import cranes, load_crane
    from stillhook.units import quote
    from stillhook.validate.synthetic import defect_of, sea_trials, write_campaign
    from stillhook.validate.synthetic.defects import size_of, told

    named = defect_of(defect) if defect is not None else None
    if named is None and size is not None:
        raise ValidateError(f"--size = {quote(size)}: the size of no defect. Name the defect.")
    large = size_of(named, size, "--size") if named is not None and size is not None else None
    plan = sea_trials(crane if crane in cranes() else load_crane(crane))
    with progress_bar(f"{len(plan.tests)} tests") as bar:
        written = write_campaign(
            out, plan=plan, seed=seed, defect=named, size=large, apart=apart, parquet=parquet, progress=bar
        )
    what = told(named, large) if named is not None else "well matched by its twin"
    if json:
        logs, notes = [str(p) for p in written.logs], list(written.notes)
        print_json(
            {
                "campaign": str(written.campaign),
                "logs": logs,
                "truth": str(written.truth),
                "crane": what,
                "notes": notes,
            }
        )
        return
    print(f"SYNTHETIC crane, seed {seed}: {what}; {len(written.logs)} tests")
    for note in written.notes:
        print(note)
    print(f"written: {written.campaign}, {written.folder / 'logs'}; what the crane really is: {written.truth}")
    print(f"next: stillhook validate {written.campaign} --out {written.folder / 'validation'}")
