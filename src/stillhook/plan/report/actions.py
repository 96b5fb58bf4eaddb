"""What to do next with a plan, for its first page: what is missing, not credited or assumed, the most urgent first."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from stillhook.plan.report.words import (
    CREDITED,
    TEXTS,
    differs,
    height,
    highest,
    leading,
    names,
    sentence,
    write,
)
from stillhook.plan.result import FAILED, PlanResult

MOST = 8
"""Lines at most: those of the end are the least urgent."""
FACTORS = {
    "C_A": "added mass",
    "C_D": "drag",
    "friction": "friction of the winch",
    "delay": "delay of the motion signal",
}
"""Inputs that a limit depends on, in words."""


def actions(result: PlanResult) -> list[str]:
    """Sentences, each with what to do and where the report has more on it."""
    return list(_actions(result))[:MOST]


def _actions(result: PlanResult) -> Iterator[str]:
    facts, name = result.facts, leading(result)
    for each in result.caused("not-assessed", FAILED):
        yield _write("missing", text=sentence(each))
    if apart := result.caused("apart"):
        pairs = dict.fromkeys(f"{each['phase']}: {each['rule'].replace('-', ' ')}" for each in apart)
        yield _write("apart", pairs="; ".join(pairs))
    certificate = facts["crane"]["certificate"]
    if any(a.twin for a in result.alternatives) and (not certificate or certificate.get("synthetic")):
        yield _write("validate") if differs(result, name) else _write("validate_same")
    if "sensitivity" in result and (line := _most_sensitive(result, name)):
        yield line
    op = facts["operation"]
    cells = result.data.sel(credit=CREDITED, alternative=name)
    without = int((~np.isfinite(cells["alpha"].values)).sum())
    if op["weather_restricted"] and without:
        lowest = float(op.get("alpha_table", {}).get("Hs_lowest", 1.0))
        yield _write("alpha", n=without, of=cells["alpha"].size, lowest=lowest)
    if op["weather_restricted"] and op["T_C"] is None:
        yield _write("contingency")
    if assumed := sum(kind == "assumed" for _, _, kind, *_ in facts["payload"]["rows"]):
        yield _write("payload", n=assumed)
    if "weather" in result and result["weather"].attrs["synthetic"]:
        yield _write("weather")
    yield _write("rules", **facts["rules"])


def _write(key: str, **values: object) -> str:
    return write(TEXTS["next"][key], **values)


def _most_sensitive(result: PlanResult, name: str) -> str:
    """The input that lowers the limit of the leading alternative most, of those that were varied."""
    block, top = result["sensitivity"], highest(result)
    if name not in names(block):
        return ""
    of = block.sel(alternative=name)
    found = [
        (float(of["Hs_base"].values[i]), float(of[f"Hs_{end}"].values[i]), factor, str(block[f"{end}_text"].values[i]))
        for i, factor in enumerate(names(block, "factor"))
        for end in ("low", "high")
    ]
    lower = [each for each in found if math.isfinite(each[0]) and math.isfinite(each[1]) and each[1] < each[0] - 0.005]
    if not lower:
        return ""
    base, Hs, factor, text = min(lower, key=lambda each: each[1] - each[0])
    what, ends = FACTORS.get(factor, factor), {"base": height(base, top), "Hs": height(Hs, top)}
    return _write("confirm", what=what, text=text, phase=block.attrs["phase"], **ends)
