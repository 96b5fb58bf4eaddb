"""Motions of the crane tip in closed form: still, sines, sums of them, velocity profiles, and the ramped start.

Every motion is an immutable value (equal and hashable by content) in SI units, heights positive up, and gives height,
velocity and acceleration that are exact derivatives of one another. Text with units is read by the constructors;
`from_si` takes plain SI numbers and is for code that already holds them. Recorded motion:
`stillhook.sea.motion.recorded`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray, fill
from stillhook.errors import MotionError
from stillhook.units import parse

Sample = tuple[FloatArray, FloatArray, FloatArray]

LARGEST_AMPLITUDE = 50.0  # m: no sea moves a crane tip so far; mm or km meant as m are caught here
CYCLE = 0.01  # of a PLC where none is given [s]
SHORTEST_PERIOD, LONGEST_PERIOD = 0.1, 3600.0  # s: no sea moves a ship so fast; ms or h meant as s are caught here


class Motion(ABC):
    """A vertical motion of the crane tip: height s [m], velocity v [m/s], acceleration a [m/s^2], all positive up."""

    kind: ClassVar[str]

    @property
    def duration(self) -> float | None:
        """Last time at which the motion is known [s]; None: endless."""
        return None

    @property
    def separate(self) -> bool:
        """Whether the PLC measures another motion than the tip has, before the errors that a scenario adds."""
        return False

    def measured(self, t: ArrayLike, h: float = CYCLE) -> Sample:
        """The motion as the PLC measures it, as `sample`; h: the PLC's cycle [s]."""
        return self.sample(t)

    @abstractmethod
    def sample(self, t: ArrayLike) -> Sample:
        """Height [m], velocity [m/s] and acceleration [m/s^2] at the times t [s], each with the shape of t."""

    @abstractmethod
    def describe(self) -> str:
        """The motion in words and units; `parse_motion` reads it back where a text can say it (still, sine, sums)."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts (SI) that JSON can hold; `motion_from_dict` is the way back."""

    def __add__(self, other: Motion) -> Motion:
        return Sum((self, other)) if isinstance(other, Motion) else NotImplemented

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """A model field of this type takes a finished motion only; texts go through `parse_motion` before."""
        from pydantic_core import core_schema  # here, so that motions alone start without pydantic

        as_dict = core_schema.plain_serializer_function_ser_schema(lambda motion: motion.to_dict())
        return core_schema.is_instance_schema(cls, serialization=as_dict)


@dataclass(frozen=True)
class Still(Motion):
    """A crane tip that does not move: s = v = a = 0.

    >>> import numpy as np, stillhook
    >>> stillhook.Still().sample(np.array([0.0, 9.0]))[0].tolist()
    [0.0, 0.0]
    """

    kind: ClassVar[str] = "still"

    def sample(self, t: ArrayLike) -> Sample:
        zero = np.zeros_like(np.asarray(t, dtype=np.float64))
        return zero, zero.copy(), zero.copy()

    def describe(self) -> str:
        return "still"

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind}


@dataclass(frozen=True, init=False)
class Sine(Motion):
    r"""One harmonic, endless.

    .. math:: s = A \sin(2\pi t/T + \varphi), \quad v = \dot s, \quad a = \ddot s = -(2\pi/T)^2 s

    Parameters (texts with units): period T; exactly one of `amplitude` A, from the middle to the crest, and `height`
    2 A, from trough to crest as a wave height is; phase, 0 deg by default (rising through the middle at t = 0;
    -90 deg starts at rest in the trough).
    Raises UnitError for a text without a length, time or angle, MotionError for an amplitude outside 0 to 50 m or a
    period outside 0.1 s to 1 h.

    >>> import numpy as np, stillhook
    >>> s, v, a = stillhook.Sine(amplitude="1 m", period="8 s").sample(np.array([0.0, 2.0]))
    >>> s.round(6).tolist(), v.round(6).tolist(), a.round(6).tolist()
    ([0.0, 1.0], [0.785398, 0.0], [-0.0, -0.61685])
    """

    amplitude: float
    period: float
    phase: float
    kind: ClassVar[str] = "sine"

    def __init__(
        self, *, period: str, amplitude: str | None = None, height: str | None = None, phase: str = "0 deg"
    ) -> None:
        if (amplitude is None) == (height is None):
            raise MotionError(
                f"Sine: {'neither' if amplitude is None else 'both'} of amplitude and height given. Give one: "
                'amplitude="1 m" (middle to crest) or height="2 m" (trough to crest).'
            )
        if height is None:
            A = parse(amplitude, "length", "Sine: amplitude")
        else:
            A = parse(height, "length", "Sine: height") / 2.0
        self._fill(A, parse(period, "time", "Sine: period"), parse(phase, "angle", "Sine: phase"), "Sine")

    @classmethod
    def from_si(cls, amplitude: float, period: float, phase: float = 0.0, *, where: str = "Sine") -> Self:
        """A sine from SI numbers: amplitude (middle to crest) [m], period [s], phase [rad]."""
        sine = cls.__new__(cls)
        sine._fill(float(amplitude), float(period), float(phase), where)
        return sine

    def _fill(self, A: float, T: float, phase: float, where: str) -> None:
        if not 0.0 <= A <= LARGEST_AMPLITUDE:
            raise MotionError(
                f"{where}: amplitude {A:g} m is not between 0 m and {LARGEST_AMPLITUDE:g} m. Check its unit; "
                "a sine is turned over with phase 180 deg."
            )
        if not SHORTEST_PERIOD <= T <= LONGEST_PERIOD:
            allowed = f"between {SHORTEST_PERIOD:g} s and {LONGEST_PERIOD:g} s"
            raise MotionError(f"{where}: period {T:g} s is not {allowed}. Check its unit.")
        if not math.isfinite(phase):
            raise MotionError(f"{where}: phase {phase:g} rad is not a number. Give a phase in deg or rad.")
        fill(self, amplitude=A, period=T, phase=phase)

    def sample(self, t: ArrayLike) -> Sample:
        omega = 2.0 * math.pi / self.period
        angle = omega * np.asarray(t, dtype=np.float64) + self.phase
        sine, cosine = np.sin(angle), np.cos(angle)
        return self.amplitude * sine, self.amplitude * omega * cosine, -self.amplitude * omega**2 * sine

    def describe(self) -> str:
        phase = f" {math.degrees(self.phase):.6g} deg" if self.phase else ""
        return f"sine {self.amplitude:.6g} m {self.period:.6g} s{phase}"

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "amplitude": self.amplitude, "period": self.period, "phase": self.phase}


