"""Hull lines in closed form: superelliptic sections between a waterline and a keel line, and panels on them.

Half-breadth at height z <= 0, x forward from midship:

    y(x, z) = b(x) [1 - (-z/d(x))^p(x)]^(1/p(x))

b(x) is the waterline's half-breadth: B/2 over the parallel middle body, B/2 (1 - s^n) to the stem, B/2 [1 - (1 - t_b)
s^2] to the transom. d(x) is the local draught: T, rising aft as T [1 - (1 - t_d) s^2] to the transom. p(x) is the
fullness of the section (2: an ellipse; large: a box with a small bilge radius), p_m amidships and p_e at the ends, with
s^2 (3 - 2 s) between. s runs from 0 to 1 along each end. A quarter of such a section has the area b d G(1 + 1/p)^2 /
G(1 + 2/p) (G: gamma function), so volume, waterplane and their moments are known without any panel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import gamma

FloatArray = NDArray[np.float64]
Panels = tuple[FloatArray, NDArray[np.int64]]

BILGE = 0.4
"""Part of a section's panels that goes with its turning rather than with its girth."""
SMALLEST = 1e-6  # m^2: smaller panels are what is left where lines meet


@dataclass(frozen=True)
class Lines:
    """Main dimensions [m]: waterline length L from transom to stem, breadth B, draught T. Ends as parts of L: entrance
    (waterline to the stem), run (waterline to the transom), rise (keel to the transom). n exponent of the entrance;
    t_b, t_d half-breadth and draught of the transom over those amidships; p_m, p_bow, p_stern fullness of sections."""

    L: float
    B: float
    T: float
    entrance: float
    run: float
    rise: float
    n: float
    t_b: float
    t_d: float
    p_m: float
    p_bow: float
    p_stern: float

    def _ends(self, x: FloatArray, part: float, sign: int) -> FloatArray:
        """0 over the middle, up to 1 at the end of the ship."""
        return np.clip((sign * x - (0.5 - part) * self.L) / (part * self.L), 0.0, 1.0)

    def half_breadth(self, x: FloatArray) -> FloatArray:
        fore, aft = self._ends(x, self.entrance, 1), self._ends(x, self.run, -1)
        return self.B / 2.0 * (1.0 - fore**self.n) * (1.0 - (1.0 - self.t_b) * aft**2)

    def draught(self, x: FloatArray) -> FloatArray:
        return self.T * (1.0 - (1.0 - self.t_d) * self._ends(x, self.rise, -1) ** 2)

    def fullness(self, x: FloatArray) -> FloatArray:
        fore, aft = self._ends(x, self.entrance, 1), self._ends(x, self.rise, -1)
        step = lambda s: s * s * (3.0 - 2.0 * s)
        return self.p_m + (self.p_bow - self.p_m) * step(fore) + (self.p_stern - self.p_m) * step(aft)

    def area(self, x: FloatArray) -> FloatArray:
        """Section area under water [m^2], both sides."""
        p = self.fullness(x)
        return 2.0 * self.half_breadth(x) * self.draught(x) * gamma(1.0 + 1.0 / p) ** 2 / gamma(1.0 + 2.0 / p)

    def over_length(self, f: Callable[[FloatArray], FloatArray]) -> float:
        """Integral of f over the ship's length."""
        breaks = [(0.5 - self.entrance) * self.L, (self.run - 0.5) * self.L, (self.rise - 0.5) * self.L]
        return float(
            quad(
                lambda x: float(f(np.float64(x))), -self.L / 2.0, self.L / 2.0, points=breaks, epsrel=1e-10, limit=200
            )[0]
        )

    def first_moment(self, x: FloatArray) -> FloatArray:
        """Integral of depth over the section [m^3]: b d^2 (2/p) B(2/p, 1 + 1/p)."""
        p = self.fullness(x)
        beta = gamma(2.0 / p) * gamma(1.0 + 1.0 / p) / gamma(1.0 + 3.0 / p)
        return 2.0 * self.half_breadth(x) * self.draught(x) ** 2 * beta / p

    def form(self) -> dict[str, float]:
        """Volume [m^3], waterplane [m^2], its second moments about midship's axes [m^4], centres of buoyancy and
        flotation [m], and coefficients, by quadrature of the closed forms."""
        V = self.over_length(self.area)
        A_w = self.over_length(lambda x: 2.0 * self.half_breadth(x))
        return {
            "V": V,
            "A_w": A_w,
            "I_x": self.over_length(lambda x: 2.0 / 3.0 * self.half_breadth(x) ** 3),
            "I_y": self.over_length(lambda x: 2.0 * x**2 * self.half_breadth(x)),
            "x_B": self.over_length(lambda x: x * self.area(x)) / V,
            "z_B": -self.over_length(self.first_moment) / V,
            "x_F": self.over_length(lambda x: 2.0 * x * self.half_breadth(x)) / A_w,
            "C_B": V / (self.L * self.B * self.T),
            "C_W": A_w / (self.L * self.B),
            "C_M": float(self.area(np.float64(0.0))) / (self.B * self.T),
        }


