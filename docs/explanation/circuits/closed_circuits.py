"""Closed circuits: the pure active winch, and the active/passive winch with its passive circuit."""

from collections.abc import Sequence

import symbols as iso
from sheet import LINES, Point, Sheet


def drain(s: Sheet, *points: Point, kind: str = "tank") -> None:
    """A line through points, and the tank that it ends in."""
    s.pipe(kind, *points)
    s.add(iso.Tank(), points[-1])


def external_leak(s: Sheet, x: float, y_a: float, y_b: float, y: float) -> None:
    """Leakage of pumps and motors from line A (above) and line B (below) to their housings, at height y to the tank."""
    s.pipe("leak", (x, y_a), (x, y_b))
    s.add(iso.Restrictor(), (x, y_a - 2.2))
    s.add(iso.Restrictor(), (x, y_b + 2.2))
    drain(s, (x, y), (x + 0.9, y), (x + 0.9, y - 0.5), kind="leak")
    s.join("leak", (x, y))
    s.join("a", (x, y_a))
    s.join("b", (x, y_b))
    s.flow("Q_ext_a", (x + 0.25, y_a - 1.2), "down", kind="leak")
    s.flow("Q_ext_b", (x + 0.25, y_b + 1.2), "up", kind="leak")


def internal_leak(s: Sheet, x: float, y_a: float, y_b: float, letter: str = "Q_int") -> None:
    """Leakage of pumps and motors from port to port."""
    s.pipe("leak", (x, y_a), (x, y_b))
    s.add(iso.Restrictor(), (x, 0.5 * (y_a + y_b)))
    s.join("a", (x, y_a))
    s.join("b", (x, y_b))
    s.flow(letter, (x + 0.25, y_a - 1.2), "down", kind="leak")


def boost(s: Sheet, x: float, y_a: float, y_b: float, y: float) -> None:
    """Boost pump, the valve that holds its pressure, check valves into both lines; x of the check valves, y of the
    boost line."""
    left, mid = x - 3.6, x - 1.75
    s.pipe("boost", (left, y - 1.1), (left, y), (x, y))
    s.add(iso.pump(variable=False, both=False), (left, y - 1.85))
    s.shaft((left - 1.25, y - 1.85), (left - 0.75, y - 1.85))
    s.add(iso.PrimeMover(), (left - 1.85, y - 1.85))
    drain(s, (left, y - 2.6), (left, y - 3.1))
    s.add(iso.Relief(), (mid, y - 1.85), theta=180)
    s.pipe("boost", (mid, y), (mid, y - 1.05))
    drain(s, (mid, y - 2.65), (mid, y - 3.1))
    s.join("boost", (mid, y), (x, y))
    s.letter("p_boost", (left + 0.1, y + 0.35), "start", LINES["boost"]["color"])
    s.pipe("boost", (x, y), (x, y_a))
    s.pipe("boost", (x, y), (x, y_b))
    s.add(iso.Check(), (x, y_a - 2.2))
    s.add(iso.Check(), (x, y_b + 2.2), theta=180)
    s.join("a", (x, y_a))
    s.join("b", (x, y_b))
    s.flow("Q_boost_a", (x + 0.25, y_a - 1.0), "up", kind="boost")
    s.flow("Q_boost_b", (x + 0.25, y_b + 1.0), "down", kind="boost")


def reliefs(s: Sheet, x: float, y_a: float, y_b: float, y: float) -> None:
    """A relief valve from each line to the tank at height y."""
    s.pipe("a", (x, y_a), (x, y_a - 1.7))
    s.add(iso.Relief(), (x, y_a - 2.4), theta=180)
    s.pipe("tank", (x, y_a - 3.2), (x, y_b + 3.2))
    s.add(iso.Relief(), (x, y_b + 2.4))
    s.pipe("b", (x, y_b), (x, y_b + 1.7))
    drain(s, (x, y), (x + 0.9, y), (x + 0.9, y - 0.5))
    s.join("tank", (x, y))
    s.join("a", (x, y_a))
    s.join("b", (x, y_b))
    s.flow("Q_relief_a", (x + 0.25, y_a - 0.9), "down", kind="a")
    s.flow("Q_relief_b", (x + 0.25, y_b + 0.9), "up", kind="b")


