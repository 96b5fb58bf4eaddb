"""Paper E's stability section: gain limit against displacement, what SSC does to it, and the whole plant beside the
reduced model."""

from __future__ import annotations

import math
from typing import Any

import causes
import numpy as np
from blocks import claims_table, percent, save, table, verdict
from routh import gain_limit_by_poles, gain_limit_by_routh

from stillhook import Crane, Scenario, load_crane, simulate
from stillhook.analysis.loop_stability.figures import (
    bode_figure,
    gain_limit_figure,
    motor_pole_figure,
    root_locus_figure,
    sweep_figure,
)
from stillhook.analysis.loop_stability.governing import Governing, governing
from stillhook.analysis.loop_stability.linear.linearisation import at_state, linearise
from stillhook.analysis.loop_stability.margins import gain_limit_of, rms_above, strongest_gain
from stillhook.analysis.loop_stability.places import wire_range
from stillhook.analysis.loop_stability.reduced import eigenfrequency, equivalent, gain_limit
from stillhook.analysis.loop_stability.stability import (
    full_stability,
    least_limit,
    range_of_modes,
    stability,
)
from stillhook.analysis.loop_stability.sweeps import slow_sweep, sweep
from stillhook.analysis.loop_stability.transfer import (
    about,
    closed_loop_polynomial,
    full_matrices,
    motor_poles,
    position_loop,
    sampled,
    speed_response,
)
from stillhook.analysis.steady.operating_point import operating_point
from stillhook.library import changed
from stillhook.spec.scenario import Mode
from stillhook.units import in_display, show

PAGE = "paper-e-stability.md"
CRANE = load_crane("nov-250t")
SPEEDS = (0.0, 40.0, 60.0, 80.0, 100.0, 120.0)  # m/min
POINTS = (
    (0.0, 15.0, 1.0),
    (0.0, 15.0, 10.0),
    (0.0, 15.0, 60.0),
    (100e3, 15.0, 1.0),
    (100e3, 15.0, 5.0),
    (100e3, 15.0, 20.0),
    (100e3, 15.0, 60.0),
    (100e3, 100.0, 5.0),
    (100e3, 100.0, 60.0),
    (100e3, 1000.0, 5.0),
    (100e3, 1000.0, 60.0),
)
"""Load [kg], wire out [m], wire speed [m/min] of the comparison."""
SLOW = (100e3, 15.0, 5.0)
"""Load, wire out and speed at which the limit is looked for in runs."""
DAMPED = changed(CRANE, {"wire": causes.WIRE})
"""The crane with the wire's damping that paper C assumes."""
SLOW_RUNS = (
    (CRANE, "hs", 0.04),
    (CRANE, "hs", 0.16),
    (CRANE, "hs", 0.40),
    (CRANE, "ssc", 0.16),
    (CRANE, "ssc", 0.50),
    (DAMPED, "hs", 0.16),
    (DAMPED, "hs", 0.20),
    (DAMPED, "hs", 0.35),
    (DAMPED, "hs", 0.40),
    (DAMPED, "ssc", 0.16),
    (DAMPED, "ssc", 0.50),
)
"""Crane, mode and K_p [1/m] of those runs: below and above the limit of HS."""
DISPLACEMENTS = (1075, 860, 645, 215, 75, 40)


def digits(x: float) -> str:
    return f"{x:.6f}"


def or_swings(K_p: float) -> str:
    """A gain limit [1/m], or that the plant swings whatever the gain."""
    return f"{K_p:.2f}" if K_p > 0.0 else "swings"


def four_ways() -> str:
    rows = []
    for D in DISPLACEMENTS:
        a = D / 1075
        loop, closed = position_loop(CRANE, a), gain_limit(CRANE, a)
        by_routh = gain_limit_by_routh(*closed_loop_polynomial(CRANE, a))
        by_poles, (by_response, _) = gain_limit_by_poles(loop.closed_poles), gain_limit_of(loop)
        plc, _ = gain_limit_of(sampled(loop, CRANE.control.t_cycle, CRANE.control.computing))
        rows.append(
            (D, *(digits(v) for v in (closed.K_p_ms, by_routh, by_poles, by_response, plc)), f"{closed.omega_c:.3f}")
        )
    head = ("cm³/rev", "closed form, 1/m", "Routh", "eigenvalues", "response", "with PLC", "swings at, rad/s")
    return table(head, rows)


