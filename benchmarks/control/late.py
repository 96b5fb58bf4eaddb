"""Late motion units: error by delay, with the tip's motion extrapolated and predicted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from benchmarks.control import course
from benchmarks.control.course import Course
from benchmarks.control.entries import PREDICTS, REFERENCE, Entry
from benchmarks.control.runs import ERROR, Runner, Setting, best, gain_of, machine, trial
from stillhook import load_crane
from stillhook.base.progress import Progress

ENTRIES = (REFERENCE, "ff")
"""Shipped entries of this part; those of users are as well."""
AHEAD = (-0.06, -0.03, 0.0, 0.015, 0.03, 0.045, 0.06, 0.08, 0.1)
"""Leads that are tried, less the delay [s]."""
LEAST = 0.005
"""Least lead that is tried [s]."""
PREDICTED = ", predicted"
"""What follows the name of an entry with prediction."""


class Late(NamedTuple):
    """Of an entry with or without prediction: by delay [s] and sea the least error [m], infinite where it failed, and
    the lead that has it [s]; at the largest gain."""

    name: str
    errors: dict[float, dict[str, float]]
    leads: dict[float, dict[str, float]]


def variants(entries: Sequence[Entry]) -> list[Entry]:
    """Entries of this part, each with and without prediction; an FMU predicts by itself, or does not."""
    found = []
    for e in entries:
        if e.own or e.name in ENTRIES:
            found.append(e)
            if e.fmu is None:
                control = {**e.tables.get("control", {}), **PREDICTS["control"]}
                found.append(e._replace(name=e.name + PREDICTED, tables={**e.tables, "control": control}))
    return found


def late(entries: Sequence[Entry], size: Course, runner: Runner, progress: Progress | None = None) -> list[Late]:
    """All of it."""
    crane, trials = load_crane(course.CRANE), {}
    found = variants(entries)
    for e in found:
        K_p = gain_of(e, crane)
        for delay in size.delays:
            leads = [delay + x for x in AHEAD if delay + x >= LEAST] if e.takes_lead else [0.0]
            machines = {s: machine(crane, e, s) for s in (Setting(lead, K_p) for lead in leads)}
            for sea, case in course.late_seas(size, delay).items():
                for s, made in machines.items():
                    trials[(e.name, delay, sea), s] = trial(made, case.with_mode(e.mode), e, s)
    least = best(list(trials), runner.values(ERROR, list(trials.values()), progress))
    seas = list(course.late_seas(size, 0.0))
    return [
        Late(
            e.name,
            {delay: {sea: least[e.name, delay, sea][1] for sea in seas} for delay in size.delays},
            {delay: {sea: least[e.name, delay, sea][0].lead for sea in seas} for delay in size.delays},
        )
        for e in found
    ]
