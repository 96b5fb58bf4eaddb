"""Tables of a plan for Excel: limiting significant wave height in every cell, and the rules with their limits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from stillhook.formats.table.workbook import Sheet
from stillhook.plan.report.document import marks
from stillhook.plan.result import PlanResult
from stillhook.variables import BY_NAME

LIMITS = (
    *("credit", "alternative", "heading [deg]", "Tp [s]", "Hs_limit [m]", "Hs_limit_low [m]", "Hs_limit_high [m]"),
    *("alpha [1]", "op_wf [m]", "governing phase", "governing rule", "tier", "limit is", "remark"),
)
RULES = (
    *("rule", "title", "phase", "alternative", "quantity", "meaning", "limit", "unit", "basis"),
    *("standard", "edition", "clause"),
)
NUMBERS = ("Hs_limit", "Hs_limit_low", "Hs_limit_high", "alpha", "op_wf")
TEXTS = ("governing_phase", "governing_rule", "governing_tier", "governing_end")


def limits_sheet(result: PlanResult) -> Sheet:
    """A row for each credit, alternative, heading and period; a remark where there is no limit or no result."""
    return Sheet("limits", LIMITS, list(_limits(result)), (f"plan: {result.name}", *marks(result)))


def _limits(result: PlanResult) -> Iterator[tuple[Any, ...]]:
    data = result.data
    highest = float(data.attrs["Hs_highest"])
    order = ("credit", "alternative", "heading", "period")
    arrays = {name: data[name].transpose(*order).values for name in (*NUMBERS, *TEXTS)}
    axes = [data[name].values.tolist() for name in order]
    for i, credit in enumerate(axes[0]):
        for j, alternative in enumerate(axes[1]):
            for k, heading in enumerate(axes[2]):
                for m, period in enumerate(axes[3]):
                    at = (i, j, k, m)
                    numbers = [float(arrays[name][at]) for name in NUMBERS]
                    texts = [str(arrays[name][at]) for name in TEXTS]
                    row = (credit, alternative, round(math.degrees(heading), 6), period)
                    yield (*row, *numbers, *texts, _remark(numbers[0], highest))


def _remark(Hs: float, highest: float) -> str:
    if math.isnan(Hs):
        return "no result"
    if Hs == 0.0:
        return "limits are exceeded in every sea state, calm included"
    return f"no limit up to Hs {highest:g} m, the highest sea state analysed" if math.isinf(Hs) else ""


def rules_sheet(facts: Mapping[str, Any]) -> Sheet:
    """The rule check: a row for each rule, phase and alternative, its limit in SI with what it is of. facts: what
    `stillhook.plan.report.checked.checked` answers, or the facts of a result."""
    about = {row["key"]: row for row in facts["rules"]["rows"]}
    rows = []
    for each in _limited(facts):
        rule = about.get(each["rule"], {})
        quantity = rule.get("quantity", "")
        known = BY_NAME.get(quantity)
        rows.append(
            (
                *(each["rule"], rule.get("title", ""), each["phase"], each["alternative"], quantity),
                *("" if known is None else known.meaning, each["limit"], "" if known is None else known.unit),
                *(each.get("basis") or "", *(rule.get(name, "") for name in RULES[-3:])),
            )
        )
    return Sheet("rules", RULES, rows)


def _limited(facts: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    if "limited" in facts:
        yield from facts["limited"]
        return
    for cell in facts["limits"]:
        for row in cell["rules"]:
            yield {**row, "phase": cell["phase"], "alternative": cell["alternative"]}