def cross_reliefs(s: Sheet, x: float, y_a: float, y_b: float) -> None:
    """A relief valve from each line to the other."""
    y = 0.5 * (y_a + y_b)
    right = x + 2.1
    s.pipe("a", (x, y_a), (x, y + 0.8))
    s.add(iso.Relief(), (x, y), theta=180)
    s.pipe("b", (x, y - 0.8), (x, y_b))
    s.pipe("b", (right, y_b), (right, y - 0.8))
    s.add(iso.Relief(), (right, y))
    s.pipe("a", (right, y + 0.8), (right, y_a))
    s.join("a", (x, y_a), (right, y_a))
    s.join("b", (x, y_b), (right, y_b))
    s.flow("Q_relief_a", (x + 0.25, y_a - 0.9), "down", kind="a")
    s.flow("Q_relief_b", (right + 0.25, y_b + 0.9), "up", kind="b")


def relief_to_tank(s: Sheet, x: float, y: float, letter: str, tank: float = 4.0) -> None:
    """A relief valve from a line at height y to a tank, which stands `tank` lower."""
    s.pipe("a", (x, y), (x, y - 1.6))
    s.add(iso.Relief(), (x, y - 2.4), theta=180)
    drain(s, (x, y - 3.2), (x, y - tank))
    s.join("a", (x, y))
    s.flow(letter, (x + 0.25, y - 0.9), "down", kind="a")


def leak_to_tank(s: Sheet, x: float, y: float, letter: str, kind: str = "a", tank: float = 3.4) -> None:
    """Leakage from a line at height y to the housings' tank, which stands `tank` lower."""
    s.pipe("leak", (x, y), (x, y - tank))
    s.add(iso.Restrictor(), (x, y - 2.2))
    s.add(iso.Tank(), (x, y - tank))
    s.join(kind, (x, y))
    s.flow(letter, (x + 0.25, y - 1.2), "down", kind="leak")


def flushing(s: Sheet, x: float, y_a: float, y_b: float, y: float) -> None:
    """Flushing shuttle about (x, y) and the valve that holds the pressure of the line flushed."""
    s.add(iso.Shuttle(), (x, y))
    left, out = x - 1.1, x + 2.0
    s.pipe("a", (left, y_a), "|-", (x - 0.475, y + 0.25))
    s.pipe("b", (left, y_b), "|-", (x - 0.475, y - 0.25))
    s.pipe("pilot", (left, y + 2.3), (x - 0.2, y + 2.3), (x - 0.2, y + 1.63))
    s.pipe("pilot", (left, y - 2.3), (x - 0.2, y - 2.3), (x - 0.2, y - 1.63))
    s.join("a", (left, y_a), (left, y + 2.3))
    s.join("b", (left, y_b), (left, y - 2.3))
    s.pipe("tank", (x + 0.475, y), (out, y), (out, y - 0.5))
    s.add(iso.Relief(), (out, y - 1.3), theta=180)
    drain(s, (out, y - 2.1), (out, y - 2.5))
    s.flow("Q_flush_a", (left + 0.25, y_a - 0.8), "down", kind="a")
    s.flow("Q_flush_b", (left + 0.25, y_b + 0.8), "up", kind="b")


def accumulator(s: Sheet, x: float, y: float, line: float, low: float | None = None) -> None:
    """Piston accumulator with gas vessels, piston at (x, y), on a line at height `line`; low: height of the low side
    that it leaks to past its piston."""
    left = x - 1.3
    if line > y:
        s.pipe("a", (left, line), (left, y - 1.8), (x, y - 1.8), (x, y - 1.2))
        s.join("a", (left, line))
        s.flow("Q_o", (left - 0.25, line - 1.2), "down", "left", "a")
    else:
        s.pipe("a", (x, line), (x, y - 1.2))
        s.join("a", (x, line))
        s.flow("Q_o", (x - 0.25, 0.5 * (line + y - 1.2)), "up", "left", "a")
    s.add(iso.Accumulator(), (x, y))
    s.letter("V_o", (x + 0.65, y - 0.75), "start", LINES["a"]["color"])
    s.letter("p_o", (x + 0.65, y + 0.7), "start", LINES["gas"]["color"])
    if low is not None:
        s.pipe("leak", (x + 0.5, y), (x + 1.5, y), (x + 1.5, low))
        s.add(iso.Restrictor(), (x + 1.5, y - 2.2))
        s.join("b", (x + 1.5, low))
        s.letter("C_leak", (x + 1.95, y - 2.2), "start", LINES["leak"]["color"])
    top = y + 1.7
    s.pipe("gas", (x, y + 1.2), (x, top), (x + 4.0, top), (x + 4.0, y + 1.1))
    s.pipe("gas", (x + 2.7, top), (x + 2.7, y + 1.1))
    s.join("gas", (x + 2.7, top))
    for i in (2.7, 4.0):
        s.add(iso.GasVessel(), (x + i, y + 0.15), theta=180)
    s.note("gas vessels", (x + 4.0, y - 1.15))


