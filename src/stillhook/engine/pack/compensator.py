"""A passive heave compensator as the kernels read it: its gas law as a polynomial over the stroke."""

import functools

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from stillhook.errors import LiftError
from stillhook.physics.hydraulics.accumulator import polytropic_ratio
from stillhook.physics.load_path.compensator import Compensator as Record
from stillhook.physics.load_path.compensator import GasForce
from stillhook.physics.scalar import G
from stillhook.spec.lift.compensator import Compensator
from stillhook.units import show

POINTS = 32
DEGREE = len(GasForce._fields) - 1
FIT_TOLERANCE = 1.0e-5
"""Largest relative error of the fitted force over the stroke. (Where the piston sweeps 77 % of the gas it is 5e-7.)"""


def compensator_record(unit: Compensator, stiffness: float, rho: float, height: float) -> Record:
    """The unit over slings of a stiffness [N/m], in water of density rho [kg/m^3]; height of the slings' top above the
    payload's underside [m]. Errors: LiftError where it sweeps nearly all of its gas."""
    swept = unit.area * unit.stroke / unit.V_0
    F_in = unit.area * unit.p_0
    return Record(
        x_max=unit.stroke,
        i_half=2.0 / unit.stroke,
        A=unit.area,
        F_in=F_in,
        F_out=unit.force(unit.stroke),
        e=F_in / stiffness,
        C=unit.orifice,
        F_f=unit.friction,
        v_f=unit.v_friction,
        A_rod=unit.rod_area,
        rho_g=rho * G,
        z_c=height,
        gas=GasForce(*(F_in * c for c in _coefficients(swept, unit.n, show(unit.V_0, "volume")))),
    )


@functools.lru_cache(maxsize=256)
def _coefficients(swept: float, n: float, V_0: str) -> tuple[float, ...]:
    """Coefficients of force over F_in in the rod's place, by the share of the gas that the piston sweeps."""

    def ratio(xi: np.typing.NDArray[np.float64]) -> np.typing.NDArray[np.float64]:
        return np.asarray(polytropic_ratio(1.0 - 0.5 * swept * (1.0 + xi), n))

    xi = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
    c = chebyshev.cheb2poly(chebyshev.chebfit(xi, ratio(xi), DEGREE))
    fine = np.linspace(-1.0, 1.0, 201)
    worst = float(np.max(np.abs(polynomial.polyval(fine, c) / ratio(fine) - 1.0)))
    if worst > FIT_TOLERANCE:
        raise LiftError(
            f"compensator.V_0 = {V_0}: the piston sweeps {100.0 * swept:.3g} % of it, too much for the gas law to be"
            " followed to the end. Give the volume with its vessels, or a shorter stroke."
        )
    return tuple(float(i) for i in c)
