"""Components of the winch: published parameters in the library, leakage, inertia, response of the pumps' swash plates,
and circuits."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp

from stillhook.analysis.steady.steady_state import inertia_parts
from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import active_record, drum_record
from stillhook.library import leak_table, load_crane, motor, system_friction
from stillhook.physics.hydraulics.swash import swash_acceleration
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS
from stillhook.thesis.gallery import DATA, Axis, Curve, Drawing, Panel, Printed, Table
from stillhook.units import from_display, in_display, show
from stillhook.validate.criteria.criteria import load_criteria

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEFT = 80.0
"""Wire on the drum that figure F7 calls empty [m]."""


def _beside(title: str, rows: Sequence[Printed], note: str = "") -> Drawing:
    """A table of numbers, printed and ours."""
    return Drawing(title, tables={"data": Table(Printed._fields, [list(row) for row in rows])}, printed=rows, note=note)


def circuit(name: str) -> Drawing:
    """The circuit that a winch type computes."""
    svg = (DATA / f"{name}.svg").read_text(encoding="utf-8")
    return Drawing(f"Circuit of the winch type {name}, as the twin computes it", svg=svg)


@cache
def _printed() -> list[dict[str, str]]:
    with (DATA / "printed.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _ours(row: Mapping[str, str]) -> Printed:
    """A printed number against that of a library's entry: what it is, its name and the place in it."""
    what, name, *place = row["ours"].split()
    if what == "criterion":
        one = next(c for c in load_criteria("paper-f").criteria if c.key == name)
        return Printed(one.title, row["printed"], f"{one.kind.value} {one.written}")
    load: dict[str, Callable[[str], Any]] = {"motor": motor, "friction": system_friction, "crane": load_crane}
    value, kind = attrgetter(place[0])(load[what](name)), row["kind"]
    text = show(value, kind) if kind and what == "crane" else f"{in_display(value, kind) if kind else value:g}"
    return Printed(row["quantity"], row["printed"], text)


def numbers(*tables: str) -> Drawing:
    """Numbers of tables as printed, and those of the library: motors, frictions, cranes, criteria."""
    return _beside(
        "Printed numbers and those of the library", [_ours(r) for t in tables for r in _printed() if r["table"] == t]
    )


def pump_leakage(speed: str) -> Drawing:
    """Leak conductance of an A4VSG355 at a pump speed [rev/min] by displacement."""
    printed = {
        "1500": ("0.030", "0.030", "0.027", "0.024", "0.034"),
        "2000": ("0.035", "0.037", "0.040", "0.039", "0.057"),
    }[speed]
    table = leak_table("A4VSG355")
    ours = table.C[("1500", "2000").index(speed)]
    rows = [
        Printed(f"at {show(D, 'displacement')}", f"{x} L/min/bar", show(C, "leakage"))
        for D, x, C in zip(table.D, printed, ours, strict=True)
    ]
    return _beside(f"A4VSG355 at {speed} rev/min: leak conductance", rows, "The printed 384 cm³/rev reads 284.")


def motor_leakage() -> Drawing:
    """Leak conductance C_1 + C_2 n of one active motor of the 250 t crane over speed (2.20, F8)."""
    m = load_crane("nov-250t").active.motor
    omega = from_display(1.0, "rotation") * np.linspace(0.0, 2500.0, 51)
    curve = Curve("C_1 + C_2 n, as in the crane file", omega, m.C_1 + m.C_2 * omega)
    panel = Panel(Axis("motor speed", "rotation"), Axis("leak conductance", "leakage"), [curve])
    note = "Ours: C_1 and C_2 of the crane file are assumed; the thesis prints neither them nor the supplier's points."
    return Drawing("One A6VM of 215 cm³/rev: leakage by eq. 2.18", [panel], note=note)


def inertia(name: str, *printed: str) -> Drawing:
    """Inertia at the motor shaft by part, drum full and with 80 m left (2.19, F7)."""
    crane = load_crane(name)
    states = {"drum full": inertia_parts(crane, 0.0)}
    states["80 m left"] = inertia_parts(crane, drum_record(crane).L_full - LEFT)
    parts = {"J_motor": "motors", "J_gear": "gears", "J_drum": "drum", "J_wire": "wire"}
    head = ("state", *(f"{words} [kg m^2]" for words in parts.values()), "total [kg m^2]")
    rows = [[state, *(one[k] for k in parts), one["J_m"]] for state, one in states.items()]

    def draw() -> Figure:
        figure, ax = kit.panel((8.0, 5.0), f"{name}: inertia at the motor shaft", grid="y")
        below = np.zeros(len(states))
        for colour, (key, words) in zip(COLOURS, parts.items(), strict=False):
            height = np.array([one[key] for one in states.values()])
            ax.bar(list(states), height, 0.5, bottom=below, color=colour, label=words)
            below += height
        kit.axis(ax, y=kit.with_unit("inertia", "inertia"))
        kit.legend(ax, loc="upper right")
        return figure

    pairs = zip(states.items(), printed, strict=False)
    compared = [Printed(f"total, {state}", f"{x} kg m²", f"{one['J_m']:.2f} kg m²") for (state, one), x in pairs]
    return Drawing(
        f"{name}: inertia at the motor shaft", draw=draw, tables={"data": Table(head, rows)}, printed=compared
    )


def swash(*inputs: str) -> Drawing:
    """Swash plate of a pump after a ramp of the command, or behind a sine (C10, C12, F6)."""
    servo = active_record(load_crane("nov-150t")).pump_servo
    commands: dict[str, Callable[[FloatArray], FloatArray]] = {
        "ramp": lambda t: np.clip(t / 0.1, 0.0, 1.0),
        "sine": lambda t: np.sin(2.0 * math.pi * t / 2.0),
    }
    panels = []
    for name in inputs:
        u, t = commands[name], np.linspace(0.0, 1.0 if name == "ramp" else 4.0, 201)

        def rates(at: float, x: FloatArray, u: Callable[[FloatArray], FloatArray] = u) -> list[float]:
            return [float(x[1]), float(swash_acceleration(x[0], x[1], float(u(np.array(at))), servo))]

        alpha = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, rtol=1e-8, atol=1e-10).y[0]
        curves = [Curve("command", t, u(t), "--"), Curve("swash plate", t, alpha)]
        panels.append(Panel(Axis("time", "time"), Axis("displacement over its maximum"), curves, name))
    printed = [
        Printed("natural frequency", "31 rad/s", show(servo.omega_n, "frequency")),
        Printed("damping ratio", "0.9", f"{servo.zeta:g}"),
    ]
    note = "Ours: rise of the ramp (0.1 s) and period of the sine (2 s) are not printed."
    return Drawing("Swash plate of an A4VSG: second order with rate limits", panels, printed=printed, note=note)
