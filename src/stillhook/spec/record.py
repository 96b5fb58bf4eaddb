"""What tables of scenarios, lifts and plans have in common."""

from typing import Any

from pydantic import ConfigDict, ValidationError

from stillhook.errors import ScenarioError
from stillhook.tables.html import record_html
from stillhook.tables.plausible import Ranged
from stillhook.tables.table import refused_by


class Record(Ranged):
    """A table of a scenario: frozen, and closed to unknown fields."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as e:
            raise refused_by(e, type(self), data, type(self).__name__, ScenarioError) from None

    def _repr_html_(self) -> str:
        """Its numbers with their units, for a notebook."""
        return record_html(self)
