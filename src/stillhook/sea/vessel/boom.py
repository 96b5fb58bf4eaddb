"""Where the crane tip is: pedestal, slew, main boom and knuckle boom, and whether the crane can reach a place."""

from __future__ import annotations

import copy
import math
import re
from dataclasses import dataclass
from typing import Self

from stillhook.base.arrays import fill
from stillhook.errors import SeaError
from stillhook.sea.vessel.ship_motion import MAX_OFFSET
from stillhook.units import number, parse, quote

LARGEST_ELEVATION = math.radians(88.0)
"""Of the main boom above the horizontal: no boom is lifted over its own pedestal."""
LARGEST_FOLD = math.radians(170.0)
"""Of the knuckle boom below the line of the main boom: beyond it the two booms meet."""
LONGEST_BOOM, LARGEST_OFFSET = 200.0, 20.0  # m
REACH_TOLERANCE = 1e-9  # part of the reach by which rounding may pass it
AT_LIKE = 'such as "x=-20 m, y=-18 m" (forward and to port of the reference point; z, the height, where it is needed)'
DESCRIPTIONS = {
    "pedestal": 'Give forward, to port, and height of the heel pin, as ("-10 m", "-6 m", "15 m").',
    "main": 'Give length and angle above the horizontal, as ("25 m", "50 deg").',
    "knuckle": 'Give length and angle below the line of the main boom, as ("15 m", "60 deg").',
}


@dataclass(frozen=True)
class TipPoint:
    """Where the crane tip is [m] from the RAO's reference point, or from the motion sensor: x forward, y to port, z up
    (None: not determined)."""

    x: float
    y: float
    z: float | None = None

    def describe(self) -> str:
        """The place in words and units."""
        up = "" if self.z is None else f", z {number(self.z)} m"
        return f"x {number(self.x)} m, y {number(self.y)} m{up}"


def parse_point(text: str, where: str = "at") -> TipPoint:
    """The place that a text such as "x=-20 m, y=-18 m" names, z optional. Errors: SeaError, UnitError, one line."""
    coordinates: dict[str, float] = {}
    for part in text.split(",") if isinstance(text, str) else [""]:
        match = re.fullmatch(r"\s*([A-Za-z]+)\s*=\s*(.*?)\s*", part)
        if match is None or match[1].lower() not in ("x", "y", "z"):
            problem = f"{quote(part.strip())} is not x, y or z with a length"
            raise SeaError(f"{where} {quote(text)}: {problem}. Write a place {AT_LIKE}.")
        name = match[1].lower()
        if name in coordinates:
            raise SeaError(f"{where} {quote(text)}: {name} is given twice. Give it once.")
        coordinates[name] = parse(match[2], "length", f"{where}: {name}")
        if abs(coordinates[name]) > MAX_OFFSET:
            raise SeaError(f"{where} {quote(text)}: {name} is more than {MAX_OFFSET:g} m. Check its unit.")
    for name in ("x", "y"):
        if name not in coordinates:
            raise SeaError(f"{where} {quote(text)}: {name} is missing. Write a place {AT_LIKE}.")
    return TipPoint(coordinates["x"], coordinates["y"], coordinates.get("z"))


