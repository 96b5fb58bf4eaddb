"""Cranes and scenarios with drawn factors: quickly for a batch, and with every check and source for one that is looked
at."""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.analysis.uncertainty.factors import CASE, FACTORS, missing
from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import gains
from stillhook.engine.scenario.checks import check
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.library.crane_file.write import file_value, items
from stillhook.spec.crane import Crane, SourceKind
from stillhook.spec.scenario import Scenario

Pair = tuple[Crane, Scenario]

SETS = {"friction": "friction.system", "motor_loss": "{circuit}.motor.loss"}
"""Factors that may be drawn from a set with evidence, and the table of its parameters; their columns are
"friction.Y_1", ..."""
ASSUMED = {"active.pump.leak_scale": 1.0, "passive.pump.leak_scale": 1.0}
"""Value of a field that a crane does not give."""
HELD = ("pump_servo", "pump_zeta")
"""Factors that the PLC does not know of: its K_2 is that of the crane that it was set up for."""


class Drawing:
    """How the columns of a table of draws change one crane and scenario.

    columns: names of factors, or "friction.Y_1" and so on for the parameters of a set. The crane must hold the set's
    own values. A factor that changes nothing here (`Factor.absent`) is left out; one that scales a parameter of a set
    scales what is drawn of it.
    """

    def __init__(self, crane: Crane, case: Scenario, columns: Sequence[str]) -> None:
        self.crane, self.case, self.columns = crane, case, tuple(columns)
        self._scales: dict[str, list[tuple[int, float]]] = {}
        self._set: dict[str, int] = {}
        for k, name in enumerate(columns):
            self._take(name, k)
        self._held = {}
        if any(name in HELD for name in columns) and crane.control.K_2 is None:
            self._held["control.K_2"] = gains(crane).K_2

    def _take(self, name: str, k: int) -> None:
        if "." in name:
            self._take_parameter(name, k)
            return
        if FACTORS[name].absent(self.crane, self.case):
            return
        for path, share in FACTORS[name].targets:
            if missing(self.crane, path):
                continue
            if share is None:
                self._set[path] = k
            else:
                self._scales.setdefault(path, []).append((k, share(self.crane)))

    def _take_parameter(self, column: str, k: int) -> None:
        """A parameter of a set; a motor's loss belongs to every circuit with that motor."""
        name, parameter = column.split(".")
        if "{circuit}" not in SETS[name]:
            self._set[f"{SETS[name]}.{parameter}"] = k
            return
        motor = self.crane.active.motor
        for circuit in (name for name, c in self.crane.circuits.items() if c.motor.D_max == motor.D_max):
            self._set[f"{SETS[name].format(circuit=circuit)}.{parameter}"] = k

    def values(self, draws: FloatArray) -> dict[str, FloatArray]:
        """Path -> value in every draw [SI], shape (n,); draws has shape (n, columns)."""
        out = {path: np.full(len(draws), x) for path, x in self._held.items()}
        out |= {path: draws[:, k] for path, k in self._set.items()}
        for path, parts in self._scales.items():
            x = out[path] if path in out else np.full(len(draws), self._base(path))
            for k, share in parts:
                x = x * (draws[:, k] if share == 1.0 else 1.0 + share * (draws[:, k] - 1.0))
            out[path] = x
        return out

    def _base(self, path: str) -> float:
        root: Any = self.case if path.startswith(CASE) else self.crane
        value = operator.attrgetter(path.removeprefix(CASE))(root)
        return ASSUMED[path] if value is None else float(value)

    def pairs(self, draws: FloatArray) -> Iterator[Pair]:
        """Crane and scenario of every draw. Untouched parts are those of the crane itself; nothing is checked (see
        `checked`)."""
        values = self.values(draws)
        of_crane = _tree({p: v.tolist() for p, v in values.items() if not p.startswith(CASE)})
        of_case = _tree({p.removeprefix(CASE): v.tolist() for p, v in values.items() if p.startswith(CASE)})
        for i in range(len(draws)):
            yield _copy(self.crane, of_crane, i), _copy(self.case, of_case, i)

    def checked(self, draw: FloatArray, label: str) -> Pair:
        """Crane and scenario of one draw, shape (columns,), through every check of a crane file; what goes into its
        sources.

        Errors: SpecError, ScenarioError of one line where they are no crane, or cannot be run.
        """
        values = self.values(draw[None, :])
        crane, case = next(self.pairs(draw[None, :]))
        tables: dict[str, Any] = {}
        for item in items(crane):
            if item.path in values:
                leaf = {
                    "value": file_value(item.value, item.quantity),
                    "kind": SourceKind.DERIVED.value,
                    "source": label,
                }
                *path, name = item.path.split(".")
                functools.reduce(lambda at, key: at.setdefault(key, {}), path, tables)[name] = leaf
        sound = changed(self.crane, tables) if tables else self.crane
        check(sound, case)
        return sound, case

    def check_ends(self, draws: FloatArray, *, crane: bool = True) -> None:
        """Refuse draws whose ends are no crane: every column at its least and largest value, the others at their middle
        draw.

        crane: False where this crane has been checked before, and the scenario alone is to be checked.
        Errors: as `checked`, naming the factor.
        """
        check(self.crane, self.case)  # what is wrong with nothing drawn is no factor's fault
        middle = np.median(draws, axis=0)
        wanted = [(k, name) for k, name in enumerate(self.columns) if crane or self._in_case(name)]
        for k, name in wanted:
            for x in sorted({float(draws[:, k].min()), float(draws[:, k].max())}):
                one = middle.copy()
                one[k] = x
                try:
                    if crane:
                        self.checked(one, "end of a distribution")
                    else:
                        check(*next(self.pairs(one[None, :])))
                except StillhookError as problem:
                    raise type(problem)(f"factor {name} = {x:.4g}: {problem}") from None

    def _in_case(self, name: str) -> bool:
        """Whether a column changes the scenario."""
        return name in FACTORS and any(t.path.startswith(CASE) for t in FACTORS[name].targets)


def _tree(values: Mapping[str, list[float]]) -> dict[str, Any]:
    """Nested tables of columns from dotted paths."""
    out: dict[str, Any] = {}
    for path, column in values.items():
        *tables, name = path.split(".")
        functools.reduce(lambda at, key: at.setdefault(key, {}), tables, out)[name] = column
    return out


def _copy(record: Any, tree: Mapping[str, Any], i: int) -> Any:
    """The record with row i of the tree's columns; itself where there are none."""
    if not tree:
        return record
    new = {name: _copy(getattr(record, name), x, i) if isinstance(x, dict) else x[i] for name, x in tree.items()}
    return record.model_copy(update=new)
