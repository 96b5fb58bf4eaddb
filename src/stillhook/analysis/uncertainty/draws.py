"""What is not known about a winch: factors with their distributions, from a table or a file, draws of them, and
cranes and scenarios with drawn factors."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import BaseModel, Field

from stillhook.analysis.uncertainty.factors import CASE, EXCLUSIVE, FACTORS, Distribution, distribution, missing
from stillhook.base.arrays import FloatArray, copied
from stillhook.base.choice import nearest
from stillhook.base.gateway.named_files import named_path
from stillhook.engine.pack.settings import ASSUMED
from stillhook.engine.pack.winch import gains, set_up_for
from stillhook.engine.scenario.checks import check
from stillhook.errors import SpecError, StillhookError
from stillhook.library import changed, load_friction, load_losses, set_toml
from stillhook.library.draws import draw
from stillhook.library.parameter_sets import FrictionSet, LossSet, is_path
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.library.toml.tree import nested
from stillhook.library.write import file_value, items
from stillhook.spec.crane import Crane, SourceKind
from stillhook.spec.scenario import Scenario
from stillhook.tables.table import Flag, Spec
from stillhook.units import quote
from stillhook.winches.circuits.losses import MJ4, X_NAMES, alternatives_of, loss_fields

Pair = tuple[Crane, Scenario]

SETS = {"friction": "friction.system", "motor_loss": "{circuit}.motor.loss"}
"""Factors that may be drawn from a set with evidence, and the table of its parameters; their columns are
"friction.Y_1", ..."""
MODEL = ".loss_model"
"""End of the paths whose value is a loss model."""
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
        self._of_model: dict[str, dict[str, int]] = {}
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
            loss = SETS[name].format(circuit=circuit)
            if parameter in X_NAMES:
                self._set[f"{loss}.{parameter}"] = k
            else:
                self._of_model.setdefault(f"{loss}_model", {})[parameter] = k

    def values(self, draws: FloatArray) -> dict[str, FloatArray]:
        """Path -> value in every draw [SI], shape (n,); draws has shape (n, columns)."""
        out = {path: np.full(len(draws), x) for path, x in self._held.items()}
        out |= {path: draws[:, k] for path, k in self._set.items() if not path.endswith(MODEL)}
        models = {path for path in self._set if path.endswith(MODEL)} | set(self._of_model)
        out |= {path: self._models(path, draws) for path in models}
        for path, parts in self._scales.items():
            if path.removesuffix(".scale") in models:
                continue
            x = out[path] if path in out else np.full(len(draws), self._base(path))
            for k, share in parts:
                x = x * (draws[:, k] if share == 1.0 else 1.0 + share * (draws[:, k] - 1.0))
            out[path] = x
        return out

    def _models(self, path: str, draws: FloatArray) -> Any:
        """The loss model of a set of motors in every draw, scaled as its loss is, the one in force with its drawn
        parameters; a number beyond its models is the last."""
        motor = operator.attrgetter(path.removesuffix(MODEL))(self.crane)
        others, columns = alternatives_of(motor), self._of_model.get(path, {})
        factors = [k for k, _ in self._scales.get(f"{path[: -len(MODEL)]}.loss.X_1", ())]
        out = np.empty(len(draws), dtype=object)
        for i, row in enumerate(draws):
            place = min(int(row[self._set[path]]), len(others)) if path in self._set else 0
            drawn = loss_fields(motor, {name: float(row[k]) for name, k in columns.items()}) if columns else {}
            model = others[place - 1] if place else drawn.get("loss_model", motor.loss_model)
            by_law = model is not None and model.law != MJ4  # MJ4 has the numbers of loss, which are scaled
            x = float(np.prod(row[factors]))
            out[i] = model.model_copy(update={"scale": model.scale * x}) if by_law else model
        return out

    def _base(self, path: str) -> float:
        root: Any = self.case if path.startswith(CASE) else self.crane
        value = operator.attrgetter(path.removeprefix(CASE))(root)
        return ASSUMED[path] if value is None else float(value)

    def pairs(self, draws: FloatArray) -> Iterator[Pair]:
        """Crane and scenario of every draw. Untouched parts are those of the crane itself, which the PLC is set up
        for in every draw; nothing is checked (see `checked`)."""
        values = self.values(draws)
        of_crane = nested((p, v.tolist()) for p, v in values.items() if not p.startswith(CASE))
        of_case = nested((p.removeprefix(CASE), v.tolist()) for p, v in values.items() if p.startswith(CASE))
        for i in range(len(draws)):
            crane = set_up_for(_copy(self.crane, of_crane, i), self.crane) if of_crane else self.crane
            yield crane, _copy(self.case, of_case, i)

    def checked(self, draw: FloatArray, label: str) -> Pair:
        """Crane and scenario of one draw, shape (columns,), through every check of a crane file; what goes into its
        sources.

        Errors: SpecError, ScenarioError of one line where they are not a crane, or cannot be run.
        """
        values = self.values(draw[None, :])
        crane, case = next(self.pairs(draw[None, :]))
        derived = {"kind": SourceKind.DERIVED.value, "source": label}
        leaves = {
            i.path: {"value": file_value(i.value, i.quantity), **derived}
            for i in items(crane)
            if i.path in values or i.path.rpartition(".")[0] in values
        }
        tables = nested(leaves.items())
        sound = changed(self.crane, tables) if tables else self.crane
        check(sound, case)
        return sound, case

    def check_ends(self, draws: FloatArray, *, crane: bool = True) -> None:
        """Refuse draws whose ends are not a crane: every column at its least and largest value, the others at their
        middle draw.

        crane: False where this crane has been checked before, and the scenario alone is to be checked.
        Errors: as `checked`, naming the factor.
        """
        check(self.crane, self.case)  # what is wrong with nothing drawn is no factor's fault
        middle = np.median(draws, axis=0)
        in_case = {name for name, f in FACTORS.items() if any(t.path.startswith(CASE) for t in f.targets)}
        for k, name in enumerate(self.columns):
            if not crane and name not in in_case:
                continue
            for x in sorted({float(draws[:, k].min()), float(draws[:, k].max())}):
                point = middle.copy()
                point[k] = x
                try:
                    if crane:
                        self.checked(point, "end of a distribution")
                    else:
                        check(*next(self.pairs(point[None, :])))
                except StillhookError as problem:
                    raise type(problem)(f"factor {name} = {x:.4g}: {problem}") from None


def _copy(record: Any, tree: Mapping[str, Any], i: int) -> Any:
    """The record with row i of the tree's columns; itself where there are none."""
    if not tree:
        return record
    new = {name: _copy(getattr(record, name), x, i) if isinstance(x, dict) else x[i] for name, x in tree.items()}
    return record.model_copy(update=new) if isinstance(record, BaseModel) else copied(record, new)


