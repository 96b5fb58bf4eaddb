"""Symbols of ISO 1219-1 as elements of schemdraw, and those of the winch and of an electric drive.

A symbol's origin is its centre unless its docstring says otherwise; lengths are units of the sheet. Flow through a
valve goes from below to above before it is turned.
"""

import math

from schemdraw.segments import SegmentArc, SegmentPoly
from sheet import BLACK, GREY, THICK, THIN, WHITE, Symbol


class Machine(Symbol):
    """Pump, motor or both: a circle with a triangle for each direction of flow. `variable`: an arrow through it.

    `triangles` names each triangle's port and direction: ("top", "out") is a pump that delivers at the top, ("top",
    "in") a motor that is fed there.
    """

    R = 0.75

    def strokes(self, *triangles: tuple[str, str], variable: bool = False) -> None:
        both = len({port for port, _ in triangles}) < len(triangles)
        R, size = self.R, 0.36 if both else 0.42
        self.circle(0.0, 0.0, R)
        for port, way in triangles:
            s = 1.0 if port == "top" else -1.0
            if way == "out":
                self.triangle((0.0, s * R), (0.0, s), size)
            else:
                edge = R - size - 0.17 if both else R
                self.triangle((0.0, s * (edge - size)), (0.0, -s), size)
        if variable:
            self.arrow((-1.0, -0.82), (1.0, 0.82))


def pump(variable: bool = True, both: bool = True) -> Machine:
    """A pump: of two flow directions (over-centre), or of one, which delivers at the top."""
    ways = (("top", "out"), ("bottom", "out")) if both else (("top", "out"),)
    return Machine(*ways, variable=variable)


def motor(variable: bool = True) -> Machine:
    """A motor that turns both ways."""
    return Machine(("top", "in"), ("bottom", "in"), variable=variable)


def secondary_unit() -> Machine:
    """A variable unit on a rail at its top: motor and, over centre or in the other direction of rotation, pump."""
    return Machine(("top", "out"), ("top", "in"), variable=True)


class PrimeMover(Symbol):
    """An electric motor that drives pumps, or any prime mover."""

    def strokes(self, text: str = "M") -> None:
        self.circle(0.0, 0.0, 0.6)
        self.text(0.0, 0.0, text)


class Relief(Symbol):
    """Relief valve, closed at rest, opened by the pressure at its inlet."""

    def strokes(self) -> None:
        self.box(-0.42, -0.42, 0.84, 0.84)
        self.arrow((-0.15, -0.42), (-0.15, 0.42))
        self.line((0.0, -0.8), (0.0, -0.42))
        self.line((0.0, 0.42), (0.0, 0.8))
        self.line((0.0, -0.65), (-0.68, -0.65), (-0.68, 0.0), (-0.42, 0.0), lw=0.8, ls="3,2")
        self.spring((0.42, 0.0), (0.95, 0.0))
        self.arrow((0.5, -0.3), (0.9, 0.32), lw=0.8)


class Check(Symbol):
    """Check valve; `spring`: one that needs a cracking pressure."""

    def strokes(self, spring: bool = False) -> None:
        r, leg = 0.17, 0.26
        v = -r * math.sqrt(2.0)
        self.circle(0.0, 0.0, r)
        self.line((-leg, v + leg), (0.0, v), (leg, v + leg))
        self.line((0.0, -0.6), (0.0, v))
        if spring:
            self.spring((0.0, r), (0.0, 0.5), turns=2)
            self.line((-0.12, 0.5), (0.12, 0.5))
            self.line((0.0, 0.5), (0.0, 0.6))
        else:
            self.line((0.0, r), (0.0, 0.6))


class Restrictor(Symbol):
    """A restriction that depends on viscosity: two arcs about a line. Laminar leakage is drawn by it."""

    def strokes(self) -> None:
        for s in (-1.0, 1.0):
            start = 130.0 if s > 0 else -50.0
            self.segments.append(
                SegmentArc((s * 0.42, 0.0), 0.6, 0.6, theta1=start, theta2=start + 100.0, color=BLACK, lw=THIN)
            )
        self.line((0.0, -0.4), (0.0, 0.4), lw=0.8)


class Orifice(Symbol):
    """A restriction that does not depend on viscosity: its loss rises with the square of the flow."""

    def strokes(self) -> None:
        for s in (-1.0, 1.0):
            self.line((s * 0.34, 0.3), (s * 0.09, 0.0), (s * 0.34, -0.3))
        self.line((0.0, -0.4), (0.0, 0.4), lw=0.8)


