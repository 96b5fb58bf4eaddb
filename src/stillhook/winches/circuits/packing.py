"""Tables of circuits as the records that kernels read."""

from typing import Any

from stillhook.physics.hydraulics.lines import Boost, Flushing, Relief
from stillhook.physics.hydraulics.motor import Motors, TorqueLossFit
from stillhook.physics.hydraulics.swash import Servo
from stillhook.winches.circuits import tables

NO_LIMIT = 1.0e30
"""Stands for a limit that a crane file does not name [SI]: no winch gets there."""
DP_LEAST = 1.0e6
"""Pressure below which the torque law of units on an accumulator stops dividing by it [Pa]: 10 bar, far below any
charge."""


def limit(value: float | None) -> float:
    """A limit, or what stands for none [SI]."""
    return NO_LIMIT if value is None else value


def power_back(crane: Any) -> float:
    """Hydraulic power that the power units of a crane take back at most [W]."""
    return NO_LIMIT if crane.hpu is None else float(crane.hpu.P_back)


def servo_record(servo: tables.Servo, lo: float = -1.0, hi: float = 1.0) -> Servo:
    """A displacement control between its stops; without a known limit its setting may get as fast as its command
    asks."""
    return Servo(omega_n=servo.omega_n, zeta=servo.zeta, lo=lo, hi=hi, rate=limit(servo.rate_max))


def relief_record(relief: tables.Relief) -> Relief:
    """A relief valve."""
    return Relief(relief.p, relief.conductance)


def boost_record(boost: tables.Boost) -> Boost:
    """A boost pump with its valves."""
    return Boost(boost.p, boost.conductance, limit(boost.Q_max))


def flushing_record(flushing: tables.Flushing, boost: tables.Boost) -> Flushing:
    """A flushing valve, which opens above the boost pressure."""
    return Flushing(boost.p + flushing.dp_open, flushing.conductance, 1.0 / max(flushing.dp_shuttle, 1.0))


def loss_fit(motor: tables.Motor) -> TorqueLossFit:
    """The torque loss of a motor."""
    loss = motor.loss
    return TorqueLossFit(X_1=loss.X_1, X_2=loss.X_2, X_3=loss.X_3, X_4=loss.X_4, X_5=loss.X_5)


def motors_record(motor: Any, C_1: float, C_2: float) -> Motors:
    """A set of motors whose leak is C_1 + C_2 |n_m| each [m^3/s/Pa]."""
    return Motors(count=float(motor.count), D_max=motor.D_max, C_1=C_1, C_2=C_2, fit=loss_fit(motor))
