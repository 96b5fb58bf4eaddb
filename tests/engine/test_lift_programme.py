"""Winch programmes: what they may say, and what the PLC makes of them."""

import math
from typing import Any

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.control import supervisor as modes
from stillhook.engine.pack.programme import hanging, pack_programme, settings, timeout
from stillhook.errors import LiftError, ScenarioError
from stillhook.physics.scalar import G
from stillhook.spec.lift.lowering import Lowering, Rigging, Stage, WinchSettings
from stillhook.spec.lift.payload import Level, Payload

CRANE = load_crane("deep-250t")
RHO = 1025.0
BOX = Payload(
    name="box",
    mass="60 t",
    height="4 m",
    C_D=2.5,
    levels=(Level(h="0 m", V="0 L", A33="0 t", A_p="0 m^2"), Level(h="4 m", V="10000 L", A33="40 t", A_p="25 m^2")),
)
DOWN = Stage(mode="ahc", lower="30 m/min", depth="1000 m")
SECOND_ORDER = 0.003
"""Weight is reckoned along the stretched wire, and 0.3 % of stretch at most is of second order in it."""


def lift(*programme: Stage, **changes: Any) -> Lowering:
    whole: dict[str, Any] = {
        "payload": BOX,
        "rigging": Rigging(height="10 m"),
        "h_tip": "30 m",
        "depth": "3000 m",
        "z_0": "5 m",
        "duration": "600 s",
        "programme": programme or (DOWN,),
    }
    return Lowering(**(whole | changes))


def stage_refusal(**fields: Any) -> str:
    with pytest.raises(ScenarioError) as error:
        Stage(**fields)
    assert "\n" not in str(error.value)
    return str(error.value)


def refusal(*programme: Stage, **changes: Any) -> str:
    with pytest.raises(LiftError) as error:
        pack_programme(CRANE, lift(*programme, **changes))
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"mode": "ahc", "lower": "6 m/min"}, "nothing ends it. Give one of time, depth, wire, landed, tension"),
        ({"mode": "ahc", "lower": "6 m/min", "time": "5 s", "depth": "3 m"}, "time and depth ends it. Give one of"),
        ({"mode": "constant-tension", "time": "5 s"}, "hold is missing, the tension that constant-tension keeps"),
        (
            {"mode": "ahc", "hold": "3 kN", "time": "5 s"},
            "hold belongs to constant-tension and landing, and this is ahc",
        ),
        ({"mode": "landing", "hold": "3 kN", "landed": True}, "a load is landed by lowering it. Give lower above 0"),
        ({"mode": "landing", "hold": "3 kN", "landed": True, "lower": "-3 m/min"}, "a load is landed by lowering it"),
        ({"mode": "ahc", "lower": "-6 m/min", "landed": True}, "landed = true needs a stage that lowers"),
        ({"mode": "splash", "depth": "5 m"}, "lower is 0, so depth never comes. Give lower, or end it by time."),
        ({"mode": "manual", "tension": "5 kN"}, "lower is 0, so tension never comes"),
        (
            {"mode": "constant-tension", "hold": "3 kN", "time": "5 s", "lower": "1 m/min"},
            "constant-tension moves the wire by itself",
        ),
        ({"mode": "ahc", "time": "5 min", "timeout": "1 min"}, "timeout 60 s comes before its time 300 s"),
        ({"mode": "warp", "time": "5 s"}, 'Stage.mode = "warp"'),
        ({"mode": "ahc", "time": "5 s", "lower": "6 m"}, 'Stage.lower = "6 m"'),
        ({"mode": "ahc", "time": "5 s", "speed": "6 m/min"}, "Stage.speed: unknown field"),
    ],
)
def test_a_stage_that_could_not_do_what_it_says_is_refused(fields, says):
    assert says in stage_refusal(**fields)


def test_a_named_stage_is_told_by_its_name():
    assert 'stage "down" (ahc): nothing ends it' in stage_refusal(name="down", mode="ahc", lower="6 m/min")


@pytest.mark.parametrize(
    ("stage", "says"),
    [
        (
            {"mode": "ahc", "lower": "6 m/min", "depth": "3001 m"},
            'stage "1 ahc": depth = 3001 m is below the seabed at 3000 m',
        ),
        (
            {"mode": "ahc", "lower": "-6 m/min", "depth": "-17 m"},
            "lifts the underside 17 m above the water, and between tip",
        ),
        (
            {"mode": "ahc", "lower": "6 m/min", "wire": "3800 m"},
            'asks for 3800 m of wire out, and "deep-250t" has 0 m to 3698 m',
        ),
        (
            {"mode": "constant-tension", "hold": "2.6 MN", "time": "5 s"},
            'hold = 2600 kN: above the 2452 kN of the SWL of "deep-250t"',
        ),
    ],
)
def test_a_programme_that_this_crane_or_water_cannot_be_asked_is_refused(stage, says):
    assert says in refusal(Stage(**stage))


def test_a_payload_that_floats_cannot_land():
    cork = BOX.model_copy(update={"mass": 5e3})
    assert "the payload floats" in refusal(Stage(mode="ahc", lower="6 m/min", landed=True), payload=cork)


def test_compensated_stages_need_a_controller_that_compensates():
    assert 'controller = "manual"' in refusal(DOWN, controller="manual")
    assert "no stages" in refusal(programme=())


