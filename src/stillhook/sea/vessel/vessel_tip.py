"""Motion of the crane tip from the vessel's: heave, roll and pitch with the boom as it slews, luffs and folds, and what
the PLC makes of its motion unit's signals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray, fill
from stillhook.errors import MotionError, SeaError
from stillhook.physics.tip_kinematics import Attitude, BoomLengths, BoomPose, Jet, lever, rise, tip_motion
from stillhook.sea.motion.motion import CYCLE, Motion, Sample, Still
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.motion.words import parse_motion
from stillhook.sea.vessel.boom import Boom, parse_boom
from stillhook.sea.vessel.motion_unit import MotionUnit, Signals
from stillhook.sea.vessel.ship_motion import ShipMotion
from stillhook.units import parse, quote

Rows = Iterable[tuple[str, str, str]]
Moves = tuple[tuple[float, float, float], ...]

SIZES = {"heave": "length", "roll": "angle", "pitch": "angle", "surge": "length", "sway": "length", "yaw": "angle"}
ANGLES = {"slew": "slew", "luff": "main_angle", "fold": "knuckle_angle"}
"""Movements of a boom, and the angle of `Boom` that each changes."""
_MEANT = {
    "heave": "heave, up positive [m]",
    "roll": "roll, port side up positive [rad]",
    "pitch": "pitch, bow up positive [rad]",
    "slew": "slew angle of the boom, from the bow to port [rad]",
    "main": "angle of the main boom above the horizontal [rad]",
    "knuckle": "angle of the knuckle boom below the line of the main boom [rad]",
    "unit_heave": "heave as the motion unit gives it to the PLC, up positive [m]",
}
GIVEN = {name: (name, f"v_{name}", f"a_{name}") for name in _MEANT}
"""Vessel, angles of the boom, and heave as the motion unit gives it, as inputs from outside: each with its rate and
acceleration."""
NEEDED = (*GIVEN["heave"], *GIVEN["roll"], *GIVEN["pitch"])
"""Those without which the vessel's motion is not complete."""
VESSEL = {
    each: (of + text[: text.index(" [")], text[text.index("[") + 1 : -1] + per)
    for name, text in _MEANT.items()
    for each, of, per in zip(GIVEN[name], ("", "rate of ", "acceleration of "), ("", "/s", "/s^2"), strict=True)
}
"""All of them with their meanings and units."""
SOFT = 2.0
"""Time over which a boom comes to its speed, and to rest [s]: half of it before a movement's first and last time."""
LARGEST_ANGLE = math.radians(60.0)  # of roll and pitch
CHECKED, LOOKED_AT = 0.5, 3600.0  # s: spacing in time at which angles and poses are checked, and how long angles are


