"""What `stillhook condition` prints and writes: report, pictures, a crane file for each date, the state last."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stillhook.base.atomic import check_folder
from stillhook.base.kept.sealed import SIGNATURE
from stillhook.formats.results import to_json
from stillhook.live.condition.drift import FALSE_A_YEAR, HORIZON
from stillhook.live.condition.follow import EVIDENCE, Condition, NumberCondition, crane_text
from stillhook.live.condition.state import statement, write_state
from stillhook.live.condition.walk import YEAR
from stillhook.report.document import Bullets, Document, Figure, Part, Section, Table, Text
from stillhook.report.formatting import percent
from stillhook.report.html import html
from stillhook.report.kit import axis, band, draw_if_possible, legend, panels, pngs, threshold
from stillhook.report.plots.colours import COLOURS, GREY
from stillhook.spec.crane import identity
from stillhook.statistics.estimate import NORMAL_95, Estimate
from stillhook.trust.results import result_folder
from stillhook.trust.standing import MEANING
from stillhook.validate.criteria.results import plain

REPORT, NUMBERS, PICTURE, PICTURE_HELD = "report.html", "condition.json", "trend.png", "held-out.png"
LINES = 80
"""Points of a drawn course."""
DIGITS = 3


def _interval(x: Estimate) -> str:
    return f"{percent(x.value, DIGITS)} ({percent(x.low, DIGITS)} to {percent(x.high, DIGITS)})"


def _time(years: float) -> str:
    return f"beyond {HORIZON:g} years" if math.isinf(years) else f"{years:.1f} years" if years else "now"


def until_limit(n: NumberCondition) -> str:
    """Time until a number reaches its limit, in words."""
    if n.limit is None:
        return "no limit in the criteria"
    if n.to_limit is None:
        return "cannot tell: no trend is shown"
    t = n.to_limit
    if not t.latest:
        return f"passed: {percent(t.limit, DIGITS)}"
    return f"{_time(t.middle)} ({_time(t.earliest)} to {_time(t.latest)}) to {percent(t.limit, DIGITS)}"


def _changed(n: NumberCondition) -> str:
    if n.drift is None:
        return "no certificate before the last campaign"
    word = "DRIFT: " if n.drift.shown else ""
    return f"{word}{_interval(n.drift.change)}, margin {percent(n.drift.margin, DIGITS)}"


def document(condition: Condition, images: Mapping[str, bytes] | None = None) -> Document:
    """The report."""
    c, images = condition, images or {}
    rows = [
        [n.of.meaning, str(len(n.dates)), _interval(n.today), _interval(n.trend), until_limit(n), _changed(n)]
        for n in c.numbers
    ]
    header = ["number", "campaigns", "today", "trend a year", "time to limit", "since the certificate"]
    front: list[Part] = [Text(statement(c.standing))]
    front.append(Table(header, rows, f"Numbers over those of the crane file of {c.measured[0].campaign.date}, less 1"))
    notes = [f"{name}: not followed: {reason}" for name, reason in c.absent.items()]
    for n in c.numbers:
        notes += [f"{n.of.meaning}: step found at {_date(c, t)}; the trend is that since" for t in n.course.found]
        notes += [f"{n.of.meaning}: none in the campaign of {date}: {reason}" for date, reason in n.reasons.items()]
    notes += [f"{d.name}: {name} left as it was: {reason}" for d in c.cranes[-1:] for name, reason in d.left.items()]
    notes += [f"refused: {line}" for line in c.gathered.refused] + [f"waiting: {line}" for line in c.gathered.waiting]
    front += [Bullets(notes)] if notes else []
    front.append(_held_out(c))
    basis = [
        "Values are 95 % intervals. Process noise, yearly wave and scatter from day to day are not known: the intervals"
        " are summed over what they may be.",
        f"Drift is shown where a level has left that of the certificate by more than half of its criterion's limit, at"
        f" {FALSE_A_YEAR:g} false alarms a year at most as the model has it.",
        MEANING,
    ]
    sections = [Section("Basis", [Bullets(basis)])]
    if images:
        captions = {PICTURE: "Numbers over the first crane file's, less 1", PICTURE_HELD: "Criteria on held-out tests"}
        sections.insert(0, Section("Pictures", [Figure(images[k], captions[k]) for k in captions if k in images]))
    marks = ["SYNTHETIC: simulated logs, not of a crane"] if any(m.campaign.synthetic for m in c.measured) else []
    return Document(
        title="Condition",
        name=c.reference.title or c.reference.name,
        front=front,
        sections=sections,
        marks=marks,
        date=c.measured[-1].campaign.date.isoformat(),
    )


def _date(c: Condition, t: float) -> str:
    first = c.measured[0].campaign.date
    return str(np.datetime64(first) + np.timedelta64(round(t * YEAR), "D"))


def _held_out(c: Condition) -> Part:
    """Criteria 2b and 3 of both crane files, on tests that neither has seen."""
    rows = [
        [str(d.date), *(_judged(side, key) for key in ("2b", "3") for side in (d.before, d.after))]
        for d in c.cranes
        if d.before
    ]
    if not rows:
        return Text("Criteria 2b and 3: no campaign has a second test in heave compensation to hold out.")
    header = [
        "campaign",
        "2b, first\ncrane file",
        "2b, that\nof the date",
        "3, first\ncrane file",
        "3, that\nof the date",
    ]
    title = "Tests that are held out: mean deviation of the peak-to-peak control error (2b), of the pump command (3)"
    return Table(header, rows, title)


def _judged(side: Mapping[str, float], key: str) -> str:
    if key not in side:
        return "-"
    return f"{100.0 * side[key]:.2f} cm" if key == "2b" else percent(side[key], 2)


def to_dict(condition: Condition) -> dict[str, Any]:
    """Everything as plain data, numbers in SI; values relative to the first campaign's crane file."""
    c, entry = condition, condition.standing.entry
    state = c.standing.state
    stated = None if state is None else state.model_dump(mode="json", exclude={SIGNATURE}) | {"digest": state.digest}
    return {
        "crane": c.reference.name,
        "campaigns": [m.campaign.date.isoformat() for m in c.measured],
        "valid": None if entry is None else entry.state == "valid",
        "statement": statement(c.standing),
        "state": stated,
        "numbers": {n.of.name: _number(c, n) for n in c.numbers},
        "not_followed": dict(c.absent),
        "cranes": [
            {
                "date": d.date.isoformat(),
                "file": d.name,
                "campaigns": [m.name for m in d.campaigns],
                "values": {name: x.to_dict() for name, x in d.values.items()},
                "left": dict(d.left),
                "before": dict(d.before),
                "after": dict(d.after),
            }
            for d in c.cranes
        ],
        "refused": list(c.gathered.refused),
        "waiting": list(c.gathered.waiting),
    }


