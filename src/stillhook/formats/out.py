"""Runs and logs as tables of other programs: columns over time, one table for each case, or numbers with a row for each
case, written in the format that a file's name, or the user, says. A format is a row of `FORMATS`.

CSV and Parquet: a column for each name with its unit in the heading, as Stillhook's log reader takes them; series of
several cases are below one another with the case in the first column. Numbers read back to the same doubles.
MAT of version 5: `time` and a vector for each name, `units` next to them, of several cases a struct for each. MDF 4: a
channel group for each case with time, units and meanings; origin in the header's comment.

Time histories as text: OrcaFlex with tabs and a line of column names, the time in the first column [s] (OrcaFlex help,
pages "Time history data" and "Time history files", Orcina, 2024); SIMA and SIMO with names in a line that begins with #
and blanks between columns (what is public of SIMO's text series, as read by QATS, DNV, 2024). Lengths are in m, forces
in kN, masses in te, as theirs are. Not tried in either program.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from stillhook import units
from stillhook.base.atomic import atomic_file
from stillhook.base.extras import need
from stillhook.errors import ConvertError
from stillhook.formats.table import parquet
from stillhook.formats.table.cells import csv_of
from stillhook.formats.table.workbook import Sheet, write_sheets
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray

TIME = "time"
ALIGNED = 1e-6
"""Part of the spacing by which a wanted spacing may miss a whole number of rows."""
IN_KILO = {"N": "kN", "N m": "kN.m", "kg": "te", "W": "kW", "Pa": "kPa", "J": "kJ"}
"""Units that OrcaFlex and SIMO count in thousands."""
LONGEST = 63
"""Letters in a name of MATLAB's."""


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
        texts |= {"case": tuple(cases)} if several else {}
        return Content({"": _frame(run, names)}, of_column, meanings, facts, texts)
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
        do = f"give a whole number of {units.show(spacing, 'time')}."
        raise ConvertError(f"--every {units.show(every, 'time')}: {do}")
    return n


class Format(NamedTuple):
    """Ending of a file, name of the format in words, and what writes it. series: it holds time series alone; library:
    what it takes of the extras."""

    suffix: str
    title: str
    write: Callable[[Content, Path], None]
    series: bool = False
    library: str = ""


def _csv(content: Content, file: Path) -> None:
    file.write_text(csv_of(_one_table(content)), encoding="utf-8", newline="")


def _xlsx(content: Content, file: Path) -> None:
    table = _one_table(content)
    rows = table.itertuples(index=False, name=None)
    write_sheets([Sheet("run", list(table.columns), list(rows))], file, ConvertError)


def _parquet(content: Content, file: Path) -> None:
    columns = {str(name): column.to_numpy() for name, column in _one_table(content).items()}
    parquet.write_table(columns, content.facts, file)


def _one_table(content: Content) -> pd.DataFrame:
    """All cases below one another, with units in the headings; texts of cases next to numbers with a row for each."""
    headings = {name: f"{name} [{unit}]" if unit else name for name, unit in content.units.items()}
    table = pd.concat(content.tables.values(), ignore_index=True).rename(columns=headings)
    if content.is_series:
        cases = [case for case, rows in content.tables.items() for _ in range(len(rows))]
        texts = {"case": cases} if len(content.tables) > 1 else {}
    else:
        texts = {name: list(column) for name, column in content.texts.items()}
    if "case" in texts:
        table.insert(0, "case", texts.pop("case"))
    return table.assign(**texts)


def _mat(content: Content, file: Path) -> None:
    from scipy.io import savemat

    data: dict[str, Any] = {}
    if len(content.tables) == 1:
        data |= _vectors(content.first)
    else:
        data |= {_name(case, i): _vectors(table) for i, (case, table) in enumerate(content.tables.items())}
        data["cases"] = np.array(list(content.tables), dtype=object)
    data["units"] = {_name(name, k): content.units[name] for k, name in enumerate(content.first.columns)}
    data["facts"] = {_name(name, 0): text for name, text in content.facts.items()}
    data |= {_name(name, 0): np.array(values, dtype=object) for name, values in content.texts.items()}
    with file.open("wb") as stream:
        savemat(stream, data, long_field_names=True, oned_as="column")


