"""Friction from the torque balance at the motor shaft against the twin's friction at the same
moments."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.physics.friction import system_friction_dry
from stillhook.physics.hydraulics.motor import motor_torque, torque_loss_dry, torque_loss_moving
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.jackknife_regression import Fit, fit, pooled
from stillhook.validate.parameters.circuit.settings import known_setting
from stillhook.validate.parameters.segments import OIL, LogPart, by_test
from stillhook.validate.parameters.slopes import bridged, means, rates

EVERY = 0.2
"""Width of the means that are compared [s]: pressures swing faster, the sea moves slower."""
MOVING = 10.0
"""Least motor speed [rad/s], about 100 rev/min: below, friction reverses and the bristle model, not the sliding law,
applies."""

CALIBRATION = 0.005
"""Uncertainty of the friction from the classes of the sensors, regardless of the samples [-]:
pressure transmitters 0.3 %, displacement of the active motors 0.4 % (assumed: class of a transmitter, sorted units of
one type)."""


@dataclass(frozen=True)
class Friction:
    """One test. scale: measured over the twin's friction, less 1; standing: constant remaining torque [N m], such as
    from an error of load cell, gas pressure or passive setting, and standing_force: the same as a force in the wire
    [N]; inertia: of the twin's that is missing, as part; measured, twin: torques for figures [N m]; mean: the twin's
    mean friction [N m]."""

    test: str
    scale: Estimate
    standing: Estimate
    standing_force: float
    inertia: Estimate
    measured: FloatArray
    twin: FloatArray
    mean: float


def missing(part: LogPart) -> tuple[str, ...]:
    """Signals missing for a torque balance of a part."""
    setting = ("alpha_m",) if known_setting(part, "m") is None else ()
    passive = OIL if part.crane.passive is not None else ()
    return part.lacking("p_a", "p_b", "F_w", *passive) + setting + part.lacking("omega_m")


def frictions(parts: Sequence[LogPart]) -> tuple[Friction, ...]:
    """Friction of every test that moves the winch and has the signals, against the twin's.

    .. math:: D_m\\alpha_m\\Delta p + D_{pm}\\alpha_{pm}(p_{hp} - p_{lp}) - F_w\\,\\lambda - J\\dot\\omega = T_f

    lambda effective drum radius over gear ratio. The scale is that of the parts in phase with the twin's friction;
    constant terms and terms proportional to the acceleration (inertia, lags) and to the wire's position (gas, weight of
    wire) are fitted as well.
    Source: Moslatt 2020 eqs 2.3 and 2.15.
    """
    out = []
    for test, same in by_test([p for p in parts if not missing(p)]).items():
        friction = _test(test, same)
        if friction is not None:
            out.append(friction)
    return tuple(out)


def overall(tests: Sequence[Friction]) -> Estimate | None:
    """Scale over all tests, less 1; CALIBRATION is a structural part of its interval because it is the same in all
    tests."""
    if not tests:
        return None
    e = pooled([f.scale for f in tests])
    structural = math.hypot(e.structural, CALIBRATION)
    return Estimate.around(e.value, math.hypot(e.half, CALIBRATION), e.n, structural)


def _test(test: str, parts: Sequence[LogPart]) -> Friction | None:
    rows = [_rows(p) for p in parts]
    T, model, spring, rate, one, block = (np.concatenate(c) for c in zip(*rows, strict=True))
    fitted = fit((model, one, spring, rate), T, block)
    if fitted is None or not np.isfinite(T).any():
        return None
    r_eff = float(np.nanmean(np.concatenate([p.r_eff for p in parts])))
    rest = fitted.b[1] + fitted.b[2] * spring + fitted.b[3] * rate
    return _friction(test, fitted, r_eff, T - rest, model, parts[0].inertia)


def _friction(test: str, fitted: Fit, r_eff: float, measured: FloatArray, model: FloatArray, J: float) -> Friction:
    return Friction(
        test=test,
        scale=fitted.estimate(0, -1.0),
        standing=fitted.estimate(1),
        standing_force=float(fitted.b[1]) / r_eff,
        inertia=Estimate.around(float(fitted.b[3]) / J, fitted.half(3) / J, fitted.blocks),
        measured=measured,
        twin=model,
        mean=float(np.nanmean(np.abs(model))),
    )


class States(NamedTuple):
    """Variables of the friction, as means over EVERY seconds, each (n,): omega motor speed [rad/s]; alpha_m setting [-]
    and dp pressure drop [Pa] of the active motors; T_w torque of the wire at the motor shaft [N m]; passive setting [-]
    and pressure drop [Pa] of the passive motors, 0 without any."""

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
    if part.crane.passive is not None:
        passive = means(part["alpha_pm"], step, EVERY), means(part["p_hp"], step, EVERY) - part.crane.passive.p_lp
    return States(
        omega=means(part.omega_m, step, EVERY),
        alpha_m=means(alpha_m, step, EVERY),
        dp=s["p_a"] - s["p_b"],
        T_w=s["F_w"] * means(part.r_eff, step, EVERY),
        passive=passive,
    )


def scale_of_law(parts: Sequence[LogPart], friction: Callable[[LogPart, States], FloatArray]) -> float | None:
    """Value of the measure for a winch with this friction law [N m, a magnitude] at the moments of the parts and no
    other torques: law over the twin's, less 1. None where the winch does not move."""
    columns = []
    for part in parts:
        s, (_, model, spring, rate, one, block) = states(part), _rows(part)
        law = np.where(np.abs(s.omega) > MOVING, np.sign(s.omega) * friction(part, s), np.nan)
        columns.append((model, one, spring, rate, law, block))
    *regressors, law, block = (np.concatenate(c) for c in zip(*columns, strict=True))
    fitted = fit(regressors, law, block)
    return None if fitted is None else float(fitted.b[0]) - 1.0


