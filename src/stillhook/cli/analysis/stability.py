"""`stillhook stability`: how far the position loop is from swinging."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from stillhook.cli.parser import CONTROLLERS, Json, check_out, refuse, write_out
from stillhook.errors import CommandError
from stillhook.report.formatting import display_number, display_unit
from stillhook.report.terminal import print_implausible, print_json, print_table
from stillhook.units import parse, show
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    from stillhook.analysis.controllers import Controller
    from stillhook.analysis.loop_stability.stability import Stability
    from stillhook.analysis.loop_stability.verdict import Verdict, WireDamping
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Mode

CraneName = Annotated[str, typer.Argument(help="Library crane, or path of a crane file.", metavar="CRANE")]
ALPHA_HELP = (
    "Motor displacement over its maximum; repeat it for several. Default: where the mode's law puts the motors at each"
    " place."
)
CONTROLLER_HELP = (
    f"Controller whose loop is judged: {CONTROLLERS}, strong-ssc or a TOML file (default: ssc on closed circuits,"
    " position on other winches)."
)
DELAY_HELP = 'Delay of the position feedback (encoder, bus, computing), such as "50 ms". Not that of the motion unit.'
FULL_HELP = "One operating point of the complete plant, at --load, --s-w and --v-tip, as a table."
LOAD, WIRE = "100 t", "100 m"
"""Default operating point of the complete plant alone."""
LOAD_HELP = f'Payload on the hook (default: empty hook to the heaviest of the mode; with --full "{LOAD}").'
WIRE_HELP = f'Wire paid out (default: from 15 m to all; with --full "{WIRE}").'
SPEED_HELP = 'Steady speed of the tip, such as "60 m/min" (default: 0.5 m/min to full speed, up and down).'
PLAIN = ("K_p_ms", "omega_c", "gain_margin", "phase_margin", "omega_gc", "delay_margin", "sensitivity_peak", "stable")
"""Rows that have a second value with PLC and delay."""
WHERE = ("alpha_m", "K_wire", "J_m", "omega_0", "zeta", "period", "K_p")


def stability(
    name: CraneName,
    controller: Annotated[str | None, typer.Option("--controller", "--mode", help=CONTROLLER_HELP)] = None,
    alpha_m: Annotated[list[float] | None, typer.Option("--alpha-m", help=ALPHA_HELP)] = None,
    layer: Annotated[
        int | None, typer.Option(help="The published loop alone, on a layer of the drum, as a table (a reference).")
    ] = None,
    delay: Annotated[str, typer.Option(help=DELAY_HELP)] = "0 s",
    v_tip: Annotated[str | None, typer.Option("--v-tip", help=SPEED_HELP)] = None,
    full: Annotated[bool, typer.Option("--full", help=FULL_HELP)] = False,
    load: Annotated[str | None, typer.Option(help=LOAD_HELP)] = None,
    s_w: Annotated[str | None, typer.Option("--s-w", help=WIRE_HELP)] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for pictures, sweeps (NetCDF) and stability.json.")
    ] = None,
    json: Json = False,
) -> None:
    """Is the position loop stable, and by how much: the complete plant with its PLC on the crane's own wire, from the
    empty hook to the SWL, from a short wire to all of it, from 0.5 m/min to full speed.

    Settings, displacement law and memory (an integral part) are those of the controller. Exit code 1 where it
    oscillates at any place with its K_p.

    Example: stillhook stability nov-250t --alpha-m 1 --alpha-m 0.6 --delay "50 ms"

    Example: stillhook stability nov-250t --controller strong-ssc
    """
    from stillhook.analysis.controllers import controller as named
    from stillhook.analysis.loop_stability.governing import by_engine
    from stillhook.library import load_crane
    from stillhook.tables.plausible import implausible_values

    check_out(out, NAMES)
    crane = load_crane(name)
    chosen = named(crane.plant.type.default_mode.value if controller is None else controller)
    crane = chosen.on(crane)
    speed, late = None if v_tip is None else parse(v_tip, "speed", "--v-tip"), parse(delay, "time", "--delay")
    alphas: list[float | None] = [*alpha_m] if alpha_m else [None]
    mass = None if load is None else parse(load, "mass", "--load")
    wire = None if s_w is None else parse(s_w, "length", "--s-w")
    closed = not by_engine(crane)
    if not closed:
        refuse(
            {"--alpha-m": alpha_m, "--layer": layer, "--full": full},
            f'belongs to closed circuits, and winch type "{crane.plant}" is none; its margins are those of the complete'
            " plant. Leave it out.",
        )
    if full or layer is not None:
        answer = _reference(
            crane,
            alphas,
            layer,
            mass,
            wire,
            speed,
            late,
            full=full,
            load=load,
            s_w=s_w,
            controller=controller,
            mode=chosen.mode,
        )
        table, ok = answer.table, all(c.loop.ok for c in answer.columns)
    else:
        found = _verdicts(crane, chosen, alphas, mass, wire, speed, late)
        table, ok = _lists([v.table() for v in found]), all(v.ok for v in found)
    table = table | {"controller": chosen.name, "notes": list(implausible_values(crane))}
    if json:
        print_json(table)
    elif full or layer is not None:
        _report(crane, answer)
    else:
        for alpha, v in zip(alphas, found, strict=True):
            _answer(v, chosen.name, alpha)
        print_implausible(crane)
    if out is not None:
        if closed:
            _write(out, crane, alphas, table, late, quiet=json)
        else:
            write_out(out, {"stability.json": table}, quiet=json)
    raise typer.Exit(0 if ok else 1)


def _verdicts(
    crane: Crane,
    chosen: Controller,
    alphas: list[float | None],
    load: float | None,
    s_w: float | None,
    v_tip: float | None,
    delay: float,
) -> list[Verdict]:
    """The one margin at each displacement."""
    from stillhook.analysis.loop_stability.verdict import verdict

    where: dict[str, Any] = {"loads": None if load is None else (load,), "wires": None if s_w is None else (s_w,)}
    return [verdict(crane, chosen.mode, alpha_m=a, v_tip=v_tip, delay=delay, **where) for a in alphas]


def _answer(v: Verdict, controller: str, alpha: float | None) -> None:
    """The answer in lines, the verdict first."""
    motors = "" if alpha is None else f", motors at {alpha:.3g}"
    K_p, n = show(v.K_p, "gain_per_length", 4), len(v.found.places)
    where = f"{v.crane}, {controller}{motors}, K_p {K_p}"
    where += f", delay {show(v.delay, 'time')}" if v.delay else ""
    if v.ok:
        print_folded(f"{where}: STABLE at all {n} places.")
    elif v.oscillates:
        print_folded(f"{where}: UNSTABLE, the complete plant oscillates at {len(v.oscillates)} of {n} places.")
    else:
        print_folded(f"{where}: UNSTABLE, {v.found.describe()}.")
    for line in (*_regardless(v), *_by_gain(v), *_margin(v), *_damping_lines(v.damping), *_published(v)):
        print_folded(line)


WIDTH = 100
"""Columns of the answer."""


def print_folded(line: str) -> None:
    """A sentence within `WIDTH` columns, what goes on set in."""
    print(textwrap.fill(line, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False))


def _regardless(v: Verdict) -> list[str]:
    """Places that no gain stabilises."""
    places = v.found.no_gain
    if not places:
        return []
    worst = max(places, key=lambda p: (p.place.load, abs(p.place.v_tip)))
    loads, speeds = [p.place.load for p in places], [abs(p.place.v_tip) for p in places]
    return [
        f"No gain K_p stabilises the complete plant at {show(worst.place.load, 'mass', 4)},"
        f" {show(abs(worst.place.v_tip), 'speed', 3)}, {show(worst.place.s_w, 'length', 4)} of wire.",
        f"That holds at {len(places)} places, from {show(min(loads), 'mass', 3)} and up to"
        f" {show(max(speeds), 'speed', 3)}; look at friction and damping of the wire.",
    ]


def _by_gain(v: Verdict) -> list[str]:
    """Places that oscillate at K_p and not at another gain."""
    places = [p for p in v.oscillates if p.gains.any]
    if not places:
        return []
    least = min(places, key=lambda p: p.gains.high)
    low = f"{show(least.gains.low, 'gain_per_length', 3)} to " if least.gains.low else "below "
    return [
        f"At {len(places)} place{'s' if len(places) > 1 else ''} K_p decides; least: {least.describe()}, stable"
        f" {low}{show(least.gains.high, 'gain_per_length', 3)}."
    ]


def _margin(v: Verdict) -> list[str]:
    """The margin where the plant does not oscillate without feedback, and the largest gain."""
    m, least = v.margins, v.found.limit
    if m is None or least is None:
        return ["No margin: no place is clear of the speeds at which it oscillates without feedback."]
    away = ", a Stribeck speed faster than that," if v.found.no_gain else ""
    at = f"{least.describe()}, limit {show(least.gains.high, 'gain_per_length', 4)}"
    if m.gain_margin > 1.0:
        margin = (
            f"Gain margin{away} {20.0 * math.log10(m.gain_margin):.3g} dB (factor {m.gain_margin:.3g}), phase margin"
            f" {math.degrees(m.phase_margin):.3g} deg, least at {at}."
        )
    else:
        margin = f"K_p is above its limit{away}, least at {at}."
    strong = show(v.found.K_p, "gain_per_length", 3)
    of = " of the proportional part" if v.found.remembers else ""
    largest = (
        f"Largest K_p{of} with gain margin 2, 45 deg and sensitivity peak 2 at a PLC cycle of"
        f" {show(v.t_cycle, 'time')}:"
    )
    return [margin, f"{largest} {strong} ({v.found.describe()})."]


def _damping_lines(damping: Sequence[WireDamping]) -> list[str]:
    """What the wire's damping decides."""
    whose = {"crane": "the crane's", "paper C": "paper C's", "least": "least", "most": "most"}
    cells = [f"{d.zeta:g} ({whose[d.whose]}) {d.oscillates}, {d.no_gain}" for d in damping]
    places = max((d.places for d in damping), default=0)
    return [f"Wire damping, places of {places} that oscillate with K_p, and with any gain: {'; '.join(cells)}."]


