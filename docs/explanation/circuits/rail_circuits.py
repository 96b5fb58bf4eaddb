"""Winches on a common rail: open circuit with directional valve, secondary control, electric."""

from closed_circuits import (
    external_leak,
    internal_leak,
    leak_to_tank,
    load_path,
    passive_lines,
    relief_to_tank,
    reliefs,
    shaft_line,
)
from symbols import (
    LINES,
    Block,
    Capacitor,
    Check,
    Counterbalance,
    Earth,
    PrimeMover,
    Proportional43,
    Resistor,
    Sheet,
    ShuttleValve,
    Switch,
    Tank,
    motor,
    pump,
    secondary_unit,
)


def open_circuit() -> Sheet:
    """A proportional directional valve meters oil to and from the motors; a counterbalance valve holds the load."""
    s = Sheet(
        "Open-circuit winch",
        "Load-sensing pumps, proportional 4/3 directional valve, counterbalance valve in the hoisting line, motors;"
        " relief and make-up valves of both lines, back-pressure valve in the tank line, leakage.",
    )
    y_p, y_s, y_a, y_b, x_v, right = 4.4, 6.4, 14.4, 2.0, 12.0, 25.8
    y_v, y_t, y = 8.2, 5.4, 0.5 * (y_a + y_b)
    supply(s, y_p, y_s, x_v - 0.28)
    s.add(Proportional43(), (x_v, y_v))
    s.letter("x_v", (x_v - 2.75, y_v + 0.1), "end")
    for i, (hoisting, lowering) in enumerate((("Q_PA", "Q_PB"), ("Q_BT", "Q_AT"))):
        s.letter(hoisting, (x_v - 1.1, y_v - 0.95 - 0.45 * i))
        s.letter(lowering, (x_v + 1.1, y_v - 0.95 - 0.45 * i))
    s.pipe("a", (x_v - 0.28, y_s), (x_v - 0.28, y_v - 0.55))
    s.pipe("tank", (x_v + 0.28, y_v - 0.55), (x_v + 0.28, y_t - 0.4))
    s.add(Check(spring=True), (x_v + 0.28, y_t - 1.0), theta=180)
    s.pipe("tank", (x_v + 0.28, y_t - 1.6), (x_v + 0.28, y_t - 1.9))
    s.add(Tank(), (x_v + 0.28, y_t - 1.9))

    a, b, bend = x_v - 0.28, x_v + 0.28, 15.2
    s.pipe("a", (a, y_v + 0.55), (a, 10.6))
    s.add(Counterbalance(), (a, 12.1))
    s.pipe("a", (a, 13.6), (a, y_a), (right, y_a), (right, y + 0.75))
    s.pipe("b", (b, y_v + 0.55), (b, 9.4), (bend, 9.4), (bend, y_b), (right, y_b), (right, y - 0.75))
    s.pipe("pilot", (a + 1.3, 11.92), (13.8, 11.92), (13.8, 9.4))
    s.join("b", (13.8, 9.4))
    s.note("counterbalance\nvalve", (a - 2.1, 12.1), "end")
    s.letter("psi", (14.05, 11.9), "start")
    s.pipe("pilot", (a, 9.7), (8.0, 9.7))
    s.pipe("pilot", (12.9, 9.4), (12.9, 10.15), (6.5, 10.15), (6.5, 9.7), (7.0, 9.7))
    s.add(ShuttleValve(), (7.5, 9.7))
    s.pipe("pilot", (7.5, 9.42), (7.5, 7.5), (3.75, 7.5), (3.75, y_p + 0.95), arrow="->")
    s.join("a", (a, 9.7))
    s.join("b", (12.9, 9.4))
    s.note("load sensing", (5.6, 7.8))

    s.letter("p_a", (17.2, y_a + 0.35), "end", LINES["a"]["color"])
    s.note("line A, hoisting side", (17.4, y_a + 0.35), "start")
    s.letter("p_b", (17.2, y_b - 0.38), "end", LINES["b"]["color"])
    s.note("line B, lowering side", (17.4, y_b - 0.38), "start")
    make_up(s, 16.8, y_a, y_b, y_t, b)
    internal_leak(s, 19.0, y_a, y_b)
    external_leak(s, 20.7, y_a, y_b, y)
    reliefs(s, 23.2, y_a, y_b, y)
    s.add(motor(variable=False), (right, y))
    s.flow("Q_m", (right + 0.25, y_a - 1.2), "down", kind="a")
    shaft_line(s, right + 0.75, y, 30.0)
    load_path(s, 31.4, y - 1.7, y_a)
    return s


