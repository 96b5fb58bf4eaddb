"""The friction of a winch that compensates, followed on the rows of its PLC."""

import re
from functools import cache

import numpy as np
import pytest
from tests.signers import signed

import stillhook
from stillhook.engine.certificate import NO_CERTIFICATE
from stillhook.errors import IdentifyError
from stillhook.kernels.build import results_hash
from stillhook.library import load_crane
from stillhook.live.estimate import Accuracies, FrictionEstimator, follow_friction, friction
from stillhook.live.estimate.accuracy import half_width
from stillhook.live.estimate.friction import NO_CLOCK
from stillhook.live.estimate.half_waves import LONGEST
from stillhook.physics.hydraulics.accumulator import accumulator_pressure
from stillhook.spec.crane import content
from stillhook.spec.validity import Certified

LOGGED = ("s_tip", "s_w", "omega_m", "p_a", "p_b", "p_hp", "alpha_m", "alpha_pm", "alpha_p", "u_p", "F_w", "mode")
CRANE = load_crane("nov-250t")
LIKE_ANOTHER_LAG = 0.01
"""Relative: the twin's load cell has no lag, the estimator takes one of 50 ms for granted; it is as much as its limit of
error, within which the interval is."""
SAME = 0.02
"""Part of the interval by which an estimate may depend on how rows come: the first search of the clock sees more rows or
fewer."""
WORN = 1.2


def worn(crane: stillhook.Crane, factor: float) -> stillhook.Crane:
    """The crane with so many times its system friction."""
    y = crane.friction.system
    more = y.model_copy(update={n: factor * getattr(y, n) for n in ("Y_1", "Y_2", "Y_3", "Y_5", "Y_6")})
    return crane.model_copy(update={"friction": crane.friction.model_copy(update={"system": more})})


@cache
def rows(
    name: str = "nov-250t", factor: float = WORN, duration: int = 150, period: float = 9.0
) -> dict[str, np.ndarray]:
    """What the PLC of the twin logs every 20 ms."""
    case = stillhook.Scenario(
        load="60 t",
        s_w="800 m",
        mode="ssc",
        duration=f"{duration} s",
        tip=stillhook.Sine(height="1.6 m", period=f"{period} s"),
    )
    run = stillhook.simulate(worn(load_crane(name), factor), case, every="0.02 s")
    return {"time": run.time.values, **{n: run[n].values for n in LOGGED if n in run}}


def last(x: dict[str, np.ndarray], crane: stillhook.Crane = CRANE, every: float = 10.0, **options: object):
    return follow_friction(FrictionEstimator(crane, **options), x, every)[-1]


def late_encoder(x: dict[str, np.ndarray], seconds: float) -> dict[str, np.ndarray]:
    """The rows with the values that the encoder had so much earlier."""
    t = x["time"]
    return {n: np.interp(t - seconds, t, v) if n in ("omega_m", "s_w") else v for n, v in x.items()}


@pytest.mark.long
@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-pure-active"])
def test_a_worn_twin_has_the_friction_that_it_was_given(name):
    found = last(rows(name), load_crane(name)).estimate
    assert found.system.value == pytest.approx(WORN, rel=LIKE_ANOTHER_LAG)
    assert found.system.contains(WORN)
    assert 1.0 < found.loss.value < WORN


@pytest.mark.long
@pytest.mark.parametrize("clock", [-0.2, -0.03, 0.2])
def test_the_offset_of_the_encoder_is_found_and_changes_nothing(clock):
    right, off = last(rows()).estimate, last(late_encoder(rows(), clock)).estimate
    assert off.clock.offset - right.clock.offset == pytest.approx(clock, abs=2.0 * off.clock.u)
    assert off.loss.value == pytest.approx(right.loss.value, abs=0.1 * right.loss.half)


@pytest.mark.long
def test_a_clock_that_cannot_be_found_widens_the_interval():
    blind = {n: v for n, v in rows().items() if n not in ("alpha_p", "u_p")}
    found, known = last(blind).estimate, last(rows()).estimate
    assert not found.clock.found
    assert last(blind).reasons == (NO_CLOCK,)
    assert found.limits["clock"] > 10.0 * known.limits["clock"]
    assert found.loss.half > 1.5 * known.loss.half
    assert last(late_encoder(blind, 0.1)).estimate.system.contains(WORN)


def test_the_pumps_command_stands_in_for_their_setting():
    found = last({n: v for n, v in rows().items() if n != "alpha_p"}).estimate
    assert found.clock.found
    assert found.system.contains(WORN)


def test_a_wire_counter_stands_in_for_the_motor_speed():
    assert last({n: v for n, v in rows().items() if n != "omega_m"}).estimate.system.contains(WORN)


