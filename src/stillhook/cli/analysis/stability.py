"""`stillhook stability`: how far the position loop is from swinging."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from stillhook.cli.parser import CONTROLLERS, CraneArgument, Json, Out, check_out, present, refuse, write_out
from stillhook.errors import CommandError, SimulationError
from stillhook.report.formatting import argument, display_number, display_unit
from stillhook.report.terminal import Answer, print_table
from stillhook.units import parse, show

if TYPE_CHECKING:
    from stillhook.analysis.loop_stability.in_the_twin import TwinMargins
    from stillhook.analysis.loop_stability.stability import Stability
    from stillhook.analysis.loop_stability.verdict import Verdict
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Mode

ALPHA_HELP = (
    "Motor displacement over its maximum; repeat it for several. Default: where the mode's law puts the motors at each"
    " place."
)
CONTROLLER_HELP = (
    f"Controller whose loop is judged: {CONTROLLERS}, strong-ssc or a TOML file (default: ssc on closed circuits,"
    " position on other winches)."
)
DELAY_HELP = 'Delay of the position feedback (encoder, bus, computing), such as "50 ms". Not that of the motion unit.'
FULL_HELP = (
    "One operating point of the complete plant, at --load, --s-w and --v-tip, as a table, and margins of the twin in"
    " waves of that speed."
)
WAVE = 9.0
"""Period of the waves in which the twin is looked at [s]."""
LOAD, WIRE = "100 t", "100 m"
"""Default operating point of the complete plant alone."""
LOAD_HELP = f'Payload on the hook (default: empty hook to the heaviest of the mode; with --full "{LOAD}").'
WIRE_HELP = f'Wire paid out (default: from 15 m to all; with --full "{WIRE}").'
SPEED_HELP = 'Steady speed of the tip, such as "60 m/min" (default: 0.5 m/min to full speed, up and down).'
PLAIN = ("K_p_ms", "omega_c", "gain_margin", "phase_margin", "omega_gc", "delay_margin", "sensitivity_peak", "stable")
"""Rows that have a second value with PLC and delay."""
WHERE = ("alpha_m", "K_wire", "J_m", "omega_0", "zeta", "period", "K_p")


def stability(
    name: CraneArgument,
    controller: Annotated[str | None, typer.Option("--controller", help=CONTROLLER_HELP)] = None,
    alpha_m: Annotated[list[float] | None, typer.Option("--alpha-m", help=ALPHA_HELP)] = None,
    layer: Annotated[
        int | None, typer.Option(help="The published loop alone, on a layer of the drum, as a table (a reference).")
    ] = None,
    delay: Annotated[str, typer.Option(help=DELAY_HELP)] = "0 s",
    v_tip: Annotated[str | None, typer.Option("--v-tip", help=SPEED_HELP)] = None,
    full: Annotated[bool, typer.Option("--full", help=FULL_HELP)] = False,
    load: Annotated[str | None, typer.Option(help=LOAD_HELP)] = None,
    s_w: Annotated[str | None, typer.Option("--s-w", help=WIRE_HELP)] = None,
    out: Out = None,
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
    from stillhook.analysis.loop_stability.stability import stability as stability_of
    from stillhook.library import load_crane
    from stillhook.spec.settings import left_out
    from stillhook.tables.plausible import implausible_values

    check_out(out, NAMES)
    crane = load_crane(name)
    chosen = named(crane.plant.type.default_mode.value if controller is None else controller)
    crane = chosen.on(crane)
    closed = not by_engine(crane)
    if not closed:
        refuse(
            {"--alpha-m": alpha_m, "--layer": layer, "--full": full},
            f'belongs to closed circuits, and winch type "{crane.plant}" has none; its margins are those of the'
            " complete plant. Leave it out.",
        )
    alphas: list[float | None] = [*alpha_m] if alpha_m else [None]
    at = _Place(
        load=None if load is None else parse(load, "mass", "--load"),
        s_w=None if s_w is None else parse(s_w, "length", "--s-w"),
        v_tip=None if v_tip is None else parse(v_tip, "speed", "--v-tip"),
        delay=parse(delay, "time", "--delay"),
    )
    loops: list[Stability] = []
    verdicts: list[Any] = []
    where, twin = "", None
    if full:
        refuse(
            {"--layer": layer},
            "belongs to the published model; with --full the wire paid out determines the layer. Leave it out.",
        )
        loops, where = _full(crane, chosen.mode, alphas, at)
        twin = None if alpha_m else _twin(crane, chosen.mode, at)
    elif layer is not None:
        refuse(
            {"--load": load, "--s-w": s_w, "--controller": controller},
            "--layer applies to the published loop only. Leave one of them out.",
        )
        loops = [stability_of(crane, a, layer=layer, v_tip=at.v_tip or 0.0, delay=at.delay) for a in alphas]
        where = f"published loop (a reference), layer {layer}"
    else:
        verdicts = [_verdict(crane, chosen.mode, a, at) for a in alphas]
    result: list[Any] = [*loops, *verdicts]
    tables = [each.table() for each in result]
    table = tables[0] if len(tables) == 1 else {key: [t[key] for t in tables] for key in tables[0]}
    notes = left_out(crane.sensors)
    table |= {"controller": chosen.name, "notes": [*implausible_values(crane), *notes]}
    if twin is not None:
        table["twin"] = {"factor": twin.factor._asdict(), "delay": twin.delay._asdict(), "e_c_pp": twin.e_c_pp}

    def show_answer() -> None:
        if loops:
            _print_loops(crane, loops, where)
        if twin is not None:
            _print_line(_in_the_twin(twin, at))
        if layer is not None:
            print("What the crane is judged by is the complete plant, without --layer.")
        for alpha, v in zip(alphas, verdicts, strict=False):
            _print_verdict(v, chosen.name, alpha)
        for note in table["notes"]:
            print(note)

    def brief() -> Answer:
        lines = [line for alpha, v in zip(alphas, verdicts, strict=False) for line in _short(v, chosen.name, alpha)]
        lines += [f"Motors at {s.alpha_m:.3g}: {_sentence(s)}" for s in loops]
        lines += [] if twin is None else [_in_the_twin(twin, at)]
        title = f"{crane.name}, {chosen.name}: position loop, {where or 'complete plant'}"
        if at.delay:
            title += f", delay {show(at.delay, 'time')}"
        step = (
            ""
            if all(each.ok for each in result)
            else f"stillhook tune {argument(name)} --controllers {argument(chosen.name)}"
        )
        return Answer(title, [*lines, *notes[:1]], step, "every margin, wire damping, the published loop")

    present(table, brief=brief, json=json, show=show_answer)
    if out is not None:
        if closed:
            _write(out, crane, alphas, table, at.delay, quiet=json)
        else:
            write_out(out, {"stability.json": table}, quiet=json, cranes=[crane])
    raise typer.Exit(0 if all(each.ok for each in result) else 1)


class _Place(NamedTuple):
    """The requested place, SI; None: all that the winch comes to."""

    load: float | None
    s_w: float | None
    v_tip: float | None
    delay: float


def _verdict(crane: Crane, mode: Mode, alpha: float | None, at: _Place) -> Verdict:
    """The one margin, at a displacement or where the law puts the motors."""
    from stillhook.analysis.loop_stability.verdict import verdict

    loads, wires = (None if x is None else (x,) for x in (at.load, at.s_w))
    return verdict(crane, mode, alpha_m=alpha, v_tip=at.v_tip, delay=at.delay, loads=loads, wires=wires)


def _full(crane: Crane, mode: Mode, alphas: list[float | None], at: _Place) -> tuple[list[Stability], str]:
    """The complete plant at one operating point, and where that is."""
    from stillhook.analysis.loop_stability.stability import full_stability

    if not at.v_tip:
        raise CommandError(
            '--full needs --v-tip, such as "10 m/min": a winch at rest sticks, and its loop has no limit until it'
            " slides."
        )
    load = parse(LOAD, "mass") if at.load is None else at.load
    s_w = parse(WIRE, "length") if at.s_w is None else at.s_w
    where: dict[str, Any] = {"load": load, "s_w": s_w, "v_tip": at.v_tip, "mode": mode, "delay": at.delay}
    results = [full_stability(crane, alpha_m=a, **where) for a in alphas]
    point = results[0][1]
    pressures = f"{show(point.p_a, 'pressure')} and {show(point.p_b, 'pressure')}"
    return [s for s, _ in results], f"complete plant at {show(-point.v_w, 'speed')} of the tip, {pressures}"


def _twin(crane: Crane, mode: Mode, at: _Place) -> TwinMargins:
    """Margins in the twin in regular waves in which the tip comes to the requested speed."""
    from stillhook.analysis.loop_stability.in_the_twin import twin_margins
    from stillhook.sea.motion.motion import Sine
    from stillhook.spec.scenario import Scenario

    height = abs(at.v_tip or 0.0) * WAVE / (2.0 * math.pi)
    waves = Sine.from_si(height, WAVE, where="--v-tip")
    case = Scenario(load=LOAD, s_w=WIRE, tip=waves, mode=mode, duration="200 s", warm_up="80 s")
    place = {name: x for name, x in (("load", at.load), ("s_w", at.s_w)) if x is not None}
    case = case.model_copy(update=place)
    try:
        return twin_margins(crane, case)
    except SimulationError:  # dead times need a compiler
        return twin_margins(crane, case, delays=False)


def _in_the_twin(twin: TwinMargins, at: _Place) -> str:
    """Margins in the twin, in a sentence."""
    tip, error = show(abs(at.v_tip or 0.0), "speed"), show(twin.e_c_pp, "diameter", 3)
    grows, stays = (_until(*ends) for ends in zip(twin.factor, twin.delay, strict=True))
    return (
        f"Twin in waves of {WAVE:g} s, tip up to {tip}: error {error} peak to peak, half more with {grows}; a"
        f" disturbance stays with {stays}."
    )


def _until(factor: float, delay: float) -> str:
    """What of a factor and a delay was enough, in words."""
    enough = [f"{factor:.3g} times K_p"] if math.isfinite(factor) else []
    enough += [f"commands {1e3 * delay:.2g} ms later"] if math.isfinite(delay) else []
    return " or ".join(enough) or "nothing that was run"


def _print_verdict(v: Verdict, controller: str, alpha: float | None) -> None:
    """The answer in lines, the verdict first."""
    motors = "" if alpha is None else f", motors at {alpha:.3g}"
    where = f"{v.crane}, {controller}{motors}, K_p {_gain(v.K_p, 4)}"
    where += f", delay {show(v.delay, 'time')}" if v.delay else ""
    n = len(v.found.places)
    if v.ok:
        answer = f"STABLE at all {n} places."
    elif v.oscillates:
        answer = f"UNSTABLE, the complete plant oscillates at {len(v.oscillates)} of {n} places."
    else:
        answer = f"UNSTABLE, {v.found.describe()}."
    for line in (f"{where}: {answer}", *_without_gain(v), *_by_gain(v), *_margin(v), *_references(v)):
        _print_line(line)


def _print_line(line: str) -> None:
    print(textwrap.fill(line, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False))


def _short(v: Verdict, controller: str, alpha: float | None) -> list[str]:
    """The verdict, what governs and the margin, a line each."""
    motors = "" if alpha is None else f"Motors at {alpha:.3g}: "
    n, least = len(v.found.places), v.found.limit
    stable = f"STABLE at all {n} places" if v.ok else f"UNSTABLE at {len(v.oscillates)} of {n} places"
    lines = [f"{motors}{stable} with K_p {_gain(v.K_p, 4)}.", *_without_gain(v)[:1]]
    if least is not None and (m := v.margins) is not None:
        at = f"{show(least.place.load, 'mass', 4)}, {show(abs(least.place.v_tip), 'speed', 3)}"
        above = f"K_p is above its limit {_gain(least.gains.high)} at {at}."
        decibel = 20.0 * math.log10(m.gain_margin)
        margin = f"Gain margin {decibel:.3g} dB, phase margin {math.degrees(m.phase_margin):.3g} deg, least at {at}."
        lines.append(margin if decibel > 0.0 else above)
        lines.append(f"Largest K_p with gain margin 2, 45 deg and sensitivity peak 2: {_gain(v.found.K_p)}.")
    return lines


WIDTH = 100
"""Columns of the answer."""


def _gain(K: float, digits: int = 3) -> str:
    return show(K, "gain_per_length", digits)


def _without_gain(v: Verdict) -> list[str]:
    """Places that no gain stabilises."""
    places = [p.place for p in v.found.no_gain]
    if not places:
        return []
    worst = max(places, key=lambda p: (p.load, abs(p.v_tip)))
    least, fastest = min(p.load for p in places), max(abs(p.v_tip) for p in places)
    return [
        f"No gain K_p stabilises the complete plant at {show(worst.load, 'mass', 4)},"
        f" {show(abs(worst.v_tip), 'speed', 3)}, {show(worst.s_w, 'length', 4)} of wire.",
        f"That holds at {len(places)} places, from {show(least, 'mass', 3)} and up to {show(fastest, 'speed', 3)}; look"
        " at friction and damping of the wire.",
    ]


def _by_gain(v: Verdict) -> list[str]:
    """Places that oscillate at K_p and not at another gain."""
    places = [p for p in v.oscillates if p.gains.any]
    if not places:
        return []
    least = min(places, key=lambda p: p.gains.high)
    low = f"{_gain(least.gains.low)} to " if least.gains.low else "below "
    return [
        f"At {len(places)} place{'s' if len(places) > 1 else ''} K_p decides; least: {least.describe()}, stable"
        f" {low}{_gain(least.gains.high)}."
    ]


def _margin(v: Verdict) -> list[str]:
    """The margin where the plant does not oscillate without feedback, and the largest gain."""
    m, least = v.margins, v.found.limit
    if m is None or least is None:
        return ["No margin: no place is clear of the speeds at which it oscillates without feedback."]
    away = ", one Stribeck speed above that," if v.found.no_gain else ""
    at = f"least at {least.describe()}"
    margin = f"K_p is above its limit{away}, {at}, limit {_gain(least.gains.high, 4)}."
    if m.gain_margin > 1.0:
        margin = (
            f"Gain margin{away} {20.0 * math.log10(m.gain_margin):.3g} dB (factor {m.gain_margin:.3g}), phase margin"
            f" {math.degrees(m.phase_margin):.3g} deg, {at}, limit {_gain(least.gains.high, 4)}."
        )
    of = " of the proportional part" if v.found.remembers else ""
    return [
        margin,
        f"Largest K_p{of} with gain margin 2, 45 deg and sensitivity peak 2 at a PLC cycle of"
        f" {show(v.t_cycle, 'time')}: {_gain(v.found.K_p)} ({v.found.describe()}).",
    ]


def _references(v: Verdict) -> list[str]:
    """What was learned, what the wire's damping decides, and the published loop."""
    whose = {"crane": "the crane's", "paper C": "paper C's", "least": "least", "most": "most"}
    cells = [f"{d.zeta:g} ({whose[d.whose]}) {d.oscillates}, {d.no_gain}" for d in v.damping]
    places = max((d.places for d in v.damping), default=0)
    lines = [f"Wire damping, places of {places} that oscillate with K_p, and with any gain: {'; '.join(cells)}."]
    if v.mode.law.learns:
        from stillhook.analysis.loop_stability.linearisation import SEA, SEA_TIME

        lines.insert(0, f"{v.mode.value} with what it has learned after {SEA_TIME:g} s of waves ({SEA}).")
    if (s := v.published) is not None:
        lines.append(
            f"Published loop (paper E, for reference): limit {_gain(s.K_p_ms, 4)} with motors at {s.alpha_m:.3g},"
            f" {20.0 * math.log10(s.gain_margin):.3g} dB."
        )
    return lines


