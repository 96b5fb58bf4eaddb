"""Step 4: acceleration and oscillation of the winch against the twin driven by the measured commands. Tunes
capacitance, leakage and inertia.

Source: Moslatt 2020 paper F step 4: without load, with less than 20 m of wire out, the pressure gradients of both lines
and the periods between significant pressure peaks, in three places. Beyond print: both are measured in every turn, and
the three underlying parameters are fitted with intervals. The verdict applies to the crane file; the tuned crane is
proposed (`stillhook.validate.dynamics.tuned_crane`).

The crane as tuned by step 4, for its user to adopt and validate again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stillhook.base.progress import Progress
from stillhook.errors import StillhookError
from stillhook.library.crane_file import changed
from stillhook.library.leakage import Point, form_of, pump_leak
from stillhook.library.toml.tree import nested
from stillhook.library.write import items
from stillhook.physics.hydraulics.pump import pump_leakage
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import NORMAL_95
from stillhook.units import KINDS, in_display, number, show
from stillhook.validate.criteria.results import Note, Step, StepNumber, nothing
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.record import Record, Segment, Transient, find_transients, quick_enough
from stillhook.validate.dynamics.estimates import (
    WORDS,
    SwingComparison,
    TunedValue,
    compare_swings,
    in_form,
    measures_of,
    statements_of,
    tables_of,
    tuned_value,
)
from stillhook.validate.dynamics.form import Tuning, clusters_of, group_differences, tune
from stillhook.validate.dynamics.model import C_LEAK, PLACE, TUNED, UNKNOWNS, scaled
from stillhook.validate.dynamics.runs import DynamicsSegment, dynamics_segment, motor_command
from stillhook.validate.parameters.flow import Balance, balance, leak_rows
from stillhook.validate.parameters.leakage import LeakChoice
from stillhook.validate.parameters.segments import parts_of
from stillhook.winches.circuits.tables import LeakForm

MOST_WIRE = 20.0
"""Wire out in a test of the dynamics [m]. Source: paper F step 4."""
FEWEST = 3
"""Least number of turns in a test: paper F measures the period in three places."""
LONGEST_STRETCH = 240.0
"""Longest used part of a test [s]; more would take time and add little."""
COARSEST = 0.025
"""Largest spacing of a log [s]. At 20 ms the tuned numbers move by 0.3 %; at 50 ms C_h by 2 and leakage by 3 %, at 100
ms by 6 and 12 %."""
SLOWEST = 1.0
"""A change of the pumps' command must be over within this time [s], two periods of the winch, or it excites no
oscillation."""
OTHER_OIL = 0.03
"""Deviation of the leakage between two tests [-]: about a kelvin of the oil's temperature, and effects not in the
balance."""


@dataclass(frozen=True)
class DynamicsEstimates:
    """Estimates of step 4. leak: form of the leakage by the flow balance of the tests with heave compensation; leak_at:
    point that C_leak_error refers to, None where it is not known."""

    time_segments: tuple[DynamicsSegment, ...]
    transients: tuple[Transient, ...]
    tuning: Tuning
    tuned: tuple[TunedValue, ...]
    swings: SwingComparison
    leak: LeakChoice | None
    leak_at: Point | None


def check_dynamics(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[DynamicsEstimates]:
    """Compare the twin's gradients and periods with those of the tests of kind "dynamics", and tune the crane to
    them."""
    tests = [r for r in records if r.test.kind is Kind.DYNAMICS]
    if not tests:
        return _nothing(Note("no-dynamics-test"))
    time_segments, turns, notes = _time_segments(campaign, tests)
    if len(turns) < FEWEST:
        few = Note("few-turns", tests=[r.test.name for r in tests], n=len(turns), least=FEWEST)
        return _nothing(*(notes or [few]))
    progress(0.0)
    try:
        clusters = [clusters_of(s, turns) for s in time_segments]
        flow = leakage_elsewhere(campaign, records)
        leakage = expected_leakage(campaign, tests, flow)
        tuning = tune(campaign.crane, time_segments, clusters, leakage, lambda x: progress(x))
    except StillhookError as e:
        return _nothing(Note("no-simulation", error=e), *notes)
    swings = compare_swings(time_segments, turns, tuning)
    differences = group_differences(tuning.fit, turns, leakage)
    values = tuple(in_form(tuned_value(tuning, name, swings.misfit_after, differences), flow) for name in TUNED)
    return Step(
        StepNumber.DYNAMICS,
        measures_of(values, swings, time_segments, turns, tuning),
        statements_of(values, tuning, bool(leakage), notes),
        tables_of(campaign.crane, values, swings),
        {"tuned": values, "groups": differences, "fit": tuning.fit, "swings": swings},
        DynamicsEstimates(
            time_segments,
            turns,
            tuning,
            values,
            swings,
            None if flow is None else flow.leak,
            _leak_at(campaign, tests, flow),
        ),
    )


def leakage_elsewhere(campaign: Campaign, records: tuple[Record, ...]) -> Balance | None:
    """The flow balance of the tests with heave compensation; None without such tests."""
    tests = [r for r in records if r.test.kind is Kind.AHC]
    b = balance(parts_of(campaign, tests)) if tests else None
    return b if b is not None and b.leak.value.value > -0.9 else None


def expected_leakage(
    campaign: Campaign, tests: Sequence[Record], flow: Balance | None
) -> dict[str, tuple[float, float]]:
    """Leakage in the tests of the dynamics expected from that balance: the logarithm over the crane file's, and its
    deviation. Without load the leakage is a hundredth of the pumps' flow, in heave compensation it is more and lasts
    for half an hour; but at another oil temperature. The form supported by the data transfers it to the settings and
    speeds of these tests."""
    if flow is None:
        return {}
    rows = leak_rows(parts_of(campaign, tests))
    e = flow.leak.over(rows) if rows is not None and rows.used.any() else flow.leak.value
    if e.value <= -0.9:
        return {}
    return {C_LEAK: (math.log1p(e.value), math.hypot(e.half / NORMAL_95 / (1.0 + e.value), OTHER_OIL))}


def _leak_at(campaign: Campaign, tests: Sequence[Record], flow: Balance | None) -> Point | None:
    """Point of the leakage of step 4: of its own turns, or of the flow balance if that refutes the crane file's
    form."""
    if flow is not None and flow.leak.refuted:
        return flow.leak.at
    rows = leak_rows(parts_of(campaign, tests))
    if rows is not None and rows.used.any():
        return rows.at
    return None if flow is None else flow.leak.at


def _nothing(reason: Note, *notes: Note) -> Step[DynamicsEstimates]:
    return nothing(StepNumber.DYNAMICS, Note("log-dynamics", reason=reason.rstrip(".")), *notes)


def _time_segments(
    campaign: Campaign, tests: Sequence[Record]
) -> tuple[tuple[DynamicsSegment, ...], tuple[Transient, ...], list[Note]]:
    """The parts of the tests that the twin repeats, their quick turns, and notes about them."""
    time_segments: list[DynamicsSegment] = []
    turns: list[Transient] = []
    notes: list[Note] = []
    for record in tests:
        reason = _unusable(record)
        if reason:
            notes.append(reason)
            continue
        notes += [x for segment in record.segments for x in _conditions(campaign, segment)]
        for segment in record.segments:
            changes = find_transients(record, segment)
            quick = quick_enough(changes, SLOWEST)
            if len(quick) < len(changes):
                notes.append(Note("slow-turns", test=record.test.name, n=len(changes) - len(quick), most=SLOWEST))
            if not quick:
                continue
            last = min(segment.last, quick[-1].last, segment.first + round(LONGEST_STRETCH / record.step))
            if last < quick[-1].last:
                notes.append(Note("first-part", test=record.test.name, seconds=LONGEST_STRETCH))
            turns += [x for x in quick if x.last <= last]
            time_segments.append(dynamics_segment(campaign.crane, record, segment, segment.first, last))
    return tuple(time_segments), tuple(turns), list(dict.fromkeys(notes))


def _unusable(record: Record) -> Note | None:
    """Reason why a test cannot be used."""
    test = record.test.name
    lines, motors = record.has("p_a") or record.has("p_b"), record.has(motor_command(record))
    if not (record.has("u_p") and motors and lines):
        lack = "u_p" if not record.has("u_p") else "p_a, nor p_b" if motors else "u_m, nor alpha_m"
        return Note("no-repetition", test=test, signals=lack)
    return Note("too-far-apart", test=test, step=record.step) if record.step > COARSEST else None


def _conditions(campaign: Campaign, segment: Segment) -> list[Note]:
    """Deviations of a segment from the test required by paper F."""
    out = [Note("load-on-hook", test=segment.test, load=segment.load)] if segment.load > 0.0 else []
    if segment.s_w_max > MOST_WIRE:
        out.append(Note("much-wire", test=segment.test, wire=segment.s_w_max, most=MOST_WIRE))
    return out


DIGITS = 4
Leaf = dict[str, Any]
"""Value of a crane file with kind and source."""


def tuned_crane(estimates: DynamicsEstimates | None, campaign: Campaign) -> Crane | None:
    """The campaign's crane with the capacitance, leakage and inertia of step 4, each with its source; None where none
    of them is proposed. A value whose law does not fit is left unchanged.

    The capacitance goes into the volume of the lines, the leakage into motors and pumps of the active circuit alike,
    the inertia into all parts but the wire, whose own follows from its mass. Where the logs refute the form of the
    leakage, the form that they support is used, as estimated by the flow balance and at its pressure, provided that
    they determine the value at the crane file's setting and speed, and nothing of the crane file's form.
    """
    if estimates is None:
        return None
    crane, leak = campaign.crane, estimates.leak
    leaves: dict[str, Leaf] = {}
    unchanged = {item.path: item.value for item in items(crane)}
    for tuned in estimates.tuned:
        if not tuned.offered or (tuned.name == C_LEAK and leak is not None and leak.refuted):
            continue
        factor = tuned.factor.value
        source = (
            f"{WORDS[tuned.name]} fitted to the winch dynamics of {campaign.title}, {campaign.date}:"
            f" {factor:.4g} times that of {crane.name} (95 %: {tuned.factor.low:.4g} to {tuned.factor.high:.4g})"
        )
        fitted = UNKNOWNS[PLACE[tuned.name]].bend(crane, factor)
        if tuned.name == C_LEAK:
            fitted = scaled(fitted, factor, "active.C_leak")
        values = {item.path: item.value for item in items(fitted) if item.value != unchanged.get(item.path)}
        leaves |= _leaves(crane, values, source)
    if leak is not None and leak.offered:
        leaves |= _leakage_in_form(crane, leak, campaign)
    return changed(crane, nested(leaves.items())) if leaves else None


def _leaves(crane: Crane, values: Mapping[str, float], source: str) -> dict[str, Leaf]:
    """Fitted values [SI] by path as a crane file writes them."""
    kinds = {item.path: item.quantity for item in items(crane)}
    leaves: dict[str, Leaf] = {}
    for path, value in values.items():
        kind = kinds.get(path)
        text = f"{number(in_display(value, kind), DIGITS)} {KINDS[kind].display}" if kind else None
        leaves[path] = {"value": text or float(f"{value:.{DIGITS}g}"), "kind": "fitted", "source": source}
    return leaves


def _leakage_in_form(crane: Crane, leak: LeakChoice, campaign: Campaign) -> dict[str, Leaf]:
    """The chosen form with what it gives to pumps and motors; a part known only as a sum keeps its share of it."""
    a, at, form = crane.active, form_of(crane.active).at, leak.chosen.form
    b = {"head": 0.0, "stroke": 0.0, "speed": 0.0} | leak.chosen.coefficients
    by_speed = form in (LeakForm.SPEED, LeakForm.STROKE_SPEED)
    pumps = float(pump_leakage(at.alpha_p, pump_leak(a.pump)))
    motors = a.motor.count * (a.motor.C_1 + (0.0 if by_speed else a.motor.C_2 * at.n_m))
    if form in (LeakForm.STROKE, LeakForm.STROKE_SPEED):
        of_pumps, of_motors = b["stroke"], b["head"] / motors if motors > 0.0 else 0.0
    else:
        of_pumps = of_motors = b["head"] / (pumps + motors)
    source = (
        f"form of the leakage by the flow balance of {campaign.title}, {campaign.date}: {form} where {crane.name} has"
        f" {leak.file_form}; {show(leak.reference.value, 'leakage', 3)} +- {show(leak.reference.half, 'leakage', 2)} at"
        " active.leak.at"
    )
    values = {
        "active.motor.C_1": of_motors * a.motor.C_1,
        "active.motor.C_2": b["speed"] / a.motor.count if by_speed else of_motors * a.motor.C_2,
        "active.pump.leak_scale": (1.0 if a.pump.leak_scale is None else a.pump.leak_scale) * of_pumps,
        "active.C_leak": leak.reference.value,
    }
    pressure = f"{number(in_display(leak.at.p, 'pressure'), DIGITS)} {KINDS['pressure'].display}"
    point: dict[str, Leaf] = {
        "active.leak.form": {"value": form.value, "kind": "fitted", "source": source},
        "active.leak.at.p": {"value": pressure, "kind": "fitted", "source": source},
    }
    return _leaves(crane, values, source) | point
