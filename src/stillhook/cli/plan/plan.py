"""`stillhook plan`: in which weather a lift may be done, what limits it, how long one waits, and what a better
controller buys."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.cluster import Scheduler, client_of
from stillhook.cli.options import Json
from stillhook.report.running_text import wrapped
from stillhook.report.terminal import print_json, print_table, progress_bar, say, say_if_compiling

if TYPE_CHECKING:
    from stillhook.plan.definition.demand import Tier
    from stillhook.plan.definition.lift_plan import LiftPlan
    from stillhook.plan.result.result import PlanResult

TIER_HELP = (
    "How far to go: closed-form (a standard's formulas), frequency (seconds), time (default: the twin in the loop near"
    " the limits)."
)
STORE_HELP = (
    "Folder in which runs of the twin are kept: a stopped plan resumes from there. Default: runs in the --out folder."
)
EXAMPLE = "example"
LEAST = 1e-3
"""Shares below it are printed as 0."""
HOURS = 365.25 * 24.0
"""Of a year."""


def register(app: typer.Typer) -> None:
    app.command("plan")(plan)


def plan(
    lift: Annotated[
        str,
        typer.Argument(metavar="LIFT.toml", help='Plan file, or one of the library\'s; "example" copies the example.'),
    ],
    folder: Annotated[Path | None, typer.Argument(metavar="DIR", help='After "example": folder for the copy.')] = None,
    check: Annotated[bool, typer.Option("--check", help="Check the plan and print its content; run nothing.")] = False,
    tier: Annotated[str | None, typer.Option(help=TIER_HELP)] = None,
    quick: Annotated[bool, typer.Option("--quick", help="The same as --tier frequency.")] = False,
    alpha: Annotated[str | None, typer.Option(help="Table of forecast factors: a name, or a TOML file.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for report (PDF, HTML), plan.nc and plan.json.")
    ] = None,
    store: Annotated[Path | None, typer.Option("--store", help=STORE_HELP)] = None,
    scheduler: Scheduler = None,
    threads: Annotated[int, typer.Option(min=1, max=256, help="Cores of this machine to use.")] = 2,
    json: Json = False,
) -> None:
    """Limiting sea states of a lift for every alternative of the winch, the governing criteria, waiting on weather, and
    the gain of each alternative.

    Limits are reported twice: as calculated by the model of each alternative, and as credited, which is no more
    than with a flat 80 % of compensation where no certificate covers the twin. A stopped plan resumes with the same
    --store or --out.

    Exit code 1 where no sea of the table is workable under any alternative, or the weather never gives a window.

    Example: stillhook plan template-to-1500m --out plan

    Example: stillhook plan example my-lift
    """
    from stillhook.errors import PlanError
    from stillhook.plan.file import load_plan

    if lift == EXAMPLE:
        if folder is None:
            raise PlanError('plan example: no folder for the copy. Enter one, such as "my-lift".')
        _copy(folder)
        return
    if folder is not None:
        raise PlanError(
            f'{folder}: unexpected argument. One plan is run at a time; a folder follows "example" only. Use --out for'
            " results."
        )
    lift_plan = load_plan(lift)
    if check:
        from stillhook.cli.plan.check import print_check

        print_check(lift_plan, json)
        return
    if quick and tier not in (None, "frequency"):
        raise PlanError(f"--quick with --tier {tier}: --quick is --tier frequency. Leave one of them out.")
    result = run(lift_plan, "frequency" if quick else tier or "time", alpha, out, store, scheduler, threads)
    show(result, out, json=json)
    raise typer.Exit(0 if result.workable else 1)


def _copy(folder: Path) -> None:
    from stillhook.plan.example import copy_plan

    first, *rest = copy_plan("template-to-1500m", folder)
    print(f"written: {first}" + "".join(f", {path}" for path in rest))
    print(f"edit it, then: stillhook plan {first} --check")


def run(
    lift_plan: LiftPlan,
    tier: str,
    alpha: str | None,
    out: Path | None,
    store: Path | None,
    scheduler: str | None,
    threads: int,
) -> PlanResult:
    """The plan's result, with its files written where requested."""
    from stillhook.base.atomic import check_folder
    from stillhook.plan.answer.files import OUT_FILES, write_answer
    from stillhook.plan.planning import plan as planned
    from stillhook.plan.planning import tier_of

    options: dict[str, Any] = {} if alpha is None else {"alpha": alpha}
    last = tier_of(tier)
    if out is not None:
        check_folder(out, OUT_FILES)
        store = out / "runs" if store is None else store
    _say_before(lift_plan, last, store)
    with client_of(scheduler) as client, progress_bar(f"{lift_plan.name}: planning") as bar:
        result = planned(lift_plan, tier=last, store=store, client=client, threads=threads, progress=bar, **options)
    if out is not None:
        write_answer(result, out)
    return result


