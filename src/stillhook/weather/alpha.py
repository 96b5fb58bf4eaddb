"""Alpha factors: what a limiting wave height must be lowered by because forecasts deviate, and whether an operation is
weather restricted.

OP_WF = alpha OP_LIM; T_R = T_POP + T_C, and 2 T_POP where the contingency time T_C is not assessed. Alpha steps with
T_POP (each row counts up to and including its time) and is interpolated along straight lines in Hs; above the highest
Hs of the table it stays, below the lowest it is "case by case": none is made up. Source: DNV-OS-H101 section 4
(not compared with print: check against your edition); tables are separate files.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.errors import StillhookError, WeatherError
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.tables.table import Fraction, Spec, Text
from stillhook.units import Hours, quote, show

OPTION = "--forecast-factors"
"""By which commands take a table."""
DEFAULT = "dnv-os-h101"
TEXTS = ("title", "version", "standard", "edition", "clause", "note")
"""What a table says of itself."""
_SHELF = Path(__file__).resolve().parent / "alpha_tables"
_ROUND = 1e-6
"""Seconds and metres by which a number may miss a step of the table and still be on it."""


@dataclass(frozen=True)
class AlphaTable:
    """Alpha over limiting height and planned time.

    Hs (k,) [m], T_POP (r,) [s] ascending; alpha: r rows of k numbers; the ends of what counts as weather restricted
    [s]; where it is from.
    """

    name: str
    Hs: tuple[float, ...]
    T_POP: tuple[float, ...]
    alpha: tuple[tuple[float, ...], ...]
    T_POP_below: float
    T_R_below: float
    texts: dict[str, str] = field(default_factory=dict)

    @property
    def source(self) -> str:
        """Standard, edition, clause and version of the table in one line."""
        t = self.texts
        file = f"table file {self.name}" + (f" version {t['version']}" if t["version"] else "")
        parts = (t["standard"], t["edition"] and f"({t['edition']})", t["clause"], file)
        return ", ".join(p for p in (" ".join(p for p in parts[:3] if p), parts[3], t["note"]) if p)


class AlphaRow(Spec):
    """A table [[row]]: alpha for planned operation periods up to and including T_POP."""

    T_POP: Hours = Field(description="planned operation period")
    alpha: tuple[Fraction, ...] = Field(description="above 0 and up to 1, for each Hs")


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
    Hs: tuple[u.Length, ...] = Field(min_length=1, description='heights of the columns, such as ["1 m", "2 m"]')
    row: tuple[AlphaRow, ...] = Field(min_length=1, description='one [[row]] or more, with T_POP = "12 h" and alpha')
    restricted: RestrictedTable = Field(description="table [restricted] with T_POP_below and T_R_below")


@dataclass(frozen=True)
class Alpha:
    """Answer for one operation. alpha and op_wf [m] are None where the table gives none; why says so, in one line."""

    hs: float
    T_POP: float
    T_C: float
    T_R: float
    alpha: float | None
    op_wf: float | None
    weather_restricted: bool
    reason: str = ""
    table: str = ""

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
    """A table by name or from a TOML file of one's own (others: `stillhook.formats.weather.alpha_table`).

    Errors: WeatherError of one line that names file and field.
    """
    path = Path(name_or_path)
    if name_or_path not in alpha_tables() and not path.suffix:
        raise WeatherError(
            f"{OPTION} {quote(name_or_path)}: no such table of alpha factors. There are {', '.join(alpha_tables())}"
            f"{nearest(name_or_path, alpha_tables())[:-1]}, or give a file, TOML, CSV or XLSX."
        )
    own = name_or_path not in alpha_tables()
    file = path if own else _SHELF / f"{name_or_path}.toml"
    try:
        table = read_toml(file, FileKind.ALPHA, WeatherError, _table, start=f"Copy {DEFAULT}.toml and change it.")
        return replace(table, name=path.name) if own else table
    except StillhookError as e:
        raise WeatherError(str(e)) from None


def _table(table: TomlTable) -> AlphaTable:
    file = table.read(AlphaFile)
    for i, row in enumerate(file.row):
        if len(row.alpha) != len(file.Hs):
            raise table.wrong(f"give {len(file.Hs)} numbers, one for each Hs.", "row", i, "alpha")
    T_POP = tuple(row.T_POP for row in file.row)
    for name, values in (("Hs", file.Hs), ("T_POP", T_POP)):
        if any(b <= a for a, b in pairwise((0.0, *values))):
            raise WeatherError(f"{name}: must rise from above 0. Put columns and rows in order.")
    texts = {key: getattr(file, key) for key in TEXTS}
    ends = file.restricted
    alpha = tuple(row.alpha for row in file.row)
    return AlphaTable(table.path.stem, file.Hs, T_POP, alpha, ends.T_POP_below, ends.T_R_below, texts)


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
    return Alpha(hs, T_POP, T_R - T_POP, T_R, alpha, op_wf, restricted, reason, table.source)


def reference_period(table: AlphaTable, T_POP: float, T_C: float | None = None) -> tuple[float, bool]:
    """T_R = T_POP + T_C [s], 2 T_POP where T_C is not assessed (None); whether it may be weather restricted."""
    T_R = T_POP + (T_POP if T_C is None else T_C)
    return T_R, T_POP < table.T_POP_below - _ROUND and T_R < table.T_R_below - _ROUND


def alphas(table: AlphaTable, Hs: FloatArray, T_POP: float) -> FloatArray:
    """Alpha of limiting heights Hs [m], same shape; NaN where the table gives none (see `alpha_of`), and for NaN."""
    if T_POP > table.T_POP[-1] + _ROUND:
        return np.full(np.shape(Hs), np.nan)
    row = table.alpha[int(np.searchsorted(np.array(table.T_POP), T_POP - _ROUND))]
    return np.where((Hs >= table.Hs[0] - _ROUND) & np.isfinite(Hs), np.interp(Hs, table.Hs, row), np.nan)


def _unrestricted(table: AlphaTable, T_POP: float, T_R: float) -> str:
    ends = f"T_POP < {_hours(table.T_POP_below)} and T_R < {_hours(table.T_R_below)}"
    return (
        f"not weather restricted: T_POP {_hours(T_POP)}, T_R {_hours(T_R)}, where {ends} are needed. "
        "Plan for extremes of the season, or divide the operation."
    )


def _alpha(table: AlphaTable, hs: float, T_POP: float) -> tuple[float | None, str]:
    if T_POP > table.T_POP[-1] + _ROUND:
        return None, (
            f"no alpha: T_POP {_hours(T_POP)} is beyond the {_hours(table.T_POP[-1])} of the table, and the"
            " operation is not weather restricted. Plan for extremes of the season, or divide the operation."
        )
    if hs < table.Hs[0] - _ROUND:
        return None, (
            f"no alpha: a limiting Hs of {show(hs, 'length')} is below the {show(table.Hs[0], 'length')} of the"
            " table: case by case. Agree a factor with your warranty surveyor, and enter it in your project's table"
            f" ({OPTION})."
        )
    return float(alphas(table, np.array([hs]), T_POP)[0]), ""


def _hours(time: float) -> str:
    return f"{time / 3600.0:g} h"
