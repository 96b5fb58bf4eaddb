"""The sheet that circuits are drawn on with schemdraw: kinds of lines, letters of the code, the SVG that it becomes."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import schemdraw
from schemdraw.elements import Element
from schemdraw.segments import Segment, SegmentCircle, SegmentPoly
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
        ElementTree.SubElement(node, "title").text = name
        for i, factor in enumerate(name.split()):
            self.write_factor(node, factor, first=i == 0)

    def write_factor(self, node: ElementTree.Element, name: str, first: bool) -> None:
        """One letter of a product."""
        base, *sub = name.split("_")
        main = ElementTree.SubElement(node, "tspan")
        main.set("font-style", "italic")
        if not first:
            main.set("dy", f"{-0.25 * self.size:.2f}")
            main.set("dx", f"{0.1 * self.size:.2f}")
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
    """An element whose lines are thin and black unless told otherwise; `strokes` draws it."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__()
        self.strokes(*args, **options)

    def strokes(self) -> None:
        """Nothing, before lines are added."""

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


class Sheet:
    """A drawing under way, and the SVG that it becomes."""

    def __init__(self, title: str, text: str) -> None:
        self.title, self.text = title, text
        self.drawing = schemdraw.Drawing(canvas="svg", show=False)
        self.drawing.config(inches_per_unit=UNIT / 72.0, margin=MARGIN)

    def add(self, symbol: Symbol, xy: Point, theta: float = 0.0) -> Symbol:
        """Place a symbol; theta turns it [deg]."""
        symbol.at(xy).theta(theta)
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
        for (x, y), (v, w) in pairwise(points):
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
        place = {"right": (0.16, 0.0), "left": (-0.16, 0.0), "above": (0.0, 0.4), "below": (0.0, -0.4)}[side]
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

    def ground(self, left: Point, right: Point) -> None:
        """Structure that something is fixed to: a hatched line, hatched on its upper side."""
        (x, y), (end, _) = left, right
        self.free(Segment([left, right], color=BLACK, lw=THICK))
        while x < end - 0.1:
            self.free(Segment([(x, y), (x + 0.25, y + 0.25)], color=BLACK, lw=0.7))
            x += 0.3

    def surface(self, left: float, right: float, y: float) -> None:
        """The sea's surface."""
        n = int((right - left) / 0.1)
        points = [(left + 0.1 * i, y + 0.12 * math.sin(0.1 * i * 2.0 * math.pi / 1.2)) for i in range(n + 1)]
        self.free(Segment(points, color=LINES["b"]["color"], lw=1.0))

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
        title, about = ElementTree.Element("title"), ElementTree.Element("desc")
        title.text, about.text = self.title, self.text
        root.insert(0, ElementTree.Element("rect", x=x, y=y, width=w, height=h, fill=WHITE))
        root.insert(0, about)
        root.insert(0, title)
        root.set("xmlns", "http://www.w3.org/2000/svg")
        root.set("font-family", FONT)
        root.set("role", "img")
        lines = [ElementTree.tostring(node, encoding="unicode") for node in root]
        head = ElementTree.tostring(root, encoding="unicode").partition(">")[0] + ">"
        path.write_text(
            "\n".join([head, *(line.strip() for line in lines), "</svg>", ""]), encoding="utf-8", newline="\n"
        )


def rounded(text: str) -> str:
    """Numbers in an attribute with two decimals at the most, no minus before zero."""
    short = re.sub(r"-?\d+\.\d+", lambda m: f"{float(m[0]) + 0.0:.2f}".rstrip("0").rstrip("."), text)
    return re.sub(r"(?<![\d.])-0(?![\d.])", "0", short)
