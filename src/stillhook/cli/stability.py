"""`stillhook stability`: how far the position loop is from swinging."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.cranes import Json
from stillhook.cli.show import human, print_implausible, print_json, print_table, say, unit_of

if TYPE_CHECKING:
    from stillhook.analysis.loop_stability import Stability
    from stillhook.analysis.operation import OperatingPoint
    from stillhook.crane import Crane

CraneName = Annotated[str, typer.Argument(help="Library crane, or path of a crane file.", metavar="CRANE")]
ALPHA_HELP = "Motor displacement over its maximum; repeat it for several. Default: where SSC stands at the tip's speed, 1 at rest."
DELAY_HELP = 'Delay of the position feedback (encoder, bus, computing), such as "50 ms". Not that of the motion unit.'
FULL_HELP = "The whole plant, linearised at --load, --s-w and --v-tip, in place of the published model."
LOAD, WIRE = "100 t", "100 m"
"""Where the whole plant stands unless an option says otherwise."""
PLAIN = ("K_p_ms", "omega_c", "gain_margin", "phase_margin", "omega_gc", "delay_margin", "sensitivity_peak", "stable")
"""Rows that have a second value with PLC and delay."""
WHERE = ("alpha_m", "K_wire", "J_m", "omega_0", "zeta", "period", "K_p")


def register(app: typer.Typer) -> None:
    app.command("stability")(stability)


def stability(
    name: CraneName,
    alpha_m: Annotated[list[float] | None, typer.Option("--alpha-m", help=ALPHA_HELP)] = None,
    layer: Annotated[int | None, typer.Option(help="Layer that the drum turns on; default: the published outer diameter.")] = None,
    delay: Annotated[str, typer.Option(help=DELAY_HELP)] = "0 s",
    v_tip: Annotated[str, typer.Option("--v-tip", help='Steady speed of the tip, up positive, such as "60 m/min".')] = "0 m/min",
    full: Annotated[bool, typer.Option("--full", help=FULL_HELP)] = False,
    load: Annotated[str | None, typer.Option(help=f'With --full: payload on the hook (default "{LOAD}").')] = None,
    s_w: Annotated[str | None, typer.Option("--s-w", help=f'With --full: wire paid out (default "{WIRE}").')] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for pictures, sweeps (NetCDF) and stability.json.")] = None,
    json: Json = False,
) -> None:
    """Gain limit and margins of the position loop, as published and with PLC and delay.

    Exit code 1 where the winch swings: K_p at or above its limit, with or without PLC and delay.

    Example: stillhook stability nov-250t --alpha-m 1 --alpha-m 0.6 --delay "50 ms"
    """
    from stillhook.library import load_crane
    from stillhook.plausible import implausible_values
    from stillhook.units import parse

    _check_out(out)
    crane = load_crane(name)
    speed, late = parse(v_tip, "speed", "--v-tip"), parse(delay, "time", "--delay")
    alphas: list[float | None] = [*alpha_m] if alpha_m else [None]
    if full:
        _refuse(layer is not None, "--layer belongs to the published model; with --full the wire paid out says the layer. Leave it out.")
        mass = parse(LOAD if load is None else load, "mass", "--load")
        found, point = _full(crane, alphas, mass, parse(WIRE if s_w is None else s_w, "length", "--s-w"), speed, late)
    else:
        for option, value in (("--load", load), ("--s-w", s_w)):
            _refuse(value is not None, f"{option}: the published model has none. Add --full, or leave it out.")
        from stillhook.analysis.loop_stability import stability as margins_of

        found, point = [margins_of(crane, a, layer=layer, v_tip=speed, delay=late) for a in alphas], None
    table = _lists([s.table() for s in found]) | {"notes": list(implausible_values(crane))}
    if json:
        print_json(table)
    else:
        _report(crane, found, point, layer)
    if out is not None:
        _write(out, crane, found, table, late, quiet=json, other=full or layer is not None)
    raise typer.Exit(0 if all(s.ok for s in found) else 1)


def _refuse(wrong: bool, line: str) -> None:
    from stillhook.errors import ScenarioError

    if wrong:
        raise ScenarioError(line)


def _full(
    crane: Crane, alphas: list[float | None], load: float, s_w: float, v_tip: float, delay: float
) -> tuple[list[Stability], OperatingPoint]:
    from stillhook.analysis.loop_stability import full_stability

    _refuse(v_tip == 0.0, '--full needs --v-tip, such as "10 m/min": a winch at rest sticks, and its loop has no limit until it slides.')
    found = [full_stability(crane, load=load, s_w=s_w, v_tip=v_tip, alpha_m=a, delay=delay) for a in alphas]
    return [s for s, _ in found], found[0][1]


def _lists(tables: list[dict[str, Any]]) -> dict[str, Any]:
    """Scalars for one displacement, lists of the same keys for several."""
    return tables[0] if len(tables) == 1 else {key: [t[key] for t in tables] for key in tables[0]}


def _cell(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    if not math.isfinite(value):
        return "-"
    return human(name, value, 4)


def _report(crane: Crane, found: list[Stability], point: OperatingPoint | None, layer: int | None) -> None:
    from stillhook.units import show
    from stillhook.variables import BY_NAME

    first = found[0]
    header = ["", *(f"motors {s.alpha_m:.3g}" for s in found), "unit", "meaning"]

    def row(label: str, name: str) -> list[str]:
        return [label, *(_cell(name, getattr(s, name)) for s in found), unit_of(name), BY_NAME[name].meaning]

    rows = [row(n, n) for n in WHERE]
    rows += [row(n, n) for n in PLAIN]
    rows += [row(f"{n}, PLC", f"{n}_plc") for n in PLAIN]
    rows.append(row("K_p_strong", "K_p_strong"))
    where = f"layer {layer}" if layer is not None else "published outer diameter, full drum"
    if point is not None:
        where = f"whole plant at {show(-point.v_w, 'speed')} of the tip, {show(point.p_a, 'pressure')} and {show(point.p_b, 'pressure')}"
    title = f"{crane.name}, {where}; PLC cycle {show(first.t_cycle, 'time')}, delay {show(first.delay, 'time')}"
    print_table(header, rows, title=title)
    print_implausible(crane)
    for s in found:
        _say_verdict(s)


def _say_verdict(s: Stability) -> None:
    if s.ok:
        least = min(s.gain_margin, s.gain_margin_plc)
        print(f"motors {s.alpha_m:.3g}: stable; K_p could grow {least:.3g} times before the winch swings.")
        return
    if s.K_p_ms == 0.0:
        why = "Friction falls with speed here, so the winch swings without feedback. More displacement or more speed damps it."
        print(f"motors {s.alpha_m:.3g}: UNSTABLE, whatever K_p. {why}")
        return
    if s.K_p_ms_plc == 0.0 or (s.gain_margin > 1.0 and s.gain_margin_plc > 1.0):
        why = "The PLC's other loops swing: SSC on motors without displacement feedback at this speed, or through the load cell."
        print(f"motors {s.alpha_m:.3g}: UNSTABLE, whatever K_p. {why}")
        return
    limit = min(s.K_p_ms, s.K_p_ms_plc)
    print(f"motors {s.alpha_m:.3g}: UNSTABLE. K_p {s.K_p:.4g} 1/m, limit {limit:.4g} 1/m. Lower K_p to {s.K_p_strong:.3g} 1/m or less.")


NAMES = (
    "gain-limit.png", "eigenfrequency.png", "sweeps.png", "bode.png", "root-locus.png", "motor-poles.png",
    "alpha_m.nc", "layer.nc", "leakage.nc", "damping.nc", "bulk_modulus.nc", "delay.nc", "stability.json",
)  # fmt: skip
"""Files that --out writes."""


def _check_out(out: Path | None) -> None:
    """Refuse a folder that cannot be written to before anything is worked out."""
    from stillhook.whole import check_folder

    if out is not None:
        check_folder(out, NAMES)


def _write(out: Path, crane: Crane, found: list[Stability], table: dict[str, Any], delay: float, *, quiet: bool, other: bool) -> None:
    """other: the table is of another model or layer than the pictures."""
    from stillhook.analysis.stability_figures import all_figures
    from stillhook.io.figures import save_figure
    from stillhook.io.results import save_json, save_run
    from stillhook.whole import whole_folder

    alphas = tuple(dict.fromkeys(s.alpha_m for s in found))
    figures, data = all_figures(crane, alphas, delay=delay)
    with whole_folder(out) as part:
        for stem, figure in figures.items():
            save_figure(figure, part / f"{stem}.png")
        for over, dataset in data.items():
            save_run(dataset, part / f"{over}.nc")
        save_json(table, part / "stability.json")
    if not quiet:
        say("written: " + ", ".join(str(out / n) for n in NAMES))
        if other:
            say("pictures and sweeps show the published loop on the full drum; stability.json holds the table above")
