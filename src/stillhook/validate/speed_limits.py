"""Step 3: the winch's velocity limits. Speeds of crane and twin with saturated pumps.

Source: Moslatt 2020 paper F, verification element 3 and criterion 4 ("pump saturation should be tested and evaluated").
Two runs of the twin: its winch driven by the measured commands (pumps, motors, gear, layers, leakage), and the complete
twin on the measured tip motion and joystick (the PLC's limits as well).

Parts with saturated pumps, and the twin on them: driven by measured commands, and complete on measured motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.base.progress import Progress
from stillhook.report.document import Table
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Commands, Operator
from stillhook.statistics.blocks import interval
from stillhook.units import number, show
from stillhook.validate.ahc.replay import Replay, replay, run_twin
from stillhook.validate.controller.inputs import PlcSegment, derivative, plc_segments
from stillhook.validate.criteria.results import Measure, Note, Step, StepNumber, has
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.record import FLAT, FULL, Record, Segment, ends_of, stretches_of
from stillhook.validate.dynamics.runs import motor_command

NEAR_LIMIT = 0.85
"""Command from which a part with heave compensation is examined: small differences may decide on saturation."""
LEAD = 10.0
"""Time that the driven twin runs before a saturated stretch [s]: the slowest of what sets the speed, the motors' servo,
takes 1 s."""
TAIL = 2.0
BRIDGE = 0.1
"""Saturated spans closer than this are joined [s]: noise lifts a command from its limit for a few cycles."""
SETTLE = 5.0
"""Start of a part that the complete twin takes to meet a crane in motion [s], where its joystick does not start at
rest."""
MEET = 4.0
"""Start of the driven twin that does not count [s], where the crane is in motion: four times what its motors' servo
takes."""
REST = 0.02  # m/s, and share of the full command: joystick or pump command below which the winch starts at rest
NAMES = ("v_w", "u_p", "u_raw")
SETTINGS = ("alpha_p", "alpha_m")
"""Signals of the twin that are compared, and settings of those winches that have them."""


@dataclass(frozen=True)
class SaturatedPart:
    """A part of a record. t (n,) [s] of the record; v_w measured [m/s], hoisting positive; ends: level that pump
    command, and setting, stop at; saturated (n,): one of them is there; driven, complete: series of the twin (n,), NaN
    where not run; twin_saturated (n,): of the complete twin."""

    record: Record
    segment: Segment
    t: FloatArray
    v_w: FloatArray
    signals: Mapping[str, FloatArray]
    ends: Mapping[str, float]
    saturated: BoolArray
    driven: Mapping[str, FloatArray]
    complete: Mapping[str, FloatArray] | None
    twin_saturated: BoolArray | None
    notes: tuple[Note, ...]

    @property
    def name(self) -> str:
        return self.segment.test

    @property
    def step(self) -> float:
        return self.record.step

    def spans(self) -> list[tuple[int, int]]:
        """Samples [a, b) of the saturated stretches, short gaps bridged."""
        return stretches_of(self.saturated, bridge=round(BRIDGE / self.step))


def names_of(crane: Crane) -> tuple[str, ...]:
    """Signals of the twin that are compared."""
    return (*NAMES, *(name for name in SETTINGS if name in has(crane)))


def driven_by(crane: Crane, record: Record) -> tuple[str, ...]:
    """Signals that command the winch: of a circuit also the setting of its motors."""
    return ("u_p", motor_command(record)) if "active" in crane.circuits else ("u_p",)


def saturated_parts(campaign: Campaign, record: Record) -> list[SaturatedPart]:
    """The parts of a record that are saturated, or near enough for the twin to be: all of a test of kind limits; of
    heave compensation where commands come near their end. Errors: SimulationError where the twin loses its numbers."""
    if not record.has("u_p", "s_w"):
        return []
    result = []
    for s in plc_segments(campaign.crane, record, blind=True):
        commands = s.simulated_commands(campaign.crane).u_raw
        for part in s.parts:
            at = s.within(part)
            requested = s.u_p[at] if not part.mode.compensates and not record.has("v_op") else commands[at]
            top = max(float(np.abs(s.u_p[at]).max()), float(np.abs(requested).max()))
            if record.test.kind is Kind.LIMITS or top > NEAR_LIMIT:
                result.append(_saturated_part(campaign, s, part, requested))
    return result


def _saturated_part(campaign: Campaign, s: PlcSegment, part: Segment, requested: FloatArray) -> SaturatedPart:
    record = s.record
    cut = slice(part.first, part.last)
    signals = {n: record.signals[n][cut] for n in ("u_p", "alpha_p", "u_m", "alpha_m", "v_op") if record.has(n)}
    v_w = -derivative(record.signals["s_w"][cut], record.step)
    ends, saturated = _ends(signals, requested, record.step)
    driven = _driven(campaign, s, part, saturated)
    complete, notes = _complete(campaign, s, part)
    twin = np.abs(complete["u_raw"]) >= FULL if complete is not None else None
    return SaturatedPart(record, part, record.t[cut], v_w, signals, ends, saturated, driven, complete, twin, notes)


def _ends(signals: Mapping[str, FloatArray], requested: FloatArray, step: float) -> tuple[dict[str, float], BoolArray]:
    """Level at which pump command and setting stop, and where one of them does; the command requests the setting."""
    ends, saturated = {}, np.zeros(len(requested), dtype=bool)
    for name, wish in (("u_p", requested), ("alpha_p", signals["u_p"])):
        if name in signals and np.isfinite(signals[name]).all():
            lo, hi = ends_of(signals[name], wish, step)
            ends[name] = min(-lo, hi)
            saturated |= (signals[name] <= lo) | (signals[name] >= hi)
    return ends, saturated


def _driven(campaign: Campaign, s: PlcSegment, part: Segment, saturated: BoolArray) -> dict[str, FloatArray]:
    """The twin's winch on the measured commands, about every saturated stretch; NaN elsewhere."""
    record, n = s.record, part.last - part.first
    names = names_of(campaign.crane)
    out = {name: np.full(n, np.nan) for name in names}
    if not (record.has(*driven_by(campaign.crane, record)) and saturated.any()):
        return out
    margin, tail = round(LEAD / record.step), round(TAIL / record.step)
    spans = [(max(0, a - margin), min(n, b + tail)) for a, b in stretches_of(saturated, bridge=margin + tail)]
    runs = [_commanded(campaign, s, part, a, b) for a, b in spans]
    for (a, _), run, series in zip(spans, runs, run_twin([campaign.crane] * len(runs), runs, names), strict=True):
        moving = abs(float(record.signals["u_p"][part.first + a])) > REST
        skip = round(MEET / record.step) if moving else 0
        for name in names:
            out[name][a + skip : a + len(run.t)] = series[name][skip:]
    return out


