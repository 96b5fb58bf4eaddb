"""Records that every winch type shares: tip motion, what drives one PLC cycle, what is observed; and extremes of its
signals, each declared in one line: `Annotated[float, Row(...), highest("p_a")]`."""

import functools
import typing
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from stillhook.control.plc import ActuatorCommands
from stillhook.physics.records import define
from stillhook.physics.scalar import fmax, fmin, scalar

NOT_YET = 1.0e300
"""Stands for the lowest value of nothing yet."""


class Tip(NamedTuple):
    """Crane tip, up positive: s [m], v [m/s]."""

    s: float
    v: float


class Motion(NamedTuple):
    """Motion of the crane tip, up positive: s [m], v [m/s], a [m/s^2]."""

    s: float
    v: float
    a: float


class Geometry(NamedTuple):
    """What the drum is during one PLC cycle, in which at most some centimetres of wire pass: layers filled; d diameter
    of the wire's centre [m]; r_eff wire per motor angle [m/rad]; i_J inverse of the inertia at the motor shaft [1/(kg
    m^2)]; c damping of the wire out [N s/m]."""

    layers: float
    d: float
    r_eff: float
    i_J: float
    c: float


class Tick(NamedTuple):
    """What comes from outside in one PLC cycle. True tip s, v, a at its start; s_m, v_m, a_m as the PLC receives them;
    v_op operator's speed and s_op its integral; mode; f_pump share of the pumps that run, f_known share that the PLC
    knows of; n_s, n_F noise on encoder [m] and load cell [N]; f_passive share of the passive pumps that run; override
    1 where the winch takes the commands u_p, u_m and brake (how far the holding brake is closed) [-] in place of the
    PLC's, else 0."""

    s: float
    v: float
    a: float
    s_m: float
    v_m: float
    a_m: float
    v_op: float
    s_op: float
    mode: float
    f_pump: float
    f_known: float
    n_s: float
    n_F: float
    f_passive: float
    override: float
    u_p: float
    u_m: float
    brake: float


THIN = 3
"""Columns of a drive that only moves the tip: s, v, a; the other fields of Tick then keep their first values."""


class Sensors(NamedTuple):
    """Smallest steps of the signals (0: none): q_s encoder [m], q_F load cell [N]."""

    q_s: float
    q_F: float


class CommonSignals(NamedTuple):
    """Signals that every winch has, of a row of the time series; names and units as in `stillhook.variables`."""

    s_tip: float
    v_tip: float
    a_tip: float
    s_w: float
    v_w: float
    e_c: float
    e_c_measured: float
    u_p: float
    u_m: float
    u_ff: float
    u_raw: float
    F_w: float
    s_load: float
    v_load: float
    layer: float
    mode: float
    v_op: float
    brake: float


@scalar
def apply_override(drive, tick):
    """The commands that the active circuit takes: the PLC's, or those given for this cycle from outside, such as a
    measured record."""
    override = tick.override > 0.0
    u_p = tick.u_p if override else drive.u_p
    u_m = tick.u_m if override else drive.u_m
    u_raw = tick.u_p if override else drive.u_raw
    brake = tick.brake if override else drive.brake
    return ActuatorCommands(u_p=u_p, u_m=u_m, u_ff=drive.u_ff, u_raw=u_raw, e_c=drive.e_c, brake=brake)


Extremes = TypeVar("Extremes", bound=tuple[Any, ...])


class Fold(NamedTuple):
    """What an extreme follows from: the greatest or least (`keep`: fmax, fmin) of signals, or of their magnitude."""

    keep: str
    signals: tuple[str, ...]
    magnitude: bool = False


def highest(*signals: str) -> Fold:
    """Highest value of these signals."""
    return Fold("fmax", signals)


def lowest(*signals: str) -> Fold:
    """Lowest value of these signals."""
    return Fold("fmin", signals)


def largest(signal: str) -> Fold:
    """Largest magnitude of a signal."""
    return Fold("fmax", (signal,), magnitude=True)


def folded(extremes: type[Extremes]) -> tuple[Extremes, Callable[..., Extremes]]:
    """BLANK and fold_extremes(a, y) of a winch type: extremes of nothing yet, and with one more cycle of signals y."""
    terms: list[str] = []
    blank: list[Any] = []
    for name, hint in typing.get_type_hints(extremes, include_extras=True).items():
        fold = next((mark for mark in getattr(hint, "__metadata__", ()) if isinstance(mark, Fold)), None)
        if fold is None:
            raise TypeError(f"Extremes.{name}: note highest, lowest or largest of a signal next to its Row")
        value = functools.reduce(lambda a, b: f"{fold.keep}({a}, {b})", [f"y.{signal}" for signal in fold.signals])
        terms.append(f"{fold.keep}(a.{name}, {f'abs({value})' if fold.magnitude else value})")
        blank.append(0.0 if fold.magnitude else -NOT_YET if fold.keep == "fmax" else NOT_YET)
    names: dict[str, Any] = {"cls": extremes, "fmax": fmax, "fmin": fmin}
    define(f"def fold_extremes(a, y): return cls({', '.join(terms)})\n", names, f"<extremes of {extremes.__module__}>")
    return extremes(*blank), scalar(names["fold_extremes"])