@dataclass(frozen=True, init=False)
class VesselTip(Motion):
    r"""Motion of a crane tip from that of the vessel at a point, by exact rotations, and as the PLC calculates it.

    boom: a `Boom` or its text; its pedestal is from the point whose motion is given (heel pin forward, to port, up).
    heave [m], roll (port up), pitch (bow up), surge, sway, yaw [rad]: motions, or texts such as "sine 1 m 14 s" and
    "sine 3 deg 12 s"; the last three move the tip in the horizontal plane alone. slew, luff, fold: movements of the
    boom, rows of first time, last time and angle reached, such as ("30 s", "90 s", "180 deg"): at a constant rate, with
    a second of rounding at either end. unit: the motion unit, ideal where none is given.
    Heights count from the tip's on a level ship at t = 0. Errors: MotionError, SeaError, UnitError, one line.

    >>> import stillhook
    >>> tip = stillhook.VesselTip("x=-10 m, y=-6 m, z=8 m, slew 270 deg, main 25 m 50 deg", roll="sine 2 deg 12 s")
    >>> round(float(tip.sample(3.0)[0]), 3)
    -0.787
    """

    boom: Boom
    heave: Motion
    roll: Motion
    pitch: Motion
    surge: Motion
    sway: Motion
    yaw: Motion
    slew: Moves
    luff: Moves
    fold: Moves
    unit: MotionUnit
    kind: ClassVar[str] = "vessel"

    def __init__(
        self,
        boom: Boom | str,
        *,
        heave: Motion | str = "still",
        roll: Motion | str = "still",
        pitch: Motion | str = "still",
        surge: Motion | str = "still",
        sway: Motion | str = "still",
        yaw: Motion | str = "still",
        slew: Rows = (),
        luff: Rows = (),
        fold: Rows = (),
        unit: MotionUnit | None = None,
    ) -> None:
        motions = zip(SIZES, (heave, roll, pitch, surge, sway, yaw), strict=True)
        self._fill(
            boom=parse_boom(boom) if isinstance(boom, str) else boom,
            **{name: parse_motion(x, name, SIZES[name]) if isinstance(x, str) else x for name, x in motions},
            **{name: _moves(name, rows) for name, rows in zip(ANGLES, (slew, luff, fold), strict=True)},
            unit=unit or MotionUnit(),
        )

    @classmethod
    def from_log(
        cls,
        ship: ShipMotion,
        boom: Boom | str,
        *,
        slew: Rows = (),
        luff: Rows = (),
        fold: Rows = (),
        unit: MotionUnit | None = None,
        every: str | None = "0.5 s",
    ) -> Self:
        """The tip of a ship that moves as logged; every: as in `stillhook.sea.vessel.ship_motion.tip_motion`. The log
        is taken as the true motion, so that a unit's heave filter comes on top of the logging one's."""
        motions, source = {}, ship.report.source
        for name in ("heave", "roll", "pitch"):
            if (column := getattr(ship, name)) is None:
                raise MotionError(f"{source}: has no {name}, which the tip of a boom needs. Log it as well.")
            motion = Recorded(ship.t, column, source=source, report=ship.report.describe())
            often = every is not None and np.median(np.diff(ship.t)) <= parse(every, "time", "every") / 2.0
            motions[name] = motion.thinned(every) if often and every is not None else motion
        return cls(boom, **motions, slew=slew, luff=luff, fold=fold, unit=unit)

    def _fill(self, **values: Any) -> None:
        fill(self, **values)
        for name in SIZES:
            motion = getattr(self, name)
            if not isinstance(motion, Motion) or motion.separate:
                raise MotionError(
                    f"{name}: {quote(motion)} is not a motion. Give one, or a text such as sine 1 m 14 s."
                )
        for name in ("roll", "pitch"):
            if (angle := self._largest(name)) > LARGEST_ANGLE:
                raise MotionError(f"{name}: {math.degrees(angle):.3g} deg is beyond any ship. Check its unit.")
        self._check_moves()

    def _largest(self, name: str) -> float:
        """Largest magnitude of a motion in its first hour [m] or [rad]."""
        end = LOOKED_AT if self.duration is None else min(LOOKED_AT, self.duration)
        return float(np.max(np.abs(getattr(self, name).sample(np.linspace(0.0, end, 1 + math.ceil(end / CHECKED)))[0])))

    def _check_moves(self) -> None:
        ends = [last for name in ANGLES for _, last, _ in getattr(self, name)]
        for t in np.linspace(0.0, max(ends) + SOFT, 1 + math.ceil(max(ends) / CHECKED)) if ends else ():
            try:
                self.boom_at(float(t))
            except SeaError as problem:
                raise MotionError(f"boom at {t:.4g} s: {str(problem).removeprefix('boom: ')}") from None

    @property
    def separate(self) -> bool:
        return True

    @property
    def duration(self) -> float | None:
        return min((d for name in SIZES if (d := getattr(self, name).duration) is not None), default=None)

    def boom_at(self, t: float) -> Boom:
        """The boom with its angles of a time [s]."""
        pose = self._pose(np.array([t]))
        return self.boom.turned(*(float(angle.x[0]) for angle in pose))  # type: ignore[index]

    def sample(self, t: ArrayLike) -> Sample:
        time = np.asarray(t, dtype=np.float64)
        return _sample(tip_motion(self._attitude(time), self._pose(time), lengths(self.boom)), time)

    def measured(self, t: ArrayLike, h: float = CYCLE) -> Sample:
        """Height, speed and acceleration of the tip as the PLC calculates them from its motion unit and the boom's
        angles."""
        time = np.asarray(t, dtype=np.float64)
        flat = np.ravel(time)
        boom = lengths(self.boom, self.unit.at, self.unit.exact)
        return _sample(tip_motion(self.signals(h).at(flat), self._pose(flat), boom), time)

    def of_inputs(
        self, values: Mapping[str, float], t: float, seen: Callable[[Attitude], Attitude] | None = None
    ) -> tuple[Sample, Sample, Jet]:
        """Motion of the tip, that of the PLC, and heave as the motion unit gives it, where the vessel's motion comes
        from outside by the names of `GIVEN` [SI].

        Angles of the boom are those of this motion at t [s] unless they are given. seen: what the unit makes of the
        attitude at its place; without it the unit must have none of a past. A unit_heave that is given is in place of
        the unit's. Errors: MotionError for what is not complete, not possible, or depends on the unit's past.
        """
        jets = {}
        for name, jet in GIVEN.items():
            given = [each for each in jet if each in values]
            if (given and len(given) < len(jet)) or (not given and name in ("heave", "roll", "pitch")):
                lacks = ", ".join(each for each in jet if each not in values)
                raise MotionError(f"{lacks} missing. Give heave, roll and pitch with their rates and accelerations.")
            if given:
                jets[name] = Jet(*np.array([[values[each]] for each in jet]))
        for name in ("roll", "pitch"):
            if abs(values[name]) > LARGEST_ANGLE:
                raise MotionError(f"{name} = {values[name]:g} rad is beyond any ship. Give a value within +-1.047.")
        if seen is None and not self.unit.passes:
            raise MotionError(
                "filter, delay and noise of the case's motion unit are those of the input. Leave them out."
            )
        true = Attitude(jets["heave"], jets["roll"], jets["pitch"])
        pose = BoomPose(
            *(jets.get(n, own) for n, own in zip(("slew", "main", "knuckle"), self._pose(np.array([t])), strict=True))
        )
        measured = self._moved_to_unit(true) if seen is None else seen(self._moved_to_unit(true))
        measured = measured._replace(heave=jets.get("unit_heave", measured.heave))
        now, boom = np.array([t]), lengths(self.boom, self.unit.at, self.unit.exact)
        tips = (tip_motion(*of) for of in ((true, pose, lengths(self.boom)), (measured, pose, boom)))
        return *(_sample(tip, now) for tip in tips), measured.heave  # type: ignore[return-value]

    def inputs_at(self, t: float, h: float) -> dict[str, float]:
        """This motion at t [s] by the names of `GIVEN`; h: the PLC's cycle [s]."""
        now = np.array([t])
        jets = (*self._attitude(now), *self._pose(now), self.signals(h).at(now).heave)
        return {
            n: float(np.ravel(x)[0])
            for names, jet in zip(GIVEN.values(), jets, strict=True)
            for n, x in zip(names, jet, strict=True)
        }

    def signals(self, h: float) -> Signals:
        """What the motion unit gives, at PLC cycles h apart [s]."""
        if h not in self._made:
            self._made[h] = Signals(self.unit, self._at_unit, self.duration, h)
        return self._made[h]

    @cached_property
    def _made(self) -> dict[float, Signals]:
        return {}

    def _attitude(self, t: FloatArray) -> Attitude:
        return Attitude(*(Jet(*getattr(self, name).sample(t)) for name in ("heave", "roll", "pitch")))

    def _at_unit(self, t: FloatArray) -> Attitude:
        return self._moved_to_unit(self._attitude(t))

    def _moved_to_unit(self, true: Attitude) -> Attitude:
        """Attitude with the heave at the motion unit's place."""
        x, y, z = self.unit.at
        if not any(self.unit.at):
            return true
        h = rise(true, Jet(x, 0.0, 0.0), Jet(y, 0.0, 0.0), Jet(z, 0.0, 0.0), 1.0)
        return Attitude(Jet(h.x - z, h.v, h.a), true.roll, true.pitch)

    def _pose(self, t: FloatArray) -> BoomPose:
        return BoomPose(*(_moved(getattr(self.boom, angle), getattr(self, name), t) for name, angle in ANGLES.items()))

    def place(self, t: ArrayLike) -> FloatArray:
        """Where the tip is, (3, shape of t): forward, to port and up from the mean place of the motion's point, in axes
        that do not turn with the ship [m]; exact rotations in the order yaw, pitch, roll."""
        time = np.asarray(t, dtype=np.float64)
        turn = {name: getattr(self, name).sample(time)[0] for name in SIZES}
        at: list[Any] = [jet.x for jet in lever(self._pose(time), lengths(self.boom))]
        for name, i, k in (("roll", 1, 2), ("pitch", 0, 2), ("yaw", 0, 1)):
            c, s = np.cos(turn[name]), np.sin(turn[name])
            at[i], at[k] = at[i] * c - at[k] * s, at[i] * s + at[k] * c
        x, y, z = at
        return np.stack([turn["surge"] + x, turn["sway"] + y, turn["heave"] + z])

    def describe(self) -> str:
        moving = [(name, size) for name, size in SIZES.items() if not isinstance(getattr(self, name), Still)]
        motions = "; ".join(
            f"{name} up to {math.degrees(self._largest(name)):.3g} deg"
            if size == "angle"
            else f"{name} {getattr(self, name).describe()}"
            for name, size in moving
        )
        moves = "".join(f"; {name} {len(rows)} movements" for name in ANGLES if (rows := getattr(self, name)))
        return f"tip of a vessel: {motions or 'still'}; {self.boom.describe()}{moves}; {self.unit.describe()}"

    def to_dict(self) -> dict[str, Any]:
        motions = {name: getattr(self, name).to_dict() for name in SIZES}
        moves = {name: [list(row) for row in getattr(self, name)] for name in ANGLES}
        return {"type": self.kind, "boom": self.boom.to_dict(), **motions, **moves, "unit": self.unit.to_dict()}

    @classmethod
    def from_dict(cls, data: dict[str, Any], read: Callable[[dict[str, Any]], Motion]) -> Self:
        """The motion that `to_dict` stored; read: makes a motion of what its `to_dict` stored."""
        tip = cls.__new__(cls)
        tip._fill(
            boom=Boom.from_dict(data["boom"]),
            **{name: read(data[name]) for name in SIZES},
            **{name: tuple((float(a), float(b), float(c)) for a, b, c in data[name]) for name in ANGLES},
            unit=MotionUnit.from_dict(data["unit"]),
        )
        return tip