Set = FrictionSet | LossSet

MOST = 1_000_000
"""Draws at most: beyond it the table of results alone takes gigabytes."""
DEFAULT, LOAD = "default", "load"


@dataclass(frozen=True)
class Uncertainty:
    """Factor -> what is known of it: a distribution, or a set with evidence (friction, motor_loss); see
    `stillhook.analysis.uncertainty.factors`.

    optional: factors that were requested together, and are left out where they change nothing.
    """

    factors: Mapping[str, Distribution | Set]
    optional: frozenset[str] = field(default_factory=frozenset)

    @classmethod
    def of(cls, table: Mapping[str, Any], label: str = "factors", folder: Path | None = None) -> Uncertainty:
        """From a table: name of a factor -> ``{normal = [1, 0.1]}``, ``"default"``, ``{set = "my.friction.toml"}`` or a
        fixed value.

        Errors: SpecError, UnitError of one line that names label and factor.
        """
        for name in table:
            if name not in FACTORS:
                raise SpecError(
                    f"{label}: {quote(name)}: unknown factor. Allowed: {', '.join(FACTORS)}"
                    f"{nearest(str(name), FACTORS)}"
                )
        return cls(
            {name: _library_factor(name, table[name], f"{label}: {name}", folder) for name in FACTORS if name in table}
        )

    @classmethod
    def default(cls) -> Uncertainty:
        """Every factor that is drawn by default, with its default distribution; those that change nothing are left out
        later."""
        names = [name for name, f in FACTORS.items() if f.by_default]
        return cls({name: FACTORS[name].default for name in names}, frozenset(names))

    def on(self, *pairs: Pair) -> Uncertainty:
        """The factors that change something in at least one pair of crane and scenario.

        A load drawn by default is left out where it might exceed the SWL. Errors: SpecError where a factor that was
        named changes nothing, or two count one thing twice.
        """
        for a, b in EXCLUSIVE:
            if a in self.factors and b in self.factors:
                raise SpecError(f"factors: {a} and {b} count the same leaks twice. Leave one of them out.")
        relevant = {}
        for name, law in self.factors.items():
            reasons = [FACTORS[name].absent(crane, case) for crane, case in pairs]
            if all(reasons) and name not in self.optional:
                raise SpecError(f"factor {name}: it has no effect here: {reasons[0]}")
            f, most = FACTORS[name], FACTORS[name].default.values[-1]
            too_heavy = name == LOAD and any(case.load * most > crane.SWL for crane, case in pairs)
            if not (all(reasons) or (too_heavy and name in self.optional)):  # else with the width of the crane's file
                relevant[name] = f.of(pairs[0][0]) if f.of is not None and law == f.default else law
        if not relevant:
            raise SpecError("factors: none. Name at least one, such as friction = { lognormal = [1, 1.3] }.")
        return Uncertainty(relevant)

    @property
    def sets(self) -> list[Set]:
        """The sets that factors are drawn from."""
        return [x for x in self.factors.values() if not isinstance(x, Distribution)]

    def to_dict(self) -> dict[str, Any]:
        """Every factor with its distribution, units and reason; sets with their full text."""
        out: dict[str, Any] = {}
        for name, law in self.factors.items():
            f = FACTORS[name]
            if isinstance(law, Distribution):
                reason = f.reason if law == f.default or f.of is not None else "given"
                out[name] = law.to_dict(f.kind) | {"meaning": f.meaning, "reason": reason}
            else:
                out[name] = {
                    "set": law.name,
                    "meaning": f.meaning,
                    "reason": "evidence of the set",
                    "toml": set_toml(law),
                }
        return out

    def describe(self) -> list[tuple[str, str, str]]:
        """Name, distribution and reason of every factor, in words."""
        texts = self.to_dict()
        rows = []
        for name, law in self.factors.items():
            words = law.describe(FACTORS[name].kind) if isinstance(law, Distribution) else f'set "{law.name}"'
            rows.append((name, words, texts[name]["reason"]))
        return rows