def margin_rows() -> str:
    rows = []
    for mode, (alpha, _) in {**range_of_modes(CRANE), "full": (1.0, 1.0)}.items():
        for delay in (0.0, 0.05):
            s = stability(CRANE, alpha, delay=delay)
            rows.append(
                (
                    {"ssc": "SSC, least", "full": "SSC, at rest"}.get(mode, mode.upper()),
                    f"{alpha:g}",
                    f"{1e3 * delay:g} ms",
                    f"{s.gain_margin:.2f}",
                    f"{s.gain_margin_plc:.2f}",
                    f"{math.degrees(s.phase_margin_plc):.1f}°",
                    f"{s.delay_margin_plc:.2f} s",
                    f"{s.sensitivity_peak_plc:.3f}",
                    f"{s.K_p_strong:.3f}",
                )
            )
    head = (
        "mode",
        "`alpha_m`",
        "delay",
        "gain margin",
        "with PLC",
        "phase margin",
        "delay margin",
        "M_s",
        "strongest `K_p`, 1/m",
    )
    return table(head, rows)


def holding_rows() -> str:
    """The one margin on the crane's own wire, and on that of paper C, for every mode and length of wire."""
    rows = []
    for mode in (Mode.NS, Mode.HS, Mode.SSC):
        for s_w in (15.0, 100.0, wire_range(CRANE)[-1]):
            least = {Mode.NS: CRANE.control.alpha_ns, Mode.HS: CRANE.control.alpha_hs}.get(
                mode, CRANE.active.motor.alpha_min
            )
            own, paper_c = (governing(crane, mode, wires=(s_w,)) for crane in (CRANE, DAMPED))
            rows.append(
                (
                    mode.value.upper(),
                    show(s_w, "length", 4),
                    f"{stability(CRANE, least).K_p_ms_plc:.2f}",
                    *_margin_cells(own),
                    *_margin_cells(paper_c),
                )
            )
    cells = ("swings whatever `K_p`", "limit beyond", "`K_p` kept")
    head = (
        "mode",
        "wire out",
        "limit published",
        *(f"{cell}, own wire (0.01)" for cell in cells),
        *(f"{cell}, paper C's (0.95)" for cell in cells),
    )
    return table(head, rows)


def _margin_cells(found: Governing) -> tuple[str, str, str]:
    """Where no gain stabilises the plant; the least limit beyond, and the gain within the margins [1/m]."""
    places = [p.place for p in found.no_gain]
    where = "–"
    if places:
        load, speed = min(p.load for p in places), max(abs(p.v_tip) for p in places)
        where = f"from {load / 1e3:.0f} t, up to {60.0 * speed:g} m/min"
    limit = "–" if found.limit is None else f"{found.limit.gains.high:.2f}"
    return where, limit, f"{found.K_p:.3f}" if found.K_p > 0.0 else "none"


def ssc_rows() -> str:
    rows = []
    for v in SPEEDS:
        at = about(CRANE, v / 60.0)
        p = motor_poles(CRANE, v / 60.0)[0]
        whole = np.linalg.eigvals(full_matrices(CRANE, at)[0])
        swing = max((q for q in whole if q.imag > 0.0), key=lambda q: q.real)
        limit = gain_limit(CRANE, at.alpha_m).K_p_ms
        rows.append(
            (
                f"{v:g}",
                f"{at.alpha_m:.3f}",
                f"{limit:.4f}",
                f"{abs(p):.2f}",
                f"{-p.real / abs(p):.3f}",
                f"{swing:.3f}".replace("j", "i"),
            )
        )
    head = (
        "tip, m/min",
        "`alpha_m`",
        "limit, 1/m",
        "motors' loop, rad/s",
        "its damping ratio",
        "oil spring's pole, 1/s",
    )
    return table(head, rows)


