"""How much wire the drum takes in per turn of the motors: the lever that a log implies, the layer that has it, and what
its error means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.spec.crane import Crane
from stillhook.statistics.jackknife_regression import Estimate
from stillhook.units import number, show
from stillhook.validate.parameters.segments import Part, by_test, diameter_of, layer_at, layer_step, wire_of_layer
from stillhook.validate.parameters.slopes import integral, slope

FLOOR = 0.001
"""What pick-up and wire counter may differ by between load cases on top of the scatter [-]: a tenth of a per cent, as
calibrated."""
AGREES = 0.005
"""Error of the lever below which nothing is wrong [-]: a tenth of a layer's step, and beyond what sensors are
calibrated to."""
NEAR_A_LAYER = 0.15
"""By how much of a layer a whole layer's error may be missed: half a per cent of the lever."""
AS_GOOD = 1.5
"""An explanation whose residual is within this factor of the best one's (or of FLOOR) is as good."""


@dataclass(frozen=True)
class Lever:
    """One test. error: implied lever over the twin's, less 1; layer: the twin's at the wire that is out; implied: the
    one that the log implies, as a real number; d, d_implied diameters of the wire's centre [m]; wire: what the wire's
    motion is from; s_w wire out [m].
    """

    test: str
    error: Estimate
    layer: float
    implied: float
    d: float
    d_implied: float
    wire: str
    s_w: float


def levers(parts: Sequence[Part], clock: float = 0.0) -> tuple[Lever, ...]:
    """The lever of every test with a motor speed and a wire speed or wire out; clock: by which the time stamps run too
    fast [-].

    The ratio of two speeds does not depend on the clock; where the wire's speed is missing its length is used, less
    what the clock does.
    """
    out = []
    for test, mine in by_test(parts).items():
        wire = "v_w" if all(p.has("v_w") for p in mine) else "s_w"
        if not all(p.has("omega_m", wire) and np.isfinite(p.layer).any() for p in mine):
            continue
        found = slope(mine, [(integral(p["omega_m"] * p.lever, p.step), _paid_in(p, wire)) for p in mine])
        if found is None:
            continue
        error = found.value * (1.0 if wire == "v_w" else 1.0 + clock) - 1.0
        out.append(_lever(mine, test, Estimate(error, found.half, found.fit.blocks), wire))
    return tuple(out)


def _paid_in(part: Part, wire: str) -> FloatArray:
    return integral(part["v_w"], part.step) if wire == "v_w" else -part["s_w"]


def _lever(parts: Sequence[Part], test: str, error: Estimate, wire: str) -> Lever:
    crane = parts[0].crane
    layer = float(np.nanmedian(np.concatenate([p.layer for p in parts])))
    s_w = float(np.nanmean(np.concatenate([p.wire_out for p in parts])))
    d = float(diameter_of(crane, np.array([round(layer)]))[0])
    d_implied = d * (1.0 + error.value)
    return Lever(test, error, layer, layer_at(crane, d_implied), d, d_implied, wire, s_w)


def diagnosis(crane: Crane, found: Sequence[Lever]) -> str:
    """What the errors of the lever in all tests point at, in one line; empty where they are small."""
    if not found or max(abs(x.error.value) for x in found) <= AGREES:
        return ""
    ideas = _ideas(crane, found)
    least = max(min(residual for residual, _ in ideas), FLOOR)
    good = [text for residual, text in ideas if residual <= AS_GOOD * least]
    layers = len({x.layer for x in found})
    alone = "" if layers > 1 else " (tests on another layer would tell which)"
    return f"{' or '.join(good)}{alone if len(good) > 1 else ''}"


def _ideas(crane: Crane, found: Sequence[Lever]) -> list[tuple[float, str]]:
    """Explanations with the root mean square of the lever's error that each leaves."""
    e, d = np.array([x.error.value for x in found]), np.array([x.d for x in found])
    w = 1.0 / np.hypot([x.error.half for x in found], FLOOR) ** 2
    gear = float(w @ e / w.sum())
    geared = (
        _left(e - gear, w),
        f"the gear ratio is {number(crane.i_hD / (1.0 + gear), 4)}, not {number(crane.i_hD, 4)}",
    )
    if _near_whole_layers(found):
        return [_whole_layers(crane, found), geared]  # a drum larger by whole layers is named with them
    ideas = [geared]
    drum, old = float((w / d**2) @ (e * d) / np.sum(w / d**2)), crane.drum.d
    ideas.append(
        (_left(e - drum / d, w), f"the drum's diameter is {show(old + drum, 'length')}, not {show(old, 'length')}")
    )
    share = 2.0 * np.array([x.layer for x in found]) - 1.0
    wire = float((w * share / d**2) @ (e * d) / np.sum(w * share**2 / d**2))
    old = crane.wire.d
    text = f"the wire's diameter on the drum is {show(old + wire, 'diameter')}, not {show(old, 'diameter')}"
    ideas.append((_left(e - wire * share / d, w), text))
    return ideas


def _left(rest: FloatArray, w: FloatArray) -> float:
    return float(np.sqrt(w @ rest**2 / w.sum()))


def _near_whole_layers(found: Sequence[Lever]) -> bool:
    off = np.array([x.implied - x.layer for x in found])
    return bool((np.abs(off - np.round(off)) <= NEAR_A_LAYER).all() and np.round(off).any())


def _whole_layers(crane: Crane, found: Sequence[Lever]) -> tuple[float, str]:
    off = np.array([x.implied - x.layer for x in found])
    rest = (off - np.round(off)) * layer_step(crane) / np.array([x.d for x in found])
    w = 1.0 / np.hypot([x.error.half for x in found], FLOOR) ** 2
    return (
        _left(rest, w),
        f"the wire runs on another layer than the twin's: {_named(found)}, {wire_counted_wrong(crane, found)}",
    )


def _named(found: Sequence[Lever]) -> str:
    """Which layers, and in which tests."""
    groups: dict[tuple[int, int], list[str]] = {}
    for x in found:
        if round(x.implied) != round(x.layer):
            groups.setdefault((round(x.implied), round(x.layer)), []).append(x.test)
    return ", ".join(f"{is_} not {twin} ({', '.join(tests)})" for (is_, twin), tests in groups.items())


def wire_counted_wrong(crane: Crane, found: Sequence[Lever]) -> str:
    """By how much the wire out would have to be counted wrong for all tests to run on the layers that they imply, in
    words."""
    wrong = "layers, turns or drum of the crane file are wrong"
    if any(not 1 <= round(x.implied) <= crane.drum.layers for x in found):
        return f"one that the drum does not have: {wrong}"
    ranges = [np.array(wire_of_layer(crane, round(x.implied))) - x.s_w for x in found]
    least, most = max(r[0] for r in ranges), min(r[1] for r in ranges)
    if not least < most or least < 0.0 < most:
        return f"by no one error of the wire out: {wrong}"
    more, near, far = ("more", least, most) if least > 0.0 else ("less", -most, -least)
    return f"as if {near:.0f} to {far:.0f} m {more} wire were out than was counted; or {wrong}"