def _library_factor(name: str, value: Any, where: str, folder: Path | None) -> Distribution | Set:
    f = FACTORS[name]
    if value == DEFAULT:
        return f.default
    if isinstance(value, Mapping) and "set" in value:
        if name not in SETS or len(value) != 1:
            raise SpecError(
                f'{where}: only {" and ".join(SETS)} are drawn from a set, written as {{ set = "my.friction.toml" }}.'
            )
        return _set(name, value["set"], where, folder)
    return distribution(value, f.kind, where, f.least, f.most)


def _set(name: str, path: Any, where: str, folder: Path | None) -> Set:
    load = load_friction if name == "friction" else load_losses
    source = path
    if folder is not None and isinstance(path, str) and is_path(path):
        source = named_path(folder, path, lambda why: SpecError(f"{where}.set = {quote(path)}: {why}"))
    try:
        parameter_set: Set = load(source)
    except StillhookError as problem:
        raise type(problem)(f"{where}: {problem}") from None
    if parameter_set.evidence is None:
        raise SpecError(
            f'{where}: set "{parameter_set.name}" has no [evidence], so its uncertainty is unknown.'
            " Identify the set from tests."
        )
    return parameter_set


class FactorsFile(Spec):
    """A table of uncertain factors."""

    defaults: Flag = Field(default=False, description="begin with the default factors")
    factors: Mapping[str, Any] = Field(default_factory=dict, description="table [factors]")


