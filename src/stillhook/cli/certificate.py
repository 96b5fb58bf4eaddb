"""`stillhook certificate`: what a certificate says, and whether it still holds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.cranes import Json
from stillhook.cli.show import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from stillhook.validate.certificate import Certificate
    from stillhook.validate.certificate_check import Check

app = typer.Typer(help="Certificates of validated twins: read one, check whether it still holds.", no_args_is_help=True)
File = Annotated[Path, typer.Argument(metavar="FILE", help="certificate.json that stillhook validate wrote.")]


@app.command("show")
def show(file: File, json: Json = False) -> None:
    """What a certificate says, in short. Exit code 1 where the validation was not passed.

    Example: stillhook certificate show validation/certificate.json
    """
    from stillhook.validate.certificate import load_certificate

    found = load_certificate(file)
    if json:
        print_json(found.data)
    else:
        _show(found)
    raise typer.Exit(0 if found.passed else 1)


def _show(found: Certificate) -> None:
    data, short = found.data, found.short
    mark = "SYNTHETIC " if data["synthetic"] and "SYNTHETIC" not in data["title"] else ""
    print(f"{mark}{data['title']}")
    print(data["verdict"])
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
    width = max(len(name) for name, _ in rows)
    for name, text in rows:
        print(f"{name:<{width}}  {text}")
    cells = [line["cells"] for line in data["lines"]]
    head = ("", "criterion", "found", "limit", "verdict")
    print_table(head, [[c["key"], c["what"], c["found"], c["limit"], c["verdict"]] for c in cells], title="Verdict", left=5)


@app.command("check")
def check(
    file: File,
    campaign: Annotated[Path | None, typer.Option(help="Campaign file, where it is not where the certificate says.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Compare hashes alone, compute nothing again.")] = False,
    json: Json = False,
) -> None:
    """Does a certificate still hold? Logs, campaign, criteria, crane and code compared, and everything computed again from the logs.

    Exit code 1 if it does not hold, or what it rests on is missing; 2 if the file is no certificate, or was changed.

    Example: stillhook certificate check validation/certificate.json
    """
    from stillhook.validate.certificate import load_certificate
    from stillhook.validate.certificate_check import check as check_again

    certificate = load_certificate(file)
    with progress_bar("checking") as bar:
        found = check_again(file, certificate, campaign=campaign, quick=quick, progress=bar)
    if json:
        print_json(found.to_dict())
    else:
        _say(found)
    raise typer.Exit(0 if found.holds else 1)


def _say(found: Check) -> None:
    from stillhook.units import number

    print(found.verdict)
    for title, lines in (("changed", found.changed), ("missing", found.missing), ("verdict line", found.lines)):
        for line in lines:
            print(f"{title}: {line}")
    if not found.computed:
        return
    if found.same_bytes:
        print("computed again: the same to the byte")
    elif found.where:
        print(f"computed again: not the same to the byte; numbers differ by {number(found.largest, 2)} at most (of {found.where})")
    else:
        print("computed again: not the same to the byte; no number differs")
    if found.same_pdf is not None:
        print(f"PDF beside it: {'the same to the byte' if found.same_pdf else 'not the same (other library versions set it otherwise)'}")
