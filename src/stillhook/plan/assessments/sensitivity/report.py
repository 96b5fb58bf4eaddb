"""The section of a report: a tornado of every phase whose limit moves, a table of what moves it, and in words what
moves it less than runs scatter and what was not judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from stillhook.plan.assessments.sensitivity.ranking import ABOVE, NAME, NOT_JUDGED, base_of, height_of, ranked, swing
from stillhook.plan.definition.rules import Alternative
from stillhook.report import document, kit
from stillhook.report.document import Bullets, Part, Section, Table, Text
from stillhook.report.formatting import EMPTY, direction, fixed, percent
from stillhook.report.plots.colours import COLOURS
from stillhook.units import number, show

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STEM = "sensitivity"
RESOLUTION = 150
"""Of the picture [dots per inch]."""
WIDTH, ROW, FRAME = 7.2, 0.3, 0.75
"""Width of the picture, height of a bar, and of the frame of a panel [inch]."""
PAPER_WIDTH, PAPER = 170.0, 225.0
"""Width of a picture on paper, and its height at the most [mm]."""
MOST, LEAST_SWING = 7, 0.04
"""Factors of a panel at the most, and part of the largest swing below which one is not drawn."""
CAPTION = (
    "Limiting Hs of every phase with one number at either end of its range: dashed as planned, blue the first end,"
    " orange the second, thin line the 95 % interval. What moves a limit less than the runs scatter is left out."
)
METHODS = {"time": "the twin", "frequency": "the frequency-domain method", "closed-form": "the closed form"}


def parts(facts: Mapping[str, Any]) -> list[Part]:
    """The section from the facts of a result."""
    of, result = facts[NAME], list[Part]()
    result.append(Text(_basis(of)))
    pictures = kit.draw_if_possible(lambda: figures(of))
    result += list(pictures.values())
    for phase in of["phases"]:
        result.append(Section(phase["phase"], _phase(phase, of["Hs_highest"])))
    if of["not_assessed"]:
        result.append(Text(f"Without a limit by any method: {', '.join(of['not_assessed'])}."))
    sources = {f["title"]: f["source"] for phase in of["phases"] for f in phase["factors"]}
    lines = [f"{title}: {source}." for title, source in sources.items()]
    return [*result, Section("Where the ends are from", [Bullets(lines)])]


def _basis(of: Mapping[str, Any]) -> str:
    who = Alternative(of["alternative"]).label
    text = (
        f"One number at a time at either end of its range, all others as planned, under {who}, in the column in which"
        " the limit of the phase is lowest. Limits are as modelled."
    )
    if of["n_runs"]:
        text += (
            f" Runs ({of['n_runs']}) are of the same waves as planned and otherwise; a change within the 95 % interval"
            " that they leave is not ranked. Peak period, heading and the flat cap are read from the plan's own table"
            " where it has them."
        )
    return text


def _words(end: Mapping[str, Any], top: float) -> str:
    if end["verdict"] == NOT_JUDGED:
        return EMPTY
    if end["verdict"] == ABOVE:
        return f"> {number(top, 3)}"
    if not end["resolved"]:
        return "no change"
    ends = [end["Hs_low"], end["Hs_high"]]
    if ends[0] == 0.0 < end["Hs"]:
        return f"< {fixed(end['Hs'], 2)}"
    if ends[0] == end["Hs"] and ends[1] is None:
        return f"> {fixed(end['Hs'], 2)}"
    known = all(x is not None for x in ends) and ends[0] != ends[1]
    return f"{fixed(end['Hs'], 2)}{f' ({fixed(ends[0], 2)} to {fixed(ends[1], 2)})' if known else ''}"


def _phase(phase: Mapping[str, Any], top: float) -> list[Part]:
    rows = [
        [
            f["title"],
            *[cell for end in f["ends"] for cell in (end["text"], _words(end, top))],
            *[EMPTY] * (2 * (2 - len(f["ends"]))),
            ", ".join(dict.fromkeys(e["rule"].replace("-", " ") for e in f["ends"] if e["resolved"] and e["rule"])),
        ]
        for f in ranked(phase, top)
    ]
    head = ("factor", "low end", "limit Hs [m]", "high end", "limit Hs [m]", "governed by")
    result: list[Part] = [Text(_cell(phase, top))]
    if rows:
        result.append(Table(head, rows))
    still = [f["title"] for f in phase["factors"] if f["ends"] and f not in ranked(phase, top) and _judged(f)]
    if still:
        scatter = "within the scatter of the runs" if phase["tier"] == "time" else "by less than 0.01 m"
        result.append(Text(f"These move the limit {scatter}, or not at all: {', '.join(still)}."))
    missing = [f"{f['title']} ({_reason(f)})" for f in phase["factors"] if not _judged(f)]
    return [*result, Text(f"Not judged: {'; '.join(missing)}.")] if missing else result


def _judged(factor: Mapping[str, Any]) -> bool:
    return any(end["verdict"] != NOT_JUDGED for end in factor["ends"])


def _reason(factor: Mapping[str, Any]) -> str:
    reasons = dict.fromkeys(end["reason"] for end in factor["ends"] if end["reason"])
    return factor["reason"] or "; ".join(reasons) or "no method says it"


def _cell(phase: Mapping[str, Any], top: float) -> str:
    where = f"Tp {show(phase['Tp'], 'time', 3)}, waves at {direction(phase['beta'])}, by {METHODS[phase['tier']]}"
    if phase["verdict"] == ABOVE:
        if not ranked(phase, top):
            return f"{where}: not limiting up to Hs {number(top, 3)} m under any of these variations.{_used(phase)}"
        return f"{where}: not limiting up to Hs {number(top, 3)} m as planned."
    if phase["verdict"] == NOT_JUDGED:
        return f"{where}: no limit."
    ends = [phase["Hs_low"], phase["Hs_high"]]
    span = f" ({fixed(ends[0], 2)} to {fixed(ends[1], 2)} m)" if all(x is not None for x in ends) else ""
    counts = phase["counts"]
    other = ""
    if counts["tier"] and counts["tier"] != phase["tier"] and counts["Hs"] is not None:
        other = f" The table counts {fixed(counts['Hs'], 2)} m by {METHODS[counts['tier']]} there."
    return f"{where}: Hs {fixed(phase['Hs'], 2)} m{span} by {phase['rule'].replace('-', ' ')}.{other}"


def _used(phase: Mapping[str, Any]) -> str:
    used = [end["used"] for f in phase["factors"] for end in f["ends"] if end["used"] is not None]
    return f" There waves use at most {percent(max(used), 2)} of what a rule leaves them." if used else ""


def figures(of: Mapping[str, Any]) -> dict[str, document.Figure]:
    """The tornadoes as one picture with its caption, by stem; none where nothing moves a limit."""
    import matplotlib  # heavy

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        figure = tornadoes(of)
        if figure is None:
            return {}
        height = min(float(figure.get_figheight()) / WIDTH * PAPER_WIDTH, PAPER)
        return {stem: replace(each, height=height) for stem, each in kit.printed({STEM: figure}, RESOLUTION).items()}


def tornadoes(of: Mapping[str, Any]) -> Figure | None:
    """A panel of every phase whose limit is moved, two in a row."""
    top = float(of["Hs_highest"])
    shown = [(phase, rows) for phase in of["phases"] if (rows := _bars(phase, top))]
    if not shown:
        return None
    columns = min(len(shown), 2)
    lines = [shown[i : i + columns] for i in range(0, len(shown), columns)]
    heights = [ROW * max(len(rows) for _, rows in line) + FRAME for line in lines]
    figure, axes = kit.panels(len(lines), columns, (WIDTH, sum(heights)), grid="x", height_ratios=heights)
    for line, row in zip(lines, axes, strict=True):
        for ax, (phase, rows) in zip(row, line, strict=False):
            _tornado(ax, phase, rows, top)
        kit.hide(row[len(line) :])
    return kit.strips(kit.caption(figure, CAPTION))


def _bars(phase: Mapping[str, Any], top: float) -> list[Mapping[str, Any]]:
    """Factors of a panel: those that move the limit most, and none that hardly does compared with the first."""
    rows = ranked(phase, top)
    least = LEAST_SWING * swing(rows[0], phase, top) if rows else 0.0
    return [factor for factor in rows[:MOST] if swing(factor, phase, top) >= least]


def _tornado(ax: Axes, phase: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], top: float) -> None:
    base, half = base_of(phase, top), 0.2
    for i, factor in enumerate(rows):
        for end, colour, place in zip(factor["ends"], COLOURS, (i - half, i + half), strict=False):
            Hs = height_of(end, top)
            if Hs is None or not end["resolved"]:
                continue
            ax.barh(place, Hs - base, 2.0 * half, left=base, color=colour)
            if end["Hs_low"] is not None and end["Hs_high"] is not None and end["Hs_low"] > 0.0:
                ax.hlines(place, end["Hs_low"], min(end["Hs_high"], top), color="black", lw=0.9)
    kit.threshold(ax, base, along="y")
    labels = [f"{f['title']}\n{' | '.join(end['text'] for end in f['ends'])}" for f in rows]
    ax.set_yticks(range(len(rows)), labels, fontsize="x-small")
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.tick_params(axis="x", labelsize="small")
    title = f"{phase['phase']}, Tp {show(phase['Tp'], 'time', 3)}, {direction(phase['beta'])}"
    kit.axis(ax, "limiting Hs [m]", title=title, size="small")
