"""The test of any table of vessel motions: in long waves every floating body follows the surface
(`stillhook.sea.vessel.rao`).

What the test cannot show: bow and stern changed together with port and starboard are one with time running backwards,
and roll has the wrong sign beyond its natural period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stillhook.base.arrays import BoolArray, ComplexArray
from stillhook.sea.vessel.rao import DOFS, Rao, long_wave_limits, long_wave_scales

Verdict = Literal["fits", "not shown", "doubtful", "wrong"]
"""From good to bad."""

LONG = 0.35
"""Frequency [rad/s] up to which a wave is long for every ship here: 18 s, 500 m."""
MIDDLE = 0.6
"""Frequency [rad/s] up to which at least the sign of a motion is that of the limit: 10.5 s, 170 m."""
BELOW_ROLL = 0.15
"""Frequency [rad/s] below every ship's natural roll (42 s): from it on roll must have the sign of the slope."""
DOUBTFUL, WRONG = 0.25, 0.6
"""Deviations from the limit, per metre of wave (rotations: per slope): beyond them a motion is doubtful, or another one
than said."""
SLOPES = 25.0
"""Times the slope of the wave beyond which a roll or yaw in long waves is not a motion: 57 is degrees taken for
radians."""
ROLL_RANGE = (0.3, 5.0)  # times the slope: roll beyond it deserves a look
ALIKE = 0.05
"""Spread of the shares of surge, sway, heave and pitch, over their mean, up to which they are out by one factor."""
LARGEST_MIDDLE = 2.5
"""Times the limit beyond which a motion in waves of `LONG` to `MIDDLE` is doubtful: above the natural periods of a ship
every motion comes down to its limit."""
LARGEST_SHIFT, LARGEST_TURN = 4.0, math.radians(20.0)  # m/m, rad/m: beyond what damped ships do in any wave
NO_SHIFT, NO_TURN = 50.0, math.pi
"""Beyond what any ship does [m/m, rad/m]: a slip, or a resonance that makes the table useless."""
USUAL, LONGEST_AND_SHORTEST = (0.02, 10.0), (1e-3, 100.0)
"""What tables have [rad/s], and beyond what none has: 0.06 s to 1.7 h."""
SHALLOW = 0.5  # m: water in which no ship of these floats
END = 0.05  # m/m: what a table may still hold at its highest frequency without a word
ARM = 50.0  # m: makes a rotation comparable with a displacement at the ship's end
MOST_NAMED = 8
"""Headings that are named of a doubtful motion."""
HEAVY = (0, 1, 2, 4)
"""Motions that long waves fix: surge, sway, heave and pitch."""
BLIND = "bow and stern exchanged together with a reversed time sign is not detected"
"""What the test cannot see."""


@dataclass(frozen=True)
class LongWave:
    """One motion at the lowest frequency against the limit, both in shares of it: m/m, or rotation per slope of the
    wave.

    share: how much of the limit is found over all headings, 1 ideal, -1 the other sign; found and limit at the heading
    beta [rad] where they differ most; deviation: by how much they do.
    """

    dof: str
    share: float
    value: complex
    limit: complex
    beta: float
    deviation: float
    verdict: Verdict


def long_wave_test(rao: Rao) -> tuple[LongWave, ...]:
    """The six motions of a vessel at its lowest frequency against the limits of a floating body, at every heading of
    its table.

    fits: within the limit. not shown: the table's longest wave is too short to decide. doubtful: compare it with its
    source. wrong: no floating body moves so, the table means something else.
    """
    limit, values = long_wave_limits(rao.beta), _scaled(rao)
    tests = []
    for d, dof in enumerate(DOFS):
        share = float(np.vdot(limit[d], values[d]).real / np.vdot(limit[d], limit[d]).real)
        apart = np.abs(values[d] - limit[d])
        j = int(np.argmax(apart))
        verdict = _verdict(dof, float(rao.omega[0]), share, float(apart[j]), float(np.abs(values[d]).max()))
        if verdict != "wrong" and _beyond_ships(rao, d).any():
            verdict = "doubtful"
        there = complex(values[d, j]), complex(limit[d, j]), float(rao.beta[j]), float(apart[j])
        tests.append(LongWave(dof, share, *there, verdict))
    shares = np.array([tests[d].share for d in HEAVY])
    mean = shares.mean()  # one factor that is not 1: all motions of a table are too small, or too large
    one_factor = abs(mean - 1.0) > DOUBTFUL and np.abs(shares - mean).max() < ALIKE * abs(mean)
    if rao.omega[0] <= LONG and one_factor:
        tests = [replace(t, verdict="wrong") if t.dof in (DOFS[d] for d in HEAVY) else t for t in tests]
    return tuple(tests)


