"""Alpha factors: what a limiting wave height must be lowered by because forecasts deviate, and whether an operation is
weather restricted.

OP_WF = alpha OP_LIM; T_R = T_POP + T_C, and 2 T_POP where the contingency time T_C is not assessed. T_POP counts from
the issue of the forecast: lead time and operation together. Alpha steps with T_POP (each row counts up to and including
its time) and is interpolated along straight lines in Hs, unless the table says otherwise; above the highest Hs of the
table it stays, below the lowest it is "case by case": none is made up. Tables are files, each with its source; one that
holds several, by forecast level and monitoring, has a key for each: `dnv-os-h101#B`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from stillhook import units as u
from stillhook.base.arrays import FloatArray, IntArray
from stillhook.base.choice import nearest
from stillhook.errors import StillhookError, WeatherError
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.tables.table import Fraction, Spec, Text
from stillhook.units import Hours, quote, show

OPTION = "--forecast-factors"
"""By which commands take a table."""
DEFAULT = "dnv-os-h101"
TEXTS = ("title", "version", "standard", "edition", "clause", "note", "source", "level", "monitoring")
"""What a table says of itself."""
SHORTEST_T_C, LEAST_T_C = 6.0 * 3600.0, 0.5
"""Contingency below which an answer warns [s], and its least share of T_POP: DNV-ST-N001 2.6.9.2-3 as publicly
implemented (assumed: check against your edition)."""
HALTING = "DNV-ST-N001 2.6.9.3 as publicly implemented"
"""Where the rule on operations that can be halted is from (assumed: check against your edition)."""
_SHELF = Path(__file__).resolve().parent / "alpha_tables"
_ROUND = 1e-6
"""Seconds and metres by which a number may miss a step of the table and still be on it."""


@dataclass(frozen=True)
class AlphaTable:
    """Alpha over limiting height and planned time.

    Hs (k,) [m], T_POP (r,) [s] ascending; alpha: r rows of k numbers, NaN where the source was not seen; the ends of
    what counts as weather restricted [s]; where it is from. steps: heights between two columns take the lower one, and
    do not interpolate; exclusive: a row counts up to its time without it.
    """

    name: str
    Hs: tuple[float, ...]
    T_POP: tuple[float, ...]
    alpha: tuple[tuple[float, ...], ...]
    T_POP_below: float
    T_R_below: float
    texts: dict[str, str] = field(default_factory=dict)
    steps: bool = False
    exclusive: bool = False

    @property
    def source(self) -> str:
        """Standard, edition, clause, forecast level and version of the table in one line."""
        t = dict.fromkeys(TEXTS, "") | self.texts
        file = f"table file {self.name}" + (f" version {t['version']}" if t["version"] else "")
        standard = (t["standard"], t["edition"] and f"({t['edition']})", t["clause"])
        level = t["level"] and f"forecast level {t['level']}, monitoring {t['monitoring'] or 'not stated'}"
        return ", ".join(p for p in (" ".join(p for p in standard if p), level, file, t["note"]) if p)

    @property
    def numbers(self) -> dict[str, Any]:
        """What `of_numbers` makes the table of again [SI]; None for a factor whose source was not seen."""
        alpha = [[None if math.isnan(a) else a for a in row] for row in self.alpha]
        steps = {"steps": self.steps, "exclusive": self.exclusive}
        ends = {"T_POP_below": self.T_POP_below, "T_R_below": self.T_R_below}
        return {"Hs": list(self.Hs), "T_POP": list(self.T_POP), "alpha": alpha, **ends, **steps}

    @classmethod
    def of_numbers(cls, name: str, numbers: Mapping[str, Any]) -> AlphaTable:
        """The table of `numbers`, without where it is from."""
        rows = tuple(tuple(math.nan if a is None else float(a) for a in row) for row in numbers["alpha"])
        more = {key: numbers[key] for key in ("T_POP_below", "T_R_below", "steps", "exclusive")}
        return cls(name, tuple(numbers["Hs"]), tuple(numbers["T_POP"]), rows, **more)


class AlphaRow(Spec):
    """A table [[row]]: alpha for planned operation periods up to and including T_POP."""

    T_POP: Hours = Field(description="planned operation period")
    alpha: tuple[Fraction, ...] = Field(description="above 0 and up to 1, for each Hs")
    seen_to: u.Length | None = Field(default=None, description="highest Hs of which the source was seen, if not all")


class LevelTable(Spec):
    """A table [[level]] of a file with several: factors by forecast level and monitoring."""

    key: Text = Field(description="short name, such as B or A+monitoring")
    level: Text = Field(description="forecast level in the words of the source")
    monitoring: Text = Field(description="monitoring of the weather in the words of the source")
    clause: str = Field(default="", description="clause of the standard")
    beyond: str = Field(default="", description="table that the source names for longer operations")
    row: tuple[AlphaRow, ...] = Field(min_length=1, description='one [[level.row]] or more, with T_POP = "12 h"')


class RestrictedTable(Spec):
    """The table [restricted]: what counts as weather restricted."""

    T_POP_below: Hours = Field(description='end of T_POP, such as "72 h"')
    T_R_below: Hours = Field(description='end of T_R, such as "96 h"')


class AlphaFile(Spec):
    """A table of forecast factors."""

    title: str = Field(default="", description="title of the table")
    version: str = Field(default="", description="version of this file")
    standard: Text = Field(description="what the factors are from")
    edition: str = Field(default="", description="edition of the standard")
    clause: str = Field(default="", description="clause of the standard")
    note: str = Field(default="", description="what to check")
    source: str = Field(default="", description="where the numbers were seen")
    steps: bool = Field(default=False, description="heights between two columns take the lower one")
    exclusive: bool = Field(default=False, description="a row counts up to its T_POP without it")
    Hs: tuple[u.Length, ...] = Field(min_length=1, description='heights of the columns, such as ["1 m", "2 m"]')
    row: tuple[AlphaRow, ...] = Field(default=(), description='one [[row]] or more, with T_POP = "12 h" and alpha')
    level: tuple[LevelTable, ...] = Field(default=(), description="in place of [[row]], one [[level]] or more")
    restricted: RestrictedTable = Field(description="table [restricted] with T_POP_below and T_R_below")


@dataclass(frozen=True)
class Alpha:
    """Answer for one operation. alpha and op_wf [m] are None where the table gives none; reason says so, in one line;
    short_contingency: that T_C is a short one, in one line."""

    hs: float
    T_POP: float
    T_C: float
    T_R: float
    alpha: float | None
    op_wf: float | None
    weather_restricted: bool
    reason: str = ""
    table: str = ""
    short_contingency: str = ""

    @property
    def case_by_case(self) -> bool:
        """Whether a factor is due and the table leaves it open."""
        return self.alpha is None and self.weather_restricted

    def numbers(self) -> dict[str, Any]:
        """By name [SI]."""
        return vars(self) | {"case_by_case": self.case_by_case}


def alpha_tables() -> tuple[str, ...]:
    """Names of the tables that come with the package."""
    return tuple(sorted(file.stem for file in _SHELF.glob("*.toml")))


def load_alpha_table(name_or_path: str = DEFAULT) -> AlphaTable:
    """A table by name or from a TOML file of one's own (others: `stillhook.formats.weather.alpha_table`); of a file
    with several by its key after a #, the first without one.

    Errors: WeatherError of one line that names file and field.
    """
    name, key = name_or_path, ""
    if "#" in name and not Path(name).is_file():
        name, _, key = name.rpartition("#")
    path = Path(name)
    own = name not in alpha_tables()
    if own and not path.suffix:
        raise WeatherError(
            f"{OPTION} {quote(name)}: no such table of alpha factors. There are {', '.join(alpha_tables())}"
            f"{nearest(name, alpha_tables())[:-1]}, or give a file, TOML, CSV or XLSX."
        )
    file = path if own else _SHELF / f"{name}.toml"
    try:
        read = partial(_table, key=key)
        table = read_toml(file, FileKind.ALPHA, WeatherError, read, start=f"Copy {DEFAULT}.toml and change it.")
        shown = path.name if own else name
        return replace(table, name=f"{shown}#{key}" if key else shown)
    except StillhookError as e:
        raise WeatherError(str(e)) from None


def _table(table: TomlTable, key: str) -> AlphaTable:
    file = table.read(AlphaFile)
    if bool(file.row) is bool(file.level):
        raise WeatherError("give one [[row]] or more, or one [[level]] or more, each with its rows.")
    keys = [level.key for level in file.level]
    if key and key not in keys:
        there = f"There are {', '.join(keys)}{nearest(key, keys)}" if keys else "The file has one table: leave # out."
        raise WeatherError(f"no factors {quote(key)} by forecast level and monitoring. {there}")
    at = keys.index(key) if key else 0
    level = file.level[at] if file.level else None
    place: tuple[str | int, ...] = () if level is None else ("level", at)
    rows = file.row if level is None else level.row
    alpha = tuple(_seen(table, file.Hs, row, (*place, "row", i)) for i, row in enumerate(rows))
    T_POP = tuple(row.T_POP for row in rows)
    for name, values in (("Hs", file.Hs), ("T_POP", T_POP)):
        if any(b <= a for a, b in pairwise((0.0, *values))):
            raise WeatherError(f"{name}: must rise from above 0. Put columns and rows in order.")
    texts = {name: getattr(file, name, "") for name in TEXTS if name != "level"}
    if level is not None:
        texts |= {"level": level.level, "monitoring": level.monitoring, "beyond": level.beyond}
        texts["clause"] = level.clause or file.clause
    ends = file.restricted.T_POP_below, file.restricted.T_R_below
    return AlphaTable(table.path.stem, file.Hs, T_POP, alpha, *ends, texts, steps=file.steps, exclusive=file.exclusive)


def _seen(table: TomlTable, Hs: Sequence[float], row: AlphaRow, at: tuple[str | int, ...]) -> tuple[float, ...]:
    """Factors of a row, NaN for heights of which the source was not seen."""
    seen = [H for H in Hs if row.seen_to is None or row.seen_to + _ROUND >= H]
    if len(row.alpha) != len(seen):
        raise table.wrong(f"give {len(seen)} numbers, one for each Hs.", *at, "alpha")
    return (*row.alpha, *(math.nan for _ in Hs[len(seen) :]))


def alpha_of(table: AlphaTable, hs: float, T_POP: float, T_C: float | None = None) -> Alpha:
    """Alpha of an operation with limiting height hs [m] (its OP_LIM) and planned time T_POP [s]; T_C contingency [s],
    None: not assessed.

    Errors: WeatherError for a height or time that is not above 0, and a contingency below 0.
    """
    if not (0.0 < hs < math.inf) or not (0.0 < T_POP < math.inf) or (T_C is not None and not (0.0 <= T_C < math.inf)):
        raise WeatherError(
            f"alpha: Hs {hs:g} m, T_POP {T_POP:g} s, T_C {'not assessed' if T_C is None else f'{T_C:g} s'}: height and"
            " time must be above 0, the contingency not below. Check the numbers."
        )
    T_R, restricted = reference_period(table, T_POP, T_C)
    alpha, reason = _alpha(table, hs, T_POP)
    if not restricted and not reason:
        reason = _unrestricted(table, T_POP, T_R)
    op_wf = None if alpha is None else alpha * hs
    short = short_contingency(T_POP, T_R - T_POP) if restricted else ""
    return Alpha(hs, T_POP, T_R - T_POP, T_R, alpha, op_wf, restricted, reason, table.source, short)


def short_contingency(T_POP: float, T_C: float) -> str:
    """That a contingency T_C [s] is a short one for T_POP [s], in one line; empty where it is not."""
    least = max(SHORTEST_T_C, LEAST_T_C * T_POP)
    if T_C >= least - _ROUND:
        return ""
    floor = f"{_hours(SHORTEST_T_C)} and half of T_POP, {_hours(least)} here"
    return (
        f"contingency T_C {_hours(T_C)} is short: at least {floor} (DNV-ST-N001 2.6.9.2-3 as publicly implemented)."
        " Agree it with your warranty surveyor, or give more T_C."
    )


def reference_period(table: AlphaTable, T_POP: float, T_C: float | None = None) -> tuple[float, bool]:
    """T_R = T_POP + T_C [s], 2 T_POP where T_C is not assessed (None); whether it may be weather restricted."""
    T_R = T_POP + (T_POP if T_C is None else T_C)
    return T_R, T_POP < table.T_POP_below - _ROUND and T_R < table.T_R_below - _ROUND


def alphas(table: AlphaTable, Hs: FloatArray, T_POP: float) -> FloatArray:
    """Alpha of limiting heights Hs [m], same shape; NaN where the table gives none (see `alpha_of`), and for NaN."""
    if _beyond(table, T_POP):
        return np.full(np.shape(Hs), np.nan)
    alpha = np.array(table.alpha[_row(table, T_POP)])
    inside = (Hs >= table.Hs[0] - _ROUND) & np.isfinite(Hs)
    if table.steps:
        column = np.maximum(np.searchsorted(np.array(table.Hs) + _ROUND, np.nan_to_num(Hs)) - 1, 0)
        return np.where(inside, alpha[column], np.nan)
    seen = np.isfinite(alpha)
    high = np.inf if seen.all() else float(np.array(table.Hs)[seen].max(initial=0.0)) + _ROUND
    values = np.interp(Hs, np.array(table.Hs)[seen], alpha[seen]) if seen.any() else np.full(np.shape(Hs), np.nan)
    return np.where(inside & (high >= Hs), values, np.nan)


def row_of_times(table: AlphaTable, T_POP: FloatArray) -> IntArray:
    """Row of the table that counts for each planned time (n,) [s]; as many as there are rows beyond the last."""
    sign = 1.0 if table.exclusive else -1.0
    return np.searchsorted(np.array(table.T_POP), T_POP + sign * _ROUND).astype(np.int64)


def _row(table: AlphaTable, T_POP: float) -> int:
    return int(row_of_times(table, np.array([T_POP]))[0])


def _beyond(table: AlphaTable, T_POP: float) -> bool:
    return _row(table, T_POP) >= len(table.T_POP)


def _unrestricted(table: AlphaTable, T_POP: float, T_R: float) -> str:
    ends = f"T_POP < {_hours(table.T_POP_below)} and T_R < {_hours(table.T_R_below)}"
    return (
        f"not weather restricted: T_POP {_hours(T_POP)}, T_R {_hours(T_R)}, where {ends} are needed. "
        "Plan for extremes of the season, or divide the operation."
    )


def _alpha(table: AlphaTable, hs: float, T_POP: float) -> tuple[float | None, str]:
    if _beyond(table, T_POP):
        end = f"no alpha: T_POP {_hours(T_POP)} is beyond the {_hours(table.T_POP[-1])} of the table"
        if T_POP >= table.T_POP_below - _ROUND:
            return None, (
                f"{end}, and the operation is not weather restricted. Plan for extremes of the season, or divide the"
                " operation."
            )
        longer = table.texts.get("beyond") or f"a table of your project for longer operations ({OPTION})"
        return None, f"{end}. Take {longer}, or divide the operation."
    if hs < table.Hs[0] - _ROUND:
        return None, (
            f"no alpha: a limiting Hs of {show(hs, 'length')} is below the {show(table.Hs[0], 'length')} of the"
            " table: case by case. Agree a factor with your warranty surveyor, and enter it in your project's table"
            f" ({OPTION})."
        )
    alpha = float(alphas(table, np.array([hs]), T_POP)[0])
    if math.isnan(alpha):
        return None, (
            f"no alpha: the table has no factor for T_POP {_hours(T_POP)} at a limiting Hs of {show(hs, 'length')}:"
            f" its source was not seen there. Enter the table of your edition ({OPTION})."
        )
    return alpha, ""


def _hours(time: float) -> str:
    return f"{time / 3600.0:g} h"