def _published(v: Verdict) -> list[str]:
    """The published loop, as a reference."""
    s = v.published
    if s is None:
        return []
    return [
        f"Published loop (paper E, for reference): limit {show(s.K_p_ms, 'gain_per_length', 4)} with motors at"
        f" {s.alpha_m:.3g}, {20.0 * math.log10(s.gain_margin):.3g} dB."
    ]


class _Column(NamedTuple):
    """A loop in the table: its name and its margins."""

    name: str
    loop: Stability


class _Answer(NamedTuple):
    """Columns of the table, the output of --json, the operating points of the loops, and the verdict in sentences."""

    columns: list[_Column]
    table: dict[str, Any]
    where: str
    verdict: list[str]


def _reference(
    crane: Crane,
    alphas: list[float | None],
    layer: int | None,
    mass: float | None,
    wire: float | None,
    v_tip: float | None,
    delay: float,
    *,
    full: bool,
    load: str | None,
    s_w: str | None,
    controller: str | None,
    mode: Mode,
) -> _Answer:
    """One operating point of the complete plant, or the published loop on a layer."""
    speed = 0.0 if v_tip is None else v_tip
    if not full:
        refuse(
            {"--load": load, "--s-w": s_w, "--controller": controller},
            "--layer applies to the published loop only. Leave one of them out.",
        )
        assert layer is not None
        return _on_layer(crane, alphas, layer, speed, delay)
    refuse(
        {"--layer": layer},
        "belongs to the published model; with --full the wire paid out determines the layer. Leave it out.",
    )
    mass = parse(LOAD, "mass") if mass is None else mass
    return _full(crane, alphas, mass, parse(WIRE, "length") if wire is None else wire, speed, delay, mode)


