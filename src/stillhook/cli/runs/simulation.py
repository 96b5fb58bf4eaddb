"""`stillhook run`, `stillhook compare` and `stillhook lower`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.base.extras import need
from stillhook.cli.analysis.drives import compare_drives
from stillhook.cli.analysis.faults import compare_faults
from stillhook.cli.parser import (
    MODES,
    USUAL,
    Duration,
    Json,
    LiftArgument,
    Load,
    MotionText,
    Out,
    SubjectArgument,
    WireOut,
    announce,
    case_of,
    check_out,
    declared,
    present,
    refuse,
    say_left_out,
    write_out,
)
from stillhook.errors import LiftError, StillhookError
from stillhook.report.formatting import argument, cell, counted, wrapped
from stillhook.report.terminal import Answer, Line, columns, print_table, progress_bar, say, started, twin_lines
from stillhook.units import parse, quote, show

if TYPE_CHECKING:
    from stillhook.analysis.controllers import Comparison
    from stillhook.formats.lift_file import LiftFile
    from stillhook.spec.crane import Crane
    from stillhook.spec.lift.lowering import Lowering

DRIVES = ", ".join(declared("winches", "types"))
"""Drives as help lists them."""
USUAL_CASE = {"load": "100 t", "s_w": "100 m", "tip": "sine 2.8 m 12 s", "warm_up": "30 s"}
"""What is compared where neither a case file nor an option says it."""
OUT_FILES = ("panels.png", "runs.nc", "summary.json")
HEADERS = {
    "e_c_pp": "error\np-p 30 s",
    "eta_c": "effi-\nciency",
    "e_c_max": "largest\nerror",
    "e_c_mean": "offset",
    "u_p_max": "pump\nuse",
    "saturation_time": "pump\nsaturated",
}
"""Numbers of every winch in a table of runs with their heads; those of its type follow (`shown`)."""
OF_DRIVE = {"u_p_max": "command\nused", "saturation_time": "command\nsaturated"}
"""Heads of the same where a drive takes a speed command."""


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
    from stillhook.engine.arguments import cycles
    from stillhook.engine.simulate import dataset_of, run_cases, unchanged
    from stillhook.formats.case_file import load_case, stored_cases

    check_out(out, OUT_FILES)
    files = stored_cases(case_file) if case_file.suffix == ".nc" else [load_case(case_file)]
    crane, case, cranes = files[0].crane, files[0].case, [f.crane for f in files]
    labels = _labels([f.case.name for f in files], case_file.stem)
    try:
        with progress_bar(case_file.stem) as bar:
            cases, every = [f.case for f in files], cycles(crane, files[0].every)
            progress = started(crane, bar, series=True)
            runs = run_cases(cranes, cases, step=files[0].step, every=every, keep=unchanged, progress=progress)
    except StillhookError as e:
        raise type(e)(f"{case_file.name}: {e}") from None
    summaries = {label: r.summary for label, r in zip(labels, runs, strict=True)}
    title = title_of(crane, case)
    answer = runs[0].summary if len(runs) == 1 else summaries
    present(answer, brief=lambda: answer_of_runs("case", crane, summaries, title), json=json)
    if out is not None:
        data = {label: dataset_of([r]) for label, r in zip(labels, runs, strict=True)}
        all_cases = dataset_of(runs, labels) if len(runs) > 1 else data[labels[0]]
        _write(out, data, summaries, all_cases, quiet=json, crane=crane, title=title)
    raise typer.Exit(0 if all(r.ok for r in runs) else 1)


def compare(
    crane: SubjectArgument = "nov-250t",
    load: Load = None,
    s_w: WireOut = None,
    motion: MotionText = None,
    controllers: Annotated[str | None, typer.Option(help=f"{MODES}.{USUAL}")] = None,
    duration: Duration = None,
    drives: Annotated[
        str | None,
        typer.Option(help=f"Drives, each sized for this crane: {DRIVES}; or a table of their costs (stillhook new)."),
    ] = None,
    plan: Annotated[
        str | None, typer.Option(help="With --drives: lift plan; days that each drive gains in a year.")
    ] = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Run one motion under several controllers, or with several drives, and put them side by side.

    Without --motion the tip moves as a sine of 2.8 m and 12 s for 120 s, 30 s of them not counted. Warm-up, delay
    of the motion signal, place of the tip for a ship log and time step are those of a case file. One with
    settings.faults gives a table of sensor faults by controllers. Exit code 1 if none stays inside its limits, or where
    a fault is survived by none.

    Example: stillhook compare nov-250t --load "100 t" --s-w "100 m" --motion "sine 2.8 m 12 s" --controllers
    ns,hs,ssc

    Example: stillhook compare nov-250t --load "100 t" --motion "sine 2 m 10 s" --drives
    active-passive,pure-active,secondary,digital,cylinder,electric,open-circuit
    """
    from stillhook.analysis.controllers import compare as side_by_side
    from stillhook.formats.case_file import load_subject

    if drives is None:
        refuse({"--plan": plan}, "belongs to --drives. Give it, or leave this out.")
        check_out(out, OUT_FILES)
    else:
        refuse({"--controllers": controllers}, "--drives gives each drive its own controller. Leave one of them out.")
    subject = load_subject(crane)
    case = case_of(subject, USUAL_CASE, load, s_w, motion, duration)
    if drives is not None:
        raise typer.Exit(0 if compare_drives(subject, case, drives, plan=plan, out=out, json=json) else 1)
    chosen = None if controllers is None else [m.strip().lower() for m in controllers.split(",") if m.strip()]
    if subject.settings.faults is not None:
        raise typer.Exit(0 if compare_faults(subject, case, chosen, out=out, json=json) else 1)
    with progress_bar("comparing") as bar:
        progress = started(subject.crane, bar, series=True, report=getattr(case.tip, "report", ""))
        result = side_by_side(subject.crane, case, chosen, step=subject.step, progress=progress)
    title = title_of(result.crane, result.runs[0].case)
    runs = result.table()
    step = f"stillhook stability {argument(result.crane.name)}, for the margins of the position loop"
    present(runs, brief=lambda: answer_of_runs("mode", result.crane, runs, title, step, result.yielding), json=json)
    if out is not None:
        write_comparison(result, out, quiet=json)
    raise typer.Exit(0 if result.ok else 1)


