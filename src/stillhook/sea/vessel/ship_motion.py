"""Motion of a ship as a motion reference unit logs it, and what it does to the crane tip.

Axes fixed in the ship, right-handed: x forward, y to port, z up. Signs as a Kongsberg Seapath gives them: roll phi
positive with port side up (right-handed about x), pitch theta positive with bow up (left-handed about y: it is -eta_5
of the wave-load convention, and roll is eta_4). Heave is positive up here, regardless of the log.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import MotionError
from stillhook.physics.scalar import G
from stillhook.sea.motion.recorded import Recorded
from stillhook.units import parse, quote

Offset = tuple[str, str, str]

MAX_OFFSET = 300.0  # m: longer than any crane vessel from its motion sensor to its crane tip


@dataclass(frozen=True)
class ReadReport:
    """How a log was read: what it held, what was left out, and what deserves a look."""

    source: str
    form: str
    """What the file was read as, such as "CSV"."""
    heave: Literal["up", "down"]
    """How the file's heave was taken to count; in the table it counts up."""
    time: str
    """Where the times are from."""
    samples: int
    duration: float
    interval: float
    """Median time between samples [s]; shortest, longest and the standard deviation (jitter) next to it [s]."""
    shortest: float
    longest: float
    jitter: float
    gaps: int
    """Intervals longer than 1.5 medians, bridged by the curve through the samples; `longest` is the longest of them."""
    longest_at: float
    """Where the longest interval begins [s from the first sample]."""
    counts: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    """Lines and samples by what became of them; those at 0 are left out of the text."""
    cautions: tuple[str, ...] = ()
    column: str = "heave"
    """Which height the file holds: heave of the ship, or tip of the crane."""

    def describe(self) -> str:
        """The report on one line."""
        longest = f"longest {self.longest:.3g} s at {self.longest_at:.6g} s"
        gaps = f"{self.gaps} {'gap' if self.gaps == 1 else 'gaps'} ({longest})" if self.gaps else "no gaps"
        counted = "".join(f", {name} {count}" for name, count in self.counts.items() if count)
        direction = "positive down in the file, turned over" if self.heave == "down" else "positive up in the file"
        text = (
            f"{self.source} read as {self.form}: {self.samples} samples over {self.duration:.6g} s, {self.time} time, "
            f"interval {self.interval:.4g} s ({self.shortest:.4g} to {self.longest:.4g} s, "
            f"jitter {1e3 * self.jitter:.3g} ms), {gaps}{counted}; {self.column} {direction}."
        )
        return " ".join((text, *(f"Caution: {caution}." for caution in self.cautions)))


@dataclass(frozen=True, eq=False)
class ShipMotion:
    """Heave, roll and pitch of a ship at its motion sensor.

    t [s] from 0, strictly increasing; heave [m] positive up; roll [rad] port up; pitch [rad] bow up, each None where
    the log has none. Heave is that of the point the sensor reports for (a Seapath: its monitoring point).
    """

    t: FloatArray
    heave: FloatArray
    roll: FloatArray | None
    pitch: FloatArray | None
    report: ReadReport

    @property
    def duration(self) -> float:
        return float(self.t[-1] - self.t[0])

    def describe(self) -> str:
        """Standard deviations and the mean period between upward zero crossings, then how the log was read."""
        angles = "".join(
            f", {name} {math.degrees(float(np.std(column, ddof=1))):.3f} deg"
            for name, column in (("roll", self.roll), ("pitch", self.pitch))
            if column is not None
        )
        T_z = mean_zero_crossing_period(self.t, self.heave)
        period = "" if T_z is None else f", mean period {T_z:.2f} s"
        heave = float(np.std(self.heave, ddof=1))
        return f"standard deviations: heave {heave:.3f} m{angles}{period}. {self.report.describe()}"


def mean_zero_crossing_period(t: FloatArray, s: FloatArray) -> float | None:
    """Mean time T_z between upward crossings of the mean [s], crossings by straight lines; None below two crossings."""
    x = s - s.mean()
    up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    if len(up) < 2:
        return None
    crossings = t[up] - x[up] * (t[up + 1] - t[up]) / (x[up + 1] - x[up])
    return float((crossings[-1] - crossings[0]) / (len(up) - 1))


