"""`stillhook identify example-map` and `example-campaign`: a supplier's map and crane tests to try the commands on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.parser import Json
from stillhook.library.examples import FRICTION_TESTS, MARK, REFERENCE_FILE
from stillhook.library.examples import example_campaign as write_campaign
from stillhook.library.examples import example_map as write_map
from stillhook.report.terminal import print_json

Folder = Annotated[Path, typer.Argument(help="Folder for campaign.toml, the logs and reference.toml.")]


def example_map(
    out: Annotated[Path, typer.Argument(metavar="OUT.csv", help="File to write.")], json: Json = False
) -> None:
    """Write a SYNTHETIC supplier map of a motor to try `identify motor` on; no supplier's map is public.

    Example: stillhook identify example-map example.csv
    """
    path = write_map(out)
    if json:
        print_json({"map": str(path)})
    else:
        print(f"written: {path}, a SYNTHETIC map")


def example_campaign(out: Folder, json: Json = False) -> None:
    """Write the logs of SYNTHETIC friction tests to try `identify friction` on.

    Example: stillhook identify example-campaign my-tests
    """
    write_example(FRICTION_TESTS, out, "identify friction", json=json)


def write_example(example: Path, out: Path, command: str, *, json: bool) -> None:
    """An example campaign into a folder, and what was written there."""
    campaign = write_campaign(example, out)
    reference = campaign.with_name(REFERENCE_FILE)
    if json:
        logs = sorted(map(str, (out / "logs").iterdir()))
        print_json({"campaign": str(campaign), "logs": logs, "reference": str(reference)})
        return
    print(f"{MARK}\nwritten: {campaign}, {out / 'logs'}; the crane that was simulated: {reference}")
    print(f"next: stillhook {command} {campaign} --out {out / 'result'}")
