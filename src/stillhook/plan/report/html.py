"""A plan's report as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stillhook.plan.report.document import sheet_of
from stillhook.plan.report.parts import WIDE, WIDER
from stillhook.plan.result.result import PlanResult
from stillhook.report.html import bullets, heading, page, paragraph, picture, subheading, table


def html(result: PlanResult, figures: Mapping[str, bytes]) -> str:
    """The page. figures: PNG by stem, of `stillhook.plan.report.figures.limits.pictures`."""
    sheet = sheet_of(result, tuple(figures))
    answer = sheet["answer"]
    parts = [paragraph(sheet["title"])]
    parts += [paragraph(answer["word"], no=not answer["yes"], yes=answer["yes"])]
    parts += [paragraph(sentence) for sentence in answer["said"]]
    parts += [_set(part, figures) for part in answer["parts"]]
    for section in sheet["sections"]:
        parts += [heading(section["title"]), *(_set(part, figures) for part in section["parts"])]
    parts.append(paragraph(f"Plan {sheet['number']}, {sheet['date']}."))
    return page(f"{sheet['heading']}: {sheet['name']}", parts, synthetic=". ".join(sheet["marks"]))


def _set(part: Mapping[str, Any], figures: Mapping[str, bytes]) -> str:
    match part["kind"]:
        case "text":
            return paragraph(part["text"])
        case "sub":
            return subheading(part["text"])
        case "facts" | "hashes":
            return table(("",) * max((len(row) for row in part["rows"]), default=2), part["rows"], words=True)
        case "bullets":
            return bullets(part["lines"])
        case "figure":
            return picture(figures[part["stem"]], part["caption"])
        case _:
            return table(part["header"], part["rows"], words=bool({WIDE, WIDER} & set(part["columns"])))
