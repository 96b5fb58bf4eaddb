"""`stillhook demo`: a ship in waves, and the example plan to its report."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.groups import VERBOSE
from stillhook.cli.parser import check_out, say_answer, say_left_out
from stillhook.cli.runs.plan import Work, run
from stillhook.cli.runs.simulation import OUT_FILES, write_comparison
from stillhook.errors import PlanError
from stillhook.report.formatting import fixed, wrapped
from stillhook.report.terminal import Answer, Line, print_table, progress_bar, started
from stillhook.units import quote, show

if TYPE_CHECKING:
    from stillhook.plan.result import PlanResult

SHOWN = 40.0
"""Last part of each run that its picture shows [s]."""
EXAMPLE = "template-to-1500m"
PLAN, QUICK = "plan", "quick"
EXAMPLE_HELP = (
    '"plan": a ship in waves, then a template of 120 t from deck to seabed at 1,500 m, to the report; "quick": the'
    " same by the frequency-domain method alone, in seconds."
)
SHIP, SEA, HEADING = "construction-vessel-130m", "jonswap Hs=2 m Tp=9 s", "165 deg"
TIP = (-15.0, -24.0)
"""Crane tip from the vessel's reference point, forward and to port [m]."""
LOAD, S_W, DURATION = "100 t", "500 m", "300 s"
PERIODS = (6.0, 8.0, 10.0, 12.0)
"""Periods whose limits the demo prints [s]."""
NOT_COMPARED = ("not-compared-closed-form", "not-compared-frequency")
"""Causes of a plan that name the controllers of which its methods say nothing."""


def demo(
    example: Annotated[str, typer.Argument(help=EXAMPLE_HELP)] = PLAN,
    out: Annotated[Path, typer.Option("--out", help="Folder for report and pictures.")] = Path("stillhook-demo"),
) -> None:
    """A ship in waves under three controllers, then the limiting weather for lowering a template of 120 t to 1,500 m
    and the days that a better controller gains: the example plan, to its report.

    An interrupted run continues where it stopped when it is started again. Exit codes are those of stillhook plan.

    Example: stillhook demo

    Example: stillhook demo quick
    """
    if example not in (PLAN, QUICK):
        raise PlanError(f"Unknown example {quote(example)}. Choose {PLAN} or {QUICK}.")
    from stillhook.plan.file import load_plan

    check_out(out, OUT_FILES)
    _in_waves(out / "ship-in-waves")
    folder = out / "lift-plan"
    result = run(
        load_plan(EXAMPLE), "frequency" if example == QUICK else "time", Work(out=folder, store=folder / "runs")
    )
    _lift(result, folder)
    raise typer.Exit(0 if result.workable else 1)


def _in_waves(out: Path) -> None:
    """A ship motion under three controllers: five lines and a picture."""
    from stillhook.analysis.controllers import compare as side_by_side
    from stillhook.formats.vessel.open import read_vessel
    from stillhook.library import load_crane
    from stillhook.report.kit import can_draw
    from stillhook.sea.spectra.text import parse_sea
    from stillhook.sea.vessel.realisation import realise, tip_motion
    from stillhook.spec.scenario import Scenario

    sea = parse_sea(SEA, heading=HEADING, spread=4.0)
    motion = tip_motion(realise(sea, repeat=3600.0, seed=1), read_vessel(SHIP), *TIP)
    crane = load_crane("nov-250t")
    case = Scenario(name="ship in waves", load=LOAD, s_w=S_W, tip=motion, duration=DURATION, warm_up="60 s")
    with progress_bar("A ship in waves") as bar:
        result = side_by_side(crane, case, progress=started(crane, bar, series=True))
    runs = result.table()
    first = next(iter(runs.values()))
    tip = show(first["s_tip_pp"], "length")
    waves = SEA.removeprefix("jonswap ")
    print(f"A crane tip moves {tip} in 30 s (ship in SIMULATED waves, {waves}), {LOAD} on the hook:")
    for mode, summary in runs.items():
        residual = f"{show(summary['e_c_pp'], 'length'):>8} of it, {summary['eta_c']:6.1%} compensated"
        print(f"  {mode.upper():4} the hook keeps {residual}; {summary['status']}")
    write_comparison(result, out, quiet=True, hint=False, start=result.runs[0].case.duration - 2.0 * SHOWN)
    if VERBOSE.get():
        print(f"  picture: {(out / OUT_FILES[0]).resolve()}\n" if can_draw() else "")


def _lift(result: PlanResult, out: Path) -> None:
    """The lift: the claimable limit, the status, what governs, and where the report is."""
    from stillhook.plan.report.decision.short import short
    from stillhook.plan.report.document import PAGE, PDF
    from stillhook.report.kit import can_set

    limits = {row["rule"]: row["limit"] for row in result.facts["limited"] if row["rule"] == "load-motion"}
    landed = f"{result.name}, landed within {show(limits['load-motion'], 'length')} over guide posts."
    report = out / (PDF if can_set() else PAGE)
    lines: list[Line] = [*short(result), partial(_in_full, result)]
    say_answer(Answer(landed, lines, f"read {report}", "simulated limits, days gained, tolerances"))
    say_left_out(pdf=True)


def _in_full(result: PlanResult) -> None:
    """Verdict, limits and days gained of every alternative, as simulated and as credited."""
    from stillhook.plan.report.document import marks
    from stillhook.plan.report.limits_summary import verdict
    from stillhook.plan.report.words import CREDITED, TWIN, gain, named, sentence
    from stillhook.report.formatting import percent

    data, answer = result.data, verdict(result)
    for line in (answer.text[0], *(text for text in answer.text if text.startswith("Simulated"))):
        wrapped(line, "  ")
    periods = [float(T) for T in data["period"].values if float(T) in PERIODS]
    weather = result.blocks.get("weather")
    excluded = {twin for cause in result.caused(*NOT_COMPARED) for twin in cause["twins"]}
    rows = []
    for credit, label in ((TWIN, "simulated"), (CREDITED, "credited")):
        for name in (str(a) for a in data["alternative"].values if str(a) not in excluded):
            Hs = data["Hs_limit"].sel(credit=credit, alternative=name)
            if credit == CREDITED and bool((Hs == data["Hs_limit"].sel(credit=TWIN, alternative=name)).all()):
                continue
            cells = [fixed(float(Hs.sel(period=T).min()), 2) for T in periods]
            if weather is not None:
                year = weather.sel(credit=credit, alternative=name, month=0)
                cells += [percent(float(year["operability"])), gain(year, "cap-80")]
            rows.append([named(name), label, *cells])
    head = ["winch", "limit", *(f"{T:g} s" for T in periods)]
    head += [] if weather is None else ["workable", "days gained over the 80 % cap (95 %)"]
    print_table(head, rows, left=2)
    print("Limiting Hs [m] by peak period, most unfavourable heading.")
    for line in (
        *_other_tolerances(result),
        *map(sentence, result.caused("oscillates")),
        *(f"{mark}." for mark in marks(result)),
    ):
        wrapped(line, "  ")


def _other_tolerances(result: PlanResult) -> list[str]:
    """From which tolerance on a better controller pays, of the lift as planned in each period; none where that was not
    computed."""
    from stillhook.plan.report.detail import answers

    lines = [line for line in answers(result["sweep"]) if "(as planned)" in line] if "sweep" in result else []
    return ["All of it depends on the tolerance, which is assumed:", *(f"{line}." for line in lines)] if lines else []
