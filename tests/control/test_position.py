"""Position control: the pressure that is fed back does what leakage would do to a swing, and nothing to a steady load."""

from typing import Any

import numpy as np
import pytest

from stillhook import Crane, Profile, Scenario, load_crane, simulate
from stillhook.analysis.loop_stability.governing import place_limits
from stillhook.analysis.loop_stability.places import Place
from stillhook.library import changed
from stillhook.spec.scenario import Mode

CYLINDER, OPEN = "nov-100t-cylinder", "utility-20t-open-circuit"
QUICK_PLC = {"control": {"t_cycle": "2 ms", "compute_share": 0.0}}
"""A PLC that is hardly late: leakage is not late at all."""
LEAK = "0.0003 1/bar"


def crane(name: str, K_dp: str, tau_mean: str = "1 s", **more: Any) -> Crane:
    """A library crane with a feedback of the pressure."""
    control = {"position": {"K_dp": K_dp, "tau_mean": tau_mean}} | more
    return changed(load_crane(name), {"control": control})


def swing(c: Crane, load: float, s_w: float, v_tip: float) -> complex:
    """Eigenvalue of the load's swing on its wire, without position feedback [1/s]."""
    (at,) = place_limits(c, Mode("position"), [Place(load, s_w, v_tip, 0.0)])
    assert at.loop is not None
    z = np.linalg.eigvals(at.loop.Phi)
    s = np.log(z[np.abs(z) > 0.5]) / c.control.t_cycle
    return complex(min(s[s.imag > 0.3], key=lambda x: x.imag))


@pytest.mark.slow
@pytest.mark.parametrize(("load", "s_w"), [(60.0e3, 800.0), (100.0e3, 1800.0)])
def test_the_swing_is_damped_as_by_leakage_of_the_same_conductance(load, s_w):
    """A flow given way per pressure is leakage: K_dp times the full flow of the pumps."""
    still = changed(crane(CYLINDER, "0 1/bar"), QUICK_PLC)
    fed_back = changed(crane(CYLINDER, LEAK, "1000 s"), QUICK_PLC)
    pump = still.cylinder.pump
    C = pump.C_leak + fed_back.control.position.K_dp * sum(pump.D) * pump.omega_p
    leaking = changed(still, {"cylinder": {"pump": {"C_leak": f"{C * 6.0e9!r} L/min/bar"}}})
    alone, given, leaked = (swing(c, load, s_w, 2.0 / 60.0) for c in (still, fed_back, leaking))
    assert given.real < 1.5 * alone.real < 0.0
    assert given.real == pytest.approx(leaked.real, rel=0.02)
    assert given.imag == pytest.approx(leaked.imag, rel=0.01)


@pytest.mark.parametrize("name", [CYLINDER, OPEN])
def test_a_steady_load_shifts_nothing_and_the_start_is_without_a_bump(name):
    case = Scenario(load="15 t", s_w="100 m", tip="still", mode="position", duration="120 s", warm_up="0 s")
    plain, damped = (simulate(crane(name, K_dp, K_p="0.2 1/m"), case) for K_dp in ("0 1/bar", LEAK))
    assert float(damped.e_c[-1]) == pytest.approx(float(plain.e_c[-1]), abs=1.0e-4)
    assert float(damped.u_p[0]) == float(plain.u_p[0])


def test_the_library_cylinder_no_longer_swings_near_the_end_of_its_stroke():
    """What its position gain alone cannot end: the tip rises slowly under SWL, a load swings on 15 m of wire."""
    tip = Profile([("0 s", "0 m/s"), ("5 s", "1 m/min"), ("150 s", "1 m/min"), ("155 s", "0 m/s")])
    case = Scenario(load="100 t", s_w="15 m", tip=tip, mode="position", duration="150 s", warm_up="0 s", ramp="0 s")
    before, now = (simulate(c, case) for c in (crane(CYLINDER, "0 1/bar"), load_crane(CYLINDER)))
    late = slice(-3000, None)
    assert float(now.F_w[late].std()) < 0.2 * float(before.F_w[late].std())
