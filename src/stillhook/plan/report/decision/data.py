"""What the decision page has to say, as plain data in SI: the file decision.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from stillhook.plan.report.decision.bands import bands_of, edges_of
from stillhook.plan.report.decision.status import rests_on_synthetic, status_of
from stillhook.plan.report.words import CREDITED, TEXTS
from stillhook.plan.result import PlanResult
from stillhook.report.formatting import groups
from stillhook.spec.validity import SHORT

if TYPE_CHECKING:
    import xarray

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


def claimed(result: PlanResult) -> PlanResult:
    """The result with the claimable limits of its leading alternative in the place of the credited ones, where these
    rest on a SYNTHETIC certificate; the same result elsewhere."""
    card = result.facts.get("card")
    if card is None or not rests_on_synthetic(result):
        return result
    data = result.data.copy(deep=True)
    for cell in card["cells"]:
        at = {"credit": CREDITED, "alternative": card["alternative"]}
        at |= {"heading": _nearest(data, "heading", cell["beta"]), "period": _nearest(data, "period", cell["T_p"])}
        numbers = {key: math.nan if cell[key] is None else cell[key] for key in ("Hs_limit", "Hs_limit_low", "op_wf")}
        numbers["alpha"] = math.nan if cell["alpha"] is None else cell["alpha"]
        numbers["Hs_limit"] = math.inf if cell["above"] else numbers["Hs_limit"]
        for key, value in (numbers | {"Hs_limit_high": math.nan}).items():
            data[key].loc[at] = value
        for key in {"governing_phase", "governing_rule", "governing_tier", "governing_end"} & set(data):
            data[key].loc[at] = cell[key]
    return replace(result, data=data)


def _nearest(data: xarray.Dataset, axis: str, value: float) -> float:
    """The coordinate of an axis that a number of a file stands for."""
    return float(data[axis].sel({axis: value}, method="nearest"))
