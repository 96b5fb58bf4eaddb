"""A scenario: what it accepts, and the one line that each mistake is refused with."""

import json
import math

import numpy as np
import pytest
from pydantic import ValidationError

from stillhook import Mode, Profile, Recorded, Scenario, Sine, Still, load_crane, simulate
from stillhook.errors import ScenarioError, StillhookError
from stillhook.library import changed
from stillhook.spec.scenario import FrictionModel, Operator, PowerLoss, Sensors, Water

BASE = {"load": "80 t", "s_w": "100 m"}
CRANE = load_crane("nov-250t")
FIELDS = "name, load, s_w, tip, mode, modes, duration, ramp, warm_up, water, operator, sensors, power_loss, friction, gas_held, commands"
MODES = "'manual', 'level-1', 'level-2', 'ns', 'hs', 'ssc', 'ssc-cubic' or 'position'"


def refusal(make) -> str:
    """The one line that a mistake is refused with."""
    with pytest.raises(StillhookError) as e:
        make()
    text = str(e.value)
    assert len(text.splitlines()) == 1
    assert text.endswith(".")
    assert not text.endswith("..")
    return text


def refused(**fields) -> str:
    return refusal(lambda: Scenario(**(BASE | fields)))


# What is accepted


def test_load_and_wire_are_enough():
    case = Scenario(load="100 t", s_w="100 m")
    assert (case.load, case.s_w) == (100e3, 100.0)
    assert case.mode is Mode.SSC
    assert case.tip == Still()
    assert (case.duration, case.ramp, case.warm_up) == (120.0, 10.0, 30.0)
    assert case.friction is FrictionModel.LUGRE
    assert case.water is None
    assert case.power_loss is None


def test_a_motion_may_be_text_or_object():
    assert Scenario(**BASE, tip="sine 2.8 m 12 s") == Scenario(**BASE, tip=Sine(amplitude="2.8 m", period="12 s"))
    assert Scenario(**BASE, tip=Profile([("0 s", "0 m/s"), ("5 s", "1 m/s"), ("9 s", "0 m/s")])).tip.duration is None


@pytest.mark.parametrize("mode", CRANE.plant.type.modes)
def test_every_mode_is_run(mode):
    data = simulate(CRANE, Scenario(**BASE, mode=mode.value, duration="3 s", warm_up="1 s", tip="sine 0.1 m 6 s"))
    assert data.status.item() == "ok"


@pytest.mark.parametrize("friction", list(FrictionModel))
def test_every_friction_model_is_run(friction):
    data = simulate(
        CRANE, Scenario(**BASE, friction=friction.value, duration="3 s", warm_up="1 s", tip="sine 0.1 m 6 s")
    )
    assert data.status.item() == "ok"


@pytest.mark.parametrize("variant", ["closed-loop", "open-loop-feedback", "open-loop"])
def test_every_control_of_the_motors_displacement_is_run(variant):
    crane = changed(CRANE, {"active": {"motor": {"variant": variant}}})
    assert simulate(crane, Scenario(**BASE, duration="3 s", warm_up="1 s", tip="sine 0.1 m 6 s")).status.item() == "ok"


def test_a_recorded_motion_is_run_to_its_end_unless_a_duration_is_given():
    t = np.linspace(0.0, 50.0, 51)
    record = Recorded(t, np.sin(t))
    assert Scenario(**BASE, tip=record).duration == 50.0
    assert Scenario(**BASE, tip=record, duration="40 s").duration == 40.0


def test_a_scenario_cannot_be_changed():
    case = Scenario(**BASE)
    with pytest.raises(ValidationError, match="frozen"):
        case.load = 1.0


