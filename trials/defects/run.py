"""Campaigns of a known truth through `stillhook validate`, kept in outcomes.json: an hour's work that the page is made
from.

    python -m trials.defects.run            run what is not in the file yet
    python -m trials.defects.run 20         run no more than the next 20 of them
    python -m trials.defects.run --new      run also what was computed by other code
    python -m trials.defects.run precharge  run those of this defect alone ("none": without a defect, "apart")

It may be stopped at any time: what is done is in the file. Then `python -m trials.defects.detection_limits` writes the
table that certificates print, and `python docs/validation/make.py truth_defects` the page.
"""

from __future__ import annotations

import functools
import math
import sys
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import StillhookError
from stillhook.library import load_crane
from stillhook.library.leakage import Point, leak_at
from stillhook.physics.hydraulics.lines import external_leakage, internal_leakage
from stillhook.physics.load_path.drum import layer_diameter, layers_filled
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.validate import validate
from stillhook.validate.criteria.results import Measure, StepNumber, Verdict
from stillhook.validate.data_set.campaign import Kind, load_campaign
from stillhook.validate.data_set.read import read_records
from stillhook.validate.parameters.hoisting import States, scale_of_law
from stillhook.validate.parameters.segments import LogPart, by_test, parts_of
from stillhook.validate.report.document import reading_notes
from stillhook.validate.report.view import view_of
from stillhook.validate.validation import Validation
from trials import store
from trials.campaigns import Defect, sea_trials, write_campaign
from trials.campaigns.defects import DEFECTS, STATED_DELAY
from trials.reference_plant.drum import TrueDrum, wound
from trials.reference_plant.laws import gap_motor, gap_pump, leak_across, leak_to_case
from trials.reference_plant.parameters import ReferenceCrane, active_leak, reference_friction

STORE = Path(__file__).resolve().parent / "outcomes.json"
SEEDS = range(100)
APART = range(200, 210)
DEFECT_SEEDS = range(2)
DIGITS = 4
FIGURES = ("2b", "2b-s")
"""Lines whose value and interval are kept."""
PASSIVE = 6
SEEN_BY: Mapping[Defect, tuple[int, ...]] = {
    Defect.LEAKAGE: (1, 4),
    Defect.FRICTION: (1,),
    Defect.LAYER: (1,),
    Defect.GEAR: (1,),
    Defect.PRESSURE_LINES: (0,),
    Defect.MRU_DELAY: (1,),
    Defect.MOTOR_OFFSET: (1,),
    Defect.K_1: (2,),
    Defect.CLOCK: (1,),
    Defect.SATURATION: (2, 3),
    Defect.GAP: (0,),
    Defect.LOAD_CELL: (1,),
    Defect.PRECHARGE: (1, PASSIVE),
    Defect.GAS_VOLUME: (1, PASSIVE),
    Defect.PASSIVE_MOTORS: (1, PASSIVE),
    Defect.MOTOR_COUNT: (1, PASSIVE),
    Defect.ACTIVE_COUNT: (1, 2),
    Defect.SENSOR_A: (1,),
    Defect.LEAK_CONSTANT: (1, 4),
    Defect.LEAK_STROKE: (1, 4),
    Defect.LEAK_SPEED: (1, 4),
    Defect.DISPLACEMENT: (1, 3),
    Defect.BOOST: (1,),
}
"""Steps that are taken where a defect has not its usual size: those that are made to see it. What another step would
see besides is not counted there, so a limit may come out too large, never too small."""


class Trial(NamedTuple):
    """One campaign: seed; defect, "" for none; apart: capacitance, leakage and inertia 10 to 30 % off; size of the
    defect, None for the usual one."""

    seed: int
    defect: str = ""
    apart: bool = False
    size: float | None = None

    @property
    def key(self) -> str:
        name = self.defect or ("apart" if self.apart else "none")
        return "-".join([name if self.size is None else f"{name}@{self.size:.4g}", str(self.seed)])


def trials() -> Iterator[Trial]:
    """What to know first comes first."""
    yield from (Trial(DEFECT_SEEDS[0], defect.value) for defect in Defect)
    yield from (Trial(seed) for seed in SEEDS[:10])
    yield from (Trial(seed, apart=True) for seed in APART[:4])
    yield from (Trial(seed, defect.value) for seed in DEFECT_SEEDS[1:] for defect in Defect)
    yield from (Trial(seed) for seed in SEEDS[10:50])
    yield from (t for defect in Defect for t in rungs(defect))
    yield from (Trial(seed) for seed in SEEDS[50:])
    yield from (Trial(seed, apart=True) for seed in APART[4:])


def rungs(defect: Defect) -> Iterator[Trial]:
    """Campaigns of a defect at the sizes of its ladder beside its usual one."""
    change = DEFECTS[defect]
    yield from (Trial(seed, defect.value, size=x) for x in change.ladder if x != change.size for seed in DEFECT_SEEDS)


