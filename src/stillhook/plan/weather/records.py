"""Weather as a plan's tables want it: read as the plan says, with the heights, periods and directions of its records,
which part of them is wind sea or swell, what of it the tables do not reach, and how much there is about a limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.choice import nearest
from stillhook.errors import PlanError, WeatherError
from stillhook.formats.weather.file import SENSES, read_weather
from stillhook.plan.definition.lift_plan import LiftPlan, WeatherUse
from stillhook.plan.weather.limit_table import SAME, bracketed, holdable_headings
from stillhook.sea.spectra.directions import FULL, relative
from stillhook.sea.spectra.parametric import Jonswap, pierson_moskowitz
from stillhook.units import quote, show
from stillhook.weather.alpha import AlphaTable, alphas
from stillhook.weather.limit_text import FREE_STEP, free_headings
from stillhook.weather.series import Weather

PEAKED = 3.3
"""Peak enhancement between which and 1 the peak period of a sea is taken to lie where only its zero-crossing period is
known."""


@dataclass(frozen=True, eq=False)
class Records:
    """Records as the tables want them: Hs (n,) [m], one or two readings of the peak period (n,) [s], come_from (n,)
    [rad from north] or None where the weather gives no direction; ship: where the bow points [rad from north], None
    where it is free to turn; systems: of a plan with a swell, of which Hs, periods and come_from are those of the wind
    sea where the weather has it apart.
    """

    Hs: FloatArray
    periods: tuple[FloatArray, ...]
    come_from: FloatArray | None
    ship: float | None
    systems: Systems


def seas_of(plan: LiftPlan, weather: Weather) -> tuple[Records, tuple[str, ...]]:
    """Records of the weather as a plan's tables want them, and how they were read.

    Errors: WeatherError for weather without heights, or without directions for a vessel whose heading is fixed.
    """
    swell = plan.environment.swell
    of_both = systems(weather, None if swell is None else swell.facts())
    weather = of_both.weather
    if "H_m0" not in weather.columns:
        raise WeatherError(f"{weather.source}: no wave height. Give weather with a column of significant wave height.")
    Hs, ship = weather.columns["H_m0"], None if plan.weather is None else plan.weather.ship
    come_from = weather.columns.get("come_from")
    periods, note = _periods(weather, len(Hs))
    check_headings(plan, ship, come_from is not None)
    if ship is not None and come_from is None:
        hint = next((f" ({note})" for note in weather.notes if "direction" in note), "")
        raise WeatherError(
            f"{weather.source}: gives no direction of waves{hint}, and weather.ship holds the vessel's heading at"
            f" {show(ship, 'angle', 4)}. State what the file's directions mean by weather.sense, or leave weather.ship"
            " out."
        )
    seas = Records(Hs, periods, come_from, ship, of_both)
    heading = (
        f"{free_to_turn(come_from is not None)}; {IN_WINDOWS}"
        if ship is None
        else f"vessel's heading fixed at {show(ship, 'angle', 4)} from north"
    )
    return seas, (*of_both.notes, *([note] if note else []), heading, *_outside(plan, seas))


IN_WINDOWS = "operability and workable hours count records within a window of the operation at one heading"
"""What a vessel that is free to turn can work in."""


def free_to_turn(directions: bool) -> str:
    """What a vessel free to turn does, in words; directions: whether the weather gives those of waves."""
    if directions:
        return (
            f"vessel free to turn: one heading through each operation, the best of every {show(FREE_STEP, 'angle', 4)}"
        )
    return (
        "vessel free to turn, and no direction of waves: they are taken to stay on one side of it through each"
        " operation (upper bound)"
    )


def _outside(plan: LiftPlan, seas: Records) -> list[str]:
    """How many records the plan's table does not reach: its limit there is 0 m in any weather."""
    words = {
        "above_period": f"are above {max(plan.environment.Tp):g} s, the highest period of the table",
        "outside_headings": "have waves outside the table's headings",
        "no_direction": "give no direction",
    }
    shares = outside(plan, seas)
    shares_text = [
        f"{100.0 * shares[key]:.3g} % of the records {text}" for key, text in words.items() if shares[key] > 0.0
    ]
    return [f"{', '.join(shares_text)}: counted as not workable"] if shares_text else []