@dataclass(frozen=True, init=False)
class Sum(Motion):
    """Motions on top of one another: s, v and a are the sums of those of the terms; known as long as every term is."""

    terms: tuple[Motion, ...]
    kind: ClassVar[str] = "sum"

    def __init__(self, terms: Iterable[Motion]) -> None:
        flat: list[Motion] = []
        for term in terms:
            if not isinstance(term, Motion):
                raise MotionError(f"Sum: {term!r} is not a motion. Give Sine, Profile, Recorded or another motion.")
            flat.extend(term.terms if isinstance(term, Sum) else (term,))
        if not flat:
            raise MotionError("Sum: no motions given. Give at least one; a tip at rest is Still().")
        fill(self, terms=tuple(flat))

    @property
    def duration(self) -> float | None:
        return min((d for term in self.terms if (d := term.duration) is not None), default=None)

    @property
    def separate(self) -> bool:
        return any(term.separate for term in self.terms)

    def sample(self, t: ArrayLike) -> Sample:
        return _added(term.sample(t) for term in self.terms)

    def measured(self, t: ArrayLike, h: float = CYCLE) -> Sample:
        return _added(term.measured(t, h) for term in self.terms)

    def describe(self) -> str:
        return " + ".join(term.describe() for term in self.terms)

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "terms": [term.to_dict() for term in self.terms]}


@dataclass(frozen=True, init=False)
class Profile(Motion):
    """A velocity that runs straight from point to point; endless, because it starts and ends at rest.

    `Profile(points=[("0 s", "0 m/min"), ("5 s", "40 m/min"), ("65 s", "40 m/min"), ("70 s", "0 m/min")])`.
    Height is the exact integral from s = 0 at t = 0; acceleration is constant between points, and at a point it is
    that of the piece that begins there. The first point is at 0 s with velocity 0, times increase strictly (a jump
    in velocity would be an endless acceleration), the last velocity is 0 and the tip stays where it then is.

    >>> import numpy as np, stillhook
    >>> lift = stillhook.Profile(points=[("0 s", "0 m/s"), ("5 s", "1 m/s"), ("10 s", "0 m/s")])
    >>> lift.sample(np.array([10.0]))[0].round(9).tolist()
    [5.0]
    """

    t: tuple[float, ...]
    v: tuple[float, ...]
    kind: ClassVar[str] = "profile"

    def __init__(self, points: Iterable[tuple[str, str]]) -> None:
        pairs = list(points)
        if not all(isinstance(p, tuple | list) and len(p) == 2 for p in pairs):
            raise MotionError('Profile: a point is not a pair. Give points as ("5 s", "40 m/min").')
        t = [parse(p[0], "time", f"Profile: time of point {i + 1}") for i, p in enumerate(pairs)]
        v = [parse(p[1], "speed", f"Profile: velocity of point {i + 1}") for i, p in enumerate(pairs)]
        self._fill(t, v)

    @classmethod
    def from_si(cls, t: Iterable[float], v: Iterable[float]) -> Self:
        """A profile from SI numbers: times [s] and velocities [m/s], positive up."""
        profile = cls.__new__(cls)
        profile._fill([float(x) for x in t], [float(x) for x in v])
        return profile

    def _fill(self, t: list[float], v: list[float]) -> None:
        if len(t) != len(v) or len(t) < 2:
            raise MotionError(f"Profile: {len(t)} times and {len(v)} velocities. Give two or more points of each.")
        if not all(math.isfinite(x) for x in (*t, *v)):
            raise MotionError("Profile: a time or velocity is not finite. Give numbers with units.")
        if t[0] != 0.0 or v[0] != 0.0:
            raise MotionError(f'Profile: starts at {t[0]:g} s with {v[0]:g} m/s. Start with ("0 s", "0 m/s").')
        for i, (before, after) in enumerate(pairwise(t)):
            if after <= before:
                raise MotionError(
                    f"Profile: point {i + 2} at {after:g} s does not come after {before:g} s. Times must increase; "
                    "give a jump in velocity its own short time."
                )
        if v[-1] != 0.0:
            raise MotionError(f"Profile: ends with {v[-1]:g} m/s. End at rest: add a last point with 0 m/s.")
        fill(self, t=tuple(t), v=tuple(v))

    def sample(self, t: ArrayLike) -> Sample:
        time = np.asarray(t, dtype=np.float64)
        knots, speeds = np.array(self.t), np.array(self.v)
        slopes = np.diff(speeds) / np.diff(knots)
        heights = np.concatenate(([0.0], np.cumsum(np.diff(knots) * (speeds[1:] + speeds[:-1]) / 2.0)))
        piece = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, len(slopes) - 1)
        moving = (time >= 0.0) & (time < knots[-1])
        x = np.where(moving, time - knots[piece], 0.0)
        a = np.where(moving, slopes[piece], 0.0)
        v = np.where(moving, speeds[piece] + a * x, 0.0)
        rest = np.where(time < 0.0, 0.0, heights[-1])
        s = np.where(moving, heights[piece] + x * (speeds[piece] + a * x / 2.0), rest)
        return s, v, a

    def describe(self) -> str:
        top = max(abs(x) for x in self.v)
        return f"velocity profile of {len(self.t)} points over {self.t[-1]:.6g} s, up to {60.0 * top:.6g} m/min"

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "t": list(self.t), "v": list(self.v)}


