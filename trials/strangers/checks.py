"""What must hold of a plan, whatever was lifted, by which crane, from which vessel and in which seas.

A check yields a text for each thing that it looked at: empty where it holds, a line with numbers where it does not.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.plan.definition.rules import Alternative, Demand, Limited, Tier
from stillhook.plan.limits import limited, utilisation
from stillhook.plan.result import FAILED, PlanResult

HOLDS = ""
CLOSE = 1e-6
"""Height by which limits may differ by rounding [m]; tables of runs are in single precision."""
INSIDE, BEYOND = 0.85, 1.05
"""Measured part of a limit that a sea may use and count as inside; part of it from which the better end of what was
measured, to 95 %, is beyond [-]."""
TWIN, CREDITED = "twin", "credited"
NO_ERROR, NO, REFUSED = 0, 1, 2
"""Exit codes that a user may get."""
ANNOUNCED = ("compiling", "some ")
"""Begin lines that a command writes before it runs something long."""
MOST_LINES = 5
"""Violations of one check that a draw keeps."""


@dataclass
class Tally:
    """How often a check looked at something, and what it found: the first lines, and how many there are."""

    checked: int = 0
    violated: int = 0
    lines: list[str] = field(default_factory=list)

    def add(self, texts: Iterable[str]) -> None:
        for text in texts:
            self.checked += 1
            if text:
                self.violated += 1
                if len(self.lines) < MOST_LINES:
                    self.lines.append(text)


def exit_code(command: str, code: int, err: str) -> Iterator[str]:
    """A command ends with 0, 1 or 2, and says why in one line where it refuses; never with a traceback."""
    lines = [line for line in err.splitlines() if line.strip() and not line.startswith(ANNOUNCED)]
    if code not in (NO_ERROR, NO, REFUSED):
        yield f"{command}: exit code {code}: {' | '.join(lines)[:300]}"
    elif "Traceback" in err:
        yield f"{command}: a traceback: {err[-300:]!r}"
    elif code == REFUSED and len(lines) != 1:
        yield f"{command}: refused in {len(lines)} lines: {' | '.join(lines)[:300]}"
    else:
        yield HOLDS


def answered(result: PlanResult, code: int) -> Iterator[str]:
    """The exit code of a plan says whether any sea of the table is workable, and whether all was computed."""
    right = NO_ERROR if result.workable and not result.failed else NO
    yield HOLDS if code == right else f"exit code {code}, and workable {result.workable}, failed {result.failed}"


def computed(result: PlanResult) -> Iterator[str]:
    """Nothing of a plan is left because its computation failed."""
    failed = [f"{each['what']}: {each['reason']}" for each in result.caused(FAILED)]
    yield from failed or [HOLDS]


def ordered(result: PlanResult) -> Iterator[str]:
    """A limit is not negative and lies within its own interval."""
    data = result.data
    names = ("Hs_limit_low", "Hs_limit", "Hs_limit_high")
    low, Hs, high = (data[name].values for name in names)
    for i in np.ndindex(Hs.shape):
        if np.isnan(Hs[i]):
            continue
        fits = Hs[i] >= 0.0 and not low[i] > Hs[i] + CLOSE and not high[i] < Hs[i] - CLOSE and not low[i] < 0.0
        yield HOLDS if fits else f"{_cell(result, i)}: low {low[i]:.3f}, limit {Hs[i]:.3f}, high {high[i]:.3f} m"


def credited(result: PlanResult) -> Iterator[str]:
    """What is credited of a twin lies between the twin and the cap; not above the cap where nothing is certified."""
    Hs, names = result.data["Hs_limit"], [a.value for a in result.alternatives]
    if Alternative.CAP not in result.alternatives:
        return
    cap = Hs.sel(credit=TWIN, alternative=Alternative.CAP.value).values
    for name in (a.value for a in result.alternatives if a.twin):
        i = names.index(name)
        twin, credit = (Hs.sel(credit=c, alternative=name).values for c in (TWIN, CREDITED))
        covered = np.nan_to_num(result.data["inside"].sel(alternative=name).values) > 0.0
        for at in np.ndindex(cap.shape):
            t, c, x = float(twin[at]), float(cap[at]), float(credit[at])
            if np.isnan([t, c, x]).any():
                continue
            most = max(t, c) if covered[(slice(None), *at)].any() else c
            fits = min(t, c) - CLOSE <= x <= min(max(t, c), most) + CLOSE
            yield HOLDS if fits else f"{_cell(result, (1, i, *at))}: credited {x:.3f} m, twin {t:.3f} m, cap {c:.3f} m"


def least_of_rules(result: PlanResult) -> Iterator[str]:
    """A credited limit is the least of what its phases and rules allow; a forecast never allows more."""
    data = result.data.sel(credit=CREDITED)
    rules = data["Hs_rule"].min(("tier", "phase", "rule")).transpose(*data["Hs_limit"].dims).values
    Hs, op_wf = data["Hs_limit"].values, data["op_wf"].values
    for i in np.ndindex(Hs.shape):
        if np.isnan(Hs[i]):
            continue
        same = Hs[i] == rules[i] or abs(Hs[i] - rules[i]) < CLOSE
        fits = same and not op_wf[i] > Hs[i] + CLOSE
        at = _cell(result, (1, *i))
        yield HOLDS if fits else f"{at}: {Hs[i]:.3f} m, least rule {rules[i]:.3f} m, forecast {op_wf[i]:.3f} m"


def agrees_with_runs(result: PlanResult, plan: LiftPlan, demands: Sequence[Demand]) -> Iterator[str]:
    """No limit by runs is below a sea whose runs used less than `INSIDE` of it, all lower ones being within it, and
    none is above a sea whose runs use more than `BEYOND` to 95 %. demands: of all seas that were run, on the table or
    not."""
    limits = result.data["Hs_rule"].sel(credit=TWIN, tier=Tier.TIME.value)
    headings = result.data["heading"].values
    for demand in (each for each in demands if each.tier is Tier.TIME):
        of = plan.under(demand.alternative)
        for rule in limited(of, of.phase(demand.phase), demand.alternative):
            if rule.rule.quantity not in demand.values:
                continue
            at = {"alternative": demand.alternative.value, "phase": demand.phase, "rule": rule.rule.key}
            for T, beta, rows in demand.seas.columns:
                heading = headings[np.abs(np.exp(1j * headings) - np.exp(1j * beta)).argmin()]
                Hs = float(limits.sel({**at, "heading": heading}).sel(period=T, method="nearest"))
                where = f"{', '.join(at.values())}, {np.degrees(beta):.0f} deg, {T:g} s"
                yield from _of_column(where, rule, demand, rows, Hs)


def _of_column(where: str, each: Limited, demand: Demand, rows: Any, Hs: float) -> Iterator[str]:
    values, low, high = (table.get(each.rule.quantity) for table in (demand.values, demand.low, demand.high))
    if values is None or np.isnan(Hs):
        return
    rows = rows[~np.isnan(values[rows])]
    heights = demand.seas.Hs[rows]
    used = utilisation(each, values[rows], heights)
    ends = [utilisation(each, end[rows], heights) for end in (low, high) if end is not None]
    surely = np.fmin.reduce([used, *ends])
    inside = 0.0
    for h, u in zip(heights, used, strict=True):
        if u > 1.0:
            break
        inside = h if u < INSIDE else inside
    beyond = min(heights[(surely > BEYOND) & (heights > 0.0)], default=np.inf)
    of = ", ".join(f"{h:g} m: {u:.2f} ({s:.2f})" for h, u, s in zip(heights, used, surely, strict=True))
    if Hs < inside - CLOSE:
        yield f"{where}: limit {Hs:.3f} m is below a sea well inside; used of the limit (better end): {of}"
    elif Hs > beyond + CLOSE:
        yield f"{where}: limit {Hs:.3f} m is above a sea beyond; used of the limit (better end): {of}"
    else:
        yield HOLDS


def more_is_more(result: PlanResult) -> Iterator[str]:
    """Limits that are nowhere lower give no lower forecast limits, and in weather no fewer workable hours and no longer
    wait."""
    Hs, op_wf = (np.nan_to_num(result.data[name].values, nan=0.0) for name in ("Hs_limit", "op_wf"))
    rows = list(itertools.product(range(Hs.shape[0]), range(Hs.shape[1])))
    year = result["weather"].sel(month=0) if "weather" in result else None
    for a, b in itertools.permutations(rows, 2):
        if not (Hs[a] >= Hs[b]).all():
            continue
        names = " against ".join(_row(result, row) for row in (a, b))
        lower = op_wf[a] < op_wf[b] - CLOSE
        yield f"{names}: forecast limits {op_wf[a][lower]} below {op_wf[b][lower]} m" if lower.any() else HOLDS
        if year is not None:
            yield from _in_weather(names, _year(year, result, a), _year(year, result, b))


def _in_weather(names: str, better: dict[str, float], worse: dict[str, float]) -> Iterator[str]:
    key = "operability"
    low = better[key] < worse[key] - 1e-12
    yield f"{names}: workable {better[key]:.6f}, fewer than {worse[key]:.6f}" if low else HOLDS
    if better["n_censored"] == worse["n_censored"]:
        key = "wait_mean"
        longer = better[key] > worse[key] + 1.0
        yield f"{names}: wait {better[key]:.0f} s, longer than {worse[key]:.0f} s" if longer else HOLDS


def _year(year: Any, result: PlanResult, row: tuple[int, int]) -> dict[str, float]:
    of = year.sel(credit=(TWIN, CREDITED)[row[0]], alternative=result.alternatives[row[1]].value)
    return {name: float(of[name]) for name in ("operability", "wait_mean", "n_censored")}


def looser_is_no_lower(strict: PlanResult, loose: PlanResult) -> Iterator[str]:
    """A more lenient limit lowers no limiting sea of the closed form and of the frequency-domain method."""
    tiers = [Tier.CLOSED_FORM.value, Tier.FREQUENCY.value]
    dims = ("tier", "alternative", "phase", "rule", "heading", "period")
    one, other = (r.data["Hs_rule"].sel(credit=TWIN, tier=tiers).transpose(*dims) for r in (strict, loose))
    rules = [str(r) for r in one["rule"].values if r in other["rule"].values]
    a, b = (x.sel(rule=rules).values for x in (one, other))
    for i in np.ndindex(a.shape):
        if np.isnan(a[i]) or np.isnan(b[i]):
            continue
        labels = [str(one[name].values[k]) for name, k in zip(dims[:3], i[:3], strict=True)]
        where = ", ".join([*labels, rules[i[3]], _column(strict, i[4:])])
        yield (
            HOLDS if b[i] >= a[i] - CLOSE else f"{where}: {b[i]:.4f} m with a more lenient limit, {a[i]:.4f} m without"
        )


def _row(result: PlanResult, row: tuple[int, ...]) -> str:
    return f"{result.alternatives[row[1]].value} ({(TWIN, CREDITED)[row[0]]})"


def _column(result: PlanResult, i: tuple[int, ...]) -> str:
    heading, period = (float(result.data[name].values[k]) for name, k in zip(("heading", "period"), i, strict=True))
    return f"{np.degrees(heading):.0f} deg, {period:g} s"


def _cell(result: PlanResult, i: tuple[int, ...]) -> str:
    return f"{_row(result, i[:2])}, {_column(result, i[2:])}"