def test_the_same_run_in_another_mode():
    case = Scenario(**BASE)
    other = case.with_mode("hs")
    assert (case.mode, other.mode) == (Mode.SSC, Mode.HS)
    assert other == Scenario(**BASE, mode="hs")
    assert (
        refusal(lambda: case.with_mode("fast"))
        == 'mode "fast" is not one of manual, level-1, level-2, ns, hs, ssc, ssc-cubic, position.'
    )


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"tip": "sine 2 m 13 s + sine 0.5 m 6 s 40 deg", "name": "swell", "mode": "ns"},
        {"tip": Recorded(np.linspace(0.0, 70.0, 71), np.sin(np.linspace(0.0, 9.0, 71)), source="log")},
        {"modes": (("20 s", "ns"), ("40 s", "manual")), "friction": "regularised"},
        {"water": {"volume": "10 m^3", "C_D": 1.0, "area": "9 m^2", "added_mass": "12 t", "rho": "1010 kg/m^3"}},
        {"operator": {"profile": (("0 s", "0 m/min"), ("9 s", "-12 m/min")), "steps": (("5 s", "20 cm"),)}},
        {"mode": "manual", "operator": {"profile": (("0 s", "0 m/min"), ("9 s", "-12 m/min")), "alpha_m": 0.7}},
        {
            "sensors": {"delay": "120 ms", "noise_F": "3 kN", "step_s_w": "1 mm", "seed": 9},
            "power_loss": {"time": "30 s", "unit": 2},
        },
    ],
)
def test_a_scenario_survives_its_own_record(more):
    case = Scenario(**(BASE | more))
    again = Scenario.from_dict(json.loads(json.dumps(case.to_dict())))
    assert again == case
    assert again.to_dict() == case.to_dict()
    assert type(again.mode) is Mode


# Mistakes in a field


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        (
            {"load": 100},
            'Scenario.load = 100: a bare number; write it as text with its unit, "100 t" (allowed: kg, t, te).',
        ),
        ({"load": "80"}, 'Scenario.load = "80": no unit; write "80 t" (allowed: kg, t, te).'),
        ({"load": "100 m"}, 'Scenario.load = "100 m": unit "m" is not one of kg, t, te.'),
        ({"load": "12 ton"}, 'Scenario.load = "12 ton": unit "ton" is not one of kg, t, te.'),
        ({"load": "-5 t"}, 'Scenario.load = "-5 t": it must be greater than or equal to 0.'),
        (
            {"load": None},
            'Scenario.load = nothing: write a number and a unit as text, such as "1 t" (allowed: kg, t, te).',
        ),
        ({"s_w": "-3 m"}, 'Scenario.s_w = "-3 m": it must be greater than or equal to 0.'),
        ({"duration": "0 s"}, 'Scenario.duration = "0 s": it must be greater than or equal to 0.01 s.'),
        ({"duration": "25 h"}, 'Scenario.duration = "25 h": it must be less than or equal to 24 h.'),
        ({"ramp": "-1 s"}, 'Scenario.ramp = "-1 s": it must be greater than or equal to 0.'),
        ({"mode": "warp"}, f'Scenario.mode = "warp": it must be {MODES}.'),
        ({"modes": (("5 s", "fast"),)}, f'Scenario.modes[0][1] = "fast": it must be {MODES}.'),
        ({"modes": (("5", "ns"),)}, 'Scenario.modes[0][0] = "5": no unit; write "5 s" (allowed: s, ms, min, h, d).'),
        ({"friction": "none"}, "Scenario.friction = \"none\": it must be 'lugre' or 'regularised'."),
        ({"tip": 3}, "Scenario.tip = 3: it must be an instance of Motion."),
        (
            {"tip": "sine 60 m 12 s"},
            'tip: "sine 60 m 12 s": amplitude 60 m is not between 0 m and 50 m. Check its unit; '
            "a sine is turned over with phase 180 deg.",
        ),
        ({"foo": 1}, f"Scenario.foo: unknown field. Allowed: {FIELDS}."),
        ({"foo": 1, "load": 3}, f"Scenario.foo: unknown field. Allowed: {FIELDS}."),
        (
            {"water": {"volume": "3 m^3", "foo": 1}},
            "Water.foo: unknown field. Allowed: volume, added_mass, C_D, area, rho.",
        ),
        ({"water": "wet"}, 'Scenario.water = "wet": it must be a table, with volume, added_mass, C_D, area, rho.'),
    ],
)
def test_a_mistake_in_a_field_says_where_what_came_and_what_is_allowed(fields, text):
    assert refused(**fields) == text


