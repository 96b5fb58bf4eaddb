"""What the decision page has to say, as plain data in SI: the file decision.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stillhook.plan.report.decision.bands import bands_of, edges_of
from stillhook.plan.report.decision.status import status_of
from stillhook.plan.report.words import TEXTS
from stillhook.plan.result import PlanResult
from stillhook.report.formatting import groups
from stillhook.spec.validity import SHORT

ASSESSED = ("failures", "rigging", "quality", "assumed", "hindcast")
"""Assessments that the page reads, by their keys in a result; None where one is missing."""
NOT_ENTERED = "not entered"
MARINE = ("DNV", "EN ", "ISO", "API", "IMCA")
"""Starts of standards among the sources of rules."""


def decision(result: PlanResult) -> dict[str, Any]:
    """The page as data; a section whose assessment is missing is None."""
    facts = result.facts
    claim = claim_of(result)
    return {
        "document": head(result),
        "status": status_of(result, claim["bands"]),
        "operation": dict(facts["operation"]),
        "rules": _rules(facts),
        "claim": claim,
        **{name: facts.get(name) for name in ASSESSED},
        "not_covered": [*TEXTS["covered_by"]["unsafe"], *TEXTS["covered_by"]["not_covered"]],
        "runs": {key: facts["runs"].get(key) for key in ("n", "n_failed", "seeds_per_cell", "seed")},
    }


def head(result: PlanResult) -> dict[str, Any]:
    """Number, revision, lift, field, date, and who prepared and checked it."""
    given, facts = result.facts.get("document", {}), result.facts
    names = ("revision", "field", "prepared_by", "checked_by")
    number = given.get("number") or groups(facts["digest"], SHORT)
    lift = facts["payload"].get("title") or facts["payload"]["name"]
    texts = {"number": number, "name": facts["name"], "lift": lift, "place": facts["place"]["text"]}
    return texts | {key: given.get(key, "") for key in names} | {"date": facts["date"], "digest": facts["digest"]}


def claim_of(result: PlanResult) -> dict[str, Any]:
    """The claimable limits by Tp band, of the whole lift and of each part; none where they were not assessed."""
    card, restricted = result.facts.get("card"), bool(result.facts["operation"]["weather_restricted"])
    if card is None:
        return {"alternative": None, "credit": None, "bands": [], "parts": []}
    edges = edges_of(card["cells"])
    parts = [
        {"name": part["name"], "phases": part["phases"], "bands": bands_of(part["cells"], restricted, edges)}
        for part in card["parts"]
    ]
    bands = bands_of(card["cells"], restricted, edges)
    return {"alternative": card["alternative"], "credit": card["credit"], "bands": bands, "parts": parts}


def _rules(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Rule set, who entered its editions, and its standards."""
    about = {key: facts["rules"].get(key, "") for key in ("name", "version", "digest", "entered_by")}
    return about | {"standards": standards(facts)}


def standards(facts: Mapping[str, Any]) -> list[str]:
    """Standards of the rules with the edition that stands in the rule set."""
    rows = facts["rules"]["rows"]
    named = ((row["standard"], "" if NOT_ENTERED in row["edition"] else row["edition"]) for row in rows)
    return list(dict.fromkeys(" ".join(filter(None, pair)) for pair in named if pair[0].startswith(MARINE)))
