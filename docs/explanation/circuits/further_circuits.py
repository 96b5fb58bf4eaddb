"""Circuits of the other types: open circuit, secondary control, electric, cylinder, and the passive compensator."""

import closed_circuits as parts
import symbols as iso
from sheet import BLACK, LINES, Point, Sheet, Symbol


def open_circuit() -> Sheet:
    """A proportional directional valve meters oil to and from the motors; a counterbalance valve holds the load."""
    s = Sheet(
        "Open-circuit winch",
        "Load-sensing pumps, proportional 4/3 directional valve, counterbalance valve in the hoisting line, motors;"
        " relief and make-up valves of both lines, back-pressure valve in the tank line, leakage.",
    )
    y_p, y_s, y_a, y_b, x_v, right = 4.4, 6.4, 14.4, 2.0, 12.0, 26.4
    y_v, y_t, y = 8.2, 5.4, 0.5 * (y_a + y_b)
    supply(s, y_p, y_s, x_v - 0.28)
    s.add(iso.Proportional43(), (x_v, y_v))
    s.letter("x_v", (x_v - 2.75, y_v + 0.1), "end")
    for i, (hoisting, lowering) in enumerate((("Q_PA", "Q_PB"), ("Q_BT", "Q_AT"))):
        s.letter(hoisting, (x_v - 1.1, y_v - 0.95 - 0.45 * i))
        s.letter(lowering, (x_v + 1.1, y_v - 0.95 - 0.45 * i))
    s.pipe("a", (x_v - 0.28, y_s), (x_v - 0.28, y_v - 0.55))
    s.pipe("tank", (x_v + 0.28, y_v - 0.55), (x_v + 0.28, y_t - 0.4))
    s.add(iso.Check(spring=True), (x_v + 0.28, y_t - 1.0), theta=180)
    parts.drain(s, (x_v + 0.28, y_t - 1.6), (x_v + 0.28, y_t - 1.9))

    a, b, bend = x_v - 0.28, x_v + 0.28, 15.2
    s.pipe("a", (a, y_v + 0.55), (a, 10.6))
    s.add(iso.Counterbalance(), (a, 12.1))
    s.pipe("a", (a, 13.6), (a, y_a), (right, y_a), (right, y + 0.75))
    s.pipe("b", (b, y_v + 0.55), (b, 9.4), (bend, 9.4), (bend, y_b), (right, y_b), (right, y - 0.75))
    s.pipe("pilot", (a + 1.3, 11.92), (13.8, 11.92), (13.8, 9.4))
    s.join("b", (13.8, 9.4))
    s.note("counterbalance\nvalve", (a - 2.1, 12.1), "end")
    s.add(iso.Restrictor(), (13.8, 10.6))
    s.letter("psi", (13.5, 12.25))
    s.letter("p_pilot", (14.0, 11.6), "start")
    s.pipe("pilot", (a, 9.7), (8.0, 9.7))
    s.pipe("pilot", (12.9, 9.4), (12.9, 10.15), (6.5, 10.15), (6.5, 9.7), (7.0, 9.7))
    s.add(iso.ShuttleValve(), (7.5, 9.7))
    s.pipe("pilot", (7.5, 9.42), (7.5, 7.5), (3.75, 7.5), (3.75, y_p + 0.95), arrow="->")
    s.join("a", (a, 9.7))
    s.join("b", (12.9, 9.4))
    s.note("load sensing", (5.6, 7.8))

    s.letter("p_a", (17.2, y_a + 0.35), "end", LINES["a"]["color"])
    s.note("line A, hoisting side", (17.4, y_a + 0.35), "start")
    s.letter("p_b", (17.2, y_b - 0.38), "end", LINES["b"]["color"])
    s.note("line B, lowering side", (17.4, y_b - 0.38), "start")
    make_up(s, 16.6, y_a, y_b, y_t, b)
    parts.internal_leak(s, 19.4, y_a, y_b)
    parts.external_leak(s, 21.1, y_a, y_b, y)
    parts.reliefs(s, 23.6, y_a, y_b, y)
    s.add(iso.motor(variable=False), (right, y))
    s.flow("Q_m", (right + 0.25, y_a - 1.2), "down", kind="a")
    parts.shaft_line(s, right + 0.75, y, 30.6)
    parts.load_path(s, 32.0, y - 1.7, y_a)
    return s


