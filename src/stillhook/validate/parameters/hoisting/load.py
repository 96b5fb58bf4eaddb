"""Load cell against the stated load: gain, and the unit whose factor would explain it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.physics.scalar import G
from stillhook.statistics.estimate import Estimate
from stillhook.statistics.jackknife_regression import fit
from stillhook.units import KINDS, in_unit, number, show
from stillhook.validate.parameters.segments import LogPart, by_test

LIGHT = 0.1
"""Load with hook over the safe working load from which a load cell is judged [-]: below, its zero error
dominates."""
LIKE_A_UNIT = 0.05
"""Tolerance of a unit's factor [-]: the accuracy of stated loads."""
CLOSE = 0.1
"""Error of the gain below which no wrong unit is considered [-]: kgf and daN differ by 2 %, all others by more."""
UNITS = {
    "N": 1.0,
    "daN": 10.0,
    "kgf": G,
    "lbf": 4.4482216,
    "kN": 1e3,
    "kip": 4448.2216,
    "short tons": 8896.443,
    "t": 1e3 * G,
    "MN": 1e6,
}
"""Units in which load cells are logged [N]."""
AS_WIRE = (0.7, 1.2)
"""Range of excess force over the weight of the wire paid out that is attributed to it [-]: less in water, and loads are
known to some per cent."""
MUCH_WIRE = 0.03
"""Least weight of the wire paid out over that of hook and payload from which it is considered [-]."""


@dataclass(frozen=True)
class Cell:
    """One test. force: mean of the cell [N]; weight: of hook and payload, in water less buoyancy [N]; error: force over
    weight, less 1."""

    test: str
    force: Estimate
    weight: float
    error: Estimate
    load: float
    light: bool


def cells(parts: Sequence[LogPart]) -> tuple[Cell, ...]:
    """The load cell in every test whose load is stated."""
    out = []
    for test, same in by_test([p for p in parts if p.has("F_w") and p.record.test.load is not None]).items():
        F = np.concatenate([p["F_w"][::10] for p in same])
        block = np.concatenate([p.blocks(p.t[::10]) for p in same])
        fitted = fit((np.ones_like(F),), F, block)
        if fitted is None:
            continue
        part = same[0]
        force = fitted.estimate(0)
        error = Estimate.around(force.value / part.weight - 1.0, force.half / part.weight, fitted.blocks)
        light = part.weight < LIGHT * part.crane.SWL * G
        out.append(Cell(test, force, part.weight, error, part.segment.load, light))
    return tuple(out)


def cell_says(readings: Sequence[Cell], parts: Sequence[LogPart]) -> str:
    """Likely cause of the errors of the load cell, in one line; empty where neither wire, unit nor hook would explain
    them."""
    heavy = [c for c in readings if not c.light]
    if not heavy:
        return ""
    gain = math.exp(float(np.mean([math.log(max(abs(1.0 + c.error.value), 1e-9)) for c in heavy])))
    if all(c.error.value < -1.0 for c in heavy):
        return "it reads the load as negative: set sign = -1 in its row of the mapping"
    wire = _wire(heavy, parts)
    if wire:
        return wire
    if abs(gain - 1.0) > CLOSE:
        return _unit(gain, parts) or f"its gain is {number(gain, 3)}: check scale, unit and parts of line"
    return _tare(heavy, parts[0])


def _wire(heavy: Sequence[Cell], parts: Sequence[LogPart]) -> str:
    """Whether the cell also carries the wire paid out: more force than stated in every test, by about the weight of its
    wire."""
    out, m_wire = {p.test: p.segment.s_w for p in parts}, parts[0].params.hoist.drum.m_wire
    weight = np.array([m_wire * out[c.test] * G for c in heavy])
    more = np.array([c.force.value - c.weight for c in heavy])
    if not (weight > MUCH_WIRE * np.array([c.weight for c in heavy])).any():
        return ""
    if ((more < AS_WIRE[0] * weight) | (more > AS_WIRE[1] * weight)).any():
        return ""
    return (
        f"it also carries the wire paid out, {show(float(weight.max()) / G, 'mass', 3)} at most: state payload and"
        " depth,"
        " or a load that includes the weight of the wire"
    )


def _unit(gain: float, parts: Sequence[LogPart]) -> str:
    """The unit that the column is in if its factor explains the gain."""
    mapping = next((p.record.log.mapping for p in parts if p.record.log.mapping), None)
    row = mapping.get("F_w") if mapping else None
    read = row.unit if row is not None and row.unit in KINDS["force"].allowed else "kN"
    factor = (row.scale if row is not None else 1.0) / in_unit(
        1.0, read, "force"
    )  # N of one number in the column, as it was read
    known = {**UNITS, "% of the SWL": parts[0].crane.SWL * G / 100.0}
    name, newton = min(known.items(), key=lambda u: abs(math.log(factor / gain / u[1])))
    if abs(math.log(factor / gain / newton)) > LIKE_A_UNIT:
        return ""
    return f"the column is in {name} and was read as {read}: it shows {number(gain, 3)} times the load"


def _tare(heavy: Sequence[Cell], part: LogPart) -> str:
    """Whether the hook is tared, or counted twice."""
    hook = part.crane.hook_mass * G
    missing = np.array([c.weight - c.force.value for c in heavy])
    if (np.abs(missing - hook) < 0.3 * hook).all():
        return f"it is tared: the hook's {show(part.crane.hook_mass, 'mass')} are missing in every test"
    return ""