def _number(c: Condition, n: NumberCondition) -> dict[str, Any]:
    drift, to_limit = n.drift, n.to_limit
    return {
        "meaning": n.of.meaning,
        "dates": [d.isoformat() for d in n.dates],
        "values": [p.y for p in n.course.points],
        "today": n.today.to_dict(),
        "trend": {**n.trend.to_dict(), "shown": n.trend_shown},
        "limit": n.limit,
        "to_limit": None if to_limit is None else plain(to_limit),
        "since_certificate": None if drift is None else {**plain(drift), "shown": drift.shown},
        "steps": [_date(c, t) for t in n.course.steps],
        "reasons": dict(n.reasons),
    }


def pictures(condition: Condition) -> dict[str, bytes]:
    """The courses of all numbers with their limits, and the criteria on held-out tests: PNG by file name."""
    figures, c = {}, condition
    first = c.measured[0].campaign.date.year + (c.measured[0].campaign.date.timetuple().tm_yday - 1) / YEAR
    rows = len(c.numbers)
    if rows:
        figure, axes = panels(rows, 1, (7.0, 0.6 + 2.0 * rows), sharex=True)
        for ax, n in zip(axes[:, 0], c.numbers, strict=True):
            _draw(ax, n, first)
        axes[0, 0].set_xlim(*_span(first, max(float(n.course.t[-1]) for n in c.numbers)))
        axis(axes[-1, 0], "year")
        legend(axes[0, 0], "upper left")
        figures[PICTURE] = figure
    held = [d for d in c.cranes if d.before]
    if held:
        figure, axes = panels(1, 2, (8.0, 3.2))
        years = [first + (d.date - c.measured[0].campaign.date).days / YEAR for d in held]
        words = {"2b": "2b: control error [cm]", "3": "3: pump command [%]"}
        for ax, (key, text) in zip(axes[0], words.items(), strict=True):
            for label, colour, sides in (
                ("first crane file", GREY, [d.before for d in held]),
                ("crane file of the date", COLOURS[0], [d.after for d in held]),
            ):
                ax.plot(years, [100.0 * s.get(key, math.nan) for s in sides], "o-", color=colour, label=label)
            ax.set_xlim(*_span(years[0], years[-1] - years[0]))
            axis(ax, "year", text, zero="y")
            ax.set_ylim(0.0, 1.05 * ax.dataLim.ymax or 1.0)
        legend(axes[0, 0])
        figures[PICTURE_HELD] = figure
    return pngs(figures)


