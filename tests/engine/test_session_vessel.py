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
EVERYTHING = stillhook.MotionUnit(
    at=("3 m", "1 m", "-2 m"),
    heave_period="12 s",
    delay="33 ms",
    noise_heave="1 cm",
    noise_angle="0.02 deg",
    noise_rate="0.001 rad/s",
    seed=5,
)
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
    jets |= {"unit_heave": tip.signals(0.01).at(t).heave} if unit else {}
    rows = np.column_stack([np.broadcast_to(x, t.shape) for jet in jets.values() for x in jet])
    names = [name for jet in jets for name in GIVEN[jet]]
    return [dict(zip(names, row, strict=True)) for row in rows.tolist()]


@pytest.mark.long
@pytest.mark.parametrize(
    ("unit", "given"),
    [
        (None, {"boom": False, "unit": False}),
        (stillhook.MotionUnit(at=("3 m", "1 m", "-2 m"), rotations="small-angle"), {"boom": True, "unit": False}),
        (stillhook.MotionUnit(heave_period="25 s"), {"boom": True, "unit": True}),
        (stillhook.MotionUnit(heave_period="25 s"), {"boom": False, "unit": False}),
        (stillhook.MotionUnit(delay="20 ms"), {"boom": False, "unit": False}),
        (EVERYTHING, {"boom": True, "unit": False}),
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


def test_pitch_alone_is_seen_late_by_the_unit_and_before_the_lever():
    """The PLC's tip is x sin(theta) + z (cos(theta) - 1) of the pitch 33 ms ago, between two cycles."""
    delay, amplitude, w = 0.033, math.radians(3.0), 2.0 * math.pi / 8.0
    tip = stillhook.VesselTip(BOOM, pitch="sine 3 deg 8 s", unit=stillhook.MotionUnit(delay="33 ms"))
    session = stillhook.Session(CRANE, case_of().model_copy(update={"tip": tip}))
    x, _, z = tip.boom.tip
    for k in range(1, 301):
        sine, cosine = math.sin(w * k * 0.01), math.cos(w * k * 0.01)
        jet = (amplitude * sine, amplitude * w * cosine, -amplitude * w * w * sine)
        session.step({**REST, **dict(zip(GIVEN["pitch"], jet, strict=True))})
        theta = amplitude * math.sin(w * max(k * 0.01 - delay, 0.0))
        assert session.sensed().s_tip == pytest.approx(x * math.sin(theta) + z * (math.cos(theta) - 1.0), abs=1e-10)


@pytest.mark.long
def test_lever_arms_amplify_the_noise_of_angles():
    """sigma_tip^2 = sigma_heave^2 + (x^2 + y^2) sigma_angle^2, of a ship that lies still."""
    heave, angle, n = 0.01, math.radians(0.02), 4000
    unit = stillhook.MotionUnit(noise_heave="1 cm", noise_angle="0.02 deg", seed=7)
    session = stillhook.Session(CRANE, case_of().model_copy(update={"tip": stillhook.VesselTip(BOOM, unit=unit)}))
    seen = np.empty(n)
    for k in range(n):
        session.step(REST)
        seen[k] = session.sensed().s_tip
    x, y, _ = session._vessel._tip.boom.tip
    assert seen.std() == pytest.approx(math.hypot(heave, angle * math.hypot(x, y)), rel=4.0 / math.sqrt(2.0 * n))
    assert angle * math.hypot(x, y) > heave / 2.0
    assert session.get("s_tip") == 0.0


def test_a_motion_unit_goes_on_from_a_saved_state_and_from_the_scenario(tmp_path):
    """Its filter and delay remember; a motion that comes late, or stops to come, is taken from where the unit is."""
    case = case_of(EVERYTHING)
    rows = columns(case.tip, np.arange(301) * 0.01, boom=True, unit=False)
    one, other = stillhook.Session(CRANE, case), stillhook.Session(CRANE, case)
    one.step(cycles=80)
    for row in rows[81:200]:
        one.step(row)
    one.step(cycles=20)
    for row in rows[220:260]:
        one.step(row)
    other.restore(one.save(tmp_path / "state"))
    kept = one.keep()
    for session in (one, other):
        for row in rows[260:]:
            session.step(row)
    plain = stillhook.Session(CRANE, case)
    plain.step(cycles=300)
    ends = [session.get(name) for session in (one, other, plain) for name in SIGNALS]
    assert ends[:5] == ends[5:10] == ends[10:]
    assert other.get("unit_heave") == plain.get("unit_heave") != plain.get("heave") == other.get("heave")
    one.go_back(kept)
    for row in rows[260:]:
        one.step(row)
    assert [one.get(name) for name in SIGNALS] == ends[:5]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda head, x: (head, x[:-1]), r"saved state: damaged: 49 numbers of a motion unit, not 50. Save it again."),
        (lambda head, x: (head, np.append(x[:-1], np.nan)), r"saved state: no state of a motion unit: nan"),
        (lambda head, x: ({"vessel": {"heave": "0x1p+60"}}, x), r"saved state: no state of a motion unit: 1.15"),
        (lambda head, x: ({"vessel": {"sway": "0x1p+0"}}, x), r"saved state: vessel = .*finite numbers for names of"),
        (lambda head, x: ({}, x), r"saved state: damaged: 50 numbers of a motion unit, not 0."),
    ],
)
def test_a_state_that_no_motion_unit_has_is_refused_in_one_line(change, line, monkeypatch):
    session = stillhook.Session(CRANE, case_of(EVERYTHING))
    session.step(REST)
    head, numbers = session._vessel.saved()
    monkeypatch.setattr(session._vessel, "saved", lambda: change(head, numbers))
    state = session.save()
    with pytest.raises(SimulationError, match=line) as problem:
        session.restore(state)
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(
    ("unit", "given", "line"),
    [
        (None, {"heave": 0.1}, r"Session.step: v_heave, a_heave missing. Give heave, roll and pitch with their rates"),
        (None, {**REST, "slew": 1.0}, r"v_slew, a_slew missing"),
        (None, {**REST, "roll": 57.0}, r"roll = 57 rad is beyond any ship"),
        (None, {**REST, "roll": math.nan}, r"roll = nan: not a number"),
        (None, {**REST, "s_tip": 0.0, "v_tip": 0.0, "a_tip": 0.0}, r"s_tip and heave: give the motion of the tip or"),
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