def _commanded(campaign: Campaign, s: PlcSegment, part: Segment, a: int, b: int) -> Replay:
    """Samples [a, b) of a part, with the logged commands in place of the PLC's."""
    cut = slice(part.first + a, part.first + b)
    x = s.record.signals
    inside = replace(
        part, first=cut.start, last=cut.stop, start=float(s.record.t[cut.start]), s_w=float(x["s_w"][cut.start])
    )
    t = s.record.t[cut] - s.record.t[cut.start]
    u_p, *settings = driven_by(campaign.crane, s.record)
    u_m = np.clip(x[settings[0]][cut], 0.0, 1.0) if settings else np.ones(b - a)
    commands = Commands(t, np.clip(x[u_p][cut], -1.0, 1.0), u_m)
    run = replay(campaign, _filled(s.record), inside)
    return replace(run, case=run.case.model_copy(update={"commands": commands, "warm_up": 0.0}), skipped=0)


def _filled(record: Record) -> Record:
    """A record that can be repeated: a tip that was not logged does not move, and a joystick that was not logged
    requests the speed that the wire has."""
    x = record.signals
    more = {} if record.has("s_tip") else {"s_tip": np.zeros(len(record.t))}
    if not record.has("v_op") and all(not part.mode.compensates for part in record.segments):
        more["v_op"] = -derivative(np.interp(record.t, record.t[k := np.isfinite(x["s_w"])], x["s_w"][k]), record.step)
    return replace(record, signals={**x, **more}) if more else record