def outside(plan: LiftPlan, seas: Records) -> dict[str, float]:
    """Shares of records that the plan's table does not reach: above its highest period (of which one reading is
    enough), between or outside its headings where the ship holds one, or without a direction; outside: any of these."""
    env = plan.environment
    high = np.any([period > max(env.Tp) for period in seas.periods], axis=0)
    blind = np.zeros_like(high) if seas.come_from is None else np.isnan(seas.come_from)
    aside = np.zeros_like(high)
    if seas.come_from is not None and seas.ship is not None:
        beta = np.asarray(relative(seas.come_from, seas.ship))
        aside = ~blind & ~bracketed(np.array(env.headings), env.heading_tolerance, beta)[1]
    parts = {"above_period": high, "outside_headings": aside, "no_direction": blind, "outside": high | aside | blind}
    return {key: float(part.mean()) for key, part in parts.items()}


def check_headings(plan: LiftPlan, ship: float | None, directions: bool) -> None:
    """Refuse headings without neighbours in the table; directions: whether the weather gives those of waves.
    Errors: PlanError; ship as in `WeatherUse`."""
    env = plan.environment
    headings, tolerance = np.array(env.headings), env.heading_tolerance
    listed = ", ".join(show(beta, "angle", 4) for beta in env.headings)
    if ship is None and not holdable_headings(headings, tolerance).any():
        raise PlanError(
            f"environment.headings {listed}: none can be kept within {show(tolerance, 'angle', 4)} (heading_tolerance),"
            " for no neighbours span that on both sides of it. For weather, give headings on both sides such as 165,"
            " 180 and 195 deg, a smaller heading_tolerance, or weather.ship."
        )
    apart = np.diff(np.sort(np.append(headings, headings.min() + FULL)))
    if directions and not (apart <= 2.0 * tolerance * (1.0 + SAME)).any():
        raise PlanError(
            f"environment.headings {listed}: no two are within {show(2.0 * tolerance, 'angle', 4)} (twice"
            " heading_tolerance), and the table has no result between them. For weather with directions of waves, give"
            " neighbours."
        )


def _periods(weather: Weather, n: int) -> tuple[tuple[FloatArray, ...], str]:
    """Readings of the peak period, of which the worse counts, and their origin where the weather gives none."""
    if "T_p" in weather.columns:
        return (weather.columns["T_p"],), ""
    if "T_m02" not in weather.columns:
        return (np.full(n, np.nan),), "no period in the weather: the worst period of the table counts in every record"
    ratios = [spectrum.T_m02 / spectrum.T_p for spectrum in (pierson_moskowitz(2.0, 9.0), Jonswap(2.0, 9.0, PEAKED))]
    note = (
        f"no peak period in the weather: T_z over {ratios[0]:.3f} and over {ratios[1]:.3f} (gamma 1 and {PEAKED:g}),"
        " the worse of both"
    )
    return tuple(weather.columns["T_m02"] / r for r in ratios), note


def weather_used(use: WeatherUse) -> Weather:
    """The weather, read as the plan says; columns without any number are left out.

    Errors: WeatherError of one line for the file and where no height is known, PlanError for an unknown sense.
    """
    if use.sense is not None and use.sense not in SENSES:
        raise PlanError(
            f"weather.sense = {quote(use.sense)}: is not one of {', '.join(SENSES)}{nearest(use.sense, tuple(SENSES))}"
        )
    sense = None if use.sense is None else SENSES[use.sense]
    weather = read_weather(
        use.file,
        sense=sense,
        columns_as=use.columns,
        time_column=use.time,
        date_order=use.date_order,
        time_zone=use.time_zone,
    )
    columns = {name: x for name, x in weather.columns.items() if np.isfinite(x).any()}
    if "H_m0" in weather.columns and "H_m0" not in columns:
        raise WeatherError(
            f"{weather.source}: no record of wave height: all {len(weather)} are missing. Give weather that has them."
        )
    return replace(weather, columns=columns)


