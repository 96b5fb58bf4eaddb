"""Motion of a crane tip from the vessel's: exact rotations, boom movements, and what the motion unit makes of it."""

import json
import math

import numpy as np
import pytest
from scipy.signal import freqs
from scipy.spatial.transform import Rotation

import stillhook
from stillhook.errors import MotionError, ScenarioError, SeaError
from stillhook.formats.case_file import load_case, read_tip
from stillhook.formats.motion.open import read_ship_motion
from stillhook.sea.motion.motion import Ramped
from stillhook.sea.motion.text import motion_from_json, motion_to_json
from stillhook.sea.vessel.motion_unit import MotionUnit
from stillhook.sea.vessel.vessel_tip import VesselTip

BOOM = "x=-10 m, y=-6 m, z=8 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg"
ROTATION = 1e-9  # m: rounding of lengths of 40 m and of the curve through the log
DIFFERENCES = 2e-5  # m/s, m/s^2: of central differences over 2 ms, where the acceleration has no jump


def constant(value: float) -> stillhook.Recorded:
    return stillhook.Recorded(np.linspace(0.0, 400.0, 9), np.full(9, value))


def turned(tip: VesselTip, t: float, roll: float, pitch: float, yaw: float = 0.0) -> np.ndarray:
    """The way from the motion's point to the tip by a rotation matrix of another program, the boom by two vectors."""
    main = tip.boom_at(t)
    slew, up = main.slew, main.main_angle
    down = up - main.knuckle_angle
    out = np.array([math.cos(slew), math.sin(slew), 0.0])
    arm = np.array([main.x, main.y, main.z]) + main.offset * out
    for length, angle in ((main.main_length, up), (main.knuckle_length, down)):
        arm = arm + length * (math.cos(angle) * out + math.sin(angle) * np.array([0.0, 0.0, 1.0]))
    return Rotation.from_euler("ZYX", [yaw, -pitch, roll]).apply(arm)


def test_a_measured_ship_moves_the_tip_as_a_rotation_matrix_of_scipy_does(shared_data):
    ship = read_ship_motion(shared_data / "ship_motion_palmer" / "NBP1406_seap-2014-08-01.txt")
    moves = {"slew": [("60 s", "150 s", "180 deg")], "luff": [("100 s", "160 s", "60 deg")]}
    tip = VesselTip.from_log(ship, BOOM, **moves, fold=[("200 s", "230 s", "20 deg")], every=None)
    i = np.arange(0, len(ship.t) - 1, 7)
    t = ship.t[i]
    rows = zip(t, ship.roll[i], ship.pitch[i], strict=True)
    expected = ship.heave[i] + [turned(tip, *row)[2] for row in rows] - tip.boom.tip[2]
    assert np.abs(tip.sample(t)[0] - expected).max() < ROTATION
    assert np.ptp(expected) > 5.0


def test_surge_sway_and_yaw_move_the_tip_in_the_plane_alone():
    angles = {"roll": "sine 6 deg 11 s 20 deg", "pitch": "sine 4 deg 9 s", "heave": "sine 1 m 8 s"}
    tip = VesselTip(BOOM, **angles, yaw="sine 5 deg 30 s 60 deg", surge="sine 2 m 20 s", sway="sine 1 m 25 s 90 deg")
    flat = VesselTip(BOOM, **angles)
    for t in (0.0, 3.3, 17.1):
        roll, pitch, yaw = (float(getattr(tip, name).sample(t)[0]) for name in ("roll", "pitch", "yaw"))
        shift = [float(getattr(tip, name).sample(t)[0]) for name in ("surge", "sway", "heave")]
        assert tip.place(t) == pytest.approx(turned(tip, t, roll, pitch, yaw) + shift, abs=ROTATION)
    t = np.linspace(0.0, 60.0, 601)
    np.testing.assert_array_equal(tip.sample(t), flat.sample(t))


def test_speed_and_acceleration_are_the_derivatives_while_ship_and_boom_move():
    moves = {"slew": [("5 s", "95 s", "180 deg")], "luff": [("5 s", "95 s", "70 deg")]}
    tip = VesselTip(BOOM, heave="sine 1 m 8 s", roll="sine 6 deg 11 s", pitch="sine 4 deg 9 s", **moves)
    t, h = np.linspace(7.0, 93.0, 500), 1e-3
    after, now, before = (tip.sample(t + x) for x in (h, 0.0, -h))
    for order in (0, 1):
        assert np.abs((after[order] - before[order]) / (2.0 * h) - now[order + 1]).max() < DIFFERENCES


