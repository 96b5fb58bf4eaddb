"""`stillhook cranes`, `stillhook crane NAME` and `stillhook calc ...`: cranes, and single numbers of the
equations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from stillhook.cli.parser import MODES, Json
from stillhook.errors import ScenarioError
from stillhook.report.formatting import display_number, display_unit
from stillhook.report.terminal import print_implausible, print_json, print_table, print_twin, print_values
from stillhook.units import parse, show

if TYPE_CHECKING:
    from stillhook.spec.crane import Crane


def list_cranes(json: Json = False) -> None:
    """List the cranes of the library. Example: stillhook cranes"""
    from stillhook.library import cranes, load_crane

    entries = [load_crane(name) for name in cranes()]
    if json:
        print_json([{"name": c.name, "title": c.title, "plant": c.plant.value, "SWL": c.SWL} for c in entries])
        return
    print_table(
        ("crane", "description", "winch", "SWL"),
        [(c.name, c.title, c.plant.value, show(c.SWL, "mass")) for c in entries],
        left=3,
    )


def show_crane(
    name: Annotated[str, typer.Argument(help="Library name, or path of a crane file (TOML).")],
    json: Json = False,
) -> None:
    """Print a crane's sheet: every number with its kind and source. Example: stillhook crane nov-250t"""
    from stillhook.engine.inputs import twin_line
    from stillhook.library import load_crane, sheet, sheet_json
    from stillhook.tables.plausible import implausible_values, marked

    crane = load_crane(name)
    notes = implausible_values(crane)
    if json:
        print_json(sheet_json(crane) | {"twin": twin_line(crane), "status": marked("ok", notes), "notes": list(notes)})
        return
    print(f"{crane.name}: {crane.title}")
    print_twin(crane)
    print_implausible(crane)
    rows = [(r.field, r.value, r.meaning, r.kind, r.source) for section in sheet(crane) for r in section.rows]
    print_sheet(rows)