SHORTEST_RAMP = 1e-6
"""A ramp [s] whose acceleration, over its square, is a number yet."""


@dataclass(frozen=True, init=False)
class Ramped(Motion):
    r"""A motion that grows from nothing over a time t_r, without a step in height, velocity or acceleration.

    .. math:: s = r s_0, \quad v = \dot r s_0 + r v_0, \quad a = \ddot r s_0 + 2 \dot r v_0 + r a_0

    with the quintic smoothstep r = x^3 (10 - 15 x + 6 x^2), x = t/t_r held to [0, 1].
    """

    motion: Motion
    t_ramp: float
    kind: ClassVar[str] = "ramped"

    def __init__(self, motion: Motion, t_ramp: str) -> None:
        self._fill(motion, parse(t_ramp, "time", "Ramped: t_ramp"))

    @classmethod
    def from_si(cls, motion: Motion, t_ramp: float) -> Self:
        """A ramped motion with t_ramp [s]."""
        ramped = cls.__new__(cls)
        ramped._fill(motion, float(t_ramp))
        return ramped

    def _fill(self, motion: Motion, t_ramp: float) -> None:
        if not isinstance(motion, Motion):
            raise MotionError(f"Ramped: {motion!r} is not a motion. Give Sine, Profile, Recorded or another motion.")
        if not (math.isfinite(t_ramp) and t_ramp >= SHORTEST_RAMP):
            least = f"shorter than {SHORTEST_RAMP:g} s"
            raise MotionError(f"Ramped: t_ramp {t_ramp:g} s is {least}. Leave the ramp out for no ramp.")
        fill(self, motion=motion, t_ramp=t_ramp)

    @property
    def duration(self) -> float | None:
        return self.motion.duration

    @property
    def separate(self) -> bool:
        return self.motion.separate

    def sample(self, t: ArrayLike) -> Sample:
        return self._grown(t, self.motion.sample(t))

    def measured(self, t: ArrayLike, h: float = CYCLE) -> Sample:
        return self._grown(t, self.motion.measured(t, h))

    def _grown(self, t: ArrayLike, full: Sample) -> Sample:
        s_0, v_0, a_0 = full
        x = np.clip(np.asarray(t, dtype=np.float64) / self.t_ramp, 0.0, 1.0)
        if np.all(x == 1.0):
            return s_0, v_0, a_0  # grown to full size: nothing to do for most of a run
        r = x**3 * (10.0 + x * (6.0 * x - 15.0))
        dr = 30.0 * x**2 * (1.0 - x) ** 2 / self.t_ramp
        ddr = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / self.t_ramp**2
        return r * s_0, dr * s_0 + r * v_0, ddr * s_0 + 2.0 * dr * v_0 + r * a_0

    def describe(self) -> str:
        return f"{self.motion.describe()}, ramped up over {self.t_ramp:.6g} s"

    def to_dict(self) -> dict[str, Any]:
        return {"type": self.kind, "motion": self.motion.to_dict(), "t_ramp": self.t_ramp}


def _added(samples: Iterable[Sample]) -> Sample:
    (s, v, a), *others = samples
    for ds, dv, da in others:
        s, v, a = s + ds, v + dv, a + da
    return s, v, a
