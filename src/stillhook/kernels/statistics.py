"""Running statistics of one trajectory, folded once per PLC cycle, and peak-to-peak values over a moving window
(van Herk, Gil and Werman); no series is stored."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stillhook.kernels.oscillation import blank_oscillation
from stillhook.physics.records import fields
from stillhook.physics.scalar import fmax, fmin, scalar
from stillhook.winches.records import NOT_YET


class CommonStats(NamedTuple):
    """Extremes, times [cycles] and sums over the part of the run that counts (after the warm-up), of every winch.

    `_cycles` fields count PLC cycles; `e_sum`, `e2_sum`, the tip's sums and `through` are trapezoidal sums over cycles.
    """

    cycles: float
    e_min: float
    e_max: float
    em_min: float
    em_max: float
    tip_min: float
    tip_max: float
    u_p_max: float
    u_raw_max: float
    v_w_max: float
    v_tip_max: float
    F_min: float
    F_max: float
    saturation_cycles: float
    slack_cycles: float
    wire_cycles: float
    e_sum: float
    e2_sum: float
    tip_sum: float
    tip2_sum: float
    through: float
    E_start: float
    E_end: float


LOWEST = ("e_min", "em_min", "tip_min", "F_min")
HIGHEST = ("e_max", "em_max", "tip_max", "F_max")


def blank_common() -> CommonStats:
    """Statistics of nothing yet."""
    values = dict.fromkeys(CommonStats._fields, 0.0)
    values |= dict.fromkeys(LOWEST, NOT_YET) | dict.fromkeys(HIGHEST, -NOT_YET)
    return CommonStats(**values)


def blank(stats: Any, plant: Any) -> Any:
    """Statistics of nothing yet of a winch type; stats: its class, as the driver makes it."""
    kinds = dict(fields(stats))
    nothing = (kinds[name](*[0.0] * len(kinds[name]._fields)) for name in ("limits", "power"))
    return stats(blank_common(), plant.BLANK, *nothing, blank_oscillation())


@scalar
def flag(condition):
    return 1.0 if condition else 0.0


@scalar
def fold_common(a, y, through, E, wire_end, w):
    """Statistics with one more cycle: y signals, through power through the winch [W], E stored energy [J], wire_end 1
    where the wire is at its end, w weight of the cycle in integrals.

    w is 1, and 0.5 at both ends of the part that counts (trapezoidal rule).
    """
    E_start = E if a.cycles == 0.0 else a.E_start
    return CommonStats(
        cycles=a.cycles + 1.0,
        e_min=fmin(a.e_min, y.e_c),
        e_max=fmax(a.e_max, y.e_c),
        em_min=fmin(a.em_min, y.e_c_measured),
        em_max=fmax(a.em_max, y.e_c_measured),
        tip_min=fmin(a.tip_min, y.s_tip),
        tip_max=fmax(a.tip_max, y.s_tip),
        u_p_max=fmax(a.u_p_max, abs(y.u_p)),
        u_raw_max=fmax(a.u_raw_max, abs(y.u_raw)),
        v_w_max=fmax(a.v_w_max, abs(y.v_w)),
        v_tip_max=fmax(a.v_tip_max, abs(y.v_tip)),
        F_min=fmin(a.F_min, y.F_w),
        F_max=fmax(a.F_max, y.F_w),
        saturation_cycles=a.saturation_cycles + flag(abs(y.u_raw) > 1.0),
        slack_cycles=a.slack_cycles + flag(y.F_w <= 0.0),
        wire_cycles=a.wire_cycles + wire_end,
        e_sum=a.e_sum + w * y.e_c,
        e2_sum=a.e2_sum + w * y.e_c * y.e_c,
        tip_sum=a.tip_sum + w * y.s_tip,
        tip2_sum=a.tip2_sum + w * y.s_tip * y.s_tip,
        through=a.through + w * through,
        E_start=E_start,
        E_end=E,
    )


SIGNALS = 3
"""Windowed signals: control error against the true tip, against the measured tip, and the tip itself."""


def window_length(n: int, lanes: int, signals: int = SIGNALS) -> int:
    """Floats that a window of n samples needs for all signals on a number of lanes."""
    return (3 + 2 * (n + 1)) * signals * lanes


def blank_window(n: int, lanes: int, signals: int = SIGNALS) -> NDArray[np.float64]:
    """Layout: running lo, running hi, best peak-to-peak, then n + 1 suffix lows and n + 1 suffix highs, each signals *
    lanes wide."""
    w = signals * lanes
    W = np.empty(window_length(n, lanes, signals))
    rows = W.reshape(-1, w)
    rows[0] = np.inf
    rows[1] = -np.inf
    rows[2] = 0.0
    rows[3 : 3 + n + 1] = np.inf
    rows[3 + n + 1 :] = -np.inf
    return W


@scalar
def window_add(W, w, j, i, n, full, y):
    """Take sample y as number i of a run (0..n-1) for signal and lane j; w = signals * lanes; full: n samples were
    seen. Returns the peak-to-peak of the window that ends here."""
    low = W[(3 + i) * w :]
    high = W[(3 + n + 1 + i) * w :]
    lo, hi = fmin(W[j], y), fmax(W[w + j], y)
    W[j] = lo
    W[w + j] = hi
    span = fmax(hi, high[w + j]) - fmin(lo, low[w + j])
    W[2 * w + j] = fmax(W[2 * w + j], span * full)
    low[j] = y
    high[j] = y
    return span * full


@scalar
def window_turn(W, w, n):
    """End of a run: suffix extremes of what was seen, running extremes restart."""
    for i in range(n - 2, -1, -1):
        low = W[(3 + i) * w :]
        high = W[(3 + n + 1 + i) * w :]
        for j in range(w):
            low[j] = fmin(low[j], low[w + j])
        for j in range(w):
            high[j] = fmax(high[j], high[w + j])
    for j in range(w):
        W[j] = np.inf
        W[w + j] = -np.inf
