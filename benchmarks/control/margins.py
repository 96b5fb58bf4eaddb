"""How far each entry is from swinging: margins of the linearised loop at both displacements, and of the twin in seas,
with noise and everything that a law has learned."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.control import course
from benchmarks.control.course import Course
from benchmarks.control.entries import Entry
from benchmarks.control.runs import ERROR, Runner, Setting, machine, settings_of, trial
from stillhook import Crane, Scenario, load_crane
from stillhook.analysis.loop_stability.in_the_twin import GROWS, MOST_FACTOR, twin_margins

FACTORS = np.geomspace(1.0, MOST_FACTOR, 16)
"""Factors on the K_p of an FMU that are run [-]."""


class Margin(NamedTuple):
    """Of an entry: K_p [1/m]; gain margin [-], phase margin [rad] and delay margin [s] of the linearised loop, the
    least over both displacements. Of the twin, the least over the seas of the drawn plants, infinite where none that
    was run is enough: factor on K_p at which the error has grown by half, and at which a disturbance stays [-]; extra
    delay of the pumps' commands at which the same happens [s].

    NaN of an FMU but its K_p and the factor at which the error has grown, and these too where it has no such parameter:
    no linearisation looks into it, and no disturbance goes through its reference.
    """

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
    by_name = course.seas(size)
    seas = [by_name[course.name_of(*sea)].with_mode(entry.mode) for sea in size.drawn]
    if entry.fmu is not None:
        K_p, grows = grid[0].K_p, _grows(entry, crane, grid[len(grid) // 2], seas, runner)
        return Margin(entry.name, K_p, math.nan, math.nan, math.nan, grows, math.nan, math.nan, math.nan)
    own = machine(crane, entry, Setting(grid[len(grid) // 2].lead, max(s.K_p for s in grid)))
    K_p = own.control.K_p
    places = (course.places(own, entry.mode, alpha) for alpha in course.DISPLACEMENTS)
    found = [m for place in places if (m := place.margins(K_p)) is not None]
    twin = [twin_margins(own, sea, threads=runner.threads) for sea in seas]
    factor, later = (np.min([getattr(m, name) for m in twin], axis=0).tolist() for name in ("factor", "delay"))
    return Margin(
        entry.name,
        K_p,
        *(min(getattr(m, name) for m in found) for name in ("gain_margin", "phase_margin", "delay_margin")),
        *factor,
        *later,
    )


def _grows(entry: Entry, crane: Crane, setting: Setting, seas: Sequence[Scenario], runner: Runner) -> float:
    """Factor on the K_p of an FMU at which the error has grown by half [-], the least over the seas."""
    if not entry.takes_gain:
        return math.nan
    settings = [setting._replace(K_p=factor * setting.K_p) for factor in FACTORS.tolist()]
    trials = [trial(machine(crane, entry, s), sea, entry, s) for sea in seas for s in settings]
    errors = runner.values(ERROR, trials, None).reshape(len(seas), -1)
    grown = ~(errors < GROWS * np.fmin.accumulate(errors, axis=1))
    return min(float(FACTORS[np.argmax(row)]) if row.any() else math.inf for row in grown)
