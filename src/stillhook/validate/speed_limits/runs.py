"""Parts with saturated pumps, and the twin on them: driven by measured commands, and complete on measured motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.spec.scenario import Commands, Operator
from stillhook.validate.ahc.replay import Replay, replay, run_twin
from stillhook.validate.controller.inputs import PlcSegment, derivative, plc_segments
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.records.record import FULL, Record, Segment, ends_of, stretches_of
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
NAMES = ("v_w", "u_p", "u_raw", "alpha_p", "alpha_m")


@dataclass(frozen=True)
class SaturatedPart:
    """A part of a record with its limits. t (n,) [s] of the record; v_w measured wire speed [m/s], hoisting positive;
    signals measured (n,); ends: level that the pump command, and the pumps' setting, stop at; saturated (n,): one of
    them is at its end; driven, complete: series of the twin (n,), NaN where it was not run; twin_saturated (n,): the
    same of the complete twin, None where it could not be run.
    """

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
    notes: tuple[str, ...]

    @property
    def name(self) -> str:
        return self.segment.test

    @property
    def step(self) -> float:
        return self.record.step

    def spans(self) -> list[tuple[int, int]]:
        """Samples [a, b) of the saturated stretches, short gaps bridged."""
        return stretches_of(self.saturated, bridge=round(BRIDGE / self.step))


def saturated_parts(campaign: Campaign, record: Record) -> list[SaturatedPart]:
    """The parts of a record that are saturated, or near enough for the twin to be.

    A test of kind limits is looked at in all its parts; one with heave compensation where its commands come near to
    their end. Errors: SimulationError where the twin loses its numbers.
    """
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
    out = {name: np.full(n, np.nan) for name in NAMES}
    if not (record.has(motor_command(record)) and saturated.any()):
        return out
    margin, tail = round(LEAD / record.step), round(TAIL / record.step)
    spans = [(max(0, a - margin), min(n, b + tail)) for a, b in stretches_of(saturated, bridge=margin + tail)]
    runs = [_commanded(campaign, s, part, a, b) for a, b in spans]
    for (a, _), run, series in zip(spans, runs, run_twin([campaign.crane] * len(runs), runs, NAMES), strict=True):
        moving = abs(float(record.signals["u_p"][part.first + a])) > REST
        skip = round(MEET / record.step) if moving else 0
        for name in NAMES:
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
    commands = Commands(t, np.clip(x["u_p"][cut], -1.0, 1.0), np.clip(x[motor_command(s.record)][cut], 0.0, 1.0))
    run = replay(campaign, _filled(s.record), inside)
    return replace(run, case=run.case.model_copy(update={"commands": commands, "warm_up": 0.0}), skipped=0)


def _filled(record: Record) -> Record:
    """A record that can be repeated: a tip that was not logged does not move, and a joystick that was not logged
    requests the speed that the wire has, for the passive pumps make up for it."""
    x = record.signals
    more = {} if record.has("s_tip") else {"s_tip": np.zeros(len(record.t))}
    if not record.has("v_op") and all(not part.mode.compensates for part in record.segments):
        more["v_op"] = -derivative(np.interp(record.t, record.t[k := np.isfinite(x["s_w"])], x["s_w"][k]), record.step)
    return replace(record, signals={**x, **more}) if more else record


def _complete(campaign: Campaign, s: PlcSegment, part: Segment) -> tuple[dict[str, FloatArray] | None, tuple[str, ...]]:
    """The complete twin with its PLC on the measured tip motion and joystick, and why it could not be run."""
    record = s.record
    if not record.has("s_tip") or (not part.mode.compensates and not record.has("v_op")):
        lack = "v_op" if record.has("s_tip") else "s_tip"
        return None, (f"test {part.test}: {lack} was not logged, so the complete twin cannot be run on it",)
    run = replay(campaign, record, part)
    if not part.mode.compensates:
        run = _by_joystick(run, s)
    [series] = run_twin([campaign.crane], [run], NAMES)
    n, a, b = part.last - part.first, run.first - part.first, run.last - part.first
    out = {name: np.full(n, np.nan) for name in NAMES}
    for name in NAMES:
        out[name][a:b] = series[name]
    return out, ()


def _by_joystick(run: Replay, s: PlcSegment) -> Replay:
    """A replay in manual mode: with the displacement that the operator holds, and counted from the start where the
    winch rests."""
    alpha_m = s.plc.motors.alpha_hold
    operator = Operator.model_construct(
        profile=run.case.operator.profile, steps=(), alpha_m=alpha_m if alpha_m > 0.0 else None
    )
    at_rest = abs(float(s.seen.v_op[run.segment.first - s.first])) < REST
    case = run.case.model_copy(update={"operator": operator, "warm_up": 0.0})
    return replace(run, case=case, skipped=0 if at_rest else round(SETTLE / run.record.step))