def load_path(s: Sheet, x: float, y: float, top: float, rim: float = 1.3, r: float = 0.62, fall: float = 2.6) -> None:
    """Drum about (x, y), wire over the sheave at the crane's tip at height top, hook and payload."""
    s.add(iso.Drum(rim, r), (x, y))
    lead = x + 0.55
    s.add(iso.Sheave(), (lead + 0.5, top))
    s.pipe("wire", (lead, y + r), (lead, top))
    s.flow("v_w", (lead - 0.25, 0.5 * (y + r + top)), "down", "left")
    s.letter("i_hD", (x - 1.75, y + 0.45), "end")
    hang(s, lead + 1.0, top, fall)


def hang(s: Sheet, x: float, top: float, fall: float) -> None:
    """Wire from the right of the sheave at the crane's tip, hook and payload."""
    s.pipe("wire", (x, top), (x, top - fall))
    s.add(iso.Payload(), (x, top - fall))
    s.flow("F_w", (x + 0.25, top - 1.3), "up")
    s.flow("v_tip", (x + 0.35, top + 0.35), "up")
    s.note("crane tip", (x - 0.5, top + 0.85))
    s.flow("v_load", (x + 1.15, top - fall - 1.9), "up")


def shaft_line(s: Sheet, left: float, y: float, right: float) -> None:
    """Shaft from a motor to the pinion at x = right, with speed, holding brake and friction."""
    s.shaft((left, y), (right, y))
    s.turning("omega_m", (left + 0.6, y), "below")
    s.add(iso.Brake(), (left + 1.7, y))
    s.letter("T_brake", (left + 1.8, y + 1.15))
    s.letter("T_f", (left + 1.8, y - 1.15))
    s.add(iso.Pinion(), (right, y))


def pumped(
    s: Sheet,
    y_h: float,
    y_l: float,
    to_high: Sequence[Point],
    to_low: Sequence[Point],
    letters: str,
    notes: Sequence[str],
    dx: float = 0.0,
) -> None:
    """Pumps between a line at height y_h and one at y_l, and the ways of both lines to the units. letters: setting of
    the pumps, share that runs, flow, pressures of both lines; dx: shift of the first two, of pumps whose speed and
    power are beside others."""
    alpha, share, flow, p_h, p_l = letters.split()
    y = 0.5 * (y_h + y_l)
    s.add(iso.pump(), (2.6, y))
    s.add(iso.PrimeMover(), (0.4, y))
    s.shaft((1.0, y), (1.85, y))
    if not dx:
        s.turning("omega_p", (1.42, y))
        s.letter("P_hpu", (0.4, y - 1.0))
    s.letter(alpha, (4.0 + dx, y + 0.85))
    s.letter(share, (3.75 + dx, y - 0.75))
    s.pipe("a", (2.6, y + 0.75), (2.6, y_h), *to_high)
    s.pipe("b", (2.6, y - 0.75), (2.6, y_l), *to_low)
    s.flow(flow, (2.35, y_h - 1.2), "up", "left", "a")
    for kind, name, note, height in (("a", p_h, notes[0], y_h + 0.35), ("b", p_l, notes[1], y_l - 0.38)):
        s.letter(name, (9.4, height), "end", LINES[kind]["color"])
        s.note(note, (9.6, height), "start")


