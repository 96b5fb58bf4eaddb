"""Records that every winch type shares: the tip's motion at an instant, what drives one PLC cycle, what is observed."""

from typing import NamedTuple


class Tip(NamedTuple):
    """Crane tip, up positive: s [m], v [m/s]."""

    s: float
    v: float


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
    knows of; n_s, n_F noise on encoder [m] and load cell [N]; f_passive share of the passive pumps that run; given 1
    where the active circuit takes the commands u_p, u_m in place of the PLC's, else 0."""

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
