"""`stillhook demo`: the example plan to its report, or four motions under three controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.parser import check_out
from stillhook.cli.simulation import OUT_FILES, headers, print_notes, row, write_comparison
from stillhook.errors import PlanError
from stillhook.report.terminal import print_table, progress_bar, started
from stillhook.units import quote, show

SHOWN = 40.0
"""Last part of each run that its picture shows [s]."""
EXAMPLE = "template-to-1500m"
PLAN, MOTIONS = "plan", "motions"
THREADS = 2
EXAMPLE_HELP = (
    '"plan": a template of 120 t from deck to seabed at 1,500 m, to the report; "motions": NS, HS and SSC on four'
    " motions."
)


def demo(
    example: Annotated[str, typer.Argument(help=EXAMPLE_HELP)] = PLAN,
    out: Annotated[Path, typer.Option("--out", help="Folder for report and pictures.")] = Path("stillhook-demo"),
    quick: Annotated[bool, typer.Option("--quick", help="Plan: frequency-domain method only, in seconds.")] = False,
) -> None:
    """Limiting weather for lowering a template of 120 t to 1,500 m, and the benefit of a better controller: the example
    plan, to its report.

    An interrupted run continues where it stopped when it is started again. Exit codes are those of stillhook plan.

    Example: stillhook demo

    Example: stillhook demo motions
    """
    if example == MOTIONS:
        _motions(out)
        return
    if example != PLAN:
        raise PlanError(f"Unknown example {quote(example)}. Choose {PLAN} or {MOTIONS}.")
    from stillhook.cli.plan import run, show
    from stillhook.plan.file import load_plan

    result = run(load_plan(EXAMPLE), "frequency" if quick else "time", None, out, None, None, THREADS)
    show(result, out, json=False)
    raise typer.Exit(0 if result.workable else 1)


def _motions(out: Path) -> None:
    """Control error of the 250 t crane under NS, HS and SSC: Four motions, table and pictures."""
    from stillhook.analysis.controllers import compare as side_by_side
    from stillhook.formats.case_file import demo_cases

    check_out(out, OUT_FILES)
    cases = demo_cases()
    rows, results = [], []
    for file in cases:
        with progress_bar(file.case.name) as bar:
            result = side_by_side(file.crane, file.case, progress=started(file.crane, bar, series=True))
        results.append((file.case.name, result))
        rows += [
            [file.case.name if i == 0 else "", r.mode.value, *row(file.crane, r.summary)]
            for i, r in enumerate(result.runs)
        ]
    crane, case = cases[0].crane, cases[0].case

    title = f"{crane.title}: {show(case.load, 'mass')} on the hook, {show(case.s_w, 'length')} of wire out"
    print_table(["motion of the crane tip", "mode", *headers(crane)], rows, title=title, left=2)
    print(
        "NS and HS: classic control, fixed motors, normal and high speed. SSC: semi-secondary control, motors move with"
        " the pumps."
    )
    for name, result in results:
        print_notes({f"{name}, {mode}": s for mode, s in result.table().items()})
    for name, result in results:
        stem, last = name.split(":")[0].replace(" ", "-"), result.runs[0].case.duration
        write_comparison(result, out / stem, quiet=True, start=last - SHOWN)
    print(f"pictures, series and summaries: {out.resolve()}")
