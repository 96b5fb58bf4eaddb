"""Deep water: the motion of the load on a long wire, which a loop by the load cell is for. The wire is a rod of nodes,
the payload is in water with its added mass and drag, and the load cell has noise and drift."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from benchmarks.control import course
from benchmarks.control.course import Course
from benchmarks.control.entries import Entry
from benchmarks.control.runs import Runner, Setting, best, gain_of, machine, trial
from stillhook import Lowering, load_crane, read_payload
from stillhook.base.progress import Progress
from stillhook.errors import SpecError

CRANE, PAYLOADS, SEAS = "deep-250t", ("suction-anchor-85t", "template-120t"), ((1.0, 6.0), (2.0, 9.0))
"""Crane, payloads, and seas: significant height [m] and peak period [s]."""
SENSORS: Mapping[str, Any] = {**course.SENSORS, "F": {"noise": "5 kN", "drift": "25 kN"}}
"""Those of the benchmark, and a load cell with noise and drift in an hour: 0.2 and 1 % of the SWL."""
DURATION, RAMP = 260.0, 60.0
"""Time of a hold, and time over which the tip's motion grows, so that no start is in the score [s]."""
TIP, ABOVE = "36 m", 200.0
"""Height of the tip, and of the payload above the seabed [m]."""
SCORE = "load_pp"
"""Motion of the load, peak to peak in 30 s [m]."""


class Deep(NamedTuple):
    """Of an entry: K_p [1/m]; by case the least motion of the load [m], infinite where it failed, and the lead that has
    it [s]."""

    name: str
    K_p: float
    motions: dict[str, float]
    leads: dict[str, float]


def cases(size: Course) -> dict[str, Lowering]:
    """Holds of payloads in seas on wires, by name."""
    found = {}
    for wire in size.wires:
        for name in PAYLOADS:
            for Hs, Tp in SEAS:
                found[f"{name}, {wire:g} m, Hs {Hs:g} m, Tp {Tp:g} s"] = Lowering(
                    payload=read_payload(name),
                    h_tip=TIP,
                    depth=f"{wire + ABOVE:g} m",
                    start_depth=f"{wire:g} m",
                    programme=[{"mode": "ahc", "time": f"{DURATION:g} s"}],
                    duration=f"{DURATION:g} s",
                    ramp=f"{RAMP:g} s",
                    tip=course.jonswap(Hs, Tp, DURATION),
                    sensors=SENSORS,
                )
    return found


def deep(entries: Sequence[Entry], size: Course, runner: Runner, progress: Progress | None = None) -> list[Deep]:
    """All entries but FMUs, which are made for one crane, and those that no gain leaves the margin here: each with the
    lead, of its grid, that has the least motion, and the largest gain that the margin allows at these payloads and
    wires."""
    crane, lowerings, trials = load_crane(CRANE), cases(size), {}
    loads, found = [read_payload(name).mass for name in PAYLOADS], {}
    for e in entries:
        if e.fmu is None:
            with contextlib.suppress(SpecError):
                found[e.name] = e, gain_of(e, crane, loads, size.wires)
    for e, K_p in found.values():
        leads = e.leads or size.leads
        settings = [Setting(lead, K_p) for lead in leads] if e.takes_lead else [Setting(0.0, K_p)]
        for s in settings:
            made = machine(crane, e, s)
            for name, case in lowerings.items():
                trials[(e.name, name), s] = trial(made, case.model_copy(update={"controller": e.mode}), e, s)
    least = best(list(trials), runner.values(SCORE, list(trials.values()), progress))
    return [
        Deep(
            name,
            K_p,
            {case: least[name, case][1] for case in lowerings},
            {case: least[name, case][0].lead for case in lowerings},
        )
        for name, (_, K_p) in found.items()
    ]
