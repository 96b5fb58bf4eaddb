"""Load cell, transmission (effective radius) and friction implied by a log."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.physics.friction import system_friction_dry
from stillhook.physics.hydraulics.motor import motor_torque
from stillhook.physics.hydraulics.motor_laws import motor_loss_dry, motor_loss_moving
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane, passive_of
from stillhook.statistics.blocks import fit, pooled
from stillhook.statistics.estimate import Estimate
from stillhook.units import KINDS, in_unit
from stillhook.validate.criteria.results import Note
from stillhook.validate.parameters.segments import (
    OIL,
    LogPart,
    TestFit,
    bridged,
    by_test,
    diameter_of,
    fits,
    integral,
    layer_at,
    layer_step,
    mean_rows,
    means,
    rates,
    slope,
    stacked,
    wire_of_layer,
)
from stillhook.validate.parameters.settings import known_setting

EVERY = 0.2
"""Width of the means that are compared [s]: pressures oscillate faster, the sea moves slower."""
MOVING = 10.0
"""Least motor speed [rad/s], about 100 rev/min: below, friction reverses and the bristle model, not the sliding law,
applies."""

CALIBRATION = 0.005
"""Uncertainty of the friction from the classes of the sensors, regardless of the samples [-]: pressure transmitters 0.3
%, displacement of the active motors 0.4 % (assumed: class of a transmitter, sorted units of one type)."""


@dataclass(frozen=True)
class Friction:
    """One test. scale: measured over the twin's friction, less 1; standing_force: constant remaining torque, such as
    from an error of load cell, gas pressure or passive setting, as a force in the wire [N]; mean: the twin's mean
    friction [N m]."""

    test: str
    scale: Estimate
    standing_force: float
    mean: float


def missing(part: LogPart) -> tuple[str, ...]:
    """Signals missing for a torque balance of a part."""
    setting = ("alpha_m",) if known_setting(part, "m") is None else ()
    passive = OIL if "passive" in part.crane.circuits else ()
    return part.lacking("p_a", "p_b", "F_w", *passive) + setting + part.lacking("omega_m")


def frictions(parts: Sequence[LogPart]) -> tuple[Friction, ...]:
    """Friction of every test that moves the winch and has the signals, against the twin's.

    .. math:: D_m\\alpha_m\\Delta p + D_{pm}\\alpha_{pm}(p_{hp} - p_{lp}) - F_w\\,\\lambda - J\\dot\\omega = T_f

    lambda effective drum radius over gear ratio. The scale is that of the parts in phase with the twin's friction;
    constant terms and terms proportional to the acceleration (inertia, lags) and to the wire's position (gas, weight of
    wire) are fitted as well.
    Source: Moslatt 2020 eqs 2.3 and 2.15.
    """
    result = fits([p for p in parts if not missing(p)], _rows)
    return tuple(_friction(f) for f in result if np.isfinite(f.columns[-1]).any())


def overall(tests: Sequence[Friction]) -> Estimate | None:
    """Scale over all tests, less 1; CALIBRATION, the same in all tests, is a structural part of its interval."""
    if not tests:
        return None
    e = pooled([f.scale for f in tests])
    structural = math.hypot(e.structural, CALIBRATION)
    return Estimate.around(e.value, math.hypot(e.half, CALIBRATION), e.n, structural)


def _friction(estimates: TestFit) -> Friction:
    r_eff = float(np.nanmean(np.concatenate([p.r_eff for p in estimates.parts])))
    force, mean = float(estimates.fit.b[1]) / r_eff, float(np.nanmean(np.abs(estimates.columns[0])))
    return Friction(estimates.test, estimates.fit.estimate(0, -1.0), force, mean)


class States(NamedTuple):
    """Means over EVERY seconds (n,): omega [rad/s]; setting alpha_m [-] and pressure drop dp [Pa] of the active motors;
    T_w torque of the wire at the motor shaft [N m]; setting [-] and pressure drop [Pa] of the passive motors, 0
    without."""

    omega: FloatArray
    alpha_m: FloatArray
    dp: FloatArray
    T_w: FloatArray
    passive: tuple[Any, Any]


def states(part: LogPart) -> States:
    """The states of a part that lacks nothing (`missing`)."""
    step, alpha_m = part.step, known_setting(part, "m")
    assert part.omega_m is not None
    assert alpha_m is not None
    s = {name: means(bridged(part[name], step), step, EVERY) for name in ("p_a", "p_b", "F_w")}
    passive: tuple[Any, Any] = 0.0, 0.0
    if "passive" in part.crane.circuits:
        passive = means(part["alpha_pm"], step, EVERY), means(part["p_hp"], step, EVERY) - passive_of(part.crane).p_lp
    return States(
        omega=means(part.omega_m, step, EVERY),
        alpha_m=means(alpha_m, step, EVERY),
        dp=s["p_a"] - s["p_b"],
        T_w=s["F_w"] * means(part.r_eff, step, EVERY),
        passive=passive,
    )


def scale_of_law(parts: Sequence[LogPart], friction: Callable[[LogPart, States], FloatArray]) -> float | None:
    """The measure for a winch with this friction law [N m, a magnitude] at the moments of the parts: law over the
    twin's, less 1. None where the winch does not move."""
    columns = []
    for part in parts:
        s, (*regressors, _, block) = states(part), _rows(part)
        law = np.where(np.abs(s.omega) > MOVING, np.sign(s.omega) * friction(part, s), np.nan)
        columns.append((*regressors, law, block))
    *regressors, law, block = stacked(columns)
    fitted = fit(regressors, law, block)
    return None if fitted is None else float(fitted.b[0]) - 1.0


