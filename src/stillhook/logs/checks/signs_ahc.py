"""Signs of a log in which the winch compensates the crane tip's motion: every pair of signals that must run together,
or against each other, is a relation; the fewest signals that explain all broken relations are named.

What is used: wire out grows as the tip rises while the winch compensates; speeds, pump command and pump setting run
together and against the tip; v_tip and a_tip are the slopes of s_tip and v_tip; friction makes p_a - p_b higher when
hoisting than when lowering, whatever part of the load a passive system carries; the PLC's error is s_tip - s_w but for
a constant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.logs.types import Log

PIECE = 30.0  # s: a few waves
FOLLOWS = 0.9  # correlation of wire and tip speed, of either sign, while the winch compensates
RATIO = 2.0  # between the sizes of both speeds, at most
LEAST = 60.0  # s of compensation from which signs are judged by it
AGREE = 0.5  # correlation beyond which two signals clearly go together, or against each other
FEWEST = 50  # values that two signals must share
MOST_NAMED = 3  # ways out that are named
PRESSURE = "p_a"  # represents the pressure drop


@dataclass(frozen=True)
class Relation:
    """Two signals that must run together; broken where they run against each other."""

    one: str
    other: str
    broken: bool


def compensating(log: Log) -> BoolArray:
    """(n,) where the wire follows the tip, of either sign; all False where it does for less than LEAST in all."""
    v, tip = _wire_speed(log), _tip_speed(log)
    out = np.zeros(len(log.t), np.bool_)
    if v is None or tip is None or len(log.t) < FEWEST:
        return out
    piece = np.floor((log.t - log.t[0]) / PIECE).astype(np.int64)
    for k in np.unique(piece):
        at = np.flatnonzero(piece == k)
        x, y = v[at], tip[at]
        ok = np.isfinite(x) & np.isfinite(y)
        if ok.sum() < FEWEST:
            continue
        a, b = float(np.std(x[ok])), float(np.std(y[ok]))
        if a and b and 1.0 / RATIO < a / b < RATIO and abs(np.corrcoef(x[ok], y[ok])[0, 1]) > FOLLOWS:
            out[at] = True
    return out if out.sum() * log.every >= LEAST else np.zeros_like(out)


def contradictions(log: Log, active: BoolArray, friction: int, way: Callable[[str], str]) -> list[str]:
    """What to write in the mapping, in clauses, empty where nothing contradicts. active: where the winch compensates;
    friction: 1 where the pressure drop is higher when hoisting by the first speed there is, -1 where it is lower, 0
    unknown; way: the row for a signal.
    """
    relations = _relations(log, active, friction)
    broken = [r for r in relations if r.broken]
    ways = _fewest(relations) if broken else []
    if len(ways) == 1:
        signals, pressure = [n for n in ways[0] if n != PRESSURE], [n for n in ways[0] if n == PRESSURE]
        return [
            f"{_listed([way(n) for n in names])}: {_reason(names, broken)}" for names in (signals, pressure) if names
        ]
    if ways:
        named = ", or ".join(_listed([way(n) for n in names]) for names in ways[:MOST_NAMED])
        return [f"{named}: {_reason(ways[0], broken)}"]
    return [*_error_sign(log, active, way), *_pull(log, way)]


def _relations(log: Log, active: BoolArray, friction: int) -> list[Relation]:
    slopes = _slopes(log)
    winch = [name for name in ("omega_m", "v_w", "s_w", "u_p", "alpha_p") if name in slopes]
    tip = [name for name in ("s_tip", "v_tip") if name in slopes]
    pairs = [*combinations(winch, 2), *combinations(tip, 2)]
    relations = [_relation(one, other, slopes[one], slopes[other]) for one, other in pairs]
    for one in tip:
        relations += [_relation(one, other, np.where(active, -slopes[one], np.nan), slopes[other]) for other in winch]
    if "a_tip" in log.signals and tip:
        relations.append(_relation("a_tip", tip[-1], _good(log, "a_tip"), _rate(slopes[tip[-1]], log.t)))
    speed = next((name for name in ("omega_m", "v_w") if name in winch), None)
    if friction and speed:
        relations.append(Relation(PRESSURE, speed, friction < 0))
    return [r for r in relations if r is not None]


def _slopes(log: Log) -> dict[str, FloatArray]:
    """Signals as speeds: of the wire hoisting positive, of the tip up positive."""
    out = {name: _good(log, name) for name in ("omega_m", "v_w", "u_p", "alpha_p", "v_tip") if name in log.signals}
    if "s_w" in log.signals:
        out["s_w"] = -_rate(_good(log, "s_w"), log.t)
    if "s_tip" in log.signals:
        out["s_tip"] = _rate(_good(log, "s_tip"), log.t)
    return out


def _relation(one: str, other: str, x: FloatArray, y: FloatArray) -> Relation | None:
    c = _correlation(x, y)
    return Relation(one, other, c < 0.0) if abs(c) > AGREE else None


def _correlation(x: FloatArray, y: FloatArray) -> float:
    """Correlation about zero; 0 where too few values tell."""
    ok = np.isfinite(x) & np.isfinite(y)
    size = float(np.sqrt(np.sum(x[ok] ** 2) * np.sum(y[ok] ** 2)))
    return float(np.sum(x[ok] * y[ok])) / size if ok.sum() >= FEWEST and size else 0.0


def _fewest(relations: Sequence[Relation]) -> list[tuple[str, ...]]:
    """The smallest sets of signals that correct the most relations when turned round."""
    names = list(dict.fromkeys(name for r in relations for name in (r.one, r.other)))
    best: list[tuple[str, ...]] = []
    least = len([r for r in relations if r.broken])
    for number in range(1, len(names) // 2 + 1):
        for flipped in combinations(names, number):
            remaining = sum(r.broken != ((r.one in flipped) != (r.other in flipped)) for r in relations)
            if remaining < least:
                best, least = [flipped], remaining
            elif remaining == least and best and len(best[0]) == number:
                best.append(flipped)
    return best


def _reason(names: Sequence[str], broken: Sequence[Relation]) -> str:
    """Why these signals are to be turned: which others they contradict."""
    met = [(r.one, r.other) for r in broken if (r.one in names) != (r.other in names)]
    against = list(dict.fromkeys(other if one in names else one for one, other in met))
    if PRESSURE in names or against == [PRESSURE]:
        return "friction makes the pressure drop higher when hoisting, and here it is lower"
    against = [name for name in against if name != PRESSURE]
    return f"{'it contradicts' if len(names) == 1 else 'they contradict'} {_listed(against)}"


def _listed(parts: Sequence[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def _error_sign(log: Log, active: BoolArray, way: Callable[[str], str]) -> list[str]:
    """The PLC's error against s_tip - s_w, both as changes over some seconds, without what the operator requested."""
    if not {"e_c_measured", "s_tip", "s_w"} <= log.signals.keys():
        return []
    logged_rate = _rate(_good(log, "e_c_measured"), log.t)
    computed_rate = _rate(_good(log, "s_tip") - _good(log, "s_w"), log.t)
    moved = np.abs(_good(log, "v_op")) > 0.0 if "v_op" in log.signals else np.zeros(len(log.t), np.bool_)
    if _correlation(np.where(active & ~moved, logged_rate, np.nan), computed_rate) < -AGREE:
        return [f"{way('e_c_measured')}: it runs against s_tip - s_w, and too little wire out is positive"]
    return []


def _pull(log: Log, way: Callable[[str], str]) -> list[str]:
    """A wire cannot push."""
    F = _good(log, "F_w") if "F_w" in log.signals else np.empty(0)
    if np.isfinite(F).any() and np.nanpercentile(F, 99.0) < 0.0:
        return [f"{way('F_w')}: it is negative throughout, and tension is positive"]
    return []


def _good(log: Log, name: str) -> FloatArray:
    return np.where(log.doubtful[name], np.nan, log.signals[name])


def _rate(x: FloatArray, t: FloatArray) -> FloatArray:
    return np.gradient(x, t) if len(t) > 1 else np.zeros_like(x)


def _wire_speed(log: Log) -> FloatArray | None:
    if "s_w" in log.signals:
        return -_rate(_good(log, "s_w"), log.t)
    return _good(log, "v_w") if "v_w" in log.signals else None


def _tip_speed(log: Log) -> FloatArray | None:
    if "v_tip" in log.signals:
        return _good(log, "v_tip")
    return _rate(_good(log, "s_tip"), log.t) if "s_tip" in log.signals else None
