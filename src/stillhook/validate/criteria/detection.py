"""Detection limits: the smallest size of each defect that the method detects, from trials with simulated cranes.
Certificates print them."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

LIMITS_FILE = Path(str(files("stillhook.validate.criteria") / "detection_limits.toml"))
"""Written by docs/validation/detection_limits.py from docs/validation/truth-trials.json."""
NONE = "This version contains no trials with known defects: the detection limits are not known."


@dataclass(frozen=True)
class DetectionLimit:
    """A defect of one sign. smallest: smallest size at which every campaign with it was refused or named [SI], None
    where not even the largest one was; largest that was tried; smallest_text, largest_text the defect in words at these
    sizes; campaigns that were tried.
    """

    defect: str
    smallest: float | None
    largest: float
    smallest_text: str
    largest_text: str
    campaigns: int


@dataclass(frozen=True)
class DetectionLimits:
    """All defects tested; code that computed, date of the newest campaign; number of campaigns of healthy cranes and
    how many were refused."""

    code: str
    date: str
    healthy: int
    refused: int
    limits: tuple[DetectionLimit, ...]

    def sentences(self) -> Iterator[str]:
        """Text of the certificate."""
        if not self.limits:
            yield NONE
            return
        when = ", ".join(filter(None, (self.date, f"code {self.code}")))
        yield (
            f"Tried on simulated cranes with one defect each ({when}). Of {self.healthy} such cranes without a defect"
            f" {self.refused} were refused. A real crane differs in more than these cranes do: its limits may be"
            " larger."
        )
        detected = [limit for limit in self.limits if limit.smallest is not None]
        yield from (
            f"Detected at this size and above, in all {i.campaigns} campaigns: {i.smallest_text}." for i in detected
        )
        yield from (
            f"Not detected: {i.largest_text} (the largest size tried)." for i in self.limits if i.smallest is None
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, sizes in SI."""
        return {**asdict(self), "limits": [asdict(limit) for limit in self.limits]}


@functools.cache
def detection_limits() -> DetectionLimits:
    """The table of this version."""
    data = tomllib.loads(LIMITS_FILE.read_text(encoding="utf-8"))
    rows = (DetectionLimit(**{"smallest": None} | row) for row in data.get("limit", []))
    return DetectionLimits(data["code"], data["date"], data["healthy"], data["refused"], tuple(rows))
