"""The torque loss of motors as the twin takes it: which model, how it is split into dry friction and what grows with
speed, and a measured map in place of a model.

A record stands for each: of MJ4 its five parameters, of other models `record_of`, of a map `map_record`. A kernel is
compiled for the records that it holds.
"""

import functools
import hashlib
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from stillhook.physics.hydraulics import motor_losses as eq
from stillhook.physics.hydraulics.motor import TorqueLossFit, torque_loss, torque_loss_dry, torque_loss_moving
from stillhook.physics.hydraulics.motor_losses import LossMotor
from stillhook.physics.records import record
from stillhook.physics.scalar import by_record, clip, in_kernels, maximum, minimum, scalar, scalar_of


class LossLaw(NamedTuple):
    """A model: class of its parameters, its equation; interpolates: its parameters have either sign, and say nothing
    below the lowest speed of the fit."""

    record: Any
    function: Callable[..., Any]
    interpolates: bool = False


LAWS: Mapping[str, LossLaw] = {
    "wilson": LossLaw(eq.Wilson, eq.wilson),
    "schlosser": LossLaw(eq.Schlosser, eq.schlosser),
    "thoma": LossLaw(eq.Thoma, eq.thoma),
    "pacey": LossLaw(eq.Pacey, eq.pacey),
    "huhtala-14": LossLaw(eq.Huhtala14, eq.huhtala_14, interpolates=True),
    "huhtala-28": LossLaw(eq.Huhtala28, eq.huhtala_28, interpolates=True),
    "ortwig": LossLaw(eq.Ortwig, eq.ortwig, interpolates=True),
    "jeong": LossLaw(eq.Jeong, eq.jeong),
    "mj1": LossLaw(eq.MJ1, eq.mj1),
    "mj2": LossLaw(eq.MJ2, eq.mj2),
    "mj3": LossLaw(eq.MJ3, eq.mj3),
    "mj4": LossLaw(TorqueLossFit, eq.mj4),
    "mj5": LossLaw(eq.MJ5, eq.mj5),
    "mj6": LossLaw(eq.MJ6, eq.mj6),
}
"""Every model by name, oldest first."""
BLIND = ("wilson", "schlosser", "huhtala-14", "jeong")
"""Those that do not vary with the displacement: of motors that swivel they say nothing."""


class FittedLoss(NamedTuple):
    """How the twin takes a loss, by its label in a kernel's key: all of it, its dry part and its moving part, each
    f(omega_m, D_m, dp_m, record) [N m] and never negative."""

    label: str
    torque: Callable[..., Any]
    dry: Callable[..., Any]
    moving: Callable[..., Any]


@scalar
def _mj4_dry(omega_m, D_m, dp_m, fit):
    return torque_loss_dry(D_m, dp_m, fit)


@scalar
def _mj4_moving(omega_m, D_m, dp_m, fit):
    return torque_loss_moving(omega_m, D_m, fit)


FITTED: dict[Any, FittedLoss] = {TorqueLossFit: FittedLoss("mj4", torque_loss, _mj4_dry, _mj4_moving)}
"""Loss of each class of record: MJ4's own, those of `record_of`, and those of maps."""


def _fitted(label: str, torque: Callable[..., Any], **members: Any) -> Any:
    """A new class of record with these fields, and its loss in `FITTED`."""

    @scalar
    def dry(omega_m, D_m, dp_m, fit):
        return minimum(torque(omega_m, D_m, dp_m, fit), torque(0.0, D_m, dp_m, fit))

    @scalar
    def moving(omega_m, D_m, dp_m, fit):
        return maximum(torque(omega_m, D_m, dp_m, fit) - torque(0.0, D_m, dp_m, fit), 0.0)

    made = record("Loss", f"{__name__} {label}", **members, scale=float)
    FITTED[made] = FittedLoss(label, torque, dry, moving)
    return made


@functools.cache
def record_of(name: str) -> Any:
    """Class of the record by which the twin knows a model's loss: law its parameters, motor, scale of the loss [-]."""
    function = LAWS[name].function

    @scalar
    def direct(omega_m, D_m, dp_m, fit):
        return fit.scale * function(omega_m, D_m, dp_m, fit.law, fit.motor)

    @scalar
    def held(omega_m, D_m, dp_m, fit):
        omega = maximum(abs(omega_m), fit.motor.omega_low)
        return fit.scale * maximum(function(omega, D_m, dp_m, fit.law, fit.motor), 0.0)

    return _fitted(name, held if LAWS[name].interpolates else direct, law=LAWS[name].record, motor=LossMotor)


def labelled(label: str) -> Any:
    """The class of record with this label, made in this process before."""
    return record_of(label) if label in LAWS else next(of for of, loss in FITTED.items() if loss.label == label)


