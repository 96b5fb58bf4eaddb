"""The log of a PLC: of every cycle the inputs that it saw and the outputs that it gave."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LiveError
from stillhook.live.hil.controller import INPUTS, OUTPUTS, SIGNALS
from stillhook.live.hil.script import kind_of_input
from stillhook.logs.formats.open import open_log
from stillhook.logs.formats.source import Want
from stillhook.logs.log import unit_of
from stillhook.logs.mapping import factors, mapping_from, place_of, split_heading
from stillhook.units import KINDS

STATUS = {"cycle": "1", "time": "s", "lateness": "s", "sample": "1", "age": "s", "round_trip": "s"}
"""Columns before the inputs, and their units: number of the cycle; its deadline since the first one; how late it began;
number of the plant's cycle that it saw; how old that was when the controller acted on it; time for the answer."""
NEEDED = ("u_p", "u_m")
"""Outputs without which there is nothing to compare."""
USUAL = {name: 1.0 for name in INPUTS if name.startswith("q_")} | {"reset": 0.0}
"""Inputs that a log may leave out."""
DISTINCT, FEW_DIGITS, MOST_DIGITS = 50, 3, 10
"""Values that a column has at least for its rounding to be seen, or decimals in place of that; decimals at most."""
PIECE = 1 << 22
"""Bytes of a log that are read at once."""


def unit(name: str) -> str:
    """SI unit of an input or output."""
    kind = "length" if name == "e_c" else kind_of_input(name)
    return KINDS[kind].si if kind else "1"


HEADINGS = tuple(f"{name} [{u}]" for name, u in STATUS.items()) + tuple(f"{n} [{unit(n)}]" for n in (*INPUTS, *OUTPUTS))


