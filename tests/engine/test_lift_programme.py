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
from stillhook.spec.lift.lowering import Lowering, Rigging, WinchSettings
from stillhook.spec.lift.payload import Level, Payload
from stillhook.spec.lift.phase import Phase, moves

CRANE = load_crane("deep-250t")
RHO = 1025.0
BOX = Payload(
    name="box",
    mass="60 t",
    height="4 m",
    C_D=2.5,
    levels=(Level(h="0 m", V="0 L", A33="0 t", A_p="0 m^2"), Level(h="4 m", V="10000 L", A33="40 t", A_p="25 m^2")),
)
DOWN = Phase(mode="ahc", speed="30 m/min", depth="1000 m")
SECOND_ORDER = 0.003
"""Weight is reckoned along the stretched wire, and 0.3 % of stretch at most is of second order in it."""


def lift(*programme: Phase, **changes: Any) -> Lowering:
    whole: dict[str, Any] = {
        "payload": BOX,
        "rigging": Rigging(height="10 m"),
        "h_tip": "30 m",
        "depth": "3000 m",
        "start_depth": "-5 m",
        "duration": "600 s",
        "programme": programme or (DOWN,),
    }
    return Lowering(**(whole | changes))


def phase_refusal(**fields: Any) -> str:
    with pytest.raises(ScenarioError) as error:
        Phase(**fields)
    assert "\n" not in str(error.value)
    return str(error.value)


def refusal(*programme: Phase, **changes: Any) -> str:
    with pytest.raises(LiftError) as error:
        pack_programme(CRANE, lift(*programme, **changes))
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"mode": "ahc", "speed": "6 m/min"}, "nothing ends it. Give one of time, depth, wire, landed, end_tension"),
        ({"mode": "ahc", "speed": "6 m/min", "time": "5 s", "depth": "3 m"}, "time and depth ends it. Give one of"),
        ({"mode": "constant-tension", "time": "5 s"}, "tension is missing, the one that constant-tension keeps"),
        (
            {"mode": "ahc", "tension": "3 kN", "time": "5 s"},
            "tension belongs to constant-tension and landing, and this is ahc",
        ),
        ({"mode": "landing", "tension": "3 kN", "landed": True}, "a load is landed by lowering it. Give speed above 0"),
        (
            {"mode": "landing", "tension": "3 kN", "landed": True, "speed": "-3 m/min"},
            "a load is landed by lowering it",
        ),
        ({"mode": "ahc", "speed": "-6 m/min", "landed": True}, "landed = true needs a phase that lowers"),
        ({"mode": "splash", "depth": "5 m"}, "speed is 0, so depth never comes. Give speed, or end it by time."),
        ({"mode": "manual", "end_tension": "5 kN"}, "speed is 0, so end_tension never comes"),
        (
            {"mode": "constant-tension", "tension": "3 kN", "time": "5 s", "speed": "1 m/min"},
            "constant-tension moves the wire by itself",
        ),
        ({"mode": "ahc", "time": "5 min", "timeout": "1 min"}, "timeout 60 s comes before its time 300 s"),
        ({"mode": "warp", "time": "5 s"}, 'Phase.mode = "warp"'),
        ({"mode": "ahc", "time": "5 s", "speed": "6 m"}, 'Phase.speed = "6 m"'),
        ({"mode": "ahc", "time": "5 s", "lower": "6 m/min"}, "Phase.lower: unknown field"),
    ],
)
def test_a_phase_that_could_not_do_what_it_says_is_refused(fields, says):
    assert says in phase_refusal(**fields)


DOWN_30 = {"mode": "ahc", "speed": "30 m/min", "time": "60 s"}  # from 10 m to 40 m as planned


@pytest.mark.parametrize(
    ("programme", "speeds"),
    [
        ([{"speed": "6 m/min", "depth": "20 m"}], [0.1]),
        ([{"speed": "6 m/min", "depth": "5 m"}], [-0.1]),  # the depth says the direction
        ([{"speed": "-6 m/min", "depth": "5 m"}], [-0.1]),
        ([{"speed": "6 m/min", "depth": "20 m"}, {"speed": "6 m/min", "depth": "-2 m"}], [0.1, -0.1]),
        (
            [{"speed": "-6 m/min", "wire": "20 m"}, {"speed": "6 m/min", "depth": "5 m"}],
            [-0.1, 0.1],
        ),  # known in a run only
        ([{"speed": "6 m/min", "landed": True}, {"speed": "6 m/min", "depth": "90 m"}], [0.1, -0.1]),
        ([DOWN_30, {"speed": "6 m/min", "depth": "40 m"}], [0.5, 0.1]),
        ([DOWN_30, {"speed": "6 m/min", "depth": "10 m"}], [0.5, -0.1]),
        ([DOWN_30, {"speed": "-6 m/min", "depth": "30 m"}], [0.5, -0.1]),
    ],
)
def test_a_depth_says_the_direction_of_a_speed(programme, speeds):
    phases = [Phase(**{"mode": "ahc", **each}) for each in programme]
    assert [move.v for move in moves(phases, 10.0, 100.0)] == pytest.approx(speeds)