def outcome(trial: Trial) -> dict[str, Any]:
    """What validation says of a campaign, short enough for a file; figures in SI."""
    with TemporaryDirectory() as folder:
        defect = Defect(trial.defect) if trial.defect else None
        written = write_campaign(
            Path(folder) / "tests", seed=trial.seed, defect=defect, size=trial.size, apart=trial.apart, threads=1
        )
        truth = tomllib.loads(written.reference.read_text(encoding="utf-8"))
        known = {n: _short(truth["crane"][n]["value"]) for n in ("capacitance", "leakage", "inertia")}
        steps = None if trial.size is None or defect is None else [int(n) for n in StepNumber if n in SEEN_BY[defect]]
        try:
            found = validate(written.campaign, steps=steps)
        except StillhookError as refused:
            return {"truth": known, "refused": str(refused).replace(folder, "")}
        if (more := _leak(truth, _leak_points(found).get("C_leak_error"))) is not None:
            known["leakage"] = _short(
                1.0 + more
            )  # over the twin's at the point of which step 4 speaks, not on the mean of the tests
        named = list(dict.fromkeys(t for step in found.steps for t in step.statements)) + reading_notes(view_of(found))
        statements = {"statements": named} if defect and not any(line.failed for line in found.lines) else {}
        measured = {} if defect else {"measured": list(against(found, truth, written.campaign))}
        return {"truth": known, **_found(found), **statements, **measured}


def against(found: Validation, truth: Mapping[str, Any], campaign: Path) -> Iterator[list[Any]]:
    """Every measure with an interval whose true value is known: name, test, true, value, low, high [SI]. campaign: its
    file."""
    points = _leak_points(found)
    friction = functools.cache(lambda: friction_at(campaign, truth))
    for step in found.steps:
        for m in step.measures:
            if None in (m.value, m.low, m.high):
                continue
            if m.name == "friction_error":
                true = friction()
            elif m.name in points:
                true = _leak(truth, points[m.name])
            else:
                true = TRUE[m.name](truth, m) if m.name in TRUE else None
            if true is not None:
                yield [m.name, m.test, *(_short(x) for x in (true, m.value, m.low, m.high))]


def _crane(truth: Mapping[str, Any], name: str) -> float:
    return float(truth["crane"][name]["value"])


def _leak_points(found: Validation) -> dict[str, Point]:
    """Point of which each measure of the leakage speaks: the working point of the data."""
    out: dict[str, Point | None] = {}
    for step in found.steps:
        if step.number is StepNumber.PARAMETERS and step.estimates is not None and step.estimates.balance is not None:
            leak = step.estimates.balance.leak
            out["leakage_error"] = leak.at
        if step.number is StepNumber.DYNAMICS and step.estimates is not None:
            out["C_leak_error"] = step.estimates.leak_at
    return {name: at for name, at in out.items() if at is not None}


def _leak(truth: Mapping[str, Any], at: Point | None) -> float | None:
    """What the truth leaks more than the twin at a point, part of the twin's."""
    if at is None or at.p is None:
        return None
    own = ReferenceCrane(**{name: float(x["value"]) for name, x in truth["crane"].items()})
    return leak_over_twin(load_crane("nov-250t"), own, at) - 1.0


def leak_over_twin(crane: Crane, reference: ReferenceCrane, at: Point) -> float:
    """Flow that the truth leaks over what the twin does, both in their own forms, at a pressure difference at.p [Pa]
    over boost, a setting of the pumps [-] and a speed of the motors [rad/s]; on the mean of a swing of the oil's
    temperature."""
    assert at.p is not None
    law, low = active_leak(crane, reference), reference.boost * crane.active.boost.p
    C, high = float(gap_pump(at.alpha_p, law) + gap_motor(at.n_m, law)), low + at.p
    thin = math.sqrt(
        1.0 - (reference.oil_thin * reference.oil_swing) ** 2
    )  # the mean of 1/viscosity over a swing is 1 over this
    flow = float(leak_across(C, at.p, thin, law) + leak_to_case(C, high, thin, law))
    head = float(internal_leakage(1.0, at.p) + external_leakage(1.0, high))
    return flow / (head * leak_at(crane.active, at.alpha_p, at.n_m))


def _lever(truth: Mapping[str, Any], m: Measure) -> float | None:
    """Wire per turn over the twin's, less 1, where a test begins; None where the wire crosses to another layer within
    some turns."""
    test = next((t for t in sea_trials().tests if t.name == m.test.removeprefix("test ")), None)
    if test is None or test.kind is not Kind.AHC:
        return None
    d, gear = drum_record(load_crane("nov-250t")), _crane(truth, "gear")
    pitch, L_full = (1.0 - _crane(truth, "wire_pressed")) * d.d_wire, d.L_full - _crane(truth, "wire_short")
    own = TrueDrum(d.d, pitch, d.turns, L_full, 0.0, 0.0, 0.0, 1.0)
    w = wound(own.L_full - test.s_w, own)
    if min(w.turn, own.turns - w.turn) < NEAR:
        return None
    return float(w.d / layer_diameter(layers_filled(d.L_full - test.s_w, d), d)) / gear - 1.0


