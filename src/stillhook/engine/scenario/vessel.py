"""The vessel's motion as the input of a session, in place of the tip's, and its motion unit from cycle to cycle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.engine.inputs import MEASURED, MOTION
from stillhook.engine.saved import numbers_in
from stillhook.errors import MotionError, SimulationError
from stillhook.physics.tip_kinematics import Attitude
from stillhook.sea.motion.motion import Motion
from stillhook.sea.vessel.motion_unit import Memory
from stillhook.sea.vessel.vessel_tip import GIVEN, VesselTip

LARGEST = 1e7
"""Largest number of a motion unit in a stored state [SI]."""


class VesselUnit(NamedTuple):
    """The motion unit of a vessel whose motion comes from outside: its memory, and by the names of `GIVEN` what came
    last, with the heave that the unit gave."""

    memory: Memory
    given: Mapping[str, float]


class VesselInputs:
    """The vessel's motion as an input. Parameters: tip of the scenario; h: PLC cycle [s]. unit: None where the present
    motion is the scenario's."""

    def __init__(self, tip: Motion, h: float) -> None:
        self._tip, self._h = tip if isinstance(tip, VesselTip) else None, h
        self.ends_as = {n: of for jet in GIVEN.values() if self._tip for n, of in zip(jet, MOTION, strict=True)}
        self.names = tuple(self.ends_as)
        self.unit: VesselUnit | None = None
        self._scenario: tuple[int, dict[str, float]] = (-1, {})

    def tip(self, inputs: Mapping[str, float], k: int) -> tuple[dict[str, float], VesselUnit | None]:
        """Inputs of cycle k with the tip's motion, and its image, in place of the vessel's, and the motion unit then.
        Errors: SimulationError."""
        given = {name: inputs[name] for name in self.names if name in inputs}
        if self._tip is None or not given:
            return dict(inputs), None
        if "s_tip" in inputs:
            raise SimulationError("Session.step: s_tip and heave: give the motion of the tip or that of the vessel.")
        signals, made = self._tip.signals(self._h), [Memory(k, np.empty(0))]

        def seen(true: Attitude) -> Attitude:
            result, memory = signals.following(signals.begin(k - 1) if self.unit is None else self.unit.memory, true)
            made.append(memory)
            return result

        try:
            *motions, heave = self._tip.of_inputs(given, k * self._h, seen if signals.places else None)
        except MotionError as problem:
            raise SimulationError(f"Session.step: {problem}") from None
        numbers = [x.item() for motion in motions for x in motion]
        others = {name: value for name, value in inputs.items() if name not in given}
        given |= {name: float(np.ravel(x)[0]) for name, x in zip(GIVEN["unit_heave"], heave, strict=True)}
        return {**others, **dict(zip((*MOTION, *MEASURED), numbers, strict=True))}, VesselUnit(made[-1], given)

    def at(self, name: str, k: int) -> float:
        """The vessel's motion by name at the present cycle k: what came, else the scenario's."""
        assert self._tip is not None
        if self.unit is not None and name in self.unit.given:
            return self.unit.given[name]
        if self._scenario[0] != k:
            self._scenario = k, self._tip.inputs_at(k * self._h, self._h)
        return self._scenario[1][name]

    def saved(self) -> tuple[dict[str, Any], FloatArray]:
        """The unit for a saved state: for its head, and numbers."""
        if self.unit is None:
            return {}, np.empty(0)
        return {"vessel": {n: x.hex() for n, x in self.unit.given.items()}}, self.unit.memory.numbers

    def restored(self, head: Mapping[str, Any], numbers: FloatArray, k: int, label: str) -> VesselUnit | None:
        """The unit of a saved state at cycle k. Errors: SimulationError."""
        saved = head.get("vessel")
        count = 0 if saved is None or self._tip is None else self._tip.signals(self._h).places
        if len(numbers) != count:
            raise SimulationError(
                f"{label}: damaged: {len(numbers)} numbers of a motion unit, not {count}. Save it again."
            )
        if saved is None:
            return None
        given = numbers_in("vessel", saved, self.names, label)
        wrong = [x for x in (*numbers.tolist(), *given.values()) if not abs(x) <= LARGEST]
        if wrong:
            raise SimulationError(f"{label}: no state of a motion unit: {wrong[0]:.6g}. Save it again.")
        return VesselUnit(Memory(k, numbers), given)
