"""A session that is moved by the vessel gives what `simulate` gives over the same motion."""

import math

import numpy as np
import pytest

import stillhook
from stillhook.errors import SimulationError
from stillhook.sea.vessel.vessel_tip import GIVEN

CRANE = stillhook.load_crane("nov-250t")
BOOM = "x=-10 m, y=-6 m, z=8 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg"
SWELL = {"heave": "sine 1 m 9 s", "roll": "sine 2 deg 12 s", "pitch": "sine 1 deg 8 s"}
MOVES = {"slew": [("2 s", "9 s", "240 deg")], "luff": [("3 s", "9 s", "55 deg")]}
SIGNALS = ("e_c", "e_c_measured", "s_w", "F_w", "u_p")
REST = {name: 0.0 for jet in ("heave", "roll", "pitch") for name in GIVEN[jet]}


def case_of(unit: stillhook.MotionUnit | None = None, **moves: list[tuple[str, str, str]]) -> stillhook.Scenario:
    tip = stillhook.VesselTip(BOOM, **SWELL, **moves, unit=unit)
    return stillhook.Scenario(
        load="100 t", s_w="100 m", tip=tip, mode="ssc", duration="10 s", ramp="0 s", warm_up="0 s"
    )


def columns(tip: stillhook.VesselTip, t: np.ndarray, *, boom: bool, unit: bool) -> list[dict[str, float]]:
    """What a program that has the vessel gives at each time."""
    jets = dict(zip(("heave", "roll", "pitch"), tip._attitude(t), strict=True))
    jets |= dict(zip(("slew", "main", "knuckle"), tip._pose(t), strict=True)) if boom else {}
    jets |= {"unit_heave": tip._signals.at(t).heave} if unit else {}
    rows = np.column_stack([np.broadcast_to(x, t.shape) for jet in jets.values() for x in jet])
    names = [name for jet in jets for name in GIVEN[jet]]
    return [dict(zip(names, row, strict=True)) for row in rows.tolist()]


@pytest.mark.parametrize(
    ("unit", "given"),
    [
        (None, {"boom": False, "unit": False}),
        (stillhook.MotionUnit(at=("3 m", "1 m", "-2 m"), rotations="small-angle"), {"boom": True, "unit": False}),
        (stillhook.MotionUnit(heave_period="25 s"), {"boom": True, "unit": True}),
    ],
)
def test_a_session_moved_by_the_vessel_gives_the_bits_of_a_simulation(unit, given):
    case = case_of(unit, **MOVES)
    run = stillhook.simulate(CRANE, case, every="10 ms", series=True)
    rows = columns(case.tip, np.arange(len(run.time)) * 0.01, **given)
    session = stillhook.Session(CRANE, case_of(unit, **({} if given["boom"] else MOVES)))
    for k, row in enumerate(rows[1:], 1):
        session.step(row)
        for name in SIGNALS:
            assert session.get(name) == float(run[name][k]), (name, k)
    assert np.ptp(run.s_w.values) > 3.0


def test_a_vessel_that_lies_still_leaves_the_tip_where_it_is():
    session = stillhook.Session(CRANE, case_of())
    session.step(REST)
    assert (session.get("s_tip"), session.get("v_tip")) == (0.0, 0.0)
    session.step({**REST, "roll": 0.02})
    _, y, z = case_of().tip.boom.tip
    assert session.get("s_tip") == pytest.approx(y * math.sin(0.02) + z * math.cos(0.02) - z)


@pytest.mark.parametrize(
    ("unit", "given", "line"),
    [
        (None, {"heave": 0.1}, r"Session.step: v_heave, a_heave missing. Give heave, roll and pitch with their rates"),
        (None, {**REST, "slew": 1.0}, r"v_slew, a_slew missing"),
        (None, {**REST, "roll": 57.0}, r"roll = 57 rad is beyond any ship"),
        (None, {**REST, "roll": math.nan}, r"roll = nan: not a number"),
        (None, {**REST, "s_tip": 0.0, "v_tip": 0.0, "a_tip": 0.0}, r"s_tip and heave: give the motion of the tip or"),
        (stillhook.MotionUnit(heave_period="25 s"), REST, r"unit_heave missing: the case's motion unit filters heave"),
        (
            stillhook.MotionUnit(delay="20 ms"),
            REST,
            r"delay and noise of the case's motion unit are those of the input",
        ),
    ],
)
def test_a_vessel_motion_that_cannot_be_taken_is_one_line(unit, given, line):
    session = stillhook.Session(CRANE, case_of(unit))
    with pytest.raises(SimulationError, match=line) as problem:
        session.step(given)
    assert "\n" not in str(problem.value)
    assert session.time == 0.0


def test_a_vessel_is_not_held_and_no_input_of_another_motion():
    session = stillhook.Session(CRANE, case_of())
    with pytest.raises(
        SimulationError, match=r"Session.set: heave is not held: give the vessel's motion to every step"
    ):
        session.set("heave", 0.1)
    assert len(session.vessel_inputs) == 21
    plain = stillhook.Session(CRANE, case_of().model_copy(update={"tip": stillhook.Still()}))
    assert plain.vessel_inputs == ()
    with pytest.raises(SimulationError, match='"heave" is not a name here'):
        plain.step(REST)
