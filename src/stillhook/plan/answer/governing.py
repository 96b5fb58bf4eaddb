"""Which cell of a plan's table is asked for, and what governs it."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stillhook.errors import PlanError
from stillhook.plan.answer.saved import PLAN_FILES, load_plan_result
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.result import CREDITS, PlanResult, ran
from stillhook.plan.tiers.time_domain.lowering import KINDS
from stillhook.spec.lift.phase import Phase
from stillhook.units import parse, quote, show

if TYPE_CHECKING:
    import xarray


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
    names = [each.name for each in plan.phases if each.kind in KINDS]
    if phase is not None and phase not in names:
        raise PlanError(f"--cell: phase {quote(phase)}: runs of the twin are made of {', '.join(names) or 'none'}.")
    Hs = None if values.get("hs") is None else parse(values["hs"], "length", "--cell: Hs")
    if Hs is not None and not 0.0 <= Hs <= max(env.Hs):
        raise PlanError(f"--cell: Hs {show(Hs, 'length')}: the table goes from 0 m to {show(max(env.Hs), 'length')}.")
    return Wanted(
        Tp,
        beta,
        Hs,
        None if alternative is None else Alternative(alternative),
        None if phase is None else plan.phase(phase),
    )


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
    """What governs a cell. Without an alternative that of the first page, as credited; with one its limit as modelled.

    result: may be left out where the cell is `complete`. Errors: PlanError where nothing limits the cell, or by no run.
    """
    if ask.alternative is not None and ask.phase is not None and ask.Hs is not None:
        return Governing(ask.alternative, ask.alternative, ask.phase, "", math.nan, credited=False)
    assert result is not None
    leads = Alternative(str(result.facts["summary"]["shown"]))
    alternative, credit = (leads, CREDITED) if ask.alternative is None else (ask.alternative, MODELLED)
    at = _column(result.data, ask).sel(alternative=alternative.value)
    if ask.phase is not None:
        name, rule, Hs, tier = ask.phase.name, *_least(at["Hs_rule"].sel(credit=MODELLED, phase=ask.phase.name)), ""
        tier = Tier.TIME.value if rule else str(at["counts"].sel(phase=name).item())
    else:
        of_cell = at.sel(credit=credit)
        name, rule, tier = (str(of_cell[f"governing_{key}"].item()) for key in ("phase", "rule", "tier"))
        Hs = float(of_cell["Hs_limit"])
    by_runs = tier == Tier.TIME.value and rule != "" and math.isfinite(Hs)
    if not name or not (by_runs or ask.Hs is not None) or plan.phase(name).kind not in KINDS:
        top = show(max(plan.environment.Hs), "length")
        why = (
            f"nothing limits it up to Hs {top}"
            if math.isinf(Hs) or not name
            else f"its limit, {rule or 'any'} in {name}, is by the {tier or 'twin not run, and by no other'} tier"
        )
        raise PlanError(f"--cell: {ask.text}, {alternative}: {why}: no run sets it. Add {_simulated(plan)}.")
    phase = plan.phase(name)
    by = alternative if credit == MODELLED else _whose(result.data, ask, alternative, phase, rule, Hs)
    return Governing(alternative, by, phase, rule if by_runs else "", Hs, credit == CREDITED)


def _simulated(plan: LiftPlan) -> str:
    """What makes a cell one that can be run, in words."""
    names = [phase.name for phase in plan.phases if phase.kind in KINDS]
    return f"Hs=2 m, phase={names[-1]} (or {', '.join(names[:-1])})" if names else "a phase that is run in time"


def _column(data: xarray.Dataset, ask: Wanted) -> xarray.Dataset:
    places = {"heading": ask.beta, "period": ask.Tp}
    return data.isel({name: int(np.abs(data[name].values - value).argmin()) for name, value in places.items()})


def _least(Hs: xarray.DataArray) -> tuple[str, float]:
    """Rule with the lowest limit by runs, and that limit [m]; "" and NaN where none was run."""
    by_runs = Hs.sel(tier=Tier.TIME.value)
    values = np.asarray(by_runs.values, dtype=float)
    if np.isnan(values).all():
        return "", math.nan
    i = int(np.nanargmin(values))
    return str(by_runs["rule"].values[i]), float(values[i])


def _whose(
    data: xarray.Dataset, ask: Wanted, alternative: Alternative, phase: Phase, rule: str, Hs: float
) -> Alternative:
    """The alternative whose runs set a credited limit: the flat cap where the limit is that of it alone."""
    place = {"credit": MODELLED, "tier": Tier.TIME.value, "phase": phase.name, "rule": rule}
    known = _column(data, ask)["Hs_rule"].sel(place)
    own, cap = (
        float(known.sel(alternative=a.value)) if a.value in data["alternative"].values else math.nan
        for a in (alternative, Alternative.CAP)
    )
    return Alternative.CAP if cap == Hs != own else alternative