def _complete(
    campaign: Campaign, s: PlcSegment, part: Segment
) -> tuple[dict[str, FloatArray] | None, tuple[Note, ...]]:
    """The complete twin with its PLC on the measured tip motion and joystick, and why it could not be run."""
    record = s.record
    if not record.has("s_tip") or (not part.mode.compensates and not record.has("v_op")):
        lack = "v_op" if record.has("s_tip") else "s_tip"
        return None, (Note("no-complete-twin", test=part.test, signal=lack),)
    run = replay(campaign, record, part)
    if not part.mode.compensates:
        run = _by_joystick(run, s)
    names = names_of(campaign.crane)
    [series] = run_twin([campaign.crane], [run], names)
    n, a, b = part.last - part.first, run.first - part.first, run.last - part.first
    out = {name: np.full(n, np.nan) for name in names}
    for name in names:
        out[name][a:b] = series[name]
    return out, ()


def _by_joystick(run: Replay, s: PlcSegment) -> Replay:
    """A replay in manual mode: with the displacement that the operator holds, counted from where the winch rests."""
    alpha_m = s.plc.motors.alpha_hold
    operator = Operator.model_construct(
        profile=run.case.operator.profile, steps=(), alpha_m=alpha_m if alpha_m > 0.0 else None
    )
    at_rest = abs(float(s.seen.v_op[run.segment.first - s.first])) < REST
    case = run.case.model_copy(update={"operator": operator, "warm_up": 0.0})
    return replace(run, case=case, skipped=0 if at_rest else round(SETTLE / run.record.step))


SETTLED = 0.3
"""Start of a saturated span that is not compared [s]: swash plates and pressures still move."""
LEAST = 0.2
"""Shortest remainder that is compared [s]."""
ROW = 2.0  # s of the pieces that the interval is drawn from: longer than anything rings at a plateau
NOTABLE = 0.08  # speed error from which causes are reported
NEAR = 0.95  # of the end: a command within 5 % of it misses it by a difference in feedback alone
APART = 0.02  # of full displacement by which the motors must differ to be named
WAYS = {1: "hoisting", -1: "lowering"}


@dataclass(frozen=True)
class Plateau:
    """A saturated span: samples [first, last) of its part that are compared; way 1 hoisting, -1 lowering; mean wire
    speed measured, of the driven and the complete twin [m/s], NaN where not run."""

    test: str
    start: float
    duration: float
    part: SaturatedPart
    first: int
    last: int
    way: int
    v_w: float
    driven: float
    complete: float


@dataclass(frozen=True)
class Times:
    """Time that the pumps are at their end [s]: in the log, all of it; over what the complete twin could be run on: in
    log and twin each, in either, and in one while the other is not even near its end."""

    log_all: float
    log: float
    twin: float
    either: float
    log_alone: float
    twin_alone: float

    @property
    def overlap(self) -> float | None:
        """Share of the time at an end of either in which the other is there too, or near; None where neither is."""
        return 1.0 - (self.log_alone + self.twin_alone) / self.either if self.either > 0.0 else None


@dataclass(frozen=True)
class SpeedLimits:
    """Estimates of step 3."""

    parts: tuple[SaturatedPart, ...]
    plateaus: tuple[Plateau, ...]
    times: Times