def test_slewing_at_constant_heel_makes_the_tip_rise_as_a_sine_of_the_slew():
    heel, rate = math.radians(3.0), math.radians(1.0)
    tip = VesselTip(BOOM, roll=constant(heel), slew=[("10 s", "370 s", "630 deg")])
    t = np.linspace(11.0, 369.0, 717)
    s, v, a = tip.sample(t)
    r, psi = tip.boom.radius, math.radians(270.0) + rate * (t - 10.0)
    mean = -6.0 * math.sin(heel) - tip.boom.tip[2] * (1.0 - math.cos(heel))
    assert np.abs(s - mean - r * math.sin(heel) * np.sin(psi)).max() < ROTATION
    assert np.abs(v - r * rate * math.sin(heel) * np.cos(psi)).max() < ROTATION
    assert np.abs(a + r * rate**2 * math.sin(heel) * np.sin(psi)).max() < ROTATION
    np.testing.assert_allclose(tip.sample(390.0)[0], tip.sample(0.0)[0], atol=ROTATION)


def test_small_angles_of_the_plc_miss_what_the_sine_loses():
    heel = math.radians(10.0)
    tip = VesselTip(
        "x=0 m, y=0 m, z=0 m, slew 90 deg, main 30 m 0 deg",
        roll=constant(heel),
        unit=MotionUnit(rotations="small-angle"),
    )
    missed = float(tip.measured(50.0)[0] - tip.sample(50.0)[0])
    assert missed == pytest.approx(30.0 * heel**3 / 6.0, rel=0.002)


def test_an_ideal_unit_anywhere_on_the_ship_gives_the_true_motion():
    motions = {"heave": "sine 1 m 8 s", "roll": "sine 6 deg 11 s", "pitch": "sine 4 deg 9 s"}
    tip = VesselTip(BOOM, **motions, unit=MotionUnit(at=("30 m", "4 m", "-7 m")))
    t = np.linspace(0.0, 40.0, 401)
    for true, measured in zip(tip.sample(t), tip.measured(t), strict=True):
        assert np.abs(true - measured).max() < ROTATION


@pytest.mark.long
@pytest.mark.parametrize(
    ("period", "corner", "damping"), [(14.0, 25.0, 0.7), (8.0, 25.0, 0.5), (25.0, 25.0, 0.7), (12.0, 100.0, 1.0)]
)
def test_the_heave_filter_has_gain_and_phase_of_a_second_order_high_pass(period, corner, damping):
    unit = MotionUnit(heave_period=f"{corner} s", heave_damping=damping, delay="30 ms")
    tip = VesselTip(BOOM, heave=f"sine 1 m {period} s", unit=unit)
    w, w_c = 2.0 * math.pi / period, 2.0 * math.pi / corner
    _, response = freqs([1.0, 0.0, 0.0], [1.0, 2.0 * damping * w_c, w_c**2], worN=[w])
    H = response[0] * np.exp(-0.03j * w)
    assert unit.response(w) == pytest.approx(H)
    t = np.linspace(5.0, 305.0, 3001)
    signal = H * np.exp(1j * w * t)
    for order, measured in enumerate(tip.measured(t)):
        assert np.abs(measured - np.imag((1j * w) ** order * signal)).max() < 1e-7
    if period == corner:
        assert abs(H) == pytest.approx(1.0 / (2.0 * damping))
        assert np.angle(response[0]) == pytest.approx(math.pi / 2.0)


def test_the_filter_passes_roll_and_pitch_and_forgets_a_standing_heave():
    unit = MotionUnit(heave_period="25 s")
    rolling = VesselTip(BOOM, roll="sine 5 deg 20 s", unit=unit)
    t = np.linspace(0.0, 60.0, 61)
    np.testing.assert_allclose(rolling.measured(t), rolling.sample(t), atol=ROTATION)
    deep = VesselTip(BOOM, heave=constant(2.0), unit=unit)
    assert abs(deep.measured(350.0)[0]) < 1e-12
    assert deep.sample(350.0)[0] == pytest.approx(2.0)


