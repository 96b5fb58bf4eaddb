"""Motions as texts and constructors: what is read, what is refused and in which words, what is stored and read back."""

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stillhook.errors import MotionError, StillhookError, UnitError
from stillhook.sea.motion.motion import Motion, Profile, Ramped, Sine, Still, Sum
from stillhook.sea.motion.recorded import Recorded
from stillhook.sea.motion.text import motion_from_dict, motion_from_json, motion_to_json
from stillhook.sea.motion.words import parse_motion

RECORD = Recorded(np.arange(7.0) + 0.1, np.sin(np.arange(7.0)), source="log.csv", report="Read.")
EXAMPLES: list[Motion] = [
    Still(),
    Sine(amplitude="2.8 m", period="12 s", phase="30 deg"),
    Sine(height="2 m", period="13 s") + Sine(height="0.5 m", period="6 s"),
    Profile(points=[("0 s", "0 m/min"), ("5 s", "40 m/min"), ("10 s", "0 m/min")]),
    RECORD,
    Ramped(RECORD + Sine(height="2 m", period="13 s"), "20 s"),
]


def test_text_names_sines_sums_and_stillness() -> None:
    assert parse_motion("still") == Still()
    assert parse_motion("sine 2.8 m 12 s") == Sine(amplitude="2.8 m", period="12 s")
    assert parse_motion(" Sine  250 cm  0.2 min  90 deg ") == Sine(amplitude="2.5 m", period="12 s", phase="90 deg")
    both = parse_motion("sine 2 m 13 s + sine 0.5 m 6 s -90 deg")
    assert both == Sine(amplitude="2 m", period="13 s") + Sine(amplitude="0.5 m", period="6 s", phase="-90 deg")
    assert parse_motion("sine 2e+0 m 1.3e+1 s") == Sine(amplitude="2 m", period="13 s")


def test_a_wave_height_is_twice_an_amplitude() -> None:
    assert Sine(height="2 m", period="12 s") == Sine(amplitude="1 m", period="12 s")


@pytest.mark.parametrize(
    ("text", "error", "says"),
    [
        ("", MotionError, 'tip: "": "" is not a motion. Allowed: "still", "sine <amplitude> <period> [<phase>]"'),
        ("sinus 2 m 12 s", MotionError, '"sinus 2 m 12 s" is not a motion'),
        ("still 2 m", MotionError, '"still 2 m" is not a motion'),
        ("sine", MotionError, "not 0 quantities"),
        ("sine 2 m", MotionError, 'not 1 quantities. Write "sine 2.8 m 12 s"'),
        ("sine 2 m 12 s 90 deg 3 m", MotionError, "not 4 quantities"),
        ("sine 12 s 2 m", UnitError, 'amplitude = "12 s": unit "s" is not one of m, cm, mm, km.'),
        ("sine 2 12", UnitError, 'amplitude = "2": no unit; write "2 m"'),
        ("sine 2,8 m 12 s", UnitError, 'a comma in the number; write a point, "2.8 m".'),
        ("sine 2.8m 12s", UnitError, 'no space before the unit; write "2.8 m".'),
        ("sine nan m 12 s", UnitError, 'amplitude = "nan m": not a finite number'),
        ("sine 2 m 12 s 1 m", UnitError, 'phase = "1 m": unit "m" is not one of rad, deg, rev.'),
        ("sine -2 m 12 s", MotionError, "amplitude -2 m is not between 0 m and 50 m"),
        ("sine 2 km 12 s", MotionError, "amplitude 2000 m is not between 0 m and 50 m"),
        ("sine 2 m 0 s", MotionError, "period 0 s is not between 0.1 s and 3600 s"),
        ("sine 2 m 12 ms", MotionError, "period 0.012 s is not between 0.1 s and 3600 s"),
        ("sine 2 m 12 s +", MotionError, '"" is not a motion'),
        ("+ sine 2 m 12 s", MotionError, '"" is not a motion'),
        ("sine 2 m 12 s + + still", MotionError, '"" is not a motion'),
        ("sine 2 m 12 s - sine 1 m 6 s", MotionError, "not 4 quantities"),
        ("sine 2 m 12 s\nstill\x00", UnitError, r'unit "s still\x00" is not one of'),
        (None, MotionError, "tip: nothing is not a motion"),
        (2.0, MotionError, "tip: 2.0 is not a motion"),
    ],
)
def test_bad_texts_are_refused_in_one_line(text: object, error: type[StillhookError], says: str) -> None:
    with pytest.raises(error) as caught:
        parse_motion(text, "tip")  # type: ignore[arg-type]
    assert says in str(caught.value)
    assert str(caught.value).startswith("tip: ")
    assert "\n" not in str(caught.value)


