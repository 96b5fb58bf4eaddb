"""The runs of all entries: their best settings, scores in every sea, and errors on the drawn plants."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.control import course
from benchmarks.control.course import Course
from benchmarks.control.entries import REFERENCE, Entry
from stillhook import Crane, Scenario, load_crane
from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Parts, Progress
from stillhook.engine.simulate import run_cases
from stillhook.errors import SpecError
from stillhook.library import changed


class Setting(NamedTuple):
    """Lead of reference and feedforward [s], and position gain [1/m]."""

    lead: float
    K_p: float


class Result(NamedTuple):
    """Of an entry: its best setting and its scores by sea; on the drawn plants, by sea, (plants,), its error over
    that of the reference with the lead of the sea, and over that with the best lead on each plant: NaN of a run that
    failed."""

    entry: Entry
    settings: dict[str, Setting]
    scores: dict[str, dict[str, float]]
    ratios: dict[str, FloatArray]
    strict: dict[str, FloatArray]


def machine(crane: Crane, entry: Entry, setting: Setting) -> Crane:
    """The crane under an entry with this setting."""
    crane = changed(crane, entry.tables) if entry.tables else crane
    if entry.fixed:
        return crane
    return changed(crane, {"control": {"t_lead": f"{1e3 * setting.lead:g} ms", "K_p": f"{setting.K_p:g} 1/m"}})


def settings_of(entry: Entry, crane: Crane, size: Course) -> list[Setting]:
    """The grid of an entry."""
    if entry.fixed:
        return [Setting(crane.control.t_lead or 0.0, crane.control.K_p)]
    K_p = course.largest_gain(changed(crane, entry.tables) if entry.tables else crane, entry.mode)
    if K_p == 0.0:
        raise SpecError(
            f"{entry.name}: no gain K_p leaves a gain margin of {course.MARGIN:g} at displacements"
            f" {course.DISPLACEMENTS[0]:g} and {course.DISPLACEMENTS[1]:g}. Feed back less of what the loop moves."
        )
    return [Setting(*pair) for pair in product(entry.leads or size.leads, (share * K_p for share in size.gains))]


def error(row: Any) -> float:
    """Peak to peak control error of a run [m], NaN where it failed."""
    return float(row["e_c_pp"])


class Runner(NamedTuple):
    """Runs pairs of crane and scenario, and keeps what it ran in a folder."""

    store: Path | None
    threads: int = 2

    def errors(self, pairs: Sequence[tuple[Crane, Scenario]], progress: Progress | None) -> FloatArray:
        cranes, cases = zip(*pairs, strict=True)
        rows = run_cases(list(cranes), list(cases), store=self.store, threads=self.threads, progress=progress)
        return np.array([error(row) for row in rows])


def results(
    entries: Sequence[Entry], size: Course, runner: Runner, ship: Path | None = None, progress: Progress | None = None
) -> list[Result]:
    """All entries, the reference first among those that the others are measured by."""
    crane = load_crane(course.CRANE)
    seas = course.seas(size, ship)
    grids = {e.name: settings_of(e, crane, size) for e in entries}
    runs = sum(len(grid) for grid in grids.values()) * len(seas)
    drawn = {e.name: size.plants * len(size.drawn) * (len(size.leads) if e.name == REFERENCE else 1) for e in entries}
    parts = Parts(progress, {"settings": runs, "scores": 2.0 * len(entries) * len(seas), **drawn})

    best = _best(entries, grids, seas, crane, runner, parts("settings"))
    scores = _scores(entries, best, seas, crane, runner, parts("scores"))
    errors: dict[str, dict[str, FloatArray]] = {}
    least: dict[str, FloatArray] = {}
    for e in entries:
        found = _on_plants(e, best[e.name], grids[e.name], seas, crane, size, runner, parts(e.name))
        errors[e.name] = {sea: by[best[e.name][sea]] for sea, by in found.items()}
        if e.name == REFERENCE:
            least = {sea: np.fmin.reduce([*by.values()]) for sea, by in found.items()}
    return [
        Result(
            e,
            best[e.name],
            scores[e.name],
            {sea: x / errors[REFERENCE][sea] for sea, x in errors[e.name].items()},
            {sea: x / least[sea] for sea, x in errors[e.name].items()},
        )
        for e in entries
    ]


def _best(
    entries: Sequence[Entry],
    grids: dict[str, list[Setting]],
    seas: dict[str, Scenario],
    crane: Crane,
    runner: Runner,
    progress: Progress | None,
) -> dict[str, dict[str, Setting]]:
    """Of every entry and sea the setting with the least error on the crane of the file."""
    keys = [(e, sea, s) for e in entries for sea in seas for s in grids[e.name]]
    machines = {(e.name, s): machine(crane, e, s) for e in entries for s in grids[e.name]}
    found = runner.errors([(machines[e.name, s], seas[sea].with_mode(e.mode)) for e, sea, s in keys], progress)
    best: dict[str, dict[str, tuple[float, Setting]]] = {e.name: {} for e in entries}
    for (e, sea, setting), x in zip(keys, np.nan_to_num(found, nan=np.inf), strict=True):
        if sea not in best[e.name] or x < best[e.name][sea][0]:
            best[e.name][sea] = (float(x), setting)
    return {name: {sea: setting for sea, (_, setting) in of.items()} for name, of in best.items()}


def _scores(
    entries: Sequence[Entry],
    best: dict[str, dict[str, Setting]],
    seas: dict[str, Scenario],
    crane: Crane,
    runner: Runner,
    progress: Progress | None,
) -> dict[str, dict[str, dict[str, float]]]:
    keys = [(e, sea) for e in entries for sea in seas]
    found = run_cases(
        [machine(crane, e, best[e.name][sea]) for e, sea in keys],
        [seas[sea].with_mode(e.mode) for e, sea in keys],
        every=course.EVERY,
        keep=course.scores_of,
        threads=runner.threads,
        progress=progress,
    )
    out: dict[str, dict[str, dict[str, float]]] = {e.name: {} for e in entries}
    for (e, sea), scores in zip(keys, found, strict=True):
        out[e.name][sea] = scores
    return out


def _on_plants(
    entry: Entry,
    best: dict[str, Setting],
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
    keys = [(sea, setting) for sea in names for setting in dict.fromkeys([best[sea], *leads])]
    pairs = [
        pair
        for sea, setting in keys
        for pair in course.plants(machine(crane, entry, setting), seas[sea].with_mode(entry.mode), size.plants)
    ]
    found = runner.errors(pairs, progress).reshape(-1, size.plants)
    out: dict[str, dict[Setting, FloatArray]] = {sea: {} for sea in names}
    for (sea, setting), x in zip(keys, found, strict=True):
        out[sea][setting] = x
    return out
