r"""Inertia of a vessel from its mass, centre of gravity and radii of gyration.

About a point P, with r from P to the centre of gravity and S(r) the matrix of r x, Newton's and Euler's equations of a
rigid body are those of the mass matrix

.. math:: M = \begin{pmatrix} m I & -m S(r) \\ m S(r) & m K^2 - m S(r) S(r) \end{pmatrix}

with K = diag(k_xx, k_yy, k_zz), the radii of gyration about axes through the centre of gravity: products of inertia
about them are 0 (Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, chapter 3).
"""

from __future__ import annotations

import numpy as np

from stillhook.base.arrays import FloatArray


def inertia_matrix(mass: float, radii: FloatArray, lever: FloatArray) -> FloatArray:
    """Mass matrix (6, 6) [kg, kg m, kg m^2] about a point.

    mass [kg]; radii (3,) of gyration about the centre of gravity, roll, pitch, yaw [m]; lever (3,) from the point to
    the centre of gravity [m].
    """
    x, y, z = lever
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    M = np.zeros((6, 6))
    M[:3, :3] = mass * np.eye(3)
    M[:3, 3:], M[3:, :3] = -mass * S, mass * S
    M[3:, 3:] = mass * (np.diag(radii**2) - S @ S)
    return M