@pytest.mark.long
def test_what_the_unit_gives_does_not_depend_on_how_it_is_asked():
    unit = MotionUnit(heave_period="25 s", noise_heave="2 cm", noise_angle="0.02 deg", noise_rate="0.001 rad/s", seed=3)
    t = np.arange(0.0, 200.0, 0.01)
    whole = VesselTip(BOOM, heave="sine 1 m 9 s", unit=unit).measured(t)
    pieces = VesselTip(BOOM, heave="sine 1 m 9 s", unit=unit)
    late, early = pieces.measured(t[12_000:]), pieces.measured(t[:12_000])
    np.testing.assert_array_equal(whole, np.hstack([early, late]))
    noise = whole[0] - VesselTip(BOOM, heave="sine 1 m 9 s", unit=MotionUnit(heave_period="25 s")).measured(t)[0]
    x, y, _ = pieces.boom.tip
    assert noise.std() == pytest.approx(math.hypot(0.02, math.radians(0.02) * math.hypot(x, y)), rel=0.03)


def test_a_vessel_motion_is_kept_as_text_and_ramped():
    moves = {"slew": [("20 s", "60 s", "180 deg")]}
    tip = VesselTip(BOOM, heave="sine 1 m 9 s", roll=constant(0.01), **moves, unit=MotionUnit(heave_period="25 s"))
    again = motion_from_json(motion_to_json(tip))
    assert again == tip
    t = np.linspace(0.0, 100.0, 101)
    np.testing.assert_array_equal(again.measured(t), tip.measured(t))
    ramped = Ramped(tip, "10 s")
    np.testing.assert_array_equal(np.array(ramped.measured(t))[:, 10:], np.array(tip.measured(t))[:, 10:])
    assert "up to 0.573 deg" in tip.describe()
    assert json.loads(motion_to_json(tip))["type"] == "vessel"


def test_the_error_in_swell_is_what_the_filter_leads_by():
    """Half of it in the wrong place: 49 deg at 14 s with a corner of 25 s. What the winch itself leaves adds to it."""
    unit = MotionUnit(heave_period="25 s")
    tip = VesselTip("x=0 m, y=0 m, z=8 m, slew 90 deg, main 30 m 45 deg", heave="sine 1 m 14 s", unit=unit)
    case = stillhook.Scenario(load="100 t", s_w="100 m", tip=tip, mode="ssc", duration="130 s", warm_up="60 s")
    run = stillhook.simulate(stillhook.load_crane("nov-250t"), case)
    w, t = 2.0 * math.pi / 14.0, run.time.values
    last = t > 130.0 - 5.0 * 14.0
    wave = np.exp(1j * w * t[last])
    lost = 2.0 * np.mean((run.e_c - run.e_c_measured).values[last] * np.conj(wave)) / -1j
    assert lost == pytest.approx(complex(1.0 - unit.response(w)), abs=2e-3)  # the last sample is half a step early
    left = float(run.e_c_pp_measured)
    assert float(run.e_c_pp) == pytest.approx(2.0 * abs(1.0 - unit.response(w)), abs=left)
    assert left < 0.1


def test_a_session_gives_the_bits_of_a_run_with_a_moving_vessel():
    moves = {"slew": [("2 s", "6 s", "260 deg")]}
    unit = MotionUnit(heave_period="25 s", noise_heave="1 cm", delay="20 ms")
    tip = VesselTip(BOOM, heave="sine 1 m 9 s", roll="sine 2 deg 12 s", **moves, unit=unit)
    crane = stillhook.load_crane("nov-250t")
    case = stillhook.Scenario(load="100 t", s_w="100 m", tip=tip, mode="ssc", duration="8 s", ramp="2 s", warm_up="1 s")
    run = stillhook.simulate(crane, case, every="10 ms")
    session = stillhook.Session(crane, case)
    session.step(cycles=500)
    at = int(np.argmin(np.abs(run.time.values - 5.0)))
    assert session.get("e_c") == float(run.e_c[at])
    assert session.get("e_c_measured") == float(run.e_c_measured[at])
    assert session.get("e_c") != session.get("e_c_measured")


