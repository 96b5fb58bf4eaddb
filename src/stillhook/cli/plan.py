"""`stillhook plan` and `stillhook report`: limits of a lift, and the report of a saved plan."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.base.extras import need
from stillhook.cli.parser import FACTORS_HELP, Json, Scheduler, announce, check_out, client_of, refuse, say_left_out
from stillhook.errors import PlanError
from stillhook.report.formatting import wrapped
from stillhook.report.terminal import print_document, print_json, progress_bar, say, say_if_compiling

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
    " animation in a folder of --out. A plan that --out holds is not computed again."
)
SEED_HELP = (
    "Each seed gives the runs of the twin other waves of the same seas: two plans show by how much limits scatter."
)


def plan(
    lift: Annotated[
        str,
        typer.Argument(metavar="LIFT.toml", help="Plan file, or one of the library's; a wrong name lists them."),
    ],
    check: Annotated[bool, typer.Option("--check", help="Check the plan and print its content; run nothing.")] = False,
    tier: Annotated[str | None, typer.Option(help=TIER_HELP)] = None,
    quick: Annotated[bool, typer.Option("--quick", help="The same as --tier frequency.")] = False,
    alpha: Annotated[str | None, typer.Option("--forecast-factors", help=FACTORS_HELP)] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for report (PDF, HTML), plan.nc and plan.json.")
    ] = None,
    store: Annotated[Path | None, typer.Option("--store", help=STORE_HELP)] = None,
    scheduler: Scheduler = None,
    threads: Annotated[int, typer.Option(min=1, max=256, help="Cores of this machine to use.")] = 2,
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
    if cell is not None:
        refuse({"--check": check, "--quick": quick}, "no run of the twin is made, and --cell writes one. Leave it out.")
        if tier not in (None, "time") or out is None:
            raise PlanError("--cell: is a run of the twin, in a folder of --out. Give --out, and leave --tier out.")
        _show_cell(lift_plan, cell, alpha, out, store or out / "runs", scheduler, threads, seed, json=json)
        raise typer.Exit(0)
    if check:
        raise typer.Exit(0 if _show_check(lift_plan, json=json) else 1)
    if quick and tier not in (None, "frequency"):
        raise PlanError(f"--quick with --tier {tier}: --quick is --tier frequency. Leave one of them out.")
    result = run(lift_plan, "frequency" if quick else tier or "time", alpha, out, store, scheduler, threads, seed)
    show(result, out, json=json)
    raise typer.Exit(0 if result.workable and not result.failed else 1)


def _show_check(lift_plan: LiftPlan, *, json: bool) -> bool:
    """What the plan requests; nothing is run. Whether still water keeps all rules under some alternative."""
    from stillhook.plan.report.checked import checked, checked_plan, possible

    answer = checked(lift_plan)
    if json:
        print_json(answer)
    else:
        print_document(checked_plan(answer))
    return possible(answer)


def _show_cell(
    lift_plan: LiftPlan,
    text: str,
    alpha: str | None,
    out: Path,
    store: Path,
    scheduler: str | None,
    threads: int,
    seed: int,
    *,
    json: bool,
) -> None:
    """The run that governs a cell: its lift file, lowered, with pictures and animation, in a folder of `out`."""
    from stillhook.plan.answer.cell_run import governing_run, lowered
    from stillhook.plan.answer.governing import answer_in, governing, wanted
    from stillhook.plan.tiers.time_domain.cells import Execution

    ask = wanted(text, lift_plan)
    answer = None if ask.complete else answer_in(out, lift_plan, seed)
    if answer is None and not ask.complete:
        answer = run(lift_plan, "time", alpha, out, store, scheduler, threads, seed)
    governs = governing(lift_plan, answer, ask)
    with client_of(scheduler) as client, progress_bar(f"{lift_plan.name}: {ask.text}") as bar:
        found = governing_run(lift_plan, governs, ask, Execution(store, client, threads, seed), bar)
    folder = out / found.folder
    say(f"lowering {found.of.phase.name} again, and drawing it ...")
    written = lowered(found, folder)
    if json:
        print_json(
            {**found.facts(), "repeats": written.repeats, "files": [str(folder / name) for name in written.files]}
        )
        return
    wrapped(found.line)
    wrapped(written.line)
    announce(folder, written.files)
    say_left_out()


def run(
    lift_plan: LiftPlan,
    tier: str,
    alpha: str | None,
    out: Path | None,
    store: Path | None,
    scheduler: str | None,
    threads: int,
    seed: int = 0,
) -> PlanResult:
    """The plan's result, with its files written where requested."""
    from stillhook.plan.planning import plan as planned
    from stillhook.plan.planning import tier_of
    from stillhook.plan.report.document import OUT_FILES, write_answer

    options: dict[str, Any] = {"seed": seed} | ({} if alpha is None else {"alpha": alpha})
    last = tier_of(tier)
    check_out(out, OUT_FILES)
    if out is not None:
        store = out / "runs" if store is None else store
    _say_before(lift_plan, last, store)
    with client_of(scheduler) as client, progress_bar(f"{lift_plan.name}: planning") as bar:
        result = planned(lift_plan, tier=last, store=store, client=client, threads=threads, progress=bar, **options)
    if out is not None:
        write_answer(result, out)
    return result


def _say_before(lift_plan: LiftPlan, last: Tier, store: Path | None) -> None:
    """Announce steps that take time before they start."""
    from stillhook.plan.definition.rules import Tier

    if last is not Tier.CLOSED_FORM:
        say_if_compiling(lift_plan.crane)
    if last is Tier.TIME:
        from stillhook.engine.lowering.run import ON_SLINGS
        from stillhook.plan.tiers.time_domain.placing import usual_runs

        say_if_compiling(lift_plan.crane, setup=ON_SLINGS)
        resume_note = (
            f"; completed runs are kept in {store}, and a stopped plan resumes from there" if store is not None else ""
        )
        runs = f"some {usual_runs(lift_plan):,} runs of the twin{resume_note}"
        say(textwrap.fill(runs, WIDTH, break_on_hyphens=False, break_long_words=False))


def show(result: PlanResult, out: Path | None, *, json: bool) -> None:
    """The answer on the terminal."""
    if json:
        print_json(result.facts)
        return
    from stillhook.plan.report.document import OUT_FILES, brief

    print_document(brief(result))
    if out is not None:
        announce(out, [name for name in OUT_FILES if (out / name).is_file()])
        say_left_out(pdf=True)


WIDTH = 98
"""Width of lines that are wrapped."""
Results = Annotated[Path, typer.Argument(metavar="RESULTS", help="Folder that stillhook plan --out wrote.")]
Out = Annotated[Path | None, typer.Option(help="Folder for the report, in place of that of the results.")]
Figures = Annotated[bool, typer.Option("--figures", help="Also write every figure as a separate PNG.")]


def report(results: Results, out: Out = None, figures: Figures = False, json: Json = False) -> None:
    """Write report.pdf and report.html of a lift plan from its saved results; nothing is computed again.

    The same results give the same bytes. Exit code 1 where the plan found no workable sea.

    Example: stillhook report my-plan
    """
    from stillhook.plan.answer.saved import PLAN_FILES, load_plan_result
    from stillhook.plan.report.document import check, save_report
    from stillhook.plan.report.summary_page import verdict

    if figures:
        need("matplotlib", "--figures", PlanError)
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
        announce(folder, names)
    say_left_out(pdf=True)
    raise typer.Exit(0 if answer.passed else 1)