def _span(first: float, length: float) -> tuple[float, float]:
    """Years that a picture shows: half of one at least."""
    margin = max(0.25, 0.05 * length)
    return first - margin, first + length + margin


def _draw(ax: Any, n: NumberCondition, first: float) -> None:
    t, points = n.course.t, n.course.points
    at = np.unique(np.concatenate([np.linspace(t[0], t[-1], LINES), t]))
    course = [n.course.value(float(x)).estimate(0) for x in at]
    values, low, high = (100.0 * np.array([getattr(x, end) for x in course]) for end in ("value", "low", "high"))
    band(ax, first + at, values, low, high, label="followed, 95 %")
    total = np.array([(p.own**2 + p.common**2) ** 0.5 for p in points])
    measured, half = 100.0 * np.array([p.y for p in points]), 100.0 * NORMAL_95 * total
    ax.errorbar(first + t, measured, half, fmt="o", color=GREY, ms=3, lw=1, label="campaign, 95 %")
    if n.limit is not None and abs(values).max() > 0.3 * 100.0 * n.limit:
        threshold(ax, math.copysign(100.0 * n.limit, values[-1]), "limit")
    for step in n.course.steps:
        ax.axvline(first + step, color=COLOURS[1], lw=1, ls=":")
    axis(ax, "", f"{n.of.name} [%]")


def check_out(out: Path) -> None:
    """Refuse a folder that cannot be written to, before the work is done. Errors: SimulationError."""
    check_folder(out, (REPORT, NUMBERS, PICTURE, PICTURE_HELD))


def save_condition(condition: Condition, out: str | Path) -> tuple[str, ...]:
    """Write everything into a folder, all of it or none, with its manifest, which has the evidence of each campaign
    too; and the state beside the crane file at the end: what is interrupted is complete after the next run.

    Returns the names of the files. Errors: SimulationError where something cannot be written.
    """
    folder = Path(out)
    images = draw_if_possible(lambda: pictures(condition))
    content: dict[str, bytes] = {d.name: crane_text(d).encode() for d in condition.cranes}
    content |= images | {REPORT: html(document(condition, images)).encode()}
    content |= {NUMBERS: f"{to_json(to_dict(condition))}\n".encode()}
    evidence = [f"{EVIDENCE}/{m.name}" for m in condition.measured if (folder / EVIDENCE / m.name).is_file()]
    with result_folder(folder, "condition", [identity(condition.reference)], kept=evidence) as part:
        for name, data in content.items():
            (part / name).write_bytes(data)
    write_state(condition.standing)
    return tuple(content)