@pytest.mark.long
@pytest.mark.parametrize("every", [0.17, 1.0, 1e9])
def test_rows_may_come_in_any_number_at_a_time(every):
    at_once, in_parts = last(rows(duration=80)), last(rows(duration=80), every=every)
    apart = in_parts.estimate.loss.value - at_once.estimate.loss.value
    assert abs(apart) < SAME * at_once.estimate.loss.half


@pytest.mark.long
@pytest.mark.parametrize(
    ("error", "source"),
    [
        ({"F_w": lambda F: 1.01 * F}, "F_gain"),
        ({"F_w": lambda F: F + 15e3}, "F_zero"),
        ({"alpha_m": lambda a: a + 0.005}, "alpha_m"),
    ],
)
def test_an_error_of_a_sensor_moves_the_estimate_by_what_is_stated_for_it(error, source):
    """To a tenth: the statement is linear."""
    right = last(rows()).estimate
    wrong = last({n: error.get(n, lambda v: v)(v) for n, v in rows().items()}).estimate
    moved = abs(wrong.loss.value - right.loss.value)
    assert moved == pytest.approx(right.limits[source], rel=0.1)


@pytest.mark.long
def test_a_constant_error_of_a_pressure_moves_nothing():
    right = last(rows()).estimate
    wrong = last({n: v + 0.5e5 if n in ("p_a", "p_hp") else v for n, v in rows().items()}).estimate
    assert wrong.loss.value == pytest.approx(right.loss.value, abs=2e-3)
    assert wrong.standing > right.standing + 5.0


def stepped(factor: float) -> dict[str, np.ndarray]:
    """Rows whose friction changes halfway: two runs of whole waves, one after the other."""
    first, second = rows(factor=1.0, duration=180), rows(factor=factor, duration=180)
    shift = first["time"][-1] + 0.02
    out = {n: np.concatenate([first[n], second[n] + (shift if n == "time" else 0.0)]) for n in first}
    settled = (out["time"] < 171.0) | (out["time"] > shift + 9.0)  # the second run starts from rest
    return {n: v[settled] for n, v in out.items()}


@pytest.mark.long
def test_a_step_of_friction_is_found_and_the_estimate_begins_anew():
    states = follow_friction(FrictionEstimator(CRANE), stepped(1.3), 5.0)
    assert len(states[-1].alarms) == 1
    alarm = states[-1].alarms[0]
    assert 171.0 < alarm.t < 171.0 + 9.0 + 60.0
    before = next(s for s in reversed(states) if s.t < 171.0).estimate.loss.value
    after = states[-1].estimate.loss.value
    assert alarm.rise.value == pytest.approx(after / before - 1.0, abs=0.01)
    assert states[-1].estimate.start > alarm.onset
    assert states[-1].estimate.system.value == pytest.approx(1.3, rel=LIKE_ANOTHER_LAG)
    assert "Total loss has risen by" in alarm.message
    assert "friction, if leakage and displacement are as in the file" in alarm.message


@pytest.mark.long
def test_friction_that_stays_raises_no_alarm():
    assert last(stepped(1.0)).alarms == ()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"mode": 0.0}, "manual mode"),
        ({"p_a": np.nan}, "p_a unknown"),
        ({"alpha_p": 1.0}, "match"),
        ({"omega_m": 1.0}, "no reversals of the winch"),
        ({"p_b": 400e5}, "relief valve open"),
    ],
)
def test_what_says_nothing_of_friction_is_named(change, reason):
    x = rows(duration=80)
    state = last({n: np.full_like(v, change[n]) if n in change else v for n, v in x.items()})
    assert state.estimate is None
    assert any(reason in text for text in state.reasons)


def test_slow_waves_say_nothing_of_friction():
    state = last({n: 0.02 * v if n == "omega_m" else v for n, v in rows(duration=80).items()})
    assert state.estimate is None


def test_missing_signals_are_named():
    state = last({n: v for n, v in rows(duration=80).items() if n not in ("p_a", "alpha_pm")})
    assert state.reasons == ("signals missing: p_a, alpha_pm",)


def test_an_estimate_ends_where_the_winch_no_longer_reverses():
    estimator = FrictionEstimator(CRANE)
    x = rows(duration=80)
    follow_friction(estimator, x)
    t = np.arange(81.0, 80.0 + LONGEST + 330.0, 0.1)
    state = estimator.update({n: t if n == "time" else np.full_like(t, v[-1]) for n, v in x.items()})
    assert state.estimate is None
    assert "no reversals of the winch" in state.reasons


@pytest.mark.parametrize(
    "name", ["nov-100t-electric", "nov-100t-cylinder", "nov-250t-secondary", "utility-20t-open-circuit"]
)
def test_a_winch_without_pressures_on_both_sides_of_its_motors_is_refused(name):
    with pytest.raises(
        IdentifyError, match=rf'Crane "{name}": .* Choose a crane of type active-passive or pure-active'
    ):
        FrictionEstimator(load_crane(name))