def tip_height(heave: FloatArray, roll: FloatArray, pitch: FloatArray, x: float, y: float, z: float) -> FloatArray:
    r"""Height of the crane tip above where it is on a level ship [m], up positive, with exact rotations.

    .. math:: s_{tip} = s + [R r]_z - r_z
              = s + x \sin\theta + \cos\theta\,(y \sin\varphi + z \cos\varphi) - z

    R turns ship axes into level ones: first roll about the ship's x, then pitch (R = R_y(-theta) R_x(phi)), the order
    in which marine attitude sensors define their angles; heading does not change a height. For small angles this is
    s + y phi + x theta = s + y eta_4 - x eta_5.

    Parameters: heave [m] up, roll [rad] port up, pitch [rad] bow up; x, y, z [m] from the point that heave is given
    for to the crane tip, forward, to port and up. Horizontal motion of the tip is left out.
    """
    sway_and_rise = y * np.sin(roll) + z * np.cos(roll)
    height: FloatArray = heave + x * np.sin(pitch) + np.cos(pitch) * sway_and_rise - z
    return height


def tip_motion(ship: ShipMotion, tip: Offset, *, every: str | None = "0.5 s") -> Recorded:
    """Motion of the crane tip of a ship that moves as logged: `tip_motion(ship, tip=("-20 m", "12 m", "35 m"))`.

    Parameters: ship; tip, the lever arm from the motion sensor's point to the crane tip as texts: forward, to port, up.
    All zeros gives the heave itself. A steady heel or trim stays in as a steady height; `about_mean` takes it off.
    every: where the log samples at least twice as fast, the step of the points that `Recorded.thinned` makes, so
    that rounding in the log does not become acceleration; None keeps every sample.
    Errors: MotionError for a lever without roll and pitch to turn it, for one beyond any ship, and for a tip that
    would fall faster than gravity, which is a spike or a jumping clock in the log; UnitError for a bare number.
    """
    x, y, z = offset(tip)
    source = ship.report.source
    if ship.roll is None or ship.pitch is None:
        missing = " and ".join(name for name, c in (("roll", ship.roll), ("pitch", ship.pitch)) if c is None)
        if (x, y, z) != (0.0, 0.0, 0.0):
            do = 'Log roll and pitch, or give tip=("0 m", "0 m", "0 m") for the heave alone.'
            raise MotionError(f"{source}: has no {missing}, which a crane tip off the motion sensor needs. {do}")
        height = ship.heave
    else:
        height = tip_height(ship.heave, ship.roll, ship.pitch, x, y, z)
    report = f"Crane tip {x:g} m forward, {y:g} m to port, {z:g} m up of the motion sensor. {ship.report.describe()}"
    return sea_worthy(Recorded(ship.t, height, source=source, report=report), every)


def offset(tip: Offset, where: str = "tip") -> tuple[float, float, float]:
    """The three texts of a lever arm as x, y, z [m]."""
    if isinstance(tip, str) or not isinstance(tip, tuple | list) or len(tip) != 3:
        raise MotionError(
            f'{where} = {quote(tip)} is not three lengths. Give forward, to port and up, as ("-20 m", "12 m", "35 m").'
        )
    x, y, z = (parse(text, "length", f"{where} {name}") for text, name in zip(tip, ("x", "y", "z"), strict=True))
    if max(abs(x), abs(y), abs(z)) > MAX_OFFSET:
        raise MotionError(f"{where} = {quote(tip)} is more than {MAX_OFFSET:g} m from the sensor. Check its units.")
    return x, y, z


def sea_worthy(motion: Recorded, every: str | None) -> Recorded:
    """The motion, thinned where it is sampled much faster than the sea moves.

    Errors: MotionError if it still falls or rises by more than gravity: no sea does that.
    """
    if every is not None and np.median(np.diff(motion.times)) <= parse(every, "time", "every") / 2.0:
        motion = motion.thinned(every)
    _, _, a = motion.sample(motion.times)
    worst = int(np.argmax(np.abs(a)))
    if abs(a[worst]) > G:
        problem = f"acceleration {a[worst]:.3g} m/s^2 at {motion.times[worst]:.6g} s is beyond gravity"
        do = 'Choose another piece with start and duration, try time="instrument", or clean the log.'
        raise MotionError(f"{motion.source}: {problem}: a spike or jumping times in the log. {do}")
    return motion