@dataclass(frozen=True, init=False)
class Boom:
    r"""Geometry of a knuckle-boom crane (a box-boom crane has no knuckle boom).

    .. math:: r = r_0 + L_1\cos\theta_1 + L_2\cos(\theta_1 - \theta_2), \quad
              z = z_p + L_1\sin\theta_1 + L_2\sin(\theta_1 - \theta_2), \quad x = x_p + r\cos\psi, \quad y = y_p +
              r\sin\psi

    pedestal (x_p, y_p, z_p): forward and to port of the RAO's reference point, main boom's heel pin above still water
    [m]. slew psi: where the boom points, counter-clockwise from the bow [rad]: 0 forward, 90 deg to port, 270 deg to
    starboard. main, knuckle: length [m] and angle [rad], the main boom's above the horizontal, the knuckle boom's below
    the line of the main boom (0 straight on). offset r_0: heel pin ahead of the axis of slewing [m].
    Texts with units in; a knuckle of None: none. Errors: SeaError for what no crane is, UnitError for a number without
    its unit.
    """

    x: float
    y: float
    z: float
    slew: float
    main_length: float
    main_angle: float
    knuckle_length: float
    knuckle_angle: float
    offset: float

    def __init__(
        self,
        *,
        pedestal: tuple[str, str, str],
        slew: str,
        main: tuple[str, str],
        knuckle: tuple[str, str] | None = None,
        offset: str = "0 m",
    ) -> None:
        for name, value, count in (("pedestal", pedestal, 3), ("main", main, 2), ("knuckle", knuckle or main, 2)):
            if isinstance(value, str) or len(value) != count:
                raise SeaError(f"boom: {name} = {value!r} is not {count} texts. {DESCRIPTIONS[name]}")
        length, angle = knuckle or ("0 m", "0 deg")
        lengths = dict(zip("xyz", pedestal, strict=True))
        lengths |= {"main_length": main[0], "knuckle_length": length, "offset": offset}
        angles = {"slew": slew, "main_angle": main[1], "knuckle_angle": angle}
        for kind, texts in (("length", lengths), ("angle", angles)):
            fill(self, **{name: parse(x, kind, f"boom: {name.replace('_', ' ')}") for name, x in texts.items()})
        self._check()

    def _check(self) -> None:
        if max(abs(self.x), abs(self.y), abs(self.z)) > MAX_OFFSET:
            raise SeaError(
                f"boom: the pedestal is more than {MAX_OFFSET:g} m off the reference point. Check its units."
            )
        if self.z < 0.0:
            raise SeaError(f"boom: its heel is {-self.z:g} m below still water. Give the pedestal's z above it.")
        lengths = (
            ("main length", self.main_length, 1.0, LONGEST_BOOM),
            ("knuckle length", self.knuckle_length, 0.0, LONGEST_BOOM),
            ("offset", self.offset, 0.0, LARGEST_OFFSET),
        )
        for name, length, least, most in lengths:
            if not least <= length <= most:
                raise SeaError(f"boom: {name} {length:g} m is not between {least:g} m and {most:g} m. Check its unit.")
        angles = (
            ("main", self.main_angle, "level", LARGEST_ELEVATION, "upright", "above the horizontal"),
            ("knuckle", self.knuckle_angle, "straight on", LARGEST_FOLD, "folded back", "below the main boom's line"),
        )
        for name, angle, at_0, most, at_most, counted in angles:
            if not 0.0 <= angle <= most:
                between = f"not between 0 deg ({at_0}) and {math.degrees(most):.3g} deg ({at_most})"
                raise SeaError(f"boom: {name} angle {math.degrees(angle):.4g} deg is {between}. Give it {counted}.")
        if self.radius <= 0.0:
            problem = f"the tip is folded back over the pedestal (radius {self.radius:.3g} m)"
            raise SeaError(f"boom: {problem}. Fold the knuckle boom less.")

    @property
    def radius(self) -> float:
        """Horizontal distance of the tip from the axis of slewing [m]."""
        down = self.main_angle - self.knuckle_angle
        return self.offset + self.main_length * math.cos(self.main_angle) + self.knuckle_length * math.cos(down)

    @property
    def tip(self) -> tuple[float, float, float]:
        """Crane tip (x, y) [m] from the reference point, forward and to port, and its height above still water [m]."""
        down = self.main_angle - self.knuckle_angle
        rise = self.main_length * math.sin(self.main_angle) + self.knuckle_length * math.sin(down)
        return self.x + self.radius * math.cos(self.slew), self.y + self.radius * math.sin(self.slew), self.z + rise

    def reaching(self, x: float, y: float, z: float) -> Self:
        """The same crane with its tip over (x, y) [m] at the height z [m] above still water, slewed and luffed, the
        knuckle boom hanging down.

        Errors: SeaError where the booms are too short or too long for it, or an angle would be beyond what a boom does.
        """
        r, h = math.hypot(x - self.x, y - self.y) - self.offset, z - self.z
        L_1, L_2 = self.main_length, self.knuckle_length
        away = math.hypot(r, h)
        place = f"boom: a tip at x {x:g} m, y {y:g} m, {z:g} m up is {away:.4g} m from the heel pin"
        if away > (L_1 + L_2) * (1.0 + REACH_TOLERANCE):
            raise SeaError(f"{place}: the boom reaches {L_1 + L_2:.4g} m. Bring the tip nearer.")
        if away < abs(L_1 - L_2) * (1.0 - REACH_TOLERANCE):
            raise SeaError(f"{place}: the booms fold to {abs(L_1 - L_2):.4g} m. Put the tip farther out.")
        up, fold = math.atan2(h, r), 0.0
        if L_2:
            up += math.acos(_limited((L_1**2 + away**2 - L_2**2) / (2.0 * L_1 * away)))
            fold = math.pi - math.acos(_limited((L_1**2 + L_2**2 - away**2) / (2.0 * L_1 * L_2)))
        slew = math.atan2(y - self.y, x - self.x) % (2.0 * math.pi)
        try:
            return self.turned(slew, up, fold)
        except SeaError as problem:
            raise SeaError(f"{place}: {str(problem).removeprefix('boom: ')}") from None

    def turned(self, slew: float, main_angle: float, knuckle_angle: float) -> Self:
        """The same crane with these angles [rad]. Errors: SeaError for an angle beyond what a boom does."""
        boom = copy.copy(self)
        fill(boom, slew=slew, main_angle=main_angle, knuckle_angle=knuckle_angle)
        boom._check()
        return boom

    def to_dict(self) -> dict[str, float]:
        """Its numbers in SI; `from_dict` is the way back."""
        return dict(vars(self))

    @classmethod
    def from_dict(cls, data: dict[str, float]) -> Self:
        """The boom whose `to_dict` gave this."""
        boom = cls.__new__(cls)
        fill(boom, **{name: float(data[name]) for name in cls.__dataclass_fields__})
        boom._check()
        return boom

    def describe(self) -> str:
        """The crane in words and units."""
        x, y, z = self.tip
        knuckle = ""
        if self.knuckle_length:
            knuckle = f", knuckle boom {self.knuckle_length:.4g} m {math.degrees(self.knuckle_angle):.4g} deg down"
        return (
            f"slew {math.degrees(self.slew):.4g} deg, "
            f"main boom {self.main_length:.4g} m {math.degrees(self.main_angle):.4g} deg up{knuckle}: "
            f"radius {self.radius:.4g} m, tip x {x:.4g} m, y {y:.4g} m, {z:.4g} m above still water"
        )


