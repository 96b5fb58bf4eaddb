"""What is written: columns over time, one table for each case, or numbers with a row for each case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stillhook import units
from stillhook.base.arrays import FloatArray
from stillhook.errors import ConvertError
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray

TIME = "time"
ALIGNED = 1e-6
"""Part of the spacing by which a wanted spacing may miss a whole number of rows."""


@dataclass(frozen=True)
class Column:
    """Numbers of one name: unit as in `stillhook.variables` ("1" for none), meaning in words."""

    name: str
    values: FloatArray
    unit: str = "1"
    meaning: str = ""


@dataclass(frozen=True)
class Table:
    """A table: name of the case; columns of one length; time first where it is a series."""

    name: str
    columns: tuple[Column, ...]

    @property
    def is_series(self) -> bool:
        """Whether its rows are times."""
        return bool(self.columns) and self.columns[0].name == TIME


@dataclass(frozen=True)
class Content:
    """Tables, one for each case of a run with series, else one; facts of their origin; texts of the cases (status,
    notes) by name."""

    tables: tuple[Table, ...]
    facts: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def of_run(run: xarray.Dataset) -> Content:
    """Of a run that `load_run` gave: its series where it has some, else its numbers with a row for each case."""
    cases = [str(c) for c in np.atleast_1d(run["case"].values)] if "case" in run.coords else [""]
    several = "case" in run.dims
    facts = {k: str(v) for k, v in run.attrs.items() if k in ("title", "crane", "scenarios", "twin")}
    facts |= {k: str(run.attrs[k]) for k in ("stillhook_version", "stillhook_kernel", "step") if k in run.attrs}
    texts = {
        str(n): tuple(str(x) for x in np.atleast_1d(run[n].values)) for n in run.data_vars if run[n].dtype.kind in "OUS"
    }
    numbers = [n for n in map(str, run.data_vars) if run[n].dtype.kind in "fiub"]
    series = [n for n in numbers if TIME in run[n].dims]
    if series:
        t = Column(TIME, np.asarray(run[TIME].values, dtype=np.float64), "s", "time")
        tables = []
        for i, case in enumerate(cases):
            one = run.isel(case=i) if several else run
            tables.append(Table(case, (t, *(_column(n, one[n]) for n in series))))
        return Content(tuple(tables), facts, texts)
    plain = [n for n in numbers if set(run[n].dims) <= {"case"}]
    rows = tuple(_column(n, run[n]) for n in plain)
    return Content((Table("", rows),), facts, texts | ({"case": tuple(cases)} if several else {}))


def _column(name: str, values: xarray.DataArray) -> Column:
    attrs = values.attrs
    row = BY_NAME.get(name)
    unit = str(attrs.get("units", row.unit if row is not None else "1"))
    meaning = str(attrs.get("long_name", row.meaning if row is not None else ""))
    return Column(name, np.atleast_1d(np.asarray(values.values, dtype=np.float64)), unit, meaning)


def chosen(
    content: Content, *, signals: Sequence[str] = (), case: str | None = None, every: str | None = None
) -> Content:
    """Part of what there is: signals by name, in this order; a case by its name or number from 0; every so much time.

    Errors: ConvertError, one line, for a name, case or spacing that is not there.
    """
    tables = list(content.tables)
    if case is not None:
        names = [t.name for t in tables]
        place = names.index(case) if case in names else int(case) if case.isdecimal() else -1
        if not 0 <= place < len(tables):
            shown = ", ".join(units.quote(n) for n in names if n) or "one case without a name"
            raise ConvertError(
                f"--case {units.quote(case)}: there is {shown}, or a number from 0 to {len(tables) - 1}."
            )
        tables = [tables[place]]
    made = []
    for table in tables:
        columns = {c.name: c for c in table.columns}
        if unknown := [s for s in signals if s not in columns]:
            shown = ", ".join(n for n in columns if n != TIME)
            raise ConvertError(f"--signals: {units.quote(unknown[0])} is not there. Choose from {shown}.")
        kept = [columns[s] for s in signals if s != TIME] or [c for c in table.columns if c.name != TIME]
        if table.is_series:
            kept = [columns[TIME], *kept]
        step = 1 if every is None else _rows_in(table, units.parse(every, "time", "--every"))
        made.append(Table(table.name, tuple(Column(c.name, c.values[::step], c.unit, c.meaning) for c in kept)))
    return Content(tuple(made), content.facts, content.texts)


def _rows_in(table: Table, every: float) -> int:
    """Rows in a spacing of time [s]."""
    if not table.is_series:
        raise ConvertError("--every: belongs to time series, and there is none. Leave it out.")
    t = table.columns[0].values
    spacing = float(t[1] - t[0]) if len(t) > 1 else every
    n = round(every / spacing)
    if n < 1 or abs(every / spacing - n) > ALIGNED * n:
        raise ConvertError(
            f"--every {units.show(every, 'time')}: give a whole number of {units.show(spacing, 'time')}."
        )
    return n


def check_series(content: Content, form: str) -> None:
    """Refuse numbers without a time. Errors: ConvertError."""
    if not content.tables[0].is_series:
        raise ConvertError(f"{form}: holds time series, and there is none. Run with series, or choose csv or mat.")


def series_of(content: Content, form: str) -> Table:
    """The only time series. Errors: ConvertError where there is none, or several."""
    check_series(content, form)
    if len(content.tables) > 1:
        names = ", ".join(units.quote(t.name) for t in content.tables[:6])
        raise ConvertError(f"{form}: holds one case, and there are {names}. Choose one with --case.")
    return content.tables[0]


def heading(column: Column) -> str:
    """Name and unit, as Stillhook's log reader takes them: "p_a [Pa]", "u_p [1]"."""
    return f"{column.name} [{column.unit}]" if column.unit else column.name


def number(x: float) -> str:
    """A number that reads back to the same double; nothing for one that is missing."""
    return "" if x != x else repr(float(x))