def stations(lines: Lines, h: float) -> FloatArray:
    """Places along the ship, stern to stem, about h apart amidships and half of that at the ends."""
    n = max(8, round(1.15 * lines.L / h))
    u = np.linspace(-1.0, 1.0, n + 1)
    return lines.L / 2.0 * (0.6 * u + 0.4 * np.sin(np.pi / 2.0 * u))


def section(b: float, d: float, p: float, n: int) -> FloatArray:
    """n + 1 points (y, z) along a section from the waterline to the keel, evenly over its girth but closer where it
    turns (BILGE)."""
    angle = np.linspace(0.0, np.pi / 2.0, 2001)
    y, z = b * np.cos(angle) ** (2.0 / p), -d * np.sin(angle) ** (2.0 / p)
    y[-1], z[0] = 0.0, 0.0
    arc = np.hypot(np.diff(y), np.diff(z))
    heading = np.unwrap(np.arctan2(np.diff(z), np.diff(y)))
    turn = np.concatenate(([0.0], np.abs(np.diff(heading)))) if b > 0.0 else np.zeros_like(arc)
    share = arc / arc.sum() + BILGE * turn / max(turn.sum(), 1e-9)
    way = np.concatenate(([0.0], np.cumsum(share)))
    even = np.linspace(0.0, way[-1], n + 1)
    return np.stack([np.interp(even, way, y), np.interp(even, way, z)], axis=1)


def grid(points: FloatArray) -> Panels:
    """Panels of a grid of points (m, n, 3), as vertices (k, 3) and faces (l, 4)."""
    m, n, _ = points.shape
    index = np.arange(m * n).reshape(m, n)
    corners = [index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]]
    return points.reshape(-1, 3), np.stack([c.ravel() for c in corners], axis=1)


def joined(parts: list[Panels]) -> Panels:
    """Parts as one, without panels that have no area."""
    offsets = np.cumsum([0, *(len(v) for v, _ in parts[:-1])])
    vertices = np.concatenate([v for v, _ in parts])
    faces = np.concatenate([f + o for (_, f), o in zip(parts, offsets, strict=True)])
    a, b, c, d = (vertices[faces[:, i]] for i in range(4))
    area = np.linalg.norm(np.cross(c - a, d - b), axis=1) / 2.0
    return vertices, faces[area > SMALLEST]


def hull_panels(lines: Lines, h: float) -> Panels:
    """Port half of the wetted hull with its transom in panels of about h [m], normals into the water."""
    x = stations(lines, h)
    n = max(4, round(0.95 * (lines.B / 2.0 + lines.T) / h))
    b, d, p = lines.half_breadth(x), lines.draught(x), lines.fullness(x)
    yz = np.stack([section(*s, n) for s in zip(b, d, p, strict=True)])
    shell = np.concatenate([np.broadcast_to(x[:, None, None], (*yz.shape[:2], 1)), yz], axis=2)
    rows = max(1, round(d[0] / h))
    down = np.linspace(0.0, 1.0, rows + 1)
    transom = np.stack([np.stack([np.full(n + 1, x[0]), yz[0, :, 0], part * yz[0, :, 1]], axis=1) for part in down])
    return joined([grid(shell[::-1]), grid(transom[::-1])])


def lid_panels(lines: Lines, h: float) -> Panels:
    """Port half of the water plane inside the hull, in panels of about h [m]."""
    x = stations(lines, h)
    n = max(2, round(lines.B / 2.0 / h))
    y = lines.half_breadth(x)[:, None] * np.linspace(0.0, 1.0, n + 1)
    return joined([grid(np.stack([np.broadcast_to(x[:, None], y.shape), y, np.zeros_like(y)], axis=2))])
