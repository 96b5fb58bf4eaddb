"""Step 2: the simulated PLC over logged inputs, against cranes whose control settings are known."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from tests.validate.ahc_logs import STEP, TWIN, campaign, record, sea
from tests.validate.controller_logs import (
    NAMES,
    UNDER_WAY,
    ahc_log,
    bent,
    later,
    limits_log,
    limits_record,
    noisy,
    own_ahc_log,
    own_limits_log,
    with_control,
    without,
)

from stillhook import Scenario, simulate
from stillhook.control.plc import MANUAL, Memory
from stillhook.engine.pack.winch import active_record, gains, plc_record
from stillhook.kernels import plc_alone as plc
from stillhook.kernels.lanes import flatten, unflatten
from stillhook.kernels.plc_alone import PlcInputs, plc_alone
from stillhook.spec.scenario import Mode, Operator
from stillhook.validate.controller.check import check_controller
from stillhook.validate.controller.inputs import plc_segments
from stillhook.validate.controller.law import SMOOTH, Run, law
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import Measure, StepNumber, Verdict

pytestmark = pytest.mark.slow

EXACT = 1e-9  # of full command: the PLC's own inputs give its own commands; the first second of a log has an unknown load filter
GAIN = 2e-3  # share by which a gain told from a log without noise may be off: smoothing and the load filter's start
OWN = gains(TWIN)


def checked(*records, twin=TWIN):
    return check_controller(campaign(*records, twin=twin), records, lambda share: None)


def found(step, name: str, test: str = "") -> Measure:
    (measure,) = [m for m in step.measures_of(name) if m.test == test]
    return measure


def lines(step, *records):
    return {line.key: line for line in judge(campaign(*records).criteria, step.measures, (StepNumber.CONTROLLER,))}


@functools.cache
def own_step():
    return checked(record(own_ahc_log()), limits_record(own_limits_log()))


# --- the PLC alone ---------------------------------------------------------------------------------------------------------------------------


def test_the_plc_over_its_own_inputs_gives_its_own_commands():
    (segment,) = plc_segments(TWIN, record(own_ahc_log()))
    told = segment.simulated_commands(TWIN)
    late = slice(500, None)
    assert np.abs(told.u_p - segment.u_p)[late].max() < EXACT
    assert np.abs(told.u_m - segment.u_m)[late].max() < 1e-4  # the load filter's start reaches the least displacement


def test_the_compiled_plc_is_the_readable_one():
    x = own_ahc_log()
    n = 300
    seen = PlcInputs(
        *(x[k][:n] for k in ("s_tip", "v_tip", "a_tip", "v_op")),
        np.zeros(n),
        x["mode"][:n],
        np.ones(n),
        x["s_w"][:n],
        x["F_w"][:n],
        x["alpha_m"][:n],
        np.full(n, 1.3),
        *np.zeros((5, n)),
        np.where(np.arange(n) // 50 == 2, 1.0, 0.0),
        np.full(n, 0.05),
    )
    memory = Memory(MANUAL, 487.0, 1e6, 0.0, 0.1, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0)  # a mode change at the first cycle
    settings = plc_record(TWIN)
    settings, control = settings._replace(brake=settings.brake._replace(fitted=0.0)), active_record(TWIN).control
    told, last, _ = plc_alone(seen, np.zeros(n), memory, settings, control, {})
    bound, plain = plc.kernel(()), np.empty((n, len(told)))
    lane = np.array(flatten(bound.Lane(memory, bound.laws.blank({}), settings, control)))
    python = getattr(bound.run, "py_func", bound.run)
    python(lane, np.column_stack([*seen, np.zeros(n)]).reshape(-1), plain.reshape(-1), n)
    assert unflatten(bound.Lane, iter(lane.tolist())).m == last
    assert np.array_equal(plain.T, np.array(told))


def test_a_plc_without_feedback_of_the_motors_reckons_with_its_command():
    motor = TWIN.active.motor.model_copy(update={"variant": "open-loop", "offset": 0.08})
    crane = TWIN.model_copy(update={"active": TWIN.active.model_copy(update={"motor": motor})})
    step = checked(record(ahc_log(crane)), twin=crane)
    assert found(step, "u_p_deviation", "test 1").value < 1e-4
    assert (
        checked(record(ahc_log(crane))).measures_of("u_p_deviation")[0].value > 0.01
    )  # a twin in closed loop would ask for more


# --- a twin that is right -----------------------------------------------------------------------------------------------------------------------


def test_a_right_twin_meets_every_criterion_of_the_controller():
    assert not any(line.failed for line in lines(own_step()).values())
    for name in ("K_1_deviation", "K_2_deviation", "K_p_deviation"):
        assert abs(found(own_step(), name).value) < GAIN
    assert abs(found(own_step(), "command_lag").value) < 1e-5
    assert found(own_step(), "u_p_deviation", "test 1").value < 1e-4


def test_the_winch_at_its_limit_is_compared_as_held():
    manual = [d for d in own_step().estimates.deviations if not d.ahc and d.signal == "u_p"]
    assert manual[0].test == "limits"
    assert manual[0].high.value < 1e-3


def test_starts_from_the_brake_are_not_held_against_the_twin():
    """Behind a closed brake the pumps follow pressures that a log need not hold, and its opening leaves a difference
    that fades for seconds."""
    (segment,) = plc_segments(TWIN, limits_record(own_limits_log()))
    bare = replace(segment, seen=segment.seen._replace(braked=np.zeros_like(segment.seen.braked)))
    apart, without_mark = (np.abs(s.simulated_commands(TWIN).u_p - s.u_p).max() for s in (segment, bare))
    assert without_mark > 0.1
    assert apart < EXACT * 1e6  # the joystick's last command stays for a cycle as the winch comes to rest
    t, brake = np.arange(len(segment.u_p)) * STEP, TWIN.brake
    for rest, start in ((0.0, 3.0), (15.0, 18.0)):
        braked = t[(segment.seen.braked > 0.0) & (t >= rest) & (t < start + 5.0)]
        assert braked[0] <= rest + brake.t_wait + 2 * STEP
        assert start + brake.t_open <= braked[-1] <= start + brake.t_open + brake.t_prove
    crane = TWIN.model_copy(update={"brake": None})
    (free,) = plc_segments(crane, limits_record(own_limits_log()))
    assert not free.seen.braked.any()


def test_noise_in_the_log_alone_widens_the_intervals_until_they_hold_the_truth():
    x, held, seeds = own_ahc_log(), 0, 8
    for seed in range(seeds):
        sds = {"s_tip": 2e-3, "v_tip": 5e-3, "a_tip": 0.1, "s_w": 1e-3, "e_c_measured": 2e-3}
        log = bent(x, **{name: noisy(x[name], sd, 10 * seed + k) for k, (name, sd) in enumerate(sds.items())})
        (segment,) = plc_segments(TWIN, record(log))
        implied = law([Run(segment, segment.simulated_commands(TWIN))], input_noise=True)
        held += sum(
            abs(getattr(implied, name).value - getattr(OWN, name)) <= getattr(implied, name).half
            for name in OWN._fields
        )
        assert implied.K_1.half < 0.01 * OWN.K_1
    assert held >= 3 * seeds - 4  # of 24 intervals of 95 %, four or more miss in one case of 30


def test_smoothing_both_sides_keeps_a_noisy_acceleration_from_hiding_its_gain():
    x = own_ahc_log()
    log = bent(x, a_tip=noisy(x["a_tip"], 0.3))  # twice the signal: raw regression would find a fifth of the gain
    (segment,) = plc_segments(TWIN, record(log))
    implied = law([Run(segment, segment.simulated_commands(TWIN))])
    assert implied.K_2.value == pytest.approx(OWN.K_2, rel=0.15)
    assert SMOOTH[0] == 1.0


# --- settings that are off, one at a time -----------------------------------------------------------------------------------------------------


def test_the_printed_k_1_is_found_and_named():
    step = checked(record(ahc_log(with_control(TWIN, K_1=0.68, K_2=OWN.K_2))))
    m = found(step, "K_1_deviation")
    assert m.value == pytest.approx(0.68 / OWN.K_1 - 1.0, abs=GAIN)
    assert m.note == "K_1 0.68 s/m in the log's commands, 0.828 s/m in the crane file (-18 %)"
    assert f"Deviation: {m.note}." in step.statements
    said = lines(step)
    assert said["3-K_1"].verdict is Verdict.REFUTED
    assert said["3-pump"].verdict is Verdict.REFUTED
    assert m.note in said["3-pump"].message
    assert not said["3-K_p"].failed


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "factor"), [("K_2", 0.6), ("K_p", 1.5)])
def test_a_gain_that_is_off_is_found_to_its_interval(name, factor):
    changed = {"K_1": OWN.K_1, "K_2": OWN.K_2, "K_p": OWN.K_p, name: factor * getattr(OWN, name)}
    step = checked(record(ahc_log(with_control(TWIN, **changed))), limits_record(own_limits_log()))
    m = found(step, f"{name}_deviation")
    assert m.value == pytest.approx(factor - 1.0, abs=0.01)
    assert f"{name} " in m.note
    assert lines(step)[f"3-{name}"].verdict is Verdict.REFUTED


@pytest.mark.parametrize(
    ("crane", "mode", "off"), [(with_control(TWIN, u_thr=0.5), Mode.SSC, -0.1), (TWIN, Mode.SSC_CUBIC, 0.0)]
)
def test_the_threshold_of_either_law_is_found_and_named_where_it_is_off(crane, mode, off):
    step = checked(record(ahc_log(crane, mode=mode.value), mode=mode))
    m = found(step, "u_thr_difference")
    assert m.value == pytest.approx(off, abs=2e-3)
    if off:
        assert m.note == "u_thr 0.5 in the log's motor commands, 0.6 in the crane file"
        assert lines(step)["3-u_thr"].verdict is Verdict.REFUTED


def test_calm_seas_say_nothing_of_the_threshold():
    step = checked(record(ahc_log(TWIN, height=0.6)))
    line = lines(step)["3-u_thr"]
    assert (line.measure.value, line.verdict, line.failed) == (None, Verdict.NOT_COVERED, False)


def test_a_log_in_another_mode_than_it_says_is_named():
    step = checked(record(ahc_log(TWIN, mode="ns")))
    assert 'Deviation: test 1: the motor command follows mode "ns", the log says "ssc".' in step.statements
    assert lines(step)["3-motor"].verdict is Verdict.REFUTED


def test_another_setting_of_normal_speed_is_named():
    """0.7 for 0.8, at this wire."""
    step = checked(record(ahc_log(with_control(TWIN, alpha_ns=0.7), mode="ns", height=1.0), mode=Mode.NS))
    assert "Deviation: test 1, mode ns: motors commanded to 0.673, by the crane file to 0.769." in step.statements


def test_a_wrong_layer_shows_as_a_k_1_that_differs_between_wire_lengths():
    drum = TWIN.drum.model_copy(
        update={"d": 1.08 * TWIN.drum.d}
    )  # the inner layers come out too wide, the outer ones less so
    twin = TWIN.model_copy(update={"drum": drum})
    records = record(ahc_log(TWIN, s_w=300.0), name="short"), record(ahc_log(TWIN, s_w=2300.0), name="long")
    step = checked(*records, twin=twin)
    for name in ("K_1", "K_p"):
        note = found(step, f"{name}_deviation").note
        assert "in test short" in note
        assert "the layer used for K_wire" in note


# --- order of the rows, and clocks -----------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize("cycles", [-1, 1, 2])
def test_commands_of_another_cycle_in_a_row_are_found_by_the_joystick_and_set_right(cycles):
    manual = limits_log(TWIN, profile=UNDER_WAY)
    a, b = (bent(x, u_p=later(x["u_p"], cycles), u_m=later(x["u_m"], cycles)) for x in (own_ahc_log(), manual))
    a["v_tip"] = noisy(a["v_tip"], 2e-3)  # of the log alone
    step = checked(record(a), limits_record(b))
    assert step.estimates.rows.cycles == cycles
    assert found(step, "command_lag").value == pytest.approx(cycles * STEP, abs=2e-4)
    assert step.estimates.rows.evidence == "joystick"
    assert found(step, "u_p_deviation", "test 1").value < 5e-3  # that noise
    assert abs(found(step, "K_2_deviation").value) < 0.01
    assert not lines(step)["3-lag"].failed
    word = "later" if cycles > 0 else "earlier"
    assert any(word in text and "they are compared with this shift" in text for text in step.statements)


def test_noise_that_both_sides_carry_shows_the_order_of_the_rows():
    """The very numbers that the PLC read: its commands repeat their noise, and no joystick is needed."""
    x = own_ahc_log()
    log = bent(x, v_tip=noisy(x["v_tip"], 5e-3))
    (segment,) = plc_segments(TWIN, record(log))
    told = segment.simulated_commands(TWIN)
    step = checked(record(bent(log, u_p=later(told.u_p, 1), u_m=later(told.u_m, 1))))
    assert (step.estimates.rows.cycles, step.estimates.rows.evidence) == (1, "fine")


def test_a_tip_that_is_not_the_plcs_own_fails_by_its_lag():
    x = own_ahc_log()
    log = bent(x, **{k: later(x[k], 15) for k in ("s_tip", "v_tip", "a_tip")})
    step = checked(record(log), limits_record(own_limits_log()))
    m = found(step, "command_lag")
    assert m.value == pytest.approx(-0.15, abs=5e-3)
    assert m.low < -0.15 < m.high
    assert "the tip's motion in the log is 15" in m.note
    said = lines(step)
    assert said["3-lag"].verdict is Verdict.REFUTED
    assert said["3-pump"].verdict is Verdict.REFUTED
    assert abs(found(step, "K_1_deviation").value) < 0.01  # told with the lag set right


# --- logs with less in them -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words", "most"),
    [
        (
            lambda x: {"v_tip": None, "a_tip": None, "s_tip": noisy(x["s_tip"], 2e-3)},
            "v_tip was not logged: derivative of s_tip",
            0.03,
        ),
        (lambda x: {"e_c_measured": None}, "the wire's reference is a constant", 5e-3),  # K_p times a standing error
        (lambda x: {"alpha_m": None, "u_m": None}, "neither alpha_m nor u_m was logged", 0.05),
    ],
)
def test_what_was_not_logged_is_made_up_and_stated(change, words, most):
    step = checked(record(bent(own_ahc_log(), **change(own_ahc_log()))))
    assert any(words in text for text in step.statements)
    assert found(step, "u_p_deviation", "test 1").value < most
    assert abs(found(step, "K_1_deviation").value) < 0.005
    if "u_m" in words:
        assert found(step, "u_m_deviation").value is None
        assert lines(step)["3-motor"].failed


@functools.cache
def started_log() -> dict[str, np.ndarray]:
    """Compensation that is switched on 15 s after the log begins, with the joystick pulled a little."""
    operator = Operator(profile=(("0 s", "10 m/min"), ("60 s", "10 m/min")))
    case = Scenario(
        load="90 t",
        s_w="487 m",
        tip=sea(3, 1.5),
        mode="manual",
        modes=(("15 s", "ssc"),),
        duration="80 s",
        operator=operator,
    )
    run = simulate(TWIN, case, every="10 ms")
    return {name: run[name].values.copy() for name in NAMES}


@pytest.mark.parametrize(("lack", "first"), [((), 1500), (("e_c_measured",), 1500), (("e_c_measured", "mode"), 1510)])
def test_a_start_of_compensation_is_followed_with_its_bumpless_commands(lack, first):
    """The segments of a log begin where compensation does: the PLC then starts from the commands that were before."""
    log = bent(started_log(), **dict.fromkeys(lack))
    (segment,) = plc_segments(TWIN, record(log, parts=((first, len(log["s_w"])),)))
    counts = segment.within(segment.parts[0])
    apart = np.abs(segment.simulated_commands(TWIN).u_p - segment.u_p)[counts]
    if "mode" in lack:
        assert apart.max() > 0.01  # nothing tells that compensation has just begun
        assert any("a constant that makes the mean error zero" in note for note in segment.notes)
    else:
        assert apart.max() < 1e-3
        assert any("set where compensation starts" in note for note in segment.notes) == bool(lack)


def test_holes_in_signals_that_matter_little_part_nothing():
    x = own_ahc_log()
    F_w, e_c = x["F_w"].copy(), x["e_c_measured"].copy()
    F_w[5000:7000] = np.nan
    e_c[3000:3100] = np.nan
    (segment,) = plc_segments(TWIN, record(bent(x, F_w=F_w, e_c_measured=e_c)))
    assert np.abs(segment.simulated_commands(TWIN).u_p - segment.u_p)[500:].max() < 1e-3


def test_a_set_point_that_was_moved_is_taken_from_the_logged_error():
    x = own_ahc_log()
    step_by = np.where(np.arange(len(x["s_w"])) > len(x["s_w"]) // 2, 0.5, 0.0)
    log = bent(x, e_c_measured=x["e_c_measured"] + step_by, u_p=x["u_p"] - OWN.K_p * step_by)
    step = checked(record(log))
    assert any("its set-point is taken from the logged error" in text for text in step.statements)
    assert found(step, "u_p_deviation", "test 1").value < 1e-3


def test_a_motor_that_the_operator_holds_is_seen():
    step = checked(record(own_ahc_log()), limits_record(limits_log(TWIN, alpha_m=0.9)))
    assert "Test limits: the operator holds the motors at 0.900." in step.statements
    assert all(d.high.value < 1e-3 for d in step.estimates.deviations if not d.ahc)


@pytest.mark.parametrize("lack", ["u_p", "s_w"])
def test_a_log_without_command_or_wire_is_a_no_that_says_what_to_log(lack):
    records = (without(record(own_ahc_log()), lack),)
    step = check_controller(campaign(*records), records, lambda share: None)
    assert step.measures_of("u_p_deviation")[0].value is None
    assert f"{lack} not logged" in step.statements[0]
    assert "log s_tip, s_w and u_p" in step.statements[0]
    assert lines(step)["3-pump"].failed


def test_a_gap_parts_the_stretches_and_both_count():
    x = own_ahc_log()
    u_p = x["u_p"].copy()
    u_p[6000:8000] = np.nan
    found_parts = plc_segments(TWIN, record(bent(x, u_p=u_p)))
    assert [(s.first, s.last) for s in found_parts] == [(0, 6000), (8000, len(u_p))]
    assert all(np.abs(s.simulated_commands(TWIN).u_p - s.u_p)[500:].max() < 1e-3 for s in found_parts)


# --- pictures ------------------------------------------------------------------------------------------------------------------------------------
