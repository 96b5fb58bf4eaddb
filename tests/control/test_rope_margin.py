"""Margin of the tension loop on the exact rod: the wire's transfer function in closed form, waves in it included, in
place of the one spring of `stability`, and the loop cut at the load cell in place of the poles of all loops.

The winch with SSC is that of `stability`: the force on the wire is taken out of its matrices as an input, and the rod
of `stillhook.response.suspended_load` answers to the wire's motion with it. Nothing of the rod's discretisation in runs
is in here, and the law of the tension loop is written once more, from the equations of `rope`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from stillhook import Crane, Lowering, load_crane, read_payload
from stillhook.analysis.loop_stability import linearisation
from stillhook.analysis.loop_stability.governing import place_limits
from stillhook.analysis.loop_stability.places import Place
from stillhook.analysis.steady.limits import Direction, Station
from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.control.controllers.rope import IMPEDANCE, IN_WATER, QUICK, WANDER
from stillhook.engine.pack.winch import plc_record
from stillhook.library import changed
from stillhook.physics.load_path.drum import K_wire
from stillhook.physics.scalar import G
from stillhook.response.suspended_load import suspended_load, transfers
from stillhook.spec.control import own_settings
from stillhook.spec.scenario import Mode

Tension = Callable[[FloatArray], ComplexArray]
OMEGA = np.concatenate((np.geomspace(2e-2, 0.5, 300), np.linspace(0.5, 40.0, 8000), np.geomspace(40.0, 250.0, 600)))
"""Frequencies of the Nyquist curve [rad/s]: slower than the mean of the load cell, to beyond all resonances; fine
enough for a load that hardly damps."""
V = 0.5
"""Speed of the tip [m/s], at which friction falls little."""


class Winch(NamedTuple):
    """SSC and the winch with the force F on its wire as an input: x' = A x + B u + b F; cycle u = K x + k F + K_r r and
    r' = M x + m F + M_r r; late time after which a command acts [s]; i_s, i_u places of s_w and u_p; ratio K_wire;
    alpha_m displacement of the motors [-]."""

    A: FloatArray
    B: FloatArray
    b: FloatArray
    K: FloatArray
    k: FloatArray
    K_r: FloatArray
    M: FloatArray
    m: FloatArray
    M_r: FloatArray
    late: FloatArray
    i_s: int
    i_u: int
    ratio: float
    alpha_m: float


def winch(crane: Crane, load: float, s_w: float, alpha_m: float) -> Winch:
    """The load acts on the winch through F_w alone, which depends on its height: so that column is all of F_w's."""
    point = Station(crane, load, s_w, Direction.LOWERING).at(V, alpha_m)
    plant, cycle = (
        linearisation.linearise(point),
        linearisation._control_slopes(linearisation._Plc(crane, point, Mode("ssc")), crane),
    )
    height, speed = plant.states.index("s_load"), plant.states.index("v_load")
    F = plant.C[linearisation.OUTPUTS.index("F_w")]
    own = [i for i in range(len(plant.states)) if i not in (height, speed)]
    commands = [i for i, name in enumerate(plant.inputs) if name.startswith("u_")]

    def opened(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        by_F = rows[:, height] / F[height]
        return rows[:, own] - np.outer(by_F, F[own]), by_F

    n = len(plant.states)
    (A, b), (K, k), (M, m) = (opened(rows) for rows in (plant.A[own], cycle.commands[:, :n], cycle.carried[:, :n]))
    return Winch(
        A=A,
        B=plant.B[np.ix_(own, commands)],
        b=b,
        K=K,
        k=k,
        K_r=cycle.commands[:, n:],
        M=M,
        m=m,
        M_r=cycle.carried[:, n:],
        late=linearisation.lateness_of(crane, [plant.inputs[i] for i in commands]),
        i_s=[plant.states[i] for i in own].index("s_w"),
        i_u=[plant.inputs[i] for i in commands].index("u_p"),
        ratio=float(K_wire(point.geometry.d, point.params.hoist.drum)),
        alpha_m=alpha_m,
    )


def answer(crane: Crane, w: Winch, tension: Tension, K_p: float) -> tuple[ComplexArray, ComplexArray]:
    """Force on the wire [N] and wire paid out [m] per pump command on top of SSC's, with SSC's own loops closed, that
    of the position with the gain K_p [1/m]."""
    plc = plc_record(crane)
    n, r, u = len(w.A), len(w.M_r), w.B.shape[1]
    z = np.exp(1j * OMEGA * plc.t_cycle)
    held = ((1.0 - 1.0 / z) / (1j * OMEGA * plc.t_cycle))[:, None] * np.exp(-1j * np.outer(OMEGA, w.late))
    x, c, v = slice(0, n), slice(n, n + r), slice(n + r, n + r + u)
    E = np.zeros((len(OMEGA), n + r + u + 1, n + r + u + 1), dtype=complex)
    E[:, x, x] = 1j * OMEGA[:, None, None] * np.eye(n) - w.A
    E[:, x, v], E[:, x, -1] = -w.B * held[:, None, :], -w.b
    E[:, c, x], E[:, c, -1] = -w.M, -w.m
    E[:, c, c] = z[:, None, None] * np.eye(r) - w.M_r
    E[:, v, x], E[:, v, c], E[:, v, -1] = -w.K, -w.K_r, -w.k
    E[:, v, v] = np.eye(u)
    E[:, n + r + w.i_u, w.i_s] -= K_p
    E[:, -1, -1], E[:, -1, w.i_s] = 1.0, tension(OMEGA)
    command = np.zeros((len(OMEGA), len(E[0]), 1))
    command[:, n + r + w.i_u] = 1.0
    result = np.linalg.solve(E, command)[..., 0]
    return result[:, -1], result[:, w.i_s]


def damping(crane: Crane, s_w: float, alpha_m: float) -> tuple[float, float]:
    """c [N s/m] and low-pass of the load cell [s] at a length of wire, motors at alpha_m."""
    plc, s = plc_record(crane), own_settings(crane.control, Mode("rope").law)
    p = plc.plant
    k = p.EA / (s_w + p.L_0)
    tau_F = min(s.tau_f, QUICK * math.sqrt(p.SWL / (G * k)))
    tau = 0.5 * plc.t_cycle + plc.t_compute + tau_F + 2.0 * p.zeta_p / p.omega_np
    noise = s.noise * p.SWL / WANDER * math.sqrt(0.25 * plc.t_cycle * s.T_ret)
    return max(s.K_c * tau * k, IMPEDANCE * math.sqrt(p.EA * p.m_wire), noise) / alpha_m**2, tau_F


class Loops(NamedTuple):
    """Return difference of the position loop of SSC, with pole at 0, and the tension loop around that, cut where the
    load cell goes into it [-]."""

    position: ComplexArray
    tension: ComplexArray


def loops(crane: Crane, w: Winch, tension: Tension, s_w: float) -> Loops:
    """The loops with a force on the wire [N] per motion of its upper end, up positive [m]."""
    plc, T_ret = plc_record(crane), own_settings(crane.control, Mode("rope").law).T_ret
    h, p, K_p = plc.t_cycle, plc.plant, plc.gains.K_p
    c, tau_F = damping(crane, s_w, w.alpha_m)
    back = np.exp(-1j * OMEGA * h)

    def low_pass(tau: float) -> ComplexArray:
        return np.asarray(h / (tau + h) / (1.0 - tau / (tau + h) * back))

    F, paid_out = answer(crane, w, tension, K_p)
    given = h / c * low_pass(tau_F) * (1.0 - low_pass(T_ret)) / (1.0 + h / T_ret - back)
    u = -(plc.gains.K_1 * w.ratio * w.alpha_m * (1.0 - back) / h + K_p) * given
    position = 1.0 - K_p * answer(crane, w, tension, 0.0)[1]
    return Loops(position, np.asarray(-u * (F - IN_WATER * G * p.m_wire * paid_out)))


def stable(at: Loops, factor: float = 1.0) -> bool:
    """Whether both loops together are stable with c divided by a factor: the pole at 0 turns their return difference by
    a quarter, and each pair of poles on the right would turn it back by a full turn."""
    turned = np.unwrap(np.angle(at.position)) + np.unwrap(np.angle(1.0 + factor * at.tension))
    return bool(abs(turned[-1] - turned[0] - 0.5 * math.pi) < math.pi)


def gain_margin(at: Loops) -> float:
    """Factor by which c may be divided before the loop swings [-]: from bisection; 20 at most."""
    lo, hi = 1.0, 20.0
    if not stable(at):
        return 0.0
    while hi / lo > 1.01:
        middle = math.sqrt(lo * hi)
        lo, hi = (middle, hi) if stable(at, middle) else (lo, middle)
    return lo


def on_rod(crane: Crane, payload: str, depth: float, alpha_m: float) -> Loops:
    lift = Lowering(
        payload=read_payload(payload),
        h_tip="36 m",
        depth=f"{depth + 200} m",
        start_depth=f"{depth} m",
        rigging={"height": "12 m"},
        programme=[{"mode": "ahc", "time": "60 s"}],
        duration="60 s",
    )
    load = suspended_load(crane, lift, -depth)
    w = winch(crane, load.F_top / G - crane.hook_mass, load.s_w, alpha_m)
    return loops(crane, w, lambda omega: transfers(omega, load.rod, load.end).top_u, load.s_w)


@pytest.mark.long
@pytest.mark.parametrize("K_c", [2.0, 2.2, 2.4, 2.8])
def test_with_one_spring_in_place_of_the_rod_it_is_stable_where_the_poles_of_stability_are(K_c):
    of_loop: dict[str, Any] = {"K_c": K_c, "noise": 0.0, "tau_f": "50 ms"}
    crane = changed(load_crane("deep-250t"), {"control": {"rope": of_loop}})
    (at,) = place_limits(crane, Mode("rope"), [Place(120e3, 200.0, V)])
    assert at.loop is not None
    p, m = plc_record(crane).plant, 120e3 + crane.hook_mass
    k = p.EA / (200.0 + p.L_0)

    def spring(omega: FloatArray) -> ComplexArray:
        pull = k + 2j * omega * crane.wire.zeta * math.sqrt(k * m)
        return np.asarray(-(omega**2) * m * pull / (pull - omega**2 * m))

    at_cut = loops(crane, winch(crane, 120e3, 200.0, at.alpha_m), spring, 200.0)
    assert stable(at_cut) is bool(np.max(np.abs(at.loop.closed_poles(crane.control.K_p))) < 1.0)


@pytest.mark.long
@pytest.mark.parametrize("alpha_m", [0.6, 1.0])
@pytest.mark.parametrize("depth", [100.0, 300.0, 1000.0, 2000.0, 3000.0])
@pytest.mark.parametrize("payload", ["spool-20t", "manifold-60t", "suction-anchor-85t"])
def test_c_may_be_halved_on_the_exact_rod(payload, depth, alpha_m):
    """6 dB, at the lightest load and at heavy ones, motors at 0.6 and at 1."""
    assert stable(on_rod(load_crane("deep-250t"), payload, depth, alpha_m), 2.0)