def title_of(crane: Crane, case: Any) -> str:
    """A run in a line: crane, load, wire, motion."""
    medium = "in water" if case.water else "in air"
    tip = case.tip.describe().split(":")[0]
    return f"{crane.name}, {show(case.load, 'mass')} {medium}, {show(case.s_w, 'length')} of wire out, tip: {tip}"


OF_BRIEF = {
    "e_c_pp": "error p-p",
    "load_pp": "load p-p",
    "eta_c": "efficiency",
    "p_max": "peak pressure",
    "u_p_max": "pump use",
}
"""Numbers of a run in its short answer, where its winch type has them."""


def answer_of_runs(
    head: str,
    crane: Crane,
    runs: Mapping[str, Mapping[str, Any]],
    title: str,
    step: str = "",
    yielding: Sequence[str] = (),
) -> Answer:
    """Error, efficiency, pressure and status of each run; the one with the smallest error; notes. head: of the first
    column of the full table; yielding: runs whose controllers give wire on purpose, so that the load's motion of
    all runs counts as well."""
    first, of_type = next(iter(runs.values())), crane.plant.type.shown
    names = [name for name in OF_BRIEF if name in first]
    common, brief = HEADERS | ({"load_pp": "load\np-p 30 s"} if yielding else {}), OF_BRIEF
    if not crane.circuits:
        common, brief = common | OF_DRIVE, OF_BRIEF | {"u_p_max": "command used"}
    rows = [[label, *(cell(n, run[n]) for n in names), str(run["status"])] for label, run in runs.items()]
    heads = [head, *common.values(), *of_type.values(), "status"]
    full = [[label, *(cell(n, run[n]) for n in (*common, *of_type, "status"))] for label, run in runs.items()]
    within = {label: run for label, run in runs.items() if run["status"] == "ok"}
    best = min(within, key=lambda label: within[label]["e_c_pp"], default="")
    outcome = "All runs exceeded a limit." if not best else ""
    if best and len(runs) > 1:
        outcome = f"Smallest control error within the limits: {best}, {cell('e_c_pp', runs[best]['e_c_pp'])} p-p."
    if yielding and best:
        stillest = min(within, key=lambda label: within[label]["load_pp"])
        outcome += f" Smallest motion of the load: {stillest}, {cell('load_pp', runs[stillest]['load_pp'])} p-p."
    notes = [
        f"{name}: its control error holds the wire that it gives on purpose: judge by load p-p" for name in yielding
    ]
    lines: list[Line] = [
        *columns(["", *(brief[n] for n in names), "status"], rows, left=(0, len(names) + 1)),
        partial(print_table, heads, full),
        outcome,
        *twin_lines(crane),
    ]
    notes += [f"{label}: {note}" for label, run in runs.items() for note in run["notes"]]
    return Answer(title, lines, step, "offset, largest error, saturation, relief", notes)


