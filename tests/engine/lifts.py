"""Payloads, lifts and seas that several tests of lowerings share."""

import math
from typing import Any

from stillhook import read_payload
from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import vessel_file
from stillhook.sea.spectra.parametric import Jonswap
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.spec.lift.lowering import InSea, Lowering
from stillhook.spec.lift.phase import Phase

RAO = read_vessel(vessel_file("construction-vessel-130m"))
X, Y = -15.0, -24.0
"""Crane tip on that vessel, forward and to port [m]."""


def deep_lift(start_depth: str = "1480 m", **more: Any) -> Lowering:
    """A manifold above the seabed in 1500 m, held in compensation for 20 s."""
    given = {
        "payload": read_payload("manifold-60t"),
        "h_tip": "36 m",
        "depth": "1500 m",
        "start_depth": start_depth,
        "duration": "30 s",
    }
    return Lowering(**{**given, "programme": (Phase(mode="ahc", time="20 s"),), **more})


def sea(Hs: float, Tp: float = 8.0) -> Sea:
    return Sea((Train(Jonswap(Hs, Tp), math.radians(165.0), 4.0),))


def in_sea(lift: Lowering | None = None, Hs: float = 2.0, seed: int = 0, **more: Any) -> InSea:
    return InSea(deep_lift() if lift is None else lift, sea(Hs), seed, RAO, X, Y, **more)


SPLASH = deep_lift(
    "10 m", programme=(Phase(mode="splash", speed="6 m/min", time="10 s"), Phase(mode="ahc", time="12 s"))
)
IN_SEAS = [in_sea(seed=seed, Hs=Hs) for Hs in (1.0, 2.5) for seed in range(9)]
IN_SEAS.append(in_sea(SPLASH, seed=3, water=True, left=0.2))
"""More than a block of lanes, and one that shares none with them."""