motor_loss = by_record(lambda of: FITTED[of].torque)
"""Torque loss of one motor shaft, whatever the model, f(omega_m, D_m, dp_m, fit) [N m]: `motor_loss_dry` and
`motor_loss_moving` together."""
motor_loss_dry = by_record(lambda of: FITTED[of].dry)
"""Its level of dry friction, which the bristle follows, f(omega_m, D_m, dp_m, fit) [N m]: the loss in the limit of
standstill, or the loss itself where that is less, as of the notches of the port plate, whose loss falls with speed."""
motor_loss_moving = by_record(lambda of: FITTED[of].moving)
"""What the loss has beyond that at a speed (viscous and turbulent), f(omega_m, D_m, dp_m, fit) [N m]; never negative,
so that no model drives the shaft."""


@scalar
def motors_dry(omega_m, alpha_m, dp_m, motors):
    """`motor_loss_dry` of a set of motors at displacement alpha_m over its maximum [-] [N m]."""
    return motors.count * motor_loss_dry(omega_m, alpha_m * motors.D_max, dp_m, motors.fit)


@scalar
def motors_moving(omega_m, alpha_m, dp_m, motors):
    """`motor_loss_moving` of a set of motors at displacement alpha_m over its maximum [-] [N m]."""
    return motors.count * motor_loss_moving(omega_m, alpha_m * motors.D_max, dp_m, motors.fit)


@functools.lru_cache(maxsize=32)
def map_record(
    D_m: tuple[float, ...], omega_m: tuple[float, ...], dp_m: tuple[float, ...], T_f: tuple[float, ...]
) -> Any:
    """Class of the record by which the twin knows a map: scale of the loss [-]; levels and losses are constants of its
    kernels.

    Parameters: as `map_torque`. The loss at the lowest speed level is dry friction, as it is held below.
    """
    label = f"map-{hashlib.sha256(repr((D_m, omega_m, dp_m, T_f)).encode()).hexdigest()[:12]}"
    return _fitted(label, map_torque(D_m, omega_m, dp_m, T_f))


class Measured(NamedTuple):
    """A map as it was measured."""

    scale: float = 1.0


def map_torque(D_m: Any, omega_m: Any, dp_m: Any, T_f: Any) -> Callable[..., Any]:
    """Loss by a map, f(omega_m, D_m, dp_m, record with its scale) [N m], from Python of arrays as well: trilinear
    between levels; outside, the loss at the edge is held. Even in speed and pressure drop.

    Parameters: levels of displacement [m^3/rad], speed [rad/s] and pressure drop [Pa], each rising; T_f loss at every
    combination, the pressure drop fastest [N m].
    """
    axes = [np.array(levels) for levels in (D_m, omega_m, dp_m)]
    T = np.array(T_f).reshape([len(levels) for levels in axes])
    for i, levels in enumerate(axes):
        if len(levels) == 1:  # one level holds everywhere
            axes[i], T = np.array([levels[0], 2.0 * levels[0]]), np.repeat(T, 2, axis=i)
    return _trilinear(axes, T, [len(x) for x in (D_m, omega_m, dp_m)])


def _place(levels: Any, known: int) -> Any:
    """Function x -> (level below x, part of the way to the one above [-]), x held between the ends."""
    n, low, high = len(levels), float(levels[0]), float(levels[known - 1])

    @scalar
    def place(x):
        x = clip(x, low, high)
        i = 0
        for k in range(1, n - 1):
            if x >= levels[k]:
                i = k
        return i, (x - levels[i]) / (levels[i + 1] - levels[i])

    return place


def _trilinear(axes: list[Any], T: Any, known: list[int]) -> Any:
    """Loss as a function of speed, displacement, pressure drop and record; from Python of arrays as well."""
    in_D, in_omega, in_dp = (_place(levels, n) for levels, n in zip(axes, known, strict=True))
    n_omega, n_dp = T.shape[1:]
    values = np.ascontiguousarray(T.ravel())

    @scalar
    def between(j, c):
        return (1.0 - c) * values[j] + c * values[j + 1]

    @scalar
    def torque(omega_m, D_m, dp_m, fit):
        i, a = in_D(D_m)
        j, b = in_omega(abs(omega_m))
        k, c = in_dp(abs(dp_m))
        at = (i * n_omega + j) * n_dp + k
        up = at + n_omega * n_dp
        low = (1.0 - b) * between(at, c) + b * between(at + n_dp, c)
        high = (1.0 - b) * between(up, c) + b * between(up + n_dp, c)
        return fit.scale * ((1.0 - a) * low + a * high)

    one = scalar_of(torque)
    assert one is not None
    each = np.vectorize(one.source, otypes=[float], excluded=[3])
    return in_kernels(lambda *x: each(*x) if any(isinstance(v, np.ndarray) for v in x[:3]) else one.source(*x), one)
