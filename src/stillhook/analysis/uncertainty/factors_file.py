"""What is not known about a winch: factors with their distributions, from a table or a file, and draws of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from stillhook.analysis.uncertainty.factors import EXCLUSIVE, FACTORS, Distribution, distribution
from stillhook.analysis.uncertainty.samples import SETS, Pair
from stillhook.base.arrays import FloatArray
from stillhook.base.choice import nearest
from stillhook.errors import SpecError, StillhookError
from stillhook.library import load_friction, load_losses, set_toml
from stillhook.library.crane_file.draws import draw
from stillhook.library.parameter_sets import FrictionSet, LossSet, is_path
from stillhook.library.toml.file import TomlTable, read_toml
from stillhook.library.toml.kinds import FileKind
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario
from stillhook.tables.table import Flag, Spec
from stillhook.units import quote

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
            {
                name: _library_factor(name, table[name], f"{label}: {name}", folder or Path())
                for name in FACTORS
                if name in table
            }
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
        kept = {}
        for name, known in self.factors.items():
            whys = [FACTORS[name].absent(crane, case) for crane, case in pairs]
            if all(whys) and name not in self.optional:
                raise SpecError(f"factor {name}: it has no effect here: {whys[0]}")
            if not (all(whys) or (name == LOAD and name in self.optional and any(_too_heavy(*pair) for pair in pairs))):
                kept[name] = _resolved(name, known, pairs)
        if not kept:
            raise SpecError("factors: none. Name at least one, such as friction = { lognormal = [1, 1.3] }.")
        return Uncertainty(kept)

    @property
    def sets(self) -> list[Set]:
        """The sets that factors are drawn from."""
        return [x for x in self.factors.values() if not isinstance(x, Distribution)]

    def to_dict(self) -> dict[str, Any]:
        """Every factor with its distribution, units and reason; sets with their full text."""
        out: dict[str, Any] = {}
        for name, known in self.factors.items():
            f = FACTORS[name]
            if isinstance(known, Distribution):
                reason = f.reason if known == f.default or f.of is not None else "given"
                out[name] = known.to_dict(f.kind) | {"meaning": f.meaning, "reason": reason}
            else:
                out[name] = {
                    "set": known.name,
                    "meaning": f.meaning,
                    "reason": "evidence of the set",
                    "toml": set_toml(known),
                }
        return out

    def describe(self) -> list[tuple[str, str, str]]:
        """Name, distribution and reason of every factor, in words."""
        texts = self.to_dict()
        rows = []
        for name, known in self.factors.items():
            words = known.describe(FACTORS[name].kind) if isinstance(known, Distribution) else f'set "{known.name}"'
            rows.append((name, words, texts[name]["reason"]))
        return rows


def _resolved(name: str, known: Distribution | Set, pairs: tuple[Pair, ...]) -> Distribution | Set:
    """The default distribution with the width that the first crane's file gives; anything else unchanged."""
    of = FACTORS[name].of
    return of(pairs[0][0]) if of is not None and known == FACTORS[name].default else known


def _too_heavy(crane: Crane, case: Scenario) -> bool:
    """Whether the default range of the load goes beyond the SWL."""
    return case.load * FACTORS[LOAD].default.values[-1] > crane.SWL


def _library_factor(name: str, value: Any, where: str, folder: Path) -> Distribution | Set:
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


def _set(name: str, path: Any, where: str, folder: Path) -> Set:
    load = load_friction if name == "friction" else load_losses
    source = folder / path if isinstance(path, str) and is_path(path) else path
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

    Errors: SpecError, UnitError of one line.
    """
    start = "Give [factors], such as friction = { lognormal = [1, 1.3] }."
    return read_toml(path, FileKind.FACTORS, SpecError, _uncertainty, start=start)


def _uncertainty(table: TomlTable) -> Uncertainty:
    file = table.read(FactorsFile)
    uncertainty = Uncertainty.of(file.factors, table.path.name, table.path.parent)
    if not file.defaults:
        return uncertainty
    every = Uncertainty.default().factors
    known = {**every, **uncertainty.factors}
    return Uncertainty(
        {name: known[name] for name in FACTORS if name in known}, frozenset(every) - set(uncertainty.factors)
    )


class Draws(NamedTuple):
    """columns: factors, and parameters of sets ("friction.Y_1"); values shape (n, columns) [SI]; groups: columns of
    each factor."""

    columns: tuple[str, ...]
    values: FloatArray
    groups: Mapping[str, tuple[int, ...]]


def draws(uncertainty: Uncertainty, n: int, seed: int = 0) -> Draws:
    """n draws of every factor: the same seed gives the same draws, more draws keep the first ones, and a factor keeps
    its draws whatever else is drawn.

    A scrambled Sobol sequence fills the space more evenly than random numbers do; n of 2, 4, 8, ... fills it best. Sets
    are drawn at random from their evidence. Errors: SpecError for n or seed that cannot be; IdentifyError for a set
    that cannot be drawn.
    """
    if type(n) is not int or not 1 <= n <= MOST:
        raise SpecError(f"draws = {quote(n)}: give a whole number from 1 to {MOST}.")
    if type(seed) is not int or seed < 0:
        raise SpecError(f"seed = {quote(seed)}: give a whole number of 0 or more.")
    return shaped(uncertainty, even(n, len(FACTORS), seed), (seed,))


def even(n: int, d: int, seed: int) -> FloatArray:
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
        known = uncertainty.factors.get(name)
        if known is None:
            continue
        if isinstance(known, Distribution):
            numbers, names = known.at(u[:, k], f.least, f.most)[:, None], [name]
        else:
            sample = draw(known, len(u), np.random.default_rng([*stream, k]))
            numbers, names = sample.values, [f"{name}.{x}" for x in sample.names]
        groups[name] = tuple(range(len(columns), len(columns) + len(names)))
        columns += names
        values.append(numbers)
    return Draws(tuple(columns), np.concatenate(values, axis=1), groups)