def _limited(cosine: float) -> float:
    return min(1.0, max(-1.0, cosine))


_TEXT = re.compile(
    r"(?P<pedestal>[^;]*?)[,;\s]+slew\s+(?P<slew>.*?)[,;\s]+main\s+(?P<main>.*?)(?:[,;\s]+knuckle\s+(?P<knuckle>.*))?"
)


def parse_boom(text: str, where: str = "boom") -> Boom:
    """The crane of a text such as "x=-10 m, y=-6 m, z=15 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg".
    Errors: SeaError, UnitError, one line."""
    parts = _TEXT.fullmatch(text.strip()) if isinstance(text, str) else None
    if parts is None:
        raise SeaError(
            f'{where} {quote(text)}: is not heel, slew and main boom. Write "x=-10 m, y=-6 m, z=15 m, slew 270 deg,'
            ' main 25 m 50 deg".'
        )
    heel = parse_point(parts["pedestal"], where)
    if heel.z is None:
        raise SeaError(f"{where}: z is missing. Give the height of the boom's heel above still water as well.")
    return Boom(
        pedestal=(f"{heel.x!r} m", f"{heel.y!r} m", f"{heel.z!r} m"),
        slew=f"{parse(parts['slew'], 'angle', f'{where}: slew')!r} rad",
        main=_length_and_angle(parts["main"], f"{where}: main"),
        knuckle=None if parts["knuckle"] is None else _length_and_angle(parts["knuckle"], f"{where}: knuckle"),
    )


def _length_and_angle(text: str, where: str) -> tuple[str, str]:
    match = re.fullmatch(r"\s*(\S+ [^\s,]+)\s*[,\s]\s*(\S+ \S+)\s*", text)
    if match is None:
        raise SeaError(f'{where} {quote(text)}: is not a length and an angle. Write "25 m 50 deg".')
    return match[1], match[2]
