"""Signals stamped by another clock, aligned with the PLC's view of them; and units of wire, tip and error.

`read_log` aligns another clock to some hundredths of a second. Here a motion recorded by both clocks is compared to
a fraction of a sample: the PLC's own view of the tip (its error and wire out make it), else the feedforward in its pump
command. A delay of the motion signal to the PLC cannot be distinguished from an offset of the clock, so tip signals are
aligned with the PLC's view.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record, plc_record
from stillhook.errors import ValidateError
from stillhook.logs.types import Log, OtherClock
from stillhook.physics.load_path.drum import K_wire, layer_diameter, layers_filled
from stillhook.spec.crane import Crane
from stillhook.statistics.time_lag import SPAN, changes, lag, shifted
from stillhook.validate.criteria.notes import Note
from stillhook.validate.data_set.campaign import CraneTest
from stillhook.validate.data_set.record import ClockError, Segment

REACH = 1.0
"""Largest lag considered after the first alignment [s]."""
LEAST_DISPLACEMENT = 0.1
"""Least displacement of the motors over their maximum that counts as a measurement [-]."""
FEEDFORWARD = 0.01
"""Standard uncertainty of a lag from the pump command [s]: includes filters of the motion signal and servo settings
(assumed)."""
ROUNDS = 3
"""Rounds of removing the feedback from the pump command with the tip as aligned in the previous round: each leaves a
fifth of the error."""


MOST_GAIN = 5.0
"""Largest ratio of the wire's motion to the tip's: a winch at its limits has less than 1, a wrong unit 1000."""
ALIKE = 0.2
"""Part by which the PLC's error may differ from tip height less wire out: noise and a delay of some cycles make less,
another unit ten."""
ONE_THING = 0.95
"""Correlation above which both show the same motion."""


@dataclass(frozen=True)
class View:
    """One motion recorded by the main clock and by the other: x, y (n,); expected lag of y behind x without clock
    errors [s] and its standard uncertainty u [s]; description of x."""

    x: FloatArray
    y: FloatArray
    expected: float
    u: float
    description: str


def refined(
    t: FloatArray, step: float, signals: Mapping[str, FloatArray], log: Log, crane: Crane, name: str
) -> tuple[dict[str, FloatArray], tuple[ClockError, ...], list[Note]]:
    """Signals with those of other clocks shifted to agree with the main clock; the corrections; statements."""
    out, errors, statements = dict(signals), [], list[Note]()
    for clock in log.clocks:
        estimate, view, moved = None, None, out
        of = {"test": name, "signals": clock.signals}
        for _ in range(ROUNDS):
            view = _view(clock, moved, out, crane)
            estimate = lag(t, view.x, view.y, REACH) if view is not None else None
            if view is None or estimate is None:
                break
            estimate = replace(estimate, seconds=estimate.seconds - view.expected)
            moved = out | {signal: shifted(t, out[signal], estimate.at(t), 2.0 * step) for signal in clock.signals}
            if not view.u:
                break
        if view is None or estimate is None:
            errors.append(ClockError(clock.signals, "", clock.offset, clock.drift, clock.scatter, np.inf))
            statements.append(Note("clock-roughly", drift=_ppm(clock.drift), **of))
            continue
        out = moved
        drift = (1.0 + clock.drift) * (1.0 - estimate.drift) - 1.0
        u = float(np.hypot(estimate.u, view.u))
        offset = clock.offset - float(estimate.at(np.zeros(1))[0])
        errors.append(ClockError(clock.signals, view.description, offset, float(drift), u, estimate.u_drift))
        ends = {"u_drift": 2e6 * estimate.u_drift, "u": 2e3 * u}
        statements.append(Note("clock-aligned", drift=_ppm(drift), by=view.description, **ends, **of))
    return out, tuple(errors), statements


def _ppm(drift: float) -> str:
    return f"{abs(1e6 * drift):.{0 if abs(drift) > 1e-5 else 1}f} ppm {'slow' if drift > 0.0 else 'fast'}"


MADE = (
    ("s_tip", "e_c_measured", "s_w", 1.0, "the error of the PLC and wire out"),
    ("s_w", "s_tip", "e_c_measured", -1.0, "tip height and the error of the PLC"),
    ("e_c_measured", "s_tip", "s_w", -1.0, "tip height and wire out"),
)
"""Each signal as a sum of another one and a third with this sign, apart from a constant; the two in words."""


def _view(
    clock: OtherClock, moved: Mapping[str, FloatArray], signals: Mapping[str, FloatArray], crane: Crane
) -> View | None:
    """The best motion recorded by both clocks. moved: the signals as aligned in the previous round."""
    theirs = set(clock.signals)
    ours = set(signals) - theirs
    for one, other, third, sign, description in MADE:
        made = {other, third}
        if one in theirs and made <= ours:
            return View(signals[other] + sign * signals[third], signals[one], 0.0, 0.0, description)
        if one in ours and made <= theirs:
            return View(signals[one], signals[other] + sign * signals[third], 0.0, 0.0, description)
    return _feedforward(moved, signals, ours, theirs, crane)


def _feedforward(
    moved: Mapping[str, FloatArray], signals: Mapping[str, FloatArray], ours: set[str], theirs: set[str], crane: Crane
) -> View | None:
    """The tip's speed in the pump command: -(K_1 v + K_2 a) K_wire alpha_m is the speed K_2/K_1 (and t_lead) later."""
    motor = next((n for n in ("alpha_m", "u_m") if n in ours), None)
    if motor is None or "s_tip" not in theirs or not {"u_p", "s_w"} <= ours:
        return None
    plc, drum = plc_record(crane), drum_record(crane)
    d = float(layer_diameter(layers_filled(drum.L_full - float(np.nanmedian(signals["s_w"])), drum), drum))
    e_c = moved["s_tip"] - moved["s_w"]
    u_ff = signals["u_p"] + plc.gains.K_p * (e_c - np.nanmean(e_c))
    made = -u_ff / (plc.gains.K_1 * float(K_wire(d, drum)) * np.maximum(signals[motor], LEAST_DISPLACEMENT))
    v_tip = signals["v_tip"] if "v_tip" in theirs else np.gradient(signals["s_tip"], crane.control.t_cycle)
    return View(
        made, v_tip, plc.gains.K_2 / plc.gains.K_1 + plc.t_lead, FEEDFORWARD, "the feedforward in the pump command"
    )


