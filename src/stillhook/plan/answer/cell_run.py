"""Which cell of a plan's table is asked for, what governs it, and the run that does: the worst of those about its
limit, and its lift file, which `stillhook lower` repeats to the bit."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stillhook.base.atomic import check_folder
from stillhook.base.progress import Progress
from stillhook.engine.simulate import simulate
from stillhook.errors import PlanError
from stillhook.formats.lift_file import load_lift
from stillhook.formats.lift_writer import FILES, LIFT, Run, write_lift
from stillhook.plan.definition.capacities import calm as calm_of
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Limited, Tier
from stillhook.plan.limits import limited
from stillhook.plan.result import CREDITS, PLAN_FILES, PlanResult, load_plan_result, ran
from stillhook.plan.tiers.time_domain.cells import CellRequest, Cells, Execution, Runs, run_numbers
from stillhook.plan.tiers.time_domain.crossings import BIN, crosses
from stillhook.plan.tiers.time_domain.curves import x_limit_of
from stillhook.plan.tiers.time_domain.lowering import KINDS, SeaState, winch_of
from stillhook.plan.tiers.time_domain.measures import Measure, measures
from stillhook.plan.tiers.time_domain.placing import FINE, Search, snapped
from stillhook.report.formatting import cell as shown
from stillhook.report.kit import can_draw
from stillhook.report.save import FILMS, LOWERING_FILES, lowering_answer, write_lowering
from stillhook.spec.crane import identity
from stillhook.spec.lift.phase import Phase
from stillhook.trust.results import result_folder
from stillhook.units import number, parse, quote, show

if TYPE_CHECKING:
    import xarray

ABOUT = 0.1
"""How far from the limiting height runs may be that stand for it, in ln."""
MOST = 128
"""Numbers up to which runs of a sea are looked for in a store."""


@dataclass(frozen=True, eq=False)
class GoverningRun:
    """The worst of the runs about a limit. Hs of its sea [m]; number of the run in that sea, n of runs that it is the
    worst of; made: whether they were made now, for the store had none; rule with its limit there; value of the rule's
    quantity in the run [SI]; counts: number of the phase that counts."""

    ask: Wanted
    of: Governing
    Hs: float
    number: int
    n: int
    made: bool
    rule: Limited
    value: float
    measure: Measure = field(repr=False)
    counts: int
    run: Run = field(repr=False)

    @property
    def limit(self) -> float:
        """Limit of the rule at the height of the run [SI]."""
        return float(self.rule.at(np.array([self.Hs]))[0])

    @property
    def folder(self) -> str:
        """Name of a folder for it."""
        height = "" if self.ask.Hs is None else f"-{number(self.Hs)}m"
        place = f"{number(self.ask.Tp)}s-{number(math.degrees(self.ask.beta))}deg{height}"
        return re.sub(r"[^a-z0-9.]+", "-", f"cell-{place}-{self.of.by}-{self.of.phase.name}".lower()).strip("-")

    @property
    def line(self) -> str:
        """What governs, which number, which limit."""
        of, name = self.of, self.rule.rule.quantity
        credited = f", credited to {of.alternative}" if of.by is not of.alternative else ""
        up_to = (
            f"{self.rule.rule.key} in {of.phase.name} governs {of.by}{credited}, up to Hs {show(of.Hs, 'length', 3)}"
        )
        what = f"{of.phase.name}, {of.by}" if math.isnan(of.Hs) else up_to
        which = "the run" if self.n == 1 else f"run {self.number}, the worst of {self.n}"
        which += " made now" if self.made else ""
        sea = "in still water" if self.Hs == 0.0 else f"at Hs {show(self.Hs, 'length', 3)}"
        sense = self.rule.rule.sense.replace("-", " ")
        judged = f"{name} {shown(name, self.value)}, {self.rule.rule.key} {sense} {shown(name, self.limit)}"
        return f"{self.ask.text}: {what}; {which} {sea}: {judged}"

    def facts(self) -> dict[str, Any]:
        """Plain data for JSON [SI]."""
        of = self.of
        who = {"alternative": of.alternative.value, "runs_of": of.by.value, "phase": of.phase.name}
        place = {"Tp": self.ask.Tp, "heading": self.ask.beta, "Hs_limit": of.Hs, "credited": of.credited}
        run = {"Hs": self.Hs, "run": self.number, "of": self.n, "seed": getattr(self.run.case, "seed", None)}
        rule = {"rule": self.rule.rule.key, "quantity": self.rule.rule.quantity}
        return who | place | run | rule | {"value": self.value, "limit": self.limit, "text": self.line}


def governing_run(
    plan: LiftPlan, of: Governing, ask: Wanted, execution: Execution, progress: Progress | None = None
) -> GoverningRun:
    """The worst run about a limit, of those in the store; made as the plan makes them where it has none.

    Of runs that have a height each (phases over the seabed) those within 5 % of the one next to the limit count, else
    those of the height next to it. Worst is the one that uses most of the rule.
    """
    cells = Cells(plan, execution)
    top = max(plan.environment.Hs)
    goal = ask.Hs if ask.Hs is not None else min(of.Hs, top)
    heights = [goal] if ask.Hs is not None or goal <= 0.0 else _ladder(goal, top)
    cell = CellRequest(of.phase.name, winch_of(of.phase, of.by), SeaState(goal, ask.Tp, ask.beta), MOST)
    result: list[_Run] = []
    for Hs in heights:
        numbers, runs = cells.stored(_at(plan, cell, Hs, MOST))
        result += [_Run(Hs, k, runs, i) for i, k in enumerate(numbers)]
    made = not result
    if made:
        request = _at(plan, cell, heights[0], Search().seeds)
        cells.request([request], progress)
        of_cell = cells.runs[request.cell]
        result = [_Run(heights[0], i + 1, of_cell, i) for i in range(len(of_cell["duration"]))]
    nearest = min((each.Hs for each in result), key=lambda Hs: _off(Hs, goal))
    one_by_one = crosses(of.phase) and plan.environment.swell is None and ask.Hs is None
    about = [each for each in result if _off(each.Hs, nearest) <= (0.5 * BIN if one_by_one else 0.0)]
    course = cells.course(of.phase, cell.winch, cell.spot)
    known, still = measures(plan, of.phase, of.by, cell.winch, course), plan.once(calm_of, of.phase)
    judged = [
        (_used(known[q], each, run, still.get(q, math.nan)), each, run)
        for each in limited(plan, of.phase, of.by)
        if of.rule in ("", each.rule.key) and (q := each.rule.quantity) in known and known[q].x in about[0].runs
        for run in about
    ]
    if not judged:
        raise PlanError(f"--cell: {ask.text}: runs of {of.phase.name} do not cover {of.rule or 'its rules'}.")
    _, rule, worst = max(judged, key=lambda row: row[0])
    measure = known[rule.rule.quantity]
    crane, cases = cells.cases(_at(plan, cell, worst.Hs, 1), [worst.number])
    return GoverningRun(
        ask=ask,
        of=of,
        Hs=worst.Hs,
        number=worst.number,
        n=len(about),
        made=made,
        rule=rule,
        value=float(measure.of_x(measure.values(worst.runs))[worst.place]),
        measure=measure,
        counts=course.counts,
        run=Run(crane, cases[0], **cells.options),
    )


class _Run(NamedTuple):
    """A run: height of its sea [m], number in that sea, runs of its cell and its place among them."""

    Hs: float
    number: int
    runs: Runs
    place: int


def _at(plan: LiftPlan, cell: CellRequest, Hs: float, seeds: int) -> CellRequest:
    """A cell at another height, with so many seeds; a calm with one run."""
    return cell._replace(spot=cell.spot._replace(Hs=Hs), seeds=1 if plan.environment.calm(Hs) else seeds)


def _off(Hs: float, goal: float) -> float:
    """Distance of two heights, in ln."""
    return abs(math.log(max(Hs, SAME) / max(goal, SAME)))


def _ladder(goal: float, top: float) -> list[float]:
    """Heights that a plan runs about one [m], the nearest first."""
    steps = [snapped(x) for x in np.arange(FINE, top + FINE, FINE)]
    near = {Hs for Hs in steps if Hs <= top * (1.0 + 1e-9) and _off(Hs, goal) <= ABOUT}
    return sorted(near | {min(snapped(goal), top)}, key=lambda Hs: (_off(Hs, goal), Hs))


def _used(measure: Measure, rule: Limited, run: _Run, still: float) -> float:
    """How much a run uses of what a rule leaves to the waves [-]; still: its quantity in still water, or NaN [SI]."""
    x, x_limit = measure.values(run.runs)[run.place], x_limit_of(measure, float(rule.at(np.array([run.Hs]))[0]))
    x_still = measure.to_x(still) if math.isfinite(still) else 0.0
    return float((x - x_still) / (x_limit - x_still)) if x_limit > x_still else math.inf if x > x_limit else 0.0


class Lowered(NamedTuple):
    """What was written of a run: names of the files; repeats: whether the lowering of the file gave the number of the
    plan's own run; line: how it is repeated."""

    files: tuple[str, ...]
    repeats: bool
    line: str


