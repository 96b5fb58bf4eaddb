"""How far each entry is from swinging: margins of the linearised loop at both displacements, and of the twin in seas,
with noise and everything that a law has learned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.control import course
from benchmarks.control.course import Course
from benchmarks.control.entries import Entry
from benchmarks.control.runs import Runner, Setting, machine, settings_of
from stillhook import load_crane
from stillhook.analysis.loop_stability.in_the_twin import twin_margins


class Margin(NamedTuple):
    """Of an entry: K_p [1/m]; gain margin [-], phase margin [rad] and delay margin [s] of the linearised loop, the
    least over both displacements. Of the twin, the least over the seas of the drawn plants, infinite where none that
    was run is enough: factor on K_p at which the error has grown by half, and at which a disturbance stays [-]; extra
    delay of the pumps' commands at which the same happens [s]."""

    entry: str
    K_p: float
    gain_margin: float
    phase_margin: float
    delay_margin: float
    factor_grows: float
    factor_stays: float
    later_grows: float
    later_stays: float


def margins(entries: Sequence[Entry], size: Course, runner: Runner) -> list[Margin]:
    """Of all entries, with their largest gain and the middle lead."""
    return [_margin(e, size, runner) for e in entries]


def _margin(entry: Entry, size: Course, runner: Runner) -> Margin:
    crane = load_crane(course.CRANE)
    grid = settings_of(entry, crane, size)
    own = machine(crane, entry, Setting(grid[len(grid) // 2].lead, max(s.K_p for s in grid)))
    K_p = own.control.K_p
    places = (course.places(own, entry.mode, alpha) for alpha in course.DISPLACEMENTS)
    found = [m for place in places if (m := place.margins(K_p)) is not None]
    by_name = course.seas(size)
    seas = (by_name[course.name_of(*sea)].with_mode(entry.mode) for sea in size.drawn)
    twin = [twin_margins(own, sea, threads=runner.threads) for sea in seas]
    factor, later = (np.min([getattr(m, name) for m in twin], axis=0).tolist() for name in ("factor", "delay"))
    return Margin(
        entry.name,
        K_p,
        *(min(getattr(m, name) for m in found) for name in ("gain_margin", "phase_margin", "delay_margin")),
        *factor,
        *later,
    )
