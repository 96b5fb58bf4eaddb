"""Signs that contradict each other: hoisting is positive, A is the hoisting side, wire out grows when lowering;
and in heave compensation every pair of signals."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import LogError
from stillhook.logs.resample import on_stretches, stretches
from stillhook.logs.types import Log

PIECE = 30.0  # s: a few waves
FOLLOWS = 0.9  # correlation of wire and tip speed, of either sign, while the winch compensates
RATIO = 2.0  # between the sizes of both speeds, at most
LEAST = 60.0  # s of compensation from which signs are judged by it
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
    """Correlation about zero; 0 where there are too few values."""
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
    pairs = [(r.one, r.other) for r in broken if (r.one in names) != (r.other in names)]
    against = list(dict.fromkeys(other if one in names else one for one, other in pairs))
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


AGREE = 0.5  # correlation beyond which two signals clearly go together, or against each other
FEWEST_BINS = 50  # bins of motion from which a sign may be judged
MOVING = 0.1  # of the largest speed: slower bins say little of direction
SHORTEST_MOVE = 5  # bins
FEWEST_PAIRS = 3  # neighbouring moves up and down
MOST_PAIRS = 0.8  # of them must say the same
CLEAR = 0.5e5  # Pa: smaller differences between directions are noise
HANGING = (
    1.0  # times the difference between directions: with a larger mean the drop has one sign in both, so a load hangs
)


def check_signs(log: Log) -> None:
    """LogError, with the row of the mapping to write, where the signs of a winch's signals contradict each other."""
    log = _on_stretches(log)
    if {"s_tip", "v_tip"} & log.signals.keys():
        contradicting = contradictions(log, compensating(log), _friction_way(log), lambda name: _row(log, name))
        _refuse(log, contradicting, "Hoisting and up are positive")
        return
    speed = next((name for name in ("omega_m", "v_w") if name in log.signals), None)
    if speed is None:
        return
    v = _good(log, speed)
    problems = _speeds(log, v, speed)
    flipped_speed, swapped, unclear = _friction(log, v)
    command = _together(_good(log, "u_p"), v) if "u_p" in log.signals else 0.0
    if unclear:
        problems.append(_unclear(log, speed, command))
    if swapped:
        problems.append(
            _swap(log) + ": the pressure drop is negative with a hanging load (map p_hp if a passive system carries it)"
        )
    if flipped_speed:
        problems.append(
            f"set sign = {-_sign(log, speed)} for {speed}: the pressure drop is higher when it is negative, and"
            " hoisting must be positive"
        )
    if command > AGREE and flipped_speed:
        problems.append(f"set sign = {-_sign(log, 'u_p')} for u_p, which runs with {speed}")
    if command < -AGREE and not unclear and not flipped_speed:
        checked = (
            "the pressures agree with the speed"
            if swapped or _has_pressure(log)
            else "or for the speed, whichever counts hoisting negative"
        )
        problems.append(f"set sign = {-_sign(log, 'u_p')} for u_p: it runs against {speed} ({checked})")
    if not unclear or command < -AGREE:  # otherwise the speed itself is in doubt
        problems += _wire(log, -v if flipped_speed or unclear else v, speed)
    _refuse(log, problems, "Hoisting is positive")


def _refuse(log: Log, problems: list[str], rule: str) -> None:
    if problems:
        reasons = "; ".join(problems)
        raise LogError(
            f"{log.source}: signs contradict each other. In the mapping {reasons}. {rule}, p_a is the hoisting side."
        )


def _on_stretches(log: Log) -> Log:
    """The log with means of about 0.1 s in place of narrower bins, doubtful ones left out."""
    index = np.round(log.t / log.every).astype(np.int64)
    wide = stretches(index, log.every)
    if wide is index or not len(wide):
        return log
    starts = np.flatnonzero(np.diff(wide, prepend=wide[0] - 1))
    means = {name: on_stretches(_good(log, name), starts) for name in log.signals}
    doubtful = {name: np.isnan(values) for name, values in means.items()}
    t = on_stretches(log.t, starts)
    every = float(np.median(np.diff(t))) if len(t) > 1 else log.every
    return replace(log, t=t, signals=means, doubtful=doubtful, every=every, at=None, number=None)


def _row(log: Log, name: str) -> str:
    """The row of the mapping that turns a signal round."""
    if name == PRESSURE:
        return _swap(log)
    offset = (
        " and an offset that makes it the wire out" if name == "s_w" and np.nanmedian(log.signals[name]) > 0.0 else ""
    )
    return f"set sign = {-_sign(log, name)}{offset} for {name}"


def _friction_way(log: Log) -> int:
    """1 where the pressure drop is higher when hoisting by the first speed there is, -1 where it is lower, 0 where it
    does not determine."""
    speed = next((name for name in ("omega_m", "v_w") if name in log.signals), None)
    if speed is None or not _has_pressure(log):
        return 0
    apart = _apart(_moves(_good(log, speed), _drop(log)))
    return 0 if apart is None else int(np.sign(apart))


