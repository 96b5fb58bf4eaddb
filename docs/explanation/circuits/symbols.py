"""Symbols of ISO 1219-1 as elements of schemdraw, those of the winch below them, and the sheet that they are drawn on.

A symbol's origin is its centre unless its docstring says otherwise; lengths are units of the sheet. Flow through a
valve goes from its anchor `inlet`, below, to `outlet`, above, before it is turned.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import schemdraw
from schemdraw.elements import Element
from schemdraw.segments import Segment, SegmentArc, SegmentCircle, SegmentPoly
from schemdraw.types import BBox

Point = tuple[float, float]

UNIT = 26.0  # points in one unit of a sheet
MARGIN = 0.5  # units around a drawing
THIN, THICK = 1.1, 1.6  # line widths in points
SIZE = 10.0  # text in points
FONT = "Arial, Helvetica, 'DejaVu Sans', sans-serif"
BLACK, WHITE, GREY = "#111111", "#ffffff", "#595959"

LINES: dict[str, dict[str, Any]] = {
    "a": {"color": "#b3261e", "lw": THICK},  # hoisting side, high pressure
    "b": {"color": "#1456b8", "lw": THICK},  # lowering side, low pressure
    "boost": {"color": "#8a5a00", "lw": THICK},
    "tank": {"color": "#1d6b3a", "lw": THICK},
    "leak": {"color": GREY, "lw": THIN, "ls": "5,3"},
    "pilot": {"color": BLACK, "lw": 0.8, "ls": "3,2"},
    "gas": {"color": "#6a1b9a", "lw": THICK},
    "wire": {"color": BLACK, "lw": 1.2},
    "electric": {"color": BLACK, "lw": THICK},
    "frame": {"color": GREY, "lw": 0.8, "ls": "9,3,2,3"},
    "thin": {"color": BLACK, "lw": 0.8},
}
"""Colour, width and dashes of each kind of line."""

GREEK = {"alpha": "α", "omega": "ω", "theta": "θ", "psi": "ψ", "eta": "η", "Delta": "Δ"}


class Lettering:
    """A segment of text: letters of the code as symbols with subscript (p_a), everything else as it is.

    It writes its own SVG, with `dy` for the subscript, because `baseline-shift` and `dominant-baseline` are not drawn
    alike by browsers and printing programs. Letters of the code carry their name as title.
    """

    zorder = 9

    def __init__(
        self, pos: Point, text: str, *, align: str = "middle", color: str = BLACK, size: float = SIZE, code: bool = True
    ) -> None:
        self.pos, self.text, self.align, self.color, self.size, self.code = pos, text, align, color, size, code

    def xform(self, transform: Any, **style: Any) -> Lettering:
        """The text at its place on the sheet."""
        x, y = transform.transform(self.pos)
        return Lettering((x, y), self.text, align=self.align, color=self.color, size=self.size, code=self.code)

    def get_bbox(self) -> BBox:
        """Box around the text, from a mean width of letters."""
        longest = max(len(line) for line in self.text.split("\n"))
        w, h = 0.58 * self.size * longest / UNIT, 1.2 * self.size * len(self.text.split("\n")) / UNIT
        left = {"start": 0.0, "middle": -0.5 * w, "end": -w}[self.align]
        x, y = self.pos
        return BBox(x + left, y - 0.5 * h, x + left + w, y + 0.5 * h)

    def doreverse(self, centerx: float) -> None:
        """Mirror the place, not the text."""
        self.pos = (2.0 * centerx - self.pos[0], self.pos[1])

    def doflip(self) -> None:
        """Mirror the place upside down, not the text."""
        self.pos = (self.pos[0], -self.pos[1])

    def draw(self, fig: Any, transform: Any, **style: Any) -> None:
        """Add the text to a figure."""
        x, y = fig.xform(*transform.transform(self.pos))
        lines = self.text.split("\n")
        for i, line in enumerate(lines):
            top = y + (0.36 + 1.15 * (i - 0.5 * (len(lines) - 1))) * self.size
            node = ElementTree.Element("text", y=f"{top:.2f}", fill=self.color)
            node.set("font-size", f"{self.size:g}")
            if self.code:
                x_0 = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[self.align] * width(line, self.size)
                node.set("x", f"{x_0:.2f}")
                self.write_letter(node, line)
            else:
                node.set("x", f"{x:.2f}")
                node.set("text-anchor", self.align)
                node.text = line
            fig.svgelements.append((self.zorder, node))

    def write_letter(self, node: ElementTree.Element, name: str) -> None:
        """A letter of the code into a text element: p_a, alpha_p, Q_relief_a. It starts at x whatever its alignment:
        not every program aligns a text of several parts."""
        base, *sub = name.split("_")
        ElementTree.SubElement(node, "title").text = name
        main = ElementTree.SubElement(node, "tspan")
        main.set("font-style", "italic")
        main.text = GREEK.get(base, base)
        if sub:
            low = ElementTree.SubElement(node, "tspan", dy=f"{0.25 * self.size:.2f}")
            low.set("font-size", f"{0.75 * self.size:g}")
            low.text = " ".join(sub)


def width(name: str, size: float) -> float:
    """Width of a letter of the code with its subscript, about [points]."""
    base, _, sub = name.partition("_")
    return size * (0.72 * len(GREEK.get(base, base)) + 0.42 * len(sub))


class Symbol(Element):
    """An element whose lines are thin and black unless told otherwise."""

    def line(self, *points: Point, **style: Any) -> None:
        """A line through points."""
        self.segments.append(Segment(list(points), **{"color": BLACK, "lw": THIN, **style}))

    def box(self, x: float, y: float, w: float, h: float, fill: str = WHITE, **style: Any) -> None:
        """A rectangle from its lower left corner."""
        corners = [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
        self.segments.append(SegmentPoly(corners, **{"color": BLACK, "lw": THIN, "fill": fill, **style}))

    def triangle(self, tip: Point, direction: Point, size: float, fill: str = BLACK) -> None:
        """An equilateral triangle whose tip points in a direction of length 1."""
        (x, y), (u, v), half = tip, direction, size / math.sqrt(3.0)
        base = (x - size * u, y - size * v)
        corners = [tip, (base[0] - half * v, base[1] + half * u), (base[0] + half * v, base[1] - half * u)]
        self.segments.append(SegmentPoly(corners, color=BLACK, lw=0.8, fill=fill))

    def circle(self, x: float, y: float, r: float, fill: str = WHITE, **style: Any) -> None:
        """A circle."""
        self.segments.append(SegmentCircle((x, y), r, **{"color": BLACK, "lw": THIN, "fill": fill, **style}))

    def arrow(self, start: Point, end: Point, **style: Any) -> None:
        """A line with a slim head at its end."""
        self.line(start, end, arrow="->", arrowwidth=0.14, arrowlength=0.22, **style)

    def spring(self, start: Point, end: Point, turns: int = 3, width: float = 0.13) -> None:
        """A zigzag from start to end."""
        (x, y), n = start, 2 * turns
        du, dv = (end[0] - x) / n, (end[1] - y) / n
        length = math.hypot(du, dv)
        side = (-dv / length * width, du / length * width)
        points = [start]
        for i in range(n):
            s = 1.0 if i % 2 == 0 else -1.0
            points.append((x + (i + 0.5) * du + s * side[0], y + (i + 0.5) * dv + s * side[1]))
        self.line(*points, end, lw=0.8)

    def text(self, x: float, y: float, text: str, size: float = SIZE) -> None:
        """Plain text that stays upright."""
        self.segments.append(Lettering((x, y), text, size=size, code=False))


class Machine(Symbol):
    """Pump, motor or both: a circle with a triangle for each direction of flow, ports `top` and `bottom`, shaft ends
    `left` and `right`. `variable`: an arrow through it.

    `triangles` names each triangle's port and direction: ("top", "out") is a pump that delivers at the top, ("top",
    "in") a motor that is fed there.
    """

    R = 0.75

    def __init__(self, *triangles: tuple[str, str], variable: bool = False, **params: Any) -> None:
        super().__init__(**params)
        R, size = self.R, 0.42
        self.circle(0.0, 0.0, R)
        both = len({port for port, _ in triangles}) < len(triangles)
        for port, way in triangles:
            s = 1.0 if port == "top" else -1.0
            if way == "out":
                self.triangle((0.0, s * R), (0.0, s), size)
            else:
                edge = R - size - 0.06 if both else R
                self.triangle((0.0, s * (edge - size)), (0.0, -s), size)
        if variable:
            self.arrow((-1.0, -0.82), (1.0, 0.82))
        self.anchors = {"top": (0, R), "bottom": (0, -R), "left": (-R, 0), "right": (R, 0), "case": (0.53, -0.53)}


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
    """An electric motor that drives pumps, or any prime mover; shaft at `right`."""

    def __init__(self, text: str = "M", **params: Any) -> None:
        super().__init__(**params)
        self.circle(0.0, 0.0, 0.6)
        self.text(0.0, 0.0, text)
        self.anchors = {"left": (-0.6, 0), "right": (0.6, 0), "top": (0, 0.6), "bottom": (0, -0.6)}


class Relief(Symbol):
    """Relief valve, closed at rest, opened by the pressure at its inlet."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        self.box(-0.42, -0.42, 0.84, 0.84)
        self.arrow((-0.15, -0.42), (-0.15, 0.42))
        self.line((0.0, -0.8), (0.0, -0.42))
        self.line((0.0, 0.42), (0.0, 0.8))
        self.line((0.0, -0.65), (-0.68, -0.65), (-0.68, 0.0), (-0.42, 0.0), lw=0.8, ls="3,2")
        self.spring((0.42, 0.0), (0.95, 0.0))
        self.arrow((0.5, -0.3), (0.9, 0.32), lw=0.8)
        self.anchors = {"inlet": (0, -0.8), "outlet": (0, 0.8)}


