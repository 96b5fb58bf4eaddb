"""What a plan found: limiting sea states of every alternative and what governs them, which alternatives it
distinguishes, and whether numbers read from disk have the shape of a plan's."""

from __future__ import annotations

import datetime
import tomllib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from types import NoneType
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from numpy.typing import NDArray

from stillhook.plan.definition.failures import FAILED, Cause
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.units import quote
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray


Key = TypeVar("Key")
Member = TypeVar("Member")
Credit = Literal["twin", "credited"]
Remark = str | Cause
"""A cause, or what a reader of files or a winch type says about its own input in a sentence."""
CREDITS: tuple[Credit, ...] = ("twin", "credited")
"""The limit as the model of each alternative says it, and what is credited: no more than the cap where no certificate
covers the cell."""
BLOCKS = ("depth", "efficiency", "landing", "sensitivity", "sweep", "convergence", "weather", "demand")
"""Datasets that a result may have in addition to its limits, in the order of the file."""


@dataclass(frozen=True, eq=False)
class PlanResult:
    """Limits, facts and blocks of one plan; saved and loaded by `stillhook.plan.answer.dataset`, reported
    by `stillhook.plan.report.document`.

    data: coordinates credit ("twin", "credited"), alternative, heading [rad], period [s], phase, rule, tier; attrs
    name, Hs_lowest, Hs_highest [m] (least and most of the seas analysed), heading_tolerance [rad].
        Hs_limit, Hs_limit_low, Hs_limit_high (credit, alternative, heading, period) [m]: limiting significant wave
        height with its 95 % interval (NaN where there is none): inf above the highest sea state analysed, 0 where a
        calm is beyond, NaN where there is no result; alpha, op_wf (same dims) [1], [m]: forecast factor of that limit
        and the height that a forecast may show, NaN where there is no result; governing_phase, governing_rule,
        governing_tier (same dims): texts, "" where nothing governs; Hs_rule (credit, tier, alternative, phase, rule,
        heading, period) [m]: everything that was found, NaN where not; counts (alternative, phase, heading, period):
        tier whose limits count, "" where there is none; n_seeds (alternative, phase, heading, period): runs behind it;
        inside (alternative, phase, heading, period): share of the analysed seas that the crane's certificate covers,
        NaN where nothing takes one: phases without compensation, and alternatives that are no twin.
    facts: plain data for JSON: the request (name, crane, vessel, payload, place, phases, rules, limited,
    alternatives, operation, inputs, settings) and how it was answered (version, code, date, shown, runs, notes,
    not_covered, remarks). blocks: name of `BLOCKS` -> Dataset, each only where it was made:
        depth (alternative, z): F_top_max, F_top_static, DAF, sling_ratio, slack_chance, T_0; attrs Hs, Tp, beta,
        z_resonance; efficiency (alternative, period): eta_wire, eta_load; landing (alternative, run): v_landed;
        sensitivity (factor, alternative); sweep (variant, alternative, landing_tolerance): Hs_landing;
        convergence (cell, n): Hs_limit, low, high; weather (credit, alternative, month; 0 the whole year); demand
        (tier, alternative, phase, heading, period, height): quantities of the rules.
    """

    data: xarray.Dataset = field(repr=False)
    facts: Mapping[str, Any] = field(repr=False)
    blocks: Mapping[str, xarray.Dataset] = field(default_factory=dict, repr=False)

    @property
    def name(self) -> str:
        """Name of the plan."""
        return str(self.facts["name"])

    @property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Alternatives that stand side by side."""
        return tuple(Alternative(str(name)) for name in self.data["alternative"].values)

    @property
    def workable(self) -> bool:
        """Whether any sea of the table is within the credited limit of any alternative, and the weather, where it was
        given, ever has a window that is long enough."""
        limits = self.data["Hs_limit"].sel(credit="credited").values
        windows = (
            self.blocks["weather"]["n_windows_long_enough"].sel(credit="credited", month=0)
            if "weather" in self
            else None
        )
        return bool((limits >= float(self.data.attrs["Hs_lowest"])).any() and (windows is None or (windows > 0).any()))

    @property
    def failed(self) -> bool:
        """Whether something could not be computed after the runs; the remarks name it."""
        return bool(self.caused(FAILED))

    def caused(self, *codes: str) -> list[Cause]:
        """Remarks of these causes."""
        return [each for each in self.facts["remarks"] if isinstance(each, Mapping) and each["cause"] in codes]

    def __getitem__(self, block: str) -> xarray.Dataset:
        """A block by its name. Errors: KeyError where it was not made."""
        return self.blocks[block]

    def __contains__(self, block: str) -> bool:
        return block in self.blocks


def grouped(pairs: Iterable[tuple[Key, Member]]) -> dict[Key, list[Member]]:
    """Members by the key that they share, in the order in which they come."""
    groups: dict[Key, list[Member]] = {}
    for key, member in pairs:
        groups.setdefault(key, []).append(member)
    return groups


def labelled(
    columns: Mapping[str, tuple[Sequence[str], NDArray[Any]]],
    coords: Mapping[str, Any],
    attrs: Mapping[str, Any] | None = None,
) -> xarray.Dataset:
    """Numbers by name over dimensions, each with the unit and the meaning that `stillhook.variables` has of it."""
    import xarray  # heavy: only where results are labelled

    data = {name: (dims, values, attributes(name)) for name, (dims, values) in columns.items()}
    return xarray.Dataset(data, coords, attrs)


CLASSIC = "best-classic"
"""Reference of a new controller's gain: the better classic controller."""
NEW = tuple(alternative for alternative in Alternative if alternative.twin and not alternative.classic)
"""Controllers that are held against the classic ones."""