def supply(s: Sheet, y_p: float, y_s: float, right: float) -> None:
    """Load-sensing pumps at height y_p on a supply line at height y_s."""
    s.add(pump(both=False), (2.6, y_p))
    s.add(PrimeMover(), (0.4, y_p))
    s.shaft((1.0, y_p), (1.85, y_p))
    s.letter("P_hpu", (0.4, y_p - 1.0))
    s.letter("alpha_p", (4.1, y_p + 0.55))
    s.letter("f_pump", (3.9, y_p - 0.75))
    s.pipe("tank", (2.6, y_p - 0.75), (2.6, y_p - 1.3))
    s.add(Tank(), (2.6, y_p - 1.3))
    s.pipe("a", (2.6, y_p + 0.75), (2.6, y_s), (right, y_s))
    s.flow("Q_p", (2.35, y_s - 0.7), "up", "left", "a")
    s.letter("p_s", (2.6, y_s + 0.35), "middle", LINES["a"]["color"])
    leak_to_tank(s, 5.6, y_s, "Q_ext_s")
    relief_to_tank(s, 8.4, y_s, "Q_relief_s")


def make_up(s: Sheet, x: float, y_a: float, y_b: float, y: float, left: float) -> None:
    """Check valves from the tank line at height y, which begins at x = left, into both motor lines."""
    s.pipe("tank", (left, y), (x, y))
    s.pipe("tank", (x, y), (x, y_a))
    s.pipe("tank", (x, y), (x, y_b))
    s.add(Check(spring=True), (x, y_a - 2.6))
    s.add(Check(spring=True), (x, y_b + 1.9), theta=180)
    s.join("tank", (left, y), (x, y))
    s.join("a", (x, y_a))
    s.join("b", (x, y_b))
    s.letter("p_T", (left + 1.0, y - 0.35), "start", LINES["tank"]["color"])
    s.flow("Q_make_up_a", (x + 0.25, y_a - 1.2), "up", kind="tank")
    s.flow("Q_make_up_b", (x + 0.25, y_b + 0.8), "down", kind="tank")


def secondary() -> Sheet:
    """Over-centre units take torque from a rail whose pressure an accumulator holds."""
    s = Sheet(
        "Winch with secondary control",
        "Constant-pressure rail with accumulator and gas vessels, pumps that top it up, over-centre units on the drum's"
        " shaft, low side at a held pressure, relief valve and leakage.",
    )
    y_h, y_l, right = 10.0, 1.0, 25.6
    y = 0.5 * (y_h + y_l)
    s.add(pump(both=False), (2.6, y))
    s.add(PrimeMover(), (0.4, y))
    s.shaft((1.0, y), (1.85, y))
    s.turning("omega_p", (1.42, y))
    s.letter("P_hpu", (0.4, y - 1.0))
    s.letter("alpha_p", (4.0, y + 0.85))
    s.letter("f_pump", (3.75, y - 0.75))
    s.pipe("a", (2.6, y + 0.75), (2.6, y_h), (right, y_h), (right, y + 0.75))
    s.pipe("b", (2.6, y - 0.75), (2.6, y_l), (right, y_l), (right, y - 0.75))
    s.flow("Q_p", (2.35, y_h - 1.2), "up", "left", "a")
    s.letter("p_hp", (9.4, y_h + 0.35), "end", LINES["a"]["color"])
    s.note("rail", (9.6, y_h + 0.35), "start")
    s.letter("p_lp", (9.4, y_l - 0.38), "end", LINES["b"]["color"])
    s.note("low side, its pressure is held", (9.6, y_l - 0.38), "start")
    passive_lines(s, y_h, y_l, "Q_relief")
    s.add(secondary_unit(), (right, y))
    s.letter("alpha_m", (right + 1.3, y + 0.85))
    s.flow("Q_m", (right + 0.25, y_h - 1.2), "down", kind="a")
    shaft_line(s, right + 0.75, y, 29.8)
    load_path(s, 31.2, y - 1.7, y_h)
    return s