class Check(Symbol):
    """Check valve; `spring`: one that needs a cracking pressure."""

    def __init__(self, spring: bool = False, **params: Any) -> None:
        super().__init__(**params)
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
        self.anchors = {"inlet": (0, -0.6), "outlet": (0, 0.6)}


class Restrictor(Symbol):
    """A restriction that depends on viscosity: two arcs about a line. Laminar leakage is drawn by it."""

    def __init__(self, adjustable: bool = False, **params: Any) -> None:
        super().__init__(**params)
        for s in (-1.0, 1.0):
            start = 130.0 if s > 0 else -50.0
            self.segments.append(
                SegmentArc((s * 0.42, 0.0), 0.6, 0.6, theta1=start, theta2=start + 100.0, color=BLACK, lw=THIN)
            )
        self.line((0.0, -0.4), (0.0, 0.4), lw=0.8)
        if adjustable:
            self.arrow((-0.45, -0.4), (0.45, 0.4), lw=0.8)
        self.anchors = {"inlet": (0, -0.4), "outlet": (0, 0.4)}


class Tank(Symbol):
    """Reservoir at ambient pressure; origin where the line ends in it."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
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

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        w, h = 0.7, 0.36
        arc = [(w + h * math.sin(math.radians(t)), -h + h * math.cos(math.radians(t))) for t in range(0, 181, 10)]
        outline = arc + [(-x, -2.0 * h - y) for x, y in arc]
        self.segments.append(SegmentPoly(outline, color=BLACK, lw=THIN, fill=WHITE))
        self.anchors = {"port": (0, 0)}


class Accumulator(Symbol):
    """Piston accumulator: gas above, oil below; anchors `gas`, `oil`, `side` at the piston."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        capsule(self, 1.0, 2.4)
        self.line((-0.5, 0.1), (0.5, 0.1))
        self.line((-0.5, -0.1), (0.5, -0.1))
        self.triangle((0.0, 0.35), (0.0, -1.0), 0.36, fill=WHITE)
        self.anchors = {"gas": (0, 1.2), "oil": (0, -1.2), "side": (0.5, 0.0), "left": (-0.5, 0.0)}


