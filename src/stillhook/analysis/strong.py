"""Strong SSC: semi-secondary control with all the position gain that the margins allow, and a reference that is not late.

Published SSC keeps K_p = 0.16 1/m, a sixth of the gain at which the winch would swing, and compares the wire with a tip motion that is
older than the command is when it acts. A controller that is to replace SSC has to beat SSC without these two handicaps.
"""

from __future__ import annotations

import math

from stillhook.analysis.controllers import STRONG, Changes, Controller
from stillhook.analysis.governing import governing
from stillhook.analysis.linear import eigenfrequency
from stillhook.crane import Crane
from stillhook.errors import StillhookError
from stillhook.scenario import Mode

LONGEST_DELAY = 1.0
"""Delay of the motion signal beyond which holding the tip's acceleration says nothing about its motion [s]: an eighth of a short wave."""


def strong_ssc(crane: Crane, *, delay: float = 0.0) -> Controller:
    """SSC with the strongest position gain, its reference aligned in time, for a motion signal that is `delay` [s] late.

    K_p: the largest gain that keeps a gain margin of 2, a phase margin of 45 degrees and a sensitivity peak of 2 with the PLC's cycle, in
    the published loop at the least displacement SSC may use on the outermost layer and in the whole plant where it is slow, from the
    empty hook to the SWL (`stillhook.analysis.governing`). The delay of the motion unit lies outside the position loop and does not
    lower it. t_lead: `lateness`. All else is the crane's own.

    Errors: StillhookError for a delay outside 0 to 1 s.
    """
    return Controller(STRONG, Mode.SSC, strong_changes(crane, delay=delay))


def strong_changes(crane: Crane, *, delay: float = 0.0) -> Changes:
    """What strong SSC changes on this crane, in the form of a crane file; see `strong_ssc`."""
    K_p = governing(crane, Mode.SSC).K_p
    rounded = math.floor(K_p * 1e4) / 1e4  # down, so that the margins are kept
    return {"control": {"K_p": f"{rounded:.4f} 1/m", "t_lead": f"{1e3 * lateness(crane, delay=delay):.4g} ms"}}


def lateness(crane: Crane, *, delay: float = 0.0) -> float:
    r"""Time by which the winch moves later than the measured tip says, once K_2 has made up for the pumps [s].

    .. math:: t_{lead} = t_{delay} + \tfrac12 t_{cycle} + t_{compute} + \frac{2 \zeta_0}{\omega_0}

    A command is held for a cycle, so on the mean it is half a cycle old, and it comes a computing time late. K_2 = K_1 2 zeta_p / omega_np
    takes the first-order lag of the pumps. What is left is that of the oil, whose transfer function 1 / (1 + 2 zeta_0 s / omega_0 +
    s^2 / omega_0^2) lags by 2 zeta_0 / omega_0 at the slow frequencies of waves; here at full displacement, where it is least.

    Parameters: crane; delay of the motion signal, which the PLC is taken to know [s].
    Errors: StillhookError for a delay outside 0 to 1 s.
    Source: linear model of Moslatt 2020 paper C eqs 8 and 9, paper E eq. 17; the thesis extrapolates nothing.
    Valid: leakage also makes the winch slow, in proportion to speed rather than by a time; that is K_1's to make up (`stillhook tune`).
    """
    if not 0.0 <= delay <= LONGEST_DELAY:
        raise StillhookError(f"delay = {delay:g} s: allowed is 0 up to {LONGEST_DELAY:g} s.")
    oil = eigenfrequency(crane, 1.0)
    return delay + 0.5 * crane.control.t_cycle + crane.control.computing + 2.0 * oil.zeta / oil.omega_0
