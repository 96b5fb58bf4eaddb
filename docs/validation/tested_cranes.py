"""The cranes of table 2.1 as crane files: what is printed of them beside what the files give, none of it fitted."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import xarray
from blocks import Blocks

from stillhook import Scenario, Sine, load_crane, metrics, simulate
from stillhook.analysis.loop_stability.stability import eigenfrequency
from stillhook.engine.pack.winch import drum_record, inertia_record
from stillhook.physics.load_path.drum import layers_filled, shaft_inertia
from stillhook.physics.scalar import G
from stillhook.sea.motion.motion import Motion, Sum
from stillhook.spec.crane import Crane, wire_capacity
from stillhook.spec.scenario import Operator
from stillhook.thesis.ringing import Ringing, ringing
from stillhook.units import from_display, in_display

CC, BAR = from_display(1.0, "displacement"), from_display(1.0, "pressure")
TWELVE, F1799, C_D = (load_crane(name) for name in ("nov-165t-12-motors", "nov-250t-f1799", "nov-150t"))
PERIODS = {2940: 0.4, 2500: 0.4, 1600: 0.7, 735: 1.5}  # cm^3/rev, s: paper C table 1
ROUNDING = 0.05  # s
START = 2.0  # s
J_FULL, J_OUT, L_FULL, L_OUT = 3.58, 1.51, 3080.0, 80.0  # kg m^2, m: paper F figure 7
HELD, D_HELD, P_HELD = 55.0, 8 * 70.0, 275.0  # t, cm^3/rev, bar: paper D section 4.3
HOOK = 2.0  # t, paper D figure 14
CASES = ((82.0, 200.0, 487.0), (94.0, 1500.0, 487.0), (164.0, 200.0, 2314.0), (162.0, 300.0, 2281.0))  # t, s, m


class LoadCase(NamedTuple):
    """A load case of paper F table 3: winch load [t], duration [s], wire paid out [m], layer, what the run gives."""

    load: float
    duration: float
    s_w: float
    layer: int
    tip: float
    e_c_pp: float
    eta: float
    p_max: float
    alpha_pm: float


def ramped(D: int) -> Ringing:
    """Paper C's ramp at a displacement [cm^3/rev]: empty hook, 15 m of wire, stick over in 1 s, as on its page."""
    profile = ((f"{START:g} s", "0 m/min"), (f"{START + 1.0:g} s", "15 m/min"))
    operator = Operator(profile=profile, alpha_m=D / 3000.0)
    bare = TWELVE.model_copy(update={"brake": None})
    case = Scenario(load="0 t", s_w="15 m", mode="manual", operator=operator, duration="24 s", warm_up="0 s")
    return ringing(simulate(bare, case, every="0.01 s"), "p_a", start=START, least=0.3 * BAR)


def missing() -> float:
    """Factor on inertia times oil volume with which the linear period would be the printed one, middle of those that
    all four allow [-]."""
    low = max((T - ROUNDING) * D for D, T in PERIODS.items())
    high = min((T + ROUNDING) * D for D, T in PERIODS.items())
    ours = eigenfrequency(TWELVE, 1.0).period * 3000.0
    return (0.5 * (low + high) / ours) ** 2


def inertia_at(crane: Crane, on_drum: float) -> float:
    """Inertia at the motor shaft with so much wire on the drum [m] [kg m^2]."""
    drum = drum_record(crane)
    length = min(on_drum, drum.L_full)
    return float(shaft_inertia(length, layers_filled(length, drum), drum, inertia_record(crane)))


def lightest_rope(r_i: float) -> float:
    """Mass per length of the rope with which 3,000 m of it on a drum of radius r over gear ratio i [m] make the printed
    difference, if all of it were on the outermost radius [kg/m]."""
    return (J_FULL - J_OUT) / ((L_FULL - L_OUT) * r_i**2)


def sea() -> Motion:
    """Three sines that beat, 0.5 to 2 m from trough to crest in 30 s: the range of table 2, 1c."""
    return Sum([Sine.from_si(a, T) for a, T in ((0.36, 9.0), (0.32, 10.7), (0.24, 12.9))])


def load_case(load: float, duration: float, s_w: float) -> LoadCase:
    case = Scenario(
        load=f"{load - F1799.hook_mass / 1000.0:g} t",
        s_w=f"{s_w:g} m",
        tip=sea(),
        mode="ns",
        duration=f"{duration + 30.0:g} s",
        warm_up="30 s",
    )
    run: xarray.Dataset = simulate(F1799, case, every="0.1 s")
    drum = drum_record(F1799)
    tip, e_c = metrics.s_tip_pp(run), metrics.e_c_pp(run)
    return LoadCase(
        load,
        duration,
        s_w,
        layer=math.ceil(layers_filled(drum.L_full - s_w, drum)),
        tip=float(tip.mean()),
        e_c_pp=100.0 * float(e_c.mean()),
        eta=float(metrics.eta_c(run).mean()),
        p_max=in_display(float(run["p_max"]), "pressure"),
        alpha_pm=float(run["alpha_pm"].mean()),
    )


def by_tip() -> tuple[float, float]:
    """Efficiency where the tip moves less than 1 m in 30 s, and where it moves more, load case 2 [-]."""
    load, duration, s_w = CASES[1]
    case = Scenario(
        load=f"{load - F1799.hook_mass / 1000.0:g} t",
        s_w=f"{s_w:g} m",
        tip=sea(),
        mode="ns",
        duration=f"{duration:g} s",
    )
    run = simulate(F1799, case, every="0.1 s")
    tip, eta = metrics.s_tip_pp(run), metrics.eta_c(run)
    return float(eta.where(tip < 1.0).mean()), float(eta.where(tip > 1.0).mean())


def compute() -> tuple[Blocks, None]:
    linear = {D: eigenfrequency(TWELVE, D / 3000.0).period for D in PERIODS}
    full = {D: ramped(D).period for D in PERIODS}
    r_i = D_HELD * CC * P_HELD * BAR / ((HELD + HOOK) * 1000.0 * G)
    file_r_i = 0.5 * C_D.drum.d_max / C_D.i_hD
    J_full, J_out = inertia_at(C_D, L_FULL), inertia_at(C_D, L_OUT)
    rope, m_file = lightest_rope(r_i), C_D.wire.mass_per_length
    capacity = wire_capacity(C_D.drum, C_D.wire)
    share = (J_full - J_out) / ((min(L_FULL, capacity) - L_OUT) * m_file * file_r_i**2)
    r_needed = math.sqrt((J_FULL - J_OUT) / ((L_FULL - L_OUT) * m_file * share))
    holds = C_D.passive.motor.D_total * P_HELD * BAR / (r_needed * G) / 1000.0 if C_D.passive else math.nan
    cases = [load_case(*case) for case in CASES]
    low, high = by_tip()
    holds_wire, factor = wire_capacity(F1799.drum, F1799.wire), missing()
    rope_mm = 1000.0 * math.sqrt(rope / m_file) * C_D.wire.d
    numbers: dict[str, Any] = locals()
    return {
        "claims": numbers,
        "periods": [(D, T, linear[D], full[D]) for D, T in PERIODS.items()],
        "pair": numbers,
        "cases": cases,
    }, None
