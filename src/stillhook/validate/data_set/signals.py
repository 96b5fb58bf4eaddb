"""Signals of a record: those of another clock aligned with the PLC's view of them, wire and tip as logged or derived,
and the tip's motion as one smooth curve through measured position and speed together.

`read_log` aligns another clock to some hundredths of a second. Here a motion recorded by both clocks is compared to
a fraction of a sample: the PLC's own view of the tip (its error and wire out make it), else the feedforward in its pump
command. A delay of the motion signal to the PLC cannot be distinguished from an offset of the clock, so tip signals are
aligned with the PLC's view.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record, plc_record
from stillhook.errors import ValidateError
from stillhook.logs.types import Log, OtherClock
from stillhook.physics.load_path.drum import K_wire, layer_diameter, layers_filled, wire_to_layer
from stillhook.sea.motion.recorded import FEWEST_POINTS, Recorded
from stillhook.spec.crane import Crane
from stillhook.statistics.time_lag import SPAN, changes, lag, shifted
from stillhook.validate.criteria.results import Note
from stillhook.validate.data_set.campaign import CraneTest, Kind
from stillhook.validate.data_set.record import ClockError, Segment, filled

REACH = 1.0
"""Largest lag considered after the first alignment [s]."""
LEAST_DISPLACEMENT = 0.1
"""Least displacement of the motors over their maximum that counts as a measurement [-]."""
FEEDFORWARD = 0.01
"""Standard uncertainty of a lag from the pump command [s]: includes filters of the motion signal and servo settings
(assumed)."""
FEEDBACK_ROUNDS = 3
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
    errors and its standard uncertainty u [s]; description of x."""

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
        for _ in range(FEEDBACK_ROUNDS):
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
    """The tip's speed in the pump command: -(K_1 v + K_2 a) K_wire alpha_m is the speed K_2/K_1 and t_lead_ff
    later."""
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
        made, v_tip, plc.gains.K_2 / plc.gains.K_1 + plc.t_lead_ff, FEEDFORWARD, "the feedforward in the pump command"
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


KNOTS = 0.4
"""Spacing of the curve's points [s]: waves of 2 s and longer pass with less than 0.1 % lost. Two samples where they are
slower."""
SLOWEST = 0.25
"""Longest spacing of samples that still allows a tip motion [s]: waves of 4 s pass with less than 0.1 % lost."""
ROUNDS = 3
"""Rounds of weighting position and speed by their spread, and of integrating the motors' speed with the diameter of the
last layer: wire over a few layers needs two."""


@dataclass(frozen=True)
class Tip:
    """motion: smooth, t = 0 at the first sample; noise (n,): measured position less the curve [m], NaN where not
    measured; spread_s, spread_v: rms deviation from the curve [m], [m/s], NaN without a measured speed."""

    motion: Recorded
    noise: FloatArray
    spread_s: float
    spread_v: float


def smooth_tip(t: FloatArray, s: FloatArray, v: FloatArray | None, *, place: str) -> Tip:
    """Quintic spline with a point every KNOTS seconds or so, least squares through position and speed, each weighted by
    its own spread: a speed that contradicts the position gets little weight. t (n,) [s] even; s [m], v [m/s] or None,
    NaN where missing; place names it in errors. Errors: ValidateError for too short a part."""
    from scipy.interpolate import BSpline  # heavy: only where data are at hand

    t = t - t[0]
    step = float(t[-1] / (len(t) - 1))
    count = int(t[-1] / max(KNOTS, 2.0 * step))
    grid = np.linspace(0.0, t[-1], count + 1)
    if count < 2 * FEWEST_POINTS or step > SLOWEST + 1e-9:
        raise ValidateError(Note("tip-too-short", place=place, n=len(t), seconds=t[-1]))
    # The knots of the curve through the points of the grid (not-a-knot ends), so that `Recorded` is this very curve.
    knots = np.concatenate((np.full(6, 0.0), grid[3:-3], np.full(6, t[-1])))
    shift = float(np.nanmean(s))
    known_s, known_v = np.isfinite(s), np.isfinite(v) if v is not None else np.zeros(len(t), dtype=bool)
    B = BSpline.design_matrix(t, knots, 5)
    dB = _slopes(t, knots) if v is not None else None
    spread_s, spread_v = 1.0, np.inf
    c = np.zeros(len(knots) - 6)
    for _ in range(ROUNDS if v is not None else 1):
        N, y = _normal(B, np.where(known_s, s - shift, 0.0), known_s / spread_s**2)
        if v is not None and dB is not None and np.isfinite(spread_v):
            more, z = _normal(dB, np.where(known_v, v, 0.0), known_v / spread_v**2)
            N, y = N + more, y + z
        c = _solved(N, y, place)
        spread_s = max(_rms((s - shift - B @ c)[known_s]), 1e-5)
        if v is not None and dB is not None:
            spread_v = max(_rms((v - dB @ c)[known_v]), 1e-5) if known_v.any() else np.inf
    noise = s - shift - B @ c
    heights = BSpline.design_matrix(grid, knots, 5) @ c + shift
    return Tip(Recorded(grid, heights, source=place), noise, spread_s, spread_v if np.isfinite(spread_v) else np.nan)


