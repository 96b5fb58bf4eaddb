"""Largest values of the tip's motion met in many realisations of one sea, and the distribution that they follow."""

from __future__ import annotations

import math
from typing import Any

from stillhook.errors import SeaError
from stillhook.sea.motion.irregular import synthesis
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.rao import Rao
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.statistics.extremes import FEWEST_MAXIMA, MPM, P90, gumbel

# rad: turn of the fastest harmonic from sample to sample; a wave of half its frequency loses 0.1 % of its crest at
# worst
SPACING = 0.2
MOST_SEEDS = 1000
NAMES = ("z", "v", "a")


def seed_maxima(
    rao: Rao, sea: Sea, x: float, y: float, duration: float, seeds: int, first: int = 1
) -> dict[str, list[float]]:
    """Largest height above the mean [m], speed [m/s] and acceleration [m/s^2] (upwards) of realisations of `duration`
    [s], one each for the seeds first, first + 1, ...: keys z, v, a. Amplitudes are random (Rayleigh), as in nature."""
    if not FEWEST_MAXIMA <= seeds <= MOST_SEEDS:
        raise SeaError(f"seeds = {seeds}: give {FEWEST_MAXIMA} to {MOST_SEEDS}; 20 or more tell something.")
    maxima: dict[str, list[float]] = {name: [] for name in NAMES}
    for seed in range(first, first + seeds):
        motion = tip_motion(realise(sea, duration, seed, amplitudes="rayleigh"), rao, x, y)
        n = math.ceil(len(motion.amplitudes) * 2.0 * math.pi / SPACING)
        for order, name in enumerate(NAMES):
            maxima[name].append(float(synthesis((1j * motion.omega) ** order * motion.amplitudes, n).max()))
    return maxima


def seed_extremes(
    rao: Rao, sea: Sea, x: float, y: float, duration: float, seeds: int, first: int = 1
) -> dict[str, Any]:
    """Gumbel distributions of those maxima: most probable maximum and 90 % level of each, with the ends of their 95 %
    intervals."""
    maxima = seed_maxima(rao, sea, x, y, duration, seeds, first)
    answer: dict[str, Any] = {"seeds": seeds}
    for name in NAMES:
        if max(maxima[name]) == 0.0:
            continue
        fit = gumbel(maxima[name])
        for level, q in (("mpm", MPM), ("p90", P90)):
            answer[f"{name}_{level}"] = fit.estimate(q).to_dict()
    return answer
