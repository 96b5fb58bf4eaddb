"""How far each entry is from swinging: margins of the linearised loop at both displacements, and on the twin the factor
on K_p at which it swings in a sea, with noise and everything that a law has learned."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.control import course
from benchmarks.control.course import Course
from benchmarks.control.entries import Entry
from benchmarks.control.runs import Runner, Setting, machine, settings_of
from stillhook import load_crane

FACTORS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0)
SWINGS = 1.5
"""Error over the least at a smaller gain from which a loop swings [-]."""


class Margin(NamedTuple):
    """Of an entry: K_p [1/m]; gain margin [-], phase margin [rad] and delay margin [s] of the linearised loop, the
    least over both displacements; factor on K_p at which the twin swings [-], infinite where it does not."""

    entry: str
    K_p: float
    gain_margin: float
    phase_margin: float
    delay_margin: float
    factor: float


def margins(entries: Sequence[Entry], size: Course, runner: Runner) -> list[Margin]:
    """Of all entries, with their largest gain and the middle lead."""
    return [_margin(e, size, runner) for e in entries]


def _margin(entry: Entry, size: Course, runner: Runner) -> Margin:
    crane = load_crane(course.CRANE)
    grid = settings_of(entry, crane, size)
    K_p, lead = max(s.K_p for s in grid), grid[len(grid) // 2].lead
    found = [
        m
        for alpha in course.DISPLACEMENTS
        if (m := course.places(machine(crane, entry, Setting(lead, K_p)), entry.mode, alpha).margins(K_p)) is not None
    ]
    free = entry._replace(fixed=False)
    cranes = [machine(crane, free, Setting(lead, factor * K_p)) for factor in FACTORS]
    by_name = course.seas(size)
    seas = [by_name[course.name_of(*sea)].with_mode(entry.mode) for sea in size.drawn]
    errors = runner.errors([(c, sea) for sea in seas for c in cranes], None).reshape(len(seas), -1)
    swings = ~(errors < SWINGS * np.fmin.accumulate(errors, axis=1))
    first = [FACTORS[int(np.argmax(row))] if row.any() else math.inf for row in swings]
    return Margin(
        entry.name,
        K_p,
        min(m.gain_margin for m in found),
        min(m.phase_margin for m in found),
        min(m.delay_margin for m in found),
        min(first),
    )
