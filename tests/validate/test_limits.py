"""Step 3: the winch with its pumps at their end, against cranes whose limits are known."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from tests.validate.ahc_logs import STEP, TWIN, campaign, record
from tests.validate.controller_logs import (
    TO_THE_LIMIT,
    ahc_log,
    bent,
    limits_log,
    limits_record,
    noisy,
    own_limits_log,
    without,
)

from stillhook.engine.pack.winch import gains
from stillhook.spec.scenario import Commands, Mode
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import Measure, StepNumber, Verdict
from stillhook.validate.report.figures import Curves, at_limits, over_time
from stillhook.validate.speed_limits import NEAR_LIMIT, check_limits

pytestmark = pytest.mark.slow

ALIKE = 1e-3  # share: the twin against itself; the log's wire is differentiated
ROUNDED = 0.01  # share: a plateau of a bent crane against what its flow alone would give; leakage goes with pressure


def checked(*records, twin=TWIN):
    return check_limits(campaign(*records, twin=twin), records, lambda share: None)


def found(step, name: str, way: str = "") -> Measure:
    (measure,) = [m for m in step.measures_of(name) if m.test == way]
    return measure


def lines(step):
    return {line.key: line for line in judge(campaign().criteria, step.measures, (StepNumber.LIMITS,))}


def with_pumps(scale: float, *, same_gains: bool = True):
    """The twin with larger or smaller active pumps, and with the gains of the twin or with those that go with the pumps."""
    pump = TWIN.active.pump
    active = TWIN.active.model_copy(update={"pump": pump.model_copy(update={"D": tuple(scale * D for D in pump.D)})})
    own = gains(TWIN)
    control = TWIN.control.model_copy(update={"K_1": own.K_1, "K_2": own.K_2} if same_gains else {})
    return TWIN.model_copy(update={"active": active, "control": control})


@functools.cache
def held_log(end: float) -> dict[str, np.ndarray]:
    """A crane whose PLC holds its pump command at this level."""
    own = own_limits_log()
    u_p = np.clip(own["u_p"], -end, end)
    commands = Commands(np.arange(len(u_p)) * STEP, u_p, own["u_m"])
    return limits_log(TWIN, commands=commands)


@functools.cache
def own_step():
    return checked(limits_record(own_limits_log()))


# --- a twin that is right -----------------------------------------------------------------------------------------------------------------------


def test_a_right_twin_reaches_the_cranes_speeds_and_saturates_with_it():
    step = own_step()
    for name in ("limit_speed_error", "limit_speed_error_whole"):
        for way in ("hoisting", "lowering"):
            assert abs(found(step, name, way).value) < ALIKE
    assert found(step, "saturation_overlap").value > 0.99
    log = own_limits_log()
    ends = (np.abs(log["u_p"]) > 0.995) | (
        np.abs(log["alpha_p"]) > 0.995
    )  # the setting leaves its end after the command
    assert found(step, "saturation_time").value == pytest.approx(np.sum(ends) * STEP, abs=STEP)
    assert not any(line.failed for line in lines(step).values())


def test_noise_of_the_wire_is_in_the_interval():
    log = own_limits_log()
    m = found(checked(limits_record(bent(log, s_w=noisy(log["s_w"], 5e-3)))), "limit_speed_error", "hoisting")
    assert m.low < 0.0 < m.high
    assert m.high - m.low < 0.02


# --- limits that are off -------------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [0.85, 1.2])
def test_a_twin_with_other_pumps_is_as_much_faster(scale):
    step = checked(limits_record(own_limits_log()), twin=with_pumps(scale))
    for way in ("hoisting", "lowering"):
        m = found(step, "limit_speed_error", way)
        assert m.value == pytest.approx(scale - 1.0, abs=ROUNDED)
        assert ("faster" if scale > 1.0 else "slower") in m.note
    assert lines(step)["4-speed"].verdict is Verdict.REFUTED


def test_a_plc_that_holds_its_command_lower_is_named():
    """The winch itself is right: only the whole twin, whose PLC goes on to full command, is too fast."""
    step = checked(limits_record(held_log(0.8)))
    assert abs(found(step, "limit_speed_error", "hoisting").value) < ALIKE
    assert found(step, "limit_speed_error_whole", "hoisting").value > 0.2
    said = "test limits: the PLC holds the pump command at 80 % in the log, at 100 % in the twin"
    assert f"Deviation: {said}." in step.statements
    assert said in lines(step)["4-speed-whole"].message
    assert lines(step)["4-speed-whole"].verdict is Verdict.REFUTED


def test_a_pump_that_stops_short_of_its_command_is_named():
    held, own = held_log(0.8), own_limits_log()
    step = checked(limits_record(bent(held, u_p=own["u_p"])))
    m = found(step, "limit_speed_error", "lowering")
    assert m.value == pytest.approx(0.25, abs=2 * ROUNDED)
    assert "the pumps' setting stops at 80 % in the log" in m.note
    assert lines(step)["4-speed"].verdict is Verdict.REFUTED


def test_motors_that_stand_elsewhere_are_named():
    log = own_limits_log()
    motor = TWIN.active.motor.model_copy(update={"variant": "open-loop-feedback", "offset": 0.1})
    crane = TWIN.model_copy(update={"active": TWIN.active.model_copy(update={"motor": motor})})
    commands = Commands(np.arange(len(log["u_p"])) * STEP, log["u_p"], log["u_m"])
    step = checked(limits_record(limits_log(crane, commands=commands)))
    assert "on the same command the motors are at" in found(step, "limit_speed_error", "hoisting").note


def test_a_twin_that_saturates_where_the_crane_does_not_is_said():
    """A crane with larger pumps in waves that the twin cannot follow."""
    log = ahc_log(with_pumps(1.6, same_gains=False), height=2.4, mode="level-1")
    assert np.abs(log["u_p"]).max() < 0.98
    step = checked(record(log, mode=Mode.LEVEL_1))
    assert found(step, "saturation_time").value is None
    overlap = found(step, "saturation_overlap")
    assert overlap.value < 0.5
    assert "the twin's pumps are saturated for" in overlap.note
    assert lines(step)["4-overlap"].verdict is Verdict.REFUTED


# --- data that show less ---------------------------------------------------------------------------------------------------------------------------


def test_a_calm_test_costs_no_run_of_the_twin_and_the_line_says_what_to_log():
    calm = record(ahc_log(TWIN, duration=60.0, height=1.0))
    assert np.abs(calm.signals["u_p"]).max() < NEAR_LIMIT
    step = checked(calm)
    assert not step.estimates.parts
    line = lines(step)["4"]
    assert (line.verdict, line.failed) == (Verdict.NOT_COVERED, True)
    assert "log hoisting and lowering with the joystick beyond the winch's limit" in line.message


def test_one_way_alone_is_shown_and_said():
    step = checked(limits_record(limits_log(TWIN, profile=TO_THE_LIMIT[:5])))
    assert [m.test for m in step.measures_of("limit_speed_error")] == ["hoisting"]
    assert "The limit when lowering is not shown." in step.statements


@pytest.mark.parametrize(
    ("lack", "driven", "complete", "words"),
    [
        (("v_op",), True, False, "v_op was not logged"),  # the winch needs the commands alone
        (("s_tip", "v_tip", "a_tip"), True, False, "s_tip was not logged"),
        (("u_m", "alpha_m"), False, True, "log u_m or alpha_m"),
        (("u_p",), False, False, "the pumps are never saturated"),
    ],
)
def test_the_twin_that_the_signals_allow_is_run_and_what_the_other_lacks_is_stated(lack, driven, complete, words):
    step = checked(without(limits_record(own_limits_log()), *lack))
    for name, runs in (("limit_speed_error", driven), ("limit_speed_error_whole", complete)):
        values = [m.value for m in step.measures_of(name)]
        assert all(abs(x) < ALIKE for x in values) if runs else values == [None]
    assert any(words in text for text in (*step.statements, *(m.note for m in step.measures)))
    assert lines(step)["4-speed"].failed is not driven
    assert not lines(step)["4-speed-whole"].failed


def test_a_stretch_that_begins_in_motion_waits_for_the_twin():
    log = own_limits_log()
    first = round(6.0 / STEP)  # in the middle of the hoisting plateau
    cut = limits_record({k: x[first:] for k, x in log.items()})
    step = checked(cut)
    hoisting = [p for p in step.estimates.plateaus if p.way > 0]
    assert not np.isfinite(hoisting[0].driven)
    assert abs(found(step, "limit_speed_error", "lowering").value) < ALIKE


def test_saturated_peaks_of_waves_count_as_well():
    step = checked(record(ahc_log(TWIN, height=4.5, seed=2)))
    assert found(step, "saturation_time").value > 2.0
    assert abs(found(step, "limit_speed_error", "hoisting").value) < 0.01
    assert found(step, "saturation_overlap").value > 0.95


# --- pictures ------------------------------------------------------------------------------------------------------------------------------------


def test_figures_are_marked_and_few():
    found_record = limits_record(own_limits_log())
    drawn = at_limits(own_step().estimates, campaign(found_record))
    assert set(drawn) == {"at-limits-1"}
    assert all(f._suptitle.get_text().startswith("SYNTHETIC") for f in drawn.values())
    none = replace(own_step().estimates, parts=(), plateaus=())
    assert not at_limits(none, campaign(found_record))


def test_what_does_not_vary_is_a_sentence_and_no_panel():
    t = np.linspace(0.0, 10.0, 101)
    wave, flat = Curves(t, np.sin(t)), Curves(t, np.full(101, 40.0), [("simulated", "red", np.full(101, 40.0))])
    columns = [("one", [wave, flat, flat]), ("two", [wave, flat, wave])]
    figure = over_time(campaign(), "Title", "Of tests.", columns, ["speed", "Pressure [bar]\n(A)", "angle"], (6.0, 6.0))
    assert len(figure.axes) == 4
    assert figure.get_label() == "Of tests. Not drawn, because it does not vary: pressure [bar]."
    assert [[text.get_text() for text in ax.texts] for ax in figure.axes] == [[], [], ["40 throughout"], []]
    assert sum(bool(ax.lines) for ax in figure.axes) == 3
