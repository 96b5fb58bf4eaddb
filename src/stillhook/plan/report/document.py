"""A plan's report as a document: the first page and the sections after it."""

from __future__ import annotations

from collections.abc import Mapping

from stillhook.plan.report import basis, detail
from stillhook.plan.report import texts as say
from stillhook.plan.report.summary_page import tables, verdict
from stillhook.plan.result.result import PlanResult
from stillhook.report.document import Document, Section
from stillhook.report.formatting import groups
from stillhook.spec.validity import SHORT

MISSING = "NOT ASSESSED"
"""Begins remarks that must be seen first."""


def document(result: PlanResult, figures: Mapping[str, bytes]) -> Document:
    """The report. figures: PNG by stem, of `stillhook.plan.report.figures.limits.pictures`."""
    facts = result.facts
    sections = {  # the answer's basis, then detail, then inputs, then what is not covered
        "Operation and phases": basis.operation(result),
        "Rules": basis.rules(result),
        "Credit for compensation": basis.credit(result),
        "Sea states analysed": basis.seas(result),
        "How the limits were calculated": basis.models(result),
        "Limits, cell by cell": detail.limit_cells(result, figures),
        "Limits, phase by phase": [*detail.by_phase(result), *detail.closed_form_comparison(result)],
        "Weather and waiting": detail.weather(result, figures),
        "Behind the limits": detail.behind(result, figures),
        "Inputs, versions, seeds": basis.inputs(result),
        "What is not covered": basis.not_covered(result),
    }
    return Document(
        title=say.HEADING,
        name=result.name,
        subtitle=_subtitle(result),
        purpose=say.PURPOSE,
        marks=marks(result),
        front=[verdict(result), *tables(result)],
        sections=[Section(f"{i}. {title}", parts) for i, (title, parts) in enumerate(sections.items(), 1)],
        signatures=("Prepared by", "Checked by", "Marine warranty surveyor, place and date"),
        number=groups(facts.get("digest", ""), SHORT),
        date=str(facts.get("date", "1970-01-01"))[:10],
        made_by=f"Stillhook {facts.get('version', '')}".strip(),
    )


def _subtitle(result: PlanResult) -> str:
    payload, place = result.facts.get("payload", {}), result.facts.get("place", {})
    depth = f", {place['depth']:g} m of water" if "depth" in place else ""
    return f"{payload.get('title') or payload.get('name') or ''}{depth}"


def marks(result: PlanResult) -> list[str]:
    """What must be seen on every page: synthetic inputs, a twin that is not validated, cells without a result."""
    lines = []
    if "weather" in result and int(result["weather"].attrs.get("synthetic", 0)):
        lines.append(say.SYNTHETIC)
    certificate = result.facts.get("crane", {}).get("certificate")
    if certificate and certificate.get("synthetic"):
        lines.append(say.SYNTHETIC_CERTIFICATE)
    if not certificate and any(a.twin for a in result.alternatives):
        lines.append(say.UNVALIDATED.rstrip("."))
    return lines + [str(line).rstrip(".") for line in result.facts.get("remarks", ()) if str(line).startswith(MISSING)]
