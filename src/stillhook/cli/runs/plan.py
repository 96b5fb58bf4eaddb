"""`stillhook plan` and `stillhook report`: limits of a lift, and the report of a saved plan."""

from __future__ import annotations

import textwrap
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from stillhook.base.extras import need
from stillhook.cli.groups import WRITES
from stillhook.cli.parser import (
    FACTORS_HELP,
    Json,
    Out,
    announce,
    check_out,
    client_of,
    present,
    refuse,
    say_left_out,
)
from stillhook.errors import PlanError
from stillhook.report.formatting import argument, wrapped
from stillhook.report.terminal import (
    Answer,
    first_sentence,
    print_document,
    progress_bar,
    say,
    say_if_compiling,
)

if TYPE_CHECKING:
    from stillhook.plan.definition.lift_plan import LiftPlan
    from stillhook.plan.definition.rules import Tier
    from stillhook.plan.result import PlanResult


TIER_HELP = (
    "How far to go: closed-form (a standard's formulas), frequency (seconds), time (default: the twin in the loop near"
    " the limits)."
)
STORE_HELP = (
    "Folder in which runs of the twin are kept: a stopped plan resumes from there. Default: runs in the --out folder."
)
CELL_HELP = (
    'The run that governs a cell, "Tp=9 s, heading=165 deg" (and Hs=, alternative=, phase=), as a lift file with its'
    " film in a folder of --out. A plan that --out holds is not computed again."
)
WORKERS_HELP = 'Cores of this machine to use, or the address of a Dask scheduler, "tls://10.0.0.1:8786".'
MOST_THREADS = 256
SEED_HELP = (
    "Each seed gives the runs of the twin other waves of the same seas: two plans show by how much limits scatter."
)


def plan(
    lift: Annotated[
        str,
        typer.Argument(metavar="LIFT.toml", help="Plan file, or one of the library's; a wrong name lists them."),
    ],
    check: Annotated[bool, typer.Option("--check", help="Check the plan and print its content; run nothing.")] = False,
    tier: Annotated[str, typer.Option(help=TIER_HELP)] = "time",
    alpha: Annotated[str | None, typer.Option("--forecast-factors", help=FACTORS_HELP)] = None,
    out: Out = None,
    store: Annotated[Path | None, typer.Option("--store", help=STORE_HELP)] = None,
    workers: Annotated[str, typer.Option(help=WORKERS_HELP)] = "2",
    seed: Annotated[int, typer.Option(min=0, help=SEED_HELP)] = 0,
    cell: Annotated[str | None, typer.Option("--cell", help=CELL_HELP)] = None,
    json: Json = False,
) -> None:
    """Limiting sea states of a lift for every alternative of the winch, the governing criteria, waiting on weather, and
    the gain of each alternative.

    Limits are reported twice: as calculated by the model of each alternative, and as credited, which is no more
    than with a flat 80 % of compensation where no certificate covers the twin. A stopped plan resumes with the same
    --store or --out.

    Exit code 1 where no sea of the table is workable under any alternative (--check: where still water is beyond a
    rule under all of them), the weather never gives a window, or something could not be computed after the runs.

    Example: stillhook plan template-to-1500m --out plan

    Example: stillhook plan template-to-1500m --out plan --cell "Tp=9 s, heading=165 deg"
    """
    from stillhook.plan.file import load_plan

    lift_plan = load_plan(lift)
    threads, scheduler = _workers(workers)
    work = Work(alpha, out, out / "runs" if store is None and out is not None else store, scheduler, threads, seed)
    if cell is not None:
        refuse({"--check": check}, "no run of the twin is made, and --cell writes one. Leave it out.")
        if tier != "time" or out is None:
            raise PlanError("--cell: is a run of the twin, in a folder of --out. Give --out, and leave --tier out.")
        _show_cell(lift_plan, cell, work, json=json)
        raise typer.Exit(0)
    if check:
        raise typer.Exit(0 if _show_check(lift_plan, lift, json=json) else 1)
    result = run(lift_plan, tier, work)
    show(result, out, lift, tier, json=json)
    raise typer.Exit(0 if result.workable and not result.failed else 1)


