"""Energy through a winch counts each joule once, when it comes in: from the supply, or over the wire. By hand for all types."""

import math

import numpy as np
import pytest
from tests.engine.runs import run_one

from stillhook import Scenario, load_crane
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.library import changed
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator

CRANES = {
    name: load_crane(name)
    for name in (
        "nov-250t",
        "nov-100t-pure-active",
        "utility-20t-open-circuit",
        "nov-250t-secondary",
        "nov-100t-cylinder",
        "nov-100t-electric",
    )
}
"""One of every type."""
PART = 0.4
"""Of the safe working load."""
FINE = 5
"""Steps per PLC cycle."""
BALANCE = 1.0e-3
"""Relative: powers are summed once per PLC cycle of 10 ms by trapezoids, and the wire still stretches by joules."""
HEAVE = 0.02
"""Relative, in waves: the load hangs almost still, and its tension almost stays."""

cranes = pytest.mark.parametrize("name", sorted(CRANES))


def weight(crane: Crane) -> float:
    return (PART * crane.SWL + crane.hook_mass) * G


def run(crane: Crane, **case) -> ScenarioRun:
    usual = {"load": f"{PART * crane.SWL!r} kg", "s_w": "150 m", "duration": "100 s", "warm_up": "40 s"}
    return run_one(crane, Scenario(**(usual | case)), n_sub=FINE)


def steady(crane: Crane, speed: float) -> ScenarioRun:
    """A steady wire speed by the operator, hoisting positive [m/s]."""
    profile = (("0 s", "0 m/s"), ("5 s", f"{speed} m/s"), ("100 s", f"{speed} m/s"))
    return run(crane, mode="manual", tip="still", operator=Operator(profile=profile))


def raised(crane: Crane, result: ScenarioRun) -> float:
    """Weight times the way up over the counted part [J]."""
    s_w = result.column("s_w")[round(result.warm_up / result.t_cycle) :]
    return weight(crane) * float(s_w[0] - s_w[-1])


def through(result: ScenarioRun) -> float:
    return float(result.stats.common.through * result.t_cycle)


def joules(crane: Crane, result: ScenarioRun) -> tuple[dict[str, float], dict[str, float]]:
    """What the supply brought and what was lost, of the winch and its wire [J]."""
    module = crane.plant.type.module
    within = getattr(module, "WITHIN", ())
    power = {k: v * result.t_cycle for k, v in result.stats.power._asdict().items() if k not in within}
    supplied = {k: v for k, v in power.items() if k in module.SUPPLIED}
    return supplied, {k: v for k, v in power.items() if k not in supplied and k != "tip"}


@cranes
def test_a_hoist_takes_in_what_it_raises_and_what_it_loses(name):
    """Nothing comes in over the wire, so that grid or power units pay for weight and losses: once."""
    crane = CRANES[name]
    result = steady(crane, 0.3)
    supplied, lost = joules(crane, result)
    stores = result.stats.common.E_end - result.stats.common.E_start - raised(crane, result)  # a store that is emptied
    expected = raised(crane, result) + sum(lost.values()) + stores
    assert raised(crane, result) > 0.0
    assert through(result) == pytest.approx(expected, rel=BALANCE)
    assert through(result) == pytest.approx(sum(max(x, 0.0) for x in supplied.values()), rel=BALANCE)


@cranes
def test_a_lowering_takes_in_the_weights_energy_over_the_wire_and_what_the_supply_gives(name):
    """What goes back to grid or power units is the same joule on its way out, and is not counted again. The pumps of
    the open circuit push the load down as well; those of the passive motors and of the rail take up."""
    crane = CRANES[name]
    result = steady(crane, -0.3)
    supplied, _ = joules(crane, result)
    given = sum(max(x, 0.0) for x in supplied.values())
    assert through(result) == pytest.approx(-raised(crane, result) + given, rel=BALANCE)


def test_the_grid_pays_for_an_electric_hoist_by_the_work_of_the_load_and_the_resistances():
    """Without friction, the store at rest: F v + n ((R + R_i) (F r/(n K_t))^2 + k omega^2 + P_idle)."""
    still = {"Y_1": 0.0, "Y_2": "0 N m", "Y_3": "0 N m", "Y_5": "0 N m s/rad", "Y_6": 0.0}
    crane = changed(
        CRANES["nov-100t-electric"],
        {"friction": {"system": still, "sigma_1_ratio": 0.0}, "electric": {"store": {"C": "1 F", "R": "0 ohm"}}},
    )
    result = steady(crane, 0.3)
    m, R_i = crane.electric.motor, crane.electric.inverter.R
    counted = slice(round(result.warm_up / result.t_cycle), None)
    v, omega = result.column("v_w")[counted], result.column("omega_m")[counted]
    i = weight(crane) * v / omega / (m.count * m.K_t)
    P = weight(crane) * v + m.count * ((m.R + R_i) * i**2 + m.k_iron * omega**2 + crane.electric.inverter.P_idle)
    assert through(result) == pytest.approx(np.trapezoid(P, dx=result.t_cycle), rel=BALANCE)
    efficiency = raised(crane, result) / through(result)
    assert 0.85 < efficiency < 0.97


@cranes
def test_in_waves_the_weight_goes_through_once_down_and_is_paid_for_once_up(name):
    """The tip lifts the weight by 2 A a period, and the wire brings that in; what the winch gives to take the wire in
    again comes from supply or store. So it is W 2 A a period and no more than what the supply brings on top."""
    crane = CRANES[name]
    result = run(crane, mode=crane.plant.type.default_mode, tip="sine 1 m 10 s")
    swing = weight(crane) * 2.0 * 6.0
    supply = next((row.name for row in crane.plant.type.rows if row.name in ("P_el", "P_hpu")), None)
    P = result.column(supply)[round(result.warm_up / result.t_cycle) :]
    assert swing < through(result) * (1.0 + HEAVE)
    given = float(np.sum(np.maximum(P, 0.0))) * result.t_cycle
    others = {k: x for k, x in joules(crane, result)[0].items() if k not in ("pump", "grid")}
    bound = swing + given + sum(abs(x) for x in others.values())
    assert through(result) < bound * (1.0 + HEAVE)
    if crane.electric:
        assert through(result) == pytest.approx(swing + given, rel=HEAVE)


def test_the_summary_gives_it_by_its_name():
    crane = CRANES["nov-100t-electric"]
    case = Scenario(load="40 t", s_w="150 m", tip="sine 1 m 10 s", mode="position", duration="60 s", warm_up="20 s")
    result = run_one(crane, case, n_sub=FINE)
    summary = result.summary
    assert summary["energy_through"] == through(result) > 0.0
    assert math.isfinite(summary["energy_unaccounted"])
