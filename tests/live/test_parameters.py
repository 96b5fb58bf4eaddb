"""Leakage, displacement, gas and delays of a twin come out as they were put in, with what is stated of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from tests.live.test_friction_estimate import certified

import stillhook
from stillhook.library import load_crane
from stillhook.live.estimate import Accuracies, FrictionEstimator, follow_friction
from stillhook.live.estimate.balance import Balance
from stillhook.live.estimate.parameters.catalogue import NOT_PROVEN, PARAMETERS, PROVEN
from stillhook.live.estimate.parameters.informed import Nuisance, informed
from stillhook.live.estimate.parameters.sums import Window, fit
from stillhook.physics.hydraulics.lines import external_leakage, internal_leakage
from stillhook.physics.hydraulics.motor import motor_leakage
from stillhook.physics.hydraulics.pump import LEAK_KNOTS

CRANE = load_crane("nov-250t")
LOGGED = (
    "s_tip",
    "s_w",
    "omega_m",
    "p_a",
    "p_b",
    "p_hp",
    "alpha_m",
    "alpha_pm",
    "alpha_p",
    "u_p",
    "u_m",
    "F_w",
    "mode",
)
CUT = 2e-3
"""Error of a change of displacement [-]: its part of the full one differs with the setting in secondary control."""


def leaky(crane: stillhook.Crane, factor: float) -> stillhook.Crane:
    """The crane with so many times its leakage."""
    motor, pump = crane.active.motor, crane.active.pump
    update = {
        "C_leak": factor * crane.active.C_leak,
        "motor": motor.model_copy(update={"C_1": factor * motor.C_1, "C_2": factor * motor.C_2}),
        "pump": pump.model_copy(update={"leak_scale": factor}),
    }
    return crane.model_copy(update={"active": crane.active.model_copy(update=update)})


def charged(crane: stillhook.Crane, factor: float) -> stillhook.Crane:
    """The crane with so much of its gas, at the pressure of the file."""
    gas = crane.passive.accumulator.gas
    acc = crane.passive.accumulator.model_copy(update={"gas": gas.model_copy(update={"V_0": factor * gas.V_0})})
    return crane.model_copy(update={"passive": crane.passive.model_copy(update={"accumulator": acc})})


def log_of(crane: stillhook.Crane, mode: str = "ssc", height: str = "1.6 m") -> dict[str, np.ndarray]:
    """What the PLC of the twin logs every 10 ms."""
    tip = stillhook.Sine(height=height, period="8 s")
    case = stillhook.Scenario(load="60 t", s_w="800 m", mode=mode, duration="150 s", tip=tip)
    run = stillhook.simulate(crane, case, every="0.01 s")
    return {"time": run.time.values, **{n: run[n].values for n in LOGGED if n in run}}


@cache
def rows(mode: str = "ssc", height: str = "1.6 m") -> dict[str, np.ndarray]:
    return log_of(CRANE, mode, height)


def quick() -> dict[str, np.ndarray]:
    """A log whose motors are reduced in every wave."""
    return rows(height="2.4 m")


def parameters(x: dict[str, np.ndarray], crane: stillhook.Crane = CRANE, **options: object):
    return follow_friction(FrictionEstimator(crane, **options), x, 20.0)[-1].parameters


@pytest.mark.parametrize("name", ["leakage", "gas", "displacement"])
def test_a_twin_is_its_file(name):
    one = parameters(rows())[name]
    assert one.estimate.value.contains(0.0 if one.unit else 1.0)


@pytest.mark.parametrize("name", ["pump_delay", "motor_delay"])
def test_a_command_takes_a_cycle_of_the_plc_to_be_obeyed(name):
    assert parameters(quick())[name].estimate.value.contains(CRANE.control.t_cycle)


def test_more_leakage_is_found():
    found = parameters(log_of(leaky(CRANE, 1.6)))["leakage"].estimate
    assert found.value.contains(1.6)
    assert found.value.low > 1.2


def with_leak(
    x: dict[str, np.ndarray], factor: Callable[[np.ndarray, np.ndarray], np.ndarray]
) -> dict[str, np.ndarray]:
    """The log of pumps that give more by what leaks beside the file's law: its leakage times factor (time, law)."""
    A = Balance(CRANE).params.active
    dp = x["p_a"] - x["p_b"]
    law = np.interp(np.abs(x["alpha_p"]), LEAK_KNOTS, A.pumps.leak) + motor_leakage(x["omega_m"], A.motors)
    head = internal_leakage(1.0, dp) + external_leakage(1.0, np.sign(dp) * np.maximum(x["p_a"], x["p_b"]))
    more = factor(x["time"], law) * law * head
    return {**x, "alpha_p": x["alpha_p"] + more / (A.pumps.D_max * A.pumps.omega_p)}


def test_the_same_oil_through_a_leak_of_another_form_is_the_same_leakage():
    found = parameters(with_leak(rows("ns"), lambda t, law: np.mean(law) / law - 1.0))["leakage"].estimate
    assert found.value.contains(1.0)
    assert found.value.half < 0.1


def test_a_reading_that_jumps_while_the_oil_warms_has_jumped_by_what_it_has():
    x = with_leak(quick(), lambda t, law: 0.4 * t / t[-1])
    jumped = {**x, "alpha_m": x["alpha_m"] + np.where(x["time"] > 100.0, 0.02, 0.0)}
    (alarm,) = parameters(jumped)["displacement"].alarms
    assert alarm.rise.contains(-0.02)
    assert alarm.rise.half < CUT