def _slopes(t: FloatArray, knots: FloatArray) -> Any:
    """Slopes of the quintic basis at t, as a sparse matrix."""
    from scipy.interpolate import BSpline
    from scipy.sparse import diags

    m = len(knots) - 6
    over = 5.0 / (knots[6 : m + 5] - knots[1:m])
    lower = BSpline.design_matrix(t, knots[1:-1], 4)
    return lower @ diags([-over, over], [0, 1], shape=(m - 1, m))


def _normal(A: Any, y: FloatArray, weight: FloatArray) -> tuple[Any, FloatArray]:
    from scipy.sparse import diags

    W = diags(weight)
    return A.T @ W @ A, A.T @ (weight * y)


def _solved(N: Any, y: FloatArray, place: str) -> FloatArray:
    """Banded, so quick for any length. Errors: ValidateError where a gap leaves the curve undetermined."""
    from scipy.linalg import LinAlgError, solveh_banded

    band = np.zeros((6, len(y)))
    for k in range(6):
        band[k, : len(y) - k] = N.diagonal(-k)
    try:
        out: FloatArray = solveh_banded(band, y, lower=True)
    except LinAlgError:
        raise ValidateError(Note("tip-gaps", place=place, longest=KNOTS)) from None
    return out


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2))) if len(x) else np.inf


BEYOND = 0.5
"""Tolerance of wire out beyond the drum's range [m]: zero of an encoder."""
APART = 5.0
"""Difference between stated and logged wire out that is reported [m]: some turns of the drum."""


def completed(
    signals: Mapping[str, FloatArray], step: float, test: CraneTest, crane: Crane
) -> tuple[dict[str, FloatArray], frozenset[str], list[Note]]:
    """The signals with wire out and tip where they can be derived, names of the derived ones, and statements. Errors:
    ValidateError where a test of heave compensation lacks tip or wire, another one every signal of motion, or the wire
    out is outside the drum's range."""
    out, derived, statements = dict(signals), set(), list[Note]()
    if "s_w" in out:
        _check_range(out["s_w"], test, crane)
        first = out["s_w"][np.isfinite(out["s_w"])][:1]
        if test.s_w is not None and len(first) and abs(first[0] - test.s_w) > APART:
            statements.append(Note("other-start", test=test.name, log=float(first[0]), stated=test.s_w))
    elif (made := _integrated(out, step, test, crane)) is not None:
        out["s_w"], source = made
        derived.add("s_w")
        statements.append(Note(f"wire-by-{source}", test=test.name, start=test.s_w))
    if "s_tip" not in out and {"e_c_measured", "s_w"} <= out.keys() and "s_w" not in derived and test.kind is Kind.AHC:
        out["s_tip"] = out["e_c_measured"] + out["s_w"]
        derived.add("s_tip")
        statements.append(Note("tip-derived", test=test.name))
    _check_needed(out, test)
    return out, frozenset(derived), statements


def _check_needed(signals: Mapping[str, FloatArray], test: CraneTest) -> None:
    of, needed = {"test": test.name, "log": test.log.name}, ("s_tip", "s_w") if test.kind is Kind.AHC else ()
    for name in needed:
        if name not in signals:
            raise ValidateError(Note(f"map-{name}", **of))
    if not {"s_w", "v_w", "omega_m"} & signals.keys():
        raise ValidateError(Note("map-motion", **of))
    for name in needed:
        if not np.isfinite(signals[name]).any():
            raise ValidateError(Note("no-values", signal=name, **of))


def _check_range(s_w: FloatArray, test: CraneTest, crane: Crane) -> None:
    L = drum_record(crane).L_full
    if not np.isfinite(s_w).any():
        return
    low, high = float(np.nanmin(s_w)), float(np.nanmax(s_w))
    if low < -BEYOND or high > L + BEYOND:
        of = {"test": test.name, "log": test.log.name, "crane": crane.name, "L": L}
        raise ValidateError(Note("wire-beyond-drum", low=low, high=high, **of))


def _integrated(
    signals: Mapping[str, FloatArray], step: float, test: CraneTest, crane: Crane
) -> tuple[FloatArray, str] | None:
    """Wire out from its start and a speed [m], and which."""
    if test.s_w is None:
        return None
    if "v_w" in signals:
        return test.s_w - _sum(signals["v_w"], step), "v_w"
    if "omega_m" not in signals:
        return None
    drum, s_w = drum_record(crane), np.full(len(signals["omega_m"]), test.s_w)
    layers = np.arange(1, crane.drum.layers + 1)
    ends = np.array([wire_to_layer(float(n), drum) for n in layers])
    radii = np.array([0.5 * layer_diameter(float(n), drum) for n in layers])
    for _ in range(ROUNDS):
        wire_on_drum = np.nan_to_num(drum.L_full - s_w)
        r_eff = radii[np.clip(np.searchsorted(ends, wire_on_drum - 1e-6), 0, len(layers) - 1)]
        s_w = test.s_w - _sum(signals["omega_m"] * r_eff / crane.i_hD, step)
    return s_w, "omega_m"


def _sum(speed: FloatArray, step: float) -> FloatArray:
    """Integral of a speed [m]; across a gap the speed is interpolated, and the result is NaN in it."""
    good = np.isfinite(speed)
    speeds = filled(speed)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * step)))
    return np.where(good, way, np.nan)