def supply(s: Sheet, y_p: float, y_s: float, right: float) -> None:
    """Load-sensing pumps at height y_p on a supply line at height y_s."""
    s.add(iso.pump(both=False), (2.6, y_p))
    s.add(iso.PrimeMover(), (0.4, y_p))
    s.shaft((1.0, y_p), (1.85, y_p))
    s.letter("P_hpu", (0.4, y_p - 1.0))
    s.letter("alpha_p", (4.1, y_p + 0.55))
    s.letter("f_pump", (3.9, y_p - 0.75))
    parts.drain(s, (2.6, y_p - 0.75), (2.6, y_p - 1.3))
    s.pipe("a", (2.6, y_p + 0.75), (2.6, y_s), (right, y_s))
    s.flow("Q_p", (2.35, y_s - 0.7), "up", "left", "a")
    s.letter("p_s", (2.6, y_s + 0.35), "middle", LINES["a"]["color"])
    parts.leak_to_tank(s, 5.6, y_s, "Q_ext_s")
    parts.relief_to_tank(s, 8.4, y_s, "Q_relief_s")


def make_up(s: Sheet, x: float, y_a: float, y_b: float, y: float, left: float) -> None:
    """Check valves from the tank line at height y, which begins at x = left, into both motor lines."""
    s.pipe("tank", (left, y), (x, y))
    s.pipe("tank", (x, y), (x, y_a))
    s.pipe("tank", (x, y), (x, y_b))
    s.add(iso.Check(spring=True), (x, y_a - 2.6))
    s.add(iso.Check(spring=True), (x, y_b + 1.9), theta=180)
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
    rail(s, y_h, y_l, [(right, y_h), (right, y + 0.75)], [(right, y_l), (right, y - 0.75)])
    s.add(iso.secondary_unit(), (right, y))
    s.letter("alpha_s", (right + 1.3, y + 0.85))
    s.flow("D_s omega_m", (right + 0.25, y_h - 1.2), "down", kind="a")
    parts.shaft_line(s, right + 0.75, y, 29.8)
    parts.load_path(s, 31.2, y - 1.7, y_h)
    return s


def digital() -> Sheet:
    """Units whose cylinders are joined to a rail or to the low side, by electric valves, stroke by stroke."""
    s = Sheet(
        "Digital displacement winch",
        "Constant-pressure rail as in secondary control. Two of the cylinders of a unit, each with an electric valve to"
        " the rail and one to the low side; a controller enables it for a stroke or leaves it idle.",
    )
    y_h, y_l, y, first, apart = 10.0, 1.0, 3.2, 26.6, 4.2
    low, valve, mid = y_h - 1.2, y_h - 2.1, y + 2.77
    last = first + apart
    low_side = [(first - 2.6, y_l), (first - 2.6, low), (last + 0.95, low), (last + 0.95, valve + 0.25)]
    rail(s, y_h, y_l, [(last - 0.95, y_h), (last - 0.95, valve + 0.25)], low_side)
    s.shaft((first - 1.2, y), (last + 1.8, y))
    for x, throw in ((first, 0.12), (last, -0.12)):
        for side, kind in ((-0.95, "a"), (0.95, "b")):
            s.pipe("pilot", (x + side - 0.9, valve + 0.16), (x + side - 0.9, y_h + 1.4))
            s.add(iso.OnOffValve(), (x + side, valve))
            s.pipe("thin", (x + side, valve - 0.25), (x + side, valve - 0.65), (x, valve - 0.65))
            if x == first:
                top = y_h if kind == "a" else low
                s.pipe(kind, (x + side, top), (x + side, valve + 0.25))
                s.join(kind, (x + side, top))
        s.pipe("thin", (x, valve - 0.65), (x, mid + 0.75 + throw))
        s.join("thin", (x, valve - 0.65))
        crank = Symbol()
        crank.circle(0.0, 0.0, 0.7)
        s.add(crank, (x, y + throw))
        s.add(iso.Plunger(length=1.5), (x, mid + throw), theta=-90)
        s.join("thin", (x, y))
    s.add(iso.Block(w=last - first + 3.4, h=1.1), (0.5 * (first + last) - 0.2, y_h + 1.95))
    s.note("controller of the units: enables a cylinder for a\nstroke or leaves it idle", (first + 1.9, y_h + 1.95))
    s.letter("alpha_s", (last + 2.0, y_h + 1.95), "start")
    s.flow("D_s omega_m", (23.4, y_h + 0.3), "right", "above", "a")
    s.note("...", (0.5 * (first + last), mid), size=14.0)
    s.frame((first - 2.3, y - 0.95), (last + 1.8, low - 0.15))
    s.note("one unit: cylinders evenly on its shaft, two drawn", (first - 2.2, y - 1.25), "start")
    parts.shaft_line(s, last + 1.8, y, last + 5.2)
    parts.load_path(s, last + 6.6, y - 1.7, y_h)
    return s


