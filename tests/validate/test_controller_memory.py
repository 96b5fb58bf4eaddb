"""Step 2 with controllers and a prediction that remember: the simulated PLC repeats the commands of a log once what it
remembers no longer depends on what was before the log, and says where that never is."""

from dataclasses import replace

import numpy as np
import pytest
from tests.validate.ahc_logs import STEP, TWIN, record, sea
from tests.validate.controller_logs import NAMES, without
from tests.validate.test_controller import EXACT, checked, found

from stillhook import Scenario, simulate
from stillhook.library import changed
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode
from stillhook.validate.controller.inputs import SAME, plc_segments
from stillhook.validate.controller.law import Run, law
from stillhook.validate.data_set.record import Record

pytestmark = pytest.mark.slow

SIGNALS = (*NAMES, "p_a", "p_b", "omega_m", "p_hp", "alpha_pm")
UNDER_WAY = 60.0  # s in which controller and prediction have learned the sea before the log begins
CHANGED = 20.0  # s of the log in SSC, before another controller comes into force in it
LEADS = {"t_lead": "0.2 s", "t_lead_ff": "0.25 s"}
LEARNED = 5e-3
"""Of full command: a log begins in motion, the simulated pumps of `ff` at rest, and what is learned from their first
second fades with 30 s."""


def logged(crane: Crane, mode: str, *, within: bool = False, duration: float = 100.0) -> Record:
    """A log under way; within: of SSC at first, then of `mode`."""
    modes = (("0 s", "ssc"), (f"{UNDER_WAY + CHANGED} s", mode)) if within else ()
    case = Scenario(
        load="90 t",
        s_w="487 m",
        tip=sea(1, 1.6),
        mode=mode,
        modes=modes,
        duration=f"{UNDER_WAY + duration} s",
    )
    run = simulate(crane, case, every="10 ms")
    log = {name: run[name].values[round(UNDER_WAY / STEP) :].copy() for name in SIGNALS}
    if not within:
        return record(log, mode=Mode(mode))
    at, n = round(CHANGED / STEP), len(log["s_w"])
    of = record(log, parts=((0, at), (at, n)))
    return replace(of, segments=(of.segments[0], replace(of.segments[1], mode=Mode(mode))))


PREDICTING = changed(TWIN, {"control": LEADS | {"prediction": {"kind": "modes"}}})


def apart(crane: Crane, of: Record) -> tuple[np.ndarray, np.ndarray]:
    """Difference of the pump commands, and the samples that count."""
    (s,) = plc_segments(crane, of)
    known = np.ones(len(s.u_p), bool) if s.settled is None else s.settled
    return np.abs(s.simulated_commands(crane).u_p - s.u_p), known


@pytest.mark.parametrize("crane", [TWIN, PREDICTING])
@pytest.mark.parametrize("mode", ["ssc", "ssc-optimal", "rope"])
def test_the_commands_of_a_log_are_repeated_once_the_start_is_forgotten(crane, mode):
    difference, known = apart(crane, logged(crane, mode, duration=240.0 if mode == "rope" else 100.0))  # comes in late
    assert known.mean() > 0.5
    assert difference[known].max() < 2.0 * SAME
    assert difference[-1000:].max() < 1e-3
    if mode == "ssc" and crane is TWIN:
        assert difference[500:].max() < EXACT


def test_the_gains_of_a_plc_that_predicts_are_those_of_its_crane_file_and_not_those_of_one_that_extrapolates():
    of = logged(PREDICTING, "ssc", duration=200.0)
    step = checked(of, twin=PREDICTING)
    for gain, share in (("K_1", 1e-3), ("K_2", 5e-3), ("K_p", 0.03)):
        assert found(step, f"{gain}_deviation").value == pytest.approx(0.0, abs=share)
    assert found(step, "u_p_deviation", "test 1").value < SAME
    assert "reference moves" not in "\n".join(map(str, step.statements))
    plain = changed(TWIN, {"control": LEADS})
    (s,) = plc_segments(plain, of)
    extrapolated = law([Run(s, s.simulated_commands(plain))])
    assert abs(extrapolated.K_1.value / s.plc.gains.K_1 - 1.0) > 5e-3


def test_a_controller_that_learns_is_repeated_where_it_comes_into_force_in_the_log():
    difference, known = apart(TWIN, logged(TWIN, "ff", within=True))
    assert difference[known].max() < LEARNED
    assert known.all()


def test_a_controller_that_has_learned_before_the_log_is_named_and_not_judged():
    step = checked(logged(TWIN, "ff"))
    assert step.measures_of("u_p_deviation")[0].value is None
    assert "ff is in force as the log begins" in "\n".join(map(str, step.statements))


def test_a_controller_that_learns_is_not_judged_without_the_pressures_that_it_learns_from():
    of = without(logged(TWIN, "ff", within=True), "p_b", "alpha_pm")
    step = checked(of)
    assert "p_b, alpha_pm" in "\n".join(map(str, step.statements))
    (s,) = plc_segments(TWIN, of)
    assert s.modes == {"ssc"}
