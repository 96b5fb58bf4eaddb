"""Step 6: what logs say of the passive circuit, with cranes and logs whose differences from the twin are known."""

import functools
import re
from dataclasses import replace

import pytest
from tests.validate.ahc_logs import TWIN, campaign, record, sea
from tests.validate.passive_logs import SENSORS, checked, dead, lines, records, with_noise

from stillhook import Scenario, load_crane, simulate
from stillhook.library import changed, cranes
from stillhook.spec.scenario import Operator
from stillhook.validate.criteria.results import StepNumber, Verdict
from stillhook.validate.validation import STEPS

pytestmark = pytest.mark.slow

GOOD, BAD = Verdict.SHOWN, Verdict.REFUTED
ALL = tuple(SENSORS)
JUDGED = ("6-precharge", "6-gas", "6-piston", "6-stroke", "6-stroke-end", "6-motors", "6-torque", "6-setting")
SHARP = 0.02
"""What a number of a crane that is its own twin may be off by [-]: a third of one motor of sixteen."""


def other(**passive):
    """The crane file with other numbers in its passive circuit; the inertia follows the motors."""
    motors = passive.get("motor", {}).get("count", 16)
    return changed(TWIN, {"passive": passive, "inertia": {"J_m_eff": f"{4.1 + 0.036 * (motors - 16):.4g} kg m^2"}})


@functools.cache
def own():
    """The twin as its own crane, with the signals of a usual log."""
    return checked(records())


def found(step, name):
    return max((m.value for m in step.measures_of(name)), key=abs)


def note(step, name):
    return step.measures_of(name)[0].note


def refuted(step):
    return {key for key, line in lines(step).items() if line.verdict is BAD}


# --- a twin that is the crane ---------------------------------------------------------------------------------------------------------------


def test_a_twin_that_is_the_crane_is_shown_in_every_line_whose_signals_are_logged():
    verdicts = {key: line.verdict for key, line in lines(own()).items()}
    assert {verdicts[key] for key in JUDGED} == {GOOD}


@pytest.mark.parametrize(
    "name", ["precharge_error", "gas_volume_error", "passive_motors_error", "passive_setting_error"]
)
def test_measures_of_a_twin_that_is_the_crane_are_none(name):
    (m,) = own().measures_of(name)
    assert abs(m.value) < SHARP
    assert m.low < m.value < m.high


def test_the_piston_costs_the_pressure_that_the_file_says():
    assert abs(found(own(), "piston_loss_difference")) < 0.5e5


def test_the_logged_place_of_the_piston_gives_the_precharge_itself():
    step = checked(records(names=ALL))
    assert abs(found(step, "precharge_error")) < 0.002
    assert "carried to mid stroke by V_acc" in step.measures_of("precharge_error")[0].note


# --- what passed before, and must not ---------------------------------------------------------------------------------------------------


def test_310_bar_in_the_file_where_the_log_shows_280_is_refuted_and_named():
    step = checked(records(), other(accumulator={"gas": {"p_0": "310 bar"}}))
    assert refuted(step) == {"6-precharge"}
    assert "precharge 279 bar, 310 bar in the crane file" in note(step, "precharge_error").replace("278.9", "279")


def test_9_m3_of_gas_in_the_file_where_there_are_5_is_refuted_and_named():
    step = checked(records(), other(accumulator={"gas": {"V_0": "9 m^3"}}))
    assert refuted(step) == {"6-gas"}
    assert re.search(r"gas volume (49[0-9]|50[0-9])0 L at n 1.3, 9000 L", note(step, "gas_volume_error"))
    assert "no n of nitrogen (here 2.35) makes it the file's volume" in note(step, "gas_volume_error")


@pytest.mark.parametrize(
    ("working", "count", "keys", "words"),
    [
        (14, 16, {"6-motors", "6-torque"}, "14.0 of 16 motors work: 2 dead; the PLC assumes all"),
        (13, 16, {"6-motors", "6-torque"}, "13.0 of 16 motors work: 3 dead; the PLC assumes all"),
        (16, 14, {"6-motors", "6-torque", "6-setting"}, "16.0 motors, not 14: the PLC also uses 16, so the number"),
        (16, 18, {"6-motors", "6-torque", "6-setting"}, "16.0 motors, not 18: the PLC also uses 16, so the number"),
    ],
)
def test_dead_motors_are_refuted_and_told_from_a_wrong_number_in_the_file(working, count, keys, words):
    spoil = {"spoil": dead(16 - working)} if working < 16 else {}
    step = checked(records(**spoil), other(motor={"count": count}) if count != 16 else TWIN)
    assert refuted(step) == keys
    (m,) = step.measures_of("passive_motors_error")
    assert words in m.note
    assert m.low < working / count - 1.0 < m.high