def rail(s: Sheet, y_h: float, y_l: float, to_high: list[Point], to_low: list[Point]) -> None:
    """Pumps on a rail at height y_h, its low side at y_l, what is on both, and the ways on to the units."""
    sides = ("rail", "low side, its pressure is held")
    parts.pumped(s, y_h, y_l, to_high, to_low, "alpha_rp f_pump Q_rp p_r p_lp", sides)
    parts.passive_lines(s, y_h, y_l, relief="Q_relief", low="")


def converter(s: Sheet, x: float, y: float, left: str, right: str) -> None:
    """A converter about (x, y) between two currents."""
    s.add(iso.Block(diagonal=True), (x, y))
    s.note(left, (x - 0.35, y + 0.35), color=BLACK, size=12)
    s.note(right, (x + 0.35, y - 0.35), color=BLACK, size=12)


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
    s.add(iso.Switch(), (2.0, y))
    s.pipe("electric", (2.5, y), (4.3, y))
    s.flow("P_el", (3.3, y + 0.3), "right", "above")
    converter(s, 5.0, y, "~", "=")
    s.note("active\nfront end", (5.0, y - 1.3))
    s.pipe("electric", (5.7, y), (15.3, y))
    s.note("DC link", (7.6, y + 0.4))
    s.pipe("electric", (9.0, y), (9.0, y - 0.9))
    converter(s, 9.0, y - 1.6, "=", "=")
    s.note("chopper", (8.1, y - 1.6), "end")
    s.pipe("electric", (9.0, y - 2.3), (9.0, y - 2.7))
    s.add(iso.Resistor(), (9.0, y - 3.3))
    s.note("braking\nresistor", (8.5, y - 3.3), "end")
    s.pipe("electric", (9.0, y - 3.9), (9.0, y - 4.3))
    s.add(iso.Earth(), (9.0, y - 4.3))
    s.flow("P_resistor", (9.25, y - 0.5), "down")
    s.pipe("electric", (12.5, y), (12.5, y - 1.5))
    s.add(iso.Resistor(), (12.5, y - 2.1))
    s.letter("R", (13.0, y - 2.1), "start")
    s.pipe("electric", (12.5, y - 2.7), (12.5, y - 2.8))
    s.add(iso.Capacitor(), (12.5, y - 3.3))
    s.letter("E", (13.2, y - 3.3), "start")
    s.note("supercapacitors", (13.2, y - 3.75), "start")
    s.pipe("electric", (12.5, y - 3.8), (12.5, y - 4.3))
    s.add(iso.Earth(), (12.5, y - 4.3))
    s.flow("P_store", (12.75, y - 0.8), "down")
    s.join("electric", (9.0, y), (12.5, y))
    s.flow("P_dc", (14.2, y + 0.3), "right", "above")
    converter(s, 16.0, y, "=", "~")
    s.note("inverters", (16.0, y - 1.1))
    s.pipe("electric", (16.7, y), (19.0, y))
    for i in range(3):
        s.pipe("thin", (17.05 + 0.15 * i, y - 0.2), (17.25 + 0.15 * i, y + 0.2))
    s.flow("i", (18.3, y + 0.3), "right", "above")
    s.add(iso.PrimeMover("M\n3~"), (19.6, y))
    s.letter("theta", (19.6, y + 1.0))
    s.letter("T", (19.6, y - 1.0))
    parts.shaft_line(s, 20.2, y, 23.8)
    parts.load_path(s, 25.2, y - 1.7, y + 4.5)
    return s