class GasVessel(Symbol):
    """A bottle of gas; port below."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        capsule(self, 0.9, 1.9)
        self.triangle((0.0, -0.18), (0.0, -1.0), 0.36, fill=WHITE)
        self.anchors = {"gas": (0, -0.95), "side": (0.45, 0.0)}


class Shuttle(Symbol):
    """Flushing shuttle: a 3/3 valve, centred and closed by springs, moved by the pressures of its lines to connect the
    one with the lower pressure with `T`. Ports `A` and `B` on the left, `T` on the right; pilots `pilot_a` and
    `pilot_b`."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
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
        self.anchors = {
            "A": (left, port),
            "B": (left, -port),
            "T": (right, 0.0),
            "pilot_a": (-0.2, top + 0.2),
            "pilot_b": (-0.2, -top - 0.2),
        }


class Proportional43(Symbol):
    """Proportional 4/3 directional valve, closed in its centre. Left box: P to A, B to T (hoisting). Ports A, B above
    and P, T below the centre box."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
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
            self.arrow((end + sign * 0.02, -0.55), (end + sign * 0.66, 0.22), lw=0.8)
        y = 0.5 * s
        self.anchors = {"A": (-q, y), "B": (q, y), "P": (-q, -y), "T": (q, -y), "left": (-1.5 * s, 0)}


class Counterbalance(Symbol):
    """Counterbalance valve between a motor's port `load`, above, and the directional valve's `valve`, below: a free
    check towards the load; from the load it opens by that pressure and by `pilot`, on the right."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
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
        self.anchors = {"load": (0, 1.5), "valve": (0, -1.5), "pilot": (1.3, -0.18)}