def test_a_missing_field_is_named():
    assert (
        refusal(lambda: Scenario(load="80 t"))
        == "Scenario.s_w: missing (wire paid out at the start; in m, cm, mm, km). Add it."
    )
    assert (
        refusal(lambda: Water()) == "Water.volume: missing (displaced volume of payload; in m^3, L, cm^3, cc). Add it."
    )


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Water(volume="0 m^3"), 'Water.volume = "0 m^3": it must be greater than 0.'),
        (lambda: Water(volume="3 m^3", C_D="1"), 'Water.C_D = "1": it must be a number (drag coefficient on `area`).'),
        (lambda: Sensors(delay="-1 s"), 'Sensors.delay = "-1 s": it must be greater than or equal to 0.'),
        (lambda: Sensors(delay="11 s"), 'Sensors.delay = "11 s": it must be less than or equal to 10 s.'),
        (lambda: Sensors(seed=-1), "Sensors.seed = -1: it must be greater than or equal to 0."),
        (lambda: Sensors(noise_F="1 bar"), 'Sensors.noise_F = "1 bar": unit "bar" is not one of N, kN, MN.'),
        (lambda: PowerLoss(time="5 s", unit=0), "PowerLoss.unit = 0: it must be greater than or equal to 1."),
        (
            lambda: PowerLoss(time="5 s", unit=1.5),
            "PowerLoss.unit = 1.5: it must be a whole number (which unit, counted from 1).",
        ),
        (lambda: Operator(alpha_m=0.0), "Operator.alpha_m = 0.0: it must be greater than 0."),
        (lambda: Operator(alpha_m=1.1), "Operator.alpha_m = 1.1: it must be less than or equal to 1."),
        (
            lambda: Operator(alpha_m="0.7"),
            'Operator.alpha_m = "0.7": it must be a number (relative displacement of the motors, held in manual mode).',
        ),
        (
            lambda: Operator(profile=(("5 s", "3 knots"),)),
            'Operator.profile[0][1] = "3 knots": unit "knots" is not one of m/s, m/min, mm/s.',
        ),
        (
            lambda: Operator(steps=((3, "1 m"),)),
            'Operator.steps[0][0] = 3: a bare number; write it as text with its unit, "3 s" (allowed: s, ms, min, h, d).',
        ),
    ],
)
def test_a_mistake_in_a_table_is_refused_as_well(make, text):
    assert refusal(make) == text


# Mistakes between fields


def test_a_warm_up_that_leaves_nothing_is_refused():
    assert refused(duration="10 s", warm_up="10 s") == (
        "Scenario: warm_up 10 s leaves nothing of the duration 10 s. Shorten warm_up or run longer."
    )


@pytest.mark.parametrize("times", [("5 s", "5 s"), ("9 s", "5 s"), ("-1 s", "5 s")])
def test_mode_changes_that_do_not_rise_in_time_are_refused(times):
    assert refused(modes=tuple(zip(times, ("ns", "hs"), strict=True))) == (
        "Scenario: modes: times must rise and not be negative. Sort the mode changes."
    )


@pytest.mark.parametrize("name", ["profile", "steps"])
@pytest.mark.parametrize("times", [("5 s", "4 s"), ("-5 s", "4 s")])
def test_an_operator_who_goes_back_in_time_is_refused(name, times):
    unit = "m/s" if name == "profile" else "m"
    rows = tuple((t, f"1 {unit}") for t in times)
    assert (
        refusal(lambda: Operator(**{name: rows}))
        == f"Operator: {name}: times must not be negative nor fall. Sort the points."
    )


def test_a_run_longer_than_its_record_is_refused():
    t = np.linspace(0.0, 50.0, 51)
    assert refused(tip=Recorded(t, np.sin(t)), duration="60 s") == (
        "Scenario: duration 60 s is longer than the recorded motion, 50 s. Shorten the run."
    )


