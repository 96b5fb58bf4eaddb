"""`stillhook lower`: one lowering in the time domain, from above the surface to the seabed, winch and controller in the
loop."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.options import Json, Step
from stillhook.report.formatting import cell
from stillhook.report.running_text import wrapped
from stillhook.report.terminal import print_json, print_table, print_twin, progress_bar, started

if TYPE_CHECKING:
    from stillhook.formats.lift.file import LiftFile

LOWERING_COLUMNS = (
    "t_begin",
    "s_tip_pp",
    "e_c_pp",
    "load_pp",
    "F_sling_min",
    "F_sling_max",
    "DAF",
    "sling_slack_time",
    "saturation_time",
)
LOWERING_HEADERS = (
    "from",
    "tip\np-p 30 s",
    "error\np-p 30 s",
    "load\np-p 30 s",
    "slings\nleast",
    "slings\nmost",
    "DAF",
    "slings\nslack",
    "pumps\nsaturated",
)


def register_lower(app: typer.Typer) -> None:
    app.command("lower")(lower)


def lower(
    lift: Annotated[
        str, typer.Argument(metavar="LIFT.toml", help="Lift file, or one of the library's; a wrong name lists them.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for pictures, NetCDF and summary.json; nothing without it.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the waves, in place of the file's.")] = None,
    duration: Annotated[
        str | None, typer.Option(help='Length of the run, in place of the file\'s, such as "20 min".')
    ] = None,
    step: Step = None,
    animation: Annotated[bool, typer.Option("--animation", help="An animation (GIF) as well; with --out.")] = False,
    json: Json = False,
) -> None:
    """Lower a payload by a winch programme: splash zone, lowering in heave compensation, landing, all in one run.

    Exit code 1 where a limit was passed, the load was too heavy, slings went slack before touch-down, the load touched
    the seabed in a stage that does not land, or the programme got stuck or was not finished.

    Example: stillhook lower anchor-to-3000m --out anchor
    """
    from stillhook.base.atomic import check_folder
    from stillhook.engine.lowering.run import KIND
    from stillhook.engine.simulate import simulate
    from stillhook.errors import LiftError, StillhookError
    from stillhook.formats.lift.file import load_lift
    from stillhook.report.save.lowering import ANIMATION, LOWERING_FILES, lowering_answer, write_lowering

    if animation and out is None:
        raise LiftError("--animation: is written to a folder. Give --out as well.")
    if out is not None:
        check_folder(out, (*LOWERING_FILES, ANIMATION) if animation else LOWERING_FILES)
    file = load_lift(lift, seed=seed, duration=duration)
    try:
        with progress_bar(file.lift.name) as bar:
            progress = started(file.crane, bar, series=True, kind=KIND)
            run = simulate(file.crane, file.lift, step=step or file.step, every=file.every, progress=progress)
    except StillhookError as e:
        raise type(e)(f"{Path(lift).name}: {str(e).replace('z_0 ', 'start ')}") from None
    answer = lowering_answer(run, file)
    written = write_lowering(out, run, file, answer, animation=animation) if out is not None else ()
    if json:
        print_json(answer)
    else:
        _print(file, answer)
        if written:
            print("written: " + ", ".join(str(out / name) for name in written))  # type: ignore[operator]
    raise typer.Exit(0 if answer["status"] == "ok" else 1)


def _print(file: LiftFile, answer: dict[str, Any]) -> None:
    from stillhook.physics.scalar import G
    from stillhook.units import show

    wrapped(f"{answer['lift']}: {answer['crane']}, {file.place}")
    load = file.lift.payload
    wrapped(f"{load.title or load.name}, {show(load.mass, 'mass')}; water {show(file.lift.depth, 'length')} deep")
    rows = [
        [row["name"], row["described"], *(cell(name, row[name]) for name in LOWERING_COLUMNS)]
        for row in answer["stages"]
    ]
    print_table(["stage", "description", *LOWERING_HEADERS], rows, left=2)
    print(f"status: {answer['status']}")
    allowed = (file.crane.SWL + file.crane.hook_mass) * G
    print(
        f"largest tension at the crane tip: {show(answer['F_w_max'], 'force')}, SWL and hook: {show(allowed, 'force')}"
    )
    if not math.isnan(answer["t_landed"]):
        slack = answer["sling_slack_landed_time"]
        after = f", slings slack for {show(slack, 'time')} from then on" if slack > 0.0 else ""
        print(f"touched down after {show(answer['t_landed'], 'time')} at {show(answer['v_landed'], 'speed')}{after}")
    held = [row for row in answer["stages"] if row["mode"] == "ahc" and not math.isnan(row["eta_load"])]
    if held:
        least = min(held, key=lambda row: row["eta_load"])
        print(
            f"least compensation, stage {least['name']}: {least['eta_c']:.0%} at the winch, {least['eta_load']:.0%} at"
            " the load"
        )
    print_twin(file.crane)
    for note in answer["notes"]:
        print(note)