@pytest.mark.parametrize(
    ("programme", "says"),
    [
        ([{"speed": "-6 m/min", "depth": "20 m"}], "hoists, and it ends at 20 m, below where it begins, 10 m"),
        ([DOWN_30, {"speed": "6 m/min", "depth": "30 m"}], "the direction is not known"),
        ([{"mode": "landing", "speed": "6 m/min", "depth": "5 m", "tension": "5 kN"}], "it lands"),
    ],
)
def test_a_sign_that_contradicts_its_depth_is_refused(programme, says):
    with pytest.raises(LiftError, match=says):
        moves([Phase(**{"mode": "ahc", **each}) for each in programme], 10.0, 100.0)


def test_a_named_phase_is_called_by_its_name():
    assert 'phase "down" (ahc): nothing ends it' in phase_refusal(name="down", mode="ahc", speed="6 m/min")


@pytest.mark.parametrize(
    ("phase", "says"),
    [
        (
            {"mode": "ahc", "speed": "6 m/min", "depth": "3001 m"},
            'phase "1 ahc": depth = 3001 m is below the seabed at 3000 m',
        ),
        (
            {"mode": "ahc", "speed": "-6 m/min", "depth": "-17 m"},
            "lifts the underside 17 m above the water, and between tip",
        ),
        (
            {"mode": "ahc", "speed": "6 m/min", "wire": "3800 m"},
            'requires 3800 m of wire out, and "deep-250t" has 0 m to 3698 m',
        ),
        (
            {"mode": "constant-tension", "tension": "2.6 MN", "time": "5 s"},
            'tension = 2600 kN: above the 2452 kN of the SWL of "deep-250t"',
        ),
    ],
)
def test_a_programme_that_this_crane_or_water_cannot_be_asked_is_refused(phase, says):
    assert says in refusal(Phase(**phase))


def test_a_payload_that_floats_cannot_land():
    cork = BOX.model_copy(update={"mass": 5e3})
    assert "the payload floats" in refusal(Phase(mode="ahc", speed="6 m/min", landed=True), payload=cork)


def test_compensated_phases_need_a_controller_that_compensates():
    assert 'controller = "manual"' in refusal(DOWN, controller="manual")
    assert "no phases" in refusal(programme=())


def test_phases_become_rows_in_which_hoisting_is_positive_and_the_last_one_says_so():
    programme = (DOWN, Phase(mode="landing", speed="6 m/min", tension="100 kN", landed=True))
    packed = pack_programme(CRANE, lift(*programme))
    first, second = (modes.Stage(*row) for row in packed.rows)
    assert packed.names == ("1 ahc", "2 landing")
    assert (first.v, first.until, first.last) == (pytest.approx(-0.5), modes.UNTIL_DEPTH, 0.0)
    assert (second.F_set, second.until, second.last) == (1e5, modes.UNTIL_LANDED, 1.0)


@pytest.mark.parametrize(
    ("first", "second", "v_end"),
    [
        ({"mode": "ahc", "speed": "30 m/min"}, {"mode": "ahc", "speed": "30 m/min", "time": "9 s"}, -0.5),  # goes on
        (
            {"mode": "ahc", "speed": "30 m/min"},
            {"mode": "landing", "speed": "6 m/min", "tension": "300 kN", "time": "9 s"},
            -0.1,
        ),  # slower
        (
            {"mode": "ahc", "speed": "6 m/min"},
            {"mode": "ahc", "speed": "30 m/min", "time": "9 s"},
            -0.1,
        ),  # speeds up afterwards
        ({"mode": "ahc", "speed": "30 m/min"}, {"mode": "ahc", "time": "9 s"}, 0.0),  # stands
        ({"mode": "ahc", "speed": "30 m/min"}, {"mode": "ahc", "speed": "-6 m/min", "time": "9 s"}, 0.0),  # turns back
        ({"mode": "ahc", "speed": "30 m/min"}, {"mode": "constant-tension", "tension": "300 kN", "time": "9 s"}, 0.0),
        (
            {"mode": "splash", "speed": "30 m/min"},
            {"mode": "ahc", "speed": "30 m/min", "time": "9 s"},
            0.0,
        ),  # waits for the tip to turn
        ({"mode": "splash", "speed": "30 m/min"}, {"mode": "manual", "speed": "30 m/min", "time": "9 s"}, -0.5),
    ],
)
def test_a_phase_that_ends_at_a_depth_stops_there_unless_the_next_goes_on(first, second, v_end):
    row = modes.Stage(*pack_programme(CRANE, lift(Phase(**first, depth="1000 m"), Phase(**second))).rows[0])
    assert row.v_end == pytest.approx(v_end)
    alone = modes.Stage(*pack_programme(CRANE, lift(Phase(**first, depth="1000 m"))).rows[0])
    assert alone.v_end == 0.0


def test_phases_of_one_name_are_told_apart():
    twice = Phase(name="rest", mode="ahc", time="5 s")
    assert pack_programme(CRANE, lift(twice, twice)).names == ("rest (1)", "rest (2)")


def test_a_phase_of_a_long_time_does_not_time_out_before_its_end():
    far = Phase(mode="ahc", speed="6 m/min", depth="2900 m")
    long, slow, own = (
        timeout(lift(), s) for s in (Phase(mode="ahc", time="2 h"), far, far.model_copy(update={"timeout": 60.0}))
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