def write_comparison(result: Comparison, out: Path, *, quiet: bool, hint: bool = True, start: float = 0.0) -> None:
    """hint: say where pictures are left out."""
    data, title = result.dataset(), title_of(result.crane, result.runs[0].case)
    runs = {mode.upper(): data.sel(case=mode) for mode in result.table()}
    _write(out, runs, result.table(), data, quiet=quiet, hint=hint, crane=result.crane, title=title, start=start)


def _write(
    out: Path,
    runs: dict[str, Any],
    summary: dict[str, Any],
    all_cases: Any,
    *,
    quiet: bool,
    hint: bool = True,
    crane: Crane,
    title: str,
    start: float = 0.0,
) -> None:
    """Picture, NetCDF and summary of a set of runs."""
    from stillhook.report.plots.run import four_panels

    picture, series, numbers = OUT_FILES
    p_relief = crane.active.relief.p if "active" in crane.circuits else None
    write_out(
        out,
        {series: all_cases, numbers: summary},
        pictures=lambda: {picture: four_panels(runs, title=title, start=start, p_relief=p_relief)},
        quiet=quiet,
        hint=hint,
        cranes=[crane],
    )


def _labels(names: list[str], stem: str) -> list[str]:
    """A label for each case of a file, no two alike."""
    labels = [name or (stem if len(names) == 1 else str(i)) for i, name in enumerate(names)]
    return [f"{label} ({i})" if labels.count(label) > 1 else label for i, label in enumerate(labels)]


OF_LOWERING = {
    "t_begin": "from",
    "s_tip_pp": "tip\np-p 30 s",
    "e_c_pp": "error\np-p 30 s",
    "load_pp": "load\np-p 30 s",
    "F_sling_min": "slings\nleast",
    "F_sling_max": "slings\nmost",
    "DAF": "DAF",
    "sling_slack_time": "slings\nslack",
    "saturation_time": "pumps\nsaturated",
}
"""Numbers of a phase of a lowering, with their heads."""


MOST_FILMED = 3
"""Controllers side by side in one film at most."""
FILM_HELP = (
    "Film to scale of these controllers side by side, such as ns,ssc; with --out (MP4, or a page without ffmpeg)."
)


HOISTING_HELP = (
    'In place of the run: the lowest of these hoisting speeds without a second hit, such as "6 to 36 m/min by 6 m/min".'
)
MOST_SPEEDS = 40
"""Hoisting speeds that a range may have."""
OF_SPEED = {
    "hoisting\nspeed": ("v", "speed"),
    "starts with a\nsecond hit": ("share", ""),
    "its\nspeed": ("v_hit", "speed"),
    "hook load\nmost": ("F_hook", "force"),
    "at the tip\nmost": ("F_tip", "force"),
    "slings\nslack": ("slack", "time"),
    "wire speed\nreached": ("v_w", "speed"),
}
"""Numbers of a hoisting speed, with their heads."""


