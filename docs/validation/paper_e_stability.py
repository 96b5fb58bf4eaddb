"""Paper E's stability section: gain limit against displacement, what SSC does to it, and the whole plant beside the
reduced model."""

from __future__ import annotations

import math
from typing import Any

import causes
import numpy as np
from blocks import Blocks, Rows, save
from reduced import closed_loop_polynomial, equivalent, least_limit
from routh import gain_limit_by_poles, gain_limit_by_routh

from stillhook import Crane, Scenario, load_crane, simulate
from stillhook.analysis.loop_stability import sweeps, transfer
from stillhook.analysis.loop_stability.governing import Governing, governing
from stillhook.analysis.loop_stability.linearisation import at_state, linearise
from stillhook.analysis.loop_stability.loops import sampled
from stillhook.analysis.loop_stability.margins import gain_limit_of
from stillhook.analysis.loop_stability.places import wire_range
from stillhook.analysis.loop_stability.stability import (
    eigenfrequency,
    full_stability,
    gain_limit,
    range_of_modes,
    stability,
)
from stillhook.analysis.steady.operating_point import operating_point
from stillhook.library import changed
from stillhook.spec.scenario import Mode
from stillhook.thesis.control import gain_limits
from stillhook.thesis.ringing import rms_above
from stillhook.units import in_display

SLOW_PAGE = True
CRANE = load_crane("nov-250t")
SPEEDS = (0.0, 40.0, 60.0, 80.0, 100.0, 120.0)  # m/min
LOADED = ((15.0, (1.0, 5.0, 20.0, 60.0)), (100.0, (5.0, 60.0)), (1000.0, (5.0, 60.0)))
POINTS = (*((0.0, 15.0, v) for v in (1.0, 10.0, 60.0)), *((100e3, s_w, v) for s_w, speeds in LOADED for v in speeds))
"""Load [kg], wire out [m], wire speed [m/min] of the comparison."""
SLOW = (100e3, 15.0, 5.0)
"""Load, wire out and speed at which the limit is looked for in runs."""
DAMPED = changed(CRANE, {"wire": causes.WIRE})
"""The crane with the wire's damping that paper C assumes."""
SLOW_RUNS = (
    *((CRANE, mode, K_p) for mode, gains in (("hs", (0.04, 0.16, 0.40)), ("ssc", (0.16, 0.50))) for K_p in gains),
    *(
        (DAMPED, mode, K_p)
        for mode, gains in (("hs", (0.16, 0.20, 0.35, 0.40)), ("ssc", (0.16, 0.50)))
        for K_p in gains
    ),
)
"""Crane, mode and K_p [1/m] of those runs: below and above the limit of HS."""
DISPLACEMENTS = (1075, 860, 645, 215, 75, 40)
NAMES = {"ssc": "SSC, least", "full": "SSC, at rest"}


def or_swings(K_p: float) -> str:
    """A gain limit [1/m], or that the plant oscillates at any gain."""
    return f"{K_p:.2f}" if K_p > 0.0 else "oscillates"


def four_ways() -> Rows:
    rows = []
    for D in DISPLACEMENTS:
        a = D / 1075
        loop, closed = transfer.position_loop(CRANE, a), gain_limit(CRANE, a)
        by_routh = gain_limit_by_routh(*closed_loop_polynomial(CRANE, a))
        by_poles, (by_response, _) = gain_limit_by_poles(loop.closed_poles), gain_limit_of(loop)
        plc, _ = gain_limit_of(sampled(loop, CRANE.control.t_cycle, CRANE.control.computing))
        rows.append({**locals()})
    return rows


def margin_rows() -> Rows:
    modes = {**range_of_modes(CRANE), "full": (1.0, 1.0)}
    pairs = [(mode, alpha, delay) for mode, (alpha, _) in modes.items() for delay in (0.0, 0.05)]
    return [
        {"mode": mode, "alpha": alpha, "delay": delay, "s": stability(CRANE, alpha, delay=delay)}
        for mode, alpha, delay in pairs
    ]


