"""`stillhook calc WHAT CRANE [NAME=VALUE...]`: single numbers of the equations."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from stillhook.cli.parser import Json, present
from stillhook.errors import CommandError
from stillhook.report.formatting import display_number, display_unit
from stillhook.report.terminal import MOST_LINES, Answer, Line, columns, print_table, print_values, say
from stillhook.units import parse, quote, show

if TYPE_CHECKING:
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Mode

VALID_SPEED = (400.0 * math.tau / 60.0, 2500.0 * math.tau / 60.0)
"""Motor speeds for which the published losses hold [rad/s]."""
VALID_DP = (50e5, 350e5)
"""Pressure drops for which they hold [Pa]."""
KINDS = {"D_m": "displacement", "omega_m": "rotation", "dp_m": "pressure", "T_d": "torque", "s_w": "length"} | {
    "v_w": "speed"
}
"""Kind of quantity of the values that have a unit."""
Rows = Mapping[str, Any] | Sequence[Mapping[str, Any]]


class Calculation(NamedTuple):
    """A quantity: what calculates it, the values that it needs, and those that it may have."""

    answer: Callable[..., Rows]
    needs: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()


def _motor_loss(name: str, D_m: float, omega_m: float, dp_m: float) -> Rows:
    """Torque loss of one motor shaft: by MJ4 (thesis eq. 2.12), or by the model that its file names."""
    from stillhook.library.parameter_sets import load_losses
    from stillhook.physics.hydraulics.motor_laws import motor_loss
    from stillhook.winches.circuits.losses import loss_fit

    losses = load_losses(name)
    m, evidence = losses.motor, losses.evidence
    if not 0.0 < D_m <= m.D_max * (1.0 + 1e-9):
        requested, full = show(D_m, "displacement"), show(m.D_max, "displacement")
        raise CommandError(f"D_m = {requested}: {name} has above 0 up to {full}. Give a value in between.")
    ranges = (
        (abs(omega_m), (evidence and evidence.omega_m) or VALID_SPEED, "rotation"),
        (abs(dp_m), (evidence and evidence.dp_m) or VALID_DP, "pressure"),
    )
    inside = all(lo * (1.0 - 1e-9) <= x <= hi * (1.0 + 1e-9) for x, (lo, hi), _ in ranges)
    if not inside:
        fitted = ", ".join(f"{show(lo, kind)} to {show(hi, kind)}" for _, (lo, hi), kind in ranges)
        say(f"outside the fitted range {fitted}: an extrapolation")
    loss = motor_loss(omega_m, D_m, dp_m, loss_fit(m))
    return {"T_fm": loss, "D_m": D_m, "omega_m": omega_m, "dp_m": dp_m, "valid": inside}


def _friction(name: str, T_d: float, omega_m: float) -> Rows:
    """System friction per motor shaft (thesis eq. 2.7)."""
    from stillhook.engine.pack.winch import friction_record
    from stillhook.library import cranes, load_crane
    from stillhook.library.parameter_sets import load_friction
    from stillhook.physics.friction import system_friction as torque

    of_crane = name in cranes() and name != "nov-250t"
    system = load_crane(name).friction.system if of_crane else load_friction(name).system
    if T_d < 0.0:
        raise CommandError(f"T_d = {show(T_d, 'torque')}: no load on the hook gives a negative one. Give 0 or more.")
    return {"T_fs": torque(omega_m, T_d, friction_record(system)), "T_d": T_d, "omega_m": omega_m}


def _drum(name: str, layer: int | None = None) -> Rows:
    """Layers of the drum: diameter, K_wire, wire, inertia."""
    from stillhook.analysis.steady.steady_state import layer_row

    crane = _crane(name, layer)
    if layer is not None:
        return layer_row(crane, layer)
    return [layer_row(crane, n) for n in range(1, crane.drum.layers + 1)]


def _inertia(name: str, s_w: float | None = None) -> Rows:
    """Inertia at the motor shaft by part (figure 2.19)."""
    from stillhook.analysis.steady.steady_state import inertia_parts
    from stillhook.engine.pack.winch import drum_record

    crane = _crane(name)
    L_full = drum_record(crane).L_full
    if s_w is None:
        return [inertia_parts(crane, 0.0), inertia_parts(crane, L_full)]
    if not 0.0 <= s_w <= L_full:
        requested, full = show(s_w, "length"), show(L_full, "length")
        raise CommandError(f's_w = {requested}: "{crane.name}" has 0 to {full} of wire. Give a value in between.')
    return inertia_parts(crane, s_w)


def _speed(name: str, alpha_m: float = 1.0, layer: int | None = None) -> Rows:
    """Wire and motor speed at full command, without leakage; no motor speed where a cylinder moves the wire."""
    from stillhook.analysis.steady.steady_state import layer_row
    from stillhook.engine.pack.winch import motor_speed_max, wire_speed_max

    crane = _crane(name, layer)
    d = crane.drum.d_max if layer is None else float(layer_row(crane, layer)["d_wire_centre"])
    v = {"v_w_max": wire_speed_max(crane, alpha_m, d)}
    if crane.plant.type.full_wire_speed(crane) is not None:
        return v
    return v | {"omega_m": motor_speed_max(crane, alpha_m), "alpha_m": alpha_m, "layer_diameter": d}


def _eigenfrequency(name: str, alpha_m: float = 1.0) -> Rows:
    """Eigenfrequency and damping of the active circuit (paper C eqs 8, 9)."""
    from stillhook.analysis.loop_stability import stability as linear

    e = linear.eigenfrequency(_crane(name), alpha_m)
    return {"omega_0": e.omega_0, "zeta": e.zeta, "period": e.period, "alpha_m": alpha_m}


def _gain_limit(name: str, alpha_m: float = 1.0) -> Rows:
    """Position gain at marginal stability (paper E figure 5)."""
    from stillhook.analysis.loop_stability import stability as linear

    limit = linear.gain_limit(_crane(name), alpha_m)
    return {"K_p_ms": limit.K_p_ms, "omega_c": limit.omega_c, "alpha_m": alpha_m}


def _steady(name: str, v_w: float, controller: Mode | None = None) -> Rows:
    """Pump and motor setting at a steady wire speed, outer diameter, no leakage (figure 2.17)."""
    from stillhook.analysis.steady.steady_state import steady as solve

    crane = _crane(name)
    result = solve(crane, v_w, crane.plant.type.default_mode if controller is None else controller)
    return {k: float(v) if isinstance(v, float) and math.isfinite(v) else v for k, v in result._asdict().items()}


def _crane(name: str, layer: int | None = None) -> Crane:
    from stillhook.library import load_crane

    crane = load_crane(name)
    if layer is not None and not 1 <= layer <= crane.drum.layers:
        raise CommandError(f'layer = {layer}: "{crane.name}" has layers 1 to {crane.drum.layers}. Choose one of them.')
    return crane


QUANTITIES = {
    "motor-loss": Calculation(_motor_loss, ("D_m", "omega_m", "dp_m")),
    "friction": Calculation(_friction, ("T_d", "omega_m")),
    "drum": Calculation(_drum, (), ("layer",)),
    "inertia": Calculation(_inertia, (), ("s_w",)),
    "speed": Calculation(_speed, (), ("alpha_m", "layer")),
    "eigenfrequency": Calculation(_eigenfrequency, (), ("alpha_m",)),
    "gain-limit": Calculation(_gain_limit, (), ("alpha_m",)),
    "steady": Calculation(_steady, ("v_w",), ("controller",)),
}


def _value(name: str, text: str) -> Any:
    """A typed value: a quantity in SI, a layer, a share or a controller. Errors: UnitError, CommandError."""
    from stillhook.spec.scenario import mode_of

    if name in KINDS:
        return parse(text, KINDS[name], name)
    if name == "controller":
        return mode_of(text)
    try:
        number = int(text) if name == "layer" else float(text)
    except ValueError:
        raise CommandError(f"{name} = {quote(text)}: is not a number. Give one without a unit.") from None
    if name == "alpha_m" and not 0.0 < number <= 1.0:
        raise CommandError(f"alpha_m = {number:g}: allowed is above 0 up to 1. Give the displacement over its maximum.")
    return number


def _values(quantity: str, texts: Sequence[str]) -> dict[str, Any]:
    """The typed values of a quantity by name. Errors: CommandError of one line."""
    _, needs, takes = QUANTITIES[quantity]
    allowed = (*needs, *takes)
    values: dict[str, Any] = {}
    for text in texts:
        name, sign, value = text.partition("=")
        if not sign or name not in allowed:
            raise CommandError(
                f"{quote(text)}: {quantity} follows from {', '.join(allowed)}. Write {allowed[0]}=VALUE."
            )
        if name in values:
            raise CommandError(f"{name}: given twice. Give it once.")
        values[name] = _value(name, value)
    if missing := next((name for name in needs if name not in values), None):
        raise CommandError(f"{missing}: missing, and {quantity} follows from it. Write {missing}=VALUE.")
    return values


def calc(
    quantity: Annotated[str, typer.Argument(metavar="WHAT", help=f"One of {', '.join(QUANTITIES)}.")],
    name: Annotated[
        str,
        typer.Argument(
            metavar="CRANE", help="Crane; of motor-loss a motor, such as A6VM215, of friction also a friction set."
        ),
    ],
    values: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME=VALUE]...", help="What it follows from, as listed above.")
    ] = None,
    json: Json = False,
) -> None:
    """Single numbers of the equations, from the values that each follows from (in brackets what may be left out).

    motor-loss: torque loss of one motor shaft, thesis eq. 2.12 (D_m omega_m dp_m). friction: system friction per motor
    shaft, eq. 2.7 (T_d omega_m). drum: layers (all, or [layer]). inertia: at the motor shaft, by part, figure 2.19
    (full and empty drum, or [s_w]). speed: of wire and motor at full command, without leakage [alpha_m, layer].
    eigenfrequency: of the active circuit, paper C eqs 8, 9 [alpha_m]. gain-limit: position gain at marginal stability,
    paper E figure 5 [alpha_m]. steady: pump and motor setting at a steady wire speed, figure 2.17 (v_w [controller]).

    Example: stillhook calc motor-loss A6VM215 D_m="215 cm^3/rev" omega_m="1000 rev/min" dp_m="200 bar"

    Example: stillhook calc steady nov-250t v_w="80 m/min"
    """
    if quantity not in QUANTITIES:
        raise CommandError(f"calc {quote(quantity)}: choose {', '.join(QUANTITIES)}.")
    answer = QUANTITIES[quantity].answer(name, **_values(quantity, values or ()))
    rows = [answer] if isinstance(answer, Mapping) else answer
    header = [f"{k} [{display_unit(k)}]" if display_unit(k) else k for k in rows[0]]
    cells = [[display_number(k, v, 5) for k, v in row.items()] for row in rows]

    lines: list[Line] = [
        *columns(header, [[display_number(k, v, 4) for k, v in row.items()] for row in rows], left=()),
        partial(print_table, header, cells, left=0),
    ]
    if isinstance(answer, Mapping):
        named = [[k, display_number(k, v, 5), display_unit(k), _meaning(k)] for k, v in answer.items()]
        short = columns([], named, left=(0, 2, 3), most=MOST_LINES - 3)
        lines = [*short, partial(print_values, dict(answer))]
    more = "" if isinstance(answer, Mapping) else "every row"
    present(answer, brief=lambda: Answer(f"{quantity} of {name}", lines, more=more), json=json)


def _meaning(name: str) -> str:
    from stillhook.variables import BY_NAME

    return BY_NAME[name].meaning if name in BY_NAME else ""
