"""`stillhook report`: the PDF and the page of a plan, from its saved results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.options import Json
from stillhook.report.running_text import wrapped
from stillhook.report.terminal import print_json, say

Results = Annotated[Path, typer.Argument(metavar="RESULTS", help="Folder that stillhook plan --out wrote.")]
Out = Annotated[Path | None, typer.Option(help="Folder for the report, in place of that of the results.")]
Figures = Annotated[bool, typer.Option("--figures", help="Every figure as a PNG of its own, too.")]


def register_report(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command("report")(report)


def report(results: Results, out: Out = None, figures: Figures = False, json: Json = False) -> None:
    """Write report.pdf and report.html of a lift plan from its saved results; nothing is computed again.

    The same results give the same bytes. Exit code 1 where the plan found no workable sea.

    Example: stillhook report my-plan
    """
    from stillhook.plan.answer.files import PLAN_FILES, load_plan_result
    from stillhook.plan.report.save import check, save_report
    from stillhook.plan.report.summary_page import verdict

    result = load_plan_result(results)
    folder = out or (results.parent if results.name in PLAN_FILES else results)
    check(result)
    say("drawing and setting the report ...")
    names = save_report(result, folder, figures=figures)
    answer = verdict(result)
    if json:
        print_json({"name": result.name, "answer": answer.word, "files": [str(folder / name) for name in names]})
    else:
        print(f"{result.name}: {answer.word}")
        for line in answer.text:
            wrapped(line, "  ")
        print(f"written: {', '.join(str(folder / name) for name in names)}")
    raise typer.Exit(0 if answer.passed else 1)