def test_rows_that_go_back_in_time_are_refused():
    estimator = FrictionEstimator(CRANE)
    estimator.update(rows(duration=80))
    with pytest.raises(IdentifyError, match=r"after rows up to 80 s: time must increase"):
        estimator.update(rows(duration=80))


def test_columns_of_different_length_are_refused():
    with pytest.raises(IdentifyError, match=r'"p_a" has shape \(3,\), "time" \(2,\)'):
        FrictionEstimator(CRANE).update({"time": [0.0, 1.0], "p_a": [1.0, 2.0, 3.0]})


def test_rows_without_time_are_refused():
    with pytest.raises(IdentifyError, match='Rows without "time"'):
        FrictionEstimator(CRANE).update({"p_a": [1.0]})


@pytest.mark.parametrize("window", [10.0, 1e5, np.nan])
def test_a_window_that_holds_too_little_or_too_much_is_refused(window):
    with pytest.raises(IdentifyError, match=r"allowed are 60 s to 3600 s"):
        FrictionEstimator(CRANE, window=window)


@pytest.mark.parametrize("value", [-0.01, np.nan, np.inf, "1 %"])
def test_an_accuracy_that_is_none_is_refused(value):
    with pytest.raises(IdentifyError, match=r"Accuracies\.F_gain"):
        Accuracies(F_gain=value)


def test_the_buffer_does_not_grow_with_the_log():
    """A winch that never reverses is the worst case: no half wave is ever complete."""
    estimator, t = FrictionEstimator(CRANE), np.arange(0.0, 600.0, 0.1)
    x = {n: t if n == "time" else np.full_like(t, v[-1]) for n, v in rows(duration=80).items()}
    sizes = []
    for i in range(0, len(t), 50):
        estimator.update({n: v[i : i + 50] for n, v in x.items()})
        sizes.append(sum(v.nbytes for v in estimator._buffer.values()))
    assert max(sizes[len(sizes) // 2 :]) <= max(sizes[: len(sizes) // 2])


@pytest.mark.parametrize(
    ("limits", "u", "expected"),
    [
        ([], 1.0, 1.959964),
        ([2.0], 0.0, 1.9),
        ([1.0, 1.0], 0.0, 2.0 * (1.0 - 0.05**0.5)),
        ([1.0] * 30, 0.0, 1.959964 * 10.0**0.5),
    ],
)
def test_the_interval_of_a_sum_of_errors(limits, u, expected):
    """A normal error, an even one, two even ones (a triangle), and many, whose sum is nearly normal."""
    assert half_width(limits, u) == pytest.approx(expected, rel=5e-3)


ENVELOPE = {
    "load": ["50 t", "100 t"],
    "s_w": ["500 m", "1000 m"],
    "s_tip_pp": ["1 m", "2 m"],
    "period": ["8 s", "11 s"],
    "modes": ["ssc"],
}


def certified(*, synthetic: bool = False, code: str = "", **envelope: object) -> stillhook.Crane:
    """The crane with a certificate for the conditions of `rows`, or others."""
    record = Certified.of(
        digest="0" * 64,
        date="2026-11-28",
        criteria="paper-f version 1",
        passed=True,
        synthetic=synthetic,
        level=2,
        variant=2,
        version="0",
        code=code or results_hash(),
        content=content(CRANE),
        envelope={**ENVELOPE, **envelope},
    )
    return CRANE.model_copy(update={"certified": signed(record)})


def test_without_a_certificate_nothing_is_applied():
    state = last(rows())
    assert state.applied is None
    assert state.bounds == (NO_CERTIFICATE,)


def test_inside_the_envelope_of_the_certificate_the_estimate_is_applied():
    state = last(rows(), certified())
    assert state.bounds == ()
    assert state.applied == state.estimate.system.value


@pytest.mark.long
@pytest.mark.parametrize(
    ("envelope", "reason"),
    [
        ({"load": ["80 t", "100 t"]}, r"load 6\d(\.\d)? t \(validated 80 t to 100 t\)"),
        ({"s_w": ["900 m", "1000 m"]}, "wire out"),
        ({"s_tip_pp": ["0.2 m", "1 m"]}, "tip motion over 30 s"),
        ({"period": ["10 s", "12 s"]}, "period of the tip"),
        ({"modes": ["ns"]}, r"mode ssc \(validated ns\)"),
        ({"synthetic": True}, "SYNTHETIC"),
        ({"code": "other"}, "certificate does not hold"),
    ],
)
def test_outside_the_envelope_the_estimate_is_shown_and_not_applied(envelope, reason):
    state = last(rows(), certified(**envelope))
    assert state.estimate.system.contains(WORN)
    assert state.applied is None
    assert re.search(reason, "; ".join(state.bounds))


@pytest.mark.long
@pytest.mark.parametrize(("name", "reason"), [("s_tip", "tip motion not known"), ("mode", "mode not known")])
def test_conditions_that_are_not_logged_are_outside(name, reason):
    state = last({n: v for n, v in rows().items() if n != name}, certified())
    assert state.applied is None
    assert any(reason in line for line in state.bounds)


def test_friction_that_no_winch_has_is_not_applied():
    state = last(rows(factor=4.0, duration=120), certified())
    assert state.estimate.system.value > 3.0
    assert state.applied is None
    assert "is not 0.3 to 3" in state.bounds[0]


@pytest.mark.long
def test_rows_at_ten_hertz_say_the_same():
    """To a tenth of the interval: a half wave is then some twenty samples."""
    fast = last(rows()).estimate
    slow = last({n: v[::5] for n, v in rows().items()}).estimate
    assert slow.loss.value == pytest.approx(fast.loss.value, abs=0.1 * fast.loss.half)


@pytest.mark.long
def test_unknown_values_here_and_there_change_little():
    rng = np.random.default_rng(3)
    holed = {n: v if n == "time" else np.where(rng.random(len(v)) < 0.02, np.nan, v) for n, v in rows().items()}
    right, found = last(rows()).estimate, last(holed).estimate
    assert found.half_waves >= right.half_waves - 2
    assert found.loss.value == pytest.approx(right.loss.value, abs=0.1 * right.loss.half)


@pytest.mark.long
def test_the_resistance_of_the_piston_is_added_where_the_gas_is_read():
    """A pressure at the gas, taken for that at the motors, counts the piston as friction of the winch."""
    case = stillhook.Scenario(
        load="60 t", s_w="800 m", mode="ssc", duration="150 s", tip=stillhook.Sine(height="1.6 m", period="9 s")
    )
    run = stillhook.simulate(CRANE, case, every="0.02 s")
    acc = FrictionEstimator(CRANE).balance.params.passive.accumulator
    gas = np.array([accumulator_pressure(v, acc) for v in run.V_acc.values])
    x = {"time": run.time.values, **{n: run[n].values for n in LOGGED}, "p_hp": gas}
    right, wrong = last(x, gas_side=True).estimate, last(x).estimate
    assert right.system.value == pytest.approx(1.0, rel=LIKE_ANOTHER_LAG)
    assert wrong.system.value > right.system.value + 0.02
    assert right.limits["R_piston"] > 0.0


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("brake", lambda t: np.where(t > 30.0, 1.0, 0.0), "brake closed"),
        ("s_w", lambda t: np.where(t > 30.0, 800.0 + 20.0 * (t - 30.0), 800.0), "wire changes its layer"),
        ("p_b", lambda t: np.where(t > 30.0, np.nan, 25e5), "p_b unknown"),
    ],
)
def test_half_waves_that_say_nothing_are_counted_by_reason(name, value, reason):
    x = rows(duration=80)
    state = last({**x, name: value(x["time"])})
    assert state.left_out[reason] > 0


