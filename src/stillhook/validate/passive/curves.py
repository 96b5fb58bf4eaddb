"""Curves of the passive circuit along a part of a log: oil displaced by the motors, and their torque."""

from __future__ import annotations

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.series import low_pass
from stillhook.validate.parameters.segments import LogPart
from stillhook.validate.parameters.slopes import bridged, integral, means, rates
from stillhook.winches.circuits.tables import PassiveCircuit

DRY = 0.05
"""Flow over which dry friction changes its side, over the flow of all active pumps [-]: the piston then creeps."""


def passive_of(part: LogPart) -> PassiveCircuit:
    """The passive circuit of the crane file. Callers have a crane with one."""
    passive = part.crane.passive
    assert passive is not None
    return passive


def flow(part: LogPart) -> FloatArray:
    """Oil flow into the accumulator about its mean, (n,) [m^3/s]: that of the passive motors, D_pm alpha_pm omega_m,
    lowering positive, and that of make-up. Leakage is in the mean: it changes little with the pressure."""
    assert part.omega_m is not None
    motors = -passive_of(part).motor.D_total * bridged(part["alpha_pm"], part.step) * bridged(part.omega_m, part.step)
    pumps = made_up(part)
    return np.asarray(motors + pumps - np.nanmean(pumps))


def made_up(part: LogPart) -> FloatArray:
    """Flow of the make-up pumps, (n,) [m^3/s], but for a constant: by their logged setting, else by the law on the
    logged pressure.

    Some per cent of a wave's oil, and about square to it: enough to turn the piston's dry friction at another moment.
    """
    settings, step = part.params.passive.settings, part.step
    if part.has("alpha_pp"):
        return np.asarray(settings.Q_p_max * bridged(part["alpha_pp"], step))
    mean = filtered(filled(part["p_hp"]), part.params.plc.tau_p, step)
    u = settings.K_acc * (float(np.mean(mean)) - mean)
    if part.has("v_op"):
        u = (
            u
            + settings.D_m_max
            * bridged(part["alpha_pm"], step)
            * bridged(part["v_op"], step)
            / part.r_eff
            / settings.Q_p_max
        )
    return np.asarray(settings.Q_p_max * np.clip(u, -1.0, 1.0))


def filtered(x: FloatArray, tau: float, step: float) -> FloatArray:
    """First-order filter of the PLC, cycle by cycle, starting on the first sample. As
    `stillhook.control.plc.low_pass`."""
    return low_pass(x, step / (tau + step))


def filled(x: FloatArray) -> FloatArray:
    """The signal with every hole bridged: only for slow means of it."""
    known = np.isfinite(x)
    return x if known.all() else np.interp(np.arange(len(x)), np.flatnonzero(known), x[known])


def oil(part: LogPart) -> FloatArray:
    """Oil that has gone into the accumulator since the start of the part, but for a constant flow, (n,) [m^3]."""
    return integral(flow(part), part.step)


def dry(Q: FloatArray, part: LogPart) -> FloatArray:
    """Side of the piston's dry friction at a flow [m^3/s], -1 to 1, (n,)."""
    pump = part.crane.active.pump
    return np.asarray(np.tanh(Q / (DRY * pump.D_total * pump.omega_p)))


def mean_every(x: FloatArray, part: LogPart, width: float) -> FloatArray:
    """Means of a signal over a width [s], one a width, its short holes bridged."""
    return means(bridged(x, part.step), part.step, width)


def rate_every(x: FloatArray, part: LogPart, width: float) -> FloatArray:
    """Rates of such means [1/s]."""
    return rates(bridged(x, part.step), part.step, width)