class Work(NamedTuple):
    """How a plan is computed: factors on forecast heights, folders of results and of runs, Dask scheduler or cores of
    this machine, seed of the waves."""

    alpha: str | None = None
    out: Path | None = None
    store: Path | None = None
    scheduler: str | None = None
    threads: int = 2
    seed: int = 0


def _workers(text: str) -> tuple[int, str | None]:
    """Cores of this machine, and the address of a scheduler where that is named in place of their number."""
    number = text.strip().lstrip("+-").isdigit()
    if number and not 1 <= int(text) <= MOST_THREADS:
        raise PlanError(f"--workers {text}: give 1 to {MOST_THREADS} cores, or the address of a Dask scheduler.")
    return (int(text), None) if number else (2, text)


def _show_check(lift_plan: LiftPlan, file: str, *, json: bool) -> bool:
    """What the plan requests; nothing is run. Whether still water keeps all rules under some alternative."""
    from stillhook.plan.report.checked import brief, check

    result = check(lift_plan)
    show, step = lambda: print_document(result.document()), f"stillhook plan {argument(file)} --tier frequency"
    present(result.facts, brief=lambda: brief(result.facts, step), json=json, show=show)
    return result.possible


def _show_cell(lift_plan: LiftPlan, text: str, work: Work, *, json: bool) -> None:
    """The run that governs a cell: its lift file, lowered, with pictures and film, in a folder of `out`."""
    from stillhook.plan.answer.cell_run import answer_in, governing, governing_run, lowered, wanted
    from stillhook.plan.tiers.time_domain.cells import Execution

    ask = wanted(text, lift_plan)
    assert work.out is not None
    answer = None if ask.complete else answer_in(work.out, lift_plan, work.seed)
    if answer is None and not ask.complete:
        answer = run(lift_plan, "time", work)
    governs = governing(lift_plan, answer, ask)
    with client_of(work.scheduler) as client, progress_bar(f"{lift_plan.name}: {ask.text}") as bar:
        execution = Execution(work.store, client, work.threads, work.seed)
        selected = governing_run(lift_plan, governs, ask, execution, bar)
    folder = work.out / selected.folder
    say(f"lowering {selected.of.phase.name} again, and drawing it ...")
    written = lowered(selected, folder)
    files = [str(folder / name) for name in written.files]

    step = f"stillhook lower {argument(folder / written.files[0])}, to run it again"
    cell_answer = Answer(f"{lift_plan.name}: {ask.text}", [selected.line, written.line], step)
    present({**selected.facts(), "repeats": written.repeats, "files": files}, brief=lambda: cell_answer, json=json)
    announce(folder, written.files, quiet=json)
    if not json:
        say_left_out()


def run(lift_plan: LiftPlan, tier: str, work: Work) -> PlanResult:
    """The plan's result, with its files written where requested."""
    from stillhook.plan.planning import plan as planned
    from stillhook.plan.planning import tier_of
    from stillhook.plan.report.document import OUT_FILES, write_answer

    options: dict[str, Any] = {"seed": work.seed, "store": work.store, "threads": work.threads}
    options |= {} if work.alpha is None else {"alpha": work.alpha}
    last = tier_of(tier)
    check_out(work.out, OUT_FILES)
    with client_of(work.scheduler) as client, progress_bar(f"{lift_plan.name}: planning") as bar:
        _say_before(lift_plan, last, work.store)
        result = planned(lift_plan, tier=last, client=client, progress=bar, **options)
    if work.out is not None:
        write_answer(result, work.out)
    return result


