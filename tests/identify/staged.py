"""Measured points as a winch of known friction would give them: the torque balance of hoisting and lowering, solved for the pressures."""

import dataclasses
import functools

import numpy as np

from stillhook.identify.system_friction.fitting.model import Points, Y, loss_of, system_friction
from stillhook.library import motor
from stillhook.library import system_friction as library_friction
from stillhook.physics.scalar import G
from stillhook.units import parse

RPM = parse("1 rev/min", "rotation")
CM3 = parse("1 cm^3/rev", "displacement")
LEVER = 1.5  # m, of the wire on the drum
RATIO = 450.0
COUNT = 11
STEP = 16.0  # s, of one stretch with its ramps: hoisting, then lowering
LEAK_SPREAD = 1.04  # lowering runs faster than hoisting at one pump command
STAIR = (20, 40, 60, 90, 120, 160, 200, 250, 300, 350, 400, 450, 500, 550, 600, 650, 700, 750, 800, 900, 1000)
CRANE_2 = (
    (215, 0, False),
    (215, 77, False),
    (215, 107, False),
    (164, 0, False),
    (164, 77, False),
    (164, 107, False),
    (200, 0, False),
    (200, 107, True),
    (146, 77, True),
    (120, 77, True),
    (146, 107, True),
)
"""Displacement [cm^3/rev], load [t], held out: paper D tables 2 and 5."""


def truth(name: str) -> Y:
    return Y.of(library_friction(name))


LOSS = loss_of(motor("A6VM215"))


def pressure(direction: int, omega: float, D_m: float, T_d: float, y: Y, loss=LOSS) -> float:
    """Pressure drop at which the motors hold load and friction, found by iterating the torque balance [Pa]."""
    dp_L = T_d / RATIO / (COUNT * D_m)
    dp = dp_L
    for _ in range(30):  # friction changes by some per cent of the pressure's change: 30 rounds leave nothing
        one = np.array([omega])
        friction = loss(one, np.array([D_m]), np.array([dp])) + system_friction(one, np.array([T_d]), y)
        dp = dp_L + direction * float(friction[0]) / D_m
    return dp


def stage(y: Y, tests=CRANE_2, stair=STAIR, *, rng=None, sd_dp=0.5e5, sd_omega=0.002, loss=LOSS) -> Points:
    """The points of a campaign; with rng every pressure and speed has normal scatter of sd_dp [Pa] and sd_omega (relative)."""
    clean = exact(y, tuple(tests), tuple(stair), loss)
    return clean if rng is None else disturbed(clean, rng, sd_dp, sd_omega)


def disturbed(points: Points, rng, sd_dp=0.5e5, sd_omega=0.002) -> Points:
    e = rng.standard_normal((4, len(points)))
    return dataclasses.replace(
        points,
        dp_up=points.dp_up + sd_dp * e[0],
        dp_down=points.dp_down + sd_dp * e[1],
        omega_up=points.omega_up * (1 + sd_omega * e[2]),
        omega_down=points.omega_down * (1 + sd_omega * e[3]),
    )


@functools.cache
def exact(y: Y, tests, stair, loss) -> Points:
    rows = []
    for k, (D, load, held) in enumerate(tests):
        D_m, T_d = D * CM3, (load + 3.0) * 1e3 * G * LEVER
        for i, n in enumerate(stair):
            up, down = n * RPM, n * LEAK_SPREAD * RPM
            dp_up, dp_down = pressure(1, up, D_m, T_d, y, loss), pressure(-1, down, D_m, T_d, y, loss)
            rows.append((k, up, down, dp_up, dp_down, D_m, T_d, COUNT, 0.0, held, 2 * i * STEP, (2 * i + 1) * STEP))
    a = np.array(rows, dtype=float).T
    return Points(tuple(str(k + 1) for k in range(len(tests))), a[0].astype(np.intp), *a[1:9], a[9] > 0.0, a[10], a[11])
