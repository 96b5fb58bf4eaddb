"""Motor loss plus system friction at measured points: one place where the equations of the twin meet the
measurements.

What a crane test measures, point by point: friction pressure of a hoisting and a lowering stretch of the same
speed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import IdentifyError
from stillhook.physics import friction
from stillhook.physics.hydraulics.motor_laws import motor_loss
from stillhook.spec.crane import SystemFriction
from stillhook.winches.circuits.losses import loss_fit, unit_loss
from stillhook.winches.circuits.tables import Motor


@dataclass(frozen=True)
class Points:
    """Measured friction, one entry a point; all arrays have shape (n,).

    ``omega_up``, ``omega_down`` motor speeds of the hoisting and of the lowering stretch, both counted positive
    [rad/s]; ``dp_up``, ``dp_down`` pressure drops p_a - p_b of both [Pa]; ``D_m`` displacement of one motor [m^3/rad];
    ``T_d`` drum torque of the hanging load [N m]; ``count`` motors in the circuit [-]; ``u_dp`` standard uncertainty of
    dp_F [Pa]; ``test`` index into ``names``; ``hold_out`` points that no fit may see; ``t_up``, ``t_down`` middle of
    both stretches in the time of their test [s], NaN where no time is known.

    Leakage makes the two speeds of a pair differ, and friction that depends on pressure differs between hoisting and
    lowering. Half the difference of the two pressure drops is the mean of the two losses at any size, so a model
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

    @classmethod
    def planned(
        cls,
        omega: FloatArray,
        T_d: float,
        D_m: float,
        *,
        dp: FloatArray | None = None,
        count: float = 1.0,
        u_dp: float = 0.0,
    ) -> Points:
        """Points of one test that was never run, hoisting as fast as lowering.

        Parameters: omega motor speeds, shape (n,); dp pressure drops of hoisting and lowering, shape (2, n) (None: 0);
        the others as the fields of that name, one number for all points.
        """
        n = len(omega)
        up, down = np.zeros((2, n)) if dp is None else dp
        constant = {
            name: np.full(n, value) for name, value in (("D_m", D_m), ("T_d", T_d), ("count", count), ("u_dp", u_dp))
        }
        test, hold_out = np.zeros(n, dtype=np.intp), np.zeros(n, dtype=bool)
        return cls(
            names=("planned",),
            test=test,
            omega_up=omega,
            omega_down=omega,
            dp_up=up,
            dp_down=down,
            hold_out=hold_out,
            **constant,
        )

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
        arrays = {f.name: getattr(self, f.name)[mask] for f in fields(self) if f.name != "names"}
        return Points(names=self.names, **arrays)

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
    arrays = {
        f.name: np.concatenate([getattr(p, f.name) for p in parts])
        for f in fields(Points)
        if f.name not in ("names", "test")
    }
    test = np.concatenate([np.full(len(p), i, dtype=np.intp) for i, p in enumerate(parts)])
    return Points(names=names, test=test, **arrays)


Y_NAMES = ("Y_1", "Y_2", "Y_3", "Y_4", "Y_5", "Y_6")
Y_LINEAR = ("Y_1", "Y_2", "Y_3", "Y_5", "Y_6")
Y_FADING = ("Y_1", "Y_3")
"""Parameters whose terms fade with the speed by Y_4; the others' columns are the same for any Y_4."""

Loss = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""Torque loss of one motor shaft [N m] from speed [rad/s], displacement [m^3/rad] and pressure drop [Pa], arrays of one
shape."""


class Y(NamedTuple):
    """System friction parameters in SI: Y_1 [-], Y_2 [N m], Y_3 [N m], Y_4 [rad/s], Y_5 [N m s/rad], Y_6 [-]."""

    Y_1: float
    Y_2: float
    Y_3: float
    Y_4: float
    Y_5: float
    Y_6: float

    @classmethod
    def of(cls, system: SystemFriction) -> Y:
        """The parameters of a set of the library or of a crane."""
        return cls(*(getattr(system, name) for name in Y_NAMES))

    @property
    def system(self) -> SystemFriction:
        """The parameters as a set of the library or a crane has them."""
        return SystemFriction.model_construct(None, **{n: float(v) for n, v in self._asdict().items()})


def system_friction(omega: FloatArray, T_d: FloatArray, y: Y) -> FloatArray:
    """System friction per motor shaft (Moslatt 2020 eq. 2.7) [N m]; omega [rad/s], T_d [N m], same shapes."""
    record = friction.SystemFriction(y.Y_1, y.Y_2, y.Y_3, 1.0 / y.Y_4, y.Y_5, y.Y_6)
    return np.asarray(friction.system_friction(np.asarray(omega, dtype=np.float64), T_d, record)) + 0.0 * omega


def loss_of(of: Motor) -> Loss:
    """The twin's motor loss: by the model that the motor names."""
    fit = loss_fit(of)
    return lambda omega, D_m, dp: np.asarray(motor_loss(omega, D_m, dp, fit), dtype=np.float64)


def mean_of_pair(f: Callable[[FloatArray, FloatArray], FloatArray], points: Points) -> FloatArray:
    """Mean of f(omega, dp) over the hoisting and the lowering stretch of every point."""
    return 0.5 * (f(points.omega_up, points.dp_up) + f(points.omega_down, points.dp_down))


def motor_loss_at(points: Points, loss: Loss) -> FloatArray:
    """Motor loss per shaft at the points, mean over both pressures and speeds [N m]."""
    return mean_of_pair(lambda omega, dp: loss(omega, points.D_m, dp), points)


def system_friction_at(points: Points, y: Y) -> FloatArray:
    """System friction per shaft at the points, mean over both speeds [N m]."""
    return mean_of_pair(lambda omega, _: system_friction(omega, points.T_d, y), points)


def system_columns(points: Points, Y_4: float, names: tuple[str, ...] = Y_LINEAR) -> FloatArray:
    """Shape (n, k): what each of these linear parameters adds per unit, with Y_4 [rad/s] given; the model is linear in
    them."""
    return np.column_stack([system_friction_at(points, _unit(name, Y_4)) for name in names])


def system_slope(points: Points, y: Y) -> FloatArray:
    """Shape (n,): change of the friction at the points per change of Y_4 [N m s/rad], by a central difference."""
    h = 1e-4 * y.Y_4
    up, down = (system_friction_at(points, y._replace(Y_4=Y_4)) for Y_4 in (y.Y_4 + h, y.Y_4 - h))
    return (up - down) / (2 * h)


def motor_columns(points: Points, of: Motor, names: Sequence[str]) -> FloatArray:
    """Shape (n, k): what these parameters of a motor's loss each add per unit at the points."""

    def column(name: str) -> FloatArray:
        fit = unit_loss(of, name)
        return motor_loss_at(points, lambda omega, D_m, dp: np.asarray(motor_loss(omega, D_m, dp, fit) + 0.0 * omega))

    return np.column_stack([column(name) for name in names])


def _unit(name: str, Y_4: float) -> Y:
    return Y(**{n: Y_4 if n == "Y_4" else float(n == name) for n in Y_NAMES})