@pytest.mark.slow
@given(st.text(max_size=60))
def test_any_text_is_a_motion_or_a_one_line_error(text: str) -> None:
    try:
        parse_motion("sine 1 m 5 s + " + text)
    except StillhookError as problem:
        text = str(problem).splitlines()
        assert len(text) == 1
        assert len(text[0]) < 700


@pytest.mark.parametrize("motion", EXAMPLES, ids=lambda m: m.kind)
def test_every_motion_survives_storing_to_the_bit(motion: Motion) -> None:
    text = motion_to_json(motion)
    assert "\n" not in text
    back = motion_from_json(text)
    assert back == motion
    assert hash(back) == hash(motion)
    assert motion_from_dict(motion.to_dict()) == motion


@pytest.mark.parametrize("motion", EXAMPLES[:3], ids=lambda m: m.kind)
def test_what_describe_says_can_be_read_back(motion: Motion) -> None:
    t = np.linspace(0.0, 50.0, 101)
    assert np.allclose(parse_motion(motion.describe()).sample(t), motion.sample(t), atol=1e-4)


@pytest.mark.parametrize("motion", EXAMPLES, ids=lambda m: m.kind)
def test_samples_have_the_shape_of_the_times_and_one_line_describes_them(motion: Motion) -> None:
    for t in (1.0, np.zeros(3), np.ones((2, 4))):
        assert all(np.shape(x) == np.shape(t) for x in motion.sample(t))
    assert "\n" not in motion.describe()


@pytest.mark.parametrize(
    ("stored", "says"),
    [
        ("", 'stored motion: "" is not JSON'),
        ("[]", "stored motion: [] is not a table"),
        ('{"type": "sawtooth"}', 'type "sawtooth" is not one of still, sine, sum, profile, ramped, recorded'),
        ("{}", "type nothing is not one of"),
        ('{"type": "sine", "amplitude": 1}', 'type "sine" lacks or misstates'),
        ('{"type": "sine", "amplitude": "x", "period": 1, "phase": 0}', 'type "sine" lacks or misstates'),
        ('{"type": "recorded", "times": "!", "heights": "!"}', "stored record"),
        ('{"type": "profile", "t": 3, "v": 4}', 'type "profile" lacks or misstates'),
    ],
)
def test_damaged_stores_are_refused_in_one_line(stored: str, says: str) -> None:
    with pytest.raises(MotionError) as caught:
        motion_from_json(stored)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Sine(period="12 s"), "neither of amplitude and height given"),
        (lambda: Sine(amplitude="1 m", height="2 m", period="12 s"), "both of amplitude and height given"),
        (lambda: Sine(height=2, period="12 s"), 'Sine: height = 2: a bare number; write it as text with its unit, "2'),
        (lambda: Sum([]), "no motions given"),
        (lambda: Sum(["still"]), "'still' is not a motion"),
        (lambda: Profile(points=[]), "Give two or more points"),
        (lambda: Profile(points=["5 s"]), "a point is not a pair"),
        (lambda: Profile(points=[("0 s", "1 m/s"), ("5 s", "0 m/s")]), "starts at 0 s with 1 m/s"),
        (lambda: Profile(points=[("0 s", "0 m/s"), ("5 s", "1 m/s")]), "ends with 1 m/s. End at rest"),
        (lambda: Profile(points=[("0 s", "0 m/s"), ("5 s", "1 m/s"), ("5 s", "0 m/s")]), "point 3 at 5 s does not c"),
        (lambda: Profile(points=[("0 s", "0 m/s"), ("5 m", "0 m/s")]), "time of point 2"),
        (lambda: Ramped(Still(), "0 s"), "t_ramp 0 s is shorter than 1e-06 s"),
        (lambda: Ramped("still", "10 s"), "'still' is not a motion"),
    ],
)
def test_constructors_refuse_in_one_line(make: object, says: str) -> None:
    with pytest.raises(StillhookError) as caught:
        make()  # type: ignore[operator]
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_motions_start_without_the_heavy_libraries() -> None:
    code = (
        "import sys, stillhook.sea.motion.text, stillhook.sea.vessel.ship_motion, stillhook.formats.motion.psxn, stillhook.formats.motion.open;"
        "print([name for name in ('scipy', 'duckdb', 'pydantic', 'pint', 'xarray', 'numba') if name in sys.modules])"
    )
    paths = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=paths)
    assert done.stdout.strip() == "[]"
