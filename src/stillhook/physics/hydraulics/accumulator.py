"""Double-piston accumulator between the passive circuit and the gas vessels, and the nitrogen above its piston."""

from typing import NamedTuple

from stillhook.physics.hydraulics.lines import P_VAPOUR, line_pressure, vapour_share, void_volume
from stillhook.physics.scalar import fmax, fmin, scalar


class Gas(NamedTuple):
    """Gas pressure as a polynomial of the piston's place xi, -1 at the oil end, 0 at mid stroke, 1 at the gas end [Pa].

    Fitted to the gas law over the stroke to better than 1e-8 when a run is packed (`stillhook.engine.pack.gas`).
    """

    c_0: float
    c_1: float
    c_2: float
    c_3: float
    c_4: float
    c_5: float
    c_6: float
    c_7: float


@scalar
def gas_pressure(xi, gas):
    """Gas pressure [Pa] with the piston at xi [-1, 1]: a state change without heat, fast against the gas's warming."""
    lo = gas.c_0 + xi * (gas.c_1 + xi * (gas.c_2 + xi * gas.c_3))
    x_2 = xi * xi
    return lo + x_2 * x_2 * (gas.c_4 + xi * (gas.c_5 + xi * (gas.c_6 + xi * gas.c_7)))


@scalar
def polytropic_ratio(V_ratio, n):
    """p / p_0 of a polytropic gas at V / V_0: p V^n is constant. Source: paper C, double-piston accumulator."""
    return V_ratio**-n


class Accumulator(NamedTuple):
    """V_stroke oil volume of the whole stroke [m^3], i_half = 2 / V_stroke;
    i_C inverse capacitance of the passive line [Pa/m^3], which holds the oil once the piston stands at an end, i_beta
    inverse bulk modulus of its oil [1/Pa];
    R piston friction as pressure per flow [Pa s/m^3]; C_leak high to low side [m^3/s/Pa]."""

    V_stroke: float
    i_half: float
    i_C: float
    i_beta: float
    R: float
    C_leak: float
    gas: Gas


@scalar
def linear_pressure(V_o, acc):
    """Pressure that the oil would have if it carried tension [Pa]; V_o as in `accumulator_pressure`."""
    V_in = fmin(fmax(V_o, 0.0), acc.V_stroke)
    return gas_pressure(V_in * acc.i_half - 1.0, acc.gas) + (V_o - V_in) * acc.i_C


@scalar
def accumulator_void(V_o, acc):
    """Vapour between accumulator and motors [m^3]."""
    return void_volume(linear_pressure(V_o, acc), acc.i_C)


@scalar
def accumulator_vapour(V_o, acc):
    """Part of the line between accumulator and motors that is vapour [-]."""
    return vapour_share(linear_pressure(V_o, acc), acc.i_beta)


@scalar
def accumulator_pressure(V_o, acc):
    """Oil pressure of the standing piston [Pa]; V_o oil taken in since the oil end [m^3].

    Within 0 < V_o < V_stroke the oil has the pressure of the gas. At the ends the piston stands and further oil loads
    or unloads the line alone: the pressure rises or falls with the stiffness of the trapped oil, and not below that of
    vapour (`stillhook.physics.hydraulics.lines`).
    """
    return line_pressure(linear_pressure(V_o, acc))


@scalar
def port_pressure(p_o, Q_o, acc):
    """Oil pressure before the moving piston [Pa], where motors and pumps are: not below that of vapour, and that of
    vapour as long as there is any."""
    return p_o if p_o <= P_VAPOUR else line_pressure(p_o + piston_loss(Q_o, acc))


@scalar
def piston_loss(Q_o, acc):
    """Pressure that the moving piston adds to the oil [Pa]: viscous friction, Q_o flow into the accumulator [m^3/s].

    Source: Moslatt 2020 paper C "Double piston accumulator": viscous in the piston speed. The piston has no mass here:
    its own mode (about 500 rad/s) is far above everything that the winch sees.
    """
    return acc.R * Q_o