def holding_rows() -> Rows:
    """The one margin on the crane's own wire, and on that of paper C, for every mode and length of wire."""
    rows = []
    for mode in (Mode.NS, Mode.HS, Mode.SSC):
        for s_w in (15.0, 100.0, wire_range(CRANE)[-1]):
            least = {Mode.NS: CRANE.control.alpha_ns, Mode.HS: CRANE.control.alpha_hs}.get(
                mode, CRANE.active.motor.alpha_min
            )
            own, paper_c = (governing(crane, mode, wires=(s_w,)) for crane in (CRANE, DAMPED))
            rows.append({**locals()})
    return rows


def _margin_cells(found: Governing) -> tuple[str, str, str]:
    """Where no gain stabilises the plant; the least limit beyond, and the gain within the margins [1/m]."""
    places = [p.place for p in found.no_gain]
    where = "–"
    if places:
        load, speed = min(p.load for p in places), max(abs(p.v_tip) for p in places)
        where = f"from {load / 1e3:.0f} t, up to {60.0 * speed:g} m/min"
    limit = "–" if found.limit is None else f"{found.limit.gains.high:.2f}"
    return where, limit, f"{found.K_p:.3f}" if found.K_p > 0.0 else "none"


def ssc_rows() -> Rows:
    rows = []
    for v in SPEEDS:
        at = transfer.about(CRANE, v / 60.0)
        p = transfer.motor_poles(CRANE, v / 60.0)[0]
        whole = np.linalg.eigvals(transfer.full_matrices(CRANE, at)[0])
        swing = max((q for q in whole if q.imag > 0.0), key=lambda q: q.real)
        rows.append({**locals()})
    return rows


def plant_rows() -> Rows:
    rows = []
    for load, s_w, v in POINTS:
        for alpha in (1.0, 0.6):
            found, point = full_stability(CRANE, load=load, s_w=s_w, v_tip=-v / 60.0, alpha_m=alpha)
            own = equivalent(CRANE, point)
            damped = full_stability(DAMPED, load=load, s_w=s_w, v_tip=-v / 60.0, alpha_m=alpha)[0]
            omega_0 = eigenfrequency(CRANE, alpha).omega_0
            rows.append({**locals()})
    return rows


def slow_limit(alpha: float, crane: Crane = CRANE) -> float:
    """Limit of the plant with PLC where the loaded winch is slow [1/m]."""
    load, s_w, v = SLOW
    return full_stability(crane, load=load, s_w=s_w, v_tip=-v / 60.0, alpha_m=alpha)[0].K_p_ms_plc


def slow_rows() -> Rows:
    """Runs of the engine about that point: a swell of 600 s, the minute about its fastest moment."""
    load, s_w, v = SLOW
    rows = []
    for crane, mode, K_p in SLOW_RUNS:
        tip = f"sine {v / 60.0 * 600.0 / (2.0 * math.pi):.6f} m 600 s"
        times = {"warm_up": "270 s", "duration": "330 s", "ramp": "20 s"}
        case = Scenario(load=f"{load} kg", s_w=f"{s_w} m", tip=tip, mode=mode, gas_held=True, **times)
        run = simulate(changed(crane, {"control": {"K_p": f"{K_p} 1/m"}}), case, every="0.05 s")
        counted = run.sel(time=slice(270.0, None))
        alpha = float(counted["alpha_m"].mean())
        speeds = f"{60.0 * float(counted['v_w'].min()):.1f} to {60.0 * float(counted['v_w'].max()):.1f}"
        above = rms_above(run, "p_a", frequency=0.5, start=270.0)
        rows.append({**locals()})
    return rows


def afloat() -> float:
    """Frequency with both lines above boost over that with one held."""
    point = operating_point(CRANE, 1.0, 1.0, load=0.0, s_w=15.0, v_tip=-1.0)
    both = at_state(point, p_b=CRANE.active.boost.p + 1e5)
    held, free = (
        max((m for m in linearise(p).modes() if m.pole.imag > 0.0), key=lambda m: m.share("p_a", "p_b"))
        for p in (point, both)
    )
    return free.omega_0 / held.omega_0


