r"""The simplified method for lifts through the wave zone and deeper, in closed form: what is printed next to every
simulation.

Characteristic forces on a payload whose extent is small against the waves, at a stated submergence, with the crane
tip's and the waves' largest values combined as if at random phases. Numbers or arrays that broadcast, SI; forces are
magnitudes [N].

Source: DNV-RP-N103 (and the older DNV-RP-H103), simplified method for lifting through the wave zone, and deep water
lowering; not compared with the printed text: check against your edition. Coefficients (wave amplitude over H_s,
limits of T_z, least C_D) come in as arguments; `stillhook.plan` takes them from its table of rules.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from stillhook.base.arrays import FloatArray
from stillhook.physics.scalar import G

SLOW_SHARE, FAST_SHARE = 0.2, 0.7
"""Free-fall speed over relative speed between which the part of the relative speed in a snap falls from all to
nothing."""


def shortest_period(Hs: ArrayLike, factor: float = 8.9) -> FloatArray:
    r"""Least zero-crossing period of the method [s], :math:`8.9\sqrt{H_s/g}`: a wave of 1.8 H_s is then as steep as 1
    to 7. Hs [m]."""
    return np.asarray(factor * np.sqrt(np.asarray(Hs, dtype=np.float64) / G))


def water_speed(zeta_a: ArrayLike, Tz: ArrayLike, d: ArrayLike) -> FloatArray:
    r"""Characteristic vertical speed of the water at depth d [m/s].

    .. math:: v_w = \zeta_a \frac{2\pi}{T_z} e^{-4\pi^2 d / (T_z^2 g)}

    Parameters: zeta_a wave amplitude [m], 0.9 H_s in the method; Tz zero-crossing period [s]; d from still water down
    to the centre of the submerged part [m], 0 or more. Deep water.
    """
    w = 2.0 * math.pi / np.asarray(Tz, dtype=np.float64)
    return np.asarray(np.asarray(zeta_a) * w * np.exp(-(w**2) / G * np.asarray(d)))


def water_acceleration(zeta_a: ArrayLike, Tz: ArrayLike, d: ArrayLike) -> FloatArray:
    """Characteristic vertical acceleration of the water [m/s^2]; parameters of `water_speed`."""
    return np.asarray(2.0 * math.pi / np.asarray(Tz, dtype=np.float64) * water_speed(zeta_a, Tz, d))


def relative_speed(v_c: ArrayLike, v_ct: ArrayLike, v_w: ArrayLike) -> FloatArray:
    r"""Characteristic speed of payload against water [m/s], :math:`v_c + \sqrt{v_{ct}^2 + v_w^2}`.

    v_c speed at which the payload is lowered, v_ct single amplitude of the crane tip's speed, v_w of the water's, all 0
    or more [m/s].
    """
    return np.asarray(np.asarray(v_c) + np.hypot(v_ct, v_w))


def slamming(dA33: ArrayLike, v_r: ArrayLike) -> FloatArray:
    r"""Slamming impact :math:`\tfrac12\rho C_s A_s v_r^2` [N], with :math:`\tfrac12\rho C_s A_s = dA_{33}/dh` [kg/m] of
    the payload."""
    return np.asarray(np.asarray(dA33) * np.asarray(v_r) ** 2)


def drag(B: ArrayLike, v_r: ArrayLike, U: ArrayLike = 0.0) -> FloatArray:
    r"""Drag :math:`\tfrac12\rho C_D A_p v_r\sqrt{v_r^2 + U^2}` [N]; B = rho C_D A_p/2 [N s^2/m^2], C_D 2.5 or more
    unless measured; U current across [m/s], which RP-N103 has not in it."""
    return np.asarray(np.asarray(B) * (np.hypot(v_r, U) * v_r))


def mass_force(M: ArrayLike, A33: ArrayLike, rho_V: ArrayLike, a_ct: ArrayLike, a_w: ArrayLike) -> FloatArray:
    r"""Inertia :math:`\sqrt{[(M + A_{33}) a_{ct}]^2 + [(\rho V + A_{33}) a_w]^2}` [N].

    M mass in air, A33 heave added mass, rho_V mass of the displaced water [kg]; a_ct, a_w single amplitudes of the
    tip's and the water's acceleration [m/s^2].
    """
    return np.asarray(np.hypot((np.asarray(M) + A33) * np.asarray(a_ct), (np.asarray(rho_V) + A33) * np.asarray(a_w)))


def buoyancy_force(rho: float, A_w: ArrayLike, zeta_a: ArrayLike, eta_ct: ArrayLike) -> FloatArray:
    r"""Varying buoyancy :math:`\rho g A_w \sqrt{\zeta_a^2 + \eta_{ct}^2}` [N]; A_w water-plane area [m^2], amplitudes
    of wave, tip [m]."""
    return np.asarray(rho * G * np.asarray(A_w) * np.hypot(zeta_a, eta_ct))


def hydrodynamic(F_D: ArrayLike, F_slam: ArrayLike, F_M: ArrayLike, F_rho: ArrayLike) -> FloatArray:
    r"""Characteristic hydrodynamic force :math:`\sqrt{(F_D + F_{slam})^2 + (F_M - F_\rho)^2}` [N]."""
    return np.asarray(np.hypot(np.asarray(F_D) + F_slam, np.asarray(F_M) - F_rho))


def free_fall_speed(W: ArrayLike, B: ArrayLike) -> FloatArray:
    r"""Speed at which the payload sinks freely, :math:`\sqrt{W/B} = \sqrt{2W/(\rho A_p C_D)}` [m/s]; W submerged weight
    [N]."""
    return np.asarray(np.sqrt(np.asarray(W, dtype=np.float64) / np.asarray(B)))


def snap_speed(v_ff: ArrayLike, v_r: ArrayLike) -> FloatArray:
    r"""Speed at which slack slings come taut, :math:`v_{ff} + C v_r` [m/s].

    C = 1 up to v_ff = 0.2 v_r, cos(pi (v_ff/v_r - 0.2)) up to 0.7 v_r, 0 beyond; free-fall and relative speed [m/s].
    """
    v_ff, v_r = np.asarray(v_ff, dtype=np.float64), np.asarray(v_r, dtype=np.float64)
    ratio = np.divide(v_ff, v_r, out=np.full(np.broadcast(v_ff, v_r).shape, np.inf), where=v_r > 0.0)
    C = np.cos(math.pi * (np.clip(ratio, SLOW_SHARE, FAST_SHARE) - SLOW_SHARE))
    return np.asarray(v_ff + np.where(ratio < FAST_SHARE, C, 0.0) * v_r)


def snap_tension(W: ArrayLike, v: ArrayLike, K: ArrayLike, M: ArrayLike) -> FloatArray:
    r"""Largest tension as a payload that falls at v is caught, :math:`W + \sqrt{W^2 + K M v^2}` [N].

    W its weight in water [N], K stiffness above it [N/m], M mass with added mass [kg]. Exact for a massless spring that
    is taut and unloaded at first: the method's :math:`v\sqrt{K M}` leaves the weight out, which is not on the safe side
    for slow snaps.
    """
    W = np.asarray(W, dtype=np.float64)
    return np.asarray(W + np.sqrt(W**2 + np.asarray(K) * np.asarray(M) * np.asarray(v) ** 2))


def taken_up(W: ArrayLike, v: ArrayLike, K: ArrayLike, M: ArrayLike) -> FloatArray:
    r"""Largest tension as a payload is lifted off something that supports it, :math:`W + v\sqrt{K M}` [N]; parameters
    of `snap_tension`, v hook against support [m/s]. Exact for a massless spring whose tension has grown to W when the
    payload leaves."""
    return np.asarray(np.asarray(W) + np.asarray(v) * np.sqrt(np.asarray(K) * np.asarray(M)))


class Swing(NamedTuple):
    """Amplitudes under a harmonic motion of the wire's upper end: load [m], top tension at the tip, sling tension
    [N]."""

    load: FloatArray
    top: FloatArray
    sling: FloatArray


def swing(
    eta: ArrayLike,
    omega: ArrayLike,
    K: ArrayLike,
    M: ArrayLike,
    m_above: ArrayLike,
    B: ArrayLike = 0.0,
    C_lin: ArrayLike = 0.0,
) -> Swing:
    r"""A payload on a spring whose upper end moves with eta cos(omega t), with quadratic drag linearised for a harmonic
    motion.

    .. math:: z = \frac{K\eta}{K - M'\omega^2 + i\omega\Sigma},\quad \Sigma = \tfrac{8}{3\pi}B\,\omega|z| +
    C_{lin},\quad
        F_{top} = K(\eta - z),\quad F_{sling} = (-M\omega^2 + i\omega\Sigma) z

    Parameters: eta amplitude [m]; omega [rad/s]; K stiffness of wire and slings [N/m]; M payload with added mass,
    m_above what of hook and wire moves with it (a third of the wire) [kg], M' = M + m_above; B = rho C_D A_p/2 [N
    s^2/m^2]; C_lin linear drag [N s/m].
    Source: DNV-RP-N103, deep water lowering, with the period 2 pi sqrt((M + A33 + m L/3)/K); check against your
    edition. Valid below the second natural frequency of the wire. Infinite at resonance without drag.
    """
    eta, omega, K, M, above, B, C_lin = np.broadcast_arrays(
        *(np.asarray(v, dtype=np.float64) for v in (eta, omega, K, M, m_above, B, C_lin))
    )
    spring = K - (M + above) * omega**2
    s = 8.0 / (3.0 * math.pi) * B * omega**2
    pull = K * eta
    size = _size(spring, omega * C_lin, s, pull)
    finite = np.isfinite(size)
    damped = omega * C_lin + s * np.where(finite, size, 0.0)
    moving = finite & (size > 0.0)
    z = np.divide(pull, spring + 1j * damped, out=np.zeros(size.shape, complex), where=moving)
    top = np.where(finite, np.abs(K * (eta - z)), np.inf)
    sling = np.where(finite, np.hypot(M * omega**2, damped) * np.abs(z), np.inf)
    return Swing(np.where(finite, np.abs(z), np.inf), top, sling)


def _size(spring: FloatArray, linear: FloatArray, square: FloatArray, pull: FloatArray) -> FloatArray:
    """|z| of (spring^2 + (linear + square |z|)^2) |z|^2 = pull^2, which rises with |z|: by bisection."""
    with np.errstate(divide="ignore", invalid="ignore"):
        free = np.where(pull > 0.0, pull / np.hypot(spring, linear), 0.0)  # no quadratic drag: the most there can be
        caught = np.where(square > 0.0, np.sqrt(pull / np.where(square > 0.0, square, 1.0)), np.inf)
    high = np.minimum(free, caught)
    if not (square > 0.0).any():
        return np.asarray(high)
    z = np.where(np.isfinite(high), high, 0.0)
    low = np.zeros_like(z)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + z)
        over = np.hypot(spring, linear + square * middle) * middle > pull
        low, z = np.where(over, low, middle), np.where(over, middle, z)
    return np.asarray(np.where(np.isfinite(high), z, np.inf))


HALVINGS = 44
"""Halvings of the bracket of an amplitude: to the last digits."""