def verdict_of(rao: Rao, tests: tuple[LongWave, ...]) -> tuple[Verdict, str]:
    """The verdict on a table, which is the worst of its motions, and what it rests on in a line."""
    line = wrong_line(rao, tests)
    if line is not None:
        return "wrong", line
    by = {word: [t for t in tests if t.verdict == word] for word in ("fits", "doubtful", "not shown")}
    met = f"Low-frequency limit: met by {len(by['fits'])} of {len(tests)} motions"
    if by["doubtful"]:
        where = "; ".join(_where(rao, t) for t in by["doubtful"])
        return "doubtful", f"{met}; doubtful: {where}. Compare with the program that made the table before it is used"
    if by["not shown"]:
        long, motions = f"{2.0 * math.pi / rao.omega[0]:.3g} s", ", ".join(t.dof for t in by["not shown"])
        reason = f"the longest wave of the table, {long}, is too short"
        do = f"Export waves of {2.0 * math.pi / LONG:.0f} s and more"
        return "not shown", f"{met}; {motions} not shown: {reason}. {do}"
    return "fits", f"{met}: signs, phases, axes, headings and units agree ({BLIND})"


def _where(rao: Rao, t: LongWave) -> str:
    """A doubtful motion with the headings at which it is furthest from the limit, or largest."""
    d = DOFS.index(t.dof)
    beyond = np.atleast_1d(_beyond_ships(rao, d).any(axis=1))
    if beyond.any():
        _, amount, place = _peak(rao, d)
        order = [j for j in np.argsort(-np.abs(rao.H[d]).max(axis=1)) if beyond[j]]
        headings = ", ".join(f"{math.degrees(rao.beta[j]):.4g}" for j in order[:MOST_NAMED])
        more = f" and {len(order) - MOST_NAMED} more" if len(order) > MOST_NAMED else ""
        reason = "a resonance with almost no damping, or an error in the table"
        return f"{t.dof} reaches {amount} at {place}, {reason} (too much at {headings} deg{more})"
    water = "the slope" if t.dof in DOFS[3:] else "the motion"
    long = f"in waves of {2.0 * math.pi / rao.omega[0]:.3g} s"
    worst = f"{in_words(t.value)} at {math.degrees(t.beta):.4g} deg, limit {in_words(t.limit)}"
    return f"{t.dof} is {t.share:.3g} times {water} of the water {long} ({worst})"


def _beyond_ships(rao: Rao, d: int) -> BoolArray:
    """Where a motion is larger than damped ships make it in any wave (headings, frequencies); in shallow water the
    water itself goes further to and fro."""
    most = LARGEST_SHIFT * long_wave_scales(rao.omega, rao.depth)[d] if d < 3 else LARGEST_TURN
    return np.asarray(np.abs(rao.H[d]) > most, dtype=np.bool_)


def _scaled(rao: Rao) -> ComplexArray:
    return np.asarray(rao.H[:, :, 0] / long_wave_scales(rao.omega[:1], rao.depth))


def _verdict(dof: str, omega: float, share: float, apart: float, largest: float) -> Verdict:
    if omega > MIDDLE:
        return "not shown"
    if dof in ("roll", "yaw"):
        if largest > SLOPES or (dof == "roll" and share < 0.0 and omega <= BELOW_ROLL):
            return "wrong"
        low, high = ROLL_RANGE if dof == "roll" else (0.0, 2.0)
        return "fits" if low <= share <= high else "doubtful"
    if omega > LONG:
        wrong = share < -DOUBTFUL or largest > SLOPES
        return "wrong" if wrong else "doubtful" if largest > LARGEST_MIDDLE else "not shown"
    return "wrong" if apart > WRONG else "doubtful" if apart > DOUBTFUL else "fits"


def wrong_line(rao: Rao, tests: tuple[LongWave, ...]) -> str | None:
    """Why a table is refused, in one line with what would make it right; None where nothing is wrong."""
    bad = [t for t in tests if t.verdict == "wrong"]
    if not bad:
        return _out_of_order(rao) or _beyond(rao)
    deviations = ", ".join(f"{t.dof} {in_words(t.value)} (should be {in_words(t.limit)})" for t in bad[:3])
    more = f" and {len(bad) - 3} more" if len(bad) > 3 else ""
    period, beta = 2.0 * math.pi / rao.omega[0], math.degrees(bad[0].beta)
    return (
        f"{rao.source or rao.name}: no floating body moves so in waves of {period:.3g} s that travel to {beta:.4g} deg:"
        f" {deviations}{more}; rotations per slope of the wave. {_remedy(rao)}"
    )


def _out_of_order(rao: Rao) -> str | None:
    """Refusal of a table whose headings go one way and whose surge and sway, read as a direction, another."""
    if rao.omega[0] > LONG:
        return None
    surge, sway = (1j * _scaled(rao)[:2]).real
    travelled = np.arctan2(sway, surge)
    steps = np.angle(np.exp(1j * (np.roll(travelled, -1) - travelled)))
    if (steps > 0.0).all():
        return None
    j = int(np.argmax(np.abs(np.angle(np.exp(1j * (travelled - rao.beta))))))
    return (
        f"{rao.source or rao.name}: headings are out of order: surge and sway that belong to waves travelling to"
        f" {math.degrees(rao.beta[j]):.4g} deg are those of waves to {math.degrees(travelled[j]) % 360.0:.3g} deg."
        " Export the file again."
    )


