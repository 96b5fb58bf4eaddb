"""Vertical motion of the crane tip in a sea: response spectra, their moments, and how far it goes in a time.

Largest values of the tip's motion met in many realisations of one sea, and the distribution that they follow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.errors import SeaError
from stillhook.sea.motion.irregular import synthesis
from stillhook.sea.motion.motion import Motion
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import Rao, VerticalMotion
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.sea.vessel.ship_motion import mean_zero_crossing_period
from stillhook.statistics.extremes import FEWEST_MAXIMA, MPM, P90, gumbel, largest

STEP = 2e-3  # rad/s: integrals over the response take steps no coarser than this
SAMPLING = 0.05  # s: of motions in time
NOTHING = 5e-5  # parts of a variance that are not worth a line
OPEN = 0.005  # part of the motion that a table may leave open between its frequencies without a line
EDGE = 5.0  # s: nearer to its ends a recorded motion is not right
SPACING = 0.2  # rad: turn of the fastest wave from sample to sample; one of half its frequency loses 0.1 % of its crest
MOST_SEEDS = 1000
NAMES = ("z", "v", "a")
LEVELS = {"mpm": MPM, "p90": P90}


@dataclass(frozen=True, eq=False)
class TipResponse:
    """Vertical motion of a crane tip in a sea, linear and Gaussian.

    omega (n,) rising [rad/s]; weight (n,) [rad/s], with which sums over omega are integrals; S_wave, S (n,) one-sided
    densities of the sea's surface and of the tip's height [m^2 s/rad]; S_end (n,) that of the height beyond the
    vessel's table if its last value stayed there, 0 within it; omega_table first and last frequency of the table
    [rad/s].
    """

    omega: FloatArray = field(repr=False)
    weight: FloatArray = field(repr=False)
    S_wave: FloatArray = field(repr=False)
    S: FloatArray = field(repr=False)
    S_end: FloatArray = field(repr=False)
    omega_table: tuple[float, float]

    def moment(self, n: int) -> float:
        """m_n of the tip's height [m^2 rad^n/s^n]; the table's end makes all of them finite."""
        return float(np.sum(self.weight * self.omega**n * self.S))

    @property
    def sigma_z(self) -> float:
        """Standard deviation of the height [m]."""
        return math.sqrt(self.moment(0))

    @property
    def sigma_v(self) -> float:
        """Standard deviation of the speed [m/s]."""
        return math.sqrt(self.moment(2))

    @property
    def sigma_a(self) -> float:
        """Standard deviation of the acceleration [m/s^2]."""
        return math.sqrt(self.moment(4))

    @property
    def T_z(self) -> float:
        """Mean time between upward crossings of the mean, 2 pi sigma_z/sigma_v [s]; NaN where nothing moves."""
        return _period(self.sigma_z, self.sigma_v)

    @property
    def T_p(self) -> float:
        """Period at which the density of the height over omega is highest [s]; NaN where nothing moves."""
        i = int(np.argmax(self.S))
        return 2.0 * math.pi / float(self.omega[i]) if self.S[i] > 0.0 else math.nan

    @property
    def bandwidth(self) -> float:
        """sqrt(1 - m_2^2/(m_0 m_4)): 0 for one period alone, towards 1 for many; NaN where nothing moves."""
        m_0, m_2, m_4 = (self.moment(n) for n in (0, 2, 4))
        return math.sqrt(max(0.0, 1.0 - m_2**2 / (m_0 * m_4))) if m_0 * m_4 > 0.0 else math.nan

    @property
    def sigma_a_beyond(self) -> float:
        """Standard deviation of the acceleration that waves beyond the table would add, in squares, if its last value
        stayed [m/s^2]."""
        return math.sqrt(float(np.sum(self.weight * self.omega**4 * self.S_end)))

    @property
    def share_beyond(self) -> float:
        """Part of the variance of the sea in waves shorter than the table has; they are taken to cause no motion."""
        return self._share(self.S_wave, self.omega > self.omega_table[1])

    @property
    def share_below(self) -> float:
        """Part of the variance of the tip's height by waves longer than the table has, in which the vessel follows."""
        return self._share(self.S, self.omega < self.omega_table[0])

    def _share(self, S: FloatArray, where: NDArray[np.bool_]) -> float:
        total = float(np.sum(self.weight * S))
        return float(np.sum((self.weight * S)[where])) / total if total > 0.0 else 0.0

    def statistics(self, duration: float) -> dict[str, float]:
        """Numbers of the motion, and the largest of a time [s]: most probable maximum and the level that 90 % of such
        times stay below.

        Maxima are above the mean alone, of height, speed and acceleration each with its own mean period. Errors:
        SeaError for a duration shorter than a few waves.
        """
        m_6 = float(np.sum(self.weight * self.omega**6 * self.S))
        numbers = {n: getattr(self, n) for n in ("sigma_z", "sigma_v", "sigma_a", "T_z", "T_p", "bandwidth")}
        return numbers | _largest((self.sigma_z, self.sigma_v, self.sigma_a, math.sqrt(m_6)), duration)


