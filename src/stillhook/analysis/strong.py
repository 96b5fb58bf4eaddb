"""Strong SSC: semi-secondary control with all the position gain that the margins allow, and a reference that is not late."""

from __future__ import annotations

from stillhook.analysis.controllers import STRONG, Changes, Controller
from stillhook.analysis.linear import gain_limit
from stillhook.crane import Crane
from stillhook.scenario import Mode

GAIN_MARGIN = 2.0
"""Least gain margin [-]: the loop gain may double before the winch swings."""


def strong_changes(crane: Crane, *, delay: float = 0.0) -> Changes:
    """What strong SSC changes on this crane."""
    K_p = gain_limit(crane, crane.active.motor.alpha_min).K_p_ms / GAIN_MARGIN
    return {"control": {"K_p": f"{K_p:.6g} 1/m", "t_lead": f"{delay + 0.5 * crane.control.t_cycle:.6g} s"}}


def strong_ssc(crane: Crane, *, delay: float = 0.0) -> Controller:
    """SSC with the strongest position gain, its reference aligned for a motion signal that is `delay` [s] late."""
    return Controller(STRONG, Mode.SSC, strong_changes(crane, delay=delay))