def _cell(truth: Mapping[str, Any], m: Measure) -> float | None:
    """What the load cell shows too much of the winch load of a test."""
    test = next((t for t in sea_trials().tests if t.name == m.test.removeprefix("test ")), None)
    if test is None or test.kind is not Kind.AHC:
        return None
    crane, water = load_crane("nov-250t"), test.water
    W = (test.load + crane.hook_mass - (0.0 if water is None else 1025.0 * water.volume)) * G
    return _crane(truth, "cell_gain") - 1.0 + _crane(truth, "cell_zero") / W


NEAR = 1.0
"""Turns from the end of a layer within which wire per turn has no one value."""
TRUE: Mapping[str, Callable[[Mapping[str, Any], Measure], float | None]] = {
    "clock_error": lambda t, _: float(t["log"]["clock_drift"]),
    "tip_delay_error": lambda t, _: float(t["log"]["delay"]) - STATED_DELAY,
    "motor_offset_error": lambda t, _: _crane(t, "motor_offset"),
    "pump_gain_error": lambda *_: 0.0,
    "lever_error": _lever,
    "load_cell_error": _cell,
    "precharge_error": lambda t, _: _crane(t, "precharge") - 1.0,
    "gas_volume_error": lambda t, _: _crane(t, "gas_volume") - 1.0,
    "passive_motors_error": lambda t, _: _crane(t, "passive") - 1.0,
}
"""Measures whose true value follows from the truth. That of gas is what the truth has on the mean of a crane's tests,
by a law of another form than the twin's; that of the leakage is `_leak`; that of friction is the true law at the loads
and speeds of the campaign (`friction_at`). The pumps of the truth follow their command with a gain of 1; what the log
shows beside it is
the gain
of its sensor."""


def friction_at(file: Path, truth: Mapping[str, Any]) -> float | None:
    """The true friction over the twin's, less 1, as the measure forms it: at the moments of each test with heave
    compensation, and the mean over these tests. The oil's temperature is taken as nominal."""
    campaign = load_campaign(file)
    made = reference_friction(
        campaign.crane, ReferenceCrane(**{name: x["value"] for name, x in truth["crane"].items()})
    ).friction

    def law(part: LogPart, s: States) -> FloatArray:
        a, b = part.crane.active.motor, part.crane.passive
        assert b is not None
        T_hyd = np.abs(a.D_total * s.alpha_m * s.dp) + np.abs(b.motor.D_total * s.passive[0] * s.passive[1])
        side, start = np.sign(s.omega), np.exp(-((s.omega * made.i_omega_s) ** 2))
        coulomb = (made.level + made.load * s.T_w + made.motors * T_hyd) * (1.0 + made.uneven * side)
        w = np.abs(s.omega)
        return np.asarray(
            coulomb + (made.start + made.start_load * s.T_w) * start + made.viscous * w + made.turbulent * w * w
        )

    parts = parts_of(campaign, [r for r in read_records(campaign, lambda share: None) if r.test.kind is Kind.AHC])
    each = [scale_of_law(mine, law) for mine in by_test(parts).values()]
    known = [x for x in each if x is not None]
    return float(np.mean(known)) if known else None


def _found(found: Validation) -> dict[str, Any]:
    measures = {line.key: line.measure for line in found.lines if line.key in FIGURES}
    figures = {key: [_short(x) for x in (m.value, m.low, m.high)] for key, m in measures.items() if m is not None}
    whole = {s.number for s in found.steps}
    tuned = found.step(StepNumber.DYNAMICS).data.get("tuned", {}) if StepNumber.DYNAMICS in whole else {}
    short = {
        name: [_short(t[n]) for n in ("factor", "low", "high")]
        for name, t in tuned.items()
        if t.get("factor") is not None
    }
    no = {line.key: line.message for line in found.lines if line.failed}
    refuted = [line.key for line in found.lines if line.failed and line.verdict is Verdict.REFUTED]
    return {"passed": not no, "no": no, "refuted": refuted, "figures": figures, "tuned": short}


def _short(x: float | None) -> float | None:
    return None if x is None else float(f"{x:.{DIGITS}g}")


def kept() -> dict[str, Any]:
    """Outcomes by key of the trial, each with the code that it was computed by."""
    return store.read(STORE)


def code() -> str:
    """State of the code that the trials rest on."""
    return store.judging_code()


def group(key: str) -> str:
    """What a trial may be named by: its defect, "none" or "apart"."""
    return key.rpartition("-")[0].partition("@")[0]


if __name__ == "__main__":
    store.run(STORE, {t.key: t for t in trials()}, outcome, code(), sys.argv[1:], group)