def load_uncertainty(path: str | Path) -> Uncertainty:
    """Factors from a TOML file::

        defaults = true               # optional: begin with the default factors
        [factors]
        friction     = { lognormal = [1.0, 1.4] }     # median, factor of one standard deviation
        bulk_modulus = { uniform = [0.6, 1.1] }
        delay        = { triangular = ["0 ms", "10 ms", "40 ms"] }
        motor_loss   = { set = "my-motor.toml" }      # a set with evidence, seen from this file
        inertia      = "default"
        boost        = 1.0                            # fixed

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Uncertainty
        The factors and their distributions.

    Raises
    ------
    SpecError, UnitError
        One line.
    """
    start = "Give [factors], such as friction = { lognormal = [1, 1.3] }."
    return read_toml(path, FileKind.FACTORS, SpecError, _uncertainty, start=start)


def _uncertainty(table: TomlTable) -> Uncertainty:
    file = table.read(FactorsFile)
    uncertainty = Uncertainty.of(file.factors, table.path.name, table.path.parent)
    if not file.defaults:
        return uncertainty
    every = Uncertainty.default().factors
    factors = {**every, **uncertainty.factors}
    return Uncertainty(
        {name: factors[name] for name in FACTORS if name in factors}, frozenset(every) - set(uncertainty.factors)
    )


class Draws(NamedTuple):
    """columns: factors, and parameters of sets ("friction.Y_1"); values shape (n, columns) [SI]; groups: columns of
    each factor."""

    columns: tuple[str, ...]
    values: FloatArray
    groups: Mapping[str, tuple[int, ...]]


def draws(uncertainty: Uncertainty, n: int, seed: int = 0) -> Draws:
    """n draws of every factor: the same seed gives the same draws, more draws keep the first ones, and a factor keeps
    its draws regardless of what else is drawn.

    A scrambled Sobol sequence fills the space more evenly than random numbers do; n of 2, 4, 8, ... fills it best. Sets
    are drawn at random from their evidence. Errors: SpecError for n or seed that cannot be; IdentifyError for a set
    that cannot be drawn.
    """
    if type(n) is not int or not 1 <= n <= MOST:
        raise SpecError(f"draws = {quote(n)}: give a whole number from 1 to {MOST}.")
    if type(seed) is not int or seed < 0:
        raise SpecError(f"seed = {quote(seed)}: give a whole number of 0 or more.")
    return shaped(uncertainty, unit_points(n, seed)[0], (seed,))


FIRST, SECOND = 23, 40
"""Ends of the factors of the first and second sequence; those after them are drawn from a third, so that a new one
moves no draw of these."""


def unit_points(n: int, seed: int, tables: int = 1) -> list[FloatArray]:
    """Points of the unit cube over all factors, (n, factors), for so many tables of draws."""
    counts = (FIRST, SECOND - FIRST, len(FACTORS) - SECOND)
    parts = [even(n, tables * d, seed if k == 0 else (seed, k)) for k, d in enumerate(counts)]
    return [np.hstack([u[:, i * d : (i + 1) * d] for u, d in zip(parts, counts, strict=True)]) for i in range(tables)]


def even(n: int, d: int, seed: int | tuple[int, ...]) -> FloatArray:
    """The first n points of a scrambled Sobol sequence in d dimensions."""
    from scipy.stats import qmc  # heavy: only where draws are wanted

    points: FloatArray = qmc.Sobol(d, scramble=True, rng=np.random.default_rng(seed)).random_base2((n - 1).bit_length())
    return points[:n]


def shaped(uncertainty: Uncertainty, u: FloatArray, stream: tuple[int, ...]) -> Draws:
    """Draws from points of the unit cube, shape (n, all factors of the table); sets at random, from seeds that begin
    with stream."""
    columns: list[str] = []
    values: list[FloatArray] = []
    groups: dict[str, tuple[int, ...]] = {}
    for k, (name, f) in enumerate(FACTORS.items()):
        law = uncertainty.factors.get(name)
        if law is None:
            continue
        if isinstance(law, Distribution):
            numbers, names = law.at(u[:, k], f.least, f.most)[:, None], [name]
        else:
            sample = draw(law, len(u), np.random.default_rng([*stream, k]))
            numbers, names = sample.values, [f"{name}.{x}" for x in sample.names]
        groups[name] = tuple(range(len(columns), len(columns) + len(names)))
        columns += names
        values.append(numbers)
    return Draws(tuple(columns), np.concatenate(values, axis=1), groups)