class Tank(Symbol):
    """Reservoir at ambient pressure; origin where the line ends in it."""

    def strokes(self) -> None:
        self.line((-0.38, 0.0), (-0.38, -0.32), (0.38, -0.32), (0.38, 0.0), lw=THICK)
        self.line((0.0, 0.0), (0.0, -0.2))


def capsule(symbol: Symbol, w: float, h: float) -> None:
    """An upright vessel about the origin."""
    r, y = 0.5 * w, 0.5 * h - 0.5 * w
    arc = [(r * math.cos(math.radians(t)), y + r * math.sin(math.radians(t))) for t in range(0, 181, 10)]
    outline = arc + [(-x, -v) for x, v in arc]
    symbol.segments.append(SegmentPoly(outline, color=BLACK, lw=THIN, fill=WHITE))


class PressureTank(Symbol):
    """A reservoir at a held pressure, which takes and gives oil; origin at its top."""

    def strokes(self) -> None:
        w, h = 0.7, 0.36
        arc = [(w + h * math.sin(math.radians(t)), -h + h * math.cos(math.radians(t))) for t in range(0, 181, 10)]
        outline = arc + [(-x, -2.0 * h - y) for x, y in arc]
        self.segments.append(SegmentPoly(outline, color=BLACK, lw=THIN, fill=WHITE))


class Accumulator(Symbol):
    """Piston accumulator: gas above, oil below."""

    def strokes(self) -> None:
        capsule(self, 1.0, 2.4)
        self.line((-0.5, 0.1), (0.5, 0.1))
        self.line((-0.5, -0.1), (0.5, -0.1))
        self.triangle((0.0, 0.35), (0.0, -1.0), 0.36, fill=WHITE)


class GasVessel(Symbol):
    """A bottle of gas, its neck below."""

    def strokes(self) -> None:
        capsule(self, 0.9, 1.9)
        self.triangle((0.0, -0.18), (0.0, -1.0), 0.36, fill=WHITE)


class Shuttle(Symbol):
    """Flushing shuttle: a 3/3 valve, centred and closed by springs, moved by the pressures of its lines to connect the
    one with the lower pressure, on the left, with the tank, on the right."""

    def strokes(self) -> None:
        s = 0.95
        for i in (-1, 0, 1):
            self.box(-0.5 * s, (i - 0.5) * s, s, s)
        left, right, port = -0.5 * s, 0.5 * s, 0.25
        for y in (-port, port):
            self.line((left, y), (left + 0.2, y))
            self.line((left + 0.2, y - 0.1), (left + 0.2, y + 0.1))
        self.line((right, 0.0), (right - 0.2, 0.0))
        self.line((right - 0.2, -0.1), (right - 0.2, 0.1))
        self.arrow((left, s - port), (right, s))  # moved down by p_a: B is flushed
        self.line((left, s + port), (left + 0.2, s + port))
        self.line((left + 0.2, s + port - 0.1), (left + 0.2, s + port + 0.1))
        self.arrow((left, -s + port), (right, -s))  # moved up by p_b: A is flushed
        self.line((left, -s - port), (left + 0.2, -s - port))
        self.line((left + 0.2, -s - port - 0.1), (left + 0.2, -s - port + 0.1))
        top = 1.5 * s
        for sign in (-1.0, 1.0):
            self.spring((0.22, sign * top), (0.22, sign * (top + 0.45)), turns=2)
            self.triangle((-0.2, sign * top), (0.0, -sign), 0.2)


class Proportional43(Symbol):
    """Proportional 4/3 directional valve, closed in its centre. Left box: P to A, B to T (hoisting). Ports A, B above
    and P, T below the centre box."""

    def strokes(self) -> None:
        s, q = 1.1, 0.28
        for i in (-1, 0, 1):
            self.box((i - 0.5) * s, -0.5 * s, s, s)
        for y in (-0.5 * s - 0.12, 0.5 * s + 0.12):
            self.line((-1.5 * s, y), (1.5 * s, y))
        for x in (-q, q):
            for sign in (-1.0, 1.0):
                self.line((x, sign * 0.5 * s), (x, sign * 0.3))
                self.line((x - 0.1, sign * 0.3), (x + 0.1, sign * 0.3))
        self.arrow((-s - q, -0.5 * s), (-s - q, 0.5 * s))
        self.arrow((-s + q, 0.5 * s), (-s + q, -0.5 * s))
        self.arrow((s - q, -0.5 * s), (s + q, 0.5 * s))
        self.arrow((s - q, 0.5 * s), (s + q, -0.5 * s))
        for sign in (-1.0, 1.0):
            end = sign * 1.5 * s
            self.spring((end, 0.3), (end + sign * 0.55, 0.3), turns=2, width=0.1)
            self.box(min(end, end + sign * 0.65), -0.4, 0.65, 0.45)
            self.line((end + sign * 0.15, -0.4), (end + sign * 0.5, 0.05), lw=0.8)
            self.arrow((end + sign * 0.1, -0.58), (end + sign * 0.72, 0.2), lw=0.8)
        y = 0.5 * s


