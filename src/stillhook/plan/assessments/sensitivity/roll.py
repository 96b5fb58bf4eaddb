r"""Other roll damping in transfer functions that are given: about its natural frequency roll is that of one degree of
freedom under the slope of the waves,

.. math:: \left|\frac{\eta_4}{k}\right| \propto \frac{1}{|T|},\qquad T = 1 - r^2 + 2 i \zeta r,\quad r = \omega/\omega_n

whose zeta and omega_n the table's own peak shows: :math:`|\eta_4/k|^{-2}` is a parabola in :math:`\omega^2` there. The
roll of every heading is then multiplied by T of that damping over T of the other. Motions that roll couples to stay.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError
from stillhook.sea.vessel.rao import DOFS, Rao, wavenumber

ABOUT = 0.1
"""Frequencies about the peak that are fitted, over its own: beyond, the waves' moment varies."""
FEWEST = 5
"""Frequencies that are needed there."""
MISFIT = 0.15
"""Largest deviation of the fit from the table's peak, over it."""
LEAST, MOST = 0.005, 0.3
"""Damping ratios that a peak can show."""
ROLL = DOFS.index("roll")


class RollPeak(NamedTuple):
    """Natural frequency of roll [rad/s] and its damping ratio [-]."""

    omega_n: float
    zeta: float

    def stiffness(self, omega: FloatArray, factor: float = 1.0) -> ComplexArray:
        """T of the formula, with so many times the damping."""
        r = omega / self.omega_n
        return np.asarray(1.0 - r**2 + 2.0j * factor * self.zeta * r)


def roll_peak(vessel: Rao) -> RollPeak:
    """The peak of the table's largest roll. Errors: SeaError where it shows no damping."""
    omega, roll = vessel.omega, np.abs(vessel.H[ROLL]) / wavenumber(vessel.omega, vessel.depth)
    heading = int(np.abs(vessel.H[ROLL]).max(axis=1).argmax())
    at = int(np.abs(vessel.H[ROLL][heading]).argmax())
    of, y = np.abs(omega / omega[at] - 1.0) <= ABOUT, roll[heading]
    if not 0 < at < len(omega) - 1 or int(of.sum()) < FEWEST:
        raise _unknown(vessel, f"{int(of.sum())} frequencies about the peak of roll, and {FEWEST} are needed")
    square, weight = omega[of] ** 2, y[of] ** 2
    columns = np.stack([square**2, square, np.ones_like(square)], axis=1)
    c = np.linalg.lstsq(columns * weight[:, None], np.ones_like(weight), rcond=None)[0]
    if not (c[0] > 0.0 and c[2] > 0.0):
        raise _unknown(vessel, "roll has no peak of one degree of freedom")
    zeta = np.sqrt(max(0.25 * (c[1] / np.sqrt(c[0] * c[2]) + 2.0), 0.0))
    fitted = 1.0 / np.sqrt(np.maximum(columns @ c, 1e-300))
    misfit = float(np.abs(fitted / y[of] - 1.0).max())
    if not LEAST <= zeta <= MOST or misfit > MISFIT:
        raise _unknown(vessel, f"the peak of roll is {misfit:.0%} off one degree of freedom with damping {zeta:.3g}")
    return RollPeak(float((c[2] / c[0]) ** 0.25), float(zeta))


def _unknown(vessel: Rao, reason: str) -> SeaError:
    return SeaError(f"{vessel.name}: {reason}, so its roll damping is not known from its table.")


def with_roll_damping(vessel: Rao, factor: float) -> Rao:
    """The vessel with so many times its roll damping. Errors: SeaError as `roll_peak`."""
    if factor == 1.0:
        return vessel
    peak, H = roll_peak(vessel), vessel.H.copy()
    H[ROLL] *= peak.stiffness(vessel.omega) / peak.stiffness(vessel.omega, factor)
    return replace(vessel, H=H, source=f"{vessel.source}, roll damping x {factor:g}")