def plant_rows() -> str:
    rows = []
    for load, s_w, v in POINTS:
        for alpha in (1.0, 0.6):
            found, point = full_stability(CRANE, load=load, s_w=s_w, v_tip=-v / 60.0, alpha_m=alpha)
            own = equivalent(CRANE, point)
            damped = full_stability(DAMPED, load=load, s_w=s_w, v_tip=-v / 60.0, alpha_m=alpha)[0]
            rows.append(
                (
                    f"{load / 1e3:g} t, {s_w:g} m, {v:g} m/min",
                    f"{alpha:g}",
                    f"{eigenfrequency(CRANE, alpha).omega_0:.2f}",
                    f"{own.omega_0:.2f}",
                    f"{found.omega_0:.2f}",
                    f"{own.B_v - own.B_low:.2f} + {own.B_low:.2f}",
                    f"{gain_limit(CRANE, alpha).K_p_ms:.2f}",
                    f"{own.K_p_ms:.2f}",
                    or_swings(found.K_p_ms),
                    or_swings(found.K_p_ms_plc),
                    or_swings(damped.K_p_ms_plc),
                )
            )
    head = (
        "load, wire out, speed",
        "`alpha_m`",
        "ω₀ published",
        "own numbers",
        "plant",
        "slope + low line, N m s/rad",
        "limit published",
        "own numbers",
        "plant",
        "plant with PLC",
        "the same, wire damping 0.95",
    )
    return table(head, rows)


def slow_limit(alpha: float, crane: Crane = CRANE) -> float:
    """Limit of the plant with PLC where the loaded winch is slow [1/m]."""
    load, s_w, v = SLOW
    return full_stability(crane, load=load, s_w=s_w, v_tip=-v / 60.0, alpha_m=alpha)[0].K_p_ms_plc


def slow_rows() -> str:
    """Runs of the engine about that point: a swell of 600 s, the minute about its fastest moment."""
    load, s_w, v = SLOW
    rows = []
    for crane, mode, K_p in SLOW_RUNS:
        case = Scenario(
            load=f"{load} kg",
            s_w=f"{s_w} m",
            tip=f"sine {v / 60.0 * 600.0 / (2.0 * math.pi):.6f} m 600 s",
            mode=mode,
            warm_up="270 s",
            duration="330 s",
            ramp="20 s",
            gas_held=True,
        )
        run = simulate(changed(crane, {"control": {"K_p": f"{K_p} 1/m"}}), case, every="0.05 s")
        counted = run.sel(time=slice(270.0, None))
        alpha = float(counted["alpha_m"].mean())
        speeds = f"{60.0 * float(counted['v_w'].min()):.1f} to {60.0 * float(counted['v_w'].max()):.1f}"
        above = rms_above(run, "p_a", frequency=0.5, start=270.0)
        rows.append(
            (
                f"{crane.wire.zeta:g}",
                mode.upper(),
                f"{alpha:.2f}",
                or_swings(slow_limit(alpha, crane)),
                f"{K_p:.2f}",
                speeds,
                f"{above / 1e5:.1f} bar",
            )
        )
    return table(
        (
            "wire damping",
            "mode",
            "`alpha_m`",
            "limit, plant with PLC",
            "`K_p`, 1/m",
            "wire speed, m/min",
            "`p_a` above 0.5 Hz, rms",
        ),
        rows,
    )


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
    at = about(crane, v_tip)
    whole = gain_limit_by_poles(lambda K_p: np.linalg.eigvals(full_matrices(crane, at, K_p=K_p)[0]))
    return abs(whole / gain_limit(crane, at.alpha_m).K_p_ms - 1.0)