def check_units(
    test: CraneTest, t: FloatArray, signals: Mapping[str, FloatArray], segments: Sequence[Segment], step: float
) -> None:
    """Errors: ValidateError where wire and tip, or the PLC's error, are not in one unit in a compensated segment."""
    made = {"s_w": signals["s_w"]}
    if "e_c_measured" in signals:
        made["e_c_measured + s_w"] = signals["e_c_measured"] + signals["s_w"]
    for part in segments:
        cut = slice(part.first, part.last)
        for late, y in made.items():
            found = lag(t[cut], signals["s_tip"][cut], y[cut], REACH)
            if found is not None and not 1.0 / MOST_GAIN < found.gain < MOST_GAIN:
                names = late.split(" + ")
                raise ValidateError(Note("wire-unit", test=test.name, late=late, gain=found.gain, names=names))
        if len(made) > 1 and found is not None and abs((size := _size(part, step, signals)) - 1.0) > ALIKE:
            raise ValidateError(Note("error-unit", test=test.name, size=size))


def _size(part: Segment, step: float, signals: Mapping[str, FloatArray]) -> float:
    """The PLC's error over tip less wire, where both clearly show the same motion; 1 where they do not."""
    cut, span = slice(part.first, part.last), max(1, round(SPAN / step))
    error = changes(signals["e_c_measured"][cut], span)
    made = changes(signals["s_tip"][cut] - signals["s_w"][cut], span)
    ok = np.isfinite(error) & np.isfinite(made)
    x, y = error[ok], made[ok]
    both = float(np.sqrt(np.sum(x * x) * np.sum(y * y)))
    return float(np.sum(x * x) / np.sum(x * y)) if both and np.sum(x * y) > ONE_THING * both else 1.0
