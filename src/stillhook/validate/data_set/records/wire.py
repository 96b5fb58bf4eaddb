"""Wire and tip of a record: as logged, or derived from other signals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import drum_record
from stillhook.errors import ValidateError
from stillhook.physics.load_path.drum import layer_diameter, wire_to_layer
from stillhook.spec.crane import Crane
from stillhook.units import show
from stillhook.validate.data_set.campaign import CraneTest, Kind

BEYOND = 0.5
"""Tolerance of wire out beyond the drum's range [m]: zero of an encoder."""
APART = 5.0
"""Difference between stated and logged wire out that is reported [m]: some turns of the drum."""
ROUNDS = 3
"""Rounds of integrating the motors' speed with the diameter of the last layer: wire over a few layers needs
two."""


def completed(
    signals: Mapping[str, FloatArray], step: float, test: CraneTest, crane: Crane
) -> tuple[dict[str, FloatArray], frozenset[str], list[str]]:
    """The signals with wire out and tip where they can be derived, the names of the derived ones, and statements about
    them.

    Errors: ValidateError where a test of heave compensation lacks the tip or the wire, another one every signal of the
    winch's motion, or the wire out is outside the drum's range.
    """
    out, derived, statements = dict(signals), set(), list[str]()
    if "s_w" in out:
        _in_range(out["s_w"], test, crane)
        statements += _compared(out["s_w"], test)
    elif (made := _integrated(out, step, test, crane)) is not None:
        out["s_w"], method = made
        derived.add("s_w")
        start = show(test.s_w or 0.0, "length")
        statements.append(
            f'Test "{test.name}": wire out is not logged; it is derived from the stated start {start} and {method}.'
        )
    if "s_tip" not in out and {"e_c_measured", "s_w"} <= out.keys() and "s_w" not in derived and test.kind is Kind.AHC:
        out["s_tip"] = out["e_c_measured"] + out["s_w"]
        derived.add("s_tip")
        statements.append(
            f'Test "{test.name}": tip height is not logged; it is derived from the error of the PLC and wire out, but'
            " for"
            " a constant."
        )
    _needed(out, test)
    return out, frozenset(derived), statements


def _needed(signals: Mapping[str, FloatArray], test: CraneTest) -> None:
    place = f'test "{test.name}": '
    if test.kind is Kind.AHC and "s_tip" not in signals:
        raise ValidateError(
            f"{place}no s_tip in {test.log.name}. Map the tip's height (or e_c_measured together with s_w): step 5"
            " replays it."
        )
    if test.kind is Kind.AHC and "s_w" not in signals:
        raise ValidateError(
            f"{place}no s_w in {test.log.name}. Map wire out, or a speed (v_w, omega_m) and state s_w at the start."
        )
    if not {"s_w", "v_w", "omega_m"} & signals.keys():
        raise ValidateError(
            f"{place}no signal in {test.log.name} shows the motion of the winch. Map s_w, v_w or omega_m."
        )
    for name in ("s_tip", "s_w") if test.kind is Kind.AHC else ():
        if not np.isfinite(signals[name]).any():
            none = f"{place}{name} in {test.log.name} has no usable value"
            raise ValidateError(f"{none}: it is constant or missing throughout. Map another column.")


def _in_range(s_w: FloatArray, test: CraneTest, crane: Crane) -> None:
    L = drum_record(crane).L_full
    if not np.isfinite(s_w).any():
        return
    low, high = float(np.nanmin(s_w)), float(np.nanmax(s_w))
    if low < -BEYOND or high > L + BEYOND:
        raise ValidateError(
            f'test "{test.name}": wire out goes from {show(low, "length")} to {show(high, "length")} in'
            f' {test.log.name}, where "{crane.name}" has 0 m to {show(L, "length")}. Check unit, sign and offset of'
            " s_w."
        )


def _compared(s_w: FloatArray, test: CraneTest) -> list[str]:
    first = s_w[np.isfinite(s_w)][:1]
    if test.s_w is None or not len(first) or abs(first[0] - test.s_w) <= APART:
        return []
    return [
        f'Test "{test.name}": the log begins with {show(float(first[0]), "length")} of wire out, but the campaign file'
        " states "
        f"{show(test.s_w, 'length')}: the log is used."
    ]


def _integrated(
    signals: Mapping[str, FloatArray], step: float, test: CraneTest, crane: Crane
) -> tuple[FloatArray, str] | None:
    """Wire out from its start and a speed [m], and the method in words."""
    if test.s_w is None:
        return None
    if "v_w" in signals:
        return test.s_w - _sum(signals["v_w"], step), "the wire's speed"
    if "omega_m" not in signals:
        return None
    drum, s_w = drum_record(crane), np.full(len(signals["omega_m"]), test.s_w)
    layers = np.arange(1, crane.drum.layers + 1)
    ends = np.array([wire_to_layer(float(n), drum) for n in layers])
    radii = np.array([0.5 * layer_diameter(float(n), drum) for n in layers])
    for _ in range(ROUNDS):
        left = np.nan_to_num(drum.L_full - s_w)
        r_eff = radii[np.clip(np.searchsorted(ends, left - 1e-6), 0, len(layers) - 1)]
        s_w = test.s_w - _sum(signals["omega_m"] * r_eff / crane.i_hD, step)
    return s_w, "the motors' speed on the layer in use"


def _sum(speed: FloatArray, step: float) -> FloatArray:
    """Integral of a speed [m]; across a gap the speed is interpolated, and the result is NaN in it."""
    good = np.isfinite(speed)
    if not good.any():
        return np.full(len(speed), np.nan)
    known = np.interp(np.arange(len(speed)), np.flatnonzero(good), speed[good])
    way = np.concatenate(([0.0], np.cumsum(0.5 * (known[1:] + known[:-1]) * step)))
    return np.where(good, way, np.nan)
