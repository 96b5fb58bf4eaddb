"""The runs of all entries: their best settings, scores in every sea, and errors on the drawn plants."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.control import course
from benchmarks.control.course import Course
from benchmarks.control.entries import REFERENCE, Entry
from benchmarks.control.fmu import GAIN, ControllerFmu, run_hosted
from stillhook import Crane, Scenario, load_crane
from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.engine.simulate import run_cases
from stillhook.errors import SpecError
from stillhook.library import changed

ERROR = "e_c_pp"
"""Peak to peak control error of a run [m]."""
HOSTED = 20.0
"""Time of a run under an FMU over that of one under our own kernels, about [-]."""


class Setting(NamedTuple):
    """Lead of reference and feedforward [s], and position gain [1/m]."""

    lead: float
    K_p: float


class Result(NamedTuple):
    """Of an entry: its best setting by sea, leads that were tried [s], and its scores by sea; on the drawn plants, by
    sea, (plants,), its error over that of the reference with the lead of the sea, and over that with the best lead on
    each plant: NaN of a run that failed."""

    entry: Entry
    settings: dict[str, Setting]
    leads: list[float]
    scores: dict[str, dict[str, float]]
    ratios: dict[str, FloatArray]
    strict: dict[str, FloatArray]


class Trial(NamedTuple):
    """A run: the machine under an entry, what is done to it, and the FMU that commands it, None for the case's mode."""

    crane: Crane
    case: Any
    fmu: ControllerFmu | None = None


def machine(crane: Crane, entry: Entry, setting: Setting) -> Crane:
    """The crane under an entry with this setting."""
    crane = changed(crane, entry.tables) if entry.tables else crane
    if entry.fixed or entry.fmu is not None:
        return crane
    return changed(crane, {"control": {"t_lead": f"{1e3 * setting.lead:g} ms", "K_p": f"{setting.K_p:g} 1/m"}})


def trial(crane: Crane, case: Any, entry: Entry, setting: Setting) -> Trial:
    """A case under an entry with a setting; crane: as `machine` makes it, or a machine drawn from that."""
    fmu = None if entry.fmu is None else entry.fmu.at(setting.lead, setting.K_p)
    return Trial(crane, case, fmu)


def gain_of(entry: Entry, crane: Crane, loads: Sequence[float] = (), wires: Sequence[float] = ()) -> float:
    """The K_p that an entry runs with [1/m]: the largest that leaves the margin, its own where it is fixed or an FMU.
    Errors: SpecError where there is none."""
    if entry.fixed:
        return crane.control.K_p
    if entry.fmu is not None:
        return entry.fmu.tunable.get(GAIN, math.nan)
    K_p = course.largest_gain(changed(crane, entry.tables) if entry.tables else crane, entry.mode, loads, wires)
    if K_p == 0.0:
        raise SpecError(
            f"{entry.name}: no gain K_p leaves a gain margin of {course.MARGIN:g} at displacements"
            f" {course.DISPLACEMENTS[0]:g} and {course.DISPLACEMENTS[1]:g}. Feed back less of what the loop moves."
        )
    return K_p


def settings_of(entry: Entry, crane: Crane, size: Course) -> list[Setting]:
    """The grid of an entry."""
    K_p = gain_of(entry, crane)
    if not entry.takes_lead:
        return [Setting(crane.control.t_lead or 0.0 if entry.fixed else 0.0, K_p)]
    gains = size.gains if entry.fmu is None else (1.0,)
    return [Setting(*pair) for pair in product(entry.leads or size.leads, (share * K_p for share in gains))]


class Runner(NamedTuple):
    """Runs trials, and keeps what it ran in a folder."""

    store: Path | None
    threads: int = 2

    def rows(self, trials: Sequence[Trial], progress: Progress | None, **more: Any) -> list[Any]:
        """What is kept of every run; more: as of `run_cases`."""
        ours = [i for i, t in enumerate(trials) if t.fmu is None]
        hosted = [i for i, t in enumerate(trials) if t.fmu is not None]
        parts = Parts(progress, {"own": float(len(ours)), "hosted": HOSTED * len(hosted)})
        store = None if more else self.store
        found: dict[int, Any] = {}
        if ours:
            cranes, cases, _ = zip(*(trials[i] for i in ours), strict=True)
            own = {"threads": self.threads, "store": store, "progress": parts("own"), **more}
            found |= dict(zip(ours, run_cases(list(cranes), list(cases), **own), strict=True))
        if hosted:
            cranes, cases, fmus = zip(*(trials[i] for i in hosted), strict=True)
            own = {"processes": self.threads, "store": store, "progress": parts("hosted"), **more}
            found |= dict(zip(hosted, run_hosted(cranes, cases, fmus, **own), strict=True))
        return [found[i] for i in range(len(trials))]

    def values(self, score: str, trials: Sequence[Trial], progress: Progress | None) -> FloatArray:
        """A score of every run, NaN where it failed."""
        return np.array([float(row[score]) for row in self.rows(trials, progress)])


