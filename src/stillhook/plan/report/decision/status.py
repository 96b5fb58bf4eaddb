"""Whether a plan is for approval, and the reasons against it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from stillhook.plan.assessments.failures.drive_off import TIMES_ONLY
from stillhook.plan.assessments.rigging.section import AT_LIMIT
from stillhook.plan.report.words import TEXTS, sentence, signature_facts, untrusted, write
from stillhook.plan.result import FAILED, UNSEALED, PlanResult

CARRY = ("card", "failures", "rigging", "quality")
"""Assessments without which no plan is for approval."""
SYNTHETIC = "SYNTHETIC"
"""Start of the names of files of no real machine or place."""


def status_of(result: PlanResult, bands: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """for_approval, and reasons: code and text of each, the gravest first."""
    reasons = [{"code": code, "text": text} for code, text in dict.fromkeys(_reasons(result, bands))]
    return {"for_approval": not reasons, "reasons": reasons}


def _reasons(result: PlanResult, bands: Sequence[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    facts = result.facts
    certificate = facts["crane"]["certificate"] or {}
    charts = [each["file"] for each in facts["inputs"] if each["item"] == "load chart"]
    synthetic = {
        "certificate": bool(certificate.get("synthetic")) and not untrusted(certificate),
        "weather": "weather" in result and bool(result["weather"].attrs["synthetic"]),
        "chart": any(str(name).startswith(SYNTHETIC) for name in charts),
    }
    if untrusted(certificate):
        how = signature_facts(certificate)["statement"]
        yield "untrusted-certificate", write(TEXTS["status"]["untrusted-certificate"], how=how)
    for name, yes in synthetic.items():
        if yes:
            yield f"synthetic-{name}", write(TEXTS["status"][f"synthetic-{name}"])
    if UNSEALED in facts:
        yield UNSEALED, write(TEXTS["status"][UNSEALED])
    for each in result.caused("not-assessed", FAILED):
        yield str(each["cause"]), sentence(each)
    for name in CARRY:
        if name not in facts:
            yield f"no-{name}", write(TEXTS["status"][f"no-{name}"])
    if bands and all(band["no_go"] for band in bands):
        reasons = dict.fromkeys(band["no_go"] for band in bands[:-1])
        yield "no-go", write(TEXTS["status"]["no-go"], reasons=list(reasons))
    yield from _of_assessments(facts)


def _of_assessments(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Reasons that assessments give."""
    texts = TEXTS["status"]
    if failures := facts.get("failures"):
        for verdict in ("not-ok", "not-assessed"):
            judged = [case for case in failures["cases"] if case.get("reason") != TIMES_ONLY]
            if cases := [case["title"] for case in judged if case["verdict"] == verdict]:
                yield f"failure-{verdict}", write(texts[f"failure-{verdict}"], cases=cases, n=len(cases))
    if rigging := facts.get("rigging"):
        if not (rigging["weight"] or {}).get("stated"):
            yield "no-weight", write(texts["no-weight"])
        if rigging["legs"] is None or not rigging["legs"]["items"]:
            yield "no-legs", write(texts["no-legs"], missing="legs" if rigging["legs"] is None else "items")
        elif rigging["legs"]["worst"]["utilisation"] > 1.0:
            yield "over-used", write(texts["over-used"], **rigging["legs"]["worst"])
        if any((row["utilisation"] or 0.0) > AT_LIMIT for row in rigging["hook_loads"]):
            yield "capacity", write(texts["capacity"])
    if failed := sum(len(check["failed"]) for check in facts.get("quality", {}).get("checks", [])):
        yield "contradicted", write(texts["contradicted"], n=failed)
