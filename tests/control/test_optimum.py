"""The displacement of least cost: what the load needs is kept, the pumps' flow is enough, a moving displacement does not
reach the wire, and without known motors the law is SSC."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from stillhook import Scenario, load_crane, simulate
from stillhook.control.commands import displacement_min_moving
from stillhook.control.controllers import ssc, ssc_optimal
from stillhook.control.controllers.ssc_optimal import Memory, Settings
from stillhook.control.interface import Reading, Sensed
from stillhook.control.plant import PlantParameters
from stillhook.engine.pack.winch import pack, set_up_for
from stillhook.library import changed

STRONG = {"K_p": "0.5 1/m", "t_lead": "60 ms"}
HEAVY = "sine 0.8 m 9.7 s + sine 1.2 m 11.9 s + sine 0.9 m 14.3 s"
SENSORS = {"delay": "20 ms", "seed": 5, "s_tip": {"noise": "2 mm"}, "v_tip": {"noise": "3 mm/s"}}
DEFAULT = Settings(w_Q=0.3, w_s=0.0, u_most=0.9, t_ahead=0.3, k_rate=0.7, k_load=0.7)


def crane(**own: Any) -> Any:
    return changed(load_crane("nov-250t"), {"control": STRONG | ({"ssc_optimal": own} if own else {})})


def case(mode: str = "ssc-optimal", tip: str = HEAVY, **more: Any) -> Scenario:
    return Scenario(
        load="100 t", s_w="487 m", duration="160 s", warm_up="60 s", mode=mode, tip=tip, sensors=SENSORS, **more
    )


PLC = pack(crane(), case()).params.plc


def readings(n: int = 500) -> list[Reading]:
    """Signals of a crane that moves as it likes, the commands within those of the pumps."""
    rng, out = np.random.default_rng(1), []
    for row in rng.standard_normal((n, len(Sensed._fields))).tolist():
        y = Sensed(*row)._replace(mode=1.0, f_pump=1.0, alpha_m=math.exp(-abs(row[9])), K_wire=1.2, F=1e6 * abs(row[8]))
        y = y._replace(dp_load=1e7 * row[12])
        out.append(Reading(y=y, e_c=row[0], F=y.F, u_ff=math.tanh(row[1]), u_fb=0.1 * row[2]))
    return out


def test_the_displacement_is_between_what_load_and_inertia_need_and_full():
    m = Memory()
    for r in readings():
        demand, m = ssc_optimal.cycle(r, PLC, DEFAULT, m)
        assert displacement_min_moving(r.F, r.y.a_tip, r.y.K_wire, PLC.motors) <= demand.u_m <= 1.0
        assert all(math.isfinite(x) for x in (*demand, *m))


def test_without_cost_of_flow_the_motors_stay_full_while_the_flow_is_enough():
    m, free = Memory(), DEFAULT._replace(w_Q=0.0)
    for v in (0.0, 0.2, 0.5, 0.8):
        y = readings(1)[0].y._replace(v_tip=v, v_op=0.0, a_tip=0.0, K_wire=1.0, alpha_m=1.0, F=1e6, dp_load=5e6)
        u_ff = -PLC.gains.K_1 * v
        demand, _ = ssc_optimal.cycle(Reading(y=y, e_c=0.0, F=1e6, u_ff=u_ff, u_fb=0.0), PLC, free, m)
        assert demand.u_m == 1.0


@pytest.mark.parametrize("U", [0.95, 1.2, 1.8])
@pytest.mark.parametrize("U_leak", [0.0, 0.03, 0.06])
def test_motion_and_leakage_take_no_more_than_the_share_of_the_flow(U, U_leak):
    alpha = 1.0
    for _ in range(20):
        alpha = ssc_optimal.optimal_displacement(U, 1e8, U_leak, alpha, DEFAULT._replace(w_Q=0.0), 0.01)
    assert U * alpha + U_leak / alpha == pytest.approx(0.9, rel=1e-9)


@pytest.mark.parametrize("start", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("w_s", [0.0, 0.05])
def test_the_cost_is_least_where_the_law_comes_to_rest(start, w_s):
    """Against a search over all displacements; travel costs time, and moves the rest nowhere."""
    U, p_1, s = 0.4, 9e6, DEFAULT._replace(w_s=w_s, w_Q=1.0)
    alpha = start
    for _ in range(4000):
        alpha = ssc_optimal.optimal_displacement(U, p_1, 0.0, alpha, s, 0.01)
    grid = np.linspace(0.05, 2.0, 200_001)
    cost = (p_1 / 3.5e7 / grid) ** 2 + s.w_Q * (U * grid) ** 2
    assert alpha == pytest.approx(grid[cost.argmin()], abs=2e-5)


@pytest.mark.parametrize("w_Q", [0.0, 0.1, 0.6, 5.0])
@pytest.mark.parametrize("w_s", [0.0, 1.0])
def test_it_begins_where_it_comes_to_rest(w_Q, w_s):
    """The linear analysis takes the displacement of its first cycle for the one at which it stands."""
    r, m, demands = readings(1)[0], Memory(), []
    still = r._replace(y=r.y._replace(v_tip=0.3, v_op=0.0, a_tip=0.0, alpha_m=1.0), u_ff=-0.4)
    for _ in range(500):
        demand, m = ssc_optimal.cycle(still, PLC, DEFAULT._replace(w_Q=w_Q, w_s=w_s), m)
        demands.append(demand.u_m)
    assert np.ptp(demands) < 1e-9


def test_more_pressure_asks_for_more_displacement_and_more_speed_for_less():
    def at_rest(U, p_1):
        alpha = 1.0
        for _ in range(50):
            alpha = ssc_optimal.optimal_displacement(U, p_1, 0.0, alpha, DEFAULT, 0.01)
        return alpha

    pressures = [at_rest(0.7, p) for p in (2e6, 5e6, 1e7, 2e7)]
    speeds = [at_rest(U, 5e6) for U in (0.2, 0.5, 0.9, 1.5)]
    assert pressures == sorted(set(pressures))
    assert speeds == sorted(set(speeds), reverse=True)


def test_without_known_motors_it_is_ssc_to_the_bit():
    nothing = PlantParameters._make([0.0] * len(PlantParameters._fields))._replace(d_max=5.1, i_hD=500.0)
    plc, m = PLC._replace(plant=nothing), Memory()
    for r in readings():
        demand, m = ssc_optimal.cycle(r, plc, DEFAULT, m)
        assert demand == ssc.cycle(r, plc)
        assert all(math.isfinite(x) for x in m)


def test_a_displacement_that_moves_does_not_reach_the_wire():
    """With pumps that follow the displacement the error in heavy waves is smaller than without, and than under SSC, at
    one lead for all."""
    followed, ignored = (float(simulate(crane(k_rate=k), case()).e_c_pp) for k in (0.7, 0.0))
    assert followed < 0.8 * ignored
    assert followed < 0.8 * float(simulate(crane(), case("ssc")).e_c_pp)


def travel_and_pressure(signal: str, **own: Any) -> tuple[float, float]:
    run = simulate(crane(**own), case(), series=True)
    return float(np.abs(np.diff(run[signal].values[run.time.values > 60.0])).sum()), float(run.p_max)


def test_cost_of_travel_takes_travel_of_the_motors():
    travel = [travel_and_pressure("alpha_m", w_Q=0.3, w_s=w_s)[0] for w_s in ("0 s", "1 s", "5 s")]
    assert travel[0] > travel[1] > travel[2]


def test_cost_of_flow_takes_travel_of_the_pumps_and_costs_pressure():
    (little, p_little), (much, p_much) = (travel_and_pressure("alpha_p", w_Q=w_Q) for w_Q in (0.0, 1.0))
    assert much < 0.9 * little
    assert p_much > p_little


def test_the_pre_load_is_the_oil_between_both_signs_of_dry_friction():
    """A reversal at half displacement pumps the volume by which one line rises from -T to T at the motors."""
    plant, h, m, volume = PLC.plant, PLC.t_cycle, Memory(), 0.0
    only = DEFAULT._replace(k_load=1.0, k_rate=0.0)
    y = Sensed._make([0.0] * len(Sensed._fields))._replace(mode=1.0, f_pump=1.0, alpha_m=0.5, K_wire=1.2, F=1e6)
    for v in (0.3,) * 200 + (-0.3,) * 500:
        demand, m = ssc_optimal.cycle(Reading(y=y._replace(v_tip=v), e_c=0.0, F=1e6, u_ff=0.0, u_fb=0.0), PLC, only, m)
        volume += demand.u_p * plant.Q_p * h
    rise = volume * plant.i_C_h
    assert rise * plant.D_m * 0.5 == pytest.approx(2.0 * plant.T_dry, rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("Y_6", [2.3e-6, 7.6e-6, 1.5e-5])
def test_the_pre_load_takes_error_and_pressure_where_friction_is_not_what_the_file_says(Y_6):
    tip = "sine 0.3 m 7.3 s + sine 0.25 m 9.1 s"
    known = [crane(k_load=k) for k in (0.7, 0.0)]
    machines = [set_up_for(changed(k, {"friction": {"system": {"Y_6": Y_6}}}), k) for k in known]
    loaded, not_loaded = (simulate(machine, case(tip=tip)) for machine in machines)
    assert float(loaded.e_c_pp) < float(not_loaded.e_c_pp)
    assert float(loaded.p_max) < float(not_loaded.p_max)
