"""Components of the winch: published parameters in the library, leakage, inertia, response of the pumps' swash plates,
and circuits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.integrate import solve_ivp

from stillhook.analysis.steady.steady_state import inertia_parts
from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import active_record, drum_record, wire_speed_max
from stillhook.library import leak_table, load_crane, motor, system_friction
from stillhook.physics.hydraulics.swash import swash_acceleration
from stillhook.report import kit
from stillhook.report.plots.colours import COLOURS
from stillhook.thesis.gallery import Axis, Curve, Drawing, Panel, Printed, Table
from stillhook.units import from_display, in_display, show
from stillhook.validate.criteria.criteria import load_criteria

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CIRCUITS = Path(__file__).parent / "circuits"
LEFT = 80.0
"""Wire on the drum that figure F7 calls empty [m]."""
CRITERIA = {
    "1a": "at least 2",
    "1b": "at least 2",
    "1b-highest": "above 40 % of the SWL",
    "1c-low": "from 0.5 m",
    "1c-high": "to 2.0 m",
    "1d": "above 1500 s",
    "2a": "below 5 cm",
    "2b": "below 5 cm",
    "3-pump": "below 3 %",
    "3-motor": "below 3 %",
}
"""Table 2 of paper F by the keys of the library's criteria."""


def _beside(title: str, rows: Sequence[Printed], note: str = "") -> Drawing:
    """A table of numbers, printed and ours."""
    return Drawing(title, tables={"data": Table(Printed._fields, [list(row) for row in rows])}, printed=rows, note=note)


def circuit(name: str) -> Drawing:
    """The circuit that a winch type computes."""
    svg = (CIRCUITS / f"{name}.svg").read_text(encoding="utf-8")
    return Drawing(f"Circuit of the winch type {name}, as the twin computes it", svg=svg)


LOSSES = {
    "A6VM280": ("8.38e-3", "2.58e10", "0.00519", "18.1", "1.47e-14"),
    "A6VM215": ("4.05e-3", "3.69e10", "0.0050", "14.0", "1.16e-14"),
    "A6VM170": ("2.48e-3", "5.01e10", "0.0049", "11.0", "0.925e-14"),
    "A6VM215-crane-2-second-loop": ("0", "4.5e10", "0.012", "12.8", "0"),
}
"""Printed parameters X_1 to X_5 of MJ4 in SI: paper D tables 1 and 4."""
FRICTIONS = {
    "L4593": ("474e-7", "3.9", "0.000084", "178", "0.0038", "328e-7"),
    "crane-1": ("328e-7", "0.0", "3.15", "157", "0.00851", "121e-7"),
    "crane-2": ("155e-7", "0.0", "0.562", "229", "0.00943", "162e-7"),
    "crane-2-second-loop": ("141e-7", "0.0", "2.38", "270", "0.0089", "159e-7"),
}
"""Printed parameters Y_1 to Y_6 in SI, Y_4 in rev/min: table 2.4, paper D tables 3 and 4."""


def parameters(*names: str) -> Drawing:
    """Published loss and friction parameters against those of the library."""
    rows = []
    for name in names:
        if name in LOSSES:
            loss = motor(name).loss
            rows += [
                Printed(f"{name} X_{i + 1}", x, f"{getattr(loss, f'X_{i + 1}'):g}") for i, x in enumerate(LOSSES[name])
            ]
        if name in FRICTIONS:
            Y = system_friction(name)
            ours = [Y.Y_1, Y.Y_2, Y.Y_3, in_display(Y.Y_4, "rotation"), Y.Y_5, Y.Y_6]
            printed = zip(FRICTIONS[name], ours, strict=True)
            rows += [Printed(f"{name} Y_{i + 1}", x, f"{y:g}") for i, (x, y) in enumerate(printed)]
    return _beside("Published parameters and those of the library, SI; Y_4 in rev/min", rows)


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


def main_data() -> Drawing:
    """Main components of the 250 t crane (ET1)."""
    c = load_crane("nov-250t")
    assert c.passive is not None
    a, p = c.active, c.passive
    rows = [
        Printed("active motors", "1075 cm³/rev", show(a.motor.D_total, "displacement")),
        Printed("passive motors", "3440 cm³/rev", show(p.motor.D_total, "displacement")),
        Printed("active pumps", "1355 cm³/rev", show(a.pump.D_total, "displacement")),
        Printed("passive pumps", "1210 cm³/rev", show(p.pump.D_total, "displacement")),
        Printed("gearbox by pinion and ring gear", "35.4 · 14.17 = 501.6", f"{c.i_hD:.1f}"),
        Printed("drum diameter", "2.8 m", f"{c.drum.d:g} m"),
        Printed("drum width", "1.9 m", f"{c.drum.width:g} m"),
        Printed("wire diameter", "96 mm", show(c.wire.d, "diameter")),
    ]
    return _beside("nov-250t: main components", rows)


def loop_data() -> Drawing:
    """Parameters of the linear analysis (ET2)."""
    c = load_crane("nov-250t")
    a, servo, pumps = c.active, active_record(c).motor_servo, active_record(c).pump_servo
    rows = [
        Printed("outer wire diameter", "5.1 m", f"{c.drum.d_max:g} m"),
        Printed("inertia", "4.1 kg/m²", show(c.inertia.J_m_eff, "inertia")),
        Printed("volume of a line", "80 L", show(a.line.V, "volume")),
        Printed("bulk modulus", "17 500 bar", f"{a.line.bulk_modulus / 1e5:.0f} bar"),
        Printed("least motor displacement", "645 cm³/rev", show(a.motor.alpha_min * a.motor.D_total, "displacement")),
        Printed("gain K_p", "0.16 1/m", f"{c.control.K_p:g} 1/m"),
        Printed("gain K_1", "0.68 s/m (an erratum)", f"{1.0 / wire_speed_max(c):.3f} s/m"),
        Printed("threshold", "0.6", f"{c.control.u_thr:g}"),
        Printed("pumps: omega_n, zeta", "31 rad/s, 0.9", f"{pumps.omega_n:g} rad/s, {pumps.zeta:g}"),
        Printed("motors: omega_n, zeta", "5 rad/s, 1", f"{servo.omega_n:g} rad/s, {servo.zeta:g}"),
        Printed("speed of the pumps", "1800 rev/min", show(a.pump.omega_p, "rotation")),
        Printed("leakage", "0.4 L/min/bar", show(a.C_leak, "leakage") if a.C_leak else "from motors and pumps"),
    ]
    return _beside("nov-250t: parameters of the stability analysis", rows)


def criteria() -> Drawing:
    """Criteria that a twin must meet (FT2)."""
    found = {c.key: c for c in load_criteria("paper-f").criteria}
    rows = [Printed(found[k].title, x, f"{found[k].kind.value} {found[k].written}") for k, x in CRITERIA.items()]
    return _beside("Criteria of paper F as stillhook validate judges them", rows)
