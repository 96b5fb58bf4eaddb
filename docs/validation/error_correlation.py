"""Coverage of the interval of line 2d-correlation: campaigns of two to four unequal load cases whose true correlation
is known, with correlated noise and drift."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from blocks import Blocks
from numpy.typing import NDArray
from scipy.signal import butter as band_filter
from scipy.signal import lfilter, sosfilt

from stillhook.statistics.estimate import Estimate, half_of_mean
from stillhook.validate.ahc.measures import THIN, case_correlation, mean_correlation

SLOW_PAGE = True
FloatArray = NDArray[np.float64]

LENGTHS = ((200.0, 1500.0, 300.0), (200.0, 300.0), (200.0, 1500.0, 200.0, 300.0))
"""Load cases of a campaign [s]; the four are those of the independent crane."""
CAMPAIGNS = 300
"""Of each row. 95 % of them are 285 +- 8 (two standard deviations)."""
SCATTERS = (0.0, 0.15, 0.3, 0.5)
"""Standard deviation of z between the load cases of a crane. Seven healthy independent cranes of four load cases have
0.28 to 0.58, 0.36 in the mean."""
MEAN = math.atanh(0.95)
PERIODS = (7.0, 12.0)  # s: peak periods, drawn evenly
BANDWIDTH = 0.25  # half width of the wave band over its middle
MEMORY = 2.0  # s: of the noise by which the simulated error differs
SLOW = 0.3
"""Of the power of that difference: slow drift (random walk, without its straight line)."""
LIMIT = 0.8
WINDOW = 30.0  # s, of paper F


class Row(NamedTuple):
    """Campaigns of one kind: load cases, scatter of z between them; shares of intervals that hold the true correlation
    and whose truth is below and above; median lower end of the new interval and of the one before."""

    cases: int
    scatter: float
    held: float
    below: float
    above: float
    low: float
    low_before: float


def narrow_band(rng: np.random.Generator, n: int) -> FloatArray:
    """A control error in waves, of unit power in the mean."""
    f = 1.0 / rng.uniform(*PERIODS)
    sos = band_filter(2, [f * (1.0 - BANDWIDTH), f * (1.0 + BANDWIDTH)], "bandpass", fs=1.0 / THIN, output="sos")
    level = math.sqrt(float(np.sum(sosfilt(sos, np.eye(1, 8000)[0]) ** 2)))
    return np.asarray(sosfilt(sos, rng.standard_normal(n + 1200))[1200:] / level)


def difference(rng: np.random.Generator, n: int) -> FloatArray:
    """What the simulated error differs by, of unit power in the mean: noise with a memory, and drift."""
    k = math.exp(-THIN / MEMORY)
    noise = lfilter([math.sqrt(1.0 - k * k)], [1.0, -k], rng.standard_normal(n + 600))[600:]
    walk = np.cumsum(rng.standard_normal(n))
    walk -= np.polyval(np.polyfit(np.arange(n), walk, 1), np.arange(n))
    # a random walk of unit steps about its own straight line has a power of n / 15
    return np.asarray(math.sqrt(1.0 - SLOW) * noise + math.sqrt(SLOW) * walk / math.sqrt(n / 15.0))


def load_case(rng: np.random.Generator, z: float, seconds: float) -> FloatArray:
    """Measured and simulated error of a load case whose correlation is tanh(z) in the mean, a row every THIN
    seconds."""
    n, r = round(seconds / THIN), math.tanh(z)
    measured = narrow_band(rng, n)
    simulated = measured + math.sqrt(1.0 / r**2 - 1.0) * difference(rng, n)
    return np.column_stack([x - x.mean() for x in (measured, simulated)])


def campaign(rng: np.random.Generator, lengths: Sequence[float], scatter: float) -> tuple[Estimate, float]:
    """The correlation over a campaign with its interval, and the lower end of the interval of version 0.10."""
    z = np.maximum(MEAN + scatter * rng.standard_normal(len(lengths)), 0.05)
    cases = {}
    for i, (each, seconds) in enumerate(zip(z, lengths, strict=True)):
        found = case_correlation([load_case(rng, float(each), seconds)], round(WINDOW / THIN))
        assert found is not None
        cases[str(i)] = found
    halves = [1.96 * c.deviation for c in cases.values()]
    before = half_of_mean([c.z for c in cases.values()], halves, lengths)
    centre = float(np.average([c.z for c in cases.values()], weights=lengths))
    return mean_correlation(cases), math.tanh(centre - before)


def row(lengths: Sequence[float], scatter: float, campaigns: int, seed: int) -> Row:
    """Campaigns of one kind."""
    rng, truth = np.random.default_rng([20, seed]), math.tanh(MEAN)
    found = [campaign(rng, lengths, scatter) for _ in range(campaigns)]
    low, high = (np.array([getattr(e, end) for e, _ in found]) for end in ("low", "high"))
    below, above = float(np.mean(high < truth)), float(np.mean(low > truth))
    lows = float(np.median(low)), float(np.median([x for _, x in found]))
    return Row(len(lengths), scatter, 1.0 - below - above, below, above, *lows)


def rows(campaigns: int = CAMPAIGNS) -> Iterator[Row]:
    """All kinds of campaigns."""
    for i, lengths in enumerate(LENGTHS):
        for k, scatter in enumerate(SCATTERS):
            yield row(lengths, scatter, campaigns, 10 * i + k)


def share(x: float) -> str:
    return f"{100.0 * x:.1f} %"


def compute() -> tuple[Blocks, None]:
    """Blocks of the page."""
    found = tuple(rows())
    lines = [{"r": r} for r in found]
    held = float(np.mean([r.held for r in found]))
    usual = [r for r in found if r.scatter in (0.3, 0.5)]

    return {
        "claims": locals(),
        "coverage": lines,
    }, None
