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

ASSUMED = 5
"""Assumed numbers on the page at most."""
ASSESSED = ("failures", "rigging", "quality", "assumed", "hindcast")
"""Assessments that the page reads, by their keys in a result; None where one is missing."""
MARINE = ("DNV", "EN ", "ISO", "API", "IMCA")
"""Starts of standards among the sources of rules."""
NOT_COMPARED = " (not compared"


def decision(result: PlanResult) -> dict[str, Any]:
    """The page as data; a section whose assessment is missing is None."""
    facts = result.facts
    claim = claim_of(result)
    return {
        "document": head(result),
        "status": status_of(result, claim["bands"]),
        "operation": dict(facts["operation"]),
        "rules": {**{key: facts["rules"][key] for key in ("name", "version", "digest")}, "standards": standards(facts)},
        "claim": claim,
        **{name: facts.get(name) for name in ASSESSED},
        "not_covered": [*TEXTS["covered_by"]["unsafe"], *TEXTS["covered_by"]["not_covered"]],
        "runs": {key: facts["runs"].get(key) for key in ("n", "n_failed", "seeds_per_cell", "seed")},
        "weather": _weather(result),
    }


def head(result: PlanResult) -> dict[str, Any]:
    """Number, revision, lift, field, date, and who prepared and checked it."""
    given, facts = result.facts.get("document", {}), result.facts
    names = ("revision", "field", "prepared_by", "checked_by", "editions_by")
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


def standards(facts: Mapping[str, Any]) -> list[str]:
    """Standards of the rules with the edition that stands in the rule set."""
    named = ((row["standard"], row["edition"].partition(NOT_COMPARED)[0]) for row in facts["rules"]["rows"])
    return list(dict.fromkeys(" ".join(filter(None, pair)) for pair in named if pair[0].startswith(MARINE)))


def _weather(result: PlanResult) -> dict[str, Any] | None:
    """Source, years and gaps of the weather that waiting was counted on."""
    if "weather" not in result:
        return None
    block = result["weather"]
    n_gaps = float(block["n_gaps"].values.ravel()[0]) if "n_gaps" in block else None
    texts = {key: str(block.attrs[key]) for key in ("source", "first", "last")}
    return {**texts, "synthetic": bool(block.attrs["synthetic"]), "n_gaps": n_gaps}


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
        for key in ("governing_phase", "governing_rule", "governing_tier"):
            data[key].loc[at] = cell[key]
    return replace(result, data=data)


def _nearest(data: xarray.Dataset, axis: str, value: float) -> float:
    """The coordinate of an axis that a number of a file stands for."""
    return float(data[axis].sel({axis: value}, method="nearest"))
