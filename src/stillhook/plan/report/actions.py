"""What to do next with a plan, for its first page: what is missing, not credited or assumed, the most urgent first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from stillhook.plan.assessments.sensitivity.ranking import NAME, lowered
from stillhook.plan.report.words import (
    TEXTS,
    differs,
    height,
    highest,
    leading,
    sentence,
    write,
)
from stillhook.plan.result import FAILED, PlanResult

MOST = 10
"""Lines at most: those of the end are the least urgent."""


def actions(result: PlanResult) -> list[str]:
    """Sentences, each with what to do and where the report has more on it."""
    return list(_actions(result))[:MOST]


def _actions(result: PlanResult) -> Iterator[str]:
    facts, name = result.facts, leading(result)
    for each in result.caused("not-assessed", FAILED):
        yield _write("missing", text=sentence(each))
    if rigging := facts.get("rigging"):
        missing = [] if (rigging["weight"] or {}).get("stated") else ["[weight]"]
        legs = rigging["legs"]
        missing += ["legs in [rigging]"] if legs is None else [] if legs["items"] else ["items in [rigging]"]
        if missing:
            yield _write("rigging", missing=missing)
    if n := sum(case["verdict"] == "not-ok" for case in facts.get("failures", {}).get("cases", [])):
        yield _write("failures", n=n)
    if apart := result.caused("apart"):
        pairs = dict.fromkeys(f"{each['phase']}: {each['rule'].replace('-', ' ')}" for each in apart)
        yield _write("apart", pairs="; ".join(pairs))
    certificate = facts["crane"]["certificate"]
    if any(a.twin for a in result.alternatives) and (not certificate or certificate.get("synthetic")):
        yield _write("validate") if differs(result, name) else _write("validate_same")
    if line := _most_sensitive(result):
        yield line
    op = facts["operation"]
    cells = result.data.sel(credit=result.claim, alternative=name)
    without = int((~np.isfinite(cells["alpha"].values)).sum())
    if op["weather_restricted"] and without:
        lowest = float(op.get("alpha_table", {}).get("Hs_lowest", 1.0))
        yield _write("alpha", n=without, of=cells["alpha"].size, lowest=lowest)
    if op["weather_restricted"] and op["T_C"] is None:
        yield _write("contingency")
    if assumed := sum(kind == "assumed" for _, _, kind, *_ in facts["payload"]["rows"]):
        yield _write("payload", n=assumed)
    if "weather" not in result or result["weather"].attrs["synthetic"]:
        yield _write("weather" if "weather" in result else "no_weather")
    if not facts["rules"].get("entered_by"):
        yield _write("rules", **facts["rules"])


def _write(key: str, **values: object) -> str:
    return write(TEXTS["next"][key], **values)


def _most_sensitive(result: PlanResult) -> str:
    """The input that lowers the limit of a phase most, of those that were varied."""
    of = result.facts.get(NAME)
    moved = next(iter(lowered(of)), None) if of is not None else None
    if moved is None:
        return ""
    top = highest(result)
    ends = {"base": height(moved.base, top), "Hs": height(moved.Hs, top)}
    return _write("confirm", what=moved.title, text=moved.text, phase=moved.phase, **ends)
