"""`stillhook stability`: how far the position loop is from swinging."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, NoReturn

import typer

from stillhook.cli.parser import Json, check_out, refuse, write_out
from stillhook.errors import CommandError
from stillhook.report.formatting import display_number, display_unit
from stillhook.report.terminal import print_implausible, print_json, print_table, say
from stillhook.units import parse, show
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    from stillhook.analysis.loop_stability.governing import Place
    from stillhook.analysis.loop_stability.stability import BothLoops, EngineStability, Stability
    from stillhook.spec.crane import Crane

CraneName = Annotated[str, typer.Argument(help="Library crane, or path of a crane file.", metavar="CRANE")]
ALPHA_HELP = (
    "Motor displacement over its maximum; repeat it for several. Default: the displacement of SSC at"
    " the tip's speed, 1 at rest."
)
DELAY_HELP = 'Delay of the position feedback (encoder, bus, computing), such as "50 ms". Not that of the motion unit.'
FULL_HELP = "The complete plant alone, linearised at --load, --s-w and --v-tip."
LOAD, WIRE = "100 t", "100 m"
"""Default operating point of the complete plant alone."""
LOAD_HELP = f'Payload on the hook (default: empty hook and SWL; with --full "{LOAD}").'
WIRE_HELP = f'Wire paid out (default: 15 m and 100 m; with --full "{WIRE}").'
SPEED_HELP = (
    'Steady speed of the tip, up positive, such as "60 m/min" (default: the published loop at rest, the plant at 2 and'
    " 5 m/min)."
)
PLAIN = ("K_p_ms", "omega_c", "gain_margin", "phase_margin", "omega_gc", "delay_margin", "sensitivity_peak", "stable")
"""Rows that have a second value with PLC and delay."""
WHERE = ("alpha_m", "K_wire", "J_m", "omega_0", "zeta", "period", "K_p")


def stability(
    name: CraneName,
    alpha_m: Annotated[list[float] | None, typer.Option("--alpha-m", help=ALPHA_HELP)] = None,
    layer: Annotated[
        int | None, typer.Option(help="Layer that the drum turns on; default: the published outer diameter.")
    ] = None,
    delay: Annotated[str, typer.Option(help=DELAY_HELP)] = "0 s",
    v_tip: Annotated[str, typer.Option("--v-tip", help=SPEED_HELP)] = "0 m/min",
    full: Annotated[bool, typer.Option("--full", help=FULL_HELP)] = False,
    load: Annotated[str | None, typer.Option(help=LOAD_HELP)] = None,
    s_w: Annotated[str | None, typer.Option("--s-w", help=WIRE_HELP)] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for pictures, sweeps (NetCDF) and stability.json.")
    ] = None,
    json: Json = False,
) -> None:
    """Gain limit and margins of the position loop: as published, and of the complete plant where it is slow; which of
    them holds.

    Both with and without PLC and delay. Exit code 1 where the winch oscillates in either: K_p at or above its limit.

    Example: stillhook stability nov-250t --alpha-m 1 --alpha-m 0.6 --delay "50 ms"
    """
    from stillhook.analysis.loop_stability.governing import by_engine
    from stillhook.library import load_crane
    from stillhook.tables.plausible import implausible_values

    check_out(out, NAMES)
    crane = load_crane(name)
    speed, late = parse(v_tip, "speed", "--v-tip"), parse(delay, "time", "--delay")
    alphas: list[float | None] = [*alpha_m] if alpha_m else [None]
    mass = None if load is None else parse(load, "mass", "--load")
    wire = None if s_w is None else parse(s_w, "length", "--s-w")
    if by_engine(crane):
        refuse(
            {"--alpha-m": alpha_m, "--layer": layer, "--full": full},
            f'belongs to closed circuits, and winch type "{crane.plant}" is none; its margins are those of the complete'
            " plant. Leave it out.",
        )
        _of_engine(crane, mass, wire, speed, late, out, json=json)
    if full:
        refuse(
            {"--layer": layer},
            "belongs to the published model; with --full the wire paid out determines the layer. Leave it out.",
        )
        mass = parse(LOAD, "mass") if mass is None else mass
        answer = _full(crane, alphas, mass, parse(WIRE, "length") if wire is None else wire, speed, late)
    elif layer is not None:
        refuse({"--load": load, "--s-w": s_w}, "--layer applies to the published loop only. Leave one of them out.")
        answer = _on_layer(crane, alphas, layer, speed, late)
    else:
        answer = _both(crane, alphas, mass, wire, speed, late)
    answer = answer._replace(table=answer.table | {"notes": list(implausible_values(crane))})
    if json:
        print_json(answer.table)
    else:
        _report(crane, answer)
    if out is not None:
        _write(out, crane, answer, late, quiet=json)
        if not json and (full or layer is not None):
            say("pictures and sweeps show the published loop on the full drum; the table is in stability.json")
    raise typer.Exit(0 if all(c.loop.ok for c in answer.columns) else 1)


OF_ENGINE = (
    "load",
    "s_w",
    "v_tip",
    "K_p",
    "K_p_ms_plc",
    "omega_c_plc",
    "gain_margin_plc",
    "phase_margin_plc",
    "omega_gc_plc",
    "delay_margin_plc",
    "sensitivity_peak_plc",
    "K_p_strong",
)
"""Rows of the margins of a winch type without the closed circuit of the thesis."""


def _of_engine(
    crane: Crane,
    load: float | None,
    s_w: float | None,
    v_tip: float,
    delay: float,
    out: Path | None,
    *,
    json: bool,
) -> NoReturn:
    """Margins out of the linearised engine."""
    from stillhook.analysis.loop_stability.stability import engine_stability
    from stillhook.tables.plausible import implausible_values

    where: dict[str, Any] = {} if s_w is None else {"wires": (s_w,)}
    found = engine_stability(crane, v_tip=v_tip, delay=delay, loads=None if load is None else (load,), **where)
    table = found.table() | {"notes": list(implausible_values(crane))}
    if json:
        print_json(table)
    else:
        rows = [[n, _cell(n, getattr(found, n)), display_unit(n), BY_NAME[n].meaning] for n in OF_ENGINE]
        title = (
            f"{crane.name}, complete plant with its PLC; cycle {show(found.t_cycle, 'time')}, delay"
            f" {show(found.delay, 'time')}"
        )
        print_table(["", "value", "unit", "meaning"], rows, title=title)
        print_implausible(crane)
        print(_engine_verdict(found))
        if found.swings:
            print(_swings(found.swings))
    if out is not None:
        write_out(out, {"stability.json": table}, quiet=json)
    raise typer.Exit(0 if found.ok else 1)


def _engine_verdict(s: EngineStability) -> str:
    """Whether the loop is stable and by how much, in a sentence."""
    if s.ok:
        dB = 20.0 * math.log10(s.gain_margin_plc)
        return (
            f"stable. Gain margin {dB:.3g} dB (K_p can rise by a factor of {s.gain_margin_plc:.3g}), least at"
            f" {s.place.describe()}"
        )
    if s.K_p_ms_plc == 0.0:
        return f"UNSTABLE, whatever K_p: the winch oscillates without feedback at {s.place.describe()}"
    return (
        f"UNSTABLE. K_p {s.K_p:.4g} 1/m, limit {s.K_p_ms_plc:.4g} 1/m at {s.place.describe()}. Lower K_p to"
        f" {s.K_p_strong:.3g} 1/m or less"
    )


class _Column(NamedTuple):
    """A loop in the table: its name, its margins, and the operating point of the complete plant."""

    name: str
    loop: Stability
    place: Place | None = None


class _Answer(NamedTuple):
    """Columns of the table, the output of --json, the operating points of the loops, and the verdict in sentences."""

    columns: list[_Column]
    table: dict[str, Any]
    where: str
    verdict: list[str]


def _full(crane: Crane, alphas: list[float | None], load: float, s_w: float, v_tip: float, delay: float) -> _Answer:
    """The complete plant at one operating point."""
    from stillhook.analysis.loop_stability.stability import full_stability

    if v_tip == 0.0:
        raise CommandError(
            '--full needs --v-tip, such as "10 m/min": a winch at rest sticks, and its loop has no limit until it'
            " slides."
        )
    results = [full_stability(crane, load=load, s_w=s_w, v_tip=v_tip, alpha_m=a, delay=delay) for a in alphas]
    loops, point = [s for s, _ in results], results[0][1]
    where = (
        f"complete plant at {show(-point.v_w, 'speed')} of the tip, {show(point.p_a, 'pressure')} and"
        f" {show(point.p_b, 'pressure')}"
    )
    return _alone(loops, where)


def _on_layer(crane: Crane, alphas: list[float | None], layer: int, v_tip: float, delay: float) -> _Answer:
    """The published loop on one layer."""
    from stillhook.analysis.loop_stability.stability import stability as margins_of

    loops = [margins_of(crane, a, layer=layer, v_tip=v_tip, delay=delay) for a in alphas]
    answer = _alone(loops, f"layer {layer}")
    line = (
        "published loop only: the complete plant is on the layer given by the wire paid out (--s-w in place of --layer)"
    )
    return answer._replace(verdict=[*answer.verdict, line])


def _alone(loops: list[Stability], where: str) -> _Answer:
    columns = [_Column(f"motors {s.alpha_m:.3g}", s) for s in loops]
    return _Answer(columns, _lists([s.table() for s in loops]), where, [_verdict(c.name, c.loop) for c in columns])


def _both(
    crane: Crane, alphas: list[float | None], load: float | None, s_w: float | None, v_tip: float, delay: float
) -> _Answer:
    """The published loop, and the complete plant where it has least gain to spare."""
    from stillhook.analysis.loop_stability.stability import both_loops

    where: dict[str, Any] = {} if s_w is None else {"wires": (s_w,)}
    results = [
        both_loops(crane, a, v_tip=v_tip, delay=delay, loads=None if load is None else (load,), **where) for a in alphas
    ]
    columns = []
    for b in results:
        columns.append(_Column(f"motors {b.published.alpha_m:.3g}\npublished", b.published))
        if b.plant is not None:
            columns.append(_Column(f"motors {b.plant.alpha_m:.3g}\ncomplete plant", b.plant, b.place))
    verdict = [_verdict(f"motors {b.governing.alpha_m:.3g}, {_governs(b)}", b.governing) for b in results]
    verdict += [f"motors {b.published.alpha_m:.3g}: {_swings(b.swings)}" for b in results if b.swings]
    return _Answer(
        columns,
        _lists([b.table() for b in results]),
        "published loop on the outer diameter, complete plant where it is slow",
        verdict,
    )


def _governs(b: BothLoops) -> str:
    """Which of the loops holds, in words."""
    if b.plant is None or b.place is None:
        return "published loop (the gain decides nowhere in the complete plant at these loads)"
    if b.governing is b.published:
        return f"the published loop governs (complete plant at least: {b.place.describe()})"
    return f"the complete plant governs ({b.place.describe()})"


def _swings(places: Sequence[Place]) -> str:
    """Where the plant oscillates whatever the gain, in words."""
    more = f" and at {len(places) - 1} more of the places looked at" if len(places) > 1 else ""
    return (
        f"whatever K_p, the complete plant oscillates at {places[0].describe()}{more}: friction that falls with speed"
        " excites the load's oscillation on its wire. More displacement, speed or damping of the wire ends it."
        " Simulate the case for its amplitude"
    )


def _lists(tables: list[dict[str, Any]]) -> dict[str, Any]:
    """Scalars for one displacement, lists of the same keys for several."""
    return tables[0] if len(tables) == 1 else {key: [t[key] for t in tables] for key in tables[0]}


def _cell(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if not math.isfinite(value):
        return "-"
    return display_number(name, value, 4)


def _report(crane: Crane, answer: _Answer) -> None:

    first = answer.columns[0].loop
    header = ["", *(c.name for c in answer.columns), "unit", "meaning"]

    def row(label: str, name: str, values: Iterable[Any] | None = None) -> list[str]:
        cells = [getattr(c.loop, name) for c in answer.columns] if values is None else values
        return [label, *(_cell(name, v) for v in cells), display_unit(name), BY_NAME[name].meaning]

    rows = []
    if any(c.place for c in answer.columns):
        rows = [
            row(n, n, [math.nan if c.place is None else getattr(c.place, n) for c in answer.columns])
            for n in ("load", "s_w", "v_tip")
        ]
    rows += [row(n, n) for n in (*WHERE, *PLAIN)]
    rows += [row(f"{n}, PLC", f"{n}_plc") for n in PLAIN]
    rows.append(row("K_p_strong", "K_p_strong"))
    title = f"{crane.name}, {answer.where}; PLC cycle {show(first.t_cycle, 'time')}, delay {show(first.delay, 'time')}"
    print_table(header, rows, title=title)
    print_implausible(crane)
    for line in answer.verdict:
        print(line)


def _verdict(name: str, s: Stability) -> str:
    """Whether a loop is stable and by how much, in a sentence."""
    if s.ok:
        least = min(s.gain_margin, s.gain_margin_plc)
        return (
            f"{name}: stable. Gain margin {20.0 * math.log10(least):.3g} dB (K_p can rise by a factor of {least:.3g})."
        )
    if s.K_p_ms == 0.0:
        reason = (
            "Friction falls with speed here, so the winch oscillates without feedback. More displacement or more speed"
            " damps it."
        )
        return f"{name}: UNSTABLE, whatever K_p. {reason}"
    if s.K_p_ms_plc == 0.0 or (s.gain_margin > 1.0 and s.gain_margin_plc > 1.0):
        reason = (
            "The PLC's other loops oscillate: SSC on motors without displacement feedback at this speed, or through the"
            " load cell."
        )
        return f"{name}: UNSTABLE, whatever K_p. {reason}"
    limit = min(s.K_p_ms, s.K_p_ms_plc)
    return f"{name}: UNSTABLE. K_p {s.K_p:.4g} 1/m, limit {limit:.4g} 1/m. Lower K_p to {s.K_p_strong:.3g} 1/m or less."


NAMES = (
    "gain-limit.png",
    "eigenfrequency.png",
    "sweeps.png",
    "bode.png",
    "root-locus.png",
    "motor-poles.png",
    "alpha_m.nc",
    "layer.nc",
    "leakage.nc",
    "damping.nc",
    "bulk_modulus.nc",
    "delay.nc",
    "slow.nc",
    "stability.json",
)
"""Files that --out writes."""


def _write(out: Path, crane: Crane, answer: _Answer, delay: float, *, quiet: bool) -> None:
    """Pictures and sweeps of the published loop at the displacements of the table, and the table."""
    from stillhook.analysis.loop_stability.figures import all_figures, all_sweeps

    alphas = tuple(dict.fromkeys(c.loop.alpha_m for c in answer.columns if c.place is None))
    data = all_sweeps(crane, alphas[0], delay=delay)

    def pictures() -> dict[str, Any]:
        return {f"{stem}.png": figure for stem, figure in all_figures(crane, alphas, data, delay=delay).items()}

    files: dict[str, Any] = {f"{over}.nc": dataset for over, dataset in data.items()}
    write_out(out, files | {"stability.json": answer.table}, pictures=pictures, quiet=quiet)