def _rows(part: LogPart) -> tuple[NDArray[Any], ...]:
    """Means over EVERY seconds: the twin's friction with the sign of the motion, one, wire out about its middle,
    angular acceleration, torque left, block; NaN at standstill."""
    step, every = part.step, max(1, round(EVERY / part.step))
    s = states(part)
    assert part.omega_m is not None
    s_w = means(bridged(part.wire_out, step), step, EVERY)
    T = motor_torque(part.crane.active.motor.D_total * s.alpha_m, s.dp) - s.T_w
    if "passive" in part.crane.circuits:
        T = T + motor_torque(passive_of(part.crane).motor.D_total * s.passive[0], s.passive[1])
    rate = rates(part.omega_m, step, EVERY)
    T = T - part.inertia * rate
    model = twin_friction(part, s.omega, s.alpha_m, s.dp, s.T_w * part.crane.i_hD, s.passive)
    moving = np.abs(s.omega) > MOVING
    spring = s_w - np.nanmean(s_w)
    blocks = part.blocks(part.t[::every])
    return np.sign(s.omega) * model, np.ones_like(T), spring, rate, np.where(moving, T, np.nan), blocks


def twin_friction(
    part: LogPart, omega: FloatArray, alpha_m: FloatArray, dp: FloatArray, T_d: FloatArray, passive: tuple[Any, Any]
) -> FloatArray:
    """All friction of the twin at the motor shaft, a magnitude [N m] (n,). omega [rad/s]; alpha_m [-]; dp [Pa]; T_d
    drum torque [N m]; passive setting [-] and pressure drop [Pa]. As `stillhook.winches.shaft.dry_level` and
    `moving_loss` for the sliding winch, with arrays."""
    hoist, sets = part.params.hoist, [(part.params.active.motors, alpha_m, dp)]
    if "passive" in part.crane.circuits:
        sets.append((part.params.passive.motors, *passive))
    T = hoist.n_motors * (system_friction_dry(omega, T_d, hoist.friction) + hoist.friction.Y_5 * np.abs(omega))
    for motors, alpha, drop in sets:
        at = (omega, alpha * motors.D_max, drop, motors.fit)
        T = T + motors.count * (motor_loss_dry(*at) + motor_loss_moving(*at))
    return np.asarray(T)


LIGHT = 0.1
"""Load with hook over the safe working load from which a load cell is judged [-]: below, its zero error dominates."""
LIKE_A_UNIT = 0.05
"""Tolerance of a unit's factor [-]: the accuracy of stated loads."""
CLOSE = 0.1
"""Error of the gain below which no wrong unit is considered [-]: kgf and daN differ by 2 %, all others by more."""
UNITS = {
    "N": 1.0,
    "daN": 10.0,
    "kgf": G,
    "lbf": 4.4482216,
    "kN": 1e3,
    "kip": 4448.2216,
    "short tons": 8896.443,
    "t": 1e3 * G,
    "MN": 1e6,
}
"""Units in which load cells are logged [N]."""
AS_WIRE = (0.7, 1.2)
"""Range of excess force over the weight of the wire paid out that is attributed to it [-]: less in water, and loads are
known to some per cent."""
MUCH_WIRE = 0.03
"""Least weight of the wire paid out over that of hook and payload from which it is considered [-]."""


