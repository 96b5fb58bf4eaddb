"""A PLC against the library: the inputs that it saw go through the library's controller, and outputs are compared.

Equal inputs give equal outputs, to the last digits. Where a log or a bus rounds, the PLC had other inputs than the log
says; by how much the outputs may differ for that is found by running the controller on inputs that differ at random
within the rounding. A difference beyond `MARGIN` times of that is one of the controller, its settings or its cycle.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LiveError
from stillhook.live.hil.controller import INPUTS, OUTPUTS, SIGNALS, LibraryController
from stillhook.live.hil.plc_log import Recorded, Step, unit
from stillhook.live.hil.script import kind_of_input
from stillhook.spec.crane import Crane
from stillhook.units import parse

ARITHMETIC = 1.0e-9
"""Difference, over the largest size of an output, that follows from the order in which numbers are added. Measured with
compiled Structured Text: below 1e-11 in 6,000 cycles."""
DRAWS = 8
MARGIN = 3.0
"""Runs with other roundings, and how far beyond the largest of their differences a PLC may be."""
WINDOW = 1.0
"""Time on both sides from which the differences of those runs count [s]: a mode may change a cycle earlier."""
SEED = 1
STATES = ("mode", "reset", *(name for name in INPUTS if name.startswith("q_")))
"""Inputs that are never rounded."""
FLOAT32 = "float32"


class Difference(NamedTuple):
    """An output: largest difference, PLC less library; how much rounding explains there; the first cycle in which
    rounding does not, -1 where it always does, with what PLC and library gave in it [SI]."""

    name: str
    unit: str
    largest: float
    explained: float
    first: float
    plc: float
    library: float

    @property
    def verdict(self) -> str:
        """In a word or two."""
        if self.first >= 0.0:
            return f"differs from cycle {self.first:.0f}"
        return "equal" if self.largest == 0.0 else "rounding"


class Comparison(NamedTuple):
    """cycles that were compared; the outputs of the log; those that it has not; steps to which its numbers are rounded,
    [SI], by name; begins: mode of the first cycle."""

    cycles: int
    outputs: tuple[Difference, ...]
    absent: tuple[str, ...]
    steps: Mapping[str, Step]
    begins: float

    @property
    def same(self) -> bool:
        """Whether PLC and library give the same, but for rounding."""
        return all(d.first < 0.0 for d in self.outputs)


def compare(crane: Crane, mode: str, recorded: Recorded, steps: Mapping[str, Step]) -> Comparison:
    """Compare a recorded PLC with a controller on a crane. steps: roundings [SI] by name of input or output."""

    controller = LibraryController(crane, mode)

    def made(inputs: FloatArray) -> FloatArray:
        controller.start()
        return controller.cycles(inputs)

    nominal = made(recorded.inputs)
    deviation = {
        name: np.where(np.isfinite(column), column - nominal[:, OUTPUTS.index(name)], math.inf)
        for name, column in recorded.outputs.items()
    }
    allowed = {name: _allowed(nominal[:, OUTPUTS.index(name)], steps.get(name)) for name in deviation}
    if any((np.abs(deviation[name]) > allowed[name]).any() for name in deviation):
        reach = max(1, round(WINDOW / crane.control.t_cycle))
        spread = _spread(made, nominal, recorded.inputs, steps)
        for name in allowed:
            allowed[name] = allowed[name] + MARGIN * _widest(spread[:, OUTPUTS.index(name)], reach)
    differences = tuple(
        _difference(name, recorded, nominal[:, OUTPUTS.index(name)], deviation[name], allowed[name])
        for name in deviation
    )
    absent = tuple(name for name in OUTPUTS if name not in deviation)
    return Comparison(len(nominal), differences, absent, steps, float(recorded.inputs[0, SIGNALS.index("mode")]))


def _difference(name: str, recorded: Recorded, own: FloatArray, of: FloatArray, allowed: FloatArray) -> Difference:
    size = np.abs(of)
    worst, beyond = int(np.argmax(size)), np.flatnonzero(size > allowed)
    k = int(beyond[0]) if beyond.size else -1
    first = float(recorded.cycles[k]) if k >= 0 else -1.0
    plc, library = (float(recorded.outputs[name][k]), float(own[k])) if k >= 0 else (math.nan, math.nan)
    return Difference(name, unit(name), float(of[worst]), float(allowed[worst]), first, plc, library)


def _allowed(own: FloatArray, step: Step | None) -> FloatArray:
    """How far an output may be off for its own rounding and for arithmetic."""
    base = np.full(len(own), ARITHMETIC * max(1.0, float(np.abs(own).max())))
    return base if step is None else base + step.half(own)


def _spread(
    made: Callable[[FloatArray], FloatArray], nominal: FloatArray, inputs: FloatArray, steps: Mapping[str, Step]
) -> FloatArray:
    """Largest difference of outputs, cycle by cycle, for inputs within their rounding."""
    rng = np.random.default_rng(SEED)
    widest = np.zeros_like(nominal)
    rounded = [(i, steps[name]) for i, name in enumerate(INPUTS) if name in steps and name not in STATES]
    for _ in range(DRAWS if rounded else 0):
        other = inputs.copy()
        for i, step in rounded:
            other[:, i] += step.half(inputs[:, i]) * rng.uniform(-1.0, 1.0, len(inputs))
        widest = np.maximum(widest, np.abs(made(other) - nominal))
    return widest


def _widest(values: FloatArray, reach: int) -> FloatArray:
    """Largest value within so many cycles on both sides."""
    from scipy.ndimage import maximum_filter1d

    out: FloatArray = maximum_filter1d(values, 2 * reach + 1, mode="nearest")
    return out


def stated_steps(table: Mapping[str, Any], where: str) -> dict[str, Step]:
    """The table [resolution] of a PLC file: steps with their units, or "float32". Errors: LiveError, UnitError."""
    steps = {}
    for name, text in table.items():
        place = f"{where}: resolution.{name}"
        if name not in (*SIGNALS, *OUTPUTS):
            raise LiveError(f"{place}: no input or output. Choose one of {', '.join((*SIGNALS, *OUTPUTS))}.")
        if text == FLOAT32:
            steps[name] = Step(0.0, 2.0**-24)
            continue
        kind = "length" if name == "e_c" else kind_of_input(name)
        number = parse(text, kind, place) if kind else text
        if isinstance(number, bool) or not isinstance(number, int | float) or not 0.0 <= number < math.inf:
            raise LiveError(f'{place} = {text!r}: give a step, a number from 0 on, or "{FLOAT32}".')
        steps[name] = Step(float(number), 0.0)
    return steps