class PlcLog:
    """A CSV log that is written cycle by cycle, as a context: every number with all its digits.

    Errors: LiveError where the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> PlcLog:
        with self._in_one_line():
            self._file = self._path.open("w", encoding="utf-8", newline="\n")
            self._file.write(",".join(HEADINGS) + "\n")
        return self

    def __exit__(self, *of: object) -> None:
        with self._in_one_line():
            self._file.close()

    @contextmanager
    def _in_one_line(self) -> Iterator[None]:
        try:
            yield
        except OSError as problem:
            raise LiveError(f"{self._path}: {problem.strerror}. Give log another place in the PLC file.") from None

    def add(self, status: tuple[float, ...], inputs: FloatArray, outputs: FloatArray) -> None:
        """A cycle: numbers of `STATUS`, `INPUTS` and `OUTPUTS` [SI]."""
        with self._in_one_line():
            self._file.write(",".join(map(repr, (*status, *inputs.tolist(), *outputs.tolist()))) + "\n")

    def flush(self) -> None:
        """Let others see it."""
        with self._in_one_line():
            self._file.flush()


class Step(NamedTuple):
    """To what a number is rounded: a step [SI], and a part of the number itself [-]."""

    size: float
    share: float

    def half(self, values: FloatArray) -> FloatArray:
        """How far the number before may be from a rounded one [SI]."""
        return 0.5 * self.size + self.share * np.abs(np.where(np.isfinite(values), values, 0.0))


class Recorded(NamedTuple):
    """A log of a PLC: number of each cycle; inputs (n, len(INPUTS)); outputs by name, those that it has; steps to which
    its numbers seem to be rounded [SI]."""

    cycles: FloatArray
    inputs: FloatArray
    outputs: Mapping[str, FloatArray]
    steps: Mapping[str, Step]


def read_plc_log(path: Path, signals: Mapping[str, Any] | None, where: str) -> Recorded:
    """A log in any format: CSV, Parquet, MDF4, TDMS, MAT.

    Parameters: signals: rows of a mapping by name, as in `stillhook.logs.mapping`; None: headings such as "s_tip [m]".
    where: file of the mapping.

    Errors: LogError, LiveError, UnitError of one line: columns, inputs or cycles that are missing.
    """
    source = open_log(path)
    known = (*STATUS, *INPUTS, *OUTPUTS)
    if signals is None:
        heads = {split_heading(h)[0]: h for h in source.headings}
        signals = {name: heads[name] for name in known if name in heads}
    if unknown := [name for name in signals if name not in known]:
        raise LiveError(f"{where}: signals.{unknown[0]}: no input or output. Choose one of {', '.join(known)}.")
    rows = mapping_from({name: _with_quantity(name, row) for name, row in signals.items()}, where)
    missing = [name for name in (*INPUTS, *NEEDED) if name not in rows and name not in USUAL]
    if missing:
        raise LiveError(
            f"{path.name}: no column {', '.join(missing)}. Log it, or name its column in [signals] of the PLC file."
        )
    wants, scales = {}, {}
    for name, signal in rows.items():
        place = place_of(signal.column, source.headings, f"{source.name}: {name}")
        wants[name] = Want((place,), words=signal.words)
        scales[name] = factors(signal, unit_of(source, signal, place))
    pieces: dict[str, list[FloatArray]] = {name: [] for name in rows}
    for chunk in source.chunks(list(dict.fromkeys(wants.values())), PIECE):
        if chunk.broken:
            line, problem = chunk.broken[0]
            raise LiveError(f"{path.name}: line {line}: {problem}. Every cycle is needed: correct or cut the log.")
        for name, want in wants.items():
            pieces[name].append(np.asarray(chunk.values[want], dtype=np.float64))
    raw = {name: np.concatenate(each) if each else np.empty(0) for name, each in pieces.items()}
    columns = {name: scales[name][0] * values + scales[name][1] for name, values in raw.items()}
    n = min((len(column) for column in columns.values()), default=0)
    if n < 2:
        raise LiveError(f"{path.name}: {n} cycles. Give a log of two cycles or more.")
    cycles = columns.get("cycle", np.arange(n, dtype=np.float64))
    if (gaps := np.flatnonzero(np.diff(cycles) != 1.0)).size:
        k = int(gaps[0])
        raise LiveError(
            f"{path.name}: cycle {cycles[k]:.0f} is followed by {cycles[k + 1]:.0f}. Every cycle is needed: cut the log"
            " there."
        )
    inputs = np.column_stack([columns[name] if name in columns else np.full(n, USUAL[name]) for name in INPUTS])
    steps = {name: _step(raw[name], abs(scales[name][0])) for name in (*SIGNALS, *OUTPUTS) if name in raw}
    return Recorded(
        cycles,
        inputs,
        {name: columns[name] for name in OUTPUTS if name in columns},
        {name: step for name, step in steps.items() if step is not None},
    )


def _step(raw: FloatArray, factor: float) -> Step | None:
    """To what numbers of a file seem to be rounded: to decimals, or to single precision; None where to neither, or
    where that cannot be said of so few."""
    values = np.unique(raw[np.isfinite(raw)])
    for digits in range(-3, MOST_DIGITS):
        with np.errstate(all="ignore"):
            scaled = values * 10.0**digits
            integers = np.abs(scaled - np.rint(scaled)) <= 1e-12 * np.abs(scaled)
        if integers.all():
            return Step(factor * 10.0**-digits, 0.0) if len(values) >= DISTINCT or digits >= FEW_DIGITS else None
    with np.errstate(all="ignore"):
        return Step(0.0, 2.0**-24) if np.array_equal(values.astype(np.float32).astype(np.float64), values) else None


def _with_quantity(name: str, row: Any) -> Any:
    """A row of a mapping with what the signal measures, which the variables of a log do not name."""
    kind = "time" if STATUS.get(name) == "s" else "length" if name == "e_c" else kind_of_input(name)
    table = {"column": row} if isinstance(row, str | int) else row
    if name in ("time", "s_tip", "v_tip", "a_tip") or not isinstance(table, Mapping) or "quantity" in table:
        return table
    return {**table, "quantity": kind}


assert not set(STATUS) & {*SIGNALS, *OUTPUTS}