def _full(
    crane: Crane, alphas: list[float | None], load: float, s_w: float, v_tip: float, delay: float, mode: Mode
) -> _Answer:
    """The complete plant at one operating point."""
    from stillhook.analysis.loop_stability.stability import full_stability

    if v_tip == 0.0:
        raise CommandError(
            '--full needs --v-tip, such as "10 m/min": a winch at rest sticks, and its loop has no limit until it'
            " slides."
        )
    where_at: dict[str, Any] = {"load": load, "s_w": s_w, "v_tip": v_tip, "mode": mode, "delay": delay}
    results = [full_stability(crane, alpha_m=a, **where_at) for a in alphas]
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
    line = "Published loop only, a reference: what the crane is judged by is the complete plant, without --layer."
    return answer._replace(verdict=[*answer.verdict, line])


def _alone(loops: list[Stability], where: str) -> _Answer:
    columns = [_Column(f"motors {s.alpha_m:.3g}", s) for s in loops]
    return _Answer(columns, _lists([s.table() for s in loops]), where, [_verdict(c.name, c.loop) for c in columns])


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

    rows = [row(n, n) for n in (*WHERE, *PLAIN)]
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


def _write(
    out: Path, crane: Crane, asked: list[float | None], table: dict[str, Any], delay: float, *, quiet: bool
) -> None:
    """Pictures and sweeps of the published loop and of the slow plant, and the table."""
    from stillhook.analysis.loop_stability.figures import all_figures, all_sweeps

    alphas = tuple(dict.fromkeys(1.0 if a is None else a for a in asked))
    data = all_sweeps(crane, alphas[0], delay=delay)

    def pictures() -> dict[str, Any]:
        return {f"{stem}.png": figure for stem, figure in all_figures(crane, alphas, data, delay=delay).items()}

    files: dict[str, Any] = {f"{over}.nc": dataset for over, dataset in data.items()}
    write_out(out, files | {"stability.json": table}, pictures=pictures, quiet=quiet)