@dataclass(frozen=True)
class Cell:
    """One test. force: mean of the cell; weight: of hook and payload, in water less buoyancy [N]; error: force over
    weight, less 1; light: too light to judge."""

    test: str
    force: Estimate
    weight: float
    error: Estimate
    light: bool


def cells(parts: Sequence[LogPart]) -> tuple[Cell, ...]:
    """The load cell in every test whose load is stated."""
    out = []
    for f in fits([p for p in parts if p.has("F_w") and p.record.test.load is not None], mean_rows("F_w")):
        part, force = f.parts[0], f.fit.estimate(0)
        error = Estimate.around(force.value / part.weight - 1.0, force.half / part.weight, f.fit.blocks)
        light = part.weight < LIGHT * part.crane.SWL * G
        out.append(Cell(f.test, force, part.weight, error, light))
    return tuple(out)


def cell_causes(heavy: Sequence[Cell], parts: Sequence[LogPart]) -> list[Note]:
    """Likely cause of the load cell's errors; none where sign, wire, unit and hook do not explain them."""
    if not heavy:
        return []
    gain = math.exp(float(np.mean([math.log(max(abs(1.0 + c.error.value), 1e-9)) for c in heavy])))
    if all(c.error.value < -1.0 for c in heavy):
        return [Note("cell-negative")]
    out, m_wire = {p.test: p.segment.s_w for p in parts}, parts[0].params.hoist.drum.m_wire
    stated = np.array([c.weight for c in heavy])
    weight, more = (
        np.array([m_wire * out[c.test] * G for c in heavy]),
        np.array([c.force.value for c in heavy]) - stated,
    )
    as_wire = (more >= AS_WIRE[0] * weight) & (more <= AS_WIRE[1] * weight)
    if (weight > MUCH_WIRE * stated).any() and as_wire.all():
        return [Note("cell-wire", wire=float(weight.max()) / G)]
    if abs(gain - 1.0) > CLOSE:
        return [_unit(gain, parts) or Note("cell-gain", gain=gain)]
    hook = parts[0].crane.hook_mass
    tared = np.abs(-more - hook * G) < 0.3 * (hook * G)
    return [Note("cell-tared", hook=hook)] if tared.all() else []


def _unit(gain: float, parts: Sequence[LogPart]) -> Note | None:
    """The unit that the column is in if its factor explains the gain."""
    mapping = next((p.record.log.mapping for p in parts if p.record.log.mapping), None)
    row = mapping.get("F_w") if mapping else None
    read = row.unit if row is not None and row.unit in KINDS["force"].allowed else "kN"
    newtons = (row.scale if row is not None else 1.0) / in_unit(1.0, read, "force")  # of one number in the column
    units = {**UNITS, "% of the SWL": parts[0].crane.SWL * G / 100.0}
    name, newton = min(units.items(), key=lambda u: abs(math.log(newtons / gain / u[1])))
    if abs(math.log(newtons / gain / newton)) > LIKE_A_UNIT:
        return None
    return Note("cell-unit", unit=name, read=read, gain=gain)


FLOOR = 0.001
"""Calibration difference of pick-up and wire counter between load cases, next to the scatter [-]: 0.1 %."""
AGREES = 0.005
"""Acceptable error of the effective radius [-]: a tenth of a layer's step, beyond the calibration of sensors."""
NEAR_A_LAYER = 0.15
"""Tolerance of an error of full layers, in layers: half a per cent of the effective radius."""
AS_GOOD = 1.5
"""An explanation whose residual is within this factor of the best one's (or of FLOOR) is as good."""


@dataclass(frozen=True)
class EffectiveRadius:
    """One test. error: implied over the twin's, less 1; layer: the twin's; implied: by the log, a real number; d,
    d_implied: diameters of the wire's centre [m]; wire: signal of its motion; s_w [m]."""

    test: str
    error: Estimate
    layer: float
    implied: float
    d: float
    d_implied: float
    wire: str
    s_w: float


