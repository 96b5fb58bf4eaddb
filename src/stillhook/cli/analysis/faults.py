"""`stillhook compare` of a case file with settings.faults: which sensor fault does which controller survive?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.cli.parser import check_out, present
from stillhook.report.formatting import fmt
from stillhook.report.terminal import Answer, Line, columns, print_table, progress_bar, started, twin_lines

if TYPE_CHECKING:
    from stillhook.analysis.maps.faults import FaultTable, Outcome
    from stillhook.formats.case_file import Subject
    from stillhook.spec.scenario import Scenario

FILES = ("faults.json",)


def compare_faults(
    subject: Subject, case: Scenario, modes: Sequence[str] | None, *, out: Path | None, json: bool
) -> bool:
    """Run, print and write the table; whether every fault is survived under some controller."""
    from stillhook.analysis.maps.faults import survive

    check_out(out, FILES)
    settings = subject.settings
    with progress_bar("faults") as bar:
        progress = started(subject.crane, bar, series=True)
        table = survive(
            subject.crane, case, modes, settings.faults or None, limit=settings.fault_limit, progress=progress
        )
    data = _data(table)
    brief = lambda: _answer(table)
    present(data, out, {FILES[0]: data}, brief=brief, json=json, cranes=[table.crane])
    return table.ok


def _data(table: FaultTable) -> dict[str, Any]:
    """The table as plain data, SI."""
    rows = {fault: {mode: o._asdict() for mode, o in row.items()} for fault, row in table.outcomes.items()}
    return {"crane": table.crane.name, "fault_time": table.time, "false_alarms": table.false_alarms, "faults": rows}


def _cell(o: Outcome) -> str:
    alarm = "no alarm" if math.isnan(o.detected) else fmt(o.detected, "time")
    return f"{o.verdict}, {fmt(o.moved, 'length')}, {alarm}"


def _ends(table: FaultTable) -> list[str]:
    """False alarms, and faults that nothing survives."""
    alarms = "no [control.guard] in the crane file: nothing is detected."
    if table.false_alarms is not None:
        each = ", ".join(f"{mode} {n:.0f}" for mode, n in table.false_alarms.items())
        alarms = f"Alarms without a fault: {each}."
    return [alarms, f"Survived by no controller: {', '.join(table.lost) or 'none'}."]


def _answer(table: FaultTable) -> Answer:
    """Faults by verdict under each controller, and each with what it moved."""
    modes = list(next(iter(table.outcomes.values())))
    verdicts = {m: [str(row[m].verdict) for row in table.outcomes.values()] for m in modes}
    counts = [[m, *(str(of.count(v)) for v in ("kept", "ended", "lost"))] for m, of in verdicts.items()]
    rows = [[fault, *map(_cell, row.values())] for fault, row in table.outcomes.items()]
    title = f"{table.crane.name}: {len(table.outcomes)} sensor faults from {table.time:g} s on"
    lines: list[Line] = [
        *columns(["", "kept", "ended at rest", "lost"], counts, left=(0,)),
        partial(print_table, ["fault", *modes], rows, title="load moved, time to the alarm"),
        *_ends(table),
        *twin_lines(table.crane),
    ]
    return Answer(title, lines, more="every fault with what it moved, and the time to its alarm")
