"""A holding brake that carries less than the load pulls lets the drum turn: valve-controlled and electric winch."""

import pytest

from stillhook import Scenario, load_crane, simulate
from stillhook.library.crane_file import changed
from stillhook.spec.crane import holding_torque

HELD = 5.0e-3
"""Wire that a brake which holds may lose [m]: its elastic travel, millimetres."""
CASES = {
    "utility-20t-open-circuit": ("brake", {"load": "20 t", "s_w": "100 m", "tip": "sine 1.5 m 6 s"}),
    "nov-100t-electric": ("brake slipping", {"load": "100 t", "s_w": "100 m", "tip": "sine 2 m 6 s"}),
}


@pytest.mark.parametrize("name", CASES)
def test_a_brake_that_carries_less_than_the_load_pulls_lets_the_wire_run_out_and_is_named(name: str) -> None:
    """It holds the load at rest and no swing of it; one of three times the torque holds both."""
    cause, case = CASES[name]
    runs = []
    for share in (1.001, 3.0):
        crane = changed(load_crane(name), {"brake": {"T": f"{share * holding_torque(load_crane(name))!r} N m"}})
        runs.append(simulate(crane, Scenario(**case, mode="manual", duration="40 s", warm_up="5 s")))
    paid_out = [float(run.s_w[-1] - run.s_w[0]) for run in runs]
    assert cause in runs[0].status.item().split(", ")
    assert paid_out[0] > 3.0 * HELD
    assert cause not in runs[1].status.item().split(", ")
    assert abs(paid_out[1]) < HELD
