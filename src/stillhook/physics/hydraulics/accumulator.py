"""Double-piston accumulator between the passive circuit and the gas vessels."""

from typing import NamedTuple

from stillhook.physics.hydraulics.gas import Gas, gas_pressure
from stillhook.physics.scalar import fmax, fmin, scalar


class Accumulator(NamedTuple):
    """V_stroke oil volume of the whole stroke [m^3], i_half = 2 / V_stroke;
    i_C inverse capacitance of the passive line [Pa/m^3], which holds the oil once the piston stands at an end;
    R piston friction as pressure per flow [Pa s/m^3]; C_leak high to low side [m^3/s/Pa]."""

    V_stroke: float
    i_half: float
    i_C: float
    R: float
    C_leak: float
    gas: Gas


@scalar
def accumulator_pressure(V_o, acc):
    """Oil pressure of the standing piston [Pa]; V_o oil taken in since the oil end [m^3].

    Within 0 < V_o < V_stroke the oil has the pressure of the gas. At the ends the piston stands and further oil loads
    or unloads the line alone: the pressure rises or falls with the stiffness of the trapped oil. It does not fall below
    zero (vapour; the run is then marked).
    """
    V_in = fmin(fmax(V_o, 0.0), acc.V_stroke)
    return fmax(gas_pressure(V_in * acc.i_half - 1.0, acc.gas) + (V_o - V_in) * acc.i_C, 0.0)


@scalar
def piston_loss(Q_o, acc):
    """Pressure that the moving piston adds to the oil [Pa]: viscous friction, Q_o flow into the accumulator [m^3/s].

    Source: Moslatt 2020 paper C "Double piston accumulator": viscous in the piston speed. The piston has no mass here:
    its own mode (about 500 rad/s) is far above everything that the winch sees.
    """
    return acc.R * Q_o
