"""The decision page in the lines of a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from stillhook.plan.report.decision.bands import headline, stopped
from stillhook.plan.report.decision.data import decision
from stillhook.plan.report.decision.page import claim_words, clipped, credit_words, status, times
from stillhook.plan.report.words import governs, named
from stillhook.plan.result import PlanResult

NAMED = 2
"""Bands that are named at most."""
STATUS = 190
"""Letters of the status with its reasons at most."""


def short(result: PlanResult) -> list[str]:
    """The claimable limit, the status, what governs, and the times of the operation."""
    of = decision(result)
    word = status(of["status"])
    text = clipped(" ".join([f"{word.word}.", *word.text]), STATUS)
    return [_claim(of), text, _governing(of["claim"]["bands"]), times(of["operation"])]


def _claim(of: Mapping[str, Any]) -> str:
    """The claimable limit with its forecast limit, winch, credit, and bands without a go."""
    claim = of["claim"]
    if claim["credit"] is None:
        return "Claimable limit: not assessed."
    bands = claim["bands"]
    op_wf = headline(bands, "op_wf")
    forecast = f", forecast OP_WF {op_wf}" if op_wf else ""
    by = f"claimable with {named(claim['alternative'])}, worst heading; credit: {credit_words(claim['credit'])}"
    return f"{claim_words(of)}{forecast}: {by}; NO GO: Tp {stopped(bands)}."


def _governing(bands: list[dict[str, Any]]) -> str:
    """What governs most bands."""
    counted = Counter(
        governs(*(band[f"governing_{key}"] or "" for key in ("phase", "rule", "end")))
        for band in bands
        if band["governing_phase"] or band["governing_end"]
    )
    if not counted:
        return ""
    text = "; ".join(f"{by} ({n} of {len(bands)} bands)" for by, n in counted.most_common(NAMED))
    return f"Governing: {text}{' and others' if len(counted) > NAMED else ''}."
