"""Added mass in heave of plates, discs, tall bodies and perforated ones, in unbounded water.

The formulas are those of DNV-RP-N103 (and the older DNV-RP-H103), appendix and section on added mass, recalled and not
read clause by clause: check against your edition. Coefficients stand in the tables below.
"""

import math

import numpy as np

PLATE_RATIO = (1.0, 2.0, 3.0, 5.0, 10.0, math.inf)
"""Sides b / a of a rectangular plate, a the shorter one."""
PLATE_C_A = (0.579, 0.757, 0.830, 0.897, 0.947, 1.0)
"""Coefficients of a rectangular plate at PLATE_RATIO; the last is the strip of two-dimensional flow."""
PERFORATION_LEAST, PERFORATION_MIDDLE, PERFORATION_MOST = 0.05, 0.34, 0.50
"""Ends of the branches of the perforation factor; it is not known beyond the last."""


def plate(rho: float, a: float, b: float) -> float:
    r"""Added mass of a thin rectangular plate that moves square to itself [kg].

    .. math:: A_{33} = \rho\,C_A\,\tfrac{\pi}{4}a^2 b,\quad a \le b

    Parameters: rho [kg/m^3]; a, b sides in either order [m]. C_A straight in a / b between the values of the table.
    """
    a, b = min(a, b), max(a, b)
    C_A = np.interp(a / b, [1.0 / r for r in reversed(PLATE_RATIO)], list(reversed(PLATE_C_A)))
    return float(rho * C_A * math.pi / 4.0 * a * a * b)


def disc(rho: float, r: float) -> float:
    """Added mass 8/3 rho r^3 of a thin disc of radius r [kg] (Lamb, Hydrodynamics, art. 102)."""
    return 8.0 / 3.0 * rho * r**3


def height_factor(A_p: float, h: float) -> float:
    r"""Growth of a flat body's added mass with its height [-].

    .. math:: 1 + \sqrt{\frac{1-\lambda^2}{2(1+\lambda^2)}},\quad \lambda = \frac{\sqrt{A_p}}{h + \sqrt{A_p}}

    Parameters: A_p projected area [m^2]; h height [m].
    """
    l = math.sqrt(A_p) / (h + math.sqrt(A_p))
    return 1.0 + math.sqrt((1.0 - l * l) / (2.0 * (1.0 + l * l)))


def perforation_factor(p: float) -> float:
    """Part of the added mass that is left with a part p of the area open [-], 0 <= p <= 0.5.

    1 up to 5 %; 0.7 + 0.3 cos(pi (p - 5) / 34) up to 34 % (p in per cent); exp((10 - p) / 28) beyond. As published, the
    last two differ by 1.7 % at 34 %.
    """
    percent = 100.0 * p
    if p <= PERFORATION_LEAST:
        return 1.0
    if p < PERFORATION_MIDDLE:
        return 0.7 + 0.3 * math.cos(math.pi * (percent - 5.0) / 34.0)
    return math.exp((10.0 - percent) / 28.0)
