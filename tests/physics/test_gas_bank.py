"""Gas banks that are set for the load: fixed motors carry it as a gas spring, a change of load takes hours, and nothing of
it is there where no bank is."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from tests.engine.test_lowering import box

from stillhook import Scenario, Still, load_crane, simulate
from stillhook.engine.pack.winch import layer_diameter_at, pack
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.physics.scalar import G
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.phase import Phase
from stillhook.winches.circuits.passive import other_motors, prepared, pressure_set, stroke, time_to_fill
from stillhook.winches.types import active_passive

BANK = {"passive": {"motor": {"alpha_min": 1.0}, "bank": {"p_min": "40 bar", "Q_free": "2000 L/min"}}}
CASE = {"load": "125 t", "s_w": "200 m", "tip": "sine 0.2 m 20 s", "mode": "ssc", "duration": "80 s", "warm_up": "20 s"}
TIGHT = {
    "passive": {
        "motor": {"C_1": "0 L/min/bar", "C_2": "0 L/min/bar/(rev/min)"},
        "pump": {"leak_scale": 1e-9},
        "accumulator": {"C_leak": "0 L/min/bar", "R_piston": "0 bar/(L/min)"},
    },
    "control": {"K_acc": "0 1/bar"},
}
"""Nothing leaks, and the pumps stand."""
SLOPE = 2.0e-3
"""Of the stiffness from a run: the gas law bends over the 0.3 m of wire."""


@cache
def crane() -> Any:
    return changed(load_crane("nov-250t"), BANK)


def weight(load: float) -> float:
    return (load + crane().hook_mass) * G


@pytest.mark.parametrize("load", ["60 t", "125 t", "250 t"])
def test_at_the_start_the_motors_hold_the_load_at_full_displacement(load):
    case = Scenario(**(CASE | {"load": load}))
    p = pack(crane(), case).params
    geo = active_passive.geometry(case.s_w, p)
    held = active_passive.carried(p, geo, p.hoist.load.W)
    assert held.alpha == 1.0
    assert held.T == pytest.approx(p.hoist.load.W * geo.r_eff, rel=1e-6)


def test_over_the_stroke_the_bank_is_a_gas_spring():
    r"""The force on the wire changes by k s, :math:`k = n p_0 D^2/(V_0 r^2)`: n p A^2/V with D/r for the area."""
    run = simulate(changed(crane(), TIGHT), Scenario(**CASE))
    r = 0.5 * layer_diameter_at(crane(), 200.0) / crane().i_hD
    passive = prepared(crane(), weight(125e3), 2.0 * r * crane().i_hD).passive
    gas, D = passive.accumulator.gas, passive.motor.D_total
    late = run.time.values > 20.0
    F = D * (run.p_hp.values[late] - passive.p_lp) / r
    assert np.ptp(run.alpha_pm.values) == 0.0
    slope = float(np.polyfit(run.s_w.values[late], F, 1)[0])  # wire paid out takes oil into the accumulator
    assert slope == pytest.approx(gas.n * gas.p_0 * (D / r) ** 2 / gas.V_0, rel=SLOPE)


def test_variable_displacement_at_one_pressure_carries_the_weight_over_the_whole_stroke():
    """What came in 2001: the displacement takes back what the gas adds, but for the lag of its servo (0.4 s of 40 s)."""
    case = Scenario(**(CASE | {"tip": "sine 2 m 40 s", "duration": "120 s"}))
    torques = []
    for each in (crane(), load_crane("nov-250t")):
        run = simulate(each, case)
        T = each.passive.motor.D_total * run.alpha_pm.values * (run.p_hp.values - each.passive.p_lp)
        torques.append(np.ptp(T[run.time.values > 20.0]) / T.mean())
    assert torques[1] < 0.25 * torques[0]


def test_a_load_that_is_lost_rests_on_the_closed_circuit():
    """The bank stays as it was set: in proportion to the weight that is gone, the active circuit pulls the other way."""
    p = pack(crane(), Scenario(**CASE)).params
    geo = active_passive.geometry(200.0, p)
    hook = weight(0.0)
    held = active_passive.carried(p, geo, hook)
    assert held.T - hook * geo.r_eff == pytest.approx((weight(125e3) - hook) * geo.r_eff, rel=1e-6)
    without = pack(load_crane("nov-250t"), Scenario(**CASE)).params
    assert active_passive.carried(without, geo, hook).T == pytest.approx(hook * geo.r_eff, rel=1e-6)


def test_the_compressor_takes_the_time_of_the_gas_that_a_load_takes():
    """Amount of gas by p V/(R T), before and after, over what the compressor delivers of air at the atmosphere."""
    d = crane().drum.d_max
    light, heavy = (prepared(crane(), weight(m), d).passive for m in (50e3, 150e3))
    T, R = 293.15, 8.314462618
    moles = [t.accumulator.gas.p_0 * t.accumulator.gas.V_0 / (R * T) for t in (light, heavy)]
    per_second = 101325.0 * crane().passive.bank.Q_free / (R * T)
    dp = heavy.accumulator.gas.p_0 - light.accumulator.gas.p_0
    assert time_to_fill(crane().passive, dp) == pytest.approx((moles[1] - moles[0]) / per_second)
    assert time_to_fill(crane().passive, dp) > 3600.0


def test_a_bank_ends_at_its_lowest_and_at_its_charge():
    passive = crane().passive
    assert pressure_set(passive, 0.0) == passive.bank.p_min
    assert pressure_set(passive, 1e9) == passive.accumulator.gas.p_0
    (heavy,) = other_motors(crane(), 3.0 * weight(250e3), crane().drum.d_max)
    assert heavy.alpha > 1.0


def test_the_stroke_on_fixed_motors_is_that_of_their_oil_whatever_the_load():
    D, r = crane().passive.motor.D_total, 0.5 * crane().drum.d / crane().i_hD
    for load in (60e3, 250e3):
        assert stroke(crane(), weight(load)).length == pytest.approx(crane().passive.accumulator.V_stroke * r / D)


def test_a_run_says_what_the_bank_is_set_to_and_what_a_change_takes():
    notes = simulate(crane(), Scenario(**CASE)).notes.item()
    assert "the gas bank is set to 129" in notes
    assert "the compressor takes" in notes
    assert "gas bank" not in simulate(load_crane("nov-250t"), Scenario(**CASE)).notes.item()


def test_energy_adds_up_and_a_lowering_begins_with_the_bank_set():
    run = simulate(crane(), Scenario(**(CASE | {"tip": "sine 2 m 10 s"})))
    assert abs(float(run.energy_unaccounted)) < 1e-3
    lift = Lowering(
        payload=box("100 t"),
        tip=Still(),
        h_tip="40 m",
        depth="500 m",
        start_depth="-20 m",
        duration="10 s",
        programme=(Phase(mode="manual", time="10 s"),),
    )
    start = simulate(crane(), lift)
    dp = float(start.p_hp.values.ravel()[0]) - crane().passive.p_lp
    r = 0.5 * crane().drum.d_max / crane().i_hD
    assert dp * crane().passive.motor.D_total / r == pytest.approx(float(start.F_w.values.ravel()[0]), rel=0.1)
    assert not math.isnan(dp)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"motor": {"alpha_min": 0.5}},
            "motor.alpha_min = 0.5: with a bank the motors are of fixed displacement. Set 1",
        ),
        ({"bank": {"p_min": "300 bar"}}, "p_lp 15 bar, bank.p_min 300 bar and accumulator.gas.p_0 280 bar must rise"),
        ({"bank": {"p_min": "10 bar"}}, "bank.p_min 10 bar"),
        ({"bank": {"Q_free": "0 L/min"}}, "passive.bank.Q_free"),
        ({"bank": {"Q": "1 L/min"}}, "unknown field"),
    ],
)
def test_a_bank_that_cannot_be_is_refused_in_one_line(changes, words):
    with pytest.raises(StillhookError) as refused:
        changed(crane(), {"passive": changes})
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
