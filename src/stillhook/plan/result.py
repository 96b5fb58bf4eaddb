"""What a plan found: limiting sea states of every alternative and what governs them; and its files, plan.nc (labelled
arrays, blocks as groups) and plan.json (facts and summary), each with a hash, so that what is read is what was written.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from numpy.typing import NDArray

from stillhook.base.gateway.access import sha256_of
from stillhook.base.gateway.guard import reader
from stillhook.base.gateway.inputs import note_input
from stillhook.base.gateway.parse import json_file
from stillhook.errors import PlanError, StillhookError, UnreadableError
from stillhook.formats.binary import read_datasets
from stillhook.formats.results import save_json, to_json
from stillhook.formats.table.netcdf import write_netcdf
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.report.document import Document, Part, Table, Text
from stillhook.report.formatting import EMPTY, percent
from stillhook.report.html import fragment
from stillhook.trust.results import note_misfit, result_folder
from stillhook.units import quote
from stillhook.variables import attributes

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")
Key = TypeVar("Key")
Member = TypeVar("Member")
Credit = Literal["twin", "credited", "claimable"]
Cause = Mapping[str, Any]
"""Why a result is as it is: its code under "cause", and values [SI]; `stillhook.plan.report.words` makes sentences."""
Remark = str | Cause
"""A cause, or what a reader of files or a winch type says about its own input in a sentence."""
NUMERICAL = (ArithmeticError, ValueError, IndexError, KeyError)
"""What a computation on odd numbers ends in."""
FAILED = "not-computed"
"""Code of what failed."""
CREDITS: tuple[Credit, ...] = ("twin", "credited")
"""The limit as the model of each alternative says it, and what is credited: no more than the cap where no certificate
covers the cell."""
CLAIMABLE: Credit = "claimable"
"""The third credit, where what is credited rests on a SYNTHETIC certificate: that without it. Elsewhere what is
credited may be claimed."""
BLOCKS = ("depth", "efficiency", "landing", "sweep", "convergence", "weather")
"""Datasets that a result may have in addition to its limits, in the order of the file."""


@dataclass(frozen=True, eq=False)
class PlanResult:
    """Limits, facts and blocks of one plan; reported by `stillhook.plan.report.document`.

    data: coordinates credit ("twin", "credited"; "claimable" where that is less), alternative, heading [rad], period
    [s], phase, rule, tier; attrs name, Hs_lowest, Hs_highest [m] (least and most of the seas analysed),
    heading_tolerance [rad].

    - Hs_limit, Hs_limit_low, Hs_limit_high (credit, alternative, heading, period) [m]: limiting significant wave
      height with its 95 % interval (NaN where there is none): inf above the highest sea state analysed, 0 where a
      calm is beyond, NaN where there is no result
    - alpha, op_wf (same dims) [1], [m]: forecast factor of that limit and the height that a forecast may show, NaN
      where there is no result
    - governing_phase, governing_rule, governing_tier (same dims): texts, "" where nothing governs
    - governing_end (same dims): what the limit is the end of (certificate-end, chart-end, seas-end, steepness), ""
      where a rule is used up there
    - Hs_rule (credit, tier, alternative, phase, rule, heading, period) [m]: everything that was found, NaN where not
    - Hs_steepest (period) [m]: height of the steepest sea, above which nothing is credited
    - counts (alternative, phase, heading, period): tier whose limits count, "" where there is none
    - n_seeds (alternative, phase, heading, period): runs behind it
    - inside (alternative, phase, heading, period): share of the analysed seas that the crane's certificate covers,
      NaN where nothing takes one: phases without compensation, and alternatives without a twin

    facts: plain data for JSON: the request (name, crane, vessel, payload, place, phases, rules, limited,
    alternatives, operation, inputs, settings) and how it was answered (version, code, date, shown, runs, notes,
    not_covered, remarks). blocks: name of `BLOCKS` -> Dataset, each only where it was made:

    - depth (alternative, z): F_top_max, F_top_static, DAF, sling_ratio, slack_chance, T_0; attrs Hs, Tp, beta,
      z_resonance
    - efficiency (alternative, period): eta_wire, eta_load
    - landing (alternative, run): v_landed
    - sweep (variant, alternative, landing_tolerance): Hs_landing
    - convergence (cell, n): Hs_limit, low, high
    - weather (credit, alternative, month; 0 the whole year)
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
        """Alternatives that are compared."""
        return tuple(Alternative(str(name)) for name in self.data["alternative"].values)

    @property
    def claim(self) -> Credit:
        """The credit that may be claimed."""
        return claim_in(self.data)

    @property
    def workable(self) -> bool:
        """Whether any sea of the table is within the claimable limit of any alternative, and the weather, where it was
        given, ever has a window that is long enough."""
        limits = self.data["Hs_limit"].sel(credit=self.claim).values
        windows = (
            self.blocks["weather"]["n_windows_long_enough"].sel(credit=self.claim, month=0)
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

    def _repr_html_(self) -> str:
        """Limits of every alternative with what governs most of them, for a notebook."""
        rows = []
        for name, of in self.facts["summary"]["alternatives"].items():
            credited, most = of["credited"], float(self.data.attrs["Hs_highest"])
            spans = [_between(each["least"], each["most"], most) for each in (credited, of["twin"])]
            governs = ", ".join(f"{each['phase']}: {each['rule']}" for each in credited["governs"][:1])
            share = percent((credited.get("weather") or {}).get("operability"))
            rows.append([name, *spans, governs, share])
        remarks = f"{len(self.facts['remarks'])} remarks"
        heads = ("alternative", "limiting Hs,\ncredited", "as simulated", "governs most cells", "operability")
        parts: list[Part] = [Table(heads, rows), Text(f"Tiers: {', '.join(self.facts['tiers'])}. {remarks}.")]
        return fragment(Document(self.name, front=parts))

    def __getitem__(self, block: str) -> xarray.Dataset:
        """A block by its name. Errors: KeyError where it was not made."""
        return self.blocks[block]

    def __contains__(self, block: str) -> bool:
        return block in self.blocks


def _between(low: float | None, high: float | None, most: float) -> str:
    """A range of limiting heights [m], up to the highest that was analysed."""
    if low is None or high is None or math.isnan(low) or math.isnan(high):
        return EMPTY
    return f"{min(low, most):.2f} to {'> ' if high > most else ''}{min(high, most):.2f} m"


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
"""Controllers that are compared with the classic ones."""


def ran(tiers: Collection[str]) -> bool:
    """Whether runs of the twin are among the tiers of an answer."""
    return Tier.TIME.value in tiers


def merged(rows: Iterable[Sequence[str]], result: PlanResult, *, between: str = ", ") -> list[list[str]]:
    """Rows of a table by alternative, its label first; without runs of the twin those printed alike are one."""
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


def claim_in(block: xarray.Dataset) -> Credit:
    """The credit of a result's data or block that may be claimed."""
    return CLAIMABLE if CLAIMABLE in block["credit"].values else CREDITS[1]


def picked(record: object, *names: str) -> dict[str, Any]:
    """Some fields of a record by name, for JSON."""
    return {name: getattr(record, name) for name in names}


def cause(code: str, **values: Any) -> Cause:
    """A cause as plain data for JSON."""
    return {"cause": code, **values}


def in_words(problem: Exception) -> str:
    """A failure in a line."""
    text = " ".join(str(problem).split()).rstrip(".")[:160]
    return text if isinstance(problem, StillhookError) else f"{type(problem).__name__}: {text}; please report it"


@dataclass(eq=False)
class Failures:
    """Numbers that could not be computed once the runs were made, what -> reason: each is named, and loses no other."""

    reasons: dict[str, str] = field(default_factory=dict)

    def attempt(self, what: str, make: Callable[[], T], otherwise: T) -> T:
        """What is made, or `otherwise` where that fails: the reason is kept."""
        try:
            return make()
        except (StillhookError, *NUMERICAL) as problem:
            self.reasons[what] = in_words(problem)
            return otherwise

    @property
    def remarks(self) -> list[Cause]:
        """A cause each."""
        return [cause(FAILED, what=what, reason=reason) for what, reason in self.reasons.items()]


NUMBERS, FACTS = "plan.nc", "plan.json"
PLAN_FILES = (NUMBERS, FACTS)
OF_NUMBERS, OF_FACTS = "numbers_sha256", "facts_sha256"
"""Keys in the file of facts of the hash of the numbers that belong to it, and of that of its other facts."""
UNSEALED = "unsealed"
"""Key of facts that were read without a hash, as version 0.10 wrote them: a part of them may be missing or odd."""


def save_plan(result: PlanResult, folder: str | Path) -> Path:
    """Write a result into a folder; both files appear together when they are complete.

    Parameters
    ----------
    result : PlanResult
        What `plan` gave.
    folder : str or Path
        Folder to write.

    Returns
    -------
    Path
        The folder.
    """
    target = Path(folder)
    with result_folder(target, "plan", cranes_of(result)) as part:
        write_plan(result, part)
    return target


def cranes_of(result: PlanResult) -> list[tuple[str, str]]:
    """Name and hash of the crane, for a manifest; none in facts that were read without."""
    crane = result.facts.get("crane")
    name, digest = (crane.get("name"), crane.get("digest")) if isinstance(crane, dict) else (None, None)
    return [(name, digest)] if isinstance(name, str) and isinstance(digest, str) else []


def write_plan(result: PlanResult, part: Path) -> None:
    """The files of a result in a folder that is moved into place later."""
    blocks = {name: result[name] for name in BLOCKS if name in result}
    write_netcdf(part / NUMBERS, {"": result.data, **blocks}, packed="fi")
    facts = json.loads(to_json({**result.facts, OF_NUMBERS: _hash((part / NUMBERS).read_bytes())}))
    save_json(facts | {OF_FACTS: _hash_of_facts(facts)}, part / FACTS)


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _hash_of_facts(facts: dict[str, Any]) -> str:
    return _hash(json.dumps(facts, sort_keys=True).encode())


@reader(PlanError)
def load_plan_result(folder: str | Path) -> PlanResult:
    """The result that `save_plan` wrote.

    Parameters
    ----------
    folder : str or Path
        Its folder.

    Returns
    -------
    PlanResult
        The result.

    Raises
    ------
    PlanError
        One line, for a folder without one, and for files that are damaged, changed or of two plans.
    """
    where = Path(folder)
    if where.name in PLAN_FILES:
        where = where.parent
    for name in PLAN_FILES:
        if not (where / name).is_file():
            raise PlanError(f"{quote(str(folder))}: no {name} there. Give the folder that stillhook plan --out wrote.")
        note_input(where / name)
    note_misfit(*(where / name for name in PLAN_FILES))
    facts = _facts(where / FACTS)
    _check_numbers(facts.pop(OF_NUMBERS, None), where)
    try:
        data, blocks = read_datasets(where / NUMBERS, BLOCKS)
    except UnreadableError as problem:
        raise PlanError(f"{where / NUMBERS}: not the numbers of a plan ({problem}). Run the plan again.") from None
    if data.attrs.get("name") != facts["name"] or data.attrs.get("digest", "") != facts.get("digest", ""):
        raise PlanError(f"{where}: {NUMBERS} and {FACTS} are of two plans. Run the plan again.")
    return PlanResult(data, facts, blocks)


def _check_numbers(recorded: object, where: Path) -> None:
    """Refuse numbers other than those that the facts were written with; facts of older versions have no hash."""
    if recorded is not None and recorded != sha256_of(where / NUMBERS, PlanError):
        raise PlanError(
            f"{where / NUMBERS}: not as it was written with {FACTS}: damaged, or of another plan. Run the plan again."
        )


def _facts(path: Path) -> dict[str, Any]:
    facts = json_file(path, "the facts of a plan", "Run the plan again.", PlanError)
    if not isinstance(facts, dict) or not isinstance(facts.get("name"), str):
        raise PlanError(f"{path}: not the facts of a plan. Run the plan again.")
    recorded = facts.pop(OF_FACTS, None)
    if recorded is not None and recorded != _hash_of_facts(facts):
        raise PlanError(f"{path}: not as it was written: damaged, or changed. Run the plan again.")
    if recorded is None:
        facts[UNSEALED] = True
    if isinstance(rows := facts.get("phases"), list):
        facts["phases"] = [_in_depths(row) for row in rows]
    return facts


def _in_depths(row: Any) -> Any:
    """A phase with depths; one of version 0.10 has heights."""
    if not isinstance(row, dict) or "start" not in row:
        return row
    heights = {"start_depth": row["start"], "depth": row.get("end")}
    others = {key: value for key, value in row.items() if key not in ("start", "end")}
    return others | {key: 0.0 - z if isinstance(z, int | float) else z for key, z in heights.items()}