def _beyond(rao: Rao) -> str | None:
    """Refusal of a motion larger than any ship's, in any wave."""
    first, last = LONGEST_AND_SHORTEST
    if rao.omega[0] < first or rao.omega[-1] > last:
        problem = (
            f"frequencies of {rao.omega[0]:.3g} to {rao.omega[-1]:.3g} rad/s are not between {first:g} and {last:g}"
        )
        return f"{rao.source or rao.name}: {problem} rad/s, those of waves. Check their unit."
    if rao.depth < SHALLOW:
        return f"{rao.source or rao.name}: a depth of {rao.depth:.3g} m is too shallow for a vessel. Check its unit."
    for d, dof in enumerate(DOFS):
        size, amount, place = _peak(rao, d)
        if size > (NO_SHIFT if d < 3 else NO_TURN):
            problem = f"{dof} of {amount} at {place} is not a ship's motion"
            return f"{rao.source or rao.name}: {problem}. Correct the value, or add damping."
    return None


def _peak(rao: Rao, d: int) -> tuple[float, str, str]:
    """Largest motion in one degree of freedom [m/m, rad/m]; it and where it is in words."""
    j, n = np.unravel_index(int(np.argmax(np.abs(rao.H[d]))), rao.H[d].shape)
    size = float(np.abs(rao.H[d, j, n]))
    amount = f"{size:.3g} m/m" if d < 3 else f"{math.degrees(size):.3g} deg/m"
    return size, amount, f"{2.0 * math.pi / rao.omega[n]:.3g} s and {math.degrees(rao.beta[j]):.4g} deg"


def _remedy(rao: Rao) -> str:
    """What the table would have to mean so that its motions are those of a floating body."""
    values, limit = _scaled(rao), long_wave_limits(rao.beta)
    other_side = np.array([1, -1, 1, -1, 1, -1])[:, None] * values
    degrees = np.array([1.0] * 3 + [math.pi / 180.0] * 3)[:, None]
    backwards = "time the other way (exp(-i omega t) against exp(+i omega t), lag against lead)"
    guesses = (
        (ALIKE, "motions per metre of wave height (crest to trough) in place of amplitude", 2.0 * values),
        (ALIKE, "motions per metre of wave amplitude that are declared as per height", 0.5 * values),
        (WRONG, f"{backwards}, or headings to against from", np.conj(values)),
        (WRONG, "headings that turn the other way, or y to the other side", other_side),
        (WRONG, "both time and the turn of headings the other way", np.conj(other_side)),
        (WRONG, "rotations in deg/m that are declared as rad/m", degrees * values),
        (WRONG, "rotations in rad/m that are declared as deg/m", values / degrees),
        (WRONG, "z the other way, or phases from the trough", -values),
    )
    heavy = list(HEAVY)
    for within, words, H in guesses:
        if np.abs(H[heavy] - limit[heavy]).max() < within:
            return f"It would fit with {words}. Check what the file declares."
    return "Check axes, signs, phases, units and the order of headings."


def remarks(rao: Rao, tests: tuple[LongWave, ...]) -> tuple[str, ...]:
    """What deserves a look: the verdict where the table does not fit, and what is beyond the ends of the table."""
    first, last = float(rao.omega[0]), float(rao.omega[-1])
    word, line = verdict_of(rao, tests)
    lines = [] if word in ("fits", "wrong") else [line]
    if first < USUAL[0] or last > USUAL[1]:
        usual = f"outside {USUAL[0]:g} to {USUAL[1]:g} rad/s"
        lines.append(f"frequencies of {first:.3g} to {last:.3g} rad/s are implausible, {usual}: check their unit")
    remaining = float(np.abs(rao.H[2:5, :, -1] * np.array([1.0, ARM, ARM])[:, None]).max())
    if remaining > END:
        move = f"points up to {ARM:g} m away still move {remaining:.2g} m/m"
        shortest = f"in the shortest waves, {2.0 * math.pi / last:.3g} s, {move}"
        lines.append(f"{shortest}; shorter ones are taken to cause no motion")
    return tuple(lines)


def in_words(z: complex) -> str:
    """A complex number in words: 1, -0.99i, 0.31-0.95i."""
    size = abs(z)
    if abs(z.imag) <= 0.02 * size or size < 0.005:
        return f"{z.real:.2g}" if size >= 0.005 else "0"
    if abs(z.real) <= 0.02 * size:
        return f"{z.imag:.2g}i"
    return f"{z.real:.2g}{z.imag:+.2g}i"
