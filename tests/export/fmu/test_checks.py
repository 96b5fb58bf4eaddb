"""An FMU of a winch whose PLC has checks before its guard."""

from pathlib import Path

import numpy as np
import pytest
from tests.export.fmu.slave import OWN, Slave, given
from tests.export.twin.test_core import CLOSE, case_of, rows

import stillhook
from stillhook.control.guard import HEALTHY, STOPPED, SUBSTITUTED
from stillhook.control.interface import Sensed
from stillhook.export.fmu import write_fmu
from stillhook.export.twin import export
from stillhook.library import changed

pytestmark = pytest.mark.skipif(OWN is None, reason="an FMU has no library for this system")

BAD = 900
"""Cycle from which the encoder's channel is bad."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("table", "state"), [({"on_encoder": "feedback-off"}, SUBSTITUTED), ({"on_encoder": "stop"}, STOPPED)]
)
def test_a_winch_with_checks_in_an_fmu_is_that_of_simulate_until_its_encoder_fails(table, state, tmp_path: Path):
    crane = changed(stillhook.load_crane("nov-250t"), {"control": {"guard": table}})
    case = case_of(crane)
    run, tip = stillhook.simulate(crane, case, every="10 ms", series=True), rows(crane, case)
    slave = Slave(write_fmu(export(crane, case), tmp_path / "checks.fmu", platforms=[str(OWN)])[0], tmp_path)
    slave.begin(given(tip[0]), {"input_time": 0})
    out, codes = [], [slave.numbers["guard_state"], slave.numbers["guard_alarm"]]
    for k, row in enumerate(tip[1:]):
        slave.set(**given(row))
        slave.fmu.setBoolean([slave.numbers["q_s_w"]], [k < BAD])
        slave.step(k * 0.01, 0.01)
        out.append([*slave.get("e_c", "s_w", "brake"), *slave.get_int(codes)])
    e_c, s_w, brake, guard, alarm = np.array(out).T
    assert np.abs(e_c[:BAD] - run.e_c.values[1 : BAD + 1]).max() < CLOSE
    assert set(guard[:BAD]) == {HEALTHY}
    assert (guard[-1], alarm[-1]) == (state, 2.0 ** Sensed._fields.index("s_w"))
    true = run.s_w.values[BAD + 1 : len(s_w) + 1]
    if state == SUBSTITUTED:  # feedforward alone moves the wire
        assert np.abs(s_w[BAD:] - true).max() < 0.2
    else:
        assert brake[-1] == 1.0
        assert np.ptp(s_w[-200:]) < 1e-2
    assert np.ptp(true) > 1.5
