"""`stillhook example WHAT OUT`: files to try a command on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from stillhook.cli.parser import Json
from stillhook.errors import CommandError
from stillhook.report.terminal import print_json
from stillhook.units import quote

PLAN, SEA_TRIALS, FRICTION_TESTS, MOTOR_MAP = "plan", "sea-trials", "friction-tests", "motor-map"
EXAMPLES = {
    PLAN: "the example plan, to edit",
    SEA_TRIALS: "SYNTHETIC logs of a crane's tests, for validate",
    FRICTION_TESTS: "SYNTHETIC logs of friction tests, for identify friction",
    MOTOR_MAP: "a SYNTHETIC supplier's map, for identify motor",
}
WHAT_HELP = "; ".join(f"{name}: {text}" for name, text in EXAMPLES.items()) + "."


def example(
    what: Annotated[str, typer.Argument(metavar="WHAT", help=WHAT_HELP)],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder for the files; of motor-map the CSV file.")],
    json: Json = False,
) -> None:
    """Write files to try a command on, to a place where none are yet.

    Example: stillhook example sea-trials my-tests

    Example: stillhook example plan my-lift
    """
    if what not in EXAMPLES:
        raise CommandError(f"example {quote(what)}: choose {', '.join(EXAMPLES)}.")
    answer, lines = _plan(out) if what == PLAN else _map(out) if what == MOTOR_MAP else _campaign(what, out)
    if json:
        print_json(answer)
        return
    for line in lines:
        print(line)


def _plan(out: Path) -> tuple[dict[str, Any], list[str]]:
    from stillhook.plan.file import copy_plan

    first, *rest = copy_plan("template-to-1500m", out)
    written = [str(path) for path in (first, *rest)]
    return {"plan": str(first), "files": written}, [
        f"written: {', '.join(written)}",
        f"edit it, then: stillhook plan {first} --check",
    ]


def _map(out: Path) -> tuple[dict[str, Any], list[str]]:
    from stillhook.library.examples import example_map

    path = example_map(out)
    return {"map": str(path)}, [f"written: {path}, a SYNTHETIC map", f"next: stillhook identify motor {path}"]


def _campaign(what: str, out: Path) -> tuple[dict[str, Any], list[str]]:
    from stillhook.library import examples

    command, folder = {
        SEA_TRIALS: ("validate", examples.SEA_TRIALS),
        FRICTION_TESTS: ("identify friction", examples.FRICTION_TESTS),
    }[what]
    campaign = examples.example_campaign(folder, out)
    reference = campaign.with_name(examples.REFERENCE_FILE)
    logs = sorted(map(str, (out / "logs").iterdir()))
    return {"campaign": str(campaign), "logs": logs, "reference": str(reference)}, [
        examples.MARK,
        f"written: {campaign}, {out / 'logs'}; the crane that was simulated: {reference}",
        f"next: stillhook {command} {campaign} --out {out / 'result'}",
    ]
