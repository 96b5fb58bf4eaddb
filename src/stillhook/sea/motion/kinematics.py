"""Water under irregular and regular waves at one place, over time and depth, for a load that passes through."""

from __future__ import annotations

from dataclasses import dataclass, field

from stillhook.base.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class WaveField:
    """Surface and vertical water motion at the load's place, sampled evenly from t = 0 on, coherent with the tip's
    motion.

    dt spacing [s] (0.1 s or less); n samples. eta (n,) surface elevation [m, up positive] and eta_dot (n,) its rate
    [m/s]; w, a (n, L) vertical water speed [m/s] and acceleration [m/s^2], up positive, on L levels below still water:
    z_j = -z_0 (exp(j ds) - 1) [m], j = 0 .. L - 1, so that level 0 is the still surface. Above it kinematics stay those
    of the surface (linear theory, no stretching); below the last level the water stands.
    """

    dt: float
    eta: FloatArray = field(repr=False)
    eta_dot: FloatArray = field(repr=False)
    w: FloatArray = field(repr=False)
    a: FloatArray = field(repr=False)
    z_0: float
    ds: float
    source: str = ""

    @property
    def duration(self) -> float:
        """Last time at which the water is known [s]."""
        return self.dt * (len(self.eta) - 1)
