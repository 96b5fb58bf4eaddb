"""`stillhook compare` of a case file with settings.faults: which sensor fault does which controller survive?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.cli.parser import check_out, present, write_out
from stillhook.report.formatting import fmt
from stillhook.report.terminal import Answer, columns, print_table, print_twin, progress_bar, started

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
    present(data, lambda: _print(table), brief=lambda: _brief(table), json=json)
    if out is not None:
        write_out(out, {FILES[0]: data}, quiet=json)
    return table.ok


def _data(table: FaultTable) -> dict[str, Any]:
    """The table as plain data, SI."""
    rows = {fault: {mode: o._asdict() for mode, o in row.items()} for fault, row in table.outcomes.items()}
    return {"crane": table.crane.name, "fault_time": table.time, "false_alarms": table.false_alarms, "faults": rows}


def _modes(table: FaultTable) -> list[str]:
    return list(next(iter(table.outcomes.values())))


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


def _print(table: FaultTable) -> None:
    rows = [[fault, *map(_cell, row.values())] for fault, row in table.outcomes.items()]
    print_table(["fault", *_modes(table)], rows, title=f"{table.crane.name}: load moved, time to the alarm")
    for line in _ends(table):
        print(line)
    print_twin(table.crane)


def _brief(table: FaultTable) -> Answer:
    """Faults by verdict under each controller."""
    verdicts = {m: [str(row[m].verdict) for row in table.outcomes.values()] for m in _modes(table)}
    counts = [[m, *(str(of.count(v)) for v in ("kept", "ended", "lost"))] for m, of in verdicts.items()]
    title = f"{table.crane.name}: {len(table.outcomes)} sensor faults from {table.time:g} s on"
    lines = columns(["", "kept", "ended at rest", "lost"], counts, left=(0,))
    return Answer(title, [*lines, *_ends(table)], more="every fault with what it moved, and the time to its alarm")