def _say_before(lift_plan: LiftPlan, last: Tier, store: Path | None) -> None:
    """Announce steps that take time before they start."""
    from stillhook.plan.definition.demand import Tier

    if last is not Tier.CLOSED_FORM:
        say_if_compiling(lift_plan.crane)
    if last is Tier.TIME:
        from stillhook.engine.lowering.run import KIND
        from stillhook.plan.tiers.time_domain.tier import expected

        say_if_compiling(lift_plan.crane, kind=KIND)
        kept = (
            f"; completed runs are kept in {store}, and a stopped plan resumes from there" if store is not None else ""
        )
        say(f"{expected(lift_plan)}{kept}")


def show(result: PlanResult, out: Path | None, *, json: bool) -> None:
    """The answer on the terminal."""
    if json:
        print_json(result.facts)
        return
    facts = result.facts
    wrapped(f"{facts['name']}: {facts['crane']['name']}, {facts['payload']['name']}, {facts['place']['text']}")
    for heading in result.data["heading"].values:
        _print_heading(result, float(heading))
    for note, names in _by_credit_note(facts["alternatives"]).items():
        wrapped(f"{', '.join(names)}: {note}")
    if certificate := facts["crane"]["certificate"]:
        wrapped(certificate["unsigned"])
    if "weather" in result:
        _print_weather(result)
    op = facts["operation"]
    hours = ", ".join(f"{key} {op[key] / 3600.0:.3g} h" for key in ("T_POP", "T_R"))
    wrapped(
        f"{hours}: {'weather restricted' if op['weather_restricted'] else 'not weather restricted'}; {_forecast(op)}"
    )
    wrapped(facts["crane"]["twin"])
    for line in facts["remarks"]:
        wrapped(line)
    wrapped(
        f"rules: {facts['rules']['name']} {facts['rules']['version']}, recalled from their standards: check against"
        " your edition"
    )
    if out is not None:
        from stillhook.plan.answer.files import OUT_FILES

        print("written: " + ", ".join(str(out / name) for name in OUT_FILES if (out / name).is_file()))


def _by_credit_note(alternatives: list[dict[str, Any]]) -> dict[str, list[str]]:
    """Credit notes, with the alternatives that each applies to."""
    out: dict[str, list[str]] = {}
    for each in alternatives:
        out.setdefault(each["credit_note"], []).append(each["name"])
    return out


def _forecast(op: dict[str, Any]) -> str:
    cell = f"{op['alternative']} at Tp {op['Tp']:g} s, {math.degrees(op['beta']):.4g} deg"
    if math.isnan(op["alpha"]):
        return f"no forecast factor for {cell}"
    return f"{cell}: OP_LIM {op['OP_LIM']:.2f} m, alpha {op['alpha']:.3f}, OP_WF {op['op_wf']:.2f} m"


