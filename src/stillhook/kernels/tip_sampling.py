"""Irregular tip motions straight into the rows of a drive, compiled: the same bits as `IrregularTip.sample`, in a tenth
of the time."""

import functools
import math
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.kernels.build import compiled
from stillhook.kernels.lanes import Array
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.motion import Motion, Ramped


def _rows(
    s: Array,
    v: Array,
    a: Array,
    count: int,
    h: float,
    h_2: float,
    k: int,
    n: int,
    t_cycle: float,
    out: Array,
    place: int,
    across: int,
):  # type: ignore[no-untyped-def]
    """Height, speed, acceleration of cycles k .. k + n - 1 to out, `across` apart, from out[place] on."""
    for i in range(n):
        since = (k + i) * t_cycle / h
        node = math.floor(since)
        x = since - node
        j = int(node) % count
        j_1 = j + 1 if j + 1 < count else 0
        s_0, v_0, a_0 = s[j], v[j], a[j]
        d, e, f = s[j_1] - s_0 - v_0 - a_0 / 2.0, v[j_1] - v_0 - a_0, a[j_1] - a_0
        q2 = a_0 / 2.0
        q3, q4, q5 = 10.0 * d - 4.0 * e + f / 2.0, -15.0 * d + 7.0 * e - f, 6.0 * d - 3.0 * e + f / 2.0
        out[place] = s_0 + x * (v_0 + x * (q2 + x * (q3 + x * (q4 + x * q5))))
        out[place + across] = (v_0 + x * (2.0 * q2 + x * (3.0 * q3 + x * (4.0 * q4 + x * (5.0 * q5))))) / h
        out[place + 2 * across] = (2.0 * q2 + x * (6.0 * q3 + x * (12.0 * q4 + x * (20.0 * q5)))) / h_2
        place += 3 * across


@functools.cache
def kernel() -> Any:
    return compiled(_rows, "tip")


def sampled(motion: Motion, k: int, n: int, t_cycle: float, out: FloatArray, lane: int) -> bool:
    """Cycles k .. k + n - 1 of a motion to one lane of out (n, 3, lanes); False, and nothing done, where it is no
    irregular one."""
    ramp, tip = (motion.t_ramp, motion.motion) if isinstance(motion, Ramped) else (0.0, motion)
    if not isinstance(tip, IrregularTip):
        return False
    h, s, v, a = tip.nodes
    lanes = out.shape[2]
    kernel()(s, v, a, len(s), h, h**2, k, n, t_cycle, out.reshape(-1), lane, lanes)
    growing = min(n, math.ceil(ramp / t_cycle) + 1 - k)
    if growing > 0:
        out[:growing, :, lane] = np.column_stack(motion.sample(np.arange(k, k + growing) * t_cycle))
    return True
