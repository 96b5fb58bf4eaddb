"""Records that every plant shares: the tip's motion at an instant, what drives one PLC cycle, what is observed."""

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


class Signals(NamedTuple):
    """One row of a time series; names and units as in `stillhook.variables`."""

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
    alpha_p: float
    alpha_m: float
    p_a: float
    p_b: float
    omega_m: float
    F_w: float
    s_load: float
    v_load: float
    Q_relief: float
    T_f: float
    layer: float
    p_hp: float
    alpha_pp: float
    alpha_pm: float
    V_acc: float
    f_pump: float
    mode: float
    v_op: float
    P_hpu: float
    brake: float


class Limits(NamedTuple):
    """1 where a limit is passed at an instant, else 0: too_fast a motor's speed; at_end the accumulator piston's
    stroke; relief_p the passive circuit's relief valve is open; wire_end the wire: its last turns leave the drum, or
    the hook is at the tip; power the hydraulic power units give or take back all they can; boost the boost pump gives
    all it
    has."""

    too_fast: float
    at_end: float
    relief_p: float
    wire_end: float
    power: float
    boost: float


class Powers(NamedTuple):
    """Powers at an instant [W]. In: pumps active and passive, boost, tip (through the wire). Out: the rest, each as a
    loss or work done. The sum of the inputs less the outputs is the rate of the stored energy."""

    pump: float
    boost: float
    passive_pump: float
    tip: float
    friction: float
    leakage: float
    relief: float
    flushing: float
    wire: float
    drag: float
    passive: float