def _drop(log: Log) -> FloatArray:
    return _good(log, "dp_m") if "dp_m" in log.signals else _good(log, "p_a") - _good(log, "p_b")


def _good(log: Log, name: str) -> FloatArray:
    return np.where(log.doubtful[name], np.nan, log.signals[name])


def _sign(log: Log, name: str) -> int:
    return log.mapping[name].sign if log.mapping and name in log.mapping else 1


def _together(x: FloatArray, y: FloatArray) -> float:
    """How much two signals go together about zero, from -1 to 1; 0 where there are too few bins."""
    ok = np.isfinite(x) & np.isfinite(y)
    x, y = x[ok], y[ok]
    if not len(x) or not x.any() or not y.any():
        return 0.0
    moves = (np.abs(y) > MOVING * np.abs(y).max()) & (np.abs(x) > MOVING * np.abs(x).max())
    if moves.sum() < FEWEST_BINS:
        return 0.0
    x, y = x[moves], y[moves]
    return float(np.sum(x * y) / np.sqrt(np.sum(x * x) * np.sum(y * y)))


def _speeds(log: Log, v: FloatArray, speed: str) -> list[str]:
    if speed == "omega_m" and "v_w" in log.signals and _together(_good(log, "v_w"), v) < -AGREE:
        return [
            f"set sign = {-_sign(log, 'v_w')} for v_w, or sign = {-_sign(log, speed)} for {speed}: they run against"
            " each other"
        ]
    return []


def _has_pressure(log: Log) -> bool:
    return "dp_m" in log.signals or {"p_a", "p_b"} <= log.signals.keys()


def _friction(log: Log, v: FloatArray) -> tuple[bool, bool, bool]:
    """Whether the speed is flipped, the pressures are swapped, or one of both and the load does not say which."""
    if not _has_pressure(log):
        return False, False, False
    moves = _moves(v, _drop(log))
    apart = _apart(moves)
    if apart is None:
        return False, False, False
    load = float(np.median([mean for _, mean in moves]))
    hangs = abs(load) > HANGING * abs(apart)
    swapped = hangs and load < 0.0
    if (
        swapped and "p_hp" in log.signals
    ):  # a passive system that carries more than the load makes the drop negative as well
        swapped = hangs = False
    against = (apart < 0.0) != swapped  # swapped pressures turn the difference round as well
    return against and hangs, swapped, against and not hangs


def _moves(v: FloatArray, dp: FloatArray) -> list[tuple[int, float]]:
    """Moves in one direction: the direction and the median pressure drop of each."""
    ok = np.isfinite(v) & np.isfinite(dp)
    v, dp = v[ok], dp[ok]
    if not len(v):
        return []
    way = np.where(np.abs(v) > MOVING * np.abs(v).max(), np.sign(v), 0.0).astype(int)
    edges = np.flatnonzero(np.diff(way, prepend=way[0] - 2, append=way[-1] - 2))
    pieces = [(int(way[a]), dp[a:b]) for a, b in pairwise(edges) if way[a] and b - a >= SHORTEST_MOVE]
    return [(direction, float(np.median(piece))) for direction, piece in pieces]


def _apart(moves: list[tuple[int, float]]) -> float | None:
    """How much higher the pressure drop is when hoisting than in the neighbouring moves down [Pa]; None where they do
    not agree."""
    differences = np.array([a[1] - b[1] if a[0] > 0 else b[1] - a[1] for a, b in pairwise(moves) if a[0] != b[0]])
    if len(differences) < FEWEST_PAIRS or abs(np.median(differences)) < CLEAR:
        return None
    apart = float(np.median(differences))
    return apart if np.mean(np.sign(differences) == np.sign(apart)) >= MOST_PAIRS else None


def _swap(log: Log) -> str:
    if "dp_m" in log.signals:
        return f"set sign = {-_sign(log, 'dp_m')} for dp_m"
    return "swap the columns of p_a and p_b"


def _unclear(log: Log, speed: str, command: float) -> str:
    either = f"set sign = {-_sign(log, speed)} for {speed}"
    reason = "friction makes the pressure drop higher when hoisting, and here it is lower"
    if command < -AGREE:
        return f"{either}: {reason}, and the pump command runs against the speed"
    both = f" and sign = {-_sign(log, 'u_p')} for u_p, which runs with it" if command > AGREE else ""
    return f"{_swap(log)}, or {either}{both}: {reason}"


def _wire(log: Log, v: FloatArray, speed: str) -> list[str]:
    if "s_w" not in log.signals:
        return []
    s, t = _good(log, "s_w"), log.t
    rate = np.gradient(s, t) if len(t) > 1 else np.zeros_like(s)
    if _together(rate, v) > AGREE:
        return [
            f"set sign = {-_sign(log, 's_w')} for s_w: it grows while {speed} is positive, and wire paid out must"
            " shrink when hoisting"
        ]
    return []