def cylinder() -> Sheet:
    """A cylinder in the wire's path compensates; the winch stands on its brake."""
    s = Sheet(
        "Winch with cylinder compensator",
        "Closed circuit on a double-acting cylinder with a rod on both sides; relief valves open into the other"
        " line. A plunger on an accumulator carries the load; both push the"
        " travelling sheave in the wire's path. The winch behind stands on its brake while they compensate.",
    )
    y_a, y_b, y_p, x_c, x_p, mid = 10.0, 1.0, 17.0, 28.3, 30.9, 7.0
    parts.closed_circuit(s, y_a, y_b, 26.3, mid + 1.45, mid - 1.45, cross=True)
    s.add(iso.Cylinder(through=True), (x_c, mid), theta=-90)
    s.add(iso.Plunger(), (x_p, mid), theta=-90)
    s.ground((x_c - 0.8, mid + 1.8), (x_c - 0.2, mid + 1.8))
    s.ground((x_c + 0.2, mid + 1.8), (x_p + 0.8, mid + 1.8))
    s.pipe("a", (26.3, mid + 1.45), (x_c - 0.55, mid + 1.45))
    s.pipe("b", (26.3, mid - 1.45), (x_c - 0.55, mid - 1.45))
    s.flow("A_a v_rod", (27.05, mid + 1.2), "right", "below", "a")
    s.flow("A_b v_rod", (27.05, mid - 1.15), "left", "above", "b")
    s.pipe("a", (x_p + 0.45, mid + 1.5), (x_p + 1.2, mid + 1.5), (x_p + 1.2, y_p), (12.0, y_p), (12.0, y_p - 1.4))
    s.flow("A_p v_rod", (x_p + 0.95, mid + 4.0), "down", "left", "a")
    carrying_line(s, y_p)
    rods(s, x_c, x_p, mid - 1.8 - 1.32)
    wire_path(s, x_p, mid - 1.8 - 1.32)
    return s


def carrying_line(s: Sheet, y: float) -> None:
    """What is on the line of the accumulator, at height y, left of the plunger."""
    x = 12.0
    s.add(iso.pump(variable=False, both=False), (x, y - 2.15))
    s.shaft((x - 1.25, y - 2.15), (x - 0.75, y - 2.15))
    s.add(iso.PrimeMover(), (x - 1.85, y - 2.15))
    parts.drain(s, (x, y - 2.9), (x, y - 3.4))
    s.flow("Q_make_up", (x - 0.25, y - 0.7), "up", "left", "a")
    parts.leak_to_tank(s, 14.6, y, "Q_leak")
    parts.relief_to_tank(s, 17.4, y, "Q_relief_p")
    parts.accumulator(s, 22.2, y - 4.0, y)
    s.letter("p_hp", (25.8, y + 0.35), "end", LINES["a"]["color"])
    s.note("carries the load", (26.0, y + 0.35), "start")


def rods(s: Sheet, x_c: float, x_p: float, y: float) -> None:
    """Crosshead below both rods at height y, lock of the rod."""
    beam = Symbol()
    beam.box(x_c - 0.5, y - 0.38, x_p + 2.8 - x_c + 0.5, 0.38, fill="#e8e8e8")
    s.add(beam, (0.0, 0.0))
    lock = Symbol()
    for sign in (-1.0, 1.0):
        lock.box(x_c + sign * 0.3 - 0.16, y + 0.4, 0.32, 0.5, fill=BLACK)
        lock.spring((x_c + sign * 0.46, y + 0.65), (x_c + sign * 0.95, y + 0.65), turns=2, width=0.1)
        lock.line((x_c + sign * 0.95, y + 0.5), (x_c + sign * 0.95, y + 0.8))
    s.add(lock, (0.0, 0.0))
    s.letter("F_lock", (x_c + 1.1, y + 0.65), "start")
    s.flow("v_rod", (x_c - 0.9, y - 0.4), "down", "left")
    s.letter("x_rod", (x_c - 1.06, y - 0.9), "end")


def wire_path(s: Sheet, x_p: float, y: float) -> None:
    """Travelling sheave on the crosshead at height y, fixed sheaves, winch, crane tip and load."""
    x, tip, fixed = x_p + 2.6, 15.0, 11.0
    low = y - 1.15
    s.pipe("thin", (x, y - 0.38), (x, low))
    s.add(iso.Sheave(), (x, low))
    s.letter("n_f", (x, low - 0.85))
    s.pipe("wire", (x - 0.5, low), (x - 0.5, tip))
    s.add(iso.Sheave(), (x, tip))
    s.pipe("wire", (x, tip + 0.5), (x + 5.0, tip + 0.5))
    s.add(iso.Sheave(), (x + 5.0, tip))
    s.flow("v_w", (x + 2.5, tip + 0.8), "left", "above")
    parts.hang(s, x + 5.5, tip, 2.6)
    s.pipe("wire", (x + 0.5, low), (x + 0.5, fixed))
    s.add(iso.Sheave(), (x + 1.0, fixed))
    y_d = 0.2
    s.pipe("wire", (x + 1.5, fixed), (x + 1.5, y_d + 0.62))
    s.add(iso.Drum(rim=0.0), (x + 0.95, y_d))
    s.flow("v_drum", (x + 1.75, 0.5 * (fixed + y_d)), "down")
    s.note("fixed sheaves", (x + 1.8, fixed), "start")
    s.shaft((x - 3.3, y_d), (x - 0.9, y_d))
    s.add(iso.Brake(), (x - 2.2, y_d))
    s.letter("T_brake", (x - 2.2, y_d - 1.1))
    s.add(iso.PrimeMover(), (x - 3.9, y_d))
    s.note("winch", (x - 3.9, y_d - 0.9))