def _apart(crane: Crane, v_tip: float) -> float:
    """How far the limit of the whole controller about a tip speed is from that of the position loop alone,
    relatively."""
    at = transfer.about(crane, v_tip)
    whole = gain_limit_by_poles(lambda K_p: np.linalg.eigvals(transfer.full_matrices(crane, at, K_p=K_p)[0]))
    return abs(whole / gain_limit(crane, at.alpha_m).K_p_ms - 1.0)


def speed_response(crane: Crane, s: complex) -> complex:
    """V_w / V_tip with the tip about rest (paper E eq. 21), A_tip = s V_tip; -1 is perfect compensation."""
    A, B, C, D = transfer.full_matrices(crane, transfer.about(crane, 0.0))
    return complex((C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D)[0] @ (1.0, s))


def claims() -> dict[str, Any]:
    lazy = changed(CRANE, {"active": {"motor": {"servo": {"omega_n": "1 rad/s", "zeta": 0.5}}}})
    same = max(_apart(c, v) for c in (CRANE, lazy) for v in (0.0, 1.0, 1.6))
    zeta = [-p.real / abs(p) for p in (transfer.motor_poles(CRANE, v / 60.0)[0] for v in (40.0, 120.0))]
    full, least = gain_limit(CRANE).K_p_ms, gain_limit(CRANE, 0.6).K_p_ms
    without = changed(CRANE, {"control": {"K_2": "0 s^2/m"}})
    errors = [abs(1.0 + speed_response(c, 2j * math.pi / 12.0)) for c in (CRANE, without)]
    slow = full_stability(CRANE, load=0.0, s_w=15.0, v_tip=-1.0 / 60.0, alpha_m=0.6)[0]
    loaded = [full_stability(CRANE, load=100e3, s_w=15.0, v_tip=-1.0 / 60.0, alpha_m=a)[0].K_p_ms for a in (1.0, 0.6)]
    margins = [[slow_limit(a, c) / CRANE.control.K_p for a in (0.6, 1.0)] for c in (CRANE, DAMPED)]
    shown = [" and ".join(f"{x:.1f}" for x in m) if max(m) > 0.0 else "oscillates at any `K_p`" for m in margins]
    swing = (
        "both oscillate at any `K_p`"
        if max(loaded) == 0.0
        else f"SSC {or_swings(loaded[0])}, HS {or_swings(loaded[1])}"
    )
    return locals()


def compute() -> tuple[Blocks, Any]:
    """Blocks of the page, its claims, and what the pictures show."""
    found = claims()
    alpha, least = least_limit(CRANE)
    D = in_display(alpha * CRANE.active.motor.D_total, "displacement")
    blocks = {
        "claims": found,
        "ways": four_ways(),
        "least": {"D": D, "alpha": alpha, "least": least},
        "margins": margin_rows(),
        "holds": holding_rows(),
        "strong": {"K_p": stability(CRANE, CRANE.active.motor.alpha_min, delay=0.05).K_p_strong},
        "ssc": ssc_rows(),
        "plant": plant_rows(),
        "slow": slow_rows(),
        "afloat": ({}),
    }
    return blocks, None


def draw(_: Any) -> None:
    save(gain_limits().figure(), "paper-e-gain-limit.png")
    save(sweeps.motor_pole_figure(CRANE), "paper-e-motor-poles.png")
    save(sweeps.bode_figure(CRANE, (1.0, 0.6), delay=0.05), "paper-e-bode.png")
    over = ("layer", "leakage", "damping", "bulk_modulus", "delay")
    save(sweeps.sweep_figure(CRANE, [sweeps.sweep(CRANE, o, alpha_m=0.6) for o in over]), "paper-e-limit-sweeps.png")