# What no crane of this kind can be asked


def asked(crane=CRANE, **case) -> str:
    return refusal(lambda: simulate(crane, Scenario(**(BASE | case))))


def test_a_load_above_the_swl_is_refused():
    assert (
        asked(load="320 t")
        == 'Load 320 t exceeds the SWL 250 t of "nov-250t" (128 %). Lower the load or choose another crane.'
    )


def test_the_swl_itself_is_lifted_and_the_wire_below_it_is_overload():
    """3.6 t of wire hang below the tip."""
    run = simulate(CRANE, Scenario(load="250 t", s_w="100 m", duration="2 s", warm_up="1 s"))
    assert run.status.item() == "overload"
    assert simulate(CRANE, Scenario(load="246 t", s_w="100 m", duration="2 s", warm_up="1 s")).status.item() == "ok"


def test_wire_that_the_drum_does_not_hold_is_refused():
    text = asked(s_w="2900 m")
    assert text == (
        's_w 2900 m is more than the 2804 m of wire that "nov-250t" can pay out (drum full, 3 turns kept). '
        "Lower s_w or choose another crane."
    )
    assert math.isfinite(
        simulate(CRANE, Scenario(load="80 t", s_w="2800 m", duration="2 s", warm_up="1 s")).p_max.item()
    )


def test_a_power_unit_that_is_not_there_is_refused():
    assert (
        asked(power_loss=PowerLoss(time="5 s", unit=4))
        == 'power_loss.unit 4: "nov-250t" has 3 hydraulic power units. Give 1 to 3.'
    )


def test_the_loss_of_the_only_power_unit_is_refused():
    single = changed(CRANE, {"active": {"pump": {"D": ["1355 cm^3/rev"]}}})
    for unit in (1, 3):
        assert asked(single, power_loss=PowerLoss(time="5 s", unit=unit)) == (
            'power_loss: "nov-250t" has a single hydraulic power unit; nothing would be left to hold the load.'
        )


def test_a_displacement_that_the_motors_do_not_have_cannot_be_held():
    assert asked(mode="manual", operator=Operator(alpha_m=0.5)) == (
        'operator.alpha_m = 0.5: the motors of "nov-250t" go from 0.6 to 1 of their displacement. '
        "Give a value in between, or a crane with a smaller active.motor.alpha_min."
    )


def test_a_winch_whose_motors_have_no_setting_says_so():
    assert asked(load_crane("nov-100t-electric"), mode="manual", operator=Operator(alpha_m=0.5)) == (
        'operator.alpha_m = 0.5: winch type "electric" has no motors whose displacement an operator sets. Leave it out.'
    )


def test_a_displacement_is_held_in_manual_mode_only():
    assert asked(mode="ssc", operator=Operator(alpha_m=0.8)) == (
        'operator.alpha_m = 0.8: held in manual mode only, and this run is in ssc. Set mode = "manual", or leave it out.'
    )


def test_a_scenario_stored_before_displacements_could_be_held_is_read():
    old = Scenario(**BASE).to_dict()
    del old["operator"]["alpha_m"]
    assert Scenario.from_dict(old) == Scenario(**BASE)


def test_a_payload_that_floats_is_refused():
    assert asked(load="10 t", water=Water(volume="50 m^3")) == (
        "The payload floats: 10 t in air displaces 50 m^3 of water. Lower water.volume or raise the load."
    )


def test_in_a_batch_the_refused_case_is_named():
    cases = [Scenario(**BASE), Scenario(load="320 t", s_w="100 m")]
    assert refusal(lambda: simulate(CRANE, cases)).startswith("case 1: Load 320 t exceeds the SWL")


def test_refusals_are_scenario_errors():
    for make in (lambda: Scenario(load=3, s_w="1 m"), lambda: simulate(CRANE, Scenario(load="320 t", s_w="1 m"))):
        with pytest.raises(ScenarioError):
            make()