def _rows(part: LogPart) -> tuple[NDArray[Any], ...]:
    """Means over EVERY seconds: torque left, the twin's friction with the sign of the motion, wire out about its
    middle, angular acceleration, one, block; NaN where the motors are at standstill or reverse."""
    step, every = part.step, max(1, round(EVERY / part.step))
    s = states(part)
    assert part.omega_m is not None
    s_w = means(bridged(part.wire_out, step), step, EVERY)
    T = motor_torque(part.crane.active.motor.D_total * s.alpha_m, s.dp) - s.T_w
    if part.crane.passive is not None:
        T = T + motor_torque(part.crane.passive.motor.D_total * s.passive[0], s.passive[1])
    rate = rates(part.omega_m, step, EVERY)
    T = T - part.inertia * rate
    model = twin_friction(part, s.omega, s.alpha_m, s.dp, s.T_w * part.crane.i_hD, s.passive)
    moving = np.abs(s.omega) > MOVING
    spring = s_w - np.nanmean(s_w)
    return (
        np.where(moving, T, np.nan),
        np.sign(s.omega) * model,
        spring,
        rate,
        np.ones_like(T),
        part.blocks(part.t[::every]),
    )


def twin_friction(
    part: LogPart, omega: FloatArray, alpha_m: FloatArray, dp: FloatArray, T_d: FloatArray, passive: tuple[Any, Any]
) -> FloatArray:
    """All friction of the twin at the motor shaft, a magnitude [N m]: of active motors, passive ones and the
    transmission.

    omega [rad/s]; alpha_m [-]; dp over the active motors [Pa]; T_d drum torque [N m]; passive setting [-] and pressure
    drop [Pa]; (n,). As `stillhook.winches.types.active_passive.dry_level` and `moving_loss` for the sliding winch, with
    arrays.
    """
    hoist, sets = part.params.hoist, [(part.params.active.motors, alpha_m, dp)]
    if part.crane.passive is not None:
        sets.append((part.params.passive.motors, *passive))
    T = hoist.n_motors * (system_friction_dry(omega, T_d, hoist.friction) + hoist.friction.Y_5 * np.abs(omega))
    for motors, alpha, drop in sets:
        D = alpha * motors.D_max
        T = T + motors.count * (torque_loss_dry(D, drop, motors.fit) + torque_loss_moving(omega, D, motors.fit))
    return np.asarray(T)
