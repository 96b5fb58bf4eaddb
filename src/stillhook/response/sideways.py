"""Sideways statics and dynamics of a load on its wire: shape in a current, pendulum of wire, hook and payload, gusts.

Small angles in the dynamics, any angle up to 60 deg in the statics. Left out: bending and torsion of the wire, its
stretch by the current, tangential drag, wind on the wire, and vortex shedding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.physics.scalar import G

STEPS = 200
"""Steps from the hook to the tip: offsets are then right to 1e-4."""
STEEPEST = math.radians(60.0)
"""Largest angle of a wire to the vertical whose shape is calculated."""
CLOSE = 1e-4
"""Length to which the depth of a payload on a wire of given length is found [m]."""

Velocity = Callable[[FloatArray], FloatArray]


class Line(NamedTuple):
    """A wire from a hook at z to a tip at h_tip above the water [m]: F_hook weight below it [N]; w weight per length
    under water and w_air above [N/m]; B = 1/2 rho C_D d of the wire and B_load = 1/2 rho C_D A of what hangs below [N
    s^2/m^3, N s^2/m^2], whose middle is z_load [m]."""

    z: float
    h_tip: float
    F_hook: float
    w: float
    w_air: float
    B: float
    B_load: float
    z_load: float


@dataclass(frozen=True, eq=False)
class WireShape:
    """A wire at rest in a current. z (n,) heights from the hook to the tip [m]; xy (n, 2) place from below the tip [m];
    T (n, 3) force that the wire above exerts on that below [N]; length of the wire [m]."""

    z: FloatArray = field(repr=False)
    xy: FloatArray = field(repr=False)
    T: FloatArray = field(repr=False)
    length: float

    @property
    def offset(self) -> FloatArray:
        """Where the hook is from below the tip (2,) [m]."""
        return np.asarray(self.xy[0])

    @property
    def extra(self) -> float:
        """Wire that it takes more than a straight one [m]."""
        return self.length - float(self.z[-1] - self.z[0])

    @property
    def tension(self) -> float:
        """Tension at the tip [N]."""
        return float(np.linalg.norm(self.T[-1]))

    def lead(self, end: int = -1) -> FloatArray:
        """Angle of the wire to the vertical (2,) [rad], towards the load; at the tip, or at the hook (0)."""
        flat = -self.T[end, :2]
        size = float(np.hypot(*flat))
        return np.asarray(flat * (math.atan2(size, float(self.T[end, 2])) / max(size, 1e-300)))


def wire_shape(line: Line, velocity: Velocity) -> WireShape | None:
    r"""Shape of a wire whose hook is at a given height; None where it is beyond 60 deg to the vertical.

    .. math:: \frac{d\mathbf T}{ds} = w\,\hat z - \tfrac12\rho C_D d\,|\mathbf u_n|\mathbf u_n, \quad
              \mathbf u_n = \mathbf u - (\mathbf u\cdot\mathbf t)\,\mathbf t, \quad
              \mathbf T_0 = (-\mathbf F_D, F_{hook})

    Drag of the velocity across the wire: cross-flow principle, as in DNV-RP-C205 (not compared with the printed text).
    velocity: (n, 2) at heights.
    """
    z = np.union1d(np.linspace(line.z, line.h_tip, STEPS + 1), [0.0] if line.z < 0.0 < line.h_tip else [])
    at_load = velocity(np.array([line.z_load]))[0]
    T = np.array((*(-line.B_load * np.linalg.norm(at_load) * at_load), line.F_hook))
    flow = np.zeros((3, len(z), 3))  # at the lower end, middle and upper end of each step; above the surface none
    for k, place in enumerate((z[:-1] + 1e-9, 0.5 * (z[:-1] + z[1:]), z[1:] - 1e-9)):
        flow[k, :-1, :2] = velocity(place)
    forces, places, length = [T], [np.zeros(2)], 0.0
    for n, dz in enumerate(np.diff(z)):
        w = line.w if z[n] < 0.0 else line.w_air
        if T[2] < np.linalg.norm(T) * math.cos(STEEPEST):
            return None
        first = _slope(T, flow[0, n], w, line.B)
        middle = T + 0.5 * dz * first
        T = T + dz * _slope(middle, flow[1, n], w, line.B)
        places.append(places[-1] + dz * middle[:2] / middle[2])
        length += float(dz * np.linalg.norm(middle) / middle[2])
        forces.append(T)
    xy = np.array(places)
    return WireShape(z, xy - xy[-1], np.array(forces), length)


def _slope(T: FloatArray, flow: FloatArray, w: float, B: float) -> FloatArray:
    """Change of a wire's tension with height (3,) [N/m]."""
    size = math.sqrt(float(T @ T))
    across = flow - (flow @ T) / (size * size) * T
    force = -B * math.sqrt(float(across @ across)) * across
    force[2] += w
    return np.asarray(force * (size / T[2]))