def _say_before(lift_plan: LiftPlan, last: Tier, store: Path | None) -> None:
    """Announce steps that take time before they start."""
    from stillhook.plan.definition.rules import Tier

    if last is not Tier.CLOSED_FORM:
        say_if_compiling(lift_plan.crane)
    if last is Tier.TIME:
        from stillhook.engine.lowering.run import setup_of
        from stillhook.plan.tiers.time_domain.placing import usual_runs

        say_if_compiling(lift_plan.crane, setup=setup_of(lift_plan.hanging(0.0)))
        resume_note = (
            f"; completed runs are kept in {store}, and a stopped plan resumes from there" if store is not None else ""
        )
        runs = f"some {usual_runs(lift_plan):,} runs of the twin{resume_note}"
        say(textwrap.fill(runs, WIDTH, break_on_hyphens=False, break_long_words=False))


def show(result: PlanResult, out: Path | None, file: str, tier: str, *, json: bool) -> None:
    """The answer on the terminal."""
    from stillhook.plan.report.document import OUT_FILES, brief

    in_full = lambda: print_document(brief(result))
    present(result.facts, brief=lambda: _answer(result, _next(out, file, tier)), json=json, show=in_full)
    if out is not None and not json:
        announce(out, [name for name in OUT_FILES if (out / name).is_file()])
        say_left_out(pdf=True)


def _next(out: Path | None, file: str, tier: str) -> str:
    if tier != "time":
        return f"stillhook plan {argument(file)} --out plan, with the twin in the loop"
    if out is None:
        return f"stillhook plan {argument(file)} --out plan, for the report"
    return f"stillhook weather forecast FORECAST.csv --plan {out}, for go or no-go"


def _answer(result: PlanResult, step: str) -> Answer:
    """The claimable limit, the status, what governs, times, and waiting."""
    from stillhook.plan.report.decision.short import short
    from stillhook.plan.report.document import brief
    from stillhook.plan.report.limits_summary import waiting
    from stillhook.plan.report.words import CREDITED
    from stillhook.report.document import Table

    notes = len([part for part in brief(result).front if isinstance(part, Table)])
    lines, waits = short(result), map(first_sentence, waiting(result, brief=True))
    at = len(lines) if result.claim == CREDITED else 2  # beside a credit that may not be claimed, after the status
    lines[at:at] = waits
    return Answer(result.name, lines, step, f"simulated limits, every period and alternative in {notes} tables")


WIDTH = 98
"""Width of lines that are wrapped."""


def report(
    results: Annotated[Path, typer.Argument(metavar="RESULTS", help="Folder that stillhook plan --out wrote.")],
    out: Annotated[Path | None, typer.Option(help="Folder for the report, in place of that of the results.")] = None,
    figures: Annotated[bool, typer.Option("--figures", help="Also write every figure as a separate PNG.")] = False,
    json: Json = False,
) -> None:
    """Write report, decision page and limits card of a lift plan from its saved results; nothing is computed again.

    The same results give the same bytes. Exit code 1 where the plan has no workable sea.

    Example: stillhook report my-plan
    """
    from stillhook.plan.report.decision.short import short
    from stillhook.plan.report.document import save_report
    from stillhook.plan.report.limits_summary import verdict
    from stillhook.plan.result import PLAN_FILES, load_plan_result

    if figures:
        need("matplotlib", "--figures", PlanError)
    result = load_plan_result(results)
    folder = out or (results.parent if results.name in PLAN_FILES else results)
    say("drawing and setting the report ...")
    WRITES.set(True)
    names = save_report(result, folder, figures=figures)
    answer, lines = verdict(result), short(result)
    data = {
        "name": result.name,
        "answer": lines[0],
        "status": lines[1],
        "files": [str(folder / name) for name in names],
    }
    brief = _answer(result, f"read {folder / names[0]}")
    in_full = [partial(wrapped, text) for text in (answer.word, *answer.text)]
    present(data, brief=lambda: replace(brief, lines=[*brief.lines, *in_full]), json=json)
    announce(folder, names, quiet=json)
    say_left_out(pdf=True)
    raise typer.Exit(0 if answer.passed else 1)
