"""Litres and metres: what flows into a line is in it, what leaves the drum is out."""

import functools

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import drum_record, pack
from stillhook.physics.load_path.drum import layer_diameter, wire_to_layer
from stillhook.spec.scenario import Operator, PowerLoss
from stillhook.winches.circuits.active import ActiveFlows, active_flows
from stillhook.winches.load_path import load as load_path
from stillhook.winches.load_path.load import drum_geometry
from stillhook.winches.records import Tip
from stillhook.winches.types.active_passive import Command, State, circuit

CYCLE = 0.01
OIL = 2.0e-4
"""Of the oil that the pumps moved. Flows are summed by trapezoids over stored cycles of 10 ms, across the kinks of valves;
the worst seen is 6e-5."""
WIRE = 2.0e-5
"""Trapezoids of the wire's speed over minutes [m]."""
ROUNDING = 1.0e-8
CRANES = {"active-passive": load_crane("nov-250t"), "pure-active": load_crane("nov-100t-pure-active")}
LOADS = {"active-passive": "100 t", "pure-active": "40 t"}
LOWERING = Operator(profile=(("0 s", "0 m/min"), ("10 s", "-20 m/min"), ("50 s", "-20 m/min"), ("60 s", "0 m/min")))
CASES = {
    "ssc": {"mode": "ssc"},
    "hs": {"mode": "hs"},
    "manual": {"mode": "manual", "operator": LOWERING, "tip": "still"},
    "power loss": {"power_loss": PowerLoss(time="40 s", unit=1)},
}
each = pytest.mark.parametrize("what", sorted(CASES))
plants = pytest.mark.parametrize("plant", sorted(CRANES))


def scenario(plant: str, what: str) -> Scenario:
    base = {"load": LOADS[plant], "s_w": "200 m", "tip": "sine 1.5 m 12 s", "duration": "80 s"}
    return Scenario(**(base | CASES[what]))


@functools.cache
def table(plant: str, what: str) -> dict[str, np.ndarray]:
    data = simulate(CRANES[plant], scenario(plant, what), every="10 ms")
    return {str(name): data[name].values for name in data.data_vars if data[name].dims == ("time",)}


def summed(rate: np.ndarray) -> np.ndarray:
    return cumulative_trapezoid(rate, dx=CYCLE, initial=0.0)


@pytest.mark.thorough
@plants
@each
def test_oil_that_flows_into_a_line_raises_its_pressure_and_is_in_no_other_place(plant, what):
    y = table(plant, what)
    A = pack(CRANES[plant], scenario(plant, what)).params.active
    rows = zip(*(y[n].tolist() for n in ("alpha_p", "alpha_m", "omega_m", "p_a", "p_b", "f_pump")), strict=True)
    D = A.motors.count * A.motors.D_max
    flows = ActiveFlows(
        *np.array([active_flows(a_p, D * a_m, w, p_a, p_b, f, A) for a_p, a_m, w, p_a, p_b, f in rows]).T
    )
    moved = np.sum(np.abs(flows.Q_p)) * CYCLE
    for into, pressure in ((flows.Q_a, "p_a"), (flows.Q_b, "p_b")):
        held = (y[pressure] - y[pressure][0]) / A.i_C_h
        assert np.max(np.abs(summed(into) - held)) < OIL * moved


@pytest.mark.thorough
@pytest.mark.parametrize("what", ["ssc", "manual"])
def test_oil_that_the_passive_circuit_takes_is_in_the_accumulator(what):
    y = table("active-passive", what)
    case = scenario("active-passive", what)
    p = pack(CRANES["active-passive"], case).params

    def net_flow(k: int) -> float:
        at = {n: float(y[n][k]) for n in y}
        x = State(
            at["alpha_p"],
            0.0,
            at["alpha_m"],
            0.0,
            at["alpha_pp"],
            0.0,
            at["alpha_pm"],
            0.0,
            at["p_a"],
            at["p_b"],
            at["V_acc"],
            at["omega_m"],
            0.0,
        )
        path = load_path.State(at["s_w"], at["s_load"], at["v_load"])
        u = Command(at["u_p"], at["u_m"], 0.0, 0.0, at["f_pump"], 1.0, at["brake"])
        geo = drum_geometry(at["s_w"], p.hoist)
        q = load_path.at(x.omega_m * geo.r_eff, path, geo, Tip(at["s_tip"], at["v_tip"]), p)
        return float(circuit(x, q, u, geo, p).o.Q_o)

    Q_o = np.array([net_flow(k) for k in range(len(y["V_acc"]))])
    moved = np.sum(np.abs(Q_o)) * CYCLE
    assert np.ptp(y["V_acc"]) > 0.01
    assert np.max(np.abs(summed(Q_o) - (y["V_acc"] - y["V_acc"][0]))) < OIL * moved


@pytest.mark.slow
@plants
@each
def test_wire_that_leaves_the_drum_is_out(plant, what):
    y = table(plant, what)
    assert np.max(np.abs(summed(y["v_w"]) + y["s_w"] - y["s_w"][0])) < WIRE


@plants
@each
def test_wire_on_the_drum_and_wire_out_are_always_all_the_wire(plant, what):
    y = table(plant, what)
    drum = drum_record(CRANES[plant])
    on_drum = np.array([wire_to_layer(k, drum) for k in y["layer"]])
    assert np.max(np.abs(on_drum + y["s_w"] - drum.L_full)) < ROUNDING * drum.L_full


@plants
def test_the_wires_speed_is_that_of_the_drum_under_it(plant):
    y = table(plant, "ssc")
    crane = CRANES[plant]
    d = np.array([layer_diameter(k, drum_record(crane)) for k in y["layer"]])
    assert np.max(np.abs(y["v_w"] - 0.5 * d * y["omega_m"] / crane.i_hD)) < ROUNDING


@plants
def test_a_change_of_layer_makes_no_wire(plant):
    """Across the end of a layer the wire is slower on the same shaft, and still none is lost."""
    crane = CRANES[plant]
    drum = drum_record(crane)
    at = drum.L_full - wire_to_layer(drum.layers - 1, drum)
    case = scenario(plant, "manual").model_copy(update={"s_w": at - 5.0})
    data = simulate(crane, case, every="10 ms")
    layer = np.ceil(data.layer.values - 1e-9)
    assert set(layer) == {drum.layers, drum.layers - 1}
    k = int(np.argmax(layer < drum.layers))
    assert abs(data.v_w.values[k]) < abs(data.v_w.values[k - 1])
    assert abs(data.s_w.values[k] - at) < abs(data.v_w.values[k - 1]) * CYCLE
    on_drum = np.array([wire_to_layer(n, drum) for n in data.layer.values])
    assert np.max(np.abs(on_drum + data.s_w.values - drum.L_full)) < ROUNDING * drum.L_full
