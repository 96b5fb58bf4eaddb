"""A plan's report as plain data: the first page and the sections after it, which `report_page` and `template/plan.typ`
set alike."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from typing import Any

from stillhook.plan.report import basis, detail
from stillhook.plan.report import texts as say
from stillhook.plan.report.parts import short
from stillhook.plan.report.summary_page import answer
from stillhook.plan.result.result import PlanResult

MISSING = "NOT ASSESSED"
"""Begins remarks that must be seen first."""


def sheet_of(result: PlanResult, stems: Sequence[str]) -> dict[str, Any]:
    """Every text of the document. stems: of the figures that there are
    (`stillhook.plan.report.figures.limits.pictures`)."""
    facts = result.facts
    date = datetime.date.fromisoformat(str(facts.get("date", "1970-01-01"))[:10])
    return {
        "heading": say.HEADING,
        "subtitle": say.SUBTITLE,
        "name": result.name,
        "title": _title(result),
        "date": date.isoformat(),
        "year": date.year,
        "month": date.month,
        "day": date.day,
        "made_by": f"Stillhook {facts.get('version', '')}".strip(),
        "number": short(facts.get("digest", "")),
        "marks": marks(result),
        "answer": answer(result),
        "sections": [
            {"title": f"{i}. {title}", "parts": _with_figures(parts, stems)}
            for i, (title, parts) in enumerate(_sections(result, stems), 1)
        ],
    }


def _title(result: PlanResult) -> str:
    payload, place = result.facts.get("payload", {}), result.facts.get("place", {})
    return str(payload.get("title") or payload.get("name") or "") + (
        f", {place['depth']:g} m of water" if "depth" in place else ""
    )


def marks(result: PlanResult) -> list[str]:
    """What must be seen on every page: what is synthetic, that a twin is not validated, what nothing was told of."""
    lines = []
    if "weather" in result and int(result["weather"].attrs.get("synthetic", 0)):
        lines.append(say.SYNTHETIC)
    certificate = result.facts.get("crane", {}).get("certificate")
    if certificate and certificate.get("synthetic"):
        lines.append(say.SYNTHETIC_CERTIFICATE)
    if not certificate and any(a.twin for a in result.alternatives):
        lines.append(say.UNVALIDATED.rstrip("."))
    return lines + [str(line).rstrip(".") for line in result.facts.get("remarks", ()) if str(line).startswith(MISSING)]


def _sections(result: PlanResult, stems: Sequence[str]) -> list[tuple[str, list[dict[str, Any]]]]:
    """The answer's basis, then detail, then inputs, then what is not covered."""
    return [
        ("Operation and phases", basis.operation(result)),
        ("Rules", basis.rules(result)),
        ("Credit for compensation", basis.credit(result)),
        ("Sea states analysed", basis.seas(result)),
        ("How the limits were calculated", basis.models(result)),
        ("Limits, cell by cell", detail.limit_cells(result, stems)),
        ("Limits, phase by phase", [*detail.by_phase(result), *detail.closed_form_comparison(result)]),
        ("Weather and waiting", detail.weather(result)),
        ("Behind the limits", detail.behind(result)),
        ("Inputs, versions, seeds", basis.inputs(result)),
        ("What is not covered", basis.not_covered(result)),
    ]


def _with_figures(parts: Sequence[dict[str, Any]], stems: Sequence[str]) -> list[dict[str, Any]]:
    """Without pictures that were not drawn."""
    return [part for part in parts if part["kind"] != "figure" or part["stem"] in stems]


def headline(result: PlanResult) -> dict[str, Any]:
    """The answer without its tables: word, yes, said."""
    return {key: value for key, value in answer(result).items() if key != "parts"}