def test_stages_become_rows_in_which_hoisting_is_positive_and_the_last_one_says_so():
    programme = (DOWN, Stage(mode="landing", lower="6 m/min", hold="100 kN", landed=True))
    packed = pack_programme(CRANE, lift(*programme))
    first, second = (modes.Stage(*row) for row in packed.rows)
    assert packed.names == ("1 ahc", "2 landing")
    assert (first.v, first.until, first.last) == (pytest.approx(-0.5), modes.UNTIL_DEPTH, 0.0)
    assert (second.F_set, second.until, second.last) == (1e5, modes.UNTIL_LANDED, 1.0)


@pytest.mark.parametrize(
    ("first", "second", "v_end"),
    [
        ({"mode": "ahc", "lower": "30 m/min"}, {"mode": "ahc", "lower": "30 m/min", "time": "9 s"}, -0.5),  # goes on
        (
            {"mode": "ahc", "lower": "30 m/min"},
            {"mode": "landing", "lower": "6 m/min", "hold": "300 kN", "time": "9 s"},
            -0.1,
        ),  # slower
        (
            {"mode": "ahc", "lower": "6 m/min"},
            {"mode": "ahc", "lower": "30 m/min", "time": "9 s"},
            -0.1,
        ),  # speeds up afterwards
        ({"mode": "ahc", "lower": "30 m/min"}, {"mode": "ahc", "time": "9 s"}, 0.0),  # stands
        ({"mode": "ahc", "lower": "30 m/min"}, {"mode": "ahc", "lower": "-6 m/min", "time": "9 s"}, 0.0),  # turns back
        ({"mode": "ahc", "lower": "30 m/min"}, {"mode": "constant-tension", "hold": "300 kN", "time": "9 s"}, 0.0),
        (
            {"mode": "splash", "lower": "30 m/min"},
            {"mode": "ahc", "lower": "30 m/min", "time": "9 s"},
            0.0,
        ),  # waits for the tip to turn
        ({"mode": "splash", "lower": "30 m/min"}, {"mode": "manual", "lower": "30 m/min", "time": "9 s"}, -0.5),
    ],
)
def test_a_stage_that_ends_at_a_depth_stops_there_unless_the_next_goes_on(first, second, v_end):
    row = modes.Stage(*pack_programme(CRANE, lift(Stage(**first, depth="1000 m"), Stage(**second))).rows[0])
    assert row.v_end == pytest.approx(v_end)
    alone = modes.Stage(*pack_programme(CRANE, lift(Stage(**first, depth="1000 m"))).rows[0])
    assert alone.v_end == 0.0


def test_stages_of_one_name_are_told_apart():
    twice = Stage(name="rest", mode="ahc", time="5 s")
    assert pack_programme(CRANE, lift(twice, twice)).names == ("rest (1)", "rest (2)")


def test_a_stage_of_a_long_time_does_not_time_out_before_its_end():
    far = Stage(mode="ahc", lower="6 m/min", depth="2900 m")
    long, slow, own = (
        timeout(lift(), s) for s in (Stage(mode="ahc", time="2 h"), far, far.model_copy(update={"timeout": 60.0}))
    )
    assert long > 7200.0
    assert slow > 2900.0 / 0.1
    assert own == 60.0


def test_wire_out_for_a_depth_is_the_way_from_the_tip_less_the_stretch_of_a_rod_hung_from_it():
    """Summed over short pieces, each under its own tension; tip, rigging and payload take 30 + 10 + 4 m of the way."""
    found = hanging(CRANE, lift(), -2900.0)
    length = 30.0 + 2900.0 - 14.0
    assert found.s_w == pytest.approx(length - found.stretch)
    E_A = 210e9 * 0.55 * math.pi / 4 * 0.096**2
    pieces, dry = 20000, 30.0
    ds = length / pieces
    steel = 0.55 * math.pi / 4 * 0.096**2
    depth = (np.arange(pieces) + 0.5) * ds
    weight = np.where(depth < dry, 36.0, 36.0 - RHO * steel) * G * ds
    below = np.cumsum(weight[::-1])[::-1] - 0.5 * weight
    F = (60e3 - RHO * 10.0 + 3e3) * G + below
    on_boom = (F[0] + 0.5 * weight[0]) * 60.0 / E_A
    assert found.stretch == pytest.approx(np.sum(F * ds / E_A) + on_boom, rel=1e-4)
    assert found.F_tip == pytest.approx(F[0] + 0.5 * weight[0], rel=1e-6)
    whole = 2976.0 * (517.3e3 + 313.2 * 2976.0 / 2) / E_A  # L (W + w L / 2) / E A, with all of it wet
    assert found.stretch == pytest.approx(whole, rel=0.01)


def test_the_plc_knows_the_weight_of_its_wire():
    """Load cell less wire is what hangs on the hook, at any depth, but for the stretch."""
    s = settings(CRANE, lift())
    for z in (5.0, -5.0, -100.0, -2900.0):
        found = hanging(CRANE, lift(), z)
        assert found.F_tip - modes.wire_weight(found.s_w, s) == pytest.approx(
            found.F_hook, abs=SECOND_ORDER * found.F_tip
        )


def test_touch_down_is_known_by_a_part_of_the_weight_in_water():
    s = settings(CRANE, lift(winch=WinchSettings(landed=0.4)))
    assert s.F_landed == pytest.approx(0.4 * (60e3 - RHO * 10.0) * G)
    assert s.F_least == pytest.approx(0.5 * 3e3 * G)
