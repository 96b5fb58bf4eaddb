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
    runs = [each.name for each in plan.phases if each.kind in KINDS]
    if phase is not None and phase not in runs:
        have = "; ".join(map(quote, runs)) or "none"
        raise PlanError(f"--cell: phase {quote(phase)}: runs of the twin are made of {have}.")
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
