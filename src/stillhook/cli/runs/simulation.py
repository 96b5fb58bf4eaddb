"""`stillhook run`, `stillhook compare` and `stillhook lower`."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.base.extras import need
from stillhook.cli.analysis.drives import compare_drives
from stillhook.cli.parser import (
    MODES,
    USUAL,
    Json,
    LiftArgument,
    Step,
    announce,
    check_out,
    refuse,
    say_left_out,
    write_out,
)
from stillhook.errors import CommandError, LiftError, MotionError, StillhookError
from stillhook.physics.scalar import G
from stillhook.report.formatting import cell, wrapped
from stillhook.report.terminal import print_json, print_table, print_twin, progress_bar, started
from stillhook.units import quote, show
from stillhook.winches.registry import WINCH_TYPES

if TYPE_CHECKING:
    from stillhook.analysis.controllers import Comparison
    from stillhook.formats.lift_file import LiftFile
    from stillhook.sea.motion.motion import Motion
    from stillhook.spec.crane import Crane


Out = Annotated[
    Path | None,
    typer.Option("--out", help="Folder for figure, NetCDF and summary.json; nothing is written without it."),
]
MOTION_HELP = (
    'Tip motion: "sine 2.8 m 12 s" (amplitude, period; sums with +), a log (CSV or $PSXN,23), or the tip.json of'
    " stillhook tip."
)
DRIVES = ", ".join(WINCH_TYPES)
"""Drives as help lists them."""
POSITION_HELP = 'Ship logs: crane tip from the motion sensor, forward, port, up, such as "20 m, -12 m, 30 m".'
PYTHON_POSITION, COMMAND_POSITION = 'tip=("-20 m", "12 m", "35 m")', '--position "-20 m, 12 m, 35 m"'
OUT_FILES = ("panels.png", "runs.nc", "summary.json")
COLUMNS = (
    "e_c_pp",
    "eta_c",
    "e_c_max",
    "e_c_mean",
    "u_p_max",
    "saturation_time",
)
"""Numbers of every winch in a table of runs; those of its type follow (`stillhook.winches.interface`, SHOWN)."""
HEADERS = {
    "e_c_pp": "error\np-p 30 s",
    "eta_c": "effi-\nciency",
    "e_c_max": "largest\nerror",
    "e_c_mean": "offset",
    "u_p_max": "pump\nuse",
    "saturation_time": "pump\nsaturated",
}
OF_DRIVE = {"u_p_max": "command\nused", "saturation_time": "command\nsaturated"}
"""Heads of the same where a drive takes a speed command."""


def headers(crane: Crane) -> list[str]:
    """Heads of the columns of a table of runs."""
    common = HEADERS if crane.circuits else HEADERS | OF_DRIVE
    return [*common.values(), *crane.plant.type.shown.values(), "status"]


def row(crane: Crane, summary: dict[str, Any]) -> list[str]:
    """A run's cells under `headers`."""
    return [cell(name, summary[name]) for name in (*COLUMNS, *crane.plant.type.shown, "status")]


def print_notes(summaries: dict[str, dict[str, Any]]) -> None:
    for label, summary in summaries.items():
        for note in summary["notes"]:
            print(f"{label}: {note}")


def run(
    case_file: Annotated[
        Path, typer.Argument(metavar="CASE.toml", help="Case file: crane and [scenario]; or runs.nc, to run it again.")
    ],
    out: Out = None,
    json: Json = False,
) -> None:
    """Run one case file, or what a stored run holds. Exit code 1 if a limit was exceeded.

    Example: stillhook run case.toml --out results
    """
    from stillhook.analysis.controllers import dataset_of, run_labelled
    from stillhook.formats.case_file import load_case, stored_cases

    check_out(out, OUT_FILES)
    files = stored_cases(case_file) if case_file.suffix == ".nc" else [load_case(case_file)]
    crane, case, cranes = files[0].crane, files[0].case, [f.crane for f in files]
    labels = _labels([f.case.name for f in files], case_file.stem)
    try:
        with progress_bar(case_file.stem) as bar:
            steps = {"step": files[0].step, "every": files[0].every}
            runs = run_labelled(cranes, [f.case for f in files], **steps, progress=started(crane, bar, series=True))
    except StillhookError as e:
        raise type(e)(f"{case_file.name}: {e}") from None
    summaries = {label: r.summary for label, r in zip(labels, runs, strict=True)}
    if json:
        print_json(runs[0].summary if len(runs) == 1 else summaries)
    else:
        rows = [[label, *row(crane, s)] for label, s in summaries.items()]
        print_table(["case", *headers(crane)], rows, title=_title(crane, case))
        print_twin(crane)
        print_notes(summaries)
    if out is not None:
        data = {label: r.dataset(c) for label, r, c in zip(labels, runs, cranes, strict=True)}
        one = all(c is crane for c in cranes)
        all_cases = dataset_of(crane if one else cranes, runs, labels) if len(runs) > 1 else None
        _write(out, data, summaries, quiet=json, crane=crane, title=_title(crane, case), all_cases=all_cases)
    raise typer.Exit(0 if all(r.ok for r in runs) else 1)