def ran(tiers: Collection[str]) -> bool:
    """Whether runs of the twin are among the tiers of an answer."""
    return Tier.TIME.value in tiers


def merged(rows: Iterable[Sequence[str]], result: PlanResult, *, between: str = ", ") -> list[list[str]]:
    """Rows of a table by alternative, its label first; without runs of the twin those that are printed alike are
    one."""
    if ran(result.facts.get("tiers", ())):
        return [list(row) for row in rows]
    groups = grouped((tuple(cells), label) for label, *cells in rows)
    return [[between.join(labels), *cells] for cells, labels in groups.items()]


def references(block: xarray.Dataset, tiers: Collection[str]) -> list[str]:
    """References of gains: the better classic controller only with runs of the twin, which compare controllers."""
    over = [str(name) for name in block["over"].values] if "over" in block.dims else []
    return over if ran(tiers) else [name for name in over if name != CLASSIC]


def for_print(result: PlanResult) -> PlanResult:
    """The result with the alternatives that it compares alone: without runs of the twin none of its controllers."""
    named = result.data["alternative"].values
    others = [str(name) for name in named if not Alternative(str(name)).twin]
    if ran(result.facts.get("tiers", ())) or not others or len(others) == len(named):
        return result
    blocks = {
        name: block.sel(alternative=[a for a in others if a in block["alternative"].values])
        if "alternative" in block.dims
        else block
        for name, block in result.blocks.items()
    }
    facts = {**result.facts}
    facts["alternatives"] = [each for each in facts["alternatives"] if each["name"] in others]
    return PlanResult(result.data.sel(alternative=others), facts, blocks)


