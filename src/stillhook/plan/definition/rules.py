"""Rules that a phase must meet: named, sourced, editable. A rule says which quantity, which limit, in which phases, by
which clause.

What a phase of a lift requires in sea states: quantities that rules limit, from one tier of the model.

What the winch may be taken for: no compensation, the flat cap, the twin under each controller, and a winch that rests
above a passive heave compensator.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.analysis.controllers import STRONG, Controller, controller
from stillhook.base.arrays import FloatArray
from stillhook.control.registry import DEFAULT_MODE, USUAL, Mode
from stillhook.library.toml.file import TomlTable
from stillhook.spec.crane import Crane
from stillhook.spec.lift.phase import PhaseKind
from stillhook.statistics.extremes import MPM, P90
from stillhook.units import show
from stillhook.variables import BY_NAME


class Quantity(NamedTuple):
    """What a rule may limit: quantities of a phase that the tiers determine, name of `stillhook.variables`.

    mean: whether it has no largest value, so that its level is the mean; needs: what a winch must have or do for it,
    "compensation" that it follows the tip, "turning" that it is not on its brake, "hydraulics" that it turns and is no
    flat cap, "compensator" that a passive heave compensator hangs below it, "vessel" that it lifts off
    another one; still: its value in still water [SI], None where that follows from the plan; number: of a run, that
    only some winch types have.
    """

    name: str
    mean: bool
    needs: tuple[str, ...]
    still: float | None
    number: str


def _quantities() -> Mapping[str, Quantity]:
    with Path(__file__).with_name("quantities.csv").open(encoding="utf-8", newline="") as table:
        return {
            row["name"]: Quantity(
                name=row["name"],
                mean=row["mean"] == "yes",
                needs=tuple(row["needs"].split()),
                still=float(row["still"]) if row["still"] else None,
                number=row["number"],
            )
            for row in csv.DictReader(table)
        }


QUANTITIES = _quantities()


class Sense(StrEnum):
    """Which side of the limit is good."""

    AT_MOST = "at-most"
    AT_LEAST = "at-least"


class Level(StrEnum):
    """Which largest value of the phase is compared with the limit: the most probable one, or what 90 % of such phases
    stay below; mean: what has no largest value, such as a share of the time, a chance, or a tension at rest."""

    MPM = "mpm"
    P90 = "p90"
    MEAN = "mean"

    @property
    def quantile(self) -> float:
        """Part of all phases that stay below it."""
        return MPM if self is Level.MPM else P90


@dataclass(frozen=True)
class Rule:
    """One criterion.

    key: its name, as in tables and in `Phase.limits`; title in words; quantity: name of `stillhook.variables` in a
    `Demand`; limit: a number in SI, or the name of a capacity of the plan
    (`stillhook.plan.definition.capacities`); sense; level: largest value that counts; phases it belongs to; standard,
    edition, clause: what it is from, the edition that the user entered, a clause "assumed" unless its text was seen;
    note: why, or what it leaves; factor on a capacity [-]; written: the limit as the file has it ("0.5 m/s").
    """

    key: str
    title: str
    quantity: str
    limit: float | str
    sense: Sense
    level: Level
    phases: tuple[PhaseKind, ...]
    standard: str
    edition: str = ""
    clause: str = ""
    note: str = ""
    factor: float = 1.0
    written: str = ""

    @property
    def requirement(self) -> str:
        """The limit in words: "at most 1.3 x SWL_tip"."""
        kind = BY_NAME[self.quantity].kind
        if isinstance(self.limit, str):
            limit = self.limit if self.factor == 1.0 else f"{self.factor:g} x {self.limit}"
        else:
            limit = self.written or (show(self.limit, kind) if kind else f"{self.limit:g}")
        return f"{self.sense.replace('-', ' ')} {limit}"

    @property
    def clause_of(self) -> str:
        """Standard, edition and clause in a line; empty where there is none."""
        return ", ".join(text for text in (self.standard, self.edition, self.clause) if text)


@dataclass(frozen=True)
class RuleSet:
    """Rules of a plan with where they are from. changes: what a user's file did to its base, a line each; digest of its
    content; source: whose rules they are; entered_by: who entered the editions of its standards; settings: numbers of
    the closed form [SI] (`stillhook.plan.definition.rules_file.SETTINGS`).
    """

    name: str
    version: str
    rules: tuple[Rule, ...]
    changes: tuple[str, ...] = ()
    digest: str = ""
    source: str = ""
    settings: Mapping[str, float] = field(default_factory=dict)
    entered_by: str = ""

    @property
    def label(self) -> str:
        """Name and version, as printed on everything that is judged by this set."""
        return f"{self.name} version {self.version}"

    def level(self, quantity: str) -> Level:
        """Which largest value of a quantity counts, one for all of its rules; the most probable one without a rule."""
        return next((rule.level for rule in self.rules if rule.quantity == quantity), Level.MPM)

    def to_dict(self) -> dict[str, Any]:
        """The set as plain data for JSON, limits in SI."""
        rows = [{**asdict(r), "phases": [str(k) for k in r.phases], "requirement": r.requirement} for r in self.rules]
        top = {"name": self.name, "version": self.version, "source": self.source, "changes": list(self.changes)}
        top |= {"entered_by": self.entered_by} if self.entered_by else {}
        return {**top, "settings": dict(self.settings), "rules": rows, "digest": self.digest}

    def of(self, kind: PhaseKind | None) -> Mapping[str, Rule]:
        """Rules that belong to a kind of phase, by key."""
        return {rule.key: rule for rule in self.rules if kind in rule.phases}


@dataclass(frozen=True)
class Limited:
    """A rule with its limit [SI] as it stands for one phase under one alternative; basis: what the limit is of, in
    words; by_Hs: of a limit that depends on the sea (`limit` is then that of the lowest), pairs of a height up to
    which and including [m], rising, and the limit; beyond the last nothing is allowed."""

    rule: Rule
    limit: float
    basis: str = field(default="")
    by_Hs: tuple[tuple[float, float], ...] = ()

    @property
    def bands(self) -> tuple[tuple[float, float], ...]:
        """Limits by height as `by_Hs`, the last up to inf."""
        if not self.by_Hs:
            return ((np.inf, self.limit),)
        return (*self.by_Hs, (np.inf, 0.0 if self.rule.sense is Sense.AT_MOST else np.inf))

    def at(self, Hs: FloatArray) -> FloatArray:
        """The limit in seas of significant wave height Hs (n,) [m]."""
        tops, limits = (np.array(column) for column in zip(*self.bands, strict=True))
        place = np.searchsorted(tops, np.asarray(Hs, dtype=np.float64) - ROUNDING)
        return np.asarray(limits[np.minimum(place, len(limits) - 1)])


ROUNDING = 1e-9
"""Height by which a sea may pass that of a limit and still be at it [m]."""


class Alternative(StrEnum):
    """One way to account for the winch; the limits of all of them are listed side by side: no compensation, the
    flat cap, a passive heave compensator below a winch at rest, and one for each controller."""

    NONE = "none"
    CAP = "cap-80"
    PHC = "phc"
    vars().update({mode.name: mode.value for mode in Mode if mode.compensates})
    STRONG_SSC = STRONG

    @property
    def twin(self) -> bool:
        """Whether the twin computes the compensation (else it is 0, or the flat cap of
        `stillhook.spec.validity.CAP`)."""
        return self not in (Alternative.NONE, Alternative.CAP, Alternative.PHC)

    @property
    def stands(self) -> bool:
        """Whether the winch is on its brake where other alternatives compensate."""
        return self in (Alternative.NONE, Alternative.PHC)

    @property
    def classic(self) -> bool:
        """Whether it is a classic controller, whose motors have a fixed displacement."""
        return self.value in list(Mode) and Mode(self.value).law.family == "classic"

    @property
    def label(self) -> str:
        """What tables and pictures call it."""
        if self is Alternative.STRONG_SSC:
            return "strong SSC"
        return Mode(self.value).law.label if self.twin else _LABELS[self.value]


_LABELS = {"none": "none", "cap-80": "80 % cap", "phc": "passive compensator"}
ALTERNATIVES = (Alternative.NONE, Alternative.CAP, *(Alternative(mode.value) for mode in USUAL), Alternative.STRONG_SSC)
"""Alternatives of a plan that names none."""


def usual_alternatives(crane: Crane) -> tuple[Alternative, ...]:
    """Alternatives of a plan that names none, on this crane: strong SSC needs a closed circuit, other drives have
    controllers of their own."""
    winch = crane.plant.type
    strong = (Alternative.STRONG_SSC,) if Mode("ssc") in winch.modes and "active" in crane.circuits else ()
    return (Alternative.NONE, Alternative.CAP, *(Alternative(mode.value) for mode in winch.usual_modes), *strong)


def own_controllers(
    files: Mapping[Alternative, str], alternatives: tuple[Alternative, ...], crane: Crane, table: TomlTable
) -> Mapping[Alternative, Controller]:
    """Controllers of the table [controllers] of a plan file: of each alternative that it names the file with its
    settings, seen from the plan's. Errors: StillhookError of one line, for an alternative that is not among those of
    the plan, and a file that is no controller, of another motor law, or of another crane."""
    found = {}
    for alternative, name in files.items():
        at = table.at("controllers", alternative.value)
        if alternative not in alternatives or not alternative.twin:
            named = ", ".join(a.value for a in alternatives if a.twin) or "none"
            raise at.wrong(f"not a controller among the plan's alternatives. Choose among {named}.")
        own = controller(table.relative_toml(name))
        law = DEFAULT_MODE if alternative is Alternative.STRONG_SSC else Mode(alternative.value)
        if own.mode is not law:
            raise at.wrong(f'the file has mode "{own.mode.value}", and {alternative.value} needs "{law.value}".')
        own.on(crane)  # refuses what the crane has not
        found[alternative] = own
    return found


class Tier(StrEnum):
    """Method of a number: closed form of a standard, frequency-domain method, twin in the time domain."""

    CLOSED_FORM = "closed-form"
    FREQUENCY = "frequency"
    TIME = "time"


@dataclass(frozen=True, eq=False)
class Seas:
    """Sea states of a table, in any order; every array (n,). Hs [m], 0 for a calm; Tp [s]; beta direction of travel
    from the bow [rad]."""

    Hs: FloatArray = field(repr=False)
    Tp: FloatArray = field(repr=False)
    beta: FloatArray = field(repr=False)

    def __len__(self) -> int:
        return len(self.Hs)

    @cached_property
    def columns(self) -> list[tuple[float, float, NDArray[np.intp]]]:
        """Every (Tp, beta) that there is, with the rows of its seas by rising Hs."""
        pairs = sorted({(float(T), float(b)) for T, b in zip(self.Tp, self.beta, strict=True)})
        result = []
        for T, b in pairs:
            rows = np.flatnonzero((self.Tp == T) & (self.beta == b))
            result.append((T, b, rows[np.argsort(self.Hs[rows], kind="stable")]))
        return result


@dataclass(frozen=True, eq=False)
class Demand:
    """Quantities of one phase under one alternative in every sea state, from one tier.

    values: quantity (a name of `stillhook.variables`) -> (n,) in SI; NaN where the tier does not determine it. Largest
    values are those of the phase's duration at the quantile of the rule about them. low, high: ends of the 95 %
    interval where there is one, same keys as values or fewer; seeds (n,) runs behind each row (0: none).
    """

    phase: str
    alternative: Alternative
    tier: Tier
    seas: Seas
    values: Mapping[str, FloatArray]
    low: Mapping[str, FloatArray] = field(default_factory=dict)
    high: Mapping[str, FloatArray] = field(default_factory=dict)
    seeds: NDArray[np.int64] | None = None