class Counterbalance(Symbol):
    """Counterbalance valve between a motor's port `load`, above, and the directional valve's `valve`, below: a free
    check towards the load; from the load it opens by that pressure and by `pilot`, on the right."""

    def strokes(self) -> None:
        self.box(-0.45, -0.45, 0.9, 0.9)
        self.arrow((0.15, 0.45), (0.15, -0.45))
        self.line((0.0, 1.5), (0.0, 0.45))
        self.line((0.0, -1.5), (0.0, -0.45))
        self.line((0.0, 0.8), (0.7, 0.8), (0.7, 0.18), (0.45, 0.18), lw=0.8, ls="3,2")
        self.line((0.45, -0.18), (1.3, -0.18), lw=0.8, ls="3,2")
        self.spring((-0.45, 0.0), (-1.0, 0.0))
        self.arrow((-0.95, -0.32), (-0.5, 0.32), lw=0.8)
        r, leg, x = 0.17, 0.26, -1.5
        v = -r * math.sqrt(2.0)
        self.line((0.0, -1.1), (x, -1.1), (x, v))
        self.line((0.0, 1.1), (x, 1.1), (x, r))
        self.circle(x, 0.0, r)
        self.line((x - leg, v + leg), (x, v), (x + leg, v + leg))
        for y in (-1.1, 1.1):
            self.circle(0.0, y, 0.06, fill=BLACK)
        self.box(-1.95, -1.3, 3.0, 2.6, fill="none", lw=0.8, ls="9,3,2,3", color=GREY)


class ShuttleValve(Symbol):
    """The higher of two pressures, from `left` and `right`, goes to `out` below."""

    def strokes(self) -> None:
        self.box(-0.5, -0.28, 1.0, 0.56)
        self.circle(0.24, 0.0, 0.15)
        for s in (-1.0, 1.0):
            self.line((s * 0.5, 0.0), (s * 0.42, 0.0))
            self.line((s * 0.22, 0.22), (s * 0.42, 0.0), (s * 0.22, -0.22), lw=0.8)


class Cylinder(Symbol):
    """Double-acting cylinder with a rod to the right (`through`: and to the left); x = 0 at mid length."""

    def strokes(self, length: float = 3.6, place: float = 0.5, through: bool = False) -> None:
        h, half = 0.55, 0.5 * length
        x = -half + place * length
        self.box(-half, -h, length, 2.0 * h)
        self.box(x - 0.12, -h, 0.24, 2.0 * h)
        self.box(x + 0.12, -0.14, half - x + 1.2, 0.28)
        if through:
            self.box(-half - 0.7, -0.14, half + x + 0.58, 0.28)


class Plunger(Symbol):
    """Single-acting cylinder that pushes its rod out to the right."""

    def strokes(self, length: float = 3.6, place: float = 0.5) -> None:
        h, half = 0.45, 0.5 * length
        x = -half + place * length
        self.line((half, -h), (-half, -h), (-half, h), (half, h))
        self.line((half, -h), (half, -0.28))
        self.line((half, h), (half, 0.28))
        self.box(x, -0.28, half - x + 1.32, 0.56)


class Capacitor(Symbol):
    """Store on a DC link; ports above and below."""

    def strokes(self) -> None:
        for s in (-1.0, 1.0):
            self.line((-0.45, s * 0.1), (0.45, s * 0.1), lw=THICK)
            self.line((0.0, s * 0.1), (0.0, s * 0.5))


class Resistor(Symbol):
    """A resistor; ports above and below."""

    def strokes(self) -> None:
        self.box(-0.22, -0.6, 0.44, 1.2)


class Earth(Symbol):
    """The other pole of the DC link, drawn as a bar; origin where the line ends."""

    def strokes(self) -> None:
        self.line((-0.3, 0.0), (0.3, 0.0), lw=THICK)


