"""Vessels by closed forms in a convention drawn at random, and weather of a year or two."""

from __future__ import annotations

import datetime
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.physics.scalar import G

Random = np.random.Generator
Motions = NDArray[np.complex128]
FREQUENCIES = 2.0 * math.pi / np.geomspace(40.0, 3.6, 30)
"""Frequencies of a vessel's table [rad/s]."""
LONGEST_WAVES = 2.0 * math.pi / 60.0
"""The lowest of them [rad/s]: a wave of 60 s."""


class Barge(NamedTuple):
    """A box: length, breadth, draught [m]; natural period [s] and damping ratio [-] of its roll."""

    L: float
    B: float
    T: float
    T_4: float
    zeta_4: float


def barge(rng: Random) -> Barge:
    """A box of the size of supply to construction vessels."""
    L = rng.uniform(75.0, 160.0)
    B = L / rng.uniform(4.2, 5.5)
    return Barge(L, B, rng.uniform(4.5, 7.5), rng.uniform(9.0, 15.0), rng.uniform(0.06, 0.15))


def motions(ship: Barge, omega: NDArray[np.float64], beta: NDArray[np.float64]) -> Motions:
    """Surge, sway, heave [m/m], roll, pitch, yaw [rad/m] over heading and frequency (6, m, k), time exp(+i omega t),
    axes x forward, y port, z up, beta where waves go, counter-clockwise from the bow [rad].

    Heave and pitch as Jensen, Mansour and Olsen (2004), Ocean Engineering 31, for a box at zero speed, with the phase
    that their damping and stiffness have; across the breadth the mean of the wave as along the length; roll as one
    degree of freedom; the rest follows the water.
    """
    k = omega**2 / G
    c, s = np.cos(beta)[:, None], np.sin(beta)[:, None]
    smith, x, y = np.exp(-k * ship.T), 0.5 * k * ship.L * np.abs(c), 0.5 * k * ship.B * np.abs(s)
    force, moment = np.sinc(x / math.pi) * np.sinc(y / math.pi) * smith, _third(x) * np.sinc(y / math.pi) * smith
    A = 2.0 * np.sin(0.5 * k * ship.B) * smith
    damping = 1j * A**2 / (k * ship.B)
    follow = (1.0 - k * ship.T + damping) / (1.0 - 2.0 * k * ship.T + damping)
    r = omega * ship.T_4 / (2.0 * math.pi)
    rolling = 1.0 / (1.0 - r**2 + 2j * ship.zeta_4 * r)
    mean = np.sinc(x / math.pi) * np.sinc(y / math.pi) * np.sqrt(smith)
    H = [-1j * c * mean, -1j * s * mean, force * follow, -1j * k * s * force * rolling]
    H += [1j * k * c * moment * follow, -k * s * c * moment]
    return np.array(np.broadcast_arrays(*H), dtype=np.complex128)


