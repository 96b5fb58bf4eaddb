"""Winch modes that lifts need, above the PLC's AHC loop: which joystick speed, mode and tension the PLC works with in this cycle."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar

STAGE_MANUAL, STAGE_AHC, STAGE_TENSION, STAGE_SPLASH, STAGE_LANDING = 0.0, 1.0, 2.0, 3.0, 4.0
UNTIL_TIME, UNTIL_DEPTH, UNTIL_WIRE, UNTIL_LANDED, UNTIL_TENSION = 0.0, 1.0, 2.0, 3.0, 4.0


class Stage(NamedTuple):
    """One stage of a winch programme: mode one of STAGE_*; v wire speed, hoisting positive [m/s]; F_set tension that is held or slackened
    to [N]; until one of UNTIL_*; value what ends it: time in the stage [s], wire paid out [m] (a depth is turned into wire out when
    packed), tension [N]; timeout [s] after which the programme is stuck."""

    mode: float
    v: float
    F_set: float
    until: float
    value: float
    timeout: float


class LiftSettings(NamedTuple):
    """t_cycle [s]; a_max ramp of the joystick [m/s^2]; v_max highest speed that tension control asks for [m/s]; omega_T bandwidth of
    tension control [rad/s]; tau_slow time constant of the mean tension [s]; omega_s return to the slow position [rad/s]; F_landed part of
    the suspended tension below which the load has landed [-]; F_least tension that compensation and tension control need to start [N];
    F_most highest tension that may be set [N]; EA [N] and L_0 [m] of the wire, from which the PLC knows its stiffness;
    code mode code of the controller while compensating."""

    t_cycle: float
    a_max: float
    v_max: float
    omega_T: float
    tau_slow: float
    omega_s: float
    F_landed: float
    F_least: float
    F_most: float
    EA: float
    L_0: float
    code: float


class Watch(NamedTuple):
    """What the lift modes read each cycle: t [s]; s_w encoder [m]; F load cell [N]; v_tip measured [m/s]."""

    t: float
    s_w: float
    F: float
    v_tip: float


class Supervisor(NamedTuple):
    """Memory: stage number; t_0 when it began [s]; entered 1 once its entry condition held; v_op ramped joystick [m/s] and s_op its
    integral [m]; F_slow mean tension [N]; F_hung tension before landing [N]; s_ref slow position [m]; landed 1 after touch-down;
    done 1 when the programme is over; stuck 1 when a stage timed out."""

    stage: float
    t_0: float
    entered: float
    v_op: float
    s_op: float
    F_slow: float
    F_hung: float
    s_ref: float
    landed: float
    done: float
    stuck: float


class Orders(NamedTuple):
    """What the PLC works with in this cycle: mode code; v_op [m/s], s_op [m]; hold 1 where the passive circuit carries F_hold [N] in place
    of the measured weight."""

    mode: float
    v_op: float
    s_op: float
    hold: float
    F_hold: float


@scalar
def supervise(y, m, stage, s):
    """One PLC cycle of the lift modes: what was read and remembered, and the stage in force, give orders and the new memory."""
    raise NotImplementedError
