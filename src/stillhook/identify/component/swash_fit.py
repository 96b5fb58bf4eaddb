"""A displacement control that follows the command of a log: the twin's own laws at many sets of parameters."""

import functools
from typing import Any, NamedTuple

from stillhook.kernels.build import compiled
from stillhook.kernels.lanes import Array
from stillhook.physics.hydraulics.swash import Servo, play, swash_acceleration, swash_rate

FREE = 1.0e3
"""Stops of a plate that is not stopped [-]."""


class SwashFit(NamedTuple):
    """Parameters of a displacement control in a log: omega_n [rad/s], zeta [-]; dead_time [s]; gain, offset of the
    displacement over the command [-]; half_width of the hysteresis [-]; rate, rate_down highest speeds as the
    displacement rises and falls [1/s]."""

    omega_n: float
    zeta: float
    dead_time: float
    gain: float
    offset: float
    half_width: float
    rate: float
    rate_down: float


def _follow(u: Array, n: int, h: float, n_sub: int, P: Array, sets: int, alpha_0: float, out: Array):  # type: ignore[no-untyped-def]
    """Displacement (sets, n) of a command u (n,) that is held over each sample of h [s], for every set of parameters in
    P (sets, 8); it begins at rest."""
    tau = h / n_sub
    for s in range(sets):
        b = 8 * s
        late, gain, offset, half = P[b + 2], P[b + 3], P[b + 4], P[b + 5]
        servo = Servo(P[b], P[b + 1], -FREE, FREE, P[b + 6], P[b + 7], 0.0)
        x, v = alpha_0, 0.0
        held = (alpha_0 - offset) / gain if gain != 0.0 else u[0]
        for k in range(n):
            out[s * n + k] = x
            for i in range(n_sub):
                place = k + (i + 0.5) / n_sub - late / h
                j = int(place) if place > 0.0 else 0
                part = place - j if place > 0.0 else 0.0
                j = j if j < n - 1 else n - 1
                after = u[j + 1] if j < n - 1 else u[j]
                held = play(u[j] + part * (after - u[j]), held, half)
                w = gain * held + offset
                a_1, r_1 = swash_acceleration(x, v, w, servo), swash_rate(x, v, servo)
                v_2 = v + 0.5 * tau * a_1
                a_2, r_2 = swash_acceleration(x + 0.5 * tau * r_1, v_2, w, servo), swash_rate(x, v_2, servo)
                v_3 = v + 0.5 * tau * a_2
                a_3, r_3 = swash_acceleration(x + 0.5 * tau * r_2, v_3, w, servo), swash_rate(x, v_3, servo)
                v_4 = v + tau * a_3
                a_4, r_4 = swash_acceleration(x + tau * r_3, v_4, w, servo), swash_rate(x, v_4, servo)
                x = x + tau / 6.0 * (r_1 + 2.0 * r_2 + 2.0 * r_3 + r_4)
                v = v + tau / 6.0 * (a_1 + 2.0 * a_2 + 2.0 * a_3 + a_4)


@functools.cache
def kernel() -> Any:
    return compiled(_follow, "swash")
