"""Results of many draws: bands with their own uncertainty, chances of going beyond a limit, and paired differences."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.engine.scenario.problem import OK, numbers_of
from stillhook.errors import SpecError
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.units import parse, quote, show
from stillhook.variables import BY_NAME, SUMMARY

if TYPE_CHECKING:
    import xarray


INSIDE = 0.9
"""Share of the draws inside a band: 5 to 95 %."""
LEAST_FOR_ERRORS = 20
"""Draws below which an end of a band has no standard error: hardly one draw is beyond it."""
FAILED = "diverged"
OFFSET = "offset"
NUMERIC = tuple(v.name for v in SUMMARY if v.name not in ("status", "notes"))


class Band(NamedTuple):
    """Median and the ends of a band, each with its standard error from so few draws; n draws with numbers, failed ones
    without."""

    low: float
    median: float
    high: float
    low_error: float
    median_error: float
    high_error: float
    n: int
    failed: int


class Limit(NamedTuple):
    """A bound on a number of the summary: at most (or at least) a value [SI]."""

    name: str
    at_most: bool
    value: float

    @classmethod
    def of(cls, text: str) -> Limit:
        """From a text such as "e_c_pp <= 10 cm" or "eta_c >= 0.95". Errors: SpecError, UnitError of one line."""
        match = re.fullmatch(r"\s*(\w+)\s*(<=|>=)\s*(\S.*?)\s*", text) if isinstance(text, str) else None
        if match is None:
            raise SpecError(f'limit {quote(text)}: write a name, <= or >=, and a value, such as "e_c_pp <= 10 cm".')
        name, sign, value = match.groups()
        if name not in NUMERIC:
            have = f"there are {', '.join(NUMERIC)}{nearest(name, NUMERIC)}"
            raise SpecError(f"limit {quote(text)}: {quote(name)} is not a result of the summary; {have}")
        kind = BY_NAME[name].kind
        if kind:
            return cls(name, sign == "<=", parse(value, kind, f"limit {name}"))
        try:
            return cls(name, sign == "<=", float(value))
        except ValueError:
            raise SpecError(f"limit {quote(text)}: {quote(value)}: must be a plain number.") from None

    def check(self, crane: Crane) -> None:
        """Errors: SpecError where runs of this crane's winch type have no such number."""
        known = numbers_of(crane)
        if self.name not in known:
            raise SpecError(
                f'limit {self}: winch type "{crane.plant}" of "{crane.name}" has no {self.name}. Choose one of'
                f" {', '.join(known)}."
            )

    def beyond(self, values: FloatArray) -> NDArray[np.bool_]:
        """Which values go beyond it; one that is not there does."""
        return ~(values <= self.value) if self.at_most else ~(values >= self.value)

    def __str__(self) -> str:
        kind = BY_NAME[self.name].kind
        return f"{self.name} {'<=' if self.at_most else '>='} {show(self.value, kind) if kind else self.value}"


def band(values: FloatArray) -> Band:
    """Median and 5-95 % band of the draws that have numbers. Standard errors by Maritz and Jarrett
    (scipy.stats.mstats.mjci).

    They are those of random draws; a Sobol sequence does somewhat better.
    """
    edge = 0.5 * (1.0 - INSIDE)
    finite = values[np.isfinite(values)]
    failed = len(values) - len(finite)
    at = (edge, 0.5, 1.0 - edge)
    low, median, high = np.quantile(finite, at).tolist() if len(finite) else [math.nan] * 3
    errors = _errors(finite, at)
    return Band(
        low=low,
        median=median,
        high=high,
        low_error=errors[0],
        median_error=errors[1],
        high_error=errors[2],
        n=len(finite),
        failed=failed,
    )


def _errors(values: FloatArray, at: tuple[float, ...]) -> list[float]:
    """Standard errors of quantiles; those of a number that does not vary are 0, those of few draws NaN."""
    from scipy.stats.mstats import mjci  # heavy

    if len(values) < LEAST_FOR_ERRORS:
        return [math.nan] * len(at)
    if np.ptp(values) == 0.0:
        return [0.0] * len(at)
    return [float(x) for x in mjci(values, prob=at)]


def bands(run: xarray.Dataset, names: Sequence[str]) -> dict[str, dict[str, Band]]:
    """Case -> name -> band, of a Dataset of `monte_carlo`."""
    return {str(c): {name: band(run[name].sel(case=c).values) for name in names} for c in run["case"].values}


def chance(holds: NDArray[np.bool_]) -> Estimate:
    """The share of draws for which something holds, with its interval."""
    return Estimate.of_share(int(np.count_nonzero(holds)), len(holds))


def chances(run: xarray.Dataset, limit: Limit) -> dict[str, Estimate]:
    """Case -> share of all draws beyond the limit; a draw that diverged is beyond every limit."""
    return {str(c): chance(limit.beyond(run[limit.name].sel(case=c).values)) for c in run["case"].values}


def troubles(run: xarray.Dataset) -> dict[str, Estimate]:
    """Case -> share of all draws that went beyond a limit of the winch: status is neither "ok" nor a standing offset
    alone, which pure active winches have by design and which shows in e_c_mean."""
    return {
        str(c): chance(~np.isin(run["status"].sel(case=c).values.astype(str), (OK, OFFSET))) for c in run["case"].values
    }


def failures(run: xarray.Dataset) -> dict[str, int]:
    """Case -> draws that diverged."""
    return {str(c): int(np.count_nonzero(run["status"].sel(case=c).values == FAILED)) for c in run["case"].values}


class Paired(NamedTuple):
    """One case against another, draw by draw: band of the relative difference, and the share of draws in which it is
    lower."""

    relative: Band
    lower: Estimate


def paired_difference(run: xarray.Dataset, case: str, other: str, name: str) -> Paired:
    """A number of one case over that of another, less 1, draw by draw: common draws cancel what both share."""
    a, b = (run[name].sel(case=c).values for c in (case, other))
    return Paired(band(a / b - 1.0), chance(a < b))


def exceedance(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sorted values, and the share of all draws above each; draws without numbers count as above all."""
    finite = np.sort(values[np.isfinite(values)])
    return finite, (len(values) - 1.0 - np.arange(len(finite))) / len(values)
