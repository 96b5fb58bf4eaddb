"""The motion unit of a crane: where it is, its heave filter, its delay and noise, and how the PLC turns its signals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, Self

import numpy as np

from stillhook.base.arrays import FloatArray, fill
from stillhook.errors import MotionError
from stillhook.physics.tip_kinematics import Attitude, FilterMemory, Jet, between, filter_step, filtered
from stillhook.sea.motion.motion import CYCLE
from stillhook.sea.vessel.ship_motion import Offset, offset
from stillhook.units import parse, quote

EXACT, SMALL = "exact", "small-angle"
HEAVE_PERIOD, HEAVE_DAMPING = "25 s", 0.7
"""Corner of the heave filter, and its damping, where a user asks for a filter without data: assumed. Motion units have
both as settings; a corner of 20 to 30 s is usual in swell, shorter in wind sea."""
SHORTEST, LONGEST = 2.0, 1000.0  # s: corners of heave filters that there are
ROUNDING = 1e-6
"""Part of a cycle by which a time may deviate from one and still be it."""
SETTLE = 10.0
"""Corner periods for which the filter ran before t = 0 where the motion is known then: what is left of its start is
below 1e-15 at a damping of 0.7."""
BLOCK = 4096  # samples of noise, and states of the filter, made at once
KEPT = 8  # blocks of states that are not made again
ENDLESS = 2**40
RATE = 100.0  # samples of noise a second [1/s]
LARGEST_DELAY = 2.0  # s
NOISES = {"noise_heave": "length", "noise_speed": "speed", "noise_angle": "angle", "noise_rate": "angle_rate"}


@dataclass(frozen=True, init=False)
class MotionUnit:
    """A motion reference unit, ideal by default.

    at: from the point whose motion is given to the unit, forward, to port and up. heave_period: corner of its
    second-order high-pass on heave, None for none; roll and pitch pass as they are. heave_damping: of that filter [-].
    delay: by which all of its signals are late. noise_heave, noise_speed, noise_angle, noise_rate: standard deviations
    of white noise, a hundred values a second, on heave, its speed, roll and pitch, and their rates (per second, as
    "0.1 deg/s"). seed: of that noise. rotations: whether the PLC turns the lever "exact" or "small-angle".
    Texts with units in, SI kept. Errors: MotionError, UnitError.

    >>> import math, stillhook
    >>> unit = stillhook.MotionUnit(heave_period="25 s")
    >>> round(abs(complex(unit.response(2.0 * math.pi / 14.0))), 3)
    0.96
    """

    at: tuple[float, float, float]
    heave_period: float | None
    heave_damping: float
    delay: float
    noise_heave: float
    noise_speed: float
    noise_angle: float
    noise_rate: float
    seed: int
    rotations: str

    def __init__(
        self,
        *,
        at: Offset = ("0 m", "0 m", "0 m"),
        heave_period: str | None = None,
        heave_damping: float = HEAVE_DAMPING,
        delay: str = "0 s",
        noise_heave: str = "0 m",
        noise_speed: str = "0 m/s",
        noise_angle: str = "0 deg",
        noise_rate: str = "0 deg/s",
        seed: int = 0,
        rotations: str = EXACT,
    ) -> None:
        period = None if heave_period is None else parse(heave_period, "time", "unit: heave_period")
        texts = zip(NOISES.items(), (noise_heave, noise_speed, noise_angle, noise_rate), strict=True)
        noise = {name: parse(text, kind, f"unit: {name}") for (name, kind), text in texts}
        place, late = offset(at, "unit: at"), parse(delay, "time", "unit: delay")
        self._fill(at=place, heave_period=period, heave_damping=heave_damping, delay=late, **noise)
        fill(self, seed=seed, rotations=rotations)
        if rotations not in (EXACT, SMALL):
            raise MotionError(f"unit: rotations = {quote(rotations)}: choose {EXACT} or {SMALL}.")
        if type(seed) is not int or seed < 0:
            raise MotionError(f"unit: seed = {quote(seed)}: give a whole number from 0.")

    def _fill(self, **values: Any) -> None:
        fill(self, **values)
        T, damping = self.heave_period, self.heave_damping
        if T is not None and not SHORTEST <= T <= LONGEST:
            raise MotionError(
                f"unit: heave_period {T:g} s is not between {SHORTEST:g} s and {LONGEST:g} s. Check its unit; leave it"
                " out for heave that is not filtered."
            )
        if type(damping) not in (int, float) or not 0.1 <= damping <= 2.0:
            raise MotionError(f"unit: heave_damping {quote(damping)} is not between 0.1 and 2. Usual is 0.7.")
        if not 0.0 <= self.delay <= LARGEST_DELAY:
            raise MotionError(f"unit: delay {self.delay:g} s is not between 0 s and {LARGEST_DELAY:g} s.")
        for name in NOISES:
            if getattr(self, name) < 0.0:
                raise MotionError(f"unit: {name} {getattr(self, name):g} is negative. Give a standard deviation.")

    @property
    def omega(self) -> float:
        """Corner of the heave filter [rad/s], 0 for none."""
        return 2.0 * math.pi / self.heave_period if self.heave_period else 0.0

    @property
    def noisy(self) -> bool:
        """Whether it adds noise."""
        return any(getattr(self, name) for name in NOISES)

    @property
    def passes(self) -> bool:
        """Whether its signals are the motion as it is."""
        return self.heave_period is None and self.delay == 0.0 and not self.noisy

    @property
    def exact(self) -> float:
        """1 where the PLC turns the lever in full."""
        return float(self.rotations == EXACT)

    def response(self, omega: FloatArray) -> FloatArray:
        r"""Measured over true heave at frequencies [rad/s], complex: filter and delay.

        .. math:: H = \frac{-\omega^2}{\omega_c^2 - \omega^2 + 2i\zeta\omega_c\omega}\,e^{-i\omega\tau}
        """
        w, w_c = np.asarray(omega, dtype=np.float64), self.omega
        H = -(w**2) / (w_c**2 - w**2 + 2j * self.heave_damping * w_c * w)
        result: FloatArray = H * np.exp(-1j * w * self.delay)
        return result

    def describe(self) -> str:
        """The unit in words."""
        heave = f"heave filter {self.heave_period:g} s, damping {self.heave_damping:g}" if self.heave_period else ""
        late = f"{1e3 * self.delay:g} ms late" if self.delay else ""
        parts = (heave, late, "with noise" if self.noisy else "", f"{self.rotations} rotations")
        return f"motion unit: {', '.join(filter(None, parts))}"

    @property
    def note(self) -> str:
        """What a reader of a lift with its heave filter should know."""
        corner = f"{self.heave_period or 0.0:g} s, damping {self.heave_damping:g}"
        return f"heave filter of the motion unit, corner {corner}: the heave that it loses is not compensated"

    def to_dict(self) -> dict[str, Any]:
        """Numbers in SI; `from_dict` is the way back."""
        return {name: list(x) if isinstance(x, tuple) else x for name, x in vars(self).items()}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """The unit whose `to_dict` gave this."""
        unit = cls.__new__(cls)
        unit._fill(**{**data, "at": tuple(float(x) for x in data["at"])})
        return unit


class Memory(NamedTuple):
    """What a unit keeps of a motion that comes cycle by cycle: number k of the last cycle; heave there (3), what the
    filter took of it (2), and what it gave without noise in the last cycles (9 each), oldest first."""

    k: int
    numbers: FloatArray


class Signals:
    """What a motion unit gives, from the attitude at its place as a function of time, known up to a duration [s] (None:
    endless). It follows from the attitude at the PLC's cycles, h apart [s], on a quintic between two of them, so that
    an attitude that comes cycle by cycle gives the same."""

    def __init__(
        self, unit: MotionUnit, true: Callable[[FloatArray], Attitude], duration: float | None, h: float = CYCLE
    ) -> None:
        self._unit, self._true, self._h = unit, true, h
        self._end = math.inf if duration is None else duration
        self._last = ENDLESS if duration is None else max(math.floor(duration / h + ROUNDING), 1)
        self._late = math.ceil(unit.delay / h - ROUNDING)
        part = self._late - unit.delay / h
        self._part = part if part > ROUNDING else 0.0
        self._begin = self._earliest()
        heave = self._at(np.array([self._begin])).heave
        self._starts = [FilterMemory(float(heave.x[0]), float(heave.v[0]))]  # type: ignore[index]
        self._blocks: dict[int, FloatArray] = {}

    @property
    def places(self) -> int:
        """Numbers of its `Memory`, none where it passes the motion."""
        return 0 if self._unit.passes else 5 + 9 * (self._late + 1)

    def _at(self, i: Any) -> Attitude:
        """The attitude at cycles i."""
        t = i * self._h
        return self._true(np.where(t <= self._end + ROUNDING * self._h, np.minimum(t, self._end), t))

    def _earliest(self) -> int:
        """Cycle where the filter begins, at rest: before t = 0 if the motion is known then."""
        period = self._unit.heave_period
        if period is None:
            return 0
        begin = -math.ceil(SETTLE * period / self._h)
        try:
            self._at(np.array([begin]))
        except MotionError:
            return 0
        return begin

    def at(self, t: FloatArray) -> Attitude:
        """Heave, roll and pitch as the unit gives them at the times t [s]; before the start as at the start."""
        unit, h = self._unit, self._h
        if unit.heave_period is None and unit.delay == 0.0:
            return self._noisy(self._true(np.maximum(t, 0.0)), t)
        k = np.floor(t / h + ROUNDING)
        x = np.maximum(t / h - k, 0.0)
        x = np.where(x > ROUNDING, x, 0.0) + self._part
        k, x = k - self._late + (x >= 1.0), x - (x >= 1.0)
        k, x = np.where(k < 0.0, 0.0, k), np.where(k < 0.0, 0.0, x)
        first: FloatArray = np.where(x > 0.0, np.minimum(k, self._last - 1), k)
        x += k - first
        result = self._clean(first)
        if x.any():
            after = self._clean(np.where(x > 0.0, first + 1, first))
            result = Attitude(*(between(p, q, h, x) for p, q in zip(result, after, strict=True)))
        return self._noisy(result, t)

    def begin(self, k: int) -> Memory:
        """What the unit keeps at cycle k of its own motion."""
        i = np.array([k])
        past = np.column_stack(self._columns(self._clean(np.maximum(np.arange(k - self._late, k + 1), 0))))
        return Memory(k, np.concatenate([*self._at(i).heave, *self._taken(i), past.ravel()]))

    def following(self, before: Memory, true: Attitude) -> tuple[Attitude, Memory]:
        """What the unit gives a cycle later, where the attitude at its place is `true` (arrays of one), and keeps."""
        unit, numbers = self._unit, before.numbers
        k, clean, taken = before.k + 1, true, FilterMemory(*numbers[3:5])
        if unit.heave_period is not None:
            heave, m = Jet(*np.concatenate(true.heave).tolist()), FilterMemory(*numbers[3:5].tolist())
            taken = filter_step(m, Jet(*numbers[:3].tolist()), heave, self._h, unit.omega, unit.heave_damping)
            clean = true._replace(heave=filtered(true.heave, taken, unit.omega, unit.heave_damping))
        past = np.concatenate([numbers[5 + 9 :], *self._columns(clean)])
        made = Memory(k, np.concatenate([*true.heave, [*taken], past]))
        result = self._attitude(past[:9, None])
        if self._part and k >= self._late:
            after = self._attitude(past[9:18, None])
            result = Attitude(*(between(p, q, self._h, self._part) for p, q in zip(result, after, strict=True)))
        return self._noisy(result, np.array([k * self._h])), made

    @staticmethod
    def _columns(attitude: Attitude) -> list[FloatArray]:
        return [x for jet in attitude for x in jet]  # type: ignore[misc]

    @staticmethod
    def _attitude(rows: FloatArray) -> Attitude:
        return Attitude(*(Jet(*jet) for jet in rows.reshape(3, 3, -1)))

    def _clean(self, i: Any) -> Attitude:
        """What the unit gives of cycles i, without delay and noise."""
        true, unit = self._at(i), self._unit
        if unit.heave_period is None:
            return true
        return true._replace(heave=filtered(true.heave, FilterMemory(*self._taken(i)), unit.omega, unit.heave_damping))

    def _taken(self, i: Any) -> FloatArray:
        """What the filter took of cycles i, (2, n)."""
        out = np.zeros((2, len(i)))
        if self._unit.heave_period is not None:
            block, inside = np.divmod(np.asarray(i - self._begin, dtype=np.intp), BLOCK)
            for b in np.unique(block).tolist():
                out[:, block == b] = self._block(b)[:, inside[block == b]]
        return out

    def _block(self, b: int) -> FloatArray:
        """The filter's states of a block: they follow from those before, so that pieces change nothing."""
        while b >= len(self._starts):
            self._block(len(self._starts) - 1)
        if b not in self._blocks:
            first = self._begin + b * BLOCK
            i = np.arange(first, min(first + BLOCK, self._last) + 1)
            omega, zeta, states = self._unit.omega, self._unit.heave_damping, [self._starts[b]]
            for p, q in pairwise(np.column_stack([*self._at(i).heave]).tolist()):
                states.append(filter_step(states[-1], Jet(*p), Jet(*q), self._h, omega, zeta))
            if b + 1 == len(self._starts) and len(states) > BLOCK:
                self._starts.append(states[BLOCK])
            if len(self._blocks) == KEPT:
                del self._blocks[next(iter(self._blocks))]
            self._blocks[b] = np.array(states).T
        return self._blocks[b]

    def _noisy(self, clean: Attitude, t: FloatArray) -> Attitude:
        unit = self._unit
        if not unit.noisy:
            return clean
        n = noise((unit.seed,), 6, np.floor(np.maximum(t, 0.0) * RATE + ROUNDING).astype(np.intp))
        turn = (unit.noise_angle, unit.noise_rate)
        pairs = zip(clean, ((unit.noise_heave, unit.noise_speed), turn, turn), n.reshape(3, 2, -1), strict=True)
        return Attitude(*(Jet(p.x + x * k[0], p.v + v * k[1], p.a) for p, (x, v), k in pairs))


def noise(seeds: tuple[int, ...], rows: int, i: FloatArray) -> FloatArray:
    """Values number i (n,) of white noise of deviation 1, (rows, n): the same however they are asked for."""
    block, inside = np.divmod(i, BLOCK)
    out = np.empty((rows, len(i)))
    for b in np.unique(block).tolist():
        out[:, block == b] = _noise_block((*seeds, b), rows)[:, inside[block == b]]
    return out


@lru_cache(maxsize=32)
def _noise_block(seeds: tuple[int, ...], rows: int) -> FloatArray:
    return np.random.default_rng(list(seeds)).standard_normal((rows, BLOCK))