@pytest.mark.long
def test_a_hole_in_the_log_costs_the_half_waves_around_it_alone():
    x = rows()
    state = last({n: np.delete(v, slice(4000, 4150)) for n, v in x.items()})
    assert 1 <= state.left_out["holes in the log"] <= 2
    assert state.estimate.loss.value == pytest.approx(last(x).estimate.loss.value, abs=0.1 * state.estimate.loss.half)


def test_a_second_log_with_other_signals_may_follow():
    estimator, x = FrictionEstimator(CRANE), rows(duration=80)
    follow_friction(estimator, x)
    later = {n: v + 100.0 if n == "time" else v for n, v in x.items() if n != "alpha_p"}
    assert follow_friction(estimator, later)[-1].estimate.system.contains(WORN)


@pytest.mark.long
def test_inside_the_envelope_the_other_parameters_are_applied_too_once_they_are_proven(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(friction, "PROVEN", ("leakage", "displacement", "gas"))
    state = last(rows(), certified())
    for name in ("leakage", "displacement", "gas"):
        assert state.parameters[name].applied == state.parameters[name].estimate.value.value


def test_outside_it_no_parameter_is_applied():
    state = last(rows(), certified(load=["80 t", "100 t"]))
    for name in ("leakage", "displacement", "gas"):
        assert state.parameters[name].applied is None
        assert re.search("load", "; ".join(state.parameters[name].bounds))


@pytest.mark.long
def test_a_displacement_that_no_winch_has_is_not_applied():
    state = last({**rows(), "alpha_m": rows()["alpha_m"] - 0.2}, certified())
    assert state.parameters["displacement"].applied is None
    assert "is not -0.15 to 0.15" in "; ".join(state.parameters["displacement"].bounds)
