"""What a crane test measures, point by point: friction pressure of a hoisting and a lowering stretch of the same
speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import IdentifyError


@dataclass(frozen=True)
class Points:
    """Measured friction, one entry a point; all arrays have shape (n,).

    ``omega_up``, ``omega_down`` motor speeds of the hoisting and of the lowering stretch, both counted positive
    [rad/s]; ``dp_up``, ``dp_down`` pressure drops p_a - p_b of both [Pa]; ``D_m`` displacement of one motor [m^3/rad];
    ``T_d`` drum torque of the hanging load [N m]; ``count`` motors in the circuit [-]; ``u_dp`` standard uncertainty of
    dp_F [Pa]; ``test`` index into ``names``; ``hold_out`` points that no fit may see; ``t_up``, ``t_down`` middle of
    both stretches in the time of their test [s], NaN where no time is known.

    Leakage makes the two speeds of a pair differ, and friction that depends on pressure differs between hoisting and
    lowering. Half the difference of the two pressure drops is the mean of the two losses whatever they are, so a model
    is compared with the mean of its values at (omega_up, dp_up) and (omega_down, dp_down): nothing has to be
    interpolated.
    """

    names: tuple[str, ...]
    test: NDArray[np.intp]
    omega_up: FloatArray
    omega_down: FloatArray
    dp_up: FloatArray
    dp_down: FloatArray
    D_m: FloatArray
    T_d: FloatArray
    count: FloatArray
    u_dp: FloatArray
    hold_out: BoolArray
    t_up: FloatArray = field(default_factory=lambda: np.zeros(0))
    t_down: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        for name in ("t_up", "t_down"):
            if len(getattr(self, name)) != len(self.test):
                object.__setattr__(self, name, np.full(len(self.test), np.nan))

    def __len__(self) -> int:
        return len(self.test)

    @property
    def omega(self) -> FloatArray:
        """Mean speed of the pair [rad/s]."""
        return 0.5 * (self.omega_up + self.omega_down)

    @property
    def dp_F(self) -> FloatArray:
        """Friction as pressure (Moslatt 2020 eq. 2.4) [Pa]."""
        return 0.5 * (self.dp_up - self.dp_down)

    @property
    def dp_L(self) -> FloatArray:
        """Load as pressure, the other half of eqs 2.2 and 2.3 [Pa]; holds half the difference of the two losses as
        well."""
        return 0.5 * (self.dp_up + self.dp_down)

    @property
    def T_f(self) -> FloatArray:
        """Friction torque per motor shaft (eq. 2.5) [N m]."""
        return self.dp_F * self.D_m

    @property
    def T_N(self) -> FloatArray:
        """Nominal torque per motor shaft D_m dp_m at the hoisting pressure (paper A eq. 21), by which errors are judged
        [N m]."""
        return self.D_m * np.abs(self.dp_up)

    def where(self, mask: BoolArray) -> Points:
        """The points under the mask; test names stay as they are."""
        rest = {f.name: getattr(self, f.name)[mask] for f in fields(self) if f.name != "names"}
        return Points(names=self.names, **rest)

    def fitted(self) -> Points:
        """The points that a fit may see."""
        return self.where(~self.hold_out)

    def held_out(self) -> Points:
        """The points that no fit has seen."""
        return self.where(self.hold_out)


def joined(parts: Sequence[Points]) -> Points:
    """Points of several tests in one; each part holds one test. Errors: IdentifyError where there are none."""
    if not parts:
        raise IdentifyError("No test gave a pair of steady stretches. See the rejected stretches and their reasons.")
    names = tuple(p.names[0] for p in parts)
    rest = {
        f.name: np.concatenate([getattr(p, f.name) for p in parts])
        for f in fields(Points)
        if f.name not in ("names", "test")
    }
    test = np.concatenate([np.full(len(p), i, dtype=np.intp) for i, p in enumerate(parts)])
    return Points(names=names, test=test, **rest)
