"""`stillhook crane NAME` and `stillhook calc ...`: a crane, and single numbers of the equations."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from stillhook.cli.parser import MODES, Json, refuse
from stillhook.errors import CommandError
from stillhook.report.formatting import display_number, display_unit
from stillhook.report.terminal import print_implausible, print_json, print_table, print_twin, print_values
from stillhook.units import parse, quote, show

if TYPE_CHECKING:
    from stillhook.spec.crane import Crane


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
        raise CommandError(f'--layer {layer}: "{crane.name}" has layers 1 to {crane.drum.layers}. Choose one of them.')


def _alpha(value: float) -> float:
    if not 0.0 < value <= 1.0:
        raise CommandError(
            f"--alpha-m = {value:g}: allowed is above 0 up to 1. Give the displacement over its maximum."
        )
    return value


class Arguments(NamedTuple):
    """Arguments of `stillhook calc`, as text or number; None what is left out."""

    name: str
    displacement: str | None
    speed: str | None
    dp: str | None
    drum_torque: str | None
    layer: int | None
    s_w: str | None
    alpha_m: float | None
    v_w: str | None
    controller: str | None
    json: bool

    def text(self, option: str) -> str:
        """An option that the quantity needs. Errors: CommandError."""
        value = getattr(self, option)
        if value is None:
            raise CommandError(f"--{option.replace('_', '-')}: missing, and this quantity follows from it. Give it.")
        return str(value)

    @property
    def alpha(self) -> float:
        """Displacement of the motors over their largest [-]."""
        return _alpha(1.0 if self.alpha_m is None else self.alpha_m)


def _motor_loss(g: Arguments) -> None:
    """Torque loss of one motor shaft (MJ4, thesis eq. 2.12)."""
    from stillhook.library.parameter_sets import load_losses
    from stillhook.physics.hydraulics.motor import torque_loss
    from stillhook.winches.circuits.packing import loss_fit

    losses = load_losses(g.name)
    m, evidence = losses.motor, losses.evidence
    D_m = parse(g.text("displacement"), "displacement", "--displacement")
    omega_m = parse(g.text("speed"), "rotation", "--speed")
    dp_m = parse(g.text("dp"), "pressure", "--dp")
    if not 0.0 < D_m <= m.D_max * (1.0 + 1e-9):
        full = show(m.D_max, "displacement")
        raise CommandError(
            f"--displacement {g.displacement}: {g.name} has above 0 up to {full}. Give a value in between."
        )
    fit = loss_fit(m)
    speeds = evidence.omega_m if evidence is not None and evidence.omega_m else VALID_SPEED
    drops = evidence.dp_m if evidence is not None and evidence.dp_m else VALID_DP
    inside = _within(abs(omega_m), speeds) and _within(abs(dp_m), drops)
    _answer(
        {"T_fm": torque_loss(omega_m, D_m, dp_m, fit), "D_m": D_m, "omega_m": omega_m, "dp_m": dp_m, "valid": inside},
        g.json,
    )
    if not inside and not g.json:
        texts = [
            f"{show(lo, kind)} to {show(hi, kind)}" for (lo, hi), kind in ((speeds, "rotation"), (drops, "pressure"))
        ]
        print(f"outside the fitted range {', '.join(texts)}: an extrapolation")


def _within(value: float, bounds: tuple[float, float]) -> bool:
    lo, hi = bounds
    return lo * (1.0 - 1e-9) <= value <= hi * (1.0 + 1e-9)


def _friction(g: Arguments) -> None:
    """System friction per motor shaft (thesis eq. 2.7)."""
    from stillhook.engine.pack.winch import friction_record
    from stillhook.library import cranes, load_crane
    from stillhook.library.parameter_sets import load_friction
    from stillhook.physics.friction import system_friction as torque

    of_crane = g.name in cranes() and g.name != "nov-250t"
    s = load_crane(g.name).friction.system if of_crane else load_friction(g.name).system
    T_d = parse(g.text("drum_torque"), "torque", "--drum-torque")
    omega_m = parse(g.text("speed"), "rotation", "--speed")
    if T_d < 0.0:
        raise CommandError(
            f"--drum-torque {g.drum_torque}: a suspended load gives no negative drum torque. Give 0 or more."
        )
    T_fs = torque(omega_m, T_d, friction_record(s))
    _answer({"T_fs": T_fs, "T_d": T_d, "omega_m": omega_m}, g.json)


def _drum(g: Arguments) -> None:
    """Layers of the drum: diameter, K_wire, wire, inertia."""
    from stillhook.analysis.steady.steady_state import layer_row
    from stillhook.library import load_crane

    crane = load_crane(g.name)
    if g.layer is not None:
        _check_layer(crane, g.layer)
        _answer(layer_row(crane, g.layer), g.json)
        return
    _print_rows([layer_row(crane, n) for n in range(1, crane.drum.layers + 1)], 5, g.json)


def _inertia(g: Arguments) -> None:
    """Inertia at the motor shaft by part (figure 2.19)."""
    from stillhook.analysis.steady.steady_state import inertia_parts
    from stillhook.engine.pack.winch import drum_record
    from stillhook.library import load_crane

    crane = load_crane(g.name)
    L_full = drum_record(crane).L_full
    if g.s_w is not None:
        out = parse(g.s_w, "length", "--s-w")
        if not 0.0 <= out <= L_full:
            raise CommandError(
                f'--s-w {g.s_w}: "{crane.name}" has 0 to {show(L_full, "length")} of wire. Give a value in between.'
            )
        _answer(inertia_parts(crane, out), g.json)
        return
    _print_rows([inertia_parts(crane, 0.0), inertia_parts(crane, L_full)], 4, g.json)


def _speed(g: Arguments) -> None:
    """Wire and motor speed at full command, without leakage; no motor speed where a cylinder moves the wire."""
    from stillhook.analysis.steady.steady_state import layer_row
    from stillhook.engine.pack.winch import motor_speed_max, wire_speed_max
    from stillhook.library import load_crane

    crane, alpha = load_crane(g.name), g.alpha
    if g.layer is not None:
        _check_layer(crane, g.layer)
    d = crane.drum.d_max if g.layer is None else float(layer_row(crane, g.layer)["d_wire_centre"])
    v = wire_speed_max(crane, alpha, d)
    if crane.plant.type.full_wire_speed(crane) is not None:
        _answer({"v_w_max": v}, g.json)
        return
    _answer({"v_w_max": v, "omega_m": motor_speed_max(crane, alpha), "alpha_m": alpha, "layer_diameter": d}, g.json)


def _eigenfrequency(g: Arguments) -> None:
    """Eigenfrequency and damping of the active circuit (paper C eqs 8, 9)."""
    from stillhook.analysis.loop_stability import reduced as linear
    from stillhook.library import load_crane

    e = linear.eigenfrequency(load_crane(g.name), g.alpha)
    _answer({"omega_0": e.omega_0, "zeta": e.zeta, "period": e.period, "alpha_m": g.alpha}, g.json)


def _gain_limit(g: Arguments) -> None:
    """Position gain at marginal stability (paper E figure 5)."""
    from stillhook.analysis.loop_stability import reduced as linear
    from stillhook.library import load_crane

    limit = linear.gain_limit(load_crane(g.name), g.alpha)
    _answer({"K_p_ms": limit.K_p_ms, "omega_c": limit.omega_c, "alpha_m": g.alpha}, g.json)


def _steady(g: Arguments) -> None:
    """Pump and motor setting at a steady wire speed, outer diameter, no leakage (figure 2.17)."""
    from stillhook.analysis.steady.steady_state import steady as solve
    from stillhook.library import load_crane
    from stillhook.spec.scenario import mode_of

    crane = load_crane(g.name)
    chosen = crane.plant.type.default_mode if g.controller is None else mode_of(g.controller)
    s = solve(crane, parse(g.text("v_w"), "speed", "--v-w"), chosen)
    values = {k: float(v) if isinstance(v, float) and math.isfinite(v) else v for k, v in s._asdict().items()}
    _answer(values, g.json)


class Calculation(NamedTuple):
    """A quantity of `stillhook calc`: what prints it, and the options that it follows from."""

    answer: Callable[[Arguments], None]
    options: tuple[str, ...]


QUANTITIES = {
    "motor-loss": Calculation(_motor_loss, ("displacement", "speed", "dp")),
    "friction": Calculation(_friction, ("drum_torque", "speed")),
    "drum": Calculation(_drum, ("layer",)),
    "inertia": Calculation(_inertia, ("s_w",)),
    "speed": Calculation(_speed, ("alpha_m", "layer")),
    "eigenfrequency": Calculation(_eigenfrequency, ("alpha_m",)),
    "gain-limit": Calculation(_gain_limit, ("alpha_m",)),
    "steady": Calculation(_steady, ("v_w", "controller")),
}


def calc(
    quantity: Annotated[str, typer.Argument(metavar="WHAT", help=f"One of {', '.join(QUANTITIES)}.")],
    name: Annotated[
        str,
        typer.Argument(
            metavar="CRANE", help="Crane; of motor-loss a motor, such as A6VM215, of friction also a friction set."
        ),
    ],
    displacement: Annotated[str | None, typer.Option(help='motor-loss: displacement now, "215 cm^3/rev".')] = None,
    speed: Annotated[
        str | None, typer.Option(help='motor-loss, friction: speed of the motor shaft, "1000 rev/min".')
    ] = None,
    dp: Annotated[str | None, typer.Option(help='motor-loss: pressure drop, "200 bar".')] = None,
    drum_torque: Annotated[str | None, typer.Option("--drum-torque", help='friction: drum torque, "1.5 MN m".')] = None,
    layer: Annotated[
        int | None, typer.Option(help="drum: layer, from the bare drum (default all); speed: layer in use.")
    ] = None,
    s_w: Annotated[
        str | None, typer.Option("--s-w", help="inertia: wire paid out (default: full and empty drum).")
    ] = None,
    alpha_m: Annotated[
        float | None,
        typer.Option("--alpha-m", help="speed, eigenfrequency, gain-limit: motor displacement, 0 to 1 (default 1)."),
    ] = None,
    v_w: Annotated[str | None, typer.Option("--v-w", help='steady: wire speed, "80 m/min".')] = None,
    controller: Annotated[
        str | None, typer.Option(help=f"steady: {MODES} (default: the usual one of the winch type).")
    ] = None,
    json: Json = False,
) -> None:
    """Single numbers of the equations: motor-loss, friction, drum, inertia, speed, eigenfrequency, gain-limit, steady.

    motor-loss: torque loss of one motor shaft (thesis eq. 2.12). friction: system friction per motor shaft (eq. 2.7).
    drum: layers. inertia: at the motor shaft, by part (figure 2.19). speed: of wire and motor at full command, without
    leakage. eigenfrequency: of the active circuit (paper C eqs 8, 9). gain-limit: position gain at marginal stability
    (paper E figure 5). steady: pump and motor setting at a steady wire speed (figure 2.17).

    Example: stillhook calc motor-loss A6VM215 --displacement "215 cm^3/rev" --speed "1000 rev/min" --dp "200 bar"

    Example: stillhook calc steady nov-250t --v-w "80 m/min"
    """
    if quantity not in QUANTITIES:
        raise CommandError(f"calc {quote(quantity)}: choose {', '.join(QUANTITIES)}.")
    given = Arguments(name, displacement, speed, dp, drum_torque, layer, s_w, alpha_m, v_w, controller, json)
    calculation = QUANTITIES[quantity]
    others = [f for f in Arguments._fields if f not in ("name", "json", *calculation.options)]
    refuse(
        {f"--{f.replace('_', '-')}": getattr(given, f) for f in others},
        f"{quantity} does not follow from it. Leave it out.",
    )
    calculation.answer(given)