FAINT = 0.2
"""Height of a swell over the plan's up to which its period and direction do not count: 4 % of its energy (assumed)."""


def swell_forecast(table: AlphaTable, Hs: float, T_POP: float) -> float:
    """Height that a forecast of the swell may show [m] for a plan with a swell of Hs [m]: alpha times it, NaN where the
    table has no factor (case by case)."""
    return float(alphas(table, np.array([Hs]), T_POP)[0]) * Hs


@dataclass(frozen=True, eq=False)
class Systems:
    """Weather as a table of wind seas wants it. weather: H_m0, T_p and come_from are those of the wind sea; swell: the
    plan's, by name [SI], None without one; apart: whether the weather has the two apart; notes."""

    weather: Weather
    swell: Mapping[str, Any] | None = field(default=None, repr=False)
    apart: bool = False
    notes: tuple[str, ...] = ()

    def within(self, ship: float | None, n_kept: int, Hs_most: float) -> BoolArray:
        """Whether the swell of each record is one that the plan's stands for, at each heading that is kept (kept, n).

        ship: where the bow points [rad from north], None where it is free to turn; n_kept: number of headings that are
        kept; Hs_most: height that the swell may have [m]. A record without a height of its swell is not.
        """
        n = len(self.weather)
        if self.swell is None or not self.apart:
            return np.ones((n_kept, n), dtype=np.bool_)
        columns = self.weather.columns
        Hs = columns["H_m0_swell"]
        like = np.ones((n_kept, n), dtype=np.bool_)
        if "T_p_swell" in columns:
            like &= np.abs(columns["T_p_swell"] - self.swell["Tp"]) <= self.swell["Tp_tolerance"] + SAME
        if self.has_directions:
            ships = free_headings() if ship is None else np.array([ship])
            beta = np.stack([np.asarray(relative(columns["come_from_swell"], float(s))) for s in ships])
            off = np.abs((beta - self.swell["heading"] + math.pi) % FULL - math.pi)
            like &= off <= self.swell["heading_tolerance"] + SAME
        faint = Hs <= FAINT * self.swell["Hs"]
        return np.asarray((Hs <= Hs_most) & (like | faint))

    @property
    def has_directions(self) -> bool:
        """Whether the directions of both systems are known, so that a heading of the vessel is one for both."""
        return {"come_from", "come_from_swell"} <= self.weather.columns.keys()

    def outside(self, Hs_most: float) -> tuple[str, ...]:
        """How many records have a higher swell than the plan's, or another."""
        if self.swell is None or not self.apart:
            return ()
        if math.isnan(Hs_most):
            return ("the plan's swell has no factor in the table of alpha (case by case): no record is workable",)
        columns = self.weather.columns
        Hs = columns["H_m0_swell"]
        higher = Hs > Hs_most
        other = np.zeros_like(higher)
        if "T_p_swell" in columns:
            off = ~(np.abs(columns["T_p_swell"] - self.swell["Tp"]) <= self.swell["Tp_tolerance"] + SAME)
            other = ~higher & off & (Hs > FAINT * self.swell["Hs"])
        words = (
            (higher, f"have a swell above {show(Hs_most, 'length', 3)}"),
            (other, f"a swell whose period is not within {show(self.swell['Tp_tolerance'], 'time', 3)} of the plan's"),
        )
        shares = [f"{100.0 * float(part.mean()):.3g} % of the records {text}" for part, text in words if part.any()]
        return (f"{', '.join(shares)}: counted as not workable",) if shares else ()