def _vectors(table: pd.DataFrame) -> dict[str, Any]:
    return {_name(name, k): table[name].to_numpy() for k, name in enumerate(table.columns)}


def _name(text: str, i: int) -> str:
    """A name of MATLAB's."""
    name = re.sub(r"\W", "_", text)[:LONGEST]
    return name if re.match(r"[A-Za-z]", name) else f"case_{i}_{name}"[:LONGEST]


def _mdf(content: Content, file: Path) -> None:
    from asammdf import MDF, Signal

    made = MDF(version="4.10")
    try:
        for case, table in content.tables.items():
            t, names = table[TIME].to_numpy(), [name for name in table.columns if name != TIME]
            of = [{"name": n, "unit": content.units[n], "comment": content.meanings[n]} for n in names]
            signals = [Signal(table[each["name"]].to_numpy(), t, **each) for each in of]
            made.append(signals, acq_name=case or "run", comment=case, common_timebase=True)
        made.header.comment = json.dumps({**content.facts, **{k: list(v) for k, v in content.texts.items()}})
        made.save(file, overwrite=True)
    finally:
        made.close()


def _orcaflex(content: Content, file: Path) -> None:
    _in_kilo(content).rename(columns={TIME: "Time"}).to_csv(file, sep="\t", index=False, lineterminator="\n")


def _sima(content: Content, file: Path) -> None:
    table = _in_kilo(content)
    rows = table.to_csv(sep=" ", index=False, header=False, na_rep="nan", lineterminator="\n")
    file.write_text(f"# {' '.join(table.columns)}\n{rows}", encoding="utf-8")


def _in_kilo(content: Content) -> pd.DataFrame:
    """The only time series. Errors: ConvertError where there are several."""
    if len(content.tables) > 1:
        names = ", ".join(units.quote(case) for case in list(content.tables)[:6])
        raise ConvertError(f"a time history holds one case, and there are {names}. Choose one with --case.")
    return content.first * [1e-3 if content.units[name] in IN_KILO else 1.0 for name in content.first.columns]


FORMATS = {
    "csv": Format(".csv", "text with commas", _csv),
    "xlsx": Format(".xlsx", "Excel", _xlsx, library="openpyxl"),
    "parquet": Format(".parquet", "Parquet", _parquet, library="duckdb"),
    "mat": Format(".mat", "MATLAB", _mat),
    "mdf": Format(".mf4", "MDF 4", _mdf, series=True, library="asammdf"),
    "orcaflex": Format(".txt", "OrcaFlex time history", _orcaflex, series=True),
    "sima": Format(".asc", "SIMA text series", _sima, series=True),
}
"""Formats by name."""
SUFFIXES = {form.suffix: name for name, form in FORMATS.items()} | {".mdf": "mdf"}


def format_of(file: str | Path, form: str | None = None) -> str:
    """The format by name, or by a file's suffix. Errors: ConvertError."""
    if form is None:
        suffix = Path(file).suffix.lower()
        if suffix not in SUFFIXES:
            do = f"Choose one of {', '.join(SUFFIXES)}, or --format."
            raise ConvertError(f"{file}: {units.quote(suffix)} is not an ending of a format. {do}")
        return SUFFIXES[suffix]
    if form not in FORMATS:
        raise ConvertError(f"--format {units.quote(form)}: choose one of {', '.join(FORMATS)}.")
    return form


def write_table(content: Content, file: str | Path, form: str | None = None) -> Path:
    """Write a table; the file appears under its name when it is complete. form: name of a format, by default that of
    the file's suffix. Errors: ConvertError, also where a library is missing or the format holds time series alone;
    SimulationError where the file cannot be written."""
    chosen = FORMATS[format_of(file, form)]
    if not content.tables or not content.first.size:
        raise ConvertError(f"{Path(file).name}: there is nothing to write.")
    if chosen.series and not content.is_series:
        raise ConvertError(f"{chosen.title}: holds time series, and there is none. Choose csv or mat.")
    if chosen.library:
        need(chosen.library, chosen.title, ConvertError)
    target = Path(file)
    with atomic_file(target) as part:
        scratch = part.with_suffix(chosen.suffix)  # some writers look at the suffix
        try:
            chosen.write(content, scratch)
            if scratch != part:
                scratch.replace(part)
        finally:
            if scratch != part:
                scratch.unlink(missing_ok=True)
    return target
