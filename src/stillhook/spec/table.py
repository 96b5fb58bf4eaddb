"""What every table of a crane file is made of: closed, frozen records, and where a number is from."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from pydantic import ConfigDict, Field

from stillhook.spec.plausible import Ranged

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Fraction = Annotated[Number, Field(gt=0, le=1)]
Count = Annotated[int, Field(strict=True, ge=1, le=1000)]
Text = Annotated[str, Field(min_length=1)]


class Spec(Ranged):
    """A table of a crane file: frozen, and closed to unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class SourceKind(StrEnum):
    """How far a number can be trusted."""

    PUBLISHED = "published"
    DATASHEET = "datasheet"
    FITTED = "fitted"
    DERIVED = "derived"
    ASSUMED = "assumed"
    USER = "user"


class Source(Spec):
    """Where a number is from."""

    text: Text
    kind: SourceKind