def compare(
    crane: Annotated[str, typer.Argument(metavar="CRANE", help="Library crane, or path of a crane file.")] = "nov-250t",
    load: Annotated[str, typer.Option(help='Payload on the hook, such as "100 t".')] = "100 t",
    s_w: Annotated[str, typer.Option("--s-w", help='Wire paid out, such as "100 m".')] = "100 m",
    motion: Annotated[str, typer.Option(help=MOTION_HELP)] = "sine 2.8 m 12 s",
    modes: Annotated[str | None, typer.Option("--controllers", help=f"{MODES}.{USUAL}")] = None,
    position: Annotated[str | None, typer.Option(help=POSITION_HELP)] = None,
    heave: Annotated[
        str | None, typer.Option(help='How a ship log counts heave: "up" or "down" (default: the rule of its kind).')
    ] = None,
    start: Annotated[str | None, typer.Option(help="Where in a log to start.")] = None,
    duration: Annotated[
        str | None, typer.Option(help='Length of the run (default 120 s, or the entire log), such as "300 s".')
    ] = None,
    warm_up: Annotated[
        str, typer.Option("--warm-up", help="Start of the run that is left out of the figures.")
    ] = "30 s",
    delay: Annotated[str, typer.Option(help="Delay of the measured tip motion.")] = "0 s",
    step: Annotated[
        str | None, typer.Option(help="Integration step (default 2 ms, or the next shorter part of the PLC cycle).")
    ] = None,
    drives: Annotated[
        str | None, typer.Option(help=f"Drives in place of controllers, each sized for this crane: {DRIVES}.")
    ] = None,
    draws: Annotated[
        int | None, typer.Option(help="With --drives: draws of what is uncertain (default 16; 0: none).")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="With --drives: same seed, same draws.")] = None,
    top_speed: Annotated[
        str | None,
        typer.Option("--top-speed", help="With --drives: wire speed at full command (default that of the crane)."),
    ] = None,
    plan: Annotated[
        str | None, typer.Option(help="With --drives: lift plan; days that each drive gains in a year.")
    ] = None,
    full_plan: Annotated[
        bool, typer.Option("--full-plan", help="With --plan: the twin in the loop (hours), not the frequency domain.")
    ] = False,
    out: Out = None,
    json: Json = False,
) -> None:
    """Run one motion under several controllers, or with several drives, and put them side by side.

    Exit code 1 if none of them stays inside its limits.

    Example: stillhook compare nov-250t --load "100 t" --s-w "100 m" --motion "sine 2.8 m 12 s" --controllers
    ns,hs,ssc

    Example: stillhook compare nov-250t --load "100 t" --motion "sine 2 m 10 s" --drives
    active-passive,pure-active,secondary,cylinder,electric,open-circuit
    """
    from stillhook.analysis.controllers import compare as side_by_side
    from stillhook.library import load_crane
    from stillhook.sea.motion.recorded import Recorded
    from stillhook.spec.scenario import Scenario, Sensors

    of_drives = {"--draws": draws, "--seed": seed, "--top-speed": top_speed, "--plan": plan, "--full-plan": full_plan}
    if drives is None:
        refuse(of_drives, "belongs to --drives. Give it, or leave this out.")
        check_out(out, OUT_FILES)
    else:
        refuse({"--controllers": modes}, "--drives gives each drive its own controller. Leave one of them out.")
    if full_plan and plan is None:
        raise CommandError("--full-plan: which plan? Give --plan.")
    machine = load_crane(crane)
    tip = motion_of(motion, position, heave, start, duration)
    times = (
        {} if duration is None or isinstance(tip, Recorded) else {"duration": duration}
    )  # a log is cut as it is read
    case = Scenario(load=load, s_w=s_w, tip=tip, warm_up=warm_up, sensors=Sensors(delay=delay), **times)
    if drives is not None:
        ok = compare_drives(
            machine,
            case,
            drives,
            draws=16 if draws is None else draws,
            seed=seed or 0,
            top_speed=top_speed,
            step=step,
            plan=plan,
            full_plan=full_plan,
            out=out,
            json=json,
        )
        raise typer.Exit(0 if ok else 1)
    chosen = None if modes is None else [m.strip().lower() for m in modes.split(",") if m.strip()]
    with progress_bar("comparing") as bar:
        progress = started(machine, bar, series=True, report=getattr(tip, "report", ""))
        result = side_by_side(machine, case, chosen, step=step, progress=progress)
    _report(result, json=json)
    if out is not None:
        write_comparison(result, out, quiet=json)
    raise typer.Exit(0 if result.ok else 1)


