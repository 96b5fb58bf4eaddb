"""Accuracy of the parameters of a set, and its data: covariance, ranges of the data, and what they cannot
tell."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, ValidationError, field_validator, model_validator

from stillhook import units as u
from stillhook.base.arrays import FloatArray
from stillhook.errors import SpecError
from stillhook.library.toml.explain import explain
from stillhook.library.toml.tree import EVIDENCE
from stillhook.tables.table import Number, Spec, Text

SYMMETRY = 1e-6
"""Relative difference across the diagonal that is rounding of a written matrix."""
SEMIDEFINITE = 1e-6
"""Most negative eigenvalue of the correlations that is rounding of a written matrix."""
RANGES = {"omega_m": "rotation", "T_d": "drum_torque", "dp_m": "pressure", "D_m": "displacement"}
"""Ranges that the data may name, and their kinds of quantity."""

Row = Annotated[tuple[Number, ...], Field(min_length=1)]
Pair = Field(default=None, description="range of the data")


class Evidence(Spec):
    """Data that a set was fitted to. covariance in SI, rows and columns in the order of names; dof degrees of freedom
    left by the fit; omega_m, T_d, dp_m, D_m ranges of the data; statements what the data cannot determine, one sentence
    each."""

    names: tuple[Text, ...] = Field(min_length=1, description="parameters that were fitted")
    covariance: tuple[Row, ...] = Field(
        min_length=1, description="covariance of the parameters in SI, in the order of names"
    )
    dof: Number = Field(gt=0, description="degrees of freedom of the fit")
    data: Text = Field(description="data of the fit")
    omega_m: tuple[u.Rotation, u.Rotation] | None = Pair
    T_d: tuple[u.Torque, u.Torque] | None = Pair
    dp_m: tuple[u.Pressure, u.Pressure] | None = Pair
    D_m: tuple[u.Displacement, u.Displacement] | None = Pair
    statements: tuple[Text, ...] = Field(default=(), description="what the data cannot determine")

    @field_validator(*RANGES)
    @classmethod
    def _rises(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        if value is not None and value[0] > value[1]:
            raise ValueError("its second value is below its first. Write the lower end first.")
        return value

    @model_validator(mode="after")
    def _is_a_covariance(self) -> Self:
        n = len(self.names)
        if len(set(self.names)) < n:
            raise ValueError("names: a name comes twice. Name each parameter once.")
        if len(self.covariance) != n or any(len(row) != n for row in self.covariance):
            sizes = (
                f"{len(self.covariance)} rows of"
                f" {', '.join(str(s) for s in sorted({len(row) for row in self.covariance}))}"
            )
            raise ValueError(f"covariance: {sizes} values for {n} names. Give {n} rows of {n}.")
        if problem := _not_a_covariance(self.matrix):
            raise ValueError(f"covariance: {problem}")
        return self

    @classmethod
    def fitted(
        cls,
        names: Sequence[str],
        covariance: FloatArray,
        *,
        dof: float,
        data: str,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        statements: Sequence[str] = (),
    ) -> Evidence:
        """The evidence of a fit from its numbers, all in SI; ranges by the names of `RANGES`. Errors: SpecError, one
        line."""
        ends = {k: [f"{float(x)!r} {u.KINDS[RANGES[k]].si}" for x in pair] for k, pair in (ranges or {}).items()}
        table = {
            "names": list(names),
            "covariance": np.asarray(covariance, dtype=np.float64).tolist(),
            "dof": float(dof),
            "data": data,
        }
        evidence = evidence_of({**table, **ends, "statements": list(statements)}, tuple(names), "fit")
        assert evidence is not None
        return evidence

    @property
    def matrix(self) -> FloatArray:
        """The covariance, shape (n, n), SI."""
        return np.array(self.covariance, dtype=np.float64)

    def deviation(self, name: str) -> float:
        """Standard deviation of a parameter [SI]; 0 where it was not fitted."""
        return math.sqrt(self.covariance[self.names.index(name)][self.names.index(name)]) if name in self.names else 0.0


def _not_a_covariance(C: FloatArray) -> str:
    """Why a square matrix is no covariance; "" where it is one."""
    scale = np.sqrt(np.abs(np.diag(C)))
    if np.any(np.diag(C) < 0.0):
        return "a variance on its diagonal is negative. Give variances and covariances."
    unit = np.where(scale > 0.0, scale, 1.0)
    R = C / np.outer(unit, unit)
    if np.max(np.abs(R - R.T)) > SYMMETRY:
        return "it is not symmetric. Give the covariance of each pair twice."
    least = float(np.linalg.eigvalsh(0.5 * (R + R.T))[0])
    if least < -SEMIDEFINITE:
        return (
            f"it is not positive semidefinite (least eigenvalue of its correlations {least:.3g}). Give a covariance"
            " matrix."
        )
    return ""


def evidence_of(table: Any, allowed: tuple[str, ...], label: str) -> Evidence | None:
    """The evidence in a set's file, None where there is none; allowed names of its parameters. Errors: SpecError,
    UnitError, one line."""
    if table is None:
        return None
    if not isinstance(table, Mapping):
        raise SpecError(
            f"{label}: {EVIDENCE} = {u.quote(table)}: must be a table, with {', '.join(Evidence.model_fields)}."
        )
    try:
        evidence = Evidence.model_validate(table)
    except ValidationError as error:
        raise explain(error, Evidence, f"{label}: {EVIDENCE}", table) from None
    for name in evidence.names:
        if name not in allowed:
            raise SpecError(f"{label}: {EVIDENCE}.names: {u.quote(name)} is not one of {', '.join(allowed)}.")
    return evidence
