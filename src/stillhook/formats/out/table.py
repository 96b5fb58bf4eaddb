"""What is written: columns over time, one table for each case, or numbers with a row for each case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from stillhook import units
from stillhook.errors import ConvertError
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray

TIME = "time"
ALIGNED = 1e-6
"""Part of the spacing by which a wanted spacing may miss a whole number of rows."""


@dataclass(frozen=True)
class Content:
    """Tables of numbers by case, one for each case of a run with series (time first), else one; unit and meaning of
    each column ("1" for no unit); facts of their origin; texts of the cases (status, notes) by name."""

    tables: Mapping[str, pd.DataFrame]
    units: Mapping[str, str]
    meanings: Mapping[str, str]
    facts: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def first(self) -> pd.DataFrame:
        """The table of the first case; all have the same columns."""
        return next(iter(self.tables.values()))

    @property
    def is_series(self) -> bool:
        """Whether rows are times."""
        return TIME in self.first.columns


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
    names = series or [n for n in numbers if set(run[n].dims) <= {"case"}]
    rows = {n: BY_NAME.get(n) for n in names}
    of_column = {n: str(run[n].attrs.get("units", row.unit if row is not None else "1")) for n, row in rows.items()}
    meanings = {
        n: str(run[n].attrs.get("long_name", row.meaning if row is not None else "")) for n, row in rows.items()
    }
    if not series:
        return Content(
            {"": _frame(run, names)}, of_column, meanings, facts, texts | ({"case": tuple(cases)} if several else {})
        )
    tables = {case: _frame(run.isel(case=i) if several else run, [TIME, *names]) for i, case in enumerate(cases)}
    return Content(tables, {TIME: "s"} | of_column, {TIME: "time"} | meanings, facts, texts)


def _frame(run: xarray.Dataset, names: Sequence[str]) -> pd.DataFrame:
    return pd.DataFrame({n: np.atleast_1d(np.asarray(run[n].values, dtype=np.float64)) for n in names})


def chosen(
    content: Content, *, signals: Sequence[str] = (), case: str | None = None, every: str | None = None
) -> Content:
    """Part of what there is: signals by name, in this order; a case by its name or number from 0; every so much time.

    Errors: ConvertError, one line, for a name, case or spacing that is not there.
    """
    tables = dict(content.tables)
    if case is not None:
        names = list(tables)
        place = names.index(case) if case in names else int(case) if case.isdecimal() else -1
        if not 0 <= place < len(names):
            shown = ", ".join(units.quote(n) for n in names if n) or "one case without a name"
            raise ConvertError(f"--case {units.quote(case)}: there is {shown}, or a number from 0 to {len(names) - 1}.")
        tables = {names[place]: tables[names[place]]}
    columns = list(content.first.columns)
    if unknown := [s for s in signals if s not in columns]:
        shown = ", ".join(n for n in columns if n != TIME)
        raise ConvertError(f"--signals: {units.quote(unknown[0])} is not there. Choose from {shown}.")
    kept = [s for s in signals if s != TIME] or [n for n in columns if n != TIME]
    kept = [TIME, *kept] if content.is_series else kept
    step = 1 if every is None else _rows_in(content, units.parse(every, "time", "--every"))
    return replace(content, tables={name: table[kept].iloc[::step] for name, table in tables.items()})


def _rows_in(content: Content, every: float) -> int:
    """Rows in a spacing of time [s]."""
    if not content.is_series:
        raise ConvertError("--every: belongs to time series, and there is none. Leave it out.")
    t = content.first[TIME].to_numpy()
    spacing = float(t[1] - t[0]) if len(t) > 1 else every
    n = round(every / spacing)
    if n < 1 or abs(every / spacing - n) > ALIGNED * n:
        raise ConvertError(
            f"--every {units.show(every, 'time')}: give a whole number of {units.show(spacing, 'time')}."
        )
    return n
