"""Weather held against a table of wind seas beside a swell: which part of a record is the wind sea, and whether its
swell is one that the plan's stands for.

Where the weather gives height, peak period and direction of wind sea and swell apart, the wind sea is held against the
table, and the swell must stay within the plan's: its height within the forecast height of the plan's (alpha times it,
as for the table), its period and direction within the tolerances. Where it does not, the whole record counts as wind
sea, and the plan's swell comes on top of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from stillhook.base.arrays import BoolArray
from stillhook.sea.spectra.directions import FULL, relative
from stillhook.units import show
from stillhook.weather.alpha import AlphaTable, alphas
from stillhook.weather.limit_text import free_headings
from stillhook.weather.series import Weather

FAINT = 0.2
"""Height of a swell over the plan's up to which its period and direction do not count: 4 % of its energy (assumed)."""
SAME = 1e-9
"""Rounding of angles and periods."""


def swell_forecast(table: AlphaTable, Hs: float, T_POP: float) -> float:
    """Height that a forecast of the swell may show [m] for a plan with a swell of Hs [m]: alpha times it, with the
    lowest factor of the table below its lowest height; NaN where the table gives none."""
    return float(alphas(table, np.array([max(Hs, table.Hs[0])]), T_POP)[0]) * Hs


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
    """Weather as a table of wind seas beside a swell wants it; swell: of the plan, by name [SI], None without one."""
    if swell is None:
        return Systems(weather)
    beside = f"{swell['text']}, in every cell of the table"
    columns = weather.columns
    if not {"H_m0_wind_sea", "H_m0_swell"} <= columns.keys():
        note = (
            f"the weather does not give wind sea and swell apart: the whole height of a record is held against the"
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
