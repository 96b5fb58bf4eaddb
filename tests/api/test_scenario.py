"""A scenario: what it accepts, and the one line that each mistake is refused with."""

import json

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
RECORD = Recorded(np.linspace(0.0, 50.0, 51), np.sin(np.linspace(0.0, 50.0, 51)))
MODES = "'manual', 'level-1', 'level-2', 'ns', 'hs', 'ssc', 'ssc-cubic', 'position', 'ff', 'rope', 'ssc-optimal' or 'ssc-scheduled'"


def refusal(make) -> str:
    """The one line that a mistake is refused with."""
    with pytest.raises(StillhookError) as e:
        make()
    text = str(e.value)
    assert len(text.splitlines()) == 1
    assert text.endswith(".")
    assert not text.endswith("..")
    return text


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
    assert Scenario(**BASE, tip=RECORD).duration == 50.0
    assert Scenario(**BASE, tip=RECORD, duration="40 s").duration == 40.0


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
        == 'mode "fast" is not one of manual, level-1, level-2, ns, hs, ssc, ssc-cubic, position, ff, rope, ssc-optimal, ssc-scheduled.'
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


# Mistakes


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"load": 100}, 'load = 100: a bare number; write it as text with its unit, "100 t"'),
        ({"load": "80"}, 'load = "80": no unit; write "80 t" (allowed: kg, t, te).'),
        ({"load": "12 ton"}, 'load = "12 ton": unit "ton" is not one of kg, t, te.'),
        ({"load": "-5 t"}, 'load = "-5 t": it must be greater than or equal to 0.'),
        ({"load": None}, "load = nothing: write a number and a unit as text"),
        ({"s_w": "-3 m"}, 's_w = "-3 m": it must be greater than or equal to 0.'),
        ({"duration": "0 s"}, 'duration = "0 s": it must be greater than or equal to 0.01 s.'),
        ({"duration": "25 h"}, 'duration = "25 h": it must be less than or equal to 24 h.'),
        ({"ramp": "-1 s"}, 'ramp = "-1 s": it must be greater than or equal to 0.'),
        ({"mode": "warp"}, f'mode = "warp": it must be {MODES}.'),
        ({"modes": (("5 s", "fast"),)}, f'modes[0][1] = "fast": it must be {MODES}.'),
        ({"modes": (("5", "ns"),)}, 'modes[0][0] = "5": no unit; write "5 s"'),
        ({"friction": "none"}, "friction = \"none\": it must be 'lugre' or 'regularised'."),
        ({"tip": 3}, "tip = 3: it must be an instance of Motion."),
        ({"foo": 1, "load": 3}, f"foo: unknown field. Allowed: {FIELDS}."),
        ({"water": {"volume": "3 m^3", "foo": 1}}, "Water.foo: unknown field. Allowed: volume, added_mass"),
        ({"water": "wet"}, 'water = "wet": it must be a table, with volume, added_mass, C_D, area, rho, current.'),
        ({"s_w": "5 m", "warm_up": "10 s", "duration": "10 s"}, "warm_up 10 s leaves nothing of the duration 10 s."),
        ({"tip": RECORD, "duration": "60 s"}, "duration 60 s is longer than the recorded motion, 50 s."),
        *(
            ({"modes": tuple(zip(times, ("ns", "hs"), strict=True))}, "modes: times must rise and not be negative.")
            for times in (("5 s", "5 s"), ("9 s", "5 s"), ("-1 s", "5 s"))
        ),
    ],
)
def test_a_mistake_says_where_what_came_and_what_is_allowed(fields, text):
    line = refusal(lambda: Scenario(**(BASE | fields)))
    assert text in line
    assert line.startswith(("Scenario.", "Scenario: ", "Water."))


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: Scenario(load="80 t"),
            "Scenario.s_w: missing (wire paid out at the start; in m, cm, mm, km). Add it.",
        ),
        (
            lambda: Scenario(**BASE, tip="sine 60 m 12 s"),
            'tip: "sine 60 m 12 s": amplitude 60 m is not between 0 m and',
        ),
        (lambda: Water(), "Water.volume: missing (displaced volume of payload; in m^3, L, cm^3, cc). Add it."),
        (lambda: Water(volume="0 m^3"), 'Water.volume = "0 m^3": it must be greater than 0.'),
        (lambda: Water(volume="3 m^3", C_D="1"), 'Water.C_D = "1": it must be a number (drag coefficient on `area`).'),
        (lambda: Sensors(delay="-1 s"), 'Sensors.delay = "-1 s": it must be greater than or equal to 0.'),
        (lambda: Sensors(delay="11 s"), 'Sensors.delay = "11 s": it must be less than or equal to 10 s.'),
        (lambda: Sensors(seed=-1), "Sensors.seed = -1: it must be greater than or equal to 0."),
        (lambda: Sensors(noise_F="1 bar"), 'Sensors.noise_F = "1 bar": unit "bar" is not one of N, kN, MN.'),
        (lambda: PowerLoss(time="5 s", unit=0), "PowerLoss.unit = 0: it must be greater than or equal to 1."),
        (lambda: PowerLoss(time="5 s", unit=1.5), "PowerLoss.unit = 1.5: it must be a whole number (which unit"),
        (lambda: Operator(alpha_m=0.0), "Operator.alpha_m = 0.0: it must be greater than 0."),
        (lambda: Operator(alpha_m=1.1), "Operator.alpha_m = 1.1: it must be less than or equal to 1."),
        (lambda: Operator(alpha_m="0.7"), 'Operator.alpha_m = "0.7": it must be a number (relative displacement'),
        (
            lambda: Operator(profile=(("5 s", "3 knots"),)),
            'Operator.profile[0][1] = "3 knots": unit "knots" is not one',
        ),
        (lambda: Operator(steps=((3, "1 m"),)), "Operator.steps[0][0] = 3: a bare number; write it as text"),
        *(
            (lambda rows={name: ((time, f"1 {unit}"), ("4 s", f"1 {unit}"))}: Operator(**rows), "negative nor fall.")
            for name, unit in (("profile", "m/s"), ("steps", "m"))
            for time in ("5 s", "-5 s")
        ),
    ],
)
def test_a_mistake_in_a_table_is_refused_as_well(make, text):
    assert text in refusal(make)


