"""How far the twin of a crane is validated: whether its certificate still holds, and whether a run is inside its
envelope."""

import hashlib
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook._version import __version__
from stillhook.engine.inputs import CycleInputs, MotionDemand
from stillhook.kernels.build import results_hash
from stillhook.sea.motion.motion import Motion
from stillhook.sea.motion.recorded import wave_periods, window_spans
from stillhook.spec.crane import Crane, content
from stillhook.spec.scenario import FrictionModel, Mode, Scenario
from stillhook.spec.validity import Certified, Conditions, Envelope
from stillhook.variables import WINDOW

NO_CERTIFICATE = "no certificate: the twin is not validated (level 1)"


def as_if_validated(crane: Crane, envelope: Envelope) -> Crane:
    """The crane with a SYNTHETIC certificate that no one issued, for conditions that are assumed to be validated."""
    record = Certified.of(
        digest=hashlib.sha256(envelope.model_dump_json().encode()).hexdigest(),
        date="no day",
        criteria="none",
        passed=True,
        synthetic=True,
        level=1,
        variant=1,
        version=__version__,
        code=results_hash(),
        content=content(crane),
        envelope=envelope,
    )
    return crane.model_copy(update={"certified": record.assumed()})


class Standing(NamedTuple):
    """validated: a certificate of logs of a crane holds, and the run is inside its envelope; notes: one line each,
    none where there is no certificate."""

    validated: bool
    notes: tuple[str, ...]


def standing(crane: Crane, case: Scenario, drive: CycleInputs, demand: MotionDemand) -> Standing:
    """How a run relates to the certificate of its crane; drive and demand are those of the run."""
    if crane.certified is None:
        return Standing(False, ())
    against = objections(crane)
    outside = crane.certified.outside(conditions(case, drive, demand)) if crane.certified.envelope is not None else ()
    notes = [f"certificate does not hold: {', '.join(against)}"] if against else []
    if outside:
        notes.append(f"outside the validated envelope: {', '.join(outside)}")
    if crane.certified.synthetic and not against:
        notes.append(
            f"certificate {crane.certified.short} is SYNTHETIC: the twin was validated on simulated logs, not on a"
            " crane"
        )
    return Standing(not notes, tuple(notes))


def objections(crane: Crane) -> tuple[str, ...]:
    """Why the certificate that a crane carries does not hold for it on this code; empty where it holds, or there is
    none."""
    return crane.certified.objections(content(crane), results_hash()) if crane.certified is not None else ()


def doubts(crane: Crane, case: Scenario) -> tuple[str, ...]:
    """Why the compensation that the twin computes may not be credited as that of the crane in this scenario; empty
    where it may.

    Where there is a doubt, `stillhook.spec.validity.CAP` is the most that may be credited. The scenario must have
    passed `check`. A synthetic certificate is a doubt: no crane was validated.
    """
    if crane.certified is None:
        return (NO_CERTIFICATE,)
    drive = CycleInputs(crane, case)
    return standing(crane, case, drive, drive.demand()).notes


def conditions(case: Scenario, drive: CycleInputs, demand: MotionDemand) -> Conditions:
    """What a run asks, in the terms of an envelope. The tip is that of the part that counts; in manual mode nothing
    follows it."""
    modes = tuple(dict.fromkeys(m.value for m in (case.mode, *(m for _, m in case.modes))))
    span, period = math.nan, math.nan
    if any(Mode(m).compensates for m in modes):
        span, period = _span_and_period(drive.motion, drive.n_ticks, drive.first, drive.t_cycle)
    return Conditions(
        load=case.load,
        s_w_min=demand.s_w_min,
        s_w_max=demand.s_w_max,
        s_tip_pp=span,
        period=period,
        modes=modes,
        faults=_faults(case),
    )


@lru_cache(maxsize=64)
def _span_and_period(motion: Motion, n_ticks: int, first: int, t_cycle: float) -> tuple[float, float]:
    """Largest peak-to-peak over the window [m] and mean period [s] of a motion from cycle `first` to the last one;
    remembered, because many cranes are drawn on one motion."""
    s = motion.sample(np.arange(first, n_ticks + 1) * t_cycle)[0]
    return float(window_spans(s, round(WINDOW / t_cycle) + 1).max()), _period(s, t_cycle)


def _period(s: NDArray[np.float64], dt: float) -> float:
    """Mean period of a motion [s]: of its whole waves; where it has none, by its deviation over that of its speed, as
    of a narrow spectrum. NaN for a tip at rest."""
    periods = wave_periods(s, dt)
    if len(periods):
        return float(periods.mean())
    return (
        float(2.0 * math.pi * s.std() / v.std()) if len(s) > 1 and (v := np.gradient(s, dt)).std() > 0.0 else math.nan
    )


def _faults(case: Scenario) -> tuple[str, ...]:
    """What no validation test has."""
    faults = [
        ("loss of a hydraulic power unit", case.power_loss is not None),
        ("accumulator without end", case.gas_held),
    ]
    faults.append(("regularised friction", case.friction is FrictionModel.REGULARISED))
    return tuple(name for name, present in faults if present)


def envelope_line(crane: Crane) -> str:
    """For what the twin of a crane is validated, in one line; empty where it is not."""
    c = crane.certified
    if c is None or c.envelope is None or objections(crane):
        return ""
    return f"validated for: {', '.join(f'{name} {text}' for name, text in c.envelope.says().items())}"


def twin_line(crane: Crane) -> str:
    """How far the twin of a crane is validated, in one line."""
    c = crane.certified
    if c is None:
        return "twin: not validated (level 1: no certificate)"
    label = f"{c.mark} certificate".strip()
    if against := objections(crane):
        return f"twin: {label} {c.short} of {c.date} does not hold: {', '.join(against)}"
    by = f"{label} {c.short} of {c.date} by {c.criteria}"
    return f"twin: level {c.level}, variant {c.variant_now}: {by} holds, {c.judgement.sentence}"
