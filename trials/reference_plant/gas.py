"""Gas and accumulator of the reference plant: nitrogen by the equation of Benedict, Webb and Rubin, with the heat of
its vessels.

Written for the reference plant alone: nothing here comes from the twin's gas or accumulator
(`stillhook.physics.hydraulics.accumulator`). Pressures of the gas are absolute [Pa], amounts in mol, temperatures in K.
"""

from typing import NamedTuple

from stillhook.physics.scalar import clip, exp, fmax, scalar, tanh

R_MOLAR = 8.314
"""Molar gas constant [J/(mol K)], with the digits of the table that the coefficients are from."""
ATMOSPHERE = 101325.0
B_0, A_0, C_0 = 4.074e-5, 0.10673, 816.4
"""Second virial coefficient of nitrogen: [m^3/mol], [Pa m^6/mol^2], [Pa m^6 K^2/mol^2]."""
B_1, A_1, C_1 = 2.328e-9, 2.54e-6, 7.379e-2
"""Third: [m^6/mol^2], [Pa m^9/mol^3], [Pa m^9 K^2/mol^3]."""
ALPHA, GAMMA = 1.272e-13, 5.3e-9
"""[m^9/mol^3] and [m^6/mol^2]. All eight: Cooper and Goldfrank 1967, as Cengel and Boles, Thermodynamics, table 3-4
print them."""
C_V0 = 20.81
"""Molar heat of nitrogen at constant volume, thin gas at 20 degC [J/(mol K)]; it changes by 0.2 % from 0 to 60 degC."""


class GasBank(NamedTuple):
    """n nitrogen [mol]; V_mid its volume with the piston at mid stroke [m^3]; hA heat that the vessels take per kelvin
    [W/K]; T_w their temperature [K]."""

    n: float
    V_mid: float
    hA: float
    T_w: float


class TrueAccumulator(NamedTuple):
    """V_stroke oil of the whole stroke [m^3]; i_C inverse capacitance of the oil behind a piston at its end [Pa/m^3];
    p_dry pressure that the dry friction of the piston's seals takes [Pa], reached about i_Q_dry, the inverse of a flow
    [s/m^3]; R viscous part [Pa s/m^3]; C_leak past the seals of the control blocks [m^3/s/Pa]; bank GasBank."""

    V_stroke: float
    i_C: float
    p_dry: float
    i_Q_dry: float
    R: float
    C_leak: float
    bank: GasBank


@scalar
def gas_pressure_true(rho, T):
    r"""Pressure of nitrogen [Pa, absolute]; rho density [mol/m^3], T [K].

    .. math:: p = R T \rho + (B_0 R T - A_0 - C_0/T^2)\rho^2 + (b R T - a)\rho^3 + a\alpha\rho^6
                  + \frac{c\rho^3}{T^2}(1 + \gamma\rho^2)e^{-\gamma\rho^2}

    Source: Benedict, Webb and Rubin 1940, for accumulators Otis and Pourmovahed 1985. Valid up to 2.5 times the
    critical density; within 1.6 % of Span et al. 2000 from 100 to 350 bar and 0 to 60 degC
    (tests/validate/test_reference_gas.py).
    """
    r_2, i_T2, RT = rho * rho, 1.0 / (T * T), R_MOLAR * T
    s = GAMMA * r_2
    second = (B_0 * RT - A_0 - C_0 * i_T2) * r_2
    third = (B_1 * RT - A_1 + C_1 * i_T2 * (1.0 + s) * exp(-s)) * r_2 * rho
    return RT * rho + second + third + A_1 * ALPHA * r_2 * r_2 * r_2


@scalar
def pressure_per_kelvin(rho, T):
    """Rise of the pressure with the temperature at constant volume [Pa/K]."""
    r_2, i_T3 = rho * rho, 1.0 / (T * T * T)
    s = GAMMA * r_2
    third = B_1 * R_MOLAR - 2.0 * C_1 * i_T3 * (1.0 + s) * exp(-s)
    return R_MOLAR * rho + (B_0 * R_MOLAR + 2.0 * C_0 * i_T3) * r_2 + third * r_2 * rho


@scalar
def molar_heat(rho, T):
    r"""Heat at constant volume [J/(mol K)]: :math:`c_v = c_{v0} - \int_0^\rho T\,\partial^2 p/\partial
    T^2\,d\rho/\rho^2`."""
    i_T3, s = 1.0 / (T * T * T), GAMMA * rho * rho
    return C_V0 + i_T3 * (6.0 * C_0 * rho - 3.0 * C_1 / GAMMA * (2.0 - (2.0 + s) * exp(-s)))


@scalar
def molar_energy(rho, T):
    """Internal energy above that of no temperature [J/mol]; its rise with T is `molar_heat`, with the volume T dp/dT -
    p."""
    s, i_T2 = GAMMA * rho * rho, 1.0 / (T * T)
    attraction = (A_0 + 3.0 * C_0 * i_T2) * rho + 0.5 * A_1 * rho * rho * (1.0 - 0.4 * ALPHA * rho * rho * rho)
    return C_V0 * T - attraction + 1.5 * C_1 / GAMMA * i_T2 * (2.0 - (2.0 + s) * exp(-s))


@scalar
def gas_density(V_o, acc):
    """Density of the gas [mol/m^3]; V_o oil taken in since the oil end [m^3]. Oil beyond the stroke presses no gas."""
    return acc.bank.n / (acc.bank.V_mid + 0.5 * acc.V_stroke - clip(V_o, 0.0, acc.V_stroke))


@scalar
def standing_pressure(V_o, T, acc):
    """Oil pressure behind the standing piston [Pa, gauge], not below that of vapour; T temperature of the gas [K].
    At an end of the stroke more oil squeezes or relieves the oil alone."""
    beyond = V_o - clip(V_o, 0.0, acc.V_stroke)
    return fmax(gas_pressure_true(gas_density(V_o, acc), T) - ATMOSPHERE + beyond * acc.i_C, -ATMOSPHERE)


@scalar
def piston_friction(Q_o, acc):
    """Pressure that the moving piston adds to the oil [Pa]; Q_o flow into the accumulator [m^3/s]. Dry seals, smooth
    through standstill, and oil in the gap."""
    return acc.p_dry * tanh(Q_o * acc.i_Q_dry) + acc.R * Q_o


@scalar
def heating(V_o, T, Q_o, acc):
    r"""Rate of the gas's temperature [K/s]: :math:`n c_v \dot T = -T\,(\partial p/\partial T)_V\,\dot V + hA\,(T_w -
    T)`.

    Parameters: V_o oil taken in [m^3]; T gas [K]; Q_o flow into the accumulator [m^3/s], with which the gas loses
    volume.
    Source: energy of a closed amount of gas with one thermal time constant, Otis and Pourmovahed 1985.
    """
    rho = gas_density(V_o, acc)
    squeezed = Q_o if 0.0 < V_o and V_o < acc.V_stroke else 0.0
    gain = T * pressure_per_kelvin(rho, T) * squeezed + acc.bank.hA * (acc.bank.T_w - T)
    return gain / (acc.bank.n * molar_heat(rho, T))