class ShuttleValve(Symbol):
    """The higher of two pressures, from `left` and `right`, goes to `out` below."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        self.box(-0.5, -0.28, 1.0, 0.56)
        self.circle(0.24, 0.0, 0.15)
        for s in (-1.0, 1.0):
            self.line((s * 0.5, 0.0), (s * 0.42, 0.0))
            self.line((s * 0.22, 0.22), (s * 0.42, 0.0), (s * 0.22, -0.22), lw=0.8)
        self.anchors = {"left": (-0.5, 0), "right": (0.5, 0), "out": (0, -0.28)}


class Cylinder(Symbol):
    """Double-acting cylinder with a single rod to the right; ports `cap` and `rod_side` below, `eye` at the rod's end,
    `base` at the other."""

    def __init__(self, length: float = 3.6, place: float = 0.5, port: float = -1.0, **params: Any) -> None:
        super().__init__(**params)
        h, half = 0.55, 0.5 * length
        x = -half + place * length
        self.box(-half, -h, length, 2.0 * h)
        self.box(x - 0.12, -h, 0.24, 2.0 * h)
        self.box(x + 0.12, -0.14, half - x + 1.2, 0.28)
        self.anchors = {
            "cap": (-half + 0.35, port * h),
            "rod_side": (half - 0.35, port * h),
            "eye": (half + 1.32, 0.0),
            "base": (-half, 0.0),
            "piston": (x, h),
        }


class Plunger(Symbol):
    """Single-acting cylinder that pushes its rod out to the right; port `cap`, rod end `eye`."""

    def __init__(self, length: float = 3.6, place: float = 0.5, port: float = -1.0, **params: Any) -> None:
        super().__init__(**params)
        h, half = 0.45, 0.5 * length
        x = -half + place * length
        self.line((half, -h), (-half, -h), (-half, h), (half, h))
        self.line((half, -h), (half, -0.28))
        self.line((half, h), (half, 0.28))
        self.box(x, -0.28, half - x + 1.2, 0.56)
        self.anchors = {"cap": (-half + 0.3, port * h), "eye": (half + 1.2, 0.0), "base": (-half, 0.0)}


class Capacitor(Symbol):
    """Store on a DC link; ports above and below."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        for s in (-1.0, 1.0):
            self.line((-0.45, s * 0.1), (0.45, s * 0.1), lw=THICK)
            self.line((0.0, s * 0.1), (0.0, s * 0.5))
        self.anchors = {"top": (0, 0.5), "bottom": (0, -0.5)}


class Resistor(Symbol):
    """A resistor; ports above and below."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        self.box(-0.22, -0.6, 0.44, 1.2)
        self.anchors = {"top": (0, 0.6), "bottom": (0, -0.6)}


class Earth(Symbol):
    """The other pole of the DC link, drawn as a bar; origin where the line ends."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        self.line((-0.3, 0.0), (0.3, 0.0), lw=THICK)