def lowered(governing: GoverningRun, folder: Path) -> Lowered:
    """Write the run as a lift file, lower that, and write pictures, series, summary and, where pictures can be drawn,
    its film next to it."""
    check_folder(folder, (*FILES, *LOWERING_FILES, *FILMS))
    with result_folder(folder, "lift file of a governing run", [identity(governing.run.crane)]) as part:
        names = write_lift(
            governing.run, part, remarks=[governing.line, f"Repeat it: stillhook lower {LIFT} --out again"]
        )
    file = load_lift(folder / LIFT)
    data = simulate(file.crane, file.lift, step=file.step, every=file.every, sampling=file.sampling, end=file.end)
    film = {file.lift.controller.value: data} if can_draw() else {}
    pictures = write_lowering(folder, data, file, lowering_answer(data, file), film=film)
    numbers = run_numbers(data.expand_dims("case"), [governing.counts])
    value = float(governing.measure.of_x(governing.measure.values(numbers))[0])
    name = governing.rule.rule.quantity
    same = value == governing.value
    again = "to the bit" if same else f"with {name} {shown(name, value)}: the store is of another version or machine"
    line = f"stillhook lower {folder / LIFT} repeats it {again}."
    return Lowered((*names, *pictures), same, line)


KEYS = {"tp": "Tp", "heading": "heading", "hs": "Hs", "alternative": "alternative", "phase": "phase"}
_KEY = re.compile(rf"(?:^|,)\s*({'|'.join(KEYS)})\s*=\s*", re.IGNORECASE)
EXAMPLE = '"Tp=9 s, heading=165 deg", and Hs, alternative, phase where you like'
SAME = 1e-6
"""Part of a period or heading by which what is written may differ from that of the table."""
MODELLED, CREDITED = CREDITS