def _third(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """3 (sin x - x cos x) / x^3, 1 for nothing [-]."""
    safe = np.where(x > 1e-3, x, 1.0)
    return np.where(x > 1e-3, 3.0 * (np.sin(safe) - safe * np.cos(safe)) / safe**3, 1.0)


AXES = {
    "x forward, y port, z up": (1, 1, 1, 1, 1, 1),
    "x aft, y starboard, z up": (-1, -1, 1, -1, -1, 1),
    "x forward, y starboard, z down": (1, -1, -1, 1, -1, -1),
}
"""Signs of the six motions in each of the right-handed axes, against the first."""
STEP = 30.0
"""Between headings of a table [deg]."""


def vessel(rng: Random, name: str) -> str:
    """The table of a box in a convention drawn at random."""
    ship = barge(rng)
    axes = str(rng.choice(list(AXES)))
    lag, polar = rng.random() < 0.5, rng.random() < 0.5
    where, turn, end = (str(rng.choice(pair)) for pair in _HEADING)
    mirror = rng.random() < 0.6
    declared = np.arange(0.0, 180.0 + 0.1 if mirror else 360.0 - 0.1, STEP)
    beta = np.radians(declared) * (1.0 if turn == "counter-clockwise" else -1.0)
    beta = beta + math.pi * ((where == "come from") != (end == "stern"))
    omega = np.concatenate(([LONGEST_WAVES], FREQUENCIES))
    H = motions(ship, omega, beta) * np.array(AXES[axes])[:, None, None]
    rotations, scale = ("deg", 180.0 / math.pi) if rng.random() < 0.5 else ("rad", 1.0)
    H[3:] *= scale
    column, first = _FREQUENCY[int(rng.integers(3))]
    lines = [f"# name: {name}", f"# axes: {axes}"]
    lines += [f"# phase: {'lag' if lag else 'lead'}" if polar else f"# time: exp({'-' if lag else '+'}i omega t)"]
    lines += [f"# heading: waves {where}, {turn} from {end}", f"# mirror: {'port-starboard' if mirror else 'none'}"]
    lines += [f"# origin: centre of a box of {ship.L:.1f} m by {ship.B:.1f} m by {ship.T:.2f} m, still waterline"]
    lines += [f"# note: closed forms, roll {ship.T_4:.1f} s with {100.0 * ship.zeta_4:.0f} % of critical damping"]
    sep, two = str(rng.choice([",", ";"])), ("amplitude", "phase") if polar else ("re", "im")
    lines.append(sep.join([column, "heading [deg]", *_columns(two, rotations)]))
    values = np.conj(H) if lag else H
    for j, k in rng.permutation([(j, k) for j in range(len(declared)) for k in range(len(omega))]):
        numbers = [first(omega[k]), declared[j]]
        for z in values[:, j, k]:
            numbers += [abs(z), math.degrees(np.angle(z))] if polar else [z.real, z.imag]
        lines.append(sep.join(f"{v:.7g}" for v in numbers))
    return "\n".join(lines) + "\n"


_HEADING = (("travel to", "come from"), ("counter-clockwise", "clockwise"), ("bow", "stern"))
_FREQUENCY: tuple[tuple[str, Any], ...] = (
    ("omega [rad/s]", lambda w: w),
    ("period [s]", lambda w: 2.0 * math.pi / w),
    ("frequency [Hz]", lambda w: w / (2.0 * math.pi)),
)


def _columns(two: tuple[str, str], rotations: str) -> list[str]:
    """Columns of the six motions."""
    units = dict.fromkeys(("surge", "sway", "heave"), "m/m") | dict.fromkeys(("roll", "pitch", "yaw"), f"{rotations}/m")
    return [f"{dof} {part} [{'deg' if part == 'phase' else unit}]" for dof, unit in units.items() for part in two]


HS = ("hs", "swh", "Hm0 [m]", "significant_wave_height [m]", "VHM0")
TP = ("tp", "tp [s]", "peak_period", "VTPK")
FROM, PLAIN = ("wave_from_direction", "wave_from_direction [deg]"), ("wave_direction", "mwd", "dir")


def weather(rng: Random) -> tuple[str, dict[str, str]]:
    """A year or two of waves, a record every three or six hours, and what a plan must say of the file."""
    every = int(rng.choice([3, 6]))
    n = int(rng.choice([1, 2])) * 8766 // every
    t = np.arange(n) * every
    season = 0.35 * np.cos(2.0 * math.pi * (t / 8766.0 - 0.04))
    Hs = np.exp(math.log(rng.uniform(1.0, 2.2)) + season + 0.45 * _correlated(rng, n, 30.0 / every))
    Tp = np.clip(rng.uniform(4.6, 5.6) * np.sqrt(Hs) * np.exp(0.18 * _correlated(rng, n, 24.0 / every)), 3.0, 20.0)
    come_from = np.mod(rng.uniform(0.0, 360.0) + 45.0 * _correlated(rng, n, 40.0 / every), 360.0)
    says, plain = dict[str, str](), rng.random() < 0.4
    heading = str(rng.choice(PLAIN if plain else FROM))
    if plain and rng.random() < 0.5:
        come_from, says["sense"] = np.mod(come_from + 180.0, 360.0), "going-to"
    elif plain:
        says["sense"] = "coming-from"
    comma = rng.random() < 0.4
    sep = ";" if comma else ","
    german = rng.random() < 0.4
    lines = [sep.join(["time", str(rng.choice(HS)), str(rng.choice(TP)), heading])]
    start = datetime.datetime(2015, 1, 1)
    for i in range(n):
        stamp = start + datetime.timedelta(hours=int(t[i]))
        cells = [f"{stamp:%d.%m.%Y %H:%M}" if german else f"{stamp:%Y-%m-%dT%H:%MZ}"]
        cells += [f"{Hs[i]:.2f}", f"{Tp[i]:.1f}", f"{come_from[i]:.0f}"]
        lines.append(sep.join([cells[0], *(c.replace(".", ",") if comma else c for c in cells[1:])]))
    return "\n".join(lines) + "\n", says


def _correlated(rng: Random, n: int, scale: float) -> NDArray[np.float64]:
    """Normal numbers (n,) whose correlation fades over a scale in records."""
    from scipy.signal import lfilter

    a = math.exp(-1.0 / scale)
    return np.asarray(lfilter([math.sqrt(1.0 - a * a)], [1.0, -a], rng.normal(size=n)), dtype=np.float64)