def raised(line: Line, velocity: Velocity) -> float | None:
    """How much higher a payload hangs in a current if no wire is paid out [m]; None as `wire_shape`."""
    up, straight = 0.0, line.h_tip - line.z
    for _ in range(50):
        shape = wire_shape(line._replace(z=line.z + up, z_load=line.z_load + up), velocity)
        if shape is None:
            return None
        more = shape.length - straight
        if abs(more) < CLOSE:
            break
        up += more * math.cos(float(np.hypot(*shape.lead())))
    return up


@dataclass(frozen=True, eq=False)
class Chain:
    """Masses on a wire from the tip down, each swinging sideways: m (n,) with added mass [kg]; T (n,) tension [N] and l
    (n,) length [m] of the part above each; c (n,) drag for a motion in water [N s/m]; zeta damping of each mode against
    the tip, part of critical."""

    m: FloatArray
    T: FloatArray
    l: FloatArray
    c: FloatArray
    zeta: float

    def _stiffness(self) -> FloatArray:
        k = self.T / self.l
        return np.diag(k) + np.diag(np.append(k[1:], 0.0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)

    def _modes(self) -> tuple[FloatArray, FloatArray]:
        """Frequencies (n,), rising [rad/s], and shapes (n, n) of unit modal mass."""
        root = np.sqrt(self.m)
        squares, vectors = np.linalg.eigh(self._stiffness() / np.outer(root, root))
        return np.sqrt(squares), vectors / root[:, None]

    @property
    def periods(self) -> FloatArray:
        r"""Natural periods (n,), longest first [s]: of :math:`\det(K - \omega^2 M) = 0`, K tridiagonal of T/l."""
        return np.asarray(2.0 * math.pi / self._modes()[0])

    @property
    def damping(self) -> FloatArray:
        """Damping of each mode (n,), part of critical, drag in water included."""
        frequencies, shapes = self._modes()
        return np.asarray(self.zeta + self.c @ shapes**2 / (2.0 * frequencies))

    def swing(self, omega: FloatArray) -> Swing:
        r"""Answer to the tip's sideways motion X and to a force F on the lowest mass, at omega (k,).

        .. math:: (K + i\omega (C_\zeta + C) - \omega^2 M)\,r = (\omega^2 M - i\omega C)\,\mathbf 1 X + \mathbf e_n F

        r motion against the tip, C_zeta the modal damping, C the drag in water.
        """
        frequencies, shapes = self._modes()
        M, n = np.diag(self.m), len(self.m)
        modal = M @ shapes @ np.diag(2.0 * self.zeta * frequencies) @ shapes.T @ M
        w = omega[:, None, None]
        system = self._stiffness() + 1j * w * (modal + np.diag(self.c)) - w**2 * M
        by_tip = omega[:, None] ** 2 * self.m - 1j * omega[:, None] * self.c
        by_force = np.zeros((len(omega), n), dtype=complex)
        by_force[:, -1] = 1.0
        r = np.asarray(np.linalg.solve(system, np.stack((by_tip, by_force), axis=-1)), dtype=np.complex128)
        return Swing(r[:, 0, 0] / self.l[0], r[:, 0, 1] / self.l[0], r[:, -1, 0] + 1.0)


class Swing(NamedTuple):
    """At frequencies (k,): angle of the wire at the tip per sideways motion of the tip [rad/m] and per force on the
    payload [rad/N]; load the payload's motion per motion of the tip [-]."""

    tip: ComplexArray
    force: ComplexArray
    load: ComplexArray


def pendulum(l_1: float, m_1: float, l_2: float, m_2: float, zeta: float = 0.0) -> Chain:
    """A double pendulum in air: hook m_1 [kg] on a weightless wire of l_1 [m], payload m_2 on slings of l_2."""
    m = np.array((m_1, m_2))
    return Chain(m, G * np.cumsum(m[::-1])[::-1], np.array((l_1, l_2)), np.zeros(2), zeta)


GUSTS = 60
"""Lengths of gusts that are looked at."""


def gust_factor(q: Callable[[float], float], T_n: float, shortest: float, longest: float) -> float:
    r"""Largest swing in a gust over the swing at rest in the mean wind [-], 1 or more.

    A gust of the length t_d [s], over which the wind pressure is q(t_d), begins and ends at once: of an undamped
    pendulum of the period T_n [s] at rest in the mean wind the largest is

    .. math:: 1 + \left(\frac{q(t_d)}{q(t_m)} - 1\right) D, \quad D = 2 \sin\frac{\pi t_d}{T_n}, \quad
              D = 2 \text{ from } t_d = T_n/2 \text{ on}

    the largest over lengths from `shortest` to `longest` (t_m). Source: rectangular pulse, Biggs 1964, section 2.3.
    """
    t = np.geomspace(shortest, longest, GUSTS)
    more = np.array([q(float(each)) for each in t]) / max(q(longest), 1e-300) - 1.0
    D = np.where(t < 0.5 * T_n, 2.0 * np.sin(math.pi * t / T_n), 2.0)
    return 1.0 + max(0.0, float((more * D).max()))