def check_limits(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[SpeedLimits]:
    """Step 3 of the validation."""
    parts: list[SaturatedPart] = []
    for i, record in enumerate(records):
        parts += saturated_parts(campaign, record)
        progress((i + 1) / len(records))
    plateaus = [p for part in parts for p in plateaus_of(part)]
    times, words = times_of(parts), machines_of(campaign.crane)
    causes = _causes(parts, plateaus, times, words)
    ways = {p.way for p in plateaus} if times.log_all > 0.0 else WAYS
    statements = (
        *(Note("deviation", cause=cause) for cause in dict.fromkeys(x for notes in causes.values() for x in notes)),
        *(Note("way-not-shown", way=name) for way, name in WAYS.items() if way not in ways),
        *(note for p in parts for note in p.notes),
    )
    estimates = SpeedLimits(tuple(parts), tuple(plateaus), times)
    results = _measures(plateaus, times, causes, words)
    data = {"times": times, "plateaus": plateaus}
    return Step(StepNumber.LIMITS, results, statements, (_table(plateaus, words["machines"]),), data, estimates)


def machines_of(crane: Crane) -> dict[str, str]:
    """Machines that a command goes to: pumps, or the drives of a winch without a closed circuit."""
    if "active" in crane.circuits:
        return {"machines": "pumps", "command": "pump"}
    return {"machines": "drives", "command": "speed"}


def plateaus_of(part: SaturatedPart) -> list[Plateau]:
    """The saturated spans of a part that are long enough to compare speeds."""
    skip, least, result = round(SETTLED / part.step), max(1, round(LEAST / part.step)), []
    for a, b in part.spans():
        if b - a - skip < least:
            continue
        cut = slice(a + skip, b)
        v_w = float(part.v_w[cut].mean())
        driven = float(part.driven["v_w"][cut].mean())
        complete = float(part.complete["v_w"][cut].mean()) if part.complete is not None else np.nan
        way, start, duration = 1 if v_w > 0.0 else -1, float(part.t[a + skip]), (b - a - skip) * part.step
        result.append(Plateau(part.name, start, duration, part, a + skip, b, way, v_w, driven, complete))
    return result


def times_of(parts: Sequence[SaturatedPart]) -> Times:
    """Saturation times of the pumps, in log and twin."""
    sums = np.zeros(6)
    for p in parts:
        sums[0] += float(p.saturated.sum()) * p.step
        if p.complete is None or p.twin_saturated is None:
            continue
        requested = np.abs(p.complete["u_raw"])
        log, twin = p.saturated & np.isfinite(requested), p.twin_saturated
        apart = log & (requested < NEAR), twin & ~log & (np.abs(p.signals["u_p"]) < NEAR * p.ends["u_p"])
        sums[1:] += [float(x.sum()) * p.step for x in (log, twin, log | twin, *apart)]
    return Times(*sums.tolist())


Causes = Mapping[str, Sequence[Note]]


def _measures(
    plateaus: Sequence[Plateau], times: Times, causes: Causes, words: Mapping[str, str]
) -> tuple[Measure, ...]:
    nowhere = [Note("never-saturated", **words)] if times.log_all == 0.0 else []
    twin = [Note("twin-saturated", seconds=times.twin)] if nowhere and times.twin > 0.0 else []
    notes = [*nowhere, *twin] or causes.get("ends", ())
    out = [Measure.of("saturation_time", None if nowhere else times.log_all, *notes)]
    for name, run in (("limit_speed_error", "driven"), ("limit_speed_error_whole", "complete")):
        result = [m for way in WAYS if (m := _speed(name, run, way, plateaus, causes))]
        out += result or [Measure.of(name, None, *(nowhere or [Note(f"lacks-{run}", **words)]))]
    overlap, each = times.overlap, f"log {times.log:.1f} s, twin {times.twin:.1f} s"
    notes = causes.get("overlap") or ([Note("neither-saturated", **words)] if overlap is None else [])
    return (*out, Measure.of("saturation_overlap", overlap, *notes, data=each))


def _speed(name: str, run: str, way: int, plateaus: Sequence[Plateau], causes: Causes) -> Measure | None:
    """The speed error of one direction over all its plateaus, each weighing as long as it lasts."""
    same = [p for p in _known(plateaus, run) if p.way == way]
    if not same:
        return None
    rows = np.concatenate([_rows(p, run) for p in same])
    result = interval(lambda x: float(x[:, 1].sum() / x[:, 0].sum() - 1.0), [rows])
    plural, seconds = "s" if len(same) > 1 else "", sum(p.duration for p in same)
    data = f"{len(same)} plateau{plural}, {seconds:.1f} s, {show(_mean(same), 'speed')}"
    notes = causes.get(run, ()) if abs(result.value) > NOTABLE else ()
    return Measure.of(name, result, *notes, test=WAYS[way], data=data)


def _rows(p: Plateau, run: str) -> FloatArray:
    """Wire that ran in pieces of about ROW, measured and simulated: sums of the speeds."""
    series = p.part.driven if run == "driven" else p.part.complete
    assert series is not None
    x = np.column_stack([p.part.v_w, series["v_w"]])[p.first : p.last]
    pieces = np.array_split(x, max(1, round(len(x) * p.part.step / ROW)))
    return np.stack([piece.sum(axis=0) for piece in pieces])


def _mean(plateaus: Sequence[Plateau]) -> float:
    return float(np.average([p.v_w for p in plateaus], weights=[p.duration for p in plateaus]))


def _known(plateaus: Sequence[Plateau], run: str) -> list[Plateau]:
    """The plateaus on which a twin was run."""
    return [p for p in plateaus if np.isfinite(getattr(p, run))]


def _error(plateaus: Sequence[Plateau], run: str) -> float:
    """Speed error over all plateaus of both ways."""
    estimate = _known(plateaus, run)
    if not estimate:
        return 0.0
    w = np.array([p.duration for p in estimate])
    simulated, measured = (np.array([abs(getattr(p, name)) for p in estimate]) for name in (run, "v_w"))
    return float(w @ simulated / (w @ measured) - 1.0)


def _causes(
    parts: Sequence[SaturatedPart], plateaus: Sequence[Plateau], times: Times, words: Mapping[str, str]
) -> dict[str, list[Note]]:
    """What is off: "ends" (the log stops below full command), "driven", "complete", "overlap"."""
    out: dict[str, list[Note]] = {}
    for p in parts:
        for name in ("u_p", "alpha_p"):
            if p.ends.get(name, FULL) < FULL and "ends" not in out:
                out["ends"] = [Note(f"ends-{name}", test=p.name, end=p.ends[name] + FLAT, **words)]
    driven, complete = _error(plateaus, "driven"), _error(plateaus, "complete")
    if abs(driven) > NOTABLE:
        stop = out.get("ends", []) if any(p.ends.get("alpha_p", FULL) < FULL for p in parts) else []
        out["driven"] = stop or _motors(plateaus) or [Note("faster", error=driven, **words)]
    if abs(complete) > NOTABLE:
        other = [Note("faster", error=complete, **words), Note("other-motion")]
        out["complete"] = out.get("ends") or out.get("driven") or other
    if times.log_alone + times.twin_alone > 0.1 * times.either:
        one, other_ = ("log", "twin") if times.log_alone > times.twin_alone else ("twin", "log")
        alone = max(times.log_alone, times.twin_alone)
        out["overlap"] = [Note("one-alone", one=one, other=other_, alone=alone, **words)]
    return out


def _motors(plateaus: Sequence[Plateau]) -> list[Note]:
    """Whether the motors have another displacement at the plateaus than the twin's."""
    for p in plateaus:
        log = p.part.signals.get("alpha_m")
        if log is None or "alpha_m" not in p.part.driven:
            continue
        a, b = float(log[p.first : p.last].mean()), float(p.part.driven["alpha_m"][p.first : p.last].mean())
        if abs(a - b) > APART:
            return [Note("motors-displaced", test=p.test, start=p.start, log=a, twin=b)]
    return []


def _table(plateaus: Sequence[Plateau], machines: str) -> Table:
    rows = []
    for p in plateaus:
        shares = [round(100.0 * (x / p.v_w - 1.0), 1) + 0.0 for x in (p.driven, p.complete)]
        errors = (f"{x:+.1f}" if np.isfinite(x) else "-" for x in shares)
        rows.append((p.test, f"{p.start:.1f}", f"{p.duration:.1f}", WAYS[p.way], number(60.0 * p.v_w, 4), *errors))
    header = ("test", "from\n[s]", "for\n[s]", "", "wire speed\n[m/min]", "driven\ntwin [%]", "complete\ntwin [%]")
    return Table(header, tuple(rows), f"Wire speed with saturated {machines}, and deviation of the twin")