def print_sheet(rows: list[tuple[str, str, str, str, str]]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(header_style="bold")
    for title in ("field", "value", "meaning", "kind", "source"):
        table.add_column(title, overflow="fold", no_wrap=title in ("field", "value", "kind"))
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    console = Console()
    (console if console.is_terminal else Console(width=200)).print(table)


app = typer.Typer(no_args_is_help=True)
CraneName = Annotated[str, typer.Argument(help="Library crane, or path of a crane file.", metavar="CRANE")]
AlphaM = Annotated[float, typer.Option("--alpha-m", help="Motor displacement over its maximum, above 0 up to 1.")]
VALID_SPEED = (400.0 * math.tau / 60.0, 2500.0 * math.tau / 60.0)
"""Motor speeds for which the published losses hold [rad/s]."""
VALID_DP = (50e5, 350e5)
"""Pressure drops for which they hold [Pa]."""


def _answer(values: dict[str, Any], json: bool) -> None:
    print_json(values) if json else print_values(values)


def _print_rows(rows: list[dict[str, Any]], digits: int, json: bool) -> None:
    """The same numbers of several layers or lengths of wire."""
    if json:
        print_json(rows)
        return
    header = [f"{k} [{display_unit(k)}]" if display_unit(k) else k for k in rows[0]]
    print_table(header, [[display_number(k, v, digits) for k, v in row.items()] for row in rows], left=0)


def _check_layer(crane: Crane, layer: int) -> None:
    if not 1 <= layer <= crane.drum.layers:
        raise ScenarioError(f'--layer {layer}: "{crane.name}" has layers 1 to {crane.drum.layers}. Choose one of them.')


def _alpha(value: float) -> float:
    if not 0.0 < value <= 1.0:
        raise ScenarioError(
            f"--alpha-m = {value:g}: allowed is above 0 up to 1. Give the displacement over its maximum."
        )
    return value


@app.command("motor-loss")
def motor_loss(
    name: Annotated[
        str, typer.Argument(help="Motor of the library, such as A6VM215, or path of a motor file.", metavar="MOTOR")
    ],
    displacement: Annotated[str, typer.Option(help='Displacement now, such as "215 cm^3/rev".')],
    speed: Annotated[str, typer.Option(help='Shaft speed, such as "1000 rev/min".')],
    dp: Annotated[str, typer.Option(help='Pressure drop, such as "200 bar".')],
    json: Json = False,
) -> None:
    """Torque loss of one motor shaft (MJ4, thesis eq. 2.12).

    Example: stillhook calc motor-loss A6VM215 --displacement "215 cm^3/rev" --speed "1000 rev/min" --dp "200 bar"
    """
    from stillhook.engine.pack.winch import loss_fit
    from stillhook.library.parameter_sets import load_losses
    from stillhook.physics.hydraulics.motor import torque_loss

    losses = load_losses(name)
    m, evidence = losses.motor, losses.evidence
    D_m, omega_m = parse(displacement, "displacement", "--displacement"), parse(speed, "rotation", "--speed")
    dp_m = parse(dp, "pressure", "--dp")
    if not 0.0 < D_m <= m.D_max * (1.0 + 1e-9):
        full = show(m.D_max, "displacement")
        raise ScenarioError(f"--displacement {displacement}: {name} has above 0 up to {full}. Give a value in between.")
    fit = loss_fit(m)
    speeds = evidence.omega_m if evidence is not None and evidence.omega_m else VALID_SPEED
    drops = evidence.dp_m if evidence is not None and evidence.dp_m else VALID_DP
    inside = _within(abs(omega_m), speeds) and _within(abs(dp_m), drops)
    _answer(
        {"T_fm": torque_loss(omega_m, D_m, dp_m, fit), "D_m": D_m, "omega_m": omega_m, "dp_m": dp_m, "valid": inside},
        json,
    )
    if not inside and not json:
        texts = [
            f"{show(lo, kind)} to {show(hi, kind)}" for (lo, hi), kind in ((speeds, "rotation"), (drops, "pressure"))
        ]
        print(f"outside the fitted range {', '.join(texts)}: an extrapolation")


def _within(value: float, bounds: tuple[float, float]) -> bool:
    lo, hi = bounds
    return lo * (1.0 - 1e-9) <= value <= hi * (1.0 + 1e-9)


@app.command("friction")
def friction(
    name: Annotated[
        str,
        typer.Argument(
            help="System friction of the library (crane-1, ...), path of a set, or a crane of the library.",
            metavar="SET",
        ),
    ],
    drum_torque: Annotated[str, typer.Option("--drum-torque", help='Drum torque, such as "1.5 MN m".')],
    speed: Annotated[str, typer.Option(help='Motor shaft speed, such as "100 rev/min".')],
    json: Json = False,
) -> None:
    """System friction per motor shaft (thesis eq. 2.7).

    Example: stillhook calc friction crane-1 --drum-torque "1.5 MN m" --speed "100 rev/min"
    """
    from stillhook.engine.pack.winch import friction_record
    from stillhook.library import cranes, load_crane
    from stillhook.library.parameter_sets import load_friction
    from stillhook.physics.friction import system_friction as torque

    s = load_crane(name).friction.system if name in cranes() and name != "nov-250t" else load_friction(name).system
    T_d, omega_m = parse(drum_torque, "torque", "--drum-torque"), parse(speed, "rotation", "--speed")
    if T_d < 0.0:
        raise ScenarioError(
            f"--drum-torque {drum_torque}: a suspended load gives no negative drum torque. Give 0 or more."
        )
    T_fs = torque(omega_m, T_d, friction_record(s))
    _answer({"T_fs": T_fs, "T_d": T_d, "omega_m": omega_m}, json)


@app.command("drum")
def drum(
    name: CraneName,
    layer: Annotated[
        int | None, typer.Option(help="Layer, counted from the bare drum; all layers if left out.")
    ] = None,
    json: Json = False,
) -> None:
    """Layers of the drum: diameter, K_wire, wire, inertia. Example: stillhook calc drum nov-250t --layer 6"""
    from stillhook.analysis.steady.steady_state import layer_row
    from stillhook.library import load_crane

    crane = load_crane(name)
    if layer is not None:
        _check_layer(crane, layer)
        _answer(layer_row(crane, layer), json)
        return
    _print_rows([layer_row(crane, n) for n in range(1, crane.drum.layers + 1)], 5, json)


@app.command("inertia")
def inertia(
    name: CraneName,
    s_w: Annotated[str | None, typer.Option("--s-w", help="Wire paid out; full and empty drum if left out.")] = None,
    json: Json = False,
) -> None:
    """Inertia at the motor shaft by part (figure 2.19). Example: stillhook calc inertia nov-250t"""
    from stillhook.analysis.steady.steady_state import inertia_parts
    from stillhook.engine.pack.winch import drum_record
    from stillhook.library import load_crane

    crane = load_crane(name)
    L_full = drum_record(crane).L_full
    if s_w is not None:
        out = parse(s_w, "length", "--s-w")
        if not 0.0 <= out <= L_full:
            raise ScenarioError(
                f'--s-w {s_w}: "{crane.name}" has 0 to {show(L_full, "length")} of wire. Give a value in between.'
            )
        _answer(inertia_parts(crane, out), json)
        return
    _print_rows([inertia_parts(crane, 0.0), inertia_parts(crane, L_full)], 4, json)


@app.command("speed")
def speed(
    name: CraneName,
    alpha_m: AlphaM = 1.0,
    layer: Annotated[int | None, typer.Option(help="Layer in use; default: the published outer diameter.")] = None,
    json: Json = False,
) -> None:
    """Wire and motor speed at full command, without leakage; no motor speed where a cylinder moves the wire. Example:
    stillhook calc speed nov-250t --alpha-m 0.6"""
    from stillhook.analysis.steady.steady_state import layer_row
    from stillhook.engine.pack.winch import motor_speed_max, wire_speed_max
    from stillhook.library import load_crane

    crane, alpha = load_crane(name), _alpha(alpha_m)
    if layer is not None:
        _check_layer(crane, layer)
    d = crane.drum.d_max if layer is None else float(layer_row(crane, layer)["d_wire_centre"])
    v = wire_speed_max(crane, alpha, d)
    if crane.plant.type.full_wire_speed(crane) is not None:
        _answer({"v_w_max": v}, json)
        return
    _answer({"v_w_max": v, "omega_m": motor_speed_max(crane, alpha), "alpha_m": alpha, "layer_diameter": d}, json)


@app.command("eigenfrequency")
def eigenfrequency(name: CraneName, alpha_m: AlphaM = 1.0, json: Json = False) -> None:
    """Eigenfrequency and damping of the active circuit (paper C eqs 8, 9). Example: stillhook calc eigenfrequency
    nov-250t --alpha-m 0.8"""
    from stillhook.analysis.loop_stability import reduced as linear
    from stillhook.library import load_crane

    e = linear.eigenfrequency(load_crane(name), _alpha(alpha_m))
    _answer({"omega_0": e.omega_0, "zeta": e.zeta, "period": e.period, "alpha_m": alpha_m}, json)


@app.command("gain-limit")
def gain_limit(name: CraneName, alpha_m: AlphaM = 1.0, json: Json = False) -> None:
    """Position gain at marginal stability (paper E figure 5). Example: stillhook calc gain-limit nov-250t --alpha-m
    0.6"""
    from stillhook.analysis.loop_stability import reduced as linear
    from stillhook.library import load_crane

    limit = linear.gain_limit(load_crane(name), _alpha(alpha_m))
    _answer({"K_p_ms": limit.K_p_ms, "omega_c": limit.omega_c, "alpha_m": alpha_m}, json)


@app.command("steady")
def steady(
    name: CraneName,
    v_w: Annotated[str, typer.Option("--v-w", help='Wire speed, such as "80 m/min".')],
    mode: Annotated[
        str | None, typer.Option(help=f"Controller: {MODES}. Default: the usual one of the winch type, or ssc.")
    ] = None,
    json: Json = False,
) -> None:
    """Pump and motor setting at a steady wire speed, outer diameter, no leakage (figure 2.17).

    Example: stillhook calc steady nov-250t --v-w "80 m/min"
    """
    from stillhook.analysis.steady.steady_state import steady as solve
    from stillhook.library import load_crane
    from stillhook.spec.scenario import mode_of

    crane = load_crane(name)
    chosen = crane.plant.type.default_mode if mode is None else mode_of(mode)
    s = solve(crane, parse(v_w, "speed", "--v-w"), chosen)
    values = {k: float(v) if isinstance(v, float) and math.isfinite(v) else v for k, v in s._asdict().items()}
    _answer(values, json)
