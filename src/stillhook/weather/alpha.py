"""Alpha factors: what a limiting wave height must be lowered by because forecasts err, and whether an operation is
weather restricted.

OP_WF = alpha OP_LIM; T_R = T_POP + T_C, and 2 T_POP where the contingency time T_C is not assessed. Alpha steps with
T_POP (each row counts up to and including its time) and is interpolated along straight lines in Hs; above the highest
Hs of the table it stays, below the lowest it is "case by case": none is made up. Source: DNV-OS-H101 section 4
(recalled: check against your edition); tables are files of their own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.nearest import nearest
from stillhook.errors import StillhookError, WeatherError
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import parsed, toml_text
from stillhook.units import parse, quote, show

DEFAULT = "dnv-os-h101"
_SHELF = Path(__file__).resolve().parent / "alpha_tables"
_TEXTS = ("title", "version", "standard", "edition", "clause", "note")
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
        parts = (
            t["standard"],
            t["edition"] and f"({t['edition']})",
            t["clause"],
            f"table file {self.name} version {t['version']}",
        )
        return ", ".join(p for p in (" ".join(p for p in parts[:3] if p), parts[3], t["note"]) if p)


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
        return dict(vars(self))


def alpha_tables() -> tuple[str, ...]:
    """Names of the tables that come with the package."""
    return tuple(sorted(file.stem for file in _SHELF.glob("*.toml")))


def load_alpha_table(name_or_path: str = DEFAULT, option: str = "--table") -> AlphaTable:
    """A table by name or from a file of one's own; option by which it was asked for.

    Errors: WeatherError of one line that names file and field.
    """
    path = Path(name_or_path)
    if name_or_path not in alpha_tables() and not path.suffix:
        raise WeatherError(
            f"{option} {quote(name_or_path)}: no such table of alpha factors. There are {', '.join(alpha_tables())}"
            f"{nearest(name_or_path, alpha_tables())[:-1]}, or give a TOML file."
        )
    file = _SHELF / f"{name_or_path}.toml" if name_or_path in alpha_tables() else path
    try:
        return _table(
            parsed(toml_text(file), file.name, FileKind.ALPHA, start=f"Copy {DEFAULT}.toml and change it."),
            file.stem,
            file.name,
        )
    except StillhookError as e:
        raise WeatherError(str(e)) from None


def _table(data: dict[str, Any], name: str, where: str) -> AlphaTable:
    allowed = (*_TEXTS, "Hs", "row", "restricted")
    for key in data:
        if key not in allowed:
            raise WeatherError(f"{where}: {key}: unknown field. Allowed: {', '.join(allowed)}{nearest(key, allowed)}")
    rows, heights, ends = data.get("row"), data.get("Hs"), data.get("restricted")
    if (
        not isinstance(rows, list)
        or not rows
        or not all(isinstance(r, dict) and set(r) == {"T_POP", "alpha"} for r in rows)
    ):
        raise WeatherError(f'{where}: row: give one [[row]] or more, each with T_POP = "12 h" and alpha = [...].')
    if not isinstance(heights, list) or not heights:
        raise WeatherError(f'{where}: Hs = {quote(heights)}: give the heights of the columns, ["1 m", "2 m"].')
    if not isinstance(ends, dict) or set(ends) != {"T_POP_below", "T_R_below"}:
        raise WeatherError(f'{where}: restricted: give [restricted] with T_POP_below = "72 h" and T_R_below = "96 h".')
    Hs = tuple(parse(h, "length", f"{where}: Hs[{i}]") for i, h in enumerate(heights))
    T_POP = tuple(parse(r["T_POP"], "hours", f"{where}: row[{i}].T_POP") for i, r in enumerate(rows))
    for field_name, ascending in (("Hs", Hs), ("T_POP", T_POP)):
        if any(b <= a for a, b in zip((0.0, *ascending), ascending, strict=False)):
            raise WeatherError(f"{where}: {field_name}: must rise from above 0. Put columns and rows in order.")
    texts = {key: data.get(key, "") for key in _TEXTS}
    if any(not isinstance(text, str) for text in texts.values()) or not texts["standard"]:
        raise WeatherError(f"{where}: {', '.join(_TEXTS)}: give texts; standard says what the factors are from.")
    alpha = tuple(_row(r["alpha"], len(Hs), f"{where}: row[{i}].alpha") for i, r in enumerate(rows))
    T_POP_below, T_R_below = (
        parse(ends[key], "hours", f"{where}: restricted.{key}") for key in ("T_POP_below", "T_R_below")
    )
    return AlphaTable(name, Hs, T_POP, alpha, T_POP_below, T_R_below, texts)


def _row(numbers: Any, count: int, where: str) -> tuple[float, ...]:
    if not isinstance(numbers, list) or len(numbers) != count:
        raise WeatherError(f"{where} = {quote(numbers)}: give {count} numbers, one for each Hs.")
    if any(isinstance(x, bool) or not isinstance(x, int | float) or not 0.0 < x <= 1.0 for x in numbers):
        raise WeatherError(f"{where} = {quote(numbers)}: alpha lies above 0 and up to 1.")
    return tuple(float(x) for x in numbers)


def alpha_of(table: AlphaTable, hs: float, T_POP: float, T_C: float | None = None, *, option: str = "--table") -> Alpha:
    """Alpha of an operation with limiting height hs [m] (its OP_LIM) and planned time T_POP [s]; T_C contingency [s],
    None: not assessed; option: by which a command takes a table of one's own, for what is said where the table leaves
    the factor open.

    Errors: WeatherError for a height or time that is not above 0, and a contingency below 0.
    """
    if not (0.0 < hs < math.inf) or not (0.0 < T_POP < math.inf) or (T_C is not None and not (0.0 <= T_C < math.inf)):
        raise WeatherError(
            f"alpha: Hs {hs:g} m, T_POP {T_POP:g} s, T_C {'not assessed' if T_C is None else f'{T_C:g} s'}: height and"
            " time must be above 0, the contingency not below. Check the numbers."
        )
    T_R, restricted = reference_period(table, T_POP, T_C)
    alpha, reason = _alpha(table, hs, T_POP, option)
    if not restricted and not reason:
        reason = _unrestricted(table, T_POP, T_R)
    op_wf = None if alpha is None else alpha * hs
    return Alpha(hs, T_POP, T_R - T_POP, T_R, alpha, op_wf, restricted, reason, table.source)


def reference_period(table: AlphaTable, T_POP: float, T_C: float | None = None) -> tuple[float, bool]:
    """T_R = T_POP + T_C [s], twice T_POP where T_C is not assessed (None); and whether the operation may be weather
    restricted."""
    T_R = T_POP + (T_POP if T_C is None else T_C)
    return T_R, T_POP < table.T_POP_below - _ROUND and T_R < table.T_R_below - _ROUND


def alphas(table: AlphaTable, Hs: FloatArray, T_POP: float) -> FloatArray:
    """Alpha of limiting heights Hs [m], same shape; NaN where the table gives none (see `alpha_of`) and for Hs that are
    no numbers."""
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


def _alpha(table: AlphaTable, hs: float, T_POP: float, option: str) -> tuple[float | None, str]:
    if T_POP > table.T_POP[-1] + _ROUND:
        return (
            None,
            (
                f"no alpha: T_POP {_hours(T_POP)} is beyond the {_hours(table.T_POP[-1])} of the table, and the"
                " operation is not weather restricted. Plan for extremes of the season, or divide the operation."
            ),
        )
    if hs < table.Hs[0] - _ROUND:
        return (
            None,
            (
                f"no alpha: a limiting Hs of {show(hs, 'length')} is below the {show(table.Hs[0], 'length')} of the"
                " table: case by case. Agree a factor with your warranty surveyor, and put it into a table of your own"
                f" ({option})."
            ),
        )
    return float(alphas(table, np.array([hs]), T_POP)[0]), ""


def _hours(time: float) -> str:
    return f"{time / 3600.0:g} h"