class Wanted(NamedTuple):
    """A cell that is asked for: peak period [s] and direction of travel [rad] of the table; None: as it governs."""

    Tp: float
    beta: float
    Hs: float | None = None
    alternative: Alternative | None = None
    phase: Phase | None = None

    @property
    def complete(self) -> bool:
        """Whether it says which run without any limit."""
        return None not in (self.Hs, self.alternative, self.phase)

    @property
    def text(self) -> str:
        """The column in words."""
        return f"Tp {show(self.Tp, 'time')}, {show(self.beta, 'angle')}"


def wanted(text: str, plan: LiftPlan) -> Wanted:
    """The cell that a text such as "Tp=9 s, heading=165 deg" names. Errors: PlanError, UnitError, one line."""
    where = f"--cell {quote(text)}"
    head, *parts = _KEY.split(text)
    values = {key.lower(): value.strip() for key, value in zip(parts[::2], parts[1::2], strict=True)}
    if head.strip() or len(values) < len(parts) // 2 or not {"tp", "heading"} <= values.keys():
        raise PlanError(f"{where}: name Tp and heading, each once: {EXAMPLE}.")
    env = plan.environment
    Tp = _of_table(parse(values["tp"], "time", "--cell: Tp"), env.Tp, "Tp", "time")
    beta = _of_table(parse(values["heading"], "angle", "--cell: heading"), env.headings, "heading", "angle")
    alternative, phase = values.get("alternative"), values.get("phase")
    if alternative is not None and alternative not in plan.alternatives:
        raise PlanError(f"--cell: alternative {quote(alternative)}: the plan has {', '.join(plan.alternatives)}.")
    runs = [each.name for each in plan.phases if each.kind in KINDS]
    if phase is not None and phase not in runs:
        have = "; ".join(map(quote, runs)) or "none"
        raise PlanError(f"--cell: phase {quote(phase)}: runs of the twin are made of {have}.")
    Hs = None if values.get("hs") is None else parse(values["hs"], "length", "--cell: Hs")
    if Hs is not None and not 0.0 <= Hs <= max(env.Hs):
        raise PlanError(f"--cell: Hs {show(Hs, 'length')}: the table goes from 0 m to {show(max(env.Hs), 'length')}.")
    named = None if alternative is None else Alternative(alternative)
    return Wanted(Tp, beta, Hs, named, None if phase is None else plan.phase(phase))


def _of_table(value: float, axis: Sequence[float], name: str, kind: str) -> float:
    nearest = min(axis, key=lambda x: abs(x - value))
    if abs(nearest - value) > SAME * (1.0 + abs(value)):
        have = ", ".join(show(x, kind) for x in sorted(axis))
        raise PlanError(f"--cell: {name} {show(value, kind)} is not of the plan's table, which has {have}.")
    return nearest


