"""The numbers of a run that have no time, as a mapping and as a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from stillhook.report.formatting import cell
from stillhook.tables.html import table
from stillhook.variables import BY_NAME

if TYPE_CHECKING:
    import xarray

FIRST = ("status", "e_c_pp", "eta_c", "e_c_max", "u_p_max", "saturation_time", "p_max", "F_w_max", "F_sling_max", "DAF")
"""Numbers that a summary shows first, where a run has them."""
ROWS = 20
"""Cases that a table shows."""


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