def lengths(boom: Boom, at: tuple[float, float, float] = (0.0, 0.0, 0.0), exact: float = 1.0) -> BoomLengths:
    """The boom seen from a place, which its tip is above as it is now; exact as in `BoomLengths`."""
    x, y, z = boom.x - at[0], boom.y - at[1], boom.z - at[2]
    return BoomLengths(x, y, z, boom.offset, boom.main_length, boom.knuckle_length, boom.tip[2] - at[2], exact)


def _sample(jet: Jet, t: FloatArray) -> Sample:
    """A jet with the shape of t."""
    s, v, a = (np.array(np.broadcast_to(x, t.size).reshape(t.shape)) for x in map(np.ravel, jet))
    return s, v, a


def _moves(name: str, rows: Rows) -> Moves:
    """Rows of a movement in SI, checked."""
    moves: list[tuple[float, float, float]] = []
    for i, row in enumerate(rows):
        where = f"{name}: row {i + 1}"
        if isinstance(row, str) or len(row) != 3:
            raise MotionError(
                f'{where}: {quote(row)} is not first time, last time, angle: ("30 s", "90 s", "180 deg").'
            )
        first, last = (parse(text, "time", where) for text in row[:2])
        moves.append((first, last, parse(row[2], "angle", where)))
    ends = [0.0, *(t for first, last, _ in moves for t in (first, last))]
    if any(after < before + SOFT / 2.0 for before, after in pairwise(ends)):
        raise MotionError(
            f"{name}: times do not increase by {SOFT / 2.0:g} s and more, from 0 s on. Give movements in their order."
        )
    return tuple(moves)


def _moved(angle: float, moves: Moves, t: FloatArray) -> Jet:
    """An angle [rad] over time: at constant rates from one to the next, the speed rising straight over `SOFT`."""
    jet: list[Any] = [np.full_like(t, angle), np.zeros_like(t), np.zeros_like(t)]
    for first, last, target in moves:
        rate, angle = (target - angle) / (last - first), target
        for begin, sign in ((first, rate), (last, -rate)):
            x = (t - begin) / SOFT + 0.5
            y = np.clip(x, 0.0, 1.0)
            jet[0] += sign * SOFT * (0.5 * y * y + np.maximum(x - 1.0, 0.0))
            jet[1] += sign * y
            jet[2] += sign / SOFT * ((x > 0.0) & (x < 1.0))
    return Jet(*jet)
