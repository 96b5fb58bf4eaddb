"""`stillhook friction compare` and `draws`: parameter sets of friction, and what their uncertainty means for a lift."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import MODES, Draws, Json, Load, Out, case_of, check_out, present
from stillhook.cli.runs.simulation import USUAL_CASE, title_of
from stillhook.errors import IdentifyError
from stillhook.report.formatting import cell, wrapped
from stillhook.report.terminal import Answer, Cells, Line, columns, print_table, progress_bar
from stillhook.units import number, parse, show

if TYPE_CHECKING:
    import xarray

NAMES = ("e_c_pp", "eta_c", "p_max", "u_p_max")
"""What the bands are of."""
BAND = {"low": 0.05, "median": 0.5, "high": 0.95}
"""Ends and middle of a printed band, as shares of the draws below."""
FILES = ("friction-sets.png", "friction-sets.json")


def compare(
    sets: Annotated[list[str], typer.Argument(metavar="SET...", help="Sets of the library, or paths of .toml files.")],
    load: Annotated[
        str, typer.Option(help='Load on the hook, such as "100 t"; its torque is that on the crane\'s layer.')
    ] = "100 t",
    crane: Annotated[str, typer.Option(help="Crane whose drum and hook turn the load into drum torque.")] = "nov-150t",
    layer: Annotated[int | None, typer.Option(help="Layer of wire (default: the outermost).")] = None,
    torque: Annotated[
        str | None, typer.Option("--drum-torque", help='Drum torque instead of a load, such as "1.5 MN m".')
    ] = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """System frictions side by side: Coulomb, stiction and viscous parts over motor speed, 95 % bands where they
    are known.

    Example: stillhook friction compare crane-1 crane-2 --load "100 t" --crane nov-150t --out figures
    """
    from stillhook.identify.compare import Split, figure, notes, speeds, split, table
    from stillhook.library import load_friction

    check_out(out, FILES)
    T_d, description = _drum_torque(load, crane, layer, torque)
    items = {name: load_friction(name) for name in sets}
    names = [item.name for item in items.values()]
    distinct = [
        item if names.count(item.name) == 1 else replace(item, name=name_or_path)
        for name_or_path, item in items.items()
    ]
    splits: list[Split] = [split(item, T_d, speeds()) for item in distinct]
    rows = table(splits)
    remarks = notes(splits, T_d)
    data = {"T_d": T_d, "sets": rows, "notes": [*remarks]}
    if all(s.half is None for s in splits):
        remarks.append("No set here has a stated uncertainty.")
    picture, numbers = FILES
    pictures = lambda: {picture: figure(splits, T_d, description)}
    brief = partial(_answer, rows, T_d, description, remarks)
    present(data, out, {numbers: data}, brief=brief, json=json, pictures=pictures)


def _drum_torque(load: str, crane: str, layer: int | None, torque: str | None) -> tuple[float, str]:
    """Drum torque [N m], and what gives it in words."""
    from stillhook.identify.compare import drum_torque
    from stillhook.library import load_crane

    if torque is not None:
        T_d = parse(torque, "drum_torque", "--drum-torque")
        if T_d < 0.0:
            raise IdentifyError(f'--drum-torque "{torque}": give 0 or more.')
        return T_d, ""
    machine = load_crane(crane)
    mass = parse(load, "mass", "--load")
    n = machine.drum.layers if layer is None else layer
    return drum_torque(machine, mass, layer), f"{show(mass, 'mass')} and the hook on layer {n} of {machine.name}"


def _answer(rows: list[dict[str, Any]], T_d: float, description: str, remarks: list[str]) -> Answer:
    """Coulomb part and the whole at each speed, a set a row; stiction, viscous part, intervals."""
    speeds = list(rows[0]["total"])
    short = [[r["set"], f"{r['coulomb']:.1f}", *(f"{r['total'][s]:.1f}" for s in speeds)] for r in rows]
    header = ("set", "Coulomb", "stiction\nat rest", "viscous at\n1000 rev/min", *(f"total at\n{s}" for s in speeds))
    body = []
    for r in rows:
        totals = [
            f"{r['total'][s]:.1f}" + ("" if r["half_95"][s] is None else f" ± {number(r['half_95'][s], 2)}")
            for s in speeds
        ]
        body.append((r["set"], f"{r['coulomb']:.1f}", f"{r['stiction']:.1f}", f"{r['viscous_1000']:.1f}", *totals))
    lines: list[Line] = [
        *columns(["set", "Coulomb", *speeds], short),
        partial(print_table, header, body),
        *(partial(wrapped, f"{r['set']}: {r['title']} ({'; '.join(r['sources'])})") for r in rows),
    ]
    title = f"System friction per motor shaft [N m] at a drum torque of {show(T_d, 'drum_torque')}"
    title += f" ({description})" if description else ""
    return Answer(title, lines, more="stiction, viscous part, intervals, sources", notes=remarks, shown=2)


def draws(
    sets: Annotated[
        list[str], typer.Argument(metavar="SET...", help="A friction set, a motor set, or both, each with evidence.")
    ],
    crane: Annotated[
        str, typer.Option(help="Library crane, path of a crane file, or case file: crane and [scenario].")
    ] = "nov-150t",
    load: Load = None,
    controller: Annotated[
        str | None, typer.Option(help=f"{MODES}. Default: the usual one of the winch type, or ssc.")
    ] = None,
    draws: Draws = 64,
    json: Json = False,
) -> None:
    """What the uncertainty of a friction set means for a lift: median and 90 % band of control error and peak pressure.

    Exit code 1 if a draw goes beyond a limit.

    Without a case file the lift is 100 t on 100 m of wire under a tip that moves by 2 m every 12 s.

    Example: stillhook friction draws our-crane.friction.toml --crane our-crane.toml --load "100 t"
    """
    from stillhook.engine.simulate import simulate
    from stillhook.formats.case_file import load_subject
    from stillhook.library import load_set
    from stillhook.library.draws import crane_with, draw_cranes
    from stillhook.variables import BY_NAME

    subject = load_subject(crane)
    machine, n, seed = subject.crane, draws, subject.settings.seed
    case = case_of(subject, USUAL_CASE | {"tip": "sine 2 m 12 s"}, load)
    if controller is not None:
        case = case.with_mode(controller)
    friction, loss = _one_of_each([load_set(name) for name in sets])
    samples = draw_cranes(machine, friction, loss, n, seed)
    middle = crane_with(machine, *(item for item in (friction, loss) if item is not None))
    with progress_bar(f"{n} draws") as bar:
        run = simulate([middle, *samples], case, on_failure="mark", progress=bar)
    spread = _bands(run.isel(case=slice(1, None)))
    at_values = {name: float(run[name][0]) for name in spread}
    notes = [note for note in str(run.notes.values[0]).split("; ") if note]
    beyond = [str(s) for s in run.status.values[1:] if s != "ok"]
    answer = {"draws": n, "seed": seed, "at_values": at_values, "band_90": spread, "beyond_limits": len(beyond)}
    answer["notes"] = notes
    rows = [
        [BY_NAME[k].meaning, *(cell(k, x) for x in (at_values[k], q["median"], q["low"], q["high"]))]
        for k, q in spread.items()
    ]
    bands = [f"{meaning}: {value}, 5 to 95 % {low} to {high}." for meaning, value, _, low, high in rows]
    lines: list[Line] = [
        *map(Cells, bands),
        partial(print_table, ("", "at the set's\nvalues", "median", "5 %", "95 %"), rows),
    ]
    if beyond:
        lines.append(f"{len(beyond)} of {n} draws go beyond a limit: {', '.join(sorted(set(beyond)))}")
    title = f"{n} draws of {' and '.join(sets)}, {title_of(machine, case)}, {case.mode.value}"
    present(answer, brief=lambda: Answer(title, lines, more="medians", notes=notes), json=json)
    raise typer.Exit(1 if beyond else 0)


def _bands(run: xarray.Dataset) -> dict[str, dict[str, float]]:
    """Median and 90 % band of the numbers in `NAMES` that the winch type has, over the draws [SI]."""
    out = {}
    for name in (name for name in NAMES if name in run):
        values = run[name].dropna("case")  # a diverged draw has no numbers, and manual mode no error
        ends = values.quantile(tuple(BAND.values())).values.tolist() if len(values) else [math.nan] * len(BAND)
        out[name] = dict(zip(BAND, ends, strict=True))
    return out


def _one_of_each(items: list[Any]) -> tuple[Any, Any]:
    """The friction set and the motor set among those given, None where there is none."""
    from stillhook.library import FrictionSet

    friction = [i for i in items if isinstance(i, FrictionSet)]
    loss = [i for i in items if not isinstance(i, FrictionSet)]
    if len(friction) > 1 or len(loss) > 1:
        raise IdentifyError("draws: two sets of one kind. Give one friction set, one motor set, or one of each.")
    return (friction[0] if friction else None), (loss[0] if loss else None)
