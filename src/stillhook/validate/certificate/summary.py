"""A certificate in short, for a terminal: verdict, envelope, and lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stillhook.report.document import Cell, Document, Part, Section, Text, Verdict, facts
from stillhook.spec.validity import SHORT, UNSIGNED
from stillhook.validate.certificate.certificate import Certificate
from stillhook.validate.certificate.document import deciding_lines, passed
from stillhook.validate.data_set.campaign import MARK


def summary(certificate: Certificate) -> Document:
    """What a certificate says, without its data."""
    data = certificate.data
    mark = f"{MARK} " if data["synthetic"] and MARK not in data["title"] else ""
    front: list[Part] = [
        Verdict(data["verdict"], data["passed"]),
        *deciding_lines(data),
        Text(data["risks"]),
        facts(_facts(certificate)),
        Text(UNSIGNED),
    ]
    lines = Section("verdict", [facts([_line(line) for line in data["lines"]])])
    return Document(f"{mark}{data['title']}", [lines], front)


def _facts(certificate: Certificate) -> list[tuple[str, str]]:
    data, envelope = certificate.data, certificate.short.envelope
    criteria, twin, lengths = data["criteria"], data["twin"], [d["duration"] for d in data["data"]]
    ranges = envelope.says().items() if envelope is not None else ()
    return [
        ("certificate", f"{certificate.digest} of {data['date']}"),
        ("crane", f"{data['crane']['name']}: {data['crane']['title']}"),
        ("twin", twin["statement"]),
        ("computed by", f"Stillhook {twin['version']}, code {twin['code']}, method {twin['method']}"),
        ("judged by", f"{criteria['name']} version {criteria['version']}, digest {criteria['digest'][:SHORT]}"),
        ("data", f"{len(lengths)} tests, {sum(lengths):.0f} s, of {data['campaign']['file']}"),
        *((f"validated: {name}", text) for name, text in ranges),
    ]


def _line(line: Mapping[str, Any]) -> tuple[Cell, ...]:
    cells = line["cells"]
    text = f"{cells['title']}: {cells['value']}, {cells['limit']}"
    return Verdict(cells["verdict"], passed(line)), cells["key"], text
