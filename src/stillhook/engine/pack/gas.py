"""An accumulator, and the coefficients of its gas: polytropic, or nitrogen along its isentrope from a property
library."""

import functools

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from stillhook.errors import SpecError
from stillhook.physics.hydraulics import accumulator
from stillhook.physics.hydraulics.accumulator import Gas, polytropic_ratio
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.units import show
from stillhook.winches.circuits.tables import Accumulator, GasModel, Line

POINTS = 24
DEGREE = 7
FIT_TOLERANCE = 1.0e-4
"""Largest relative error of the fitted pressure over the stroke (the library cranes stay below 1e-8): 0.03 bar of 280,
less than the 0.2 bar that the default step may cost."""
COLDEST, HOTTEST = 200.0, 500.0
"""Gas temperatures at mid stroke that are expected [K]: above the critical point by far, within the equation of
state."""
HELD = 1.0e4
"""Size of the accumulator whose pressure is constant, over that of the crane: cubic metres of oil then move it by
hundredths of a bar."""


def accumulator_record(
    table: Accumulator, line: Line, gas_held: bool, circuit: str, gas_factor: float = 1.0
) -> accumulator.Accumulator:
    """An accumulator with the oil of its line; gas_held: with so large a bank that its pressure is constant; circuit:
    name of its table; gas_factor: charge over that of the table [-]."""
    acc = charged(table, gas_factor)
    if gas_held:
        gas = acc.gas.model_copy(update={"V_0": HELD * acc.gas.V_0})
        acc = acc.model_copy(update={"V_stroke": HELD * acc.V_stroke, "gas": gas})
    return accumulator.Accumulator(
        V_stroke=acc.V_stroke,
        i_half=2.0 / acc.V_stroke,
        i_C=1.0 / capacitance(line.V, line.bulk_modulus),
        i_beta=1.0 / line.bulk_modulus,
        R=acc.R_piston,
        C_leak=acc.C_leak,
        gas=gas_record(acc, circuit),
    )


def charged(table: Accumulator, factor: float) -> Accumulator:
    """An accumulator whose gas has a factor times its charge."""
    if factor == 1.0:
        return table
    return table.model_copy(update={"gas": table.gas.model_copy(update={"p_0": factor * table.gas.p_0})})


def gas_record(acc: Accumulator, circuit: str = "passive") -> Gas:
    """The engine's gas: a polynomial through the gas law over the piston's stroke, checked against the law itself;
    circuit: table that the accumulator is in.

    Errors: SpecError where real gas is requested and its library is missing, or the stroke is too large for the fit.
    """
    gas, law = acc.gas, acc
    if gas.model is GasModel.POLYTROPIC:  # its ratio depends on no pressure: one fit for every charge
        law = acc.model_copy(update={"gas": gas.model_copy(update={"p_0": 1.0})})
    return Gas(*(gas.p_0 * i for i in _coefficients(law, circuit)))


@functools.lru_cache(maxsize=256)
def _coefficients(acc: Accumulator, circuit: str) -> tuple[float, ...]:
    """Coefficients of the gas pressure over p_0 in the piston's place."""
    gas = acc.gas
    xi = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
    ratio = pressure_ratio(acc, xi, circuit)
    c = chebyshev.cheb2poly(chebyshev.chebfit(xi, ratio, DEGREE))
    fine = np.linspace(-1.0, 1.0, 201)
    worst = float(np.max(np.abs(np.polynomial.polynomial.polyval(fine, c) / pressure_ratio(acc, fine, circuit) - 1.0)))
    if worst > FIT_TOLERANCE:
        raise SpecError(
            f"{circuit}.accumulator: V_stroke {acc.V_stroke:g} m^3 is too large for the gas volume {gas.V_0:g} m^3: the"
            f" gas law is fitted to {worst:.0e} only (allowed {FIT_TOLERANCE:.0e}). Raise gas.V_0 or lower V_stroke."
        )
    return tuple(float(i) for i in c)


def pressure_ratio(acc: Accumulator, xi: NDArray[np.float64], circuit: str = "passive") -> NDArray[np.float64]:
    """Gas pressure over p_0 by the chosen law, with the piston at xi (-1 oil end, 0 mid stroke, 1 gas end)."""
    volume_ratio = 1.0 - 0.5 * acc.V_stroke * xi / acc.gas.V_0
    if acc.gas.model is GasModel.POLYTROPIC:
        return np.asarray(polytropic_ratio(volume_ratio, acc.gas.n))
    return nitrogen_isentrope(acc.gas.p_0, acc.gas.T_0, volume_ratio, circuit)


def nitrogen_isentrope(
    p_0: float, T_0: float, volume_ratio: NDArray[np.float64], circuit: str = "passive"
) -> NDArray[np.float64]:
    """Pressure ratio p / p_0 of nitrogen at constant entropy for volume ratios V / V_0; p_0 gauge [Pa], T_0 [K].

    Source: Helmholtz equation of Span et al. (2000) through CoolProp. The ratio is of gauge pressures.
    """
    try:
        from CoolProp.CoolProp import PropsSI  # heavy and optional: only where real gas is requested
    except ImportError:
        raise SpecError(
            f'{circuit}.accumulator.gas.model = "nitrogen": the property library is not installed. '
            'Install it with pip install "stillhook[gas]", or use model = "polytropic".'
        ) from None
    place = f"{circuit}.accumulator.gas: nitrogen at p_0 {show(p_0, 'pressure')} and T_0 {show(T_0, 'temperature')}"
    if not COLDEST <= T_0 <= HOTTEST:
        raise SpecError(
            f"{place}: T_0 must be between {show(COLDEST, 'temperature')} and {show(HOTTEST, 'temperature')}. Check its"
            " unit."
        )
    atmosphere = 101325.0
    try:
        rho = PropsSI("D", "P", p_0 + atmosphere, "T", T_0, "Nitrogen")
        entropy = PropsSI("S", "P", p_0 + atmosphere, "T", T_0, "Nitrogen")
        p = np.array([PropsSI("P", "D", rho / r, "S", entropy, "Nitrogen") for r in volume_ratio])
    except ValueError:
        raise SpecError(
            f"{place}: the property library has no data of this gas over the stroke. Lower p_0, or raise V_0."
        ) from None
    return (p - atmosphere) / p_0
