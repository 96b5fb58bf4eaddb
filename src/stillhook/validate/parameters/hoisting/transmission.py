"""Wire per turn of the motors: effective radius (r_eff) implied by a log, the corresponding layer, and the likely cause
of its error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.units import number, show
from stillhook.validate.parameters.segments import LogPart, by_test, diameter_of, layer_at, layer_step, wire_of_layer
from stillhook.validate.parameters.slopes import integral, slope

FLOOR = 0.001
"""Calibration difference of pick-up and wire counter between load cases in addition to the scatter [-]: a tenth of a
per cent."""
AGREES = 0.005
"""Error of the effective radius that is acceptable [-]: a tenth of a layer's step, and beyond what sensors are
calibrated to."""
NEAR_A_LAYER = 0.15
"""Tolerance of an error of full layers, in layers: half a per cent of the effective radius."""
AS_GOOD = 1.5
"""An explanation whose residual is within this factor of the best one's (or of FLOOR) is as good."""


@dataclass(frozen=True)
class EffectiveRadius:
    """One test. error: implied effective radius over the twin's, less 1; layer: the twin's at the wire that is out;
    implied: the one that the log implies, as a real number; d, d_implied diameters of the wire's centre [m]; wire:
    signal of the wire's motion; s_w wire out [m].
    """

    test: str
    error: Estimate
    layer: float
    implied: float
    d: float
    d_implied: float
    wire: str
    s_w: float


def effective_radii(parts: Sequence[LogPart], clock: float = 0.0) -> tuple[EffectiveRadius, ...]:
    """The effective radius of every test with a motor speed and a wire speed or wire out; clock: rate error of the time
    stamps, positive if fast [-].

    The ratio of two speeds does not depend on the clock; where the wire's speed is missing its length is used,
    corrected for the clock.
    """
    out = []
    for test, same in by_test(parts).items():
        wire = "v_w" if all(p.has("v_w") for p in same) else "s_w"
        if not all(p.has("omega_m", wire) and np.isfinite(p.layer).any() for p in same):
            continue
        fitted = slope(same, [(integral(p["omega_m"] * p.r_eff, p.step), _paid_in(p, wire)) for p in same])
        if fitted is None:
            continue
        error = fitted.value * (1.0 if wire == "v_w" else 1.0 + clock) - 1.0
        out.append(_radius(same, test, Estimate.around(error, fitted.half, fitted.fit.blocks), wire))
    return tuple(out)


def _paid_in(part: LogPart, wire: str) -> FloatArray:
    return integral(part["v_w"], part.step) if wire == "v_w" else -part["s_w"]


def _radius(parts: Sequence[LogPart], test: str, error: Estimate, wire: str) -> EffectiveRadius:
    crane = parts[0].crane
    layer = float(np.nanmedian(np.concatenate([p.layer for p in parts])))
    s_w = float(np.nanmean(np.concatenate([p.wire_out for p in parts])))
    d = float(diameter_of(crane, np.array([round(layer)]))[0])
    d_implied = d * (1.0 + error.value)
    return EffectiveRadius(test, error, layer, layer_at(crane, d_implied), d, d_implied, wire, s_w)


def diagnosis(crane: Crane, radii: Sequence[EffectiveRadius]) -> str:
    """Likely cause of the errors of the effective radius in all tests, in one line; empty where they are small."""
    if not radii or max(abs(x.error.value) for x in radii) <= AGREES:
        return ""
    ideas = _ideas(crane, radii)
    least = max(min(residual for residual, _ in ideas), FLOOR)
    good = [text for residual, text in ideas if residual <= AS_GOOD * least]
    layers = len({x.layer for x in radii})
    alone = "" if layers > 1 else " (tests on another layer would distinguish them)"
    return f"{' or '.join(good)}{alone if len(good) > 1 else ''}"


def _ideas(crane: Crane, radii: Sequence[EffectiveRadius]) -> list[tuple[float, str]]:
    """Explanations, each with the root mean square of the remaining error of the effective radius."""
    e, d = np.array([x.error.value for x in radii]), np.array([x.d for x in radii])
    w = 1.0 / np.hypot([x.error.half for x in radii], FLOOR) ** 2
    gear = float(w @ e / w.sum())
    geared = (
        _rms(e - gear, w),
        f"the gear ratio is {number(crane.i_hD / (1.0 + gear), 4)}, not {number(crane.i_hD, 4)}",
    )
    if _near_full_layers(radii):
        return [_full_layers(crane, radii), geared]  # a drum larger by whole layers is named with them
    ideas = [geared]
    drum, old = float((w / d**2) @ (e * d) / np.sum(w / d**2)), crane.drum.d
    ideas.append(
        (_rms(e - drum / d, w), f"the drum's diameter is {show(old + drum, 'length')}, not {show(old, 'length')}")
    )
    share = 2.0 * np.array([x.layer for x in radii]) - 1.0
    wire = float((w * share / d**2) @ (e * d) / np.sum(w * share**2 / d**2))
    old = crane.wire.d
    text = f"the wire's diameter on the drum is {show(old + wire, 'diameter')}, not {show(old, 'diameter')}"
    ideas.append((_rms(e - wire * share / d, w), text))
    return ideas


def _rms(rest: FloatArray, w: FloatArray) -> float:
    return float(np.sqrt(w @ rest**2 / w.sum()))


def _near_full_layers(radii: Sequence[EffectiveRadius]) -> bool:
    off = np.array([x.implied - x.layer for x in radii])
    return bool((np.abs(off - np.round(off)) <= NEAR_A_LAYER).all() and np.round(off).any())


def _full_layers(crane: Crane, radii: Sequence[EffectiveRadius]) -> tuple[float, str]:
    off = np.array([x.implied - x.layer for x in radii])
    rest = (off - np.round(off)) * layer_step(crane) / np.array([x.d for x in radii])
    w = 1.0 / np.hypot([x.error.half for x in radii], FLOOR) ** 2
    return (
        _rms(rest, w),
        f"the wire runs on another layer than the twin's: {_named(radii)}, {wire_counted_wrong(crane, radii)}",
    )


def _named(radii: Sequence[EffectiveRadius]) -> str:
    """Which layers, and in which tests."""
    groups: dict[tuple[int, int], list[str]] = {}
    for x in radii:
        if round(x.implied) != round(x.layer):
            groups.setdefault((round(x.implied), round(x.layer)), []).append(x.test)
    return ", ".join(f"{is_} not {twin} ({', '.join(tests)})" for (is_, twin), tests in groups.items())


def wire_counted_wrong(crane: Crane, radii: Sequence[EffectiveRadius]) -> str:
    """Error of the wire counter that would put all tests on the layers that they imply, in
    words."""
    wrong = "layers, turns or drum of the crane file are wrong"
    if any(not 1 <= round(x.implied) <= crane.drum.layers for x in radii):
        return f"one that the drum does not have: {wrong}"
    ranges = [np.array(wire_of_layer(crane, round(x.implied))) - x.s_w for x in radii]
    least, most = max(r[0] for r in ranges), min(r[1] for r in ranges)
    if not least < most or least < 0.0 < most:
        return f"not by a constant error of the wire out: {wrong}"
    more, near, far = ("more", least, most) if least > 0.0 else ("less", -most, -least)
    return f"as if {near:.0f} to {far:.0f} m {more} wire were out than counted; or {wrong}"