def best(keys: Sequence[tuple[Any, Setting]], values: FloatArray) -> dict[Any, tuple[Setting, float]]:
    """Of every key the setting with the least value, and that value; infinite where all runs failed."""
    found: dict[Any, tuple[Setting, float]] = {}
    for (key, setting), x in zip(keys, np.nan_to_num(values, nan=np.inf), strict=True):
        if key not in found or x < found[key][1]:
            found[key] = setting, float(x)
    return found


def results(
    entries: Sequence[Entry], size: Course, runner: Runner, ship: Path | None = None, progress: Progress | None = None
) -> list[Result]:
    """All entries, each measured by the reference, which is before those that are not fixed."""
    crane = load_crane(course.CRANE)
    seas = course.seas(size, ship)
    grids = {e.name: settings_of(e, crane, size) for e in entries}
    runs = sum(len(grid) for grid in grids.values()) * len(seas)
    drawn = {e.name: size.plants * len(size.drawn) * (len(size.leads) if e.name == REFERENCE else 1) for e in entries}
    drawn |= {e.name: HOSTED * drawn[e.name] for e in entries if e.fmu is not None}
    parts = Parts(progress, {"settings": runs, "scores": 2.0 * len(entries) * len(seas), **drawn})

    found = _settings(entries, grids, seas, crane, runner, parts("settings"))
    scores = _scores(entries, found, seas, crane, runner, parts("scores"))
    errors: dict[str, dict[str, FloatArray]] = {}
    least: dict[str, FloatArray] = {}
    for e in entries:
        by_sea = _on_plants(e, found[e.name], grids[e.name], seas, crane, size, runner, parts(e.name))
        errors[e.name] = {sea: by[found[e.name][sea]] for sea, by in by_sea.items()}
        if e.name == REFERENCE:
            least = {sea: np.fmin.reduce([*by.values()]) for sea, by in by_sea.items()}
    return [
        Result(
            e,
            found[e.name],
            sorted({s.lead for s in grids[e.name]}),
            scores[e.name],
            {sea: x / errors[REFERENCE][sea] for sea, x in errors[e.name].items()},
            {sea: x / least[sea] for sea, x in errors[e.name].items()},
        )
        for e in entries
    ]


def _settings(
    entries: Sequence[Entry],
    grids: dict[str, list[Setting]],
    seas: dict[str, Scenario],
    crane: Crane,
    runner: Runner,
    progress: Progress | None,
) -> dict[str, dict[str, Setting]]:
    """Of every entry and sea the setting with the least error on the crane of the file."""
    machines = {(e.name, s): machine(crane, e, s) for e in entries for s in grids[e.name]}
    trials = {
        ((e.name, sea), s): trial(machines[e.name, s], case.with_mode(e.mode), e, s)
        for e in entries
        for sea, case in seas.items()
        for s in grids[e.name]
    }
    found = best(list(trials), runner.values(ERROR, list(trials.values()), progress))
    return {e.name: {sea: found[e.name, sea][0] for sea in seas} for e in entries}


def _scores(
    entries: Sequence[Entry],
    settings: dict[str, dict[str, Setting]],
    seas: dict[str, Scenario],
    crane: Crane,
    runner: Runner,
    progress: Progress | None,
) -> dict[str, dict[str, dict[str, float]]]:
    trials = [
        trial(machine(crane, e, s), seas[sea].with_mode(e.mode), e, s)
        for e in entries
        for sea, s in settings[e.name].items()
    ]
    found = iter(runner.rows(trials, progress, every=course.EVERY, keep=course.scores_of))
    return {e.name: {sea: next(found) for sea in settings[e.name]} for e in entries}


def _on_plants(
    entry: Entry,
    settings: dict[str, Setting],
    grid: Sequence[Setting],
    seas: dict[str, Scenario],
    crane: Crane,
    size: Course,
    runner: Runner,
    progress: Progress | None,
) -> dict[str, dict[Setting, FloatArray]]:
    """Error on every drawn plant by sea and setting: that which is best on the crane file, and of the reference all
    leads with its largest gain too."""
    names = [course.name_of(*sea) for sea in size.drawn]
    K_p = max(s.K_p for s in grid)
    leads = [s for s in grid if s.K_p == K_p and entry.name == REFERENCE]
    keys = [(sea, setting) for sea in names for setting in dict.fromkeys([settings[sea], *leads])]
    trials = [
        trial(*drawn, entry, setting)
        for sea, setting in keys
        for drawn in course.plants(machine(crane, entry, setting), seas[sea].with_mode(entry.mode), size.plants)
    ]
    found = runner.values(ERROR, trials, progress).reshape(-1, size.plants)
    out: dict[str, dict[Setting, FloatArray]] = {sea: {} for sea in names}
    for (sea, setting), x in zip(keys, found, strict=True):
        out[sea][setting] = x
    return out