def answer_in(folder: Path, plan: LiftPlan, seed: int = 0) -> PlanResult | None:
    """The answer of this plan, by runs of the twin with this seed, that a folder holds; None where it holds none, or
    that of another one. Errors: PlanError where its files are damaged."""
    if not all((folder / name).is_file() for name in PLAN_FILES):
        return None
    result = load_plan_result(folder)
    digests = [row["sha256"] for row in result.facts.get("inputs", ()) if row["item"] == "plan"]
    same = digests == [plan.digest] and result.facts.get("runs", {}).get("seed", 0) == seed
    return result if same and ran(result.facts.get("tiers", ())) else None


@dataclass(frozen=True)
class Governing:
    """What limits a cell: the alternative whose limit it is, and the one whose runs set it (the flat cap, where no more
    is credited); phase; rule by its key ("": the one that a run uses most); limiting height [m], NaN where the height
    was given."""

    alternative: Alternative
    by: Alternative
    phase: Phase
    rule: str
    Hs: float
    credited: bool


def governing(plan: LiftPlan, result: PlanResult | None, ask: Wanted) -> Governing:
    """What governs a cell: of the alternative of the first page as credited; where alternative or phase are named, by
    their own runs.

    result: may be left out where the cell is `complete`. Errors: PlanError where nothing limits the cell, or no run.
    """
    if ask.alternative is not None and ask.phase is not None and ask.Hs is not None:
        return Governing(ask.alternative, ask.alternative, ask.phase, "", math.nan, credited=False)
    assert result is not None
    credited = ask.alternative is None and ask.phase is None
    alternative = ask.alternative or Alternative(str(result.facts["summary"]["shown"]))
    at = _column(result.data, ask).sel(alternative=alternative.value)
    if ask.phase is None:
        of_cell = at.sel(credit=CREDITED if credited else MODELLED)
        name, rule, tier = (str(of_cell[f"governing_{key}"].item()) for key in ("phase", "rule", "tier"))
        Hs = float(of_cell["Hs_limit"])
    else:
        name = ask.phase.name
        rule, Hs = _least(at["Hs_rule"].sel(credit=MODELLED, tier=Tier.TIME.value, phase=name))
        tier = Tier.TIME.value if rule else str(at["counts"].sel(phase=name).item())
    by_runs = tier == Tier.TIME.value and math.isfinite(Hs)
    if not name or plan.phase(name).kind not in KINDS or not (by_runs or ask.Hs is not None):
        of = f"{ask.text}, {alternative}{f', {name}' if name else ''}"
        if name and tier != Tier.TIME.value:
            why = f"the limit is by the {tier} tier, and no run sets it" if tier else "no tier gives a limit"
        else:
            why = f"no limit up to Hs {show(max(plan.environment.Hs), 'length')}"
        runs = "; ".join(quote(phase.name) for phase in plan.phases if phase.kind in KINDS)
        height = Hs if 0.0 < Hs < math.inf else 0.5 * max(plan.environment.Hs)
        add = f"Hs={show(height, 'length', 3)}"
        add += "" if ask.phase is not None else f" and phase=, one of {runs or 'none that is run'}"
        raise PlanError(f"--cell: {of}: {why}. Add {add}.")
    rule = rule if by_runs else ""
    by = _whose(result.data, ask, alternative, name, rule, Hs) if credited and rule else alternative
    return Governing(alternative, by, plan.phase(name), rule, Hs, credited)


def _column(data: xarray.Dataset, ask: Wanted) -> xarray.Dataset:
    places = {"heading": ask.beta, "period": ask.Tp}
    return data.isel({name: int(np.abs(data[name].values - value).argmin()) for name, value in places.items()})


def _least(Hs: xarray.DataArray) -> tuple[str, float]:
    """Rule with the lowest limit, and that limit [m]; "" and NaN where there is none."""
    values = np.asarray(Hs.values, dtype=float)
    if np.isnan(values).all():
        return "", math.nan
    i = int(np.nanargmin(values))
    return str(Hs["rule"].values[i]), float(values[i])


def _whose(
    data: xarray.Dataset, ask: Wanted, alternative: Alternative, phase: str, rule: str, Hs: float
) -> Alternative:
    """The alternative whose runs set a credited limit: the flat cap where the limit is that of it alone."""
    place = {"credit": MODELLED, "tier": Tier.TIME.value, "phase": phase, "rule": rule}
    known = _column(data, ask)["Hs_rule"].sel(place)
    own, cap = (
        float(known.sel(alternative=a.value)) if a.value in data["alternative"].values else math.nan
        for a in (alternative, Alternative.CAP)
    )
    return Alternative.CAP if cap == Hs != own else alternative
