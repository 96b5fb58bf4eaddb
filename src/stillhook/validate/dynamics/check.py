"""Step 4: does the winch accelerate and swing as the twin does, driven by the measured commands? Tunes capacitance,
leakage and inertia.

Source: Moslatt 2020 paper F step 4: without load, with less than 20 m of wire out, the pressure gradients of both lines
and the periods between significant pressure peaks, in three places. What goes beyond print: both are measured in every
turn, and the three numbers behind them are fitted with intervals. The verdict is on the crane as its file has it; the
tuned one is offered (`stillhook.validate.dynamics.tuned_crane`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from stillhook.errors import StillhookError
from stillhook.library.leakage import Point
from stillhook.units import show
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.records.record import Record, Segment
from stillhook.validate.data_set.records.transients import Transient, find_transients, quick_enough
from stillhook.validate.dynamics.estimates import Found, found_of, in_form, measures_of
from stillhook.validate.dynamics.fitting.fit import Tuning, clusters_of, tune
from stillhook.validate.dynamics.fitting.form import Apart, apart
from stillhook.validate.dynamics.fitting.unknowns import C_LEAK, NAMES, TUNED
from stillhook.validate.dynamics.runs import Stretch, motor_command, stretch_of
from stillhook.validate.dynamics.swings import Compared, compared
from stillhook.validate.dynamics.tables import statements_of, tables_of
from stillhook.validate.parameters.circuit.flow import Balance, balance, leak_rows
from stillhook.validate.parameters.circuit.leakage import LeakChoice
from stillhook.validate.parameters.segments import parts_of

MOST_WIRE = 20.0
"""Wire out in a test of the dynamics [m]. Source: paper F step 4."""
FEWEST = 3
"""Turns that a test must hold: paper F measures the period in three places."""
LONGEST_STRETCH = 240.0
"""Of a longer test the first part is used [s]; more would cost time and add little."""
COARSEST = 0.025
"""Largest spacing of a log [s]. At 20 ms the tuned numbers move by 0.3 %; at 50 ms C_h by 2 and leakage by 3 %, at 100
ms by 6 and 12 %."""
SLOWEST = 1.0
"""A change of the pumps' command must be over within this time [s], two periods of the winch, or it rings nothing."""
OTHER_OIL = 0.03
"""Deviation of the leakage between two tests [-]: a kelvin or so of the oil's temperature, and what the balance does
not see."""
ALL = (
    "C_h_error",
    "C_leak_error",
    "J_m_eff_error",
    "pressure_gradient_error",
    "swing_period_error",
    "dynamics_misfit",
    "dynamics_misfit_tuned",
)
WHAT_TO_LOG = (
    "Log the winch without load and with less than 20 m of wire out, in manual mode: from rest to a speed and back,"
    " each within half a second, both ways, eight times; p_a, p_b, omega_m, u_p, u_m every 10 ms."
)


@dataclass(frozen=True)
class DynamicsStep(Step):
    """Step 4 with what its figures and the tuned crane need: stretches of the tests, their turns, the fit, and what it
    gave. None where no test could be used. leak: form of the leakage by the flow balance of the tests with heave
    compensation; leak_at: point of which C_leak_error speaks, None where it is not known."""

    stretches: tuple[Stretch, ...] = ()
    transients: tuple[Transient, ...] = ()
    tuning: Tuning | None = None
    tuned: tuple[Found, ...] = ()
    swings: Compared | None = None
    leak: LeakChoice | None = None
    leak_at: Point | None = None


def check_dynamics(campaign: Campaign, records: tuple[Record, ...], progress: Callable[[float], None]) -> Step:
    """Compare the twin's gradients and periods with those of the tests of kind "dynamics", and tune the crane to them.

    Returns a DynamicsStep; its measures have no value, and say why, where the tests cannot tell.
    """
    tests = [r for r in records if r.test.kind is Kind.DYNAMICS]
    if not tests:
        return _nothing('The campaign has no test of kind "dynamics".', ())
    stretches, turns, said = _stretches(campaign, tests)
    if len(turns) < FEWEST:
        why = (
            f"{_names(tests)} shows {len(turns)} quick turns of the winch; {FEWEST} are the least."
            if not said
            else said[0]
        )
        return _nothing(why, tuple(said))
    progress(0.05)
    try:
        clusters = [clusters_of(s, turns) for s in stretches]
        flow = leakage_elsewhere(campaign, records)
        known = expected_leakage(campaign, tests, flow)
        tuning = tune(campaign.crane, stretches, clusters, known, lambda x: progress(0.05 + 0.9 * x))
    except StillhookError as e:
        return _nothing(f"The twin does not run on it: {e}", tuple(said))
    swings = compared(stretches, turns, tuning)
    differences = apart(tuning.fit, turns, known)
    found = tuple(in_form(found_of(tuning, name, swings.misfit_after, differences), flow) for name in TUNED)
    return DynamicsStep(
        number=StepNumber.DYNAMICS,
        measures=measures_of(found, swings, stretches, turns, tuning),
        statements=statements_of(campaign.crane, found, tuning, swings, bool(known), said),
        tables=tables_of(campaign.crane, found, tuning, swings),
        data=_data(found, swings, tuning, differences),
        stretches=stretches,
        transients=turns,
        tuning=tuning,
        tuned=found,
        swings=swings,
        leak=None if flow is None else flow.leak,
        leak_at=_leak_at(campaign, tests, flow),
    )