def lower(
    lift: LiftArgument,
    out: Out = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the waves, in place of the file's.")] = None,
    duration: Annotated[
        str | None, typer.Option(help='Length of the run, in place of the file\'s, such as "20 min".')
    ] = None,
    film: Annotated[str | None, typer.Option("--film", help=FILM_HELP)] = None,
    hoisting_speeds: Annotated[str | None, typer.Option(help=HOISTING_HELP)] = None,
    json: Json = False,
) -> None:
    """Lower a payload by a winch programme: splash zone, lowering in heave compensation, landing, all in one run; or
    lift it off a moving deck, or set it down there.

    Exit code 1 where a limit was passed, the load was too heavy, slings went slack before touch-down, the load touched
    seabed or deck in a phase that does not land, a deck hit it again, or the programme got stuck or was not finished.

    Example: stillhook lower anchor-to-3000m --out anchor

    Example: stillhook lower template-through-the-surface --out template --film ns,ssc

    Example: stillhook lower anchor/lowering.nc, to run a stored lowering again

    Example: stillhook lower lift-off.toml --hoisting-speeds "6 to 36 m/min by 6 m/min"
    """
    from stillhook.engine.lowering.run import setup_of
    from stillhook.engine.simulate import simulate
    from stillhook.formats.lift_file import load_lift, stored_lift
    from stillhook.report.save import FILMS, LOWERING_FILES, lowering_answer, write_lowering

    if film is not None and out is None:
        raise LiftError("--film: is written to a folder. Give --out as well.")
    if hoisting_speeds is not None:
        refuse({"--out": out, "--film": film}, "--hoisting-speeds writes no files. Leave it out.")
        _hoist(lift, hoisting_speeds, seed, duration, json=json)
        return
    if film is not None:
        need("matplotlib", "--film", LiftError)
    check_out(out, LOWERING_FILES if film is None else (*LOWERING_FILES, *FILMS))
    if lift.endswith(".nc"):
        refuse({"--seed": seed, "--duration": duration}, "a stored run is run again as it was. Leave it out.")
        file = stored_lift(lift)
    else:
        file = load_lift(lift, seed=seed, duration=duration)
    wanted = {} if film is None else _filmed(file, film)
    runs: dict[str, Any] = {}
    try:
        for name, case in {file.lift.controller.value: file.lift, **wanted}.items():
            with progress_bar(f"{file.lift.name}, {name}" if wanted else file.lift.name) as bar:
                runs[name] = simulate(
                    file.crane,
                    case,
                    step=file.step,
                    every=file.every,
                    sampling=file.sampling,
                    end=file.end,
                    progress=started(file.crane, bar, series=True, setup=setup_of(case)),
                )
    except StillhookError as e:
        raise type(e)(f"{Path(lift).name}: {e}") from None
    run = runs[file.lift.controller.value]
    answer = lowering_answer(run, file)
    if wanted:
        say("drawing the film ...")
    films = {name: runs[name] for name in wanted}
    written = write_lowering(out, run, file, answer, film=films) if out is not None else ()
    present(answer, brief=lambda: _answer_of_lowering(file, answer), json=json)
    if out is not None:
        announce(out, written, quiet=json)
        say_left_out()
    raise typer.Exit(0 if answer["status"] == "ok" else 1)


def _hoist(lift: str, text: str, seed: int | None, duration: str | None, *, json: bool) -> None:
    """The lowest of several hoisting speeds at which a deck does not hit its load again."""
    from stillhook.engine.lowering.hoisting_speed import hoisting_speed
    from stillhook.formats.lift_file import load_lift
    from stillhook.tables.range_text import values_of

    try:
        speeds = [parse(v, "speed", "--hoisting-speeds") for v in values_of(text, "speed", MOST_SPEEDS)]
    except ValueError as problem:
        raise LiftError(f"--hoisting-speeds: {problem}") from None
    file = load_lift(lift, seed=seed, duration=duration)
    try:
        with progress_bar(f"{file.lift.name}, hoisting speeds") as bar:
            found = hoisting_speed(file.crane, file.lift, speeds, progress=bar)
    except StillhookError as e:
        raise type(e)(f"{Path(lift).name}: {e}") from None
    rows = [row._asdict() for row in found.rows]
    head = {"lift": file.lift.name, "crane": file.crane.name, "place": file.place}
    answer = {**head, "lowest": found.lowest, "starts": found.starts, "span": found.span, "speeds": rows}
    none = f"No speed of these avoids a second hit: {show(found.rows[-1].v, 'speed')} has one. Give higher ones."
    lowest = f"Lowest hoisting speed without a second hit: {show(found.lowest, 'speed')}"
    over = f"{found.starts} starts over {show(found.span, 'time')}"
    line = none if math.isnan(found.lowest) else f"{lowest}, of {over} at each speed."

    cells = [
        [f"{row.share:.0%}" if k == "share" else show(getattr(row, k), kind) for k, kind in OF_SPEED.values()]
        for row in found.rows
    ]
    lines: list[Line] = [partial(print_table, list(OF_SPEED), cells), line]
    title = f"{file.lift.name}: {file.crane.name}, {file.place}"
    present(answer, brief=lambda: Answer(title, lines, more="every speed"), json=json)


