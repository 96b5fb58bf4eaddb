"""`run.stillhook` on every Dataset: its summary, its series, its figure. Registered when xarray is first loaded."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

import xarray

from stillhook.errors import StillhookError
from stillhook.report.formatting import cell
from stillhook.tables.html import table
from stillhook.variables import BY_NAME

FIRST = ("status", "e_c_pp", "eta_c", "e_c_max", "u_p_max", "saturation_time", "p_max", "F_w_max", "F_sling_max", "DAF")
"""Numbers that a summary shows first, where a run has them."""
ROWS = 20
"""Cases that a table shows."""
FIGURES = "run, lowering, map, envelope, settings, uncertainty"
NAMES = ("plot", "series", "summary")


class Summary(Mapping[str, Any]):
    """The numbers of a run that have no time: by name, in SI; over cases an array each."""

    def __init__(self, data: xarray.Dataset) -> None:
        self._data = data[[name for name, x in data.data_vars.items() if x.dims in ((), ("case",))]]

    def __getitem__(self, name: str) -> Any:
        """A number or text; an array over the cases where there are several. Errors: KeyError."""
        value = self._data.data_vars[name].values
        return value.item() if value.ndim == 0 else value

    def __iter__(self) -> Iterator[str]:
        return (str(name) for name in self._data.data_vars)

    def __len__(self) -> int:
        return len(self._data.data_vars)

    def __dir__(self) -> list[str]:
        return ["items", "keys", "meaning", "unit", "values"]

    def unit(self, name: str) -> str:
        """SI unit of a number; empty for a text."""
        return str(self._data[name].attrs.get("units", ""))

    def meaning(self, name: str) -> str:
        """What a number is."""
        words = BY_NAME[name].meaning if name in BY_NAME else ""
        return words.partition(":")[0] if name == "status" else words

    def _rows(self) -> tuple[tuple[str, ...], list[list[str]]]:
        """Head and rows: a row for each number of one run, for each case of several."""
        first = [name for name in FIRST if name in self]
        if "case" not in self._data.dims:
            order = [*first, *(name for name in self if name not in first)]
            return ("", "", ""), [[name, cell(name, self[name]), self.meaning(name)] for name in order]
        labels = [str(label) for label in self._data["case"].values[:ROWS]]
        columns = {name: self._data[name].values[:ROWS].tolist() for name in first}
        rows = [[label, *(cell(name, columns[name][i]) for name in first)] for i, label in enumerate(labels)]
        return ("case", *first), rows

    def __repr__(self) -> str:
        head, rows = self._rows()
        every = [list(head), *rows] if any(head) else rows
        width = [max(len(row[i]) for row in every) for i in range(len(head) - 1)]
        lines = ["  ".join([*(f"{c:<{w}}" for c, w in zip(row, width, strict=False)), row[-1][:80]]) for row in every]
        return "\n".join([*lines, *self._left_out()])

    def _left_out(self) -> list[str]:
        left = self._data.sizes.get("case", 0) - ROWS
        return [f"and {left} more cases"] if left > 0 else []

    def _repr_html_(self) -> str:
        head, rows = self._rows()
        if any(head):
            return table(rows, head) + "".join(f"<p>{line}</p>" for line in self._left_out())
        n = sum(name in self for name in FIRST)
        return f"{table(rows[:n])}<details><summary>{len(rows) - n} more numbers</summary>{table(rows[n:])}</details>"


@xarray.register_dataset_accessor("stillhook")  # type: ignore[no-untyped-call]
class Accessor:
    """A Dataset of Stillhook: its summary, its series, its figure."""

    def __init__(self, data: xarray.Dataset) -> None:
        self._data = data

    def __dir__(self) -> list[str]:
        return list(NAMES)

    @property
    def summary(self) -> Summary:
        """The numbers of a run that have no time, by name, with units."""
        return Summary(self._data)

    @property
    def series(self) -> xarray.Dataset:
        """What is stored over time, alone."""
        return self._data[[name for name, x in self._data.data_vars.items() if "time" in x.dims]]

    def plot(self, **options: Any) -> Any:
        """The figure of what this is: a run, a lowering, a map, an envelope, settings or uncertainty.

        Parameters
        ----------
        **options
            Those of the function in `stillhook.plot` with this name.

        Returns
        -------
        Figure
            Of matplotlib.

        Raises
        ------
        StillhookError
            One line, for a Dataset that has no figure.
        """
        from stillhook import plot

        return getattr(plot, self._figure)(self._data, **options)

    @property
    def _figure(self) -> str:
        """Name of the function in `stillhook.plot`. Errors: StillhookError."""
        data = self._data
        tests = {
            "run": "scenarios" in data.attrs,
            "lowering": "lowerings" in data.attrs,
            "map": {"cause", "applicable"} <= set(data.data_vars),
            "envelope": "v_w_top" in data,
            "settings": "alpha_m_ideal" in data,
            "uncertainty": "at_values" in data.attrs,
        }
        name = next((name for name, holds in tests.items() if holds), None)
        if name is None:
            raise StillhookError(
                f"plot: no figure of this Dataset. There are those of {FIGURES}; others by stillhook.plot."
            )
        return name

    def __repr__(self) -> str:
        return repr(self.summary)

    def _repr_html_(self) -> str:
        """Title, summary, and the Dataset below."""
        title = escape(str(self._data.attrs.get("title", "Stillhook")))
        return f"<div><b>{title}</b>{self.summary._repr_html_()}{self._data._repr_html_()}</div>"
