"""The text of controllers beyond SSC on the signals of a crane on which their own parts are at work: learned friction in
force, a tension loop that yields, a displacement that moves."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from tests.export.plc.cases import all_good, bits, open_wide
from tests.export.plc.structured_text import Machine

from stillhook import Scenario, load_crane, simulate
from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands, memory_before
from stillhook.control.registry import CONTROLLERS
from stillhook.engine.pack.prediction import predicting
from stillhook.export.plc import structured_text
from stillhook.export.plc.block import controller_block
from stillhook.kernels.control_laws import control_laws, extra_controllers
from stillhook.library import changed
from stillhook.spec.crane import Crane

SEA = "sine 0.4 m 8.7 s + sine 0.7 m 10.9 s + sine 0.5 m 13.7 s"
WIRE = {"nov-250t": "487 m", "deep-250t": "2000 m"}
PREDICTING = {"t_lead": "0.2 s", "t_lead_ff": "0.25 s", "prediction": {"kind": "modes"}}
CYCLES = 6000
"""A minute: `ff` trusts what it learned after half of it."""
N = len(ActuatorCommands._fields)


@functools.cache
def signals(name: str) -> np.ndarray:
    """What the PLC reads in a minute (cycles, `Sensed`), of a winch under SSC with every quantity through a sensor."""
    crane = load_crane(name)
    case = Scenario(
        load="100 t",
        s_w=WIRE[name],
        tip=SEA,
        duration=f"{CYCLES * crane.control.t_cycle} s",
        warm_up="0 s",
        sensors={"delay": "20 ms", "seed": 3, "p_a": {"noise": "0.4 bar"}, "F": {"noise": "2 kN"}},
    )
    run = simulate(crane, case, every=f"{crane.control.t_cycle} s", series=True)
    y = {f: np.zeros(CYCLES) for f in Sensed._fields} | {"f_pump": np.ones(CYCLES), "K_wire": np.full(CYCLES, 1.2)}
    read = {"s_tip": "s_tip", "v_tip": "v_tip", "a_tip": "a_tip", "s_w": "s_w", "F": "F_w", "alpha_m": "alpha_m"}
    read |= {"omega_m": "omega_m", "p_a": "p_a", "p_b": "p_b", "p_hp": "p_hp"}
    y |= {f: np.asarray(run[of].values)[:CYCLES] for f, of in read.items()}
    y["dp"] = y["p_a"] - y["p_b"]
    y["dp_load"] = y["dp"].mean() + 2e5 * np.sin(np.arange(CYCLES) / 300.0)
    return np.column_stack([y[f] for f in Sensed._fields])


def cycles_of(crane: Crane, controller: str, rows: np.ndarray):
    """Commands of the cycle that simulations use, and what the controllers carry at the end."""
    block = controller_block(crane, controller)
    own = {controller: block.own} if block.own is not None else {}
    predicted = predicting(crane)
    laws = control_laws(extra_controllers([controller]), block.drive, predicts=bool(predicted))
    m, record, out = None, laws.blank(own | predicted), []
    for row in rows.tolist():
        y = Sensed(*row)
        m = memory_before(block.memory, y.F, y.s_w, y.s_tip, y.mode, y.v_op, block.plc) if m is None else m
        drive, m, record = laws.cycle(y, m, record, block.plc)
        out.append(drive)
    return np.array(out), record


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "controller", "control"),
    [
        ("nov-250t", "ff", {}),
        ("nov-250t", "ff", PREDICTING),
        ("deep-250t", "rope", {}),
        ("nov-250t", "ssc-optimal", {"ssc_optimal": {"w_Q": 0.6, "w_s": "1 s"}}),
    ],
)
def test_the_text_has_the_bits_of_the_cycle_where_the_law_is_at_work(name, controller, control):
    crane = changed(load_crane(name), {"control": control}) if control else load_crane(name)
    rows = signals(name).copy()
    rows[:, Sensed._fields.index("mode")] = CONTROLLERS[controller].code
    expected, record = cycles_of(crane, controller, rows)
    if controller == "ff":
        assert record.ff_memory.trust > 0.9
    if controller == "rope":
        assert record.rope_memory.x != 0.0
    if controller == "ssc-optimal":
        assert np.ptp(expected[CYCLES // 2 :, ActuatorCommands._fields.index("u_m")]) > 0.02
    machine = Machine(structured_text(controller_block(crane, controller)))
    open_wide(machine)
    step = machine.start()
    ours = np.array([step(*row) for row in all_good(rows).tolist()])
    np.testing.assert_array_equal(bits(ours[:, :N]), bits(expected))