def _print_heading(result: PlanResult, beta: float) -> None:
    """One table for a heading: limits of every alternative over the periods, what is credited, the closed form, and
    what governs."""
    from stillhook.plan.result.distinguishable import columns

    data, shown = result.data.sel(heading=beta), str(result.facts["shown"])
    groups = columns(result)
    closed = data["Hs_rule"].sel(credit="twin", tier="closed-form", alternative=shown).min(dim=("phase", "rule"))
    rows = []
    for period in data["period"].values:
        at = data.sel(period=period)
        modelled = [_height(at["Hs_limit"].sel(credit="twin", alternative=group[0]), data.attrs) for group in groups]
        credited = _height(at["Hs_limit"].sel(credit="credited", alternative=shown), data.attrs)
        governs = [
            str(at[f"governing_{quantity}"].sel(credit="twin", alternative=shown).item())
            for quantity in ("phase", "rule", "tier")
        ]
        rows.append(
            [f"{float(period):g} s", *modelled, credited, _height(closed.sel(period=period), data.attrs), *governs]
        )
    names = [",\n".join(group) for group in groups]
    head = ["Tp", *names, f"credited:\n{shown}", "closed\nform", f"{shown} is\ngoverned in", "by", "tier"]
    n = len(groups) + 3
    print_table(
        head,
        rows,
        title=f"limiting Hs [m], waves travelling {math.degrees(beta):.4g} deg from the bow",
        texts={n, n + 1, n + 2},
    )


def _height(value: Any, attrs: dict[str, Any]) -> str:
    Hs = float(value)
    if math.isnan(Hs):
        return "-"
    return f"> {attrs['Hs_highest']:g}" if math.isinf(Hs) else "never" if Hs == 0.0 else f"{Hs:.2f}"


def _print_weather(result: PlanResult) -> None:
    """A table: how often each alternative can work, how long it waits, and what it gains an operation, as modelled; as
    credited where that differs, alike ones in one row."""
    from stillhook.plan.result.distinguishable import merged, references

    block, over = result["weather"], references(result["weather"], result.facts["tiers"])
    synthetic = "SYNTHETIC weather, " if block.attrs["synthetic"] else ""
    years = f"{block.attrs['first'][:10]} to {block.attrs['last'][:10]}"
    title = f"{synthetic}{block.attrs['source']}, {years}, window {block.attrs['T_R'] / 3600.0:.3g} h"
    names = [str(name) for name in block["alternative"].values]
    modelled, credited = (
        {name: _weather_row(block.sel(credit=c, alternative=name, month=0), over) for name in names}
        for c in ("twin", "credited")
    )
    rows = [
        ["twin", *row] for row in merged(([name, *cells] for name, cells in modelled.items()), result, between=",\n")
    ]
    alike: dict[tuple[str, ...], list[str]] = {}
    for name, cells in credited.items():
        if cells != modelled[name]:
            alike.setdefault(tuple(cells), []).append(name)
    rows += [["credited", ",\n".join(those), *cells] for cells, those in alike.items()]
    head = ["limit", "winch", "workable", "hours\na year", "wait\nmean", "wait\nP50", "wait\nP90", "vessel\ndays"]
    print_table([*head, *(f"days gained\nover {name.replace('-', ' ')}" for name in over)], rows, title=title, left=2)


def _weather_row(year: Any, over: Sequence[str]) -> list[str]:
    """Workable share and hours of a year, waits, vessel days, and days gained over each of these alternatives."""
    worked = float(year["operability"])
    waits = [_days(float(year[key])) for key in ("wait_mean", "wait_p50", "wait_p90")]
    days = [_number(float(year["days_gained"].sel(over=name)), 1) for name in over]
    return [_share(worked), _number(worked * HOURS, 0), *waits, _number(float(year["vessel_days"]), 1), *days]


def _days(seconds: float) -> str:
    return "never" if math.isnan(seconds) else f"{seconds / 86400.0:.1f} d"


def _share(x: float) -> str:
    return "-" if math.isnan(x) else f"{0.0 if x < LEAST else 100.0 * x:.1f} %"


def _number(x: float, digits: int) -> str:
    return "-" if math.isnan(x) else f"{round(x, digits) + 0.0:.{digits}f}"