def motion_of(
    text: str,
    position: str | None = None,
    heave: str | None = None,
    start: str | None = None,
    duration: str | None = None,
) -> Motion:
    """A motion text, or the log that it names."""
    from stillhook.sea.motion.text import parse_motion

    of_log = {"--position": position, "--heave": heave, "--start": start}
    if text.strip().split(" ")[0].lower() in ("sine", "still"):
        refuse(of_log, f"belongs to a log, and --motion {quote(text)} is not one. Leave it out.")
        return parse_motion(text, "--motion")
    if not os.path.exists(text):
        raise MotionError(
            f'--motion {quote(text)}: no such file, and not a motion such as "sine 2.8 m 12 s". Check the path.'
        )
    from stillhook.formats.motion.open import read_tip_motion, stored_motion

    stored = stored_motion(text)
    if stored is not None:
        refuse(of_log, f"belongs to a log, and {quote(text)} holds a tip's motion. Leave it out.")
        return stored
    arm = tuple(p.strip() for p in position.split(",")) if position is not None else None
    try:
        return read_tip_motion(text, tip=arm, heave=heave, start=start, duration=duration)  # type: ignore[arg-type]
    except MotionError as e:
        raise MotionError(str(e).replace(PYTHON_POSITION, COMMAND_POSITION)) from None


def _title(crane: Crane, case: Any) -> str:

    medium = "in water" if case.water else "in air"
    tip = case.tip.describe().split(":")[0]
    return f"{crane.name}, {show(case.load, 'mass')} {medium}, {show(case.s_w, 'length')} of wire out, tip: {tip}"


def _report(result: Comparison, *, json: bool) -> None:
    if json:
        print_json(result.table())
        return
    rows = [[r.mode.value, *row(result.crane, r.summary)] for r in result.runs]
    print_table(["mode", *headers(result.crane)], rows, title=_title(result.crane, result.runs[0].case))
    print_twin(result.crane)
    print_notes(result.table())


def write_comparison(result: Comparison, out: Path, *, quiet: bool, hint: bool = True, start: float = 0.0) -> None:
    """hint: say where pictures are left out."""
    data = result.dataset()
    runs = {r.mode.value.upper(): data.sel(case=r.mode.value) for r in result.runs}
    _write(
        out,
        runs,
        result.table(),
        quiet=quiet,
        hint=hint,
        crane=result.crane,
        title=_title(result.crane, result.runs[0].case),
        start=start,
        all_cases=data,
    )


def _write(
    out: Path,
    runs: dict[str, Any],
    summary: dict[str, Any],
    *,
    quiet: bool,
    hint: bool = True,
    crane: Crane,
    title: str,
    start: float = 0.0,
    all_cases: Any = None,
) -> None:
    """Picture, NetCDF and summary of a set of runs."""
    from stillhook.report.plots.run import four_panels

    picture, series, numbers = OUT_FILES
    p_relief = crane.active.relief.p if "active" in crane.circuits else None
    data = next(iter(runs.values())) if all_cases is None else all_cases
    write_out(
        out,
        {series: data, numbers: summary},
        pictures=lambda: {picture: four_panels(runs, title=title, start=start, p_relief=p_relief)},
        quiet=quiet,
        hint=hint,
    )