def tip_response(rao: VerticalMotion, sea: Sea, x: float, y: float) -> TipResponse:
    r"""Spectra of the vertical motion of a crane tip over (x, y) [m] from the RAO's reference point, forward and to
    port.

    .. math:: S_z(\omega) = \sum_{trains} S(\omega) \sum_j w_j |H_3 + y H_4 - x H_5|^2(\omega, \beta_j)

    Trains are independent of one another, and so are the directions of a short-crested one, with shares w_j of its
    variance. What the sea has beyond the vessel's table is left out of S and reported by `share_beyond` and
    `sigma_a_beyond`.
    """
    return tip_responses(rao, sea, x, y, np.zeros(1))[0]


def tip_responses(rao: VerticalMotion, sea: Sea, x: float, y: float, turns: FloatArray) -> list[TipResponse]:
    """The same with the sea turned about the ship by each of some angles (n,) [rad, counter-clockwise]."""
    edges = _edges(sea, rao)
    omega, weight = (edges[1:] + edges[:-1]) / 2.0, np.diff(edges)
    trains = [(train.spectrum.density(omega), *train.directions()) for train in sea.trains]
    angles = np.concatenate([(turns[:, None] + beta).ravel() for _, beta, _ in trains])
    used, place = np.unique(np.round(angles % (2.0 * math.pi), 12), return_inverse=True)
    power = np.abs(rao.vertical(omega, used, x, y)) ** 2
    power_end = np.abs(rao.vertical(rao.omega[-1:], used, x, y)) ** 2 * (omega > rao.omega[-1])
    S_wave = np.sum([density for density, _, _ in trains], axis=0)
    S, S_end = np.zeros((len(turns), len(omega))), np.zeros((len(turns), len(omega)))
    at = 0
    for density, beta, share in trains:
        rows = place[at : at + len(turns) * len(beta)].reshape(len(turns), len(beta))
        at += rows.size
        for i, row in enumerate(rows):
            S[i] += density * (share @ power[row])
            S_end[i] += density * (share @ power_end[row])
    table = (float(rao.omega[0]), float(rao.omega[-1]))
    return [TipResponse(omega, weight, S_wave, S[i], S_end[i], table) for i in range(len(turns))]


def tip_summary(rao: Rao, sea: Sea, at: TipPoint, duration: float) -> dict[str, Any]:
    """What there is to say of a tip in a sea, in SI and with the names of `stillhook.variables`; duration [s] is that
    of the extremes."""
    response = tip_response(rao, sea, at.x, at.y)
    T_p = sea.trains[0].spectrum.peak_period
    if len(sea.trains) > 1:
        T_p = 2.0 * math.pi / float(response.omega[np.argmax(response.S_wave)])
    where = {"x": at.x, "y": at.y} | ({} if at.z is None else {"z": at.z})
    leeway = rao.leeway(at.x, at.y)
    open_by = f"that leaves {leeway:.1%} of the motion open, either way"
    between = [f"The vessel's table says nothing between its frequencies: {open_by}."] if leeway > OPEN else []
    notes = [*_table_notes(response), *between, *rao.notes]
    waves = {"H_m0": sea.H_m0, "T_p": T_p, "text": sea.describe()}
    top = {"vessel": rao.name, "at": where, "sea": waves, "duration": duration}
    return top | tip_numbers(response, duration) | {"leeway": leeway, "notes": notes}


def tip_numbers(response: TipResponse, duration: float) -> dict[str, float]:
    """The numbers among them."""
    limits = dict(zip(("omega_first", "omega_last"), response.omega_table, strict=True))
    limits |= {name: getattr(response, name) for name in ("share_below", "share_beyond", "sigma_a_beyond")}
    return {**response.statistics(duration), **limits}


def _table_notes(response: TipResponse) -> list[str]:
    """Where the vessel's table ends, and what is beyond."""
    first, last = response.omega_table
    with_end = math.hypot(response.sigma_a, response.sigma_a_beyond)
    more = with_end / response.sigma_a - 1.0 if response.sigma_a > 0.0 else 0.0
    edge = response.share_beyond > NOTHING or more > NOTHING
    notes = edge * [
        f"The vessel's table ends at a period of {2.0 * math.pi / last:.4g} s. Shorter waves,"
        f" {response.share_beyond:.2%} of the sea's variance, are taken to cause no motion; if its last value stayed,"
        f" sigma_a would be {with_end:.4g} m/s^2 in place of {response.sigma_a:.4g} (+{more:.2%})."
    ]
    if more > 0.01:
        notes.append(
            "Caution: more than 1 % of sigma_a depends on waves shorter than the table has. Use a vessel file with"
            " shorter periods."
        )
    if response.share_below > 1e-3:
        notes.append(
            f"{response.share_below:.2%} of the tip's variance is by waves longer than the {2.0 * math.pi / first:.4g}"
            " s at which the vessel's table begins: there it is taken to follow the water."
        )
    return notes


