"""The identification of a component as a report."""

from __future__ import annotations

from collections.abc import Mapping

from stillhook.identify.component.result import Component, Kind, interval
from stillhook.report.document import Bullets, Document, Figure, Section, Table, Text, Verdict
from stillhook.report.formatting import percent_fixed

TITLES: Mapping[str, str] = {
    Kind.MOTOR_LEAKAGE: "Leakage of a motor",
    Kind.PUMP_LEAKAGE: "Leakage of a pump",
    Kind.SERVO: "Displacement control",
    Kind.LINES: "Restrictions of the lines",
}
INTERVALS = (
    "Intervals are 95 %, the widest of those that leave out, one after the other, levels of each setting or stretches"
    " of the log: they hold what the law misses and what drifts within the data, not an error that all of the data"
    " share, such as the gain of a sensor."
)


def report(result: Component, pictures: Mapping[str, bytes]) -> Document:
    """The result as a document."""
    rows = [[p.name, p.meaning, *interval(p), p.status] for p in result.parameters]
    apart = [[name, percent_fixed(x, 2)] for name, x in result.held_out.items()]
    word = Verdict("determined" if result.usable else "not to be used", result.usable)
    sections = [
        Section("Parameters", [Table(("name", "meaning", "value", "low", "high", "status"), rows), Text(INTERVALS)])
    ]
    if apart:
        heading = (
            "error of what was left out,\nof the mean"
            if result.component.endswith("leakage")
            else "error, of the deviation"
        )
        sections.append(Section("Held-out data", [Table(("left out", heading), apart)]))
    if result.notes:
        sections.append(Section("Notes", [Bullets(result.notes)]))
    sections.append(Section("What the twin does with it", [Bullets(result.twin)]))
    if pictures:
        sections.append(Section("Figures", [Figure(png, stem) for stem, png in pictures.items()]))
    return Document(TITLES[result.component], sections, front=[word], name=result.source)