class Switch(Symbol):
    """An electronic switch or a circuit breaker in a horizontal line."""

    def strokes(self) -> None:
        self.line((-0.5, 0.0), (-0.3, 0.0))
        self.line((-0.3, 0.0), (0.3, 0.32))
        self.line((0.3, 0.0), (0.5, 0.0))
        for s in (-1.0, 1.0):
            self.line((0.3 - 0.1, -s * 0.1), (0.3 + 0.1, s * 0.1), lw=0.8)


class Brake(Symbol):
    """Spring-applied holding brake on a shaft that runs through it: a disc between two shoes."""

    def strokes(self) -> None:
        self.box(-0.08, -0.75, 0.16, 1.5)
        for s in (-1.0, 1.0):
            self.box(-0.38, 0.45 if s > 0 else -0.75, 0.26, 0.3, fill=BLACK)
            self.box(0.12, 0.45 if s > 0 else -0.75, 0.26, 0.3, fill=BLACK)
            self.spring((0.38, s * 0.6), (0.8, s * 0.6), turns=2, width=0.1)
            self.line((0.8, s * 0.45), (0.8, s * 0.75))


class Pinion(Symbol):
    """A toothed wheel seen from the side: a box about the shaft."""

    def strokes(self, w: float = 0.4, h: float = 0.8) -> None:
        self.box(-0.5 * w, -0.5 * h, w, h)
        for s in (-1.0, 1.0):
            self.line((-0.5 * w, s * (0.5 * h - 0.1)), (0.5 * w, s * (0.5 * h - 0.1)), lw=0.6)


class Drum(Symbol):
    """A drum seen from the side: gear rim on the left, origin in the middle of its axis."""

    def strokes(self, rim: float = 1.3, r: float = 0.62) -> None:
        w, flange = 2.0, r + 0.4
        self.line((-1.9, 0.0), (1.7, 0.0), lw=THICK)
        self.box(-0.5 * w, -r, w, 2.0 * r)
        for i in range(9):
            x = -0.5 * w + 0.11 + i * 0.22
            self.line((x, -r), (x + 0.06, r), lw=0.6)
        for x in (-0.5 * w - 0.12, 0.5 * w):
            self.box(x, -flange, 0.12, 2.0 * flange)
        if rim:
            self.box(-1.6, -rim, 0.4, 2.0 * rim)
            for s in (-1.0, 1.0):
                self.line((-1.6, s * (rim - 0.1)), (-1.2, s * (rim - 0.1)), lw=0.6)
        for x in (-1.9, 1.7):
            self.line((x - 0.2, -0.22), (x, 0.0), (x + 0.2, -0.22), (x - 0.2, -0.22))


class Sheave(Symbol):
    """A sheave."""

    R = 0.5

    def strokes(self) -> None:
        self.circle(0.0, 0.0, self.R, lw=1.2)
        self.circle(0.0, 0.0, 0.07, fill=BLACK)


class Payload(Symbol):
    """Hook, sling and payload; origin where the wire ends."""

    def strokes(self, text: str = "") -> None:
        self.box(-0.22, -0.5, 0.44, 0.5)
        self.line((-0.75, -1.4), (0.0, -0.5), (0.75, -1.4), lw=0.8)
        self.box(-0.85, -2.4, 1.7, 1.0, fill="#e8e8e8")


class OnOffValve(Symbol):
    """Electric valve of one cylinder, closed at rest by a spring; its coil is on the left."""

    def strokes(self) -> None:
        s = 0.5
        for x in (-s, 0.0):
            self.box(x - 0.5 * s, -0.5 * s, s, s)
        self.arrow((-s, -0.5 * s), (-s, 0.5 * s), lw=0.8)
        for sign in (-1.0, 1.0):
            self.line((0.0, sign * 0.5 * s), (0.0, sign * 0.13))
            self.line((-0.1, sign * 0.13), (0.1, sign * 0.13))
        self.box(-1.5 * s - 0.3, -0.16, 0.3, 0.32)
        self.line((-1.5 * s - 0.24, -0.16), (-1.5 * s - 0.06, 0.16), lw=0.8)
        self.spring((0.5 * s, 0.0), (0.5 * s + 0.35, 0.0), turns=2, width=0.1)


class Block(Symbol):
    """A box with a text, as in single-line diagrams: converter, store, resistor."""

    def strokes(self, text: str = "", w: float = 1.4, h: float = 1.4, diagonal: bool = False) -> None:
        self.box(-0.5 * w, -0.5 * h, w, h)
        if diagonal:
            self.line((-0.5 * w, -0.5 * h), (0.5 * w, 0.5 * h))
        self.text(0.0, 0.0, text)
