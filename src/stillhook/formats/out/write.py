"""Writes a table in the format that a file's name, or the user, says. A format is a row of `FORMATS`.

CSV and Parquet: a column for each name with its unit in the heading, as Stillhook's log reader takes them; series of
several cases stand below one another with the case in the first column. Numbers read back to the same doubles.
MAT of version 5: `time` and a vector for each name, `units` beside, of several cases a struct for each. MDF 4: a
channel group for each case with time, units and meanings; origin in the header's comment.

Time histories as text: OrcaFlex with tabs and a line of column names, the time in the first column [s] (OrcaFlex help,
pages "Time history data" and "Time history files", Orcina, 2024); SIMA and SIMO with names in a line that begins with #
and blanks between columns (what is public of SIMO's text series, as read by QATS, DNV, 2024). Lengths are in m, forces
in kN, masses in te, as theirs are. Not tried in either program.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from stillhook import units
from stillhook.base.atomic import atomic_file
from stillhook.base.extras import need
from stillhook.errors import ConvertError
from stillhook.formats.out.table import TIME, Content

IN_KILO = {"N": "kN", "N m": "kN.m", "kg": "te", "W": "kW", "Pa": "kPa", "J": "kJ"}
"""Units that OrcaFlex and SIMO count in thousands."""
LONGEST = 63
"""Letters in a name of MATLAB's."""


class Format(NamedTuple):
    """Ending of a file, name of the format in words, and what writes it. series: it holds time series alone; library:
    what it takes of the extras."""

    suffix: str
    title: str
    write: Callable[[Content, Path], None]
    series: bool = False
    library: str = ""


def _csv(content: Content, file: Path) -> None:
    _one_table(content).to_csv(file, index=False, lineterminator="\n")


def _parquet(content: Content, file: Path) -> None:
    import polars as pl

    columns = {name: column.tolist() for name, column in _one_table(content).items()}
    pl.DataFrame(columns).write_parquet(file, metadata=dict(content.facts))


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
            signals = [
                Signal(table[n].to_numpy(), t, name=n, unit=content.units[n], comment=content.meanings[n])
                for n in names
            ]
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
    "parquet": Format(".parquet", "Parquet", _parquet, library="polars"),
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
            shown = ", ".join(SUFFIXES)
            raise ConvertError(
                f"{file}: {units.quote(suffix)} is no ending of a format. Choose one of {shown}, or --format."
            )
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
        raise ConvertError(
            f"{chosen.title}: holds time series, and there is none. Run with series, or choose csv or mat."
        )
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