class Switch(Symbol):
    """An electronic switch or a circuit breaker in a horizontal line."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        self.line((-0.5, 0.0), (-0.3, 0.0))
        self.line((-0.3, 0.0), (0.3, 0.32))
        self.line((0.3, 0.0), (0.5, 0.0))
        for s in (-1.0, 1.0):
            self.line((0.3 - 0.1, -s * 0.1), (0.3 + 0.1, s * 0.1), lw=0.8)
        self.anchors = {"left": (-0.5, 0), "right": (0.5, 0)}


class Brake(Symbol):
    """Spring-applied holding brake on a shaft that runs through it: a disc between two shoes."""

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        self.box(-0.08, -0.75, 0.16, 1.5)
        for s in (-1.0, 1.0):
            self.box(-0.38, 0.45 if s > 0 else -0.75, 0.26, 0.3, fill=BLACK)
            self.box(0.12, 0.45 if s > 0 else -0.75, 0.26, 0.3, fill=BLACK)
            self.spring((0.38, s * 0.6), (0.8, s * 0.6), turns=2, width=0.1)
            self.line((0.8, s * 0.45), (0.8, s * 0.75))
        self.anchors = {"top": (0, 0.75), "bottom": (0, -0.75)}


class Pinion(Symbol):
    """A toothed wheel seen from the side: a box about the shaft."""

    def __init__(self, w: float = 0.4, h: float = 0.8, **params: Any) -> None:
        super().__init__(**params)
        self.box(-0.5 * w, -0.5 * h, w, h)
        for s in (-1.0, 1.0):
            self.line((-0.5 * w, s * (0.5 * h - 0.1)), (0.5 * w, s * (0.5 * h - 0.1)), lw=0.6)


class Drum(Symbol):
    """A drum seen from the side: gear rim on the left, wire up from `wire`; origin in the middle of its axis."""

    def __init__(self, rim: float = 1.3, r: float = 0.62, **params: Any) -> None:
        super().__init__(**params)
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
        self.anchors = {"wire": (0.55, r), "rim": (-1.4, rim), "rim_low": (-1.4, -rim)}


class Sheave(Symbol):
    """A sheave; the wire touches it at `left`, `right` and `top`."""

    R = 0.5

    def __init__(self, **params: Any) -> None:
        super().__init__(**params)
        self.circle(0.0, 0.0, self.R, lw=1.2)
        self.circle(0.0, 0.0, 0.07, fill=BLACK)
        self.anchors = {"left": (-self.R, 0), "right": (self.R, 0), "top": (0, self.R)}


class Payload(Symbol):
    """Hook, sling and payload; origin where the wire ends."""

    def __init__(self, text: str = "", **params: Any) -> None:
        super().__init__(**params)
        self.box(-0.22, -0.5, 0.44, 0.5)
        self.line((-0.75, -1.4), (0.0, -0.5), (0.75, -1.4), lw=0.8)
        self.box(-0.85, -2.4, 1.7, 1.0, fill="#e8e8e8")
        self.anchors = {"middle": (0, -1.9)}


class Block(Symbol):
    """A box with a text, as in single-line diagrams: converter, store, resistor."""

    def __init__(self, text: str = "", w: float = 1.4, h: float = 1.4, diagonal: bool = False, **params: Any) -> None:
        super().__init__(**params)
        self.box(-0.5 * w, -0.5 * h, w, h)
        if diagonal:
            self.line((-0.5 * w, -0.5 * h), (0.5 * w, 0.5 * h))
        self.text(0.0, 0.0, text)
        self.anchors = {"left": (-0.5 * w, 0), "right": (0.5 * w, 0), "top": (0, 0.5 * h), "bottom": (0, -0.5 * h)}


class Sheet:
    """A drawing under way, and the SVG that it becomes."""

    def __init__(self, title: str, text: str) -> None:
        self.title, self.text = title, text
        self.drawing = schemdraw.Drawing(canvas="svg", show=False)
        self.drawing.config(inches_per_unit=UNIT / 72.0, margin=MARGIN)

    def add(self, symbol: Symbol, xy: Point, theta: float = 0.0, flip: bool = False, mirror: bool = False) -> Symbol:
        """Place a symbol; theta turns it [deg], flip turns it upside down, mirror exchanges left and right."""
        symbol.at(xy).theta(theta)
        if flip:
            symbol.flip()
        if mirror:
            symbol.reverse()
        self.drawing.add(symbol)
        return symbol

    def free(self, *segments: Any) -> None:
        """Lines and texts that are no symbol."""
        holder = Symbol()
        holder.segments.extend(segments)
        self.add(holder, (0.0, 0.0))

    def pipe(self, kind: str, *points: Any, arrow: str | None = None) -> None:
        """A line of a kind through points; "-|" between two points goes sideways first, "|-" up or down first."""
        path: list[Point] = []
        turn = ""
        for p in points:
            if isinstance(p, str):
                turn = p
                continue
            x, y = float(p[0]), float(p[1])
            if turn:
                path.append((x, path[-1][1]) if turn == "-|" else (path[-1][0], y))
                turn = ""
            path.append((x, y))
        head = {"arrow": arrow, "arrowwidth": 0.16, "arrowlength": 0.24} if arrow else {}
        self.free(Segment(path, zorder=0, joinstyle="miter", **LINES[kind], **head))

    def shaft(self, *points: Point) -> None:
        """A shaft: a double line."""
        for (x, y), (v, w) in zip(points, points[1:], strict=False):
            dx, dy = (0.0, 0.05) if y == w else (0.05, 0.0)
            for s in (-1.0, 1.0):
                ends = [(x + s * dx, y + s * dy), (v + s * dx, w + s * dy)]
                self.free(Segment(ends, color=BLACK, lw=0.8, zorder=0))

    def join(self, kind: str, *places: Point) -> None:
        """Dots where lines are connected; lines that cross without one are not."""
        for xy in places:
            self.free(SegmentCircle(xy, 0.08, color=LINES[kind]["color"], fill=LINES[kind]["color"], lw=0.5, zorder=4))

    def flow(self, letter: str, xy: Point, way: str, side: str = "right", kind: str = "thin") -> None:
        """A small arrow for the positive direction of a flow, force or motion, beside its line, and its letter."""
        x, y = xy
        u, v = {"up": (0.0, 1.0), "down": (0.0, -1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)}[way]
        ends = [(x - 0.3 * u, y - 0.3 * v), (x + 0.3 * u, y + 0.3 * v)]
        color = LINES[kind]["color"]
        self.free(Segment(ends, color=color, lw=1.1, arrow="->", arrowwidth=0.17, arrowlength=0.24))
        place = {"right": (0.16, 0.0), "left": (-0.16, 0.0), "above": (0.0, 0.32), "below": (0.0, -0.34)}[side]
        self.letter(letter, (x + place[0], y + place[1]), {"right": "start", "left": "end"}.get(side, "middle"), color)

    def letter(self, name: str, xy: Point, align: str = "middle", color: str = BLACK) -> None:
        """A letter of the code as symbol."""
        self.free(Lettering(xy, name, align=align, color=color))

    def note(self, text: str, xy: Point, align: str = "middle", color: str = GREY, size: float = 9.0) -> None:
        """A word or two; lines apart by a line feed."""
        self.free(Lettering(xy, text, align=align, color=color, size=size, code=False))

    def turning(self, letter: str, xy: Point, side: str = "above") -> None:
        """An arrow about a shaft, for its positive direction of rotation."""
        x, y = xy
        points = [
            (x + 0.22 * math.sin(math.radians(t)), y + 0.36 * math.cos(math.radians(t))) for t in range(-150, 151, 15)
        ]
        self.free(Segment(points[:14], color=BLACK, lw=1.0, arrow="->", arrowwidth=0.15, arrowlength=0.2))
        if letter:
            self.letter(letter, (x, y + (0.82 if side == "above" else -0.76)))

    def frame(self, low: Point, high: Point, text: str = "") -> None:
        """A chain line about an assembly."""
        corners = [low, (high[0], low[1]), high, (low[0], high[1])]
        self.free(SegmentPoly(corners, fill="none", zorder=0, **LINES["frame"]))
        if text:
            self.note(text, (low[0] + 0.15, high[1] - 0.3), "start")

    def save(self, path: Path) -> None:
        """Write the SVG: white background, one element a line, numbers rounded so that it is the same everywhere."""
        root = ElementTree.fromstring(self.drawing.get_imagedata("svg"))
        for node in root.iter():
            node.tag = node.tag.rpartition("}")[2]
            for key, value in list(node.attrib.items()):
                if "}" in key:
                    del node.attrib[key]
                else:
                    node.set(key, rounded(value).replace("stroke-dasharray:-;", ""))
        x, y, w, h = root.get("viewBox", "0 0 0 0").split()
        title, text = ElementTree.Element("title"), ElementTree.Element("desc")
        title.text, text.text = self.title, self.text
        root.insert(0, ElementTree.Element("rect", x=x, y=y, width=w, height=h, fill=WHITE))
        root.insert(0, text)
        root.insert(0, title)
        root.set("xmlns", "http://www.w3.org/2000/svg")
        root.set("font-family", FONT)
        root.set("role", "img")
        lines = [ElementTree.tostring(node, encoding="unicode") for node in root]
        head = ElementTree.tostring(root, encoding="unicode").partition(">")[0] + ">"
        path.write_text("\n".join([head, *(line.strip() for line in lines), "</svg>", ""]), encoding="utf-8")


def rounded(text: str) -> str:
    """Numbers in an attribute with two decimals at the most, no minus before zero."""
    short = re.sub(r"-?\d+\.\d+", lambda m: f"{float(m[0]) + 0.0:.2f}".rstrip("0").rstrip("."), text)
    return re.sub(r"(?<![\d.])-0(?![\d.])", "0", short)