def _filmed(file: LiftFile, text: str) -> dict[str, Lowering]:
    """The lift under each controller that is to be filmed, in the order given."""
    from stillhook.winches.registry import WINCH_TYPES

    known = {mode.value: mode for mode in WINCH_TYPES[file.crane.plant].modes}
    names = list(dict.fromkeys(each.strip().lower() for each in text.split(",")))
    if unknown := [name for name in names if name not in known]:
        raise LiftError(f"--film: unknown controller {quote(unknown[0])}. Choose of {', '.join(known)}.")
    if len(names) > 1 and not any(phase.compensated for phase in file.lift.programme):
        raise LiftError("--film: no phase of this lift is compensated, so controllers do not differ. Give one.")
    if len(names) > MOST_FILMED:
        raise LiftError(f"--film: {len(names)} controllers. Give {MOST_FILMED} at most.")
    return {name: file.lift.model_copy(update={"controller": known[name]}) for name in names}


def _answer_of_lowering(file: LiftFile, answer: dict[str, Any]) -> Answer:
    """Status, tension against what is allowed, the worst phase, touch-down and compensation of a lowering."""
    from stillhook.physics.scalar import G

    allowed, phases = (file.crane.SWL + file.crane.hook_mass) * G, answer["phases"]
    used = f"{show(answer['F_w_max'], 'force')} of {show(allowed, 'force')} (SWL and hook)"
    load, heads = file.lift.payload, OF_LOWERING
    if not file.crane.circuits:
        heads = OF_LOWERING | {"saturation_time": OF_DRIVE["saturation_time"]}
    rows = [[row["name"], row["described"], *(cell(name, row[name]) for name in OF_LOWERING)] for row in phases]
    of_load = f"{load.title or load.name}, {show(load.mass, 'mass')}; water {show(file.lift.depth, 'length')} deep"
    lines: list[Line] = [
        partial(wrapped, of_load),
        partial(print_table, ["phase", "description", *heads.values()], rows, left=2),
        f"Status: {answer['status']}; {len(phases)} phases, {show(answer['duration'], 'time')} in all.",
        f"Largest tension at the crane tip: {used}, utilisation {answer['F_w_max'] / allowed:.2f}.",
    ]
    slings = [row for row in phases if not math.isnan(row["F_sling_min"])]
    if slings:
        least = min(slings, key=lambda row: row["F_sling_min"])
        most = max(slings, key=lambda row: row["DAF"])
        lines.append(
            f"Slings: least {cell('F_sling_min', least['F_sling_min'])} in {least['name']}; largest DAF"
            f" {cell('DAF', most['DAF'])} in {most['name']}."
        )
    if (unit := file.lift.compensator) is not None:
        from stillhook.winches.load_path.registry import UNITS

        lines.append(partial(wrapped, UNITS[unit.type].summary(unit, answer)))
    lines += _off_deck(file, answer)
    if not math.isnan(answer["t_landed"]) and not file.lift.on_deck:
        slack = answer["sling_slack_landed_time"]
        after = f", slings slack for {show(slack, 'time')} from then on" if slack > 0.0 else ""
        at = f"after {show(answer['t_landed'], 'time')} at {show(answer['v_landed'], 'speed')}"
        lines.append(f"Touch-down {at}{after}.")
    compensated = [row for row in phases if row["mode"] == "ahc" and not math.isnan(row["eta_load"])]
    if compensated:
        row = min(compensated, key=lambda row: row["eta_load"])
        lines.append(
            f"Least compensation: {row['eta_c']:.0%} at the winch, {row['eta_load']:.0%} at the load, in {row['name']}."
        )
    title = f"{answer['lift']}: {load.title or load.name}, {answer['crane']}, {file.place}"
    return Answer(title, [*lines, *twin_lines(file.crane)], more="every phase", notes=answer["notes"])


def _off_deck(file: LiftFile, answer: dict[str, Any]) -> list[str]:
    """When a load left the deck that it started on, and how the deck hit it again."""
    if not file.lift.on_deck:
        return []
    if math.isnan(answer["t_lift_off"]):
        return ["The payload does not leave the deck."]
    hits = int(answer["second_hits"])
    again = (
        f"{counted(hits, 'second hit')}, up to {show(answer['v_second_hit_max'], 'speed')}" if hits else "no second hit"
    )
    return [f"Lift-off after {show(answer['t_lift_off'], 'time')}; {again}."]