def test_a_case_file_describes_vessel_boom_and_unit(tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(
        'crane = "nov-250t"\n[scenario]\nload = "100 t"\ns_w = "100 m"\nmode = "ssc"\n[scenario.tip]\n'
        f'boom = "{BOOM}"\nheave = "sine 1 m 14 s"\nroll = "sine 2 deg 12 s"\nslew = [["30 s", "90 s", "180 deg"]]\n'
        'unit = { heave_period = "25 s", at = ["1 m", "0 m", "-2 m"] }\n'
    )
    tip = load_case(file).case.tip
    unit = MotionUnit(heave_period="25 s", at=("1 m", "0 m", "-2 m"))
    rows = [("30 s", "90 s", "180 deg")]
    assert tip == VesselTip(BOOM, heave="sine 1 m 14 s", roll="sine 2 deg 12 s", slew=rows, unit=unit)


def test_a_case_file_takes_heave_roll_and_pitch_from_a_log(tmp_path):
    t = np.arange(0.0, 120.0, 0.5)
    rows = [f"{x},{math.sin(x):.5f},{2.0 * math.sin(x / 2.0):.5f},{math.sin(x / 3.0):.5f}" for x in t]
    (tmp_path / "mru.csv").write_text("\n".join(["time [s],heave [m],roll [deg],pitch [deg]", *rows]) + "\n")
    tip = read_tip({"file": "mru.csv", "boom": BOOM}, tmp_path)
    roll, pitch = math.radians(2.0 * math.sin(20.0)), math.radians(math.sin(40.0 / 3.0))
    expected = math.sin(40.0) + turned(tip, 40.0, roll, pitch)[2] - tip.boom.tip[2]
    assert float(tip.sample(40.0)[0]) == pytest.approx(expected, abs=1e-3)  # rounding in the log
    assert tip.duration == 119.5


REFUSED = {
    "a log's key": ({"max_gap": "3 s"}, "tip.max_gap: belongs to a log, and none is given."),
    "number": ({"heave": 2.0}, "tip.heave: 2.0 is not a text such as"),
    "unit": ({"roll": "sine 2 m 12 s"}, "roll"),
    "capsized": ({"roll": "sine 70 deg 12 s"}, "roll: 70 deg is beyond any ship."),
    "rows": ({"slew": ["30 s", "90 s", "180 deg"]}, "tip.slew: give rows of first time"),
    "order": ({"slew": [["30 s", "20 s", "180 deg"]]}, "slew: times do not increase"),
    "at once": ({"luff": [["0 s", "20 s", "60 deg"]]}, "luff: times do not increase by 1 s"),
    "too steep": ({"luff": [["10 s", "20 s", "95 deg"]]}, "boom at"),
    "corner": ({"unit": {"heave_period": "25 ms"}}, "unit: heave_period 0.025 s is not between 2 s and 1000 s."),
    "damping": ({"unit": {"heave_damping": "0.7"}}, "unit: heave_damping"),
    "rotations": ({"unit": {"rotations": "none"}}, 'unit: rotations = "none": choose exact or small-angle.'),
    "unknown": ({"unit": {"hevae_period": "25 s"}}, "hevae_period"),
    "late": ({"unit": {"delay": "20 s"}}, "unit: delay 20 s is not between 0 s and 2 s."),
    "noise": ({"unit": {"noise_heave": "-1 cm"}}, "unit: noise_heave -0.01 is negative."),
    "seed": ({"unit": {"seed": -1}}, "unit: seed = -1: give a whole number from 0."),
    "boom": ({"boom": "x=1 m"}, "is not heel, slew and main boom."),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_no_vessel_does_is_refused_in_one_line(name, tmp_path):
    changes, text = REFUSED[name]
    with pytest.raises((MotionError, ScenarioError, SeaError, stillhook.StillhookError)) as problem:
        read_tip({"boom": BOOM, "heave": "sine 1 m 14 s", **changes}, tmp_path)
    assert text in str(problem.value)
    assert "\n" not in str(problem.value)


def test_a_log_without_roll_cannot_move_a_boom(tmp_path):
    rows = [f"{x},{math.sin(x):.5f}" for x in range(60)]
    (tmp_path / "mru.csv").write_text("\n".join(["time [s],heave [m]", *rows]) + "\n")
    with pytest.raises(MotionError, match=r"mru.csv: has no roll, which the tip of a boom needs. Log it as well."):
        read_tip({"file": "mru.csv", "boom": BOOM}, tmp_path)
