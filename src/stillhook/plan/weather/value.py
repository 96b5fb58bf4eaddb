"""What limits are worth in weather: how often one can work, how long one waits, and what each alternative gains over
the others.

The operation needs a window of T_R in which the sea stays under OP_WF, the limit lowered by alpha because forecasts
err. A record is workable where its height is at most OP_WF of its period and direction (`LimitTable.at`); a vessel free
to turn keeps one heading through the window (`KeptHeadings`). Where the table of alpha gives no factor (case by case)
there is no OP_WF, and no window. Gains alone compare such limits, of both alternatives by the factor of the table's
lowest height: a limit without a factor would make the other look better than it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.result import Credit, labelled
from stillhook.plan.table import Axes, Governed, limit_table
from stillhook.plan.weather.limit_table import KeptHeadings, Kinds
from stillhook.plan.weather.records import Records, outside, seas_of, swell_forecast
from stillhook.weather.alpha import AlphaTable, alpha_of, alphas, reference_period
from stillhook.weather.persistence import Persistence, Window, month_of, persistence, waits
from stillhook.weather.series import Weather

if TYPE_CHECKING:
    import xarray


YEAR = 365.25 * 24.0
"""Hours of a year."""
DAY = 86400.0
MONTH_DAYS = (31.0, 28.25, 31.0, 30.0, 31.0, 30.0, 31.0, 31.0, 30.0, 31.0, 30.0, 31.0)
COUNTS = ("n_hours", "n_windows", "n_windows_long_enough", "n_censored", "n_gaps")
STATISTICS = ("operability", "start_share", "window_mean", "wait_mean", "wait_p50", "wait_p90", *COUNTS)
OVER = (Alternative.NONE.value, Alternative.CAP.value, "best-classic")
"""References of gains: no compensation, the flat cap, the better of the classic controllers."""
SYNTHETIC = "synthetic"
"""Word by which a source or its notes say that weather was made up."""


@dataclass(frozen=True, eq=False)
class Forecast:
    """Forecast factors of every cell (credit, alternative, heading, period): alpha [1], op_wf [m], NaN where the table
    has none; T_R from the issue of the forecast [s], window [s]: what is left of it at the start; restricted, whether
    the operation is weather restricted; reason: what the table says of cells that it leaves open, case_by_case: which
    have a limit and no factor; compared [m]: op_wf, there with the factor of the table's lowest height."""

    alpha: FloatArray = field(repr=False)
    op_wf: FloatArray = field(repr=False)
    case_by_case: BoolArray = field(repr=False)
    compared: FloatArray = field(repr=False)
    credits: tuple[Credit, ...]
    T_R: float
    window: float
    restricted: bool
    reason: str
    table: AlphaTable = field(repr=False)
    swell: float = math.nan  # height that a forecast of the plan's swell may show [m]; NaN without one


def forecast_limits(plan: LiftPlan, table: AlphaTable, limits: Mapping[Credit, Governed]) -> Forecast:
    """alpha and OP_WF of every limit; one above the highest sea state analysed is taken as that height."""
    Hs = np.stack([np.minimum(of.Hs, max(plan.environment.Hs)) for of in limits.values()])
    T_R, restricted = reference_period(table, plan.T_POP, plan.T_C)
    alpha = np.where(Hs > 0.0, alphas(table, Hs, plan.T_POP), np.nan)
    open_ = (Hs > 0.0) & np.isnan(alpha)
    reason = alpha_of(table, float(Hs[open_].max()), plan.T_POP, plan.T_C).reason if open_.any() else ""
    op_wf = np.where(Hs == 0.0, 0.0, alpha * Hs)
    swell = plan.environment.swell
    most = math.nan if swell is None else swell_forecast(table, swell.Hs, plan.T_POP)
    lowest = np.where(open_, Hs * alphas(table, np.maximum(Hs, table.Hs[0]), plan.T_POP), op_wf)
    numbers, window = (alpha, op_wf, open_, lowest), T_R - plan.lead
    return Forecast(*numbers, tuple(limits), T_R, window, restricted, reason, table, most)