def effective_radii(parts: Sequence[LogPart], clock: float = 0.0) -> tuple[EffectiveRadius, ...]:
    """Every test with a motor speed and a wire speed (a ratio of speeds does not depend on the clock), else wire out,
    corrected for the clock: rate error of the stamps, positive if fast [-]."""
    out = []
    for test, same in by_test(parts).items():
        wire = "v_w" if all(p.has("v_w") for p in same) else "s_w"
        if not all(p.has("omega_m", wire) and np.isfinite(p.layer).any() for p in same):
            continue
        paid_in = [integral(p["v_w"], p.step) if wire == "v_w" else -p["s_w"] for p in same]
        wound = [integral(p["omega_m"] * p.r_eff, p.step) for p in same]
        fitted = slope(same, list(zip(wound, paid_in, strict=True)))
        if fitted is None:
            continue
        error = fitted.value * (1.0 if wire == "v_w" else 1.0 + clock) - 1.0
        crane, layer = same[0].crane, float(np.nanmedian(np.concatenate([p.layer for p in same])))
        d = float(diameter_of(crane, np.array([round(layer)]))[0])
        d_implied = d * (1.0 + error)
        out.append(
            EffectiveRadius(
                test=test,
                error=Estimate.around(error, fitted.half, fitted.fit.blocks),
                layer=layer,
                implied=layer_at(crane, d_implied),
                d=d,
                d_implied=d_implied,
                wire=wire,
                s_w=float(np.nanmean(np.concatenate([p.wire_out for p in same]))),
            )
        )
    return tuple(out)


def diagnosis(crane: Crane, radii: Sequence[EffectiveRadius]) -> list[Note]:
    """Likely causes of the errors of the effective radius in all tests; none where they are small."""
    if not radii or max(abs(x.error.value) for x in radii) <= AGREES:
        return []
    ideas = _ideas(crane, radii)
    least = max(min(residual for residual, _ in ideas), FLOOR)
    good = [note for residual, note in ideas if residual <= AS_GOOD * least]
    if len(good) > 1:
        good.append(Note("any-of-these" if len({x.layer for x in radii}) > 1 else "another-layer-would-tell"))
    return good


def _ideas(crane: Crane, radii: Sequence[EffectiveRadius]) -> list[tuple[float, Note]]:
    """Explanations, each with the root mean square of the remaining error of the effective radius."""
    e, d = np.array([x.error.value for x in radii]), np.array([x.d for x in radii])
    w = 1.0 / np.hypot([x.error.half for x in radii], FLOOR) ** 2
    gear = float(w @ e / w.sum())
    geared = (_rms(e - gear, w), Note("gear", log=crane.i_hD / (1.0 + gear), file=crane.i_hD))
    layers = np.array([x.layer for x in radii])
    off = np.array([x.implied for x in radii]) - layers
    rest = off - np.round(off)
    if (np.abs(rest) <= NEAR_A_LAYER).all() and np.round(off).any():
        layer = Note("layer", which=_named(radii), counter=wire_counted_wrong(crane, radii))
        # a drum larger by full layers is named with them
        return [(_rms(rest * layer_step(crane) / d, w), layer), geared]
    drum = float((w / d**2) @ (e * d) / np.sum(w / d**2))
    larger = (_rms(e - drum / d, w), Note("drum", log=crane.drum.d + drum, file=crane.drum.d))
    share = 2.0 * layers - 1.0
    wire = float((w * share / d**2) @ (e * d) / np.sum(w * share**2 / d**2))
    thick = (_rms(e - wire * share / d, w), Note("wire", log=crane.wire.d + wire, file=crane.wire.d))
    return [geared, larger, thick]


def _rms(rest: FloatArray, w: FloatArray) -> float:
    return float(np.sqrt(w @ rest**2 / w.sum()))


def _named(radii: Sequence[EffectiveRadius]) -> list[Note]:
    """Which layers, and in which tests."""
    groups: dict[tuple[int, int], list[str]] = {}
    for x in radii:
        if round(x.implied) != round(x.layer):
            groups.setdefault((round(x.implied), round(x.layer)), []).append(x.test)
    return [Note("layer-of", log=log, twin=twin, tests=tests) for (log, twin), tests in groups.items()]


def wire_counted_wrong(crane: Crane, radii: Sequence[EffectiveRadius]) -> Note:
    """Error of the wire counter that would put all tests on the layers that they imply."""
    if any(not 1 <= round(x.implied) <= crane.drum.layers for x in radii):
        return Note("no-such-layer")
    ranges = [np.array(wire_of_layer(crane, round(x.implied))) - x.s_w for x in radii]
    least, most = max(r[0] for r in ranges), min(r[1] for r in ranges)
    if not least < most or least < 0.0 < most:
        return Note("no-counter-error")
    near, far = sorted((abs(least), abs(most)))
    return Note("counter-error", near=near, far=far, way=least if least > 0.0 else -1.0)