def systems(weather: Weather, swell: Mapping[str, Any] | None) -> Systems:
    """Weather as a table of wind seas with a swell needs it; swell: of the plan, by name [SI], None without one.

    Where the weather gives wind sea and swell apart, the wind sea is compared with the table, and the swell must stay
    within the plan's: its height within the forecast height of the plan's (alpha times it, as for the table), its
    period and direction within the tolerances. Where it does not, the whole record counts as wind sea, and the plan's
    swell comes on top of it.
    """
    if swell is None:
        return Systems(weather)
    beside = f"{swell['text']}, in every cell of the table"
    columns = weather.columns
    if not {"H_m0_wind_sea", "H_m0_swell"} <= columns.keys():
        note = (
            f"the weather does not give wind sea and swell apart: the whole height of a record is compared with the"
            f" limits of the wind sea, and the plan's {beside}, comes on top of it; two periods and directions in one"
            " record are not seen"
        )
        return Systems(weather, swell, False, (note,))
    known = np.isfinite(columns["H_m0_swell"])
    others = {name: x for name, x in columns.items() if name not in ("H_m0", "T_p", "T_m02", "come_from")}
    parts = {name: columns.get(f"{name}_wind_sea") for name in ("H_m0", "T_p", "come_from")}
    parts["H_m0"] = np.where(known, columns["H_m0_wind_sea"], np.nan)
    wind_sea = replace(weather, columns=others | {name: x for name, x in parts.items() if x is not None})
    notes = [f"wind sea and swell apart: the wind sea against the table, the swell against the plan's {beside}"]
    missing = [text for name, text in _LEFT.items() if f"{name}_swell" not in columns]
    notes += (
        [f"the weather gives no {' and no '.join(missing)} of the swell: not held (upper bound)"] if missing else []
    )
    if "come_from_swell" in columns and "come_from" not in wind_sea.columns:
        notes.append("the weather gives no direction of the wind sea: that of the swell is not held (upper bound)")
    return Systems(wind_sea, swell, True, tuple(notes))


_LEFT = {"T_p": "peak period", "come_from": "direction"}


ALPHA = 0.75
"""Forecast factor by which a limit is lowered, about."""
HALF = 0.25
"""Half width of the window about a limit, in ln of the height."""
USUAL = 0.5
"""Share of the records of a period, for each unit of ln of the height, that counts as usual."""

Occurrence = Callable[[tuple[float, float], float], float]
"""Weather about a limiting height [m] in a column (Tp, beta), over the usual."""


def occurrence(plan: LiftPlan, weather: Weather) -> Occurrence:
    """Records whose period is nearest to that of a column and whose height is about what a limit leaves, over those of
    an even spread over the periods. Headings are alike, for the vessel may take any of them; weather without periods is
    about all of them alike."""
    seas, _ = seas_of(plan, weather)
    Tp, T = np.sort(np.array(plan.environment.Tp)), seas.periods[0]
    sound = np.isfinite(seas.Hs) & (seas.Hs > 0.0)
    timed = sound & np.isfinite(T) & (T > 0.0) & (Tp[-1] >= T)
    if timed.any() and len(Tp) > 1:
        nearest = np.abs(np.log(T[timed])[:, None] - np.log(Tp)).argmin(axis=1)
        rows = [np.sort(np.log(seas.Hs[timed][nearest == k])) for k in range(len(Tp))]
    else:
        rows = [np.sort(np.log(seas.Hs[sound]))] * len(Tp)
    even = sum(map(len, rows)) / len(Tp)

    def about(column: tuple[float, float], limit: float) -> float:
        if not 0.0 < limit < math.inf or even == 0.0:
            return 1.0
        row = rows[int(np.abs(Tp - column[0]).argmin())]
        middle = math.log(ALPHA * limit)
        n = int(np.searchsorted(row, middle + HALF) - np.searchsorted(row, middle - HALF))
        return n / (2.0 * HALF * USUAL * even)

    return about
