"""Errors of pydantic in a file, as one line: where, what came, what is allowed, what to do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from stillhook.errors import ScenarioError, SpecError, StillhookError, UnitError
from stillhook.spec.crane import Crane
from stillhook.tables.problem import first_problem

_BASE = ", or start the file with base = <crane of the library>."


def explain(
    error: ValidationError,
    model: type[BaseModel],
    where: str,
    data: Mapping[str, Any],
    raised: type[StillhookError] = SpecError,
) -> StillhookError:
    """The first problem of a validation of ``data`` as one line, with the number of further ones.

    An error of its own class: UnitError for a quantity, that of what a field names; `raised` for the rest.
    """
    problem = first_problem(error, model, data)
    line = problem.line
    if problem.kind == "missing" and issubclass(model, Crane):
        line = line.removesuffix(".") + _BASE
    more = f" (and {problem.total - 1} more)" if problem.total > 1 else ""
    if problem.kind == "unit":
        raised = UnitError
    elif problem.cause is not None and not isinstance(problem.cause, ScenarioError):
        raised = type(problem.cause)
    return raised(f"{where}: {line}{more}" if where else line + more)