def test_a_load_cell_that_reads_wrong_is_not_counted_as_dead_motors():
    step = checked(records(spoil=lambda log: log | {"F_w": 0.9 * log["F_w"]}))
    (m,) = step.measures_of("passive_motors_error")
    assert m.low < -0.1  # either is possible until the load cell is right
    assert m.high > 0.0
    assert "14.4 motors by the cell, 16 by the stated load; correct load cell or load first" in m.note


def test_a_gas_that_is_stiffer_within_what_heat_exchange_explains_is_not_refuted():
    step = checked(records(other(accumulator={"gas": {"n": 1.6}})))
    assert refuted(step) == set()
    assert found(step, "gas_volume_error") == pytest.approx(1.3 / 1.6 - 1.0, abs=SHARP)


def test_a_piston_that_reaches_an_end_which_the_file_does_not_have_is_named():
    step = checked(records(other(accumulator={"V_stroke": "0.1 m^3"})))
    assert "6-stroke-end" in refuted(step)
    assert "as with a piston at its end" in step.measures_of("stroke_end_time")[0].note


def test_a_stroke_in_the_file_that_the_piston_goes_beyond_is_refuted():
    step = checked(records(names=ALL), other(accumulator={"V_stroke": "0.06 m^3"}))
    assert "6-stroke" in refuted(step)


def test_lost_gas_behind_a_held_pressure_shows_where_the_place_of_the_piston_is_logged():
    """Make-up holds 280 bar with 300 L more oil behind the piston: at mid stroke the gas has 258 bar."""
    step = checked(records(names=ALL, spoil=lambda log: log | {"V_acc": log["V_acc"] + 0.3}))
    assert refuted(step) == {"6-precharge"}
    (m,) = step.measures_of("precharge_error")
    assert m.value == pytest.approx((4.7 / 5.0) ** 1.3 - 1.0, abs=0.005)
    assert "280 bar in the crane file; carried to mid stroke by V_acc" in m.note


def test_the_piston_tells_dead_motors_from_a_load_cell():
    """Dead motors move no oil; behind a wrong load cell the motors move as much as ever."""
    fewer = dead(2)

    def spoil(log):
        mean = log["V_acc"].mean()
        return fewer(log) | {"V_acc": mean + 0.875 * (log["V_acc"] - mean)}

    assert found(checked(records(names=ALL, spoil=spoil)), "passive_flow_error") == pytest.approx(-0.125, abs=SHARP)
    cell = checked(records(names=ALL, spoil=lambda log: log | {"F_w": 0.875 * log["F_w"]}))
    assert abs(found(cell, "passive_flow_error")) < SHARP
    assert "6-flow" not in refuted(cell)


# --- what the data cannot tell -------------------------------------------------------------------------------------------------------------


def test_without_the_signals_every_line_says_what_to_log():
    left = tuple(n for n in SENSORS if n not in ("p_hp", "alpha_pm", "alpha_pp", "V_acc"))
    step = checked(records(names=left))
    assert {line.verdict for line in lines(step).values()} == {Verdict.NOT_COVERED}
    assert all("log " in m.note for m in step.measures)


def test_a_crane_without_a_passive_circuit_gets_one_statement():
    crane = next(c for c in map(load_crane, cranes()) if c.passive is None)
    mine = replace(campaign(*records(), twin=TWIN), crane=crane)
    step = STEPS[StepNumber.PASSIVE].take(StepNumber.PASSIVE, mine, records(), lambda share: None)
    (text,) = step.statements
    assert text.startswith("Step 6 is not judged: ")
    assert step.measures == ()


# --- make-up, in a run where the operator's motion asks much of it ---------------------------------------------------------------------


@functools.cache
def hoisting():
    """Heave compensation with an operator who hoists and lowers: make-up replaces the oil of the way."""
    points = [("0 s", "0 m/s"), ("80 s", "0 m/s")]
    for i, v in enumerate((0.12, -0.12, 0.08, -0.08)):
        points += [(f"{85 + 40 * i} s", f"{v} m/s"), (f"{110 + 40 * i} s", f"{v} m/s"), (f"{115 + 40 * i} s", "0 m/s")]
    case = Scenario(
        load="90 t", s_w="487 m", tip=sea(1, 1.0), mode="ssc", duration="260 s", operator=Operator(profile=points)
    )
    run = simulate(TWIN, case, every="10 ms")
    return {name: run[name].values for name in SENSORS}


def made_up(spoil=lambda log: log):
    one = record(with_noise(spoil(dict(hoisting())), 0, ALL), name="1", load=90e3)
    return checked((one,))


def test_make_up_of_a_crane_that_is_its_twin_follows_its_law():
    step = made_up()
    assert abs(found(step, "make_up_error")) < 0.1
    assert lines(step)["6-make-up"].verdict is GOOD


def test_make_up_with_half_the_gain_is_refuted():
    step = made_up(lambda log: log | {"alpha_pp": 0.5 * log["alpha_pp"]})
    assert found(step, "make_up_error") == pytest.approx(-0.5, abs=0.1)
    assert lines(step)["6-make-up"].verdict is BAD
