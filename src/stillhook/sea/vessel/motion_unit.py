"""The motion unit of a crane: where it is, its heave filter, its delay and noise, and how the PLC turns its signals."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

import numpy as np

from stillhook.base.arrays import FloatArray, fill
from stillhook.errors import MotionError
from stillhook.physics.tip_kinematics import Attitude, FilterMemory, Jet, filter_step, filtered
from stillhook.sea.vessel.ship_motion import Offset, offset
from stillhook.units import parse, quote

EXACT, SMALL = "exact", "small-angle"
HEAVE_PERIOD, HEAVE_DAMPING = "25 s", 0.7
"""Corner of the heave filter, and its damping, where a user asks for a filter without data: assumed. Motion units have
both as settings; a corner of 20 to 30 s is usual in swell, shorter in wind sea."""
SHORTEST, LONGEST = 2.0, 1000.0  # s: corners of heave filters that there are
STEP = 0.05
"""Between stored states of the filter [s]; RK4 is then right to 1e-9 of the heave at a corner of 25 s."""
SETTLE = 10.0
"""Corner periods for which the filter ran before t = 0 where the motion is known then: what is left of its start is
below 1e-15 at a damping of 0.7."""
BLOCK = 4096  # samples of noise, and states of the filter, made at once
ENDLESS = 2**40
RATE = 100.0  # samples of noise a second [1/s]
LARGEST_DELAY = 2.0  # s
NOISES = {"noise_heave": "length", "noise_speed": "speed", "noise_angle": "angle", "noise_rate": "rotation"}


@dataclass(frozen=True, init=False)
class MotionUnit:
    """A motion reference unit, ideal by default.

    at: from the point whose motion is given to the unit, forward, to port and up. heave_period: corner of its
    second-order high-pass on heave, None for none; roll and pitch pass as they are. heave_damping: of that filter [-].
    delay: by which all of its signals are late. noise_heave, noise_speed, noise_angle, noise_rate: standard deviations
    of white noise, a hundred values a second, on heave, its speed, roll and pitch, and their rates (per second, as
    "0.01 rad/s"). seed: of that noise. rotations: whether the PLC turns the lever "exact" or "small-angle".
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
        noise_rate: str = "0 rad/s",
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

    def to_dict(self) -> dict[str, Any]:
        """Numbers in SI; `from_dict` is the way back."""
        return {name: list(x) if isinstance(x, tuple) else x for name, x in vars(self).items()}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """The unit whose `to_dict` gave this."""
        unit = cls.__new__(cls)
        unit._fill(**{**data, "at": tuple(float(x) for x in data["at"])})
        return unit


class Signals:
    """What a motion unit gives over time, from the attitude at its place as a function of time, known up to a duration
    [s] (None: endless)."""

    def __init__(self, unit: MotionUnit, true: Callable[[FloatArray], Attitude], duration: float | None) -> None:
        self._unit, self._true = unit, true
        self._begin = self._earliest()
        self._nodes = ENDLESS if duration is None else math.floor((duration - self._begin) / STEP) + 1
        heave = true(np.array([self._begin])).heave
        self._states = np.array([[float(heave.x[0])], [float(heave.v[0])]])  # type: ignore[index]
        self._noise = np.empty((6, 0))

    def _earliest(self) -> float:
        """Where the filter begins [s], at rest: before t = 0 if the motion is known then."""
        period = self._unit.heave_period
        if period is None:
            return 0.0
        begin = -math.ceil(SETTLE * period / STEP) * STEP
        try:
            self._true(np.array([begin]))
        except MotionError:
            return 0.0
        return begin

    def at(self, t: FloatArray) -> Attitude:
        """Heave, roll and pitch as the unit gives them at the times t [s]; before the start as at the start."""
        unit = self._unit
        late = np.maximum(t - unit.delay, 0.0)
        true = self._true(late)
        heave = true.heave
        if unit.heave_period is not None:
            node = np.floor((late - self._begin) / STEP).astype(np.intp)
            self._extend(int(node.max()))
            m = FilterMemory(*self._states[:, node])
            from_node = self._begin + node * STEP
            before = self._true(np.minimum(from_node, late)).heave
            step = np.maximum(late - from_node, 1e-9)  # at a node the cubic between is not needed
            m = filter_step(m, before, heave, step, unit.omega, unit.heave_damping)
            heave = filtered(heave, m, unit.omega, unit.heave_damping)
        if not unit.noisy:
            return Attitude(heave, true.roll, true.pitch)
        n = self._noise_of(np.floor(np.maximum(t, 0.0) * RATE + 1e-6).astype(np.intp))
        jets, turn = (heave, true.roll, true.pitch), (unit.noise_angle, unit.noise_rate)
        sizes = ((unit.noise_heave, unit.noise_speed), turn, turn)
        pairs = zip(jets, sizes, n.reshape(3, 2, -1), strict=True)
        return Attitude(*(Jet(p.x + x * k[0], p.v + v * k[1], p.a) for p, (x, v), k in pairs))

    def _extend(self, node: int) -> None:
        """Make the filter's states up to a node: they follow from those before, so that pieces change nothing."""
        have = self._states.shape[1]
        if node < have:
            return
        count = max(node + 1, min(have + BLOCK, self._nodes))
        heave = self._true(self._begin + np.arange(have - 1, count) * STEP).heave
        omega, zeta, states = self._unit.omega, self._unit.heave_damping, [FilterMemory(*self._states[:, -1].tolist())]
        for p, q in pairwise(np.column_stack(heave).tolist()):
            states.append(filter_step(states[-1], Jet(*p), Jet(*q), STEP, omega, zeta))
        self._states = np.hstack([self._states, np.array(states[1:]).T])

    def _noise_of(self, i: FloatArray) -> FloatArray:
        while self._noise.shape[1] <= int(i.max()):
            block = self._noise.shape[1] // BLOCK
            made = np.random.default_rng([self._unit.seed, block]).standard_normal((6, BLOCK))
            self._noise = np.hstack([self._noise, made])
        return self._noise[:, i]