def leakage_elsewhere(campaign: Campaign, records: tuple[Record, ...]) -> Balance | None:
    """The flow balance of the tests with heave compensation; None without such tests."""
    tests = [r for r in records if r.test.kind is Kind.AHC]
    b = balance(parts_of(campaign, tests)) if tests else None
    return b if b is not None and b.leakage.value > -0.9 else None


def expected_leakage(
    campaign: Campaign, tests: Sequence[Record], flow: Balance | None
) -> dict[str, tuple[float, float]]:
    """What that balance tells of the leakage in the tests of the dynamics: the logarithm over the crane file's, its
    deviation.

    Without load the leakage is a hundredth of the pumps' flow, in heave compensation it is more and lasts for half an
    hour; but it was another oil that leaked then, by some kelvin. The form that the data speak for carries it to the
    settings and speeds of these tests, and what the forms differ by there counts as uncertain.
    """
    if flow is None:
        return {}
    rows = leak_rows(parts_of(campaign, tests))
    e = flow.leak.over(rows) if rows is not None and rows.used.any() else flow.leakage
    if e.value <= -0.9:
        return {}
    return {C_LEAK: (math.log1p(e.value), math.hypot(e.half / 1.96 / (1.0 + e.value), OTHER_OIL))}


def _leak_at(campaign: Campaign, tests: Sequence[Record], flow: Balance | None) -> Point | None:
    """Where the leakage of step 4 holds: in its own turns, or where the flow balance judges it if that refutes the
    crane file's form."""
    if flow is not None and flow.leak.refuted:
        return flow.leak.judged_at
    rows = leak_rows(parts_of(campaign, tests))
    if rows is not None and rows.used.any():
        return rows.at
    return None if flow is None else flow.leak.at


def _nothing(why: str, said: Sequence[str]) -> DynamicsStep:
    note = f"{why} {WHAT_TO_LOG}"
    return DynamicsStep(
        StepNumber.DYNAMICS,
        tuple(Measure(name, None, note=note) for name in ALL),
        (note, *(x for x in said if x != why)),
    )


def _names(tests: Sequence[Record]) -> str:
    return f"Test {', '.join(r.test.name for r in tests)}"


def _stretches(
    campaign: Campaign, tests: Sequence[Record]
) -> tuple[tuple[Stretch, ...], tuple[Transient, ...], list[str]]:
    """The parts of the tests that the twin repeats, their quick turns, and what a reader must know of them."""
    stretches: list[Stretch] = []
    turns: list[Transient] = []
    said: list[str] = []
    for record in tests:
        why = _unusable(record)
        if why:
            said.append(why)
            continue
        said += [x for segment in record.segments for x in _conditions(campaign, segment)]
        for segment in record.segments:
            own = find_transients(record, segment)
            quick = quick_enough(own, SLOWEST)
            if len(quick) < len(own):
                said.append(
                    f'Test "{record.test.name}": {len(own) - len(quick)} changes of the command take longer than'
                    f" {SLOWEST:g} s: too slow."
                )
            if not quick:
                continue
            last = min(segment.last, quick[-1].last, segment.first + round(LONGEST_STRETCH / record.step))
            if last < quick[-1].last:
                said.append(f'Test "{record.test.name}": the first {LONGEST_STRETCH:g} s are used.')
            turns += [x for x in quick if x.last <= last]
            stretches.append(stretch_of(campaign.crane, record, segment, segment.first, last))
    return tuple(stretches), tuple(turns), list(dict.fromkeys(said))


def _missing(record: Record) -> str:
    if not record.has("u_p"):
        return "u_p"
    if not record.has(motor_command(record)):
        return "u_m, nor alpha_m"
    return "" if record.has("p_a") or record.has("p_b") else "p_a, nor p_b"


def _unusable(record: Record) -> str:
    """Why a test cannot be used; "" where it can."""
    missing = _missing(record)
    if missing:
        return f'Test "{record.test.name}" has no {missing}: it cannot be repeated, or has nothing to compare.'
    if record.step > COARSEST:
        return (
            f'Test "{record.test.name}" was logged every {show(record.step, "time")}: too far apart for swings of half'
            " a second."
        )
    return ""


def _conditions(campaign: Campaign, segment: Segment) -> list[str]:
    """How far a segment is from the test that paper F asks for."""
    out = []
    if segment.load > 0.0:
        out.append(
            f'Test "{segment.test}" has {show(segment.load, "mass")} on the hook; paper F asks for none, '
            "so that load and wire stay out of the pressures."
        )
    if segment.s_w_max > MOST_WIRE:
        out.append(
            f'Test "{segment.test}" has up to {segment.s_w_max:.3g} m of wire out; paper F asks for less than'
            f" {MOST_WIRE:g} m."
        )
    return out


def _data(found: Sequence[Found], swings: Compared, tuning: Tuning, differences: Sequence[Apart]) -> dict[str, object]:
    """Numbers behind the figures for JSON, SI."""
    return {
        "tuned": {
            f.name: {
                "factor": f.factor,
                "low": f.low,
                "high": f.high,
                "structural": f.structural,
                "known": f.known,
                "offered": f.offered,
            }
            for f in found
        },
        "groups": [
            {
                "name": x.name,
                "groups": list(x.groups),
                "difference": x.difference,
                "deviation": x.deviation,
                "clear": x.beyond_sampling,
            }
            for x in differences
        ],
        "beside": {name: float(tuning.fit.theta[i]) for i, name in enumerate(NAMES) if name not in TUNED},
        "fit": {
            "converged": tuning.fit.converged,
            "said": tuning.fit.said,
            "runs": tuning.fit.runs,
            "turns": tuning.fit.clusters,
        },
        "swings": swings.to_dict(),
    }
