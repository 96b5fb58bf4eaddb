"""What the winch may be taken for: no compensation, the flat cap, and the twin under each controller."""

from __future__ import annotations

from enum import StrEnum

from stillhook.analysis.controllers import STRONG
from stillhook.control.registry import USUAL, Mode


class Alternative(StrEnum):
    """One way to account for the winch; the limits of all of them are listed side by side. Beside no compensation and
    the flat cap there is one for each controller."""

    NONE = "none"
    CAP = "cap-80"
    vars().update({mode.name: mode.value for mode in Mode if mode.compensates})
    STRONG_SSC = STRONG

    @property
    def twin(self) -> bool:
        """Whether the twin computes the compensation (else it is 0, or the flat cap of
        `stillhook.spec.validity.CAP`)."""
        return self not in (Alternative.NONE, Alternative.CAP)

    @property
    def classic(self) -> bool:
        """Whether it is a classic controller, whose motors have a fixed displacement."""
        return self.value in list(Mode) and Mode(self.value).law.family == "classic"

    @property
    def label(self) -> str:
        """What tables and pictures call it."""
        if self is Alternative.STRONG_SSC:
            return "strong SSC"
        return Mode(self.value).law.label if self.twin else {"none": "none", "cap-80": "80 % cap"}[self.value]


ALTERNATIVES = (Alternative.NONE, Alternative.CAP, *(Alternative(mode.value) for mode in USUAL), Alternative.STRONG_SSC)
"""Alternatives of a plan that names none."""
