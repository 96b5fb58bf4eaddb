"""Settings of motors and pumps of the passive circuit against their laws: displacement for the weight, make-up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray
from stillhook.physics.scalar import G
from stillhook.spec.crane import passive_of
from stillhook.statistics.blocks import fit, pooled
from stillhook.statistics.estimate import Estimate
from stillhook.validate.data_set.campaign import Kind
from stillhook.validate.parameters.segments import LogPart, bridged, by_test, stacked
from stillhook.validate.parameters.settings import EVERY, followed
from stillhook.validate.passive.torque import filtered, flow

SETTLING = 3.0
"""Time constants of a filter of the PLC after which its unknown start has faded."""
LEAST_LOAD = 0.1
"""Load over the safe working load from which a setting is compared [-]: below, the zero of the load cell decides."""
LEAST_ORDER = 0.02
"""Smallest scatter of the make-up command from which its gain is shown [-]."""


@dataclass(frozen=True)
class Setting:
    """gain: measured setting of the passive motors over that of the law, less 1; tests: by test."""

    gain: Estimate
    tests: dict[str, Estimate]


@dataclass(frozen=True)
class MakeUp:
    """gain: measured setting of the passive pumps over the response to the law's command, less 1; offset
    between them, as the pressure [Pa] by which set pressure and transmitter disagree."""

    gain: Estimate
    offset: float


def displacement_by_weight(part: LogPart) -> FloatArray | None:
    """Setting that the law and the servo give the passive motors, (n,) [-], NaN while the filter settles and where it
    is held in [0, 1]; None where load cell or pressure have holes."""
    F, p = (bridged(part[name], part.step) for name in ("F_w", "p_hp"))
    if not (np.isfinite(F).all() and np.isfinite(p).all() and np.isfinite(part.r_eff).all()):
        return None
    settings, tau = part.params.passive.settings, part.params.plc.tau_F
    dp = np.maximum(p - settings.p_lp, settings.dp_least)
    law = filtered(F, tau, part.step) * part.r_eff / (settings.D_m_max * dp)
    setting = followed(np.clip(law, 0.0, 1.0), part.params.passive.motor_servo, part.step)
    free = (law > 0.0) & (law < 1.0) & (part.t > SETTLING * (tau + 1.0 / passive_of(part.crane).motor.servo.omega_n))
    return np.where(free, setting, np.nan)


def setting(parts: Sequence[LogPart]) -> Setting | None:
    """Gain of the passive motors' setting over the law, of every test that carries a load; None without the signals."""
    tests = {}
    usable = [p for p in parts if p.has("alpha_pm", "F_w", "p_hp") and p.weight > LEAST_LOAD * p.crane.SWL * G]
    for test, same in by_test(usable).items():
        rows = [_row(law, p, "alpha_pm") for p in same if (law := displacement_by_weight(p)) is not None]
        if not rows:
            continue
        law, alpha, block = stacked(rows)
        fitted = fit((law,), alpha, block)
        if fitted is not None:
            tests[test] = fitted.estimate(0, -1.0)
    return Setting(pooled(list(tests.values())), tests) if tests else None


def make_up_command(part: LogPart, standing: bool) -> FloatArray | None:
    """Setting that the make-up law and the servo give the passive pumps, (n,) [-], NaN while the slow mean settles and
    where the command is at an end; None where signals have holes. standing: the PLC's pressure is that of the standing
    piston, as in the twin (p_hp less what flow costs by the file), else p_hp as it is, which a transmitter at the
    motors gives."""
    if (part.kind is not Kind.AHC and not part.has("v_op")) or part.omega_m is None:
        return None
    p, u_m = (bridged(part[name], part.step) for name in ("p_hp", "alpha_pm"))
    if standing:
        p = p - passive_of(part.crane).accumulator.R_piston * flow(part)
    v_op = bridged(part["v_op"], part.step) if part.has("v_op") else np.zeros(part.n)
    if not all(np.isfinite(x).all() for x in (p, u_m, v_op, part.r_eff)):
        return None
    s, tau = part.params.passive.settings, part.params.plc.tau_p
    u = s.K_acc * (s.p_set - filtered(p, tau, part.step)) + s.D_m_max * u_m * v_op / part.r_eff / s.Q_p_max
    free = (np.abs(u) < 0.9) & (part.t > SETTLING * tau)
    return np.where(free, followed(np.clip(u, -1.0, 1.0), part.params.passive.pump_servo, part.step), np.nan)


def make_up(parts: Sequence[LogPart]) -> MakeUp | None:
    """Gain and offset of the passive pumps' setting over the make-up law; None where it was not logged or the command
    hardly moves. Of the two places that the PLC's pressure may be from, the one that explains the setting better."""
    fits = [x for x in (_made_up(parts, standing) for standing in (True, False)) if x is not None]
    _, moves, result = min(fits, key=lambda x: x[0], default=(0.0, 0.0, None))
    return result if moves > LEAST_ORDER else None


def _made_up(parts: Sequence[LogPart], standing: bool) -> tuple[float, float, MakeUp] | None:
    """What is left of the setting (rms), scatter of the law's [-], gain and offset."""
    rows, settings = [], None
    for p in parts:
        if p.has("alpha_pp", "alpha_pm", "p_hp") and (law := make_up_command(p, standing)) is not None:
            rows.append(_row(law, p, "alpha_pp"))
            settings = p.params.passive.settings
    if settings is None:
        return None
    law, alpha, block = stacked(rows)
    fitted = fit((law, np.ones_like(law)), alpha, block)
    if fitted is None:
        return None
    make_up = MakeUp(fitted.estimate(0, -1.0), float(fitted.b[1]) / settings.K_acc)
    return fitted.sd, float(np.nanstd(law)), make_up


def _row(law: FloatArray, part: LogPart, name: str) -> tuple[NDArray[Any], ...]:
    """A law, the measured setting and the blocks of time every EVERY seconds."""
    every = max(1, round(EVERY / part.step))
    return law[::every], part[name][::every], part.blocks(part.t[::every])
