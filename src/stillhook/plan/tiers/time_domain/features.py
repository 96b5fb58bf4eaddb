"""Largest values of the linear sea that cost no run: tip motion, speed and acceleration, and the motion of a load that
hangs from a tip that nothing compensates. Of the very waves of a run, or of very many seeds of a sea at once.

They say which of two seeds of one sea asks more of a lift; what the winch makes of that the runs say.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import scipy

from stillhook.base.arrays import ComplexArray, FloatArray, IntArray
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.tiers.situations import natural_period
from stillhook.plan.tiers.time_domain.lowering import Course, SeaState
from stillhook.response.suspended_load import suspended_load
from stillhook.sea.motion.irregular import synthesis
from stillhook.sea.vessel.realisation import Amplitudes, Realisation, realise
from stillhook.sea.vessel.tip import TipPoint
from stillhook.spec.lift.phase import Phase
from stillhook.variables import WINDOW

SAMPLES = 4.0
"""Samples for each second of a series [1/s], at the least: peaks of waves of 4 s and longer are right to 0.3 %."""
DAMPING = 0.1
"""Damping ratio of the load on its wire in the linear motion, some of the drag at limiting motions."""
NAMES = ("tip speed", "tip speed down", "tip motion", "tip acceleration", "load motion")


@dataclass(frozen=True, eq=False)
class Waves:
    """Harmonics of a sea: omega (h,) [rad/s], their numbers (h,), and the standard deviation of each of the two parts
    of the tip's height in them for each metre of the sea's (h,) [-]."""

    omega: FloatArray = field(repr=False)
    harmonic: IntArray = field(repr=False)
    tip: FloatArray = field(repr=False)


@dataclass(frozen=True)
class Place:
    """What features follow from: the vessel's tip in a phase, period of the waves and the part of a run that counts
    [s], natural period of the load [s]."""

    plan: LiftPlan
    at: TipPoint
    repeat: float
    begin: float
    counted: float
    T_0: float

    @classmethod
    def of(cls, plan: LiftPlan, phase: Phase, course: Course) -> Place:
        """That of a phase that is run so; the first window of a peak to peak reaches back before what counts."""
        counts = sum(each.time or 0.0 for each in course.programme[: course.counts])
        begin = max(counts - WINDOW, 0.0)
        hangs = suspended_load(plan.crane, plan.hanging(course.z_0), course.z_0)
        lasts = counts + course.counted - begin
        return cls(plan, plan.tip_of(phase), course.duration, begin, lasts, natural_period(hangs))

    @property
    def key(self) -> tuple[object, ...]:
        """What features of one plan follow from: winches that are run alike share them."""
        return self.at, self.repeat, self.begin, self.counted, self.T_0

    def of_seed(self, spot: SeaState, seed: int) -> dict[str, float]:
        """Features of the waves of one run: name -> value [SI]."""
        waves = self._waves(spot, seed, Amplitudes.RAYLEIGH)
        tip = np.sum(self._vertical(waves) * waves.a, axis=0)
        return {name: float(x[0]) for name, x in self._largest(waves, tip[None]).items()}

    def each_metre(self, spot: SeaState) -> Waves:
        """The tip's motion in a sea for each metre of its height; one in all seas of one shape."""
        waves = self._waves(spot, 0, Amplitudes.FIXED)
        tip = np.sqrt(0.5 * np.sum(np.abs(self._vertical(waves) * waves.a) ** 2, axis=0)) / spot.Hs
        return Waves(waves.omega, waves.harmonic, tip)

    def of_many(self, waves: Waves, count: int, seed: int) -> dict[str, FloatArray]:
        """Features of `count` seeds for each metre of height: name -> (count,)."""
        parts = np.random.default_rng(seed).standard_normal((2, count, len(waves.tip)))
        return self._largest(waves, waves.tip * (parts[0] + 1j * parts[1]))

    def _waves(self, spot: SeaState, seed: int, law: Amplitudes) -> Realisation:
        sea = self.plan.environment.sea(*spot)
        return realise(sea, self.repeat, seed, amplitudes=law, depth=self.plan.depth)

    def _vertical(self, waves: Realisation) -> ComplexArray:
        return self.plan.vessel.vertical(waves.omega, waves.beta, self.at.x, self.at.y)

    def _largest(self, waves: Realisation | Waves, tip: ComplexArray) -> dict[str, FloatArray]:
        """Features of complex amplitudes of the tip's height (n, harmonics)."""
        omega, last = waves.omega, int(waves.harmonic[-1])
        n = scipy.fft.next_fast_len(math.ceil(max(SAMPLES * self.repeat, 2 * last + 2)), real=True)
        dt = self.repeat / n
        counts = slice(math.floor(self.begin / dt), min(math.ceil((self.begin + self.counted) / dt) + 1, n))

        def series(c: ComplexArray) -> FloatArray:
            bins = np.zeros((len(c), last + 1), dtype=np.complex128)
            bins[:, waves.harmonic] = c
            return synthesis(bins, n)[:, counts]

        speed, motion = series(1j * omega * tip), series(tip)
        r = omega * self.T_0 / (2.0 * math.pi)
        load = series(tip / (1.0 - r**2 + 2j * DAMPING * r))
        return dict(
            zip(
                NAMES,
                (
                    np.abs(speed).max(axis=1),
                    (-speed).max(axis=1),
                    _span(motion, dt),
                    np.abs(series(-(omega**2) * tip)).max(axis=1),
                    _span(load, dt),
                ),
                strict=True,
            )
        )


def _span(x: FloatArray, dt: float) -> FloatArray:
    """Largest difference of highest and lowest value of rows (n, k) within a window."""
    size = min(max(round(WINDOW / dt), 1), x.shape[1])
    spread = scipy.ndimage.maximum_filter1d(x, size, axis=1) - scipy.ndimage.minimum_filter1d(x, size, axis=1)
    return np.asarray(spread.max(axis=1))


Features = Mapping[str, FloatArray]
"""Feature -> values of the runs of a cell (n,)."""