# What no crane of this kind can be asked


def test_the_swl_itself_is_lifted_and_the_wire_below_it_is_overload():
    """3.6 t of wire hang below the tip."""
    run = simulate(CRANE, Scenario(load="250 t", s_w="100 m", duration="2 s", warm_up="1 s"))
    assert run.status.item() == "overload"
    assert simulate(CRANE, Scenario(load="246 t", s_w="100 m", duration="2 s", warm_up="1 s")).status.item() == "ok"


SINGLE = changed(CRANE, {"active": {"pump": {"D": ["1355 cm^3/rev"]}}})
OF_ANOTHER = 'winch type "electric" has no motors whose displacement an operator sets. Leave it out.'


@pytest.mark.parametrize(
    ("crane", "case", "text"),
    [
        (CRANE, {"load": "320 t"}, 'Load 320 t exceeds the SWL 250 t of "nov-250t" (128 %). Lower the load'),
        (CRANE, {"s_w": "2900 m"}, 's_w 2900 m is more than the 2804 m of wire that "nov-250t" can pay out'),
        (CRANE, {"power_loss": PowerLoss(time="5 s", unit=4)}, 'unit 4: "nov-250t" has 3 hydraulic power units.'),
        (SINGLE, {"power_loss": PowerLoss(time="5 s", unit=1)}, "nothing would be left to hold the load."),
        (CRANE, {"mode": "manual", "operator": Operator(alpha_m=0.5)}, "operator.alpha_m = 0.5: the motors of"),
        (load_crane("nov-100t-electric"), {"mode": "manual", "operator": Operator(alpha_m=0.5)}, OF_ANOTHER),
        (CRANE, {"mode": "ssc", "operator": Operator(alpha_m=0.8)}, "held in manual mode only, and this run is in ssc"),
        (CRANE, {"load": "10 t", "water": Water(volume="50 m^3")}, "The payload floats: 10 t in air displaces 50 m^3"),
    ],
)
def test_what_a_crane_cannot_do_is_refused(crane, case, text):
    assert text in refusal(lambda: simulate(crane, Scenario(**(BASE | case))))


def test_a_scenario_stored_before_displacements_could_be_held_is_read():
    old = Scenario(**BASE).to_dict()
    del old["operator"]["alpha_m"]
    assert Scenario.from_dict(old) == Scenario(**BASE)


def test_in_a_batch_the_refused_case_is_named():
    cases = [Scenario(**BASE), Scenario(load="320 t", s_w="100 m")]
    assert refusal(lambda: simulate(CRANE, cases)).startswith("case 1: Load 320 t exceeds the SWL")


def test_refusals_are_scenario_errors():
    for make in (lambda: Scenario(load=3, s_w="1 m"), lambda: simulate(CRANE, Scenario(load="320 t", s_w="1 m"))):
        with pytest.raises(ScenarioError):
            make()