@dataclass(frozen=True, eq=False)
class WeatherValue:
    """Persistence of each alternative's workable weather by credit, each with its months; waits from every record (n,)
    [s], NaN where no start follows, and month (n,) of the record; compared: both as gains take them; best_classic by
    credit, None without one; window [s]; workability: how the weather was judged.
    """

    persistence_of: Mapping[tuple[Credit, Alternative], Persistence] = field(repr=False)
    waits: Mapping[tuple[Credit, Alternative], FloatArray] = field(repr=False)
    compared: Mapping[tuple[Credit, Alternative], tuple[Persistence, FloatArray]] = field(repr=False)
    month: NDArray[np.int64] = field(repr=False)
    best_classic: Mapping[Credit, Alternative | None]
    window: float
    workability: Workability = field(repr=False)

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on how the weather was read."""
        return self.workability.notes

    def reference(self, over: str, credit: Credit) -> Alternative | None:
        """The alternative that a name of `OVER` stands for; None where the plan has none."""
        if over == OVER[-1]:
            return self.best_classic[credit]
        return Alternative(over) if (credit, Alternative(over)) in self.waits else None


def weather_value(plan: LiftPlan, axes: Axes, forecast: Forecast, weather: Weather) -> WeatherValue:
    """How each alternative fares in the weather.

    Errors: WeatherError where the weather does not give the height, or no direction though the vessel's heading is
    fixed.
    """
    judge = Workability.of(plan, axes, weather, forecast.swell)
    window = Window.of(weather.time, weather.step, forecast.window)

    valid = np.isfinite(judge.seas.Hs)
    known: dict[bytes, tuple[Persistence, FloatArray]] = {}

    def of(limits: FloatArray) -> tuple[Persistence, FloatArray]:
        op_wf = np.nan_to_num(limits, nan=0.0)
        key = op_wf.tobytes()
        if key not in known:
            good = judge.workable(op_wf)
            statistics = persistence(good, weather.time, weather.step, forecast.window, valid=valid)
            can_start = np.any([window.starts(row) for row in good], axis=0)
            known[key] = statistics, waits(can_start, weather.time)
        return known[key]

    persistence_of: dict[tuple[Credit, Alternative], Persistence] = {}
    waited: dict[tuple[Credit, Alternative], FloatArray] = {}
    compared: dict[tuple[Credit, Alternative], tuple[Persistence, FloatArray]] = {}
    for c, credit in enumerate(forecast.credits):
        for a, alternative in enumerate(axes.alternatives):
            key = credit, alternative
            persistence_of[key], waited[key] = of(forecast.op_wf[c, a])
            compared[key] = of(forecast.compared[c, a])
    classic = [a for a in axes.alternatives if a.classic]
    best = {credit: _best(persistence_of, credit, classic) for credit in forecast.credits}
    month = month_of(weather.time)
    return WeatherValue(persistence_of, waited, compared, month, best, forecast.window, judge)


@dataclass(frozen=True, eq=False)
class Workability:
    """How weather is judged by tables of limits on the axes of a plan: what does not depend on the limits. swell
    (kept, n): whether the swell of each record is within the plan's, at each heading that may be kept; notes on how
    the weather was read."""

    plan: LiftPlan
    axes: Axes
    weather: Weather
    seas: Records
    headings: KeptHeadings
    kinds: Kinds
    swell: BoolArray
    notes: tuple[str, ...]

    @classmethod
    def of(cls, plan: LiftPlan, axes: Axes, weather: Weather, height: float) -> Workability:
        """height that a forecast of the plan's swell may show [m], NaN without one. Errors: as `weather_value`."""
        seas, notes = seas_of(plan, weather)
        table = limit_table(plan, axes, np.zeros(axes.columns))
        headings = KeptHeadings.of(table, len(weather), seas.come_from, seas.ship)
        kinds = headings.kinds(table, seas.periods)
        kept = len(headings.counts)
        swell = seas.systems.within(seas.ship, kept, height)
        notes = (*notes, *seas.systems.outside(height))
        return cls(plan, axes, weather, seas, headings, kinds, swell, notes)

    def workable(self, op_wf: FloatArray) -> BoolArray:
        """Whether each record is within limits (heading, period) [m] at each heading that may be kept (kept, n)."""
        return np.asarray((self.seas.Hs <= self._limits(op_wf)[:, self.kinds.inverse]) & self.swell)

    def starts(self, op_wf: FloatArray, window: Window) -> tuple[BoolArray, BoolArray]:
        """Whether each record is workable (one of several headings: within a window), and whether an operation can
        start in it, by limits (heading, period) [m] (n,)."""
        some, start = (np.zeros(len(self.weather), dtype=np.bool_) for _ in range(2))
        limits, seen = self._limits(op_wf), set()
        for limit, swell in zip(limits, self.swell, strict=True):
            if (content := limit.tobytes() + swell.tobytes()) not in seen:
                seen.add(content)
                good = (self.seas.Hs <= limit.take(self.kinds.inverse, mode="clip")) & swell
                starts = window.starts(good)
                some |= good if len(limits) == 1 else window.covered(starts)
                start |= starts
        return some, start

    def _limits(self, op_wf: FloatArray) -> FloatArray:
        """Limits of the kinds of records at each heading that may be kept (kept, k) [m]; -inf: nothing is workable."""
        table = limit_table(self.plan, self.axes, op_wf)
        limit = self.headings.of_kinds(table, self.seas.periods, self.kinds)
        return np.where(limit > 0.0, limit, -np.inf)


def _best(
    persistence_of: Mapping[tuple[Credit, Alternative], Persistence], credit: Credit, of: list[Alternative]
) -> Alternative | None:
    """The one in which work can start most often."""
    return max(of, key=lambda a: persistence_of[credit, a].start_share, default=None)