def _edges(sea: Sea, rao: VerticalMotion) -> FloatArray:
    """Edges of cells [rad/s] that resolve sea and vessel: bands of the one, frequencies of the other, within its table
    steps of STEP."""
    low = min(float(train.spectrum.grid()[0]) for train in sea.trains) / 2.0
    high = max(train.spectrum.omega_cut for train in sea.trains)
    spectra = [train.spectrum for train in sea.trains]
    bands = [s.grid() + side * s.weights() / 2.0 for s in spectra for side in (-1.0, 1.0)]
    marks = np.concatenate([*bands, rao.omega, np.arange(low, min(high, rao.omega[-1]), STEP)])
    return np.unique(np.concatenate((marks[(marks > low) & (marks < high)], [low, high])))


def motion_statistics(motion: Motion, duration: float) -> dict[str, float]:
    """The same numbers of a motion in time, such as a log of a motion sensor, over all of it but its first and last
    EDGE seconds.

    About the mean height. T_z by counting crossings (`T_z_counted`) next to that of the deviations; the largest that
    was met (z_max, v_max, a_max: magnitudes) next to the largest that is to be expected in `duration` [s] if the
    motion is Gaussian and continues like this.
    Errors: SeaError for a motion without end, shorter than ten waves, or at rest.
    """
    end = motion.duration
    if end is None or end < 2.0 * EDGE + 60.0:
        allowed = "statistics take a motion of 70 s or longer that has an end"
        raise SeaError(f"{motion.describe()}: {allowed}. Give a longer record.")
    t = np.arange(EDGE, end - EDGE, SAMPLING)
    s, v, a = motion.sample(t)
    s = s - s.mean()
    sigma = (float(s.std()), float(v.std()), float(a.std()), float(np.diff(a).std()) / SAMPLING)
    counted = mean_zero_crossing_period(t, s)
    if sigma[0] <= 0.0 or counted is None:
        raise SeaError(f"{motion.describe()}: does not move up and down. Give a record of a ship in waves.")
    numbers = dict(zip(("sigma_z", "sigma_v", "sigma_a"), sigma[:3], strict=True))
    numbers |= {"T_z": _period(sigma[0], sigma[1]), "T_z_counted": counted}
    extremes = {f"{name}_max": float(np.abs(x).max()) for name, x in zip(NAMES, (s, v, a), strict=True)}
    return {**numbers, **extremes, **_largest(sigma, duration)}


def _largest(sigma: tuple[float, float, float, float], duration: float) -> dict[str, float]:
    """Most probable maximum and 90 % level of height, speed and acceleration, from deviations of each and the next."""
    if sigma[0] <= 0.0:
        return {f"{name}_{level}": 0.0 for name in NAMES for level in LEVELS}
    cycles = [duration / _period(x, rate) for x, rate in pairwise(sigma)]
    of = zip(NAMES, sigma[:3], cycles, strict=True)
    return {f"{name}_{level}": largest(x, n, q) for name, x, n in of for level, q in LEVELS.items()}


def _period(sigma: float, rate: float) -> float:
    return 2.0 * math.pi * sigma / rate if rate > 0.0 else math.nan


def seed_extremes(
    rao: VerticalMotion, sea: Sea, x: float, y: float, duration: float, seeds: int, first: int
) -> dict[str, Any]:
    """Gumbel distributions of the largest height above the mean [m], speed [m/s] and acceleration [m/s^2] (upwards) of
    realisations of `duration` [s], one each for the seeds first, first + 1, ...: most probable maximum and 90 % level
    of each, with the ends of their 95 % intervals. Amplitudes are random (Rayleigh), as in nature."""
    if not FEWEST_MAXIMA <= seeds <= MOST_SEEDS:
        raise SeaError(f"seeds = {seeds}: give {FEWEST_MAXIMA} to {MOST_SEEDS}; use 20 or more.")
    maxima: dict[str, list[float]] = {name: [] for name in NAMES}
    for seed in range(first, first + seeds):
        motion = tip_motion(realise(sea, duration, seed, amplitudes="rayleigh"), rao, x, y)
        n = math.ceil(len(motion.amplitudes) * 2.0 * math.pi / SPACING)
        for order, name in enumerate(NAMES):
            maxima[name].append(float(synthesis((1j * motion.omega) ** order * motion.amplitudes, n).max()))
    fits = {name: gumbel(met) for name, met in maxima.items() if max(met) > 0.0}
    levels = {f"{n}_{level}": fit.estimate(q).to_dict() for n, fit in fits.items() for level, q in LEVELS.items()}
    return {"seeds": seeds, **levels}