def phc() -> Sheet:
    """A gas spring between hook and payload, below any winch."""
    s = Sheet(
        "Passive heave compensator",
        "A cylinder between hook and slings: the load draws its rod out against oil, which a piston accumulator with"
        " gas vessel pushes back through an orifice. The sea presses on the rod. The winch above may stand.",
    )
    x, tip, mid = 8.5, 15.0, 9.2
    top, end = mid + 1.8, mid - 1.8 - 1.32
    s.add(iso.Drum(rim=0.0), (2.2, 4.0))
    s.note("any winch;\nit may stand", (2.2, 2.3))
    s.pipe("wire", (2.75, 4.62), (2.75, tip))
    s.add(iso.Sheave(), (3.25, tip))
    s.pipe("wire", (3.25, tip + 0.5), (x - 0.5, tip + 0.5))
    s.add(iso.Sheave(), (x - 0.5, tip))
    s.flow("v_w", (5.5, tip + 0.8), "left", "above")
    s.pipe("wire", (x, tip), (x, 12.3))
    s.flow("F_w", (x + 0.25, 13.9), "up")
    s.flow("v_tip", (x + 0.35, tip + 0.35), "up")
    s.note("crane tip", (x - 0.5, tip + 1.0))
    hook = Symbol()
    hook.box(x - 0.22, 11.8, 0.44, 0.5)
    hook.line((x, 11.8), (x, top), lw=1.4)
    s.add(hook, (0.0, 0.0))
    s.note("hook", (x - 0.4, 12.05), "end")
    s.surface(5.2, 7.9, 13.1)
    s.surface(9.1, 17.2, 13.1)
    s.add(iso.Cylinder(), (x, mid), theta=-90)
    s.note("empty", (x, mid + 1.0), size=7.5)
    s.letter("A", (x - 0.33, mid - 0.9))
    s.letter("F_f", (x - 0.7, mid - 1.7), "end")
    s.flow("A_rod", (x - 0.4, end + 0.35), "up", "left", "b")
    s.note("sea", (x - 1.5, end + 0.35), "end", LINES["b"]["color"])
    s.flow("v_c", (x + 0.4, end + 0.55), "down")
    s.letter("s_c", (x + 0.56, end + 0.1), "start")
    s.add(iso.Payload(), (x, end))
    s.flow("v_load", (x + 1.15, end - 1.9), "up")
    y_o, x_o, x_g = mid - 1.45, 11.8, 14.0
    s.pipe("a", (x + 0.55, y_o), (x_o, y_o), (x_o, mid - 0.7))
    s.add(iso.Orifice(), (10.4, y_o), theta=90)
    s.letter("C", (10.4, y_o + 0.65))
    s.add(iso.Accumulator(), (x_o, mid + 0.5))
    s.letter("p_c", (x_o + 0.65, mid + 1.0), "start", LINES["gas"]["color"])
    s.pipe("gas", (x_o, mid + 1.7), (x_o, mid + 2.1), (x_g, mid + 2.1), (x_g, mid + 1.6))
    s.add(iso.GasVessel(), (x_g, mid + 0.65), theta=180)
    s.letter("p_0", (x_g + 0.6, mid + 0.9), "start", LINES["gas"]["color"])
    s.letter("V_0", (x_g + 0.6, mid + 0.3), "start", LINES["gas"]["color"])
    s.frame((6.6, end + 0.75), (15.6, 11.65))
    s.note("compensator", (15.4, end + 0.45), "end")
    bottom = mid - 1.8
    s.pipe("thin", (16.3, 13.1), (16.3, bottom), arrow="<->")
    s.pipe("thin", (15.9, bottom), (16.7, bottom))
    s.letter("z", (16.5, 10.4), "start")
    return s