def test_an_interval_that_says_nothing_is_no_estimate():
    one = parameters(rows(), accuracies=Accuracies(C_h=2.0))["leakage"]
    assert one.estimate is None
    assert "not determined" in one.reasons[0]


def test_gas_that_is_lost_is_found():
    found = parameters(log_of(charged(CRANE, 0.85)))["gas"].estimate
    assert found.value.contains(0.85)
    assert found.value.half < 0.05


@pytest.mark.parametrize("offset", [0.02, -0.03])
def test_a_reading_that_is_off_is_the_displacement_above_it(offset):
    right = parameters(rows())["displacement"].estimate
    wrong = parameters({**rows(), "alpha_m": rows()["alpha_m"] + offset})["displacement"].estimate
    assert wrong.value.value - right.value.value == pytest.approx(-offset, abs=CUT)


@pytest.mark.parametrize(("command", "name"), [("u_p", "pump_delay"), ("u_m", "motor_delay")])
def test_a_command_that_takes_longer_is_a_delay(command, name):
    x = quick()
    late = {**x, command: np.concatenate([x[command][3:], np.repeat(x[command][-1:], 3)])}
    right, wrong = parameters(x)[name].estimate, parameters(late)[name].estimate
    assert wrong.value.value - right.value.value == pytest.approx(0.03, abs=wrong.value.half)


@pytest.mark.parametrize(
    ("name", "source", "error"),
    [
        ("gas", "alpha_pm", lambda x: {"alpha_pm": x["alpha_pm"] + 0.005}),
        ("displacement", "D_p", lambda x: {"alpha_p": 1.005 * x["alpha_p"]}),
    ],
)
def test_an_error_of_a_sensor_moves_a_parameter_by_what_is_stated_for_it(name, source, error):
    right, wrong = parameters(rows())[name].estimate, parameters({**rows(), **error(rows())})[name].estimate
    assert abs(wrong.value.value - right.value.value) == pytest.approx(right.limits[source], rel=0.15)


def test_better_sensors_make_a_narrower_interval():
    known = parameters(rows(), accuracies=Accuracies(alpha_pm=1e-4, D_pm=1e-4, make_up=0.0, R_piston=0.0))["gas"]
    assert known.estimate.value.half < 0.7 * parameters(rows())["gas"].estimate.value.half


@pytest.mark.parametrize(
    ("without", "name", "reason"),
    [
        (("alpha_p", "u_p"), "leakage", "alpha_p or u_p"),
        (("u_p",), "pump_delay", "signals missing: u_p"),
        (("alpha_p",), "pump_delay", "signals missing: alpha_p"),
        (("u_m",), "motor_delay", "u_m"),
    ],
)
def test_what_a_parameter_lacks_is_named(without, name, reason):
    one = parameters({n: v for n, v in rows().items() if n not in without})[name]
    assert one.estimate is None
    assert reason in one.reasons[0]


def test_motors_whose_command_stands_still_have_no_delay():
    one = parameters(rows("ns"))["motor_delay"]
    assert one.estimate is None
    assert one.reasons == ("0 of 8 half waves",)


def test_a_winch_without_a_passive_circuit_has_no_gas():
    crane = load_crane("nov-100t-pure-active")
    found = parameters(log_of(crane), crane)
    assert found["gas"].reasons == ("no passive circuit",)
    assert found["leakage"].estimate.value.contains(1.0)


def test_without_a_certificate_nothing_is_applied():
    for one in parameters(quick()).values():
        assert one.applied is None
        assert "no certificate" in one.bounds[0]


def test_what_the_trial_has_not_proven_is_not_applied_whatever_the_certificate():
    for name, one in parameters(quick(), certified()).items():
        assert one.applied is None or name in PROVEN
        assert NOT_PROVEN in one.bounds or name in PROVEN or one.estimate is None


def test_a_reading_that_jumps_is_found_and_named():
    x = rows()
    jumped = {**x, "alpha_m": x["alpha_m"] + np.where(x["time"] > 100.0, 0.02, 0.0)}
    found = parameters(jumped)
    (alarm,) = found["displacement"].alarms
    assert 100.0 < alarm.t < 130.0
    assert alarm.rise.value == pytest.approx(-0.02, abs=CUT)
    assert "displacement" in alarm.message
    assert found["leakage"].alarms == ()
    assert found["pump_delay"].alarms == ()


def test_every_parameter_says_what_it_is_and_what_a_step_may_be():
    assert len({p.name for p in PARAMETERS}) == len(PARAMETERS)
    for p in PARAMETERS:
        assert p.meaning
        assert p.cause
        assert set(p.by) | set(p.explained) <= set(p.columns)
        assert p.plausible[0] < (0.0 if p.unit else 1.0) < p.plausible[1]


@pytest.mark.parametrize(("limit", "columns"), [(1e-6, [0, 1]), (1e6, [0, 1, 2])])
def test_a_nuisance_counts_between_what_is_known_and_what_is_free(limit, columns):
    rng = np.random.default_rng(1)
    Z = rng.normal(size=(20, 50, 4))
    Z[:, :, 0] += Z[:, :, 2]
    G = np.einsum("nij,nik->njk", Z, Z)
    w, y = Window(np.arange(20.0), np.ones(20), np.ones(20), G), np.eye(4)[3]
    free = np.tile(np.eye(4)[:2], (20, 1, 1))
    found = informed(w, free, {"other": Nuisance(np.eye(4)[2], limit)}, y, {}, np.zeros(4))
    assert found.b[:2] == pytest.approx(fit(w, columns, y).b[:2], rel=1e-4)