SHAPE: Mapping[str, Any] = tomllib.loads((files("stillhook.plan") / "facts.toml").read_text(encoding="utf-8"))
"""Shape of the facts where they are present."""
TYPES = {"text": str, "true or false": bool, "number": int | float, "null": NoneType, "cause": Mapping}
ROW = 2
"""Texts in a payload's row at least: what it is, and its value."""
CELL = {"credit", "alternative", "heading", "period"}
COLUMN = {"alternative", "phase", "heading", "period"}
DATA: Mapping[str, set[str]] = {
    **dict.fromkeys(
        ("Hs_limit", "Hs_limit_low", "Hs_limit_high", "governing_phase", "governing_rule", "governing_tier"), CELL
    ),
    **dict.fromkeys(("alpha", "op_wf"), CELL),
    **dict.fromkeys(("counts", "n_seeds", "inside"), COLUMN),
    "Hs_rule": {"credit", "tier", "rule", *CELL, *COLUMN},
}
"""Dimensions of a result's numbers."""


def odd_fact(facts: Mapping[str, Any]) -> str:
    """The first fact that is present and has the wrong shape, in words; empty where all are right."""
    present = {key: shape for key, shape in SHAPE.items() if key.removesuffix("?") in facts}
    if error := _odd_entry(facts, present, ""):
        return error
    if any(len(row) < ROW for row in facts.get("payload", {}).get("rows", ())):
        return "payload.rows: a row without a value"
    if "date" in facts:
        try:
            datetime.date.fromisoformat(facts["date"])
        except ValueError:
            return f"date = {quote(facts['date'])}: it must be a date"
    return ""


def missing_facts(facts: Mapping[str, Any]) -> str:
    """Names of the facts that no report can do without and that are missing; empty where none is."""
    return ", ".join(key for key in SHAPE if not key.endswith("?") and key not in facts)


def _odd(value: Any, shape: Any, where: str) -> str:
    if isinstance(shape, str):
        types = shape.split(" | ")
        right = any(isinstance(value, TYPES[name]) for name in types)
        right &= not isinstance(value, bool) or "true or false" in types
        return "" if right else f"{where} = {quote(value)}: it must be a {' or '.join(types)}"
    if isinstance(shape, list):
        if not isinstance(value, list | tuple):
            return f"{where} = {quote(value)}: it must be a list"
        return next((error for i, each in enumerate(value) if (error := _odd(each, shape[0], f"{where}[{i}]"))), "")
    if not isinstance(value, Mapping):
        return f"{where} = {quote(value)}: it must be a table"
    return _odd_entry(value, shape, f"{where}.")


def _odd_entry(table: Mapping[str, Any], shape: Mapping[str, Any], where: str) -> str:
    for key, inner in shape.items():
        name, null = key.removesuffix("?").removesuffix(" | null"), key.endswith(" | null")
        if name not in table and not key.endswith("?"):
            return f"{where}{name}: missing"
        present = name in table and not (null and table[name] is None)
        if present and (error := _odd(table[name], inner, f"{where}{name}")):
            return error
    return ""


def odd_numbers(data: xarray.Dataset) -> str:
    """The first of a result's numbers that is not what it should be, in words; empty where all are."""
    for name, dims in DATA.items():
        if name not in data:
            return f"{name}: missing"
        if set(data[name].dims) != dims:
            return f"{name}: over {', '.join(map(str, data[name].dims))} in place of {', '.join(sorted(dims))}"
    names = [*dict.fromkeys(("credit", *sorted(DATA["Hs_rule"])))]
    if missing := [name for name in names if name not in data.coords]:
        return f"{', '.join(missing)}: missing"
    return next(
        (
            f"alternative {quote(str(a))}: unknown"
            for a in data["alternative"].values
            if str(a) not in list(Alternative)
        ),
        "",
    )


def of_two(data: xarray.Dataset, facts: Mapping[str, Any]) -> str:
    """Where facts name other phases, rules or alternatives than the numbers, in words; empty where they do not."""
    named = {"phase": facts["phases"], "alternative": facts["alternatives"], "rule": facts["rules"]["rows"]}
    for name, rows in named.items():
        keys = [row["key" if name == "rule" else "name"] for row in rows]
        if sorted(keys) != sorted(map(str, data[name].values)):
            return f"its facts name other {name}s than its numbers"
    return ""