def _print_loops(crane: Crane, loops: list[Stability], where: str) -> None:
    """Margins of single loops in a table, and each in a sentence."""

    from stillhook.variables import BY_NAME

    def row(label: str, name: str) -> list[str]:
        return [label, *(_cell(name, getattr(s, name)) for s in loops), display_unit(name), BY_NAME[name].meaning]

    rows = [*(row(n, n) for n in (*WHERE, *PLAIN)), *(row(f"{n}, PLC", f"{n}_plc") for n in PLAIN)]
    rows.append(row("K_p_strong", "K_p_strong"))
    names = [f"motors {s.alpha_m:.3g}" for s in loops]
    times = f"PLC cycle {show(loops[0].t_cycle, 'time')}, delay {show(loops[0].delay, 'time')}"
    print_table(["", *names, "unit", "meaning"], rows, title=f"{crane.name}, {where}; {times}")
    for name, s in zip(names, loops, strict=True):
        print(f"{name}: {_sentence(s)}")


def _cell(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    return display_number(name, value, 4) if math.isfinite(value) else "-"


def _sentence(s: Stability) -> str:
    """Whether a loop is stable, and by how much or why not."""
    if s.ok:
        least = min(s.gain_margin, s.gain_margin_plc)
        return f"stable. Gain margin {20.0 * math.log10(least):.3g} dB (K_p can rise by a factor of {least:.3g})."
    if s.K_p_ms == 0.0:
        return (
            "UNSTABLE at every K_p. Friction falls with speed here, so the winch oscillates without feedback. More"
            " displacement or more speed damps it."
        )
    if s.K_p_ms_plc == 0.0 or (s.gain_margin > 1.0 and s.gain_margin_plc > 1.0):
        return (
            "UNSTABLE at every K_p. The PLC's other loops oscillate: SSC on motors without displacement feedback at"
            " this speed, or through the load cell."
        )
    limit = min(s.K_p_ms, s.K_p_ms_plc)
    return f"UNSTABLE. K_p {s.K_p:.4g} 1/m, limit {limit:.4g} 1/m. Lower K_p to {s.K_p_strong:.3g} 1/m or less."


NAMES = (
    "gain-limit.png",
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
    out: Path, crane: Crane, alphas: list[float | None], table: dict[str, Any], delay: float, *, quiet: bool
) -> None:
    """Pictures and sweeps of the published loop and of the slow plant, and the table."""
    from stillhook.analysis.loop_stability.sweeps import all_figures, all_sweeps

    displacements = tuple(dict.fromkeys(1.0 if a is None else a for a in alphas))
    data = all_sweeps(crane, displacements[0], delay=delay)

    def pictures() -> dict[str, Any]:
        return {f"{stem}.png": figure for stem, figure in all_figures(crane, displacements, data, delay=delay).items()}

    files: dict[str, Any] = {f"{over}.nc": dataset for over, dataset in data.items()}
    write_out(out, files | {"stability.json": table}, pictures=pictures, quiet=quiet, cranes=[crane])