def _labels(names: list[str], stem: str) -> list[str]:
    """A label for each case of a file, no two alike."""
    labels = [name or (stem if len(names) == 1 else str(i)) for i, name in enumerate(names)]
    return [f"{label} ({i})" if labels.count(label) > 1 else label for i, label in enumerate(labels)]


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


def lower(
    lift: LiftArgument,
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
    the seabed in a phase that does not land, or the programme got stuck or was not finished.

    Example: stillhook lower anchor-to-3000m --out anchor

    Example: stillhook lower anchor/lowering.nc, to run a stored lowering again
    """
    from stillhook.engine.lowering.run import setup_of
    from stillhook.engine.simulate import simulate
    from stillhook.formats.lift_file import load_lift, stored_lift
    from stillhook.report.save import ANIMATION, LOWERING_FILES, lowering_answer, write_lowering

    if animation and out is None:
        raise LiftError("--animation: is written to a folder. Give --out as well.")
    if animation:
        need("matplotlib", "--animation", LiftError)
    check_out(out, (*LOWERING_FILES, ANIMATION) if animation else LOWERING_FILES)
    if lift.endswith(".nc"):
        refuse({"--seed": seed, "--duration": duration}, "a stored run is run again as it was. Leave it out.")
        file = stored_lift(lift)
    else:
        file = load_lift(lift, seed=seed, duration=duration)
    try:
        with progress_bar(file.lift.name) as bar:
            progress = started(file.crane, bar, series=True, setup=setup_of(file.lift))
            run = simulate(
                file.crane,
                file.lift,
                step=step or file.step,
                every=file.every,
                sampling=file.sampling,
                end=file.end,
                progress=progress,
            )
    except StillhookError as e:
        raise type(e)(f"{Path(lift).name}: {e}") from None
    answer = lowering_answer(run, file)
    written = write_lowering(out, run, file, answer, animation=animation) if out is not None else ()
    if json:
        print_json(answer)
    else:
        _print(file, answer)
    if out is not None:
        announce(out, written, quiet=json)
        say_left_out()
    raise typer.Exit(0 if answer["status"] == "ok" else 1)


def _print(file: LiftFile, answer: dict[str, Any]) -> None:

    wrapped(f"{answer['lift']}: {answer['crane']}, {file.place}")
    load = file.lift.payload
    wrapped(f"{load.title or load.name}, {show(load.mass, 'mass')}; water {show(file.lift.depth, 'length')} deep")
    rows = [
        [row["name"], row["described"], *(cell(name, row[name]) for name in LOWERING_COLUMNS)]
        for row in answer["phases"]
    ]
    of_command = () if file.crane.circuits else (OF_DRIVE["saturation_time"],)
    heads = (*LOWERING_HEADERS[: -1 if of_command else None], *of_command)
    print_table(["phase", "description", *heads], rows, left=2)
    print(f"status: {answer['status']}")
    allowed = (file.crane.SWL + file.crane.hook_mass) * G
    print(
        f"largest tension at the crane tip: {show(answer['F_w_max'], 'force')}, SWL and hook: {show(allowed, 'force')}"
    )
    if (unit := file.lift.compensator) is not None:
        from stillhook.winches.joints.registry import UNITS

        print(UNITS[unit.type].summary(unit, answer))
    if not math.isnan(answer["t_landed"]):
        slack = answer["sling_slack_landed_time"]
        after = f", slings slack for {show(slack, 'time')} from then on" if slack > 0.0 else ""
        print(f"touched down after {show(answer['t_landed'], 'time')} at {show(answer['v_landed'], 'speed')}{after}")
    compensated = [row for row in answer["phases"] if row["mode"] == "ahc" and not math.isnan(row["eta_load"])]
    if compensated:
        least = min(compensated, key=lambda row: row["eta_load"])
        print(
            f"least compensation, phase {least['name']}: {least['eta_c']:.0%} at the winch, {least['eta_load']:.0%} at"
            " the load"
        )
    print_twin(file.crane)
    for note in answer["notes"]:
        print(note)
