"""`stillhook demo`: a ship in waves, and the example plan to its report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.parser import check_out
from stillhook.cli.runs.plan import Work, run, show
from stillhook.cli.runs.simulation import OUT_FILES, write_comparison
from stillhook.errors import PlanError
from stillhook.report.kit import can_draw
from stillhook.report.terminal import progress_bar, started
from stillhook.units import quote
from stillhook.units import show as with_unit

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
    show(result, folder, json=False)
    raise typer.Exit(0 if result.workable else 1)


def _in_waves(out: Path) -> None:
    """A ship motion under three controllers: five lines and a picture."""
    from stillhook.analysis.controllers import compare as side_by_side
    from stillhook.formats.vessel.open import read_vessel
    from stillhook.library import load_crane
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
    tip = with_unit(first["s_tip_pp"], "length")
    waves = SEA.removeprefix("jonswap ")
    print(f"A crane tip moves {tip} in 30 s (ship in SIMULATED waves, {waves}), {LOAD} on the hook:")
    for mode, summary in runs.items():
        residual = f"{with_unit(summary['e_c_pp'], 'length'):>8} of it, {summary['eta_c']:6.1%} compensated"
        print(f"  {mode.upper():4} the hook keeps {residual}; {summary['status']}")
    write_comparison(result, out, quiet=True, hint=False, start=result.runs[0].case.duration - 2.0 * SHOWN)
    print(f"  picture: {(out / OUT_FILES[0]).resolve()}\n" if can_draw() else "")
