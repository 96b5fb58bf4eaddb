"""Nitrogen above the accumulator piston."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar


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