def claims() -> dict[str, tuple[str, str, str]]:
    lazy = changed(CRANE, {"active": {"motor": {"servo": {"omega_n": "1 rad/s", "zeta": 0.5}}}})
    same = max(_apart(c, v) for c in (CRANE, lazy) for v in (0.0, 1.0, 1.6))
    zeta = [-p.real / abs(p) for p in (motor_poles(CRANE, v / 60.0)[0] for v in (40.0, 120.0))]
    full, least = gain_limit(CRANE).K_p_ms, gain_limit(CRANE, 0.6).K_p_ms
    s = 2j * math.pi / 12.0
    without = changed(CRANE, {"control": {"K_2": "0 s^2/m"}})
    errors = [abs(1.0 + complex(speed_response(c)(s))) for c in (CRANE, without)]
    slow = full_stability(CRANE, load=0.0, s_w=15.0, v_tip=-1.0 / 60.0, alpha_m=0.6)[0]
    loaded = [full_stability(CRANE, load=100e3, s_w=15.0, v_tip=-1.0 / 60.0, alpha_m=a)[0].K_p_ms for a in (1.0, 0.6)]
    margins = [[slow_limit(a, c) / CRANE.control.K_p for a in (0.6, 1.0)] for c in (CRANE, DAMPED)]
    shown = [" and ".join(f"{x:.1f}" for x in m) if max(m) > 0.0 else "swings whatever `K_p`" for m in margins]
    swing = (
        "both swing whatever `K_p`" if max(loaded) == 0.0 else f"SSC {or_swings(loaded[0])}, HS {or_swings(loaded[1])}"
    )
    return {
        "SSC does not change the gain limit at a given displacement": (
            "yes",
            "the same limit, to nine digits" if same < 1e-9 else "another limit",
            verdict(same < 1e-9, "not so"),
        ),
        "motor servo has no effect on the limit": (
            "yes",
            "the same limit with 1 rad/s, 0.5",
            verdict(same < 1e-9, "not so"),
        ),
        "less displacement, less `K_p` before the winch swings": (
            "yes, figure 5",
            f"{full:.3f} to {least:.3f} 1/m from 1075 to 645 cm³/rev ({percent(least / full - 1.0, sign=True)})",
            verdict(least < full, "not so"),
        ),
        "SSC is a pure feedforward": (
            "yes",
            (
                f"no: measured `alpha_m` closes a loop; its damping falls from {zeta[0]:.2f} at 40 to {zeta[1]:.2f} at"
                " 120 m/min"
            ),
            "not so; the conclusion holds",
        ),
        "`a_tip` disappears in the linear model": (
            "yes",
            (
                f"no: dropping `K_2` leaves {percent(errors[1])} of a 12 s motion uncompensated instead of"
                f" {100.0 * errors[0]:.1f} %"
            ),
            "not so",
        ),
        "`K_p` in use is far from the limit": (
            "“do not usually demand high K_p”",
            (
                f"gain margin {least / CRANE.control.K_p:.1f} at 645, {full / CRANE.control.K_p:.1f} at 1075 cm³/rev; "
                f"plant with 100 t at 5 m/min {shown[0]}; with wire damping 0.95 {shown[1]}"
            ),
            verdict(min(margins[0]) > 3.0, "in the published loop, not slow and loaded"),
        ),
        "highest stability margin at zero speed": (
            "yes",
            (
                f"published loop with SSC: yes (motors full); plant at 1 m/min: HS keeps {slow.K_p_ms:.2f} 1/m of"
                f" {least:.2f} with the empty hook; with 100 t {swing}"
            ),
            verdict(min(loaded) > least, "in the published loop"),
        ),
    }


def compute() -> tuple[dict[str, str], dict[str, tuple[str, str, str]], Any]:
    """Blocks of the page, its claims, and what the pictures show."""
    found = claims()
    alpha, least = least_limit(CRANE)
    D = in_display(alpha * CRANE.active.motor.D_total, "displacement")
    blocks = {
        "claims": claims_table(found),
        "ways": four_ways(),
        "least": f"The least limit is {least:.4f} 1/m, at {D:.0f} cm³/rev ({percent(alpha)} of the full displacement).",
        "margins": margin_rows(),
        "holds": holding_rows(),
        "strong": (
            "`strongest_gain` of this crane, PLC of 10 ms, any delay up to 50 ms:"
            f" {strongest_gain(CRANE, delay=0.05):.3f} 1/m."
        ),
        "ssc": ssc_rows(),
        "plant": plant_rows(),
        "slow": slow_rows(),
        "afloat": (
            f"With both lines above boost the frequency is {afloat():.3f} times that with one line held (√2 = 1.414)."
        ),
    }
    return blocks, found, None


def draw(_: Any) -> None:
    save(gain_limit_figure(CRANE, sweep(CRANE), slow_sweep(CRANE)), "paper-e-gain-limit.png")
    save(motor_pole_figure(CRANE), "paper-e-motor-poles.png")
    save(root_locus_figure(CRANE), "paper-e-root-locus.png")
    save(bode_figure(CRANE, (1.0, 0.6), delay=0.05), "paper-e-bode.png")
    over = ("layer", "leakage", "damping", "bulk_modulus", "delay")
    save(sweep_figure(CRANE, [sweep(CRANE, o, alpha_m=0.6) for o in over]), "paper-e-limit-sweeps.png")