def closed_circuit(
    s: Sheet, y_a: float, y_b: float, right: float, top: float, bottom: float, cross: bool = False
) -> None:
    """Pumps and lines A and B with everything on them, to ports at (right, top) and (right, bottom). cross: the relief
    valves open into the other line, not to the tank."""
    y = 0.5 * (y_a + y_b)
    sides = ("line A, hoisting side", "line B, lowering side")
    to_a, to_b = [(right, y_a), (right, top)], [(right, y_b), (right, bottom)]
    pumped(s, y_a, y_b, to_a, to_b, "alpha_p f_pump Q_p p_a p_b", sides)
    internal_leak(s, 5.0, y_a, y_b)
    external_leak(s, 6.8, y_a, y_b, y + 1.2)
    s.note("leakage of the units", (6.2, y_b - 0.38))
    boost(s, 14.2, y_a, y_b, y + 0.4)
    if cross:
        cross_reliefs(s, 16.6, y_a, y_b)
    else:
        reliefs(s, 16.8, y_a, y_b, y)
    flushing(s, 22.0 if cross else 20.7, y_a, y_b, y)


def pure_active() -> Sheet:
    """One closed circuit moves the drum and carries the weight."""
    s = Sheet(
        "Pure active winch",
        "Closed circuit: over-centre pumps, lines A and B, variable motors, boost, relief, flushing and leakage; brake,"
        " gear, drum, wire and load.",
    )
    y_a, y_b, right = 10.0, 1.0, 25.6
    y = 0.5 * (y_a + y_b)
    closed_circuit(s, y_a, y_b, right, y + 0.75, y - 0.75)
    s.add(iso.motor(), (right, y))
    s.letter("alpha_m", (right + 1.3, y + 0.85))
    s.flow("Q_m", (right + 0.25, y_a - 1.2), "down", kind="a")
    shaft_line(s, right + 0.75, y, 29.8)
    load_path(s, 31.2, y - 1.7, y_a)
    return s


def active_passive() -> Sheet:
    """A closed circuit moves the drum, a second one with accumulator carries the weight."""
    s = Sheet(
        "Active/passive winch",
        "Above: the closed circuit of the pure active winch. Below: the passive circuit, pumps, motors, accumulator"
        " with gas vessels, low side at a held pressure. Both sets of motors turn the drum.",
    )
    y_a, y_b, right = 21.0, 12.0, 25.6
    y_m, y_pm = 13.8, 7.6
    closed_circuit(s, y_a, y_b, right, y_m + 0.75, y_m - 0.75)
    s.add(iso.motor(), (right, y_m))
    s.letter("alpha_m", (right + 1.3, y_m + 0.85))
    s.flow("Q_m", (right + 0.25, y_a - 1.2), "down", kind="a")
    shaft_line(s, right + 0.75, y_m, 29.8)

    y_h, y_l = 9.4, 0.6
    sides = ("high side", "low side, its pressure is held")
    to_high, to_low = [(right, y_h), (right, y_pm + 0.75)], [(right, y_l), (right, y_pm - 0.75)]
    pumped(s, y_h, y_l, to_high, to_low, "alpha_pp f_passive Q_pp p_hp p_lp", sides, 0.1)
    passive_lines(s, y_h, y_l)
    s.add(iso.motor(), (right, y_pm))
    s.letter("alpha_pm", (right + 1.4, y_pm + 0.85))
    s.shaft((right + 0.75, y_pm), (29.8, y_pm))
    s.turning("omega_m", (right + 1.35, y_pm), "below")
    s.add(iso.Pinion(), (29.8, y_pm))
    s.flow("D_pm omega_m", (right + 0.25, y_pm - 3.0), "down", kind="b")
    load_path(s, 31.2, 0.5 * (y_m + y_pm), y_a, rim=0.5 * (y_m - y_pm) - 0.4, r=1.1)
    return s


def passive_lines(s: Sheet, y_h: float, y_l: float, relief: str = "Q_relief_p", low: str = "Q_low") -> None:
    """What is on high and low side of a circuit with accumulator; relief, low: letters of two flows."""
    internal_leak(s, 5.4, y_h, y_l, "Q_lp")
    leak_to_tank(s, 7.2, y_h, "Q_lp_ext")
    relief_to_tank(s, 10.0, y_h, relief)
    accumulator(s, 15.0, y_h - 4.0, y_h, y_l)
    s.pipe("b", (22.5, y_l), (22.5, y_l + 1.4))
    s.add(iso.PressureTank(), (22.5, y_l + 2.1))
    s.join("b", (22.5, y_l))
    if low:
        s.flow(low, (22.75, y_l + 0.75), "up", kind="b")
