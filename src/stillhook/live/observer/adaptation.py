"""Which friction factor the twin runs with: it follows the estimate in small steps, and goes back to the certified
one as soon as there is a reason to.

The certified factor is 1: a certificate is of the crane file as it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from stillhook.engine.certificate import NO_CERTIFICATE, objections
from stillhook.live.observer.panel import Proposal
from stillhook.live.observer.settings import AdaptSettings
from stillhook.spec.crane import Crane

CERTIFIED = 1.0
"""Factor on the system friction that a certificate is of [-]."""
DEADBAND = 0.01
"""Difference to the estimate that is left [-]: a third of the estimate's own interval."""
CONFIRM = 240.0
"""Time within which an estimate must confirm a factor from before a start [s]: the clock takes 60 s, and eight half
waves as long."""
SILENT = 10.0
"""Age of a proposal from which the observer says nothing [s]."""
REST, LONGEST_REST, GOOD = 60.0, 3600.0, 600.0
"""Time after a withdrawal for which the factor stays certified, so that it does not flicker: doubled each time up to
the longest, and from new after so long at the estimate [s]. A step of friction needs none: its estimate begins
again."""
SETTLED = 40.0
"""Time at the estimate after which a deviation that is an alarm counts against the factor [s]: two windows of
deviations. Before that the twin is still on its way, and the alarm may be what the factor is about."""


class Change(NamedTuple):
    """A change of the factor, with the interval of the estimate behind it (NaN without one) and the reason."""

    old: float
    new: float
    low: float
    high: float
    reason: str

    @property
    def text(self) -> str:
        """One line."""
        of = f" (95 %: {self.low:.3f} to {self.high:.3f})" if math.isfinite(self.low) else ""
        return f"Friction factor from {self.old:.3f} to {self.new:.3f}{of}: {self.reason}."


def not_allowed(crane: Crane) -> str:
    """Why no factor at all may be applied to a crane; empty where its certificate allows some."""
    if crane.certified is None:
        return NO_CERTIFICATE
    if against := objections(crane):
        return f"certificate does not hold: {', '.join(against)}"
    if crane.certified.synthetic:
        return f"certificate {crane.certified.short} is SYNTHETIC: validated on simulated logs, not on a crane"
    return ""


class Adaptation:
    """The factor in force. Parameters: settings; value: the one from before a start, which an estimate must confirm;
    now [s]. Times are of one clock."""

    def __init__(self, settings: AdaptSettings, value: float, now: float) -> None:
        self._settings = settings
        self.value = value
        self._deadline = now + CONFIRM
        self._changed = self._rest = -math.inf
        self._arrived = math.inf
        self._blocked = False
        self._withdrawn = 0
        self._steps = 0

    def begin_again(self, now: float) -> None:
        """The observer ended, and its next one has seen no step yet: it gets time to confirm the factor, once."""
        self._steps = 0
        if self._deadline == -math.inf:
            self._deadline = now + CONFIRM

    def next(self, proposal: Proposal | None, now: float) -> Change | None:
        """What is to change at a time, if anything."""
        if proposal is None or now - proposal.time > SILENT:
            return self._lost("the observer is silent", now)
        self._blocked = self._blocked and bool(proposal.deviating)
        if proposal.steps > self._steps:
            self._steps = proposal.steps
            if self.value != CERTIFIED:
                return self._withdraw(f"alarm: {proposal.step.rstrip('.')}", now, rests=False)
        if proposal.deviating and self.value != CERTIFIED and now - self._arrived > SETTLED:
            self._blocked = True
            return self._withdraw(f"alarm: {proposal.deviating} deviates although the factor is the estimate", now)
        if not proposal.known:
            return self._lost(f"no estimate: {proposal.reason}", now)
        if proposal.value is None:
            return self._withdraw(proposal.reason, now) if self.value != CERTIFIED else None
        return self._follow(proposal, proposal.value, now)

    def _lost(self, reason: str, now: float) -> Change | None:
        if self.value == CERTIFIED or now < self._deadline:
            return None
        return self._withdraw(reason, now, rests=False)

    def _withdraw(self, reason: str, now: float, *, rests: bool = True) -> Change:
        if rests:
            self._withdrawn = 0 if now - self._arrived > GOOD else self._withdrawn
            self._rest = now + min(REST * 2.0**self._withdrawn, LONGEST_REST)
            self._withdrawn += 1
        return self._change(CERTIFIED, math.nan, math.nan, f"withdrawn, {reason}", now)

    def _follow(self, proposal: Proposal, wanted: float, now: float) -> Change | None:
        self._deadline = -math.inf
        if self._blocked or now < self._rest or now - self._changed < self._settings.every:
            return None
        if abs(wanted - self.value) < DEADBAND:
            self._arrived = min(self._arrived, now)
            return None
        step = min(max(wanted - self.value, -self._settings.step), self._settings.step)
        reason = f"estimate {wanted:.3f}"
        return self._change(self.value + step, proposal.low, proposal.high, reason, now)

    def _change(self, new: float, low: float, high: float, reason: str, now: float) -> Change:
        change = Change(self.value, new, low, high, reason)
        self.value, self._changed, self._arrived = new, now, math.inf
        return change
