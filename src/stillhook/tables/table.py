"""What every table of a file that users write is made of: closed, frozen records, and where a number is from."""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator, ConfigDict, Field, ValidatorFunctionWrapHandler, WrapValidator
from pydantic_core import PydanticCustomError

from stillhook.errors import StillhookError
from stillhook.tables.plausible import Ranged

LARGEST = 1e12
"""Pure numbers beyond this size are slips of the pen."""
_PERCENT = re.compile(r"[+-]?[0-9]+(\.[0-9]*)? ?%")


def pure_number(value: object) -> float:
    """A number as it is, or a text such as "3 %" [-]. Errors: ValueError."""
    if isinstance(value, str) and _PERCENT.fullmatch(value.strip()) and abs(float(value.strip()[:-1])) < LARGEST:
        return float(value.strip()[:-1]) / 100.0
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGEST:
        return float(value)
    raise ValueError('give a number, or a text such as "3 %".')


def _refused(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
    """An error of Stillhook as a problem with its place, which `stillhook.tables.problem` puts into one line."""
    try:
        return handler(value)
    except StillhookError as e:
        raise PydanticCustomError("refused", "{problem}", {"problem": str(e), "error": e}) from None


Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Fraction = Annotated[Number, Field(gt=0, le=1)]
Share = Annotated[float, BeforeValidator(pure_number)]
Count = Annotated[int, Field(strict=True, ge=1, le=1000)]
Text = Annotated[str, Field(pattern=r"\S")]
Flag = Annotated[bool, Field(strict=True)]
Inner = TypeVar("Inner")
Part = Annotated[Inner, WrapValidator(_refused)]
"""A table that is a record of its own, or anything else whose validation raises errors of Stillhook."""


class Spec(Ranged):
    """A table of a file that users write: frozen, and closed to unknown fields."""

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
