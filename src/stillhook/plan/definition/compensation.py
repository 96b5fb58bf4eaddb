"""What the winch may be taken for: no compensation, the flat cap, and the twin under each controller."""

from __future__ import annotations

from enum import StrEnum


class Alternative(StrEnum):
    """One way to reckon the winch; the limits of all of them stand side by side."""

    NONE = "none"
    CAP = "cap-80"
    NS = "ns"
    HS = "hs"
    SSC = "ssc"
    STRONG_SSC = "strong-ssc"

    @property
    def twin(self) -> bool:
        """Whether the twin computes the compensation (else it is 0, or the flat cap of
        `stillhook.spec.validity.CAP`)."""
        return self not in (Alternative.NONE, Alternative.CAP)