def weather_block(
    plan: LiftPlan, value: WeatherValue, axes: Axes, weather: Weather, forecast: Forecast
) -> xarray.Dataset:
    """The Dataset of a result: dims credit, alternative, month (0 the whole year), over. A month without records is
    NaN. attrs say which weather, read how."""
    shape = (len(forecast.credits), len(axes.alternatives), 13)
    tables = {name: np.full(shape, np.nan) for name in (*STATISTICS, "vessel_days")}
    for c, credit in enumerate(forecast.credits):
        for a, alternative in enumerate(axes.alternatives):
            year = value.persistence_of[credit, alternative]
            for each in (replace(year, month=0), *year.months):
                for name in STATISTICS:
                    tables[name][c, a, each.month or 0] = getattr(each, name)
    tables["vessel_days"] = (tables["wait_mean"] + value.window) / DAY
    hours, days = _gained(axes, value)
    dims = ("credit", "alternative", "month")
    data: dict[str, tuple[tuple[str, ...], FloatArray]] = {name: (dims, values) for name, values in tables.items()}
    for name, gains in (("hours_gained", hours), ("days_gained", days)):
        data[name] = (*dims, "over"), np.moveaxis(gains, 0, -1)
    coords = {
        "credit": list(forecast.credits),
        "alternative": [a.value for a in axes.alternatives],
        "month": np.arange(13),
        "over": list(OVER),
    }
    best = {f"best_classic_{credit}": a.value if a else "" for credit, a in value.best_classic.items()}
    return labelled(data, coords, _described(plan, weather, forecast) | best)


def _described(plan: LiftPlan, weather: Weather, forecast: Forecast) -> dict[str, Any]:
    """Attributes of the block: weather, window, vessel, forecast factors."""
    ship = None if plan.weather is None else plan.weather.ship
    first, last = (np.datetime_as_string(weather.time[k], unit="m") for k in (0, -1))
    seas, _ = seas_of(plan, weather)
    synthetic = any(SYNTHETIC in text.lower() for text in (weather.source, *weather.notes))
    return {
        "source": weather.source,
        "synthetic": int(synthetic),
        "first": str(first),
        "last": str(last),
        "step": weather.step,
        "T_R": forecast.T_R,
        "window": forecast.window,
        "limit": _limit_words(plan, seas),
        "case_by_case": _case_by_case(forecast),
        "ship": math.nan if ship is None else ship,
        **outside(plan, seas),
    }


def _case_by_case(forecast: Forecast) -> str:
    """That limits have no forecast factor, and so no window; empty where all have one."""
    n = int(forecast.case_by_case.sum())
    if not n:
        return ""
    return (
        f"{n} of {forecast.case_by_case.size} limits have no factor in the table of alpha (case by case below Hs"
        f" {forecast.table.Hs[0]:g} m): no OP_WF and no window there; gains alone compare them, by the factor of"
        f" {forecast.table.Hs[0]:g} m"
    )


def _limit_words(plan: LiftPlan, seas: Records) -> str:
    """What a record is compared with."""
    words = "wave height at most OP_WF of its period and direction"
    if plan.environment.swell is None:
        return words
    with_swell = f"with a {plan.environment.swell.describe()}"
    return f"wind sea: {words}; swell within the plan's" if seas.systems.apart else f"{words}, {with_swell}"


def _gained(axes: Axes, value: WeatherValue) -> tuple[FloatArray, FloatArray]:
    """Workable hours more and days of waiting less than each of `OVER` (over, credit, alternative, month).

    Days are means over the starts from which both get their window within the series: means over different starts
    cannot be subtracted, for one who hardly ever works has most of his long waits censored and looks quick.
    """
    counted = tuple(value.best_classic)
    operability = np.full((len(counted), len(axes.alternatives), 13), np.nan)
    for c, a in np.ndindex(operability.shape[:2]):
        year, _ = value.compared[counted[c], axes.alternatives[a]]
        for each in (replace(year, month=0), *year.months):
            operability[c, a, each.month or 0] = each.operability
    hours = np.full((len(OVER), *operability.shape), np.nan)
    days = hours.copy()
    length = np.array([YEAR, *(24.0 * d for d in MONTH_DAYS)])
    for o, name in enumerate(OVER):
        for c, credit in enumerate(counted):
            other = value.reference(name, credit)
            if other is None:
                continue
            hours[o, c] = length * (operability[c] - operability[c, axes.alternatives.index(other)])
            for a, alternative in enumerate(axes.alternatives):
                less = value.compared[credit, other][1] - value.compared[credit, alternative][1]
                days[o, c, a] = _mean_by_month(less, value.month) / DAY
    return hours, days


def _mean_by_month(x: FloatArray, month: NDArray[np.int64]) -> FloatArray:
    """Means of what is known of x (n,), of all and of each month (13,)."""
    rows = [x[np.isfinite(x)], *(x[(month == m) & np.isfinite(x)] for m in range(1, 13))]
    return np.array([row.mean() if len(row) else np.nan for row in rows])
