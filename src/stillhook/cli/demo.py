"""`stillhook demo`: the example plan to its report, or four motions under three controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.simulation.runs import COLUMNS, HEADERS, check_out, print_notes, row, write_comparison
from stillhook.report.terminal import print_table, progress_bar, started

SHOWN = 40.0
"""Last part of each run that its picture shows [s]."""
EXAMPLE = "template-to-1500m"
PLAN, MOTIONS = "plan", "motions"
THREADS = 2
WHAT_HELP = (
    '"plan": a template of 120 t from deck to seabed at 1,500 m, to the report; "motions": NS, HS and SSC on four'
    " motions."
)


def register(app: typer.Typer) -> None:
    app.command("demo")(demo)


def demo(
    what: Annotated[str, typer.Argument(help=WHAT_HELP)] = PLAN,
    out: Annotated[Path, typer.Option("--out", help="Folder for report and pictures.")] = Path("stillhook-demo"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Of the plan: the frequency-domain method only, in seconds.")
    ] = False,
) -> None:
    """In which weather may a template of 120 t go down to 1,500 m, and what does a better controller buy? The example
    plan, to its report.

    Stopped, it goes on where it was when it is run again. Exit codes are those of stillhook plan.

    Example: stillhook demo

    Example: stillhook demo motions
    """
    from stillhook.errors import PlanError
    from stillhook.units import quote

    if what == MOTIONS:
        _motions(out)
        return
    if what != PLAN:
        raise PlanError(f"demo {quote(what)}: is none. Give {PLAN} or {MOTIONS}.")
    from stillhook.cli.plan.plan import run, show
    from stillhook.plan.file import load_plan

    found = run(load_plan(EXAMPLE), "frequency" if quick else "time", None, out, None, None, THREADS)
    show(found, out, json=False)
    raise typer.Exit(0 if found.workable else 1)


def _motions(out: Path) -> None:
    """How still does the 250 t crane keep its hook under NS, HS and SSC? Four motions, table and pictures."""
    from stillhook.analysis.compare import compare as side_by_side
    from stillhook.formats.case_file import demo_cases

    check_out(out)
    cases = demo_cases()
    rows, results = [], []
    for file in cases:
        with progress_bar(file.case.name) as bar:
            result = side_by_side(file.crane, file.case, progress=started(file.crane, bar, series=True))
        results.append((file.case.name, result))
        rows += [[file.case.name if i == 0 else "", r.mode.value, *row(r.summary)] for i, r in enumerate(result.runs)]
    crane, case = cases[0].crane, cases[0].case
    from stillhook.units import show

    title = f"{crane.title}: {show(case.load, 'mass')} on the hook, {show(case.s_w, 'length')} of wire out"
    print_table(["motion of the crane tip", "mode", *(HEADERS[c] for c in COLUMNS)], rows, title=title, left=2)
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