def electric() -> Sheet:
    """Single-line diagram: grid, converter, DC link with store and braking resistor, inverter, motors."""
    s = Sheet(
        "Electric winch",
        "Single-line diagram: grid, active front end, DC link with supercapacitors and braking resistor, inverters,"
        " motors with permanent magnets; brake, gear, drum, wire and load.",
    )
    y = 5.5
    s.note("vessel's grid\n3~", (0.2, y + 0.9))
    s.pipe("electric", (0.2, y + 0.4), (0.2, y - 0.4))
    s.pipe("electric", (0.2, y), (1.5, y))
    s.add(Switch(), (2.0, y))
    s.pipe("electric", (2.5, y), (4.3, y))
    s.flow("P_grid", (3.3, y + 0.3), "right", "above")
    s.add(Block(diagonal=True), (5.0, y))
    s.note("~", (4.65, y + 0.35), color="#111111", size=12)
    s.note("=", (5.35, y - 0.35), color="#111111", size=12)
    s.note("active\nfront end", (5.0, y - 1.3))
    s.pipe("electric", (5.7, y), (15.3, y))
    s.note("DC link", (7.6, y + 0.4))
    s.pipe("electric", (9.0, y), (9.0, y - 0.9))
    s.add(Block(diagonal=True), (9.0, y - 1.6))
    s.note("=", (8.65, y - 1.25), color="#111111", size=12)
    s.note("=", (9.35, y - 1.95), color="#111111", size=12)
    s.note("chopper", (8.1, y - 1.6), "end")
    s.pipe("electric", (9.0, y - 2.3), (9.0, y - 2.7))
    s.add(Resistor(), (9.0, y - 3.3))
    s.note("braking\nresistor", (8.5, y - 3.3), "end")
    s.pipe("electric", (9.0, y - 3.9), (9.0, y - 4.3))
    s.add(Earth(), (9.0, y - 4.3))
    s.flow("P_resistor", (9.25, y - 0.5), "down")
    s.pipe("electric", (12.5, y), (12.5, y - 1.5))
    s.add(Resistor(), (12.5, y - 2.1))
    s.letter("R", (13.0, y - 2.1), "start")
    s.pipe("electric", (12.5, y - 2.7), (12.5, y - 2.8))
    s.add(Capacitor(), (12.5, y - 3.3))
    s.letter("E_store", (13.2, y - 3.3), "start")
    s.note("supercapacitors", (11.9, y - 3.3), "end")
    s.pipe("electric", (12.5, y - 3.8), (12.5, y - 4.3))
    s.add(Earth(), (12.5, y - 4.3))
    s.flow("P_store", (12.75, y - 0.8), "up")
    s.join("electric", (9.0, y), (12.5, y))
    s.flow("P_dc", (14.2, y + 0.3), "right", "above")
    s.add(Block(diagonal=True), (16.0, y))
    s.note("=", (15.65, y + 0.35), color="#111111", size=12)
    s.note("~", (16.35, y - 0.35), color="#111111", size=12)
    s.note("inverters", (16.0, y - 1.1))
    s.pipe("electric", (16.7, y), (19.0, y))
    for i in range(3):
        s.pipe("thin", (17.05 + 0.15 * i, y - 0.2), (17.25 + 0.15 * i, y + 0.2))
    s.flow("i", (18.3, y + 0.3), "right", "above")
    s.add(PrimeMover("M\n3~"), (19.6, y))
    s.letter("theta", (19.6, y + 1.0))
    s.letter("T_m", (19.6, y - 1.0))
    shaft_line(s, 20.2, y, 23.8)
    load_path(s, 25.2, y - 1.7, y + 4.5)
    return s
