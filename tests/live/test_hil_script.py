"""A script changes what a PLC reads, and what it says wrong is refused in one line."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from stillhook.errors import StillhookError
from stillhook.library.examples import HIL
from stillhook.live.hil.controller import INPUTS, SIGNALS
from stillhook.live.hil.script import Script, read_script

STEP = 0.01
RAMP = 'points = [["0 s", "0 m/s"], ["2 s", "0.4 m/s"]]'


def script(text: str, folder: Path) -> Script:
    path = folder / "script.toml"
    path.write_text(text)
    return read_script(path)


def row(name: str, action: str, at: str = "1 s", until: str = "3 s") -> str:
    return f'[[input]]\nname = "{name}"\nat = "{at}"\nuntil = "{until}"\n{action}\n'


def applied(of: Script, seconds: float = 4.0) -> np.ndarray:
    """Inputs over some seconds where s_tip is the time [m], F is 1 MN and all else is 0, all of them good."""
    rows = []
    for k in range(round(seconds / STEP)):
        inputs = np.concatenate([np.zeros(len(SIGNALS)), np.ones(len(SIGNALS)), [0.0]])
        inputs[[INPUTS.index("s_tip"), INPUTS.index("F")]] = k * STEP, 1e6
        rows.append(of.apply(k * STEP, inputs))
    return np.array(rows)


def at(rows: np.ndarray, name: str, seconds: float) -> float:
    return float(rows[round(seconds / STEP), INPUTS.index(name)])


@pytest.mark.parametrize(
    ("name", "action", "before", "within", "after"),
    [
        ("s_tip", 'value = "25 cm"', 0.5, 0.25, 3.5),
        ("s_tip", 'offset = "10 cm"', 0.5, 2.1, 3.5),
        ("s_tip", "stuck = true", 0.5, 1.0, 3.5),
        ("v_tip", RAMP, 0.0, 0.2, 0.0),
        ("F", 'value = "20 kN"', 1e6, 2e4, 1e6),
        ("mode", 'value = "ssc"', 0.0, 5.0, 0.0),
        ("mode", "value = 4", 0.0, 4.0, 0.0),
        ("reset", "value = 1", 0.0, 1.0, 0.0),
        ("p_a", 'value = "100 bar"', 0.0, 1e7, 0.0),
        ("f_pump", 'value = "50 %"', 0.0, 0.5, 0.0),
    ],
)
def test_an_input_is_changed_within_its_time_and_no_other(
    name: str, action: str, before: float, within: float, after: float, tmp_path: Path
):
    rows = applied(script(row(name, action), tmp_path))
    assert [at(rows, name, t) for t in (0.5, 2.0, 3.5)] == pytest.approx([before, within, after])
    untouched = np.delete(rows, INPUTS.index(name), axis=1)
    assert np.array_equal(untouched, np.delete(applied(Script()), INPUTS.index(name), axis=1))


def test_a_lost_input_is_no_number_of_bad_quality(tmp_path: Path):
    rows = applied(script(row("s_w", "lost = true"), tmp_path))
    assert math.isnan(at(rows, "s_w", 2.0))
    assert [at(rows, "q_s_w", t) for t in (0.5, 2.0, 3.5)] == [1.0, 0.0, 1.0]


def test_noise_has_its_size_and_is_the_same_each_time(tmp_path: Path):
    text = row("F", 'noise = "5 kN"', "0 s", "100 s")
    one, two = (applied(script(text, tmp_path), 60.0)[:, INPUTS.index("F")] for _ in range(2))
    assert np.array_equal(one, two)
    assert np.std(one) == pytest.approx(5e3, rel=0.05)
    assert np.mean(one) == pytest.approx(1e6, abs=300.0)


def test_rows_act_one_after_another(tmp_path: Path):
    rows = applied(script(row("s_tip", 'value = "1 m"') + row("s_tip", 'offset = "1 cm"'), tmp_path))
    assert at(rows, "s_tip", 2.0) == pytest.approx(1.01)


def test_wire_that_the_operator_asks_for_is_the_integral_of_the_speed(tmp_path: Path):
    rows = applied(script(row("v_op", RAMP), tmp_path))
    assert at(rows, "s_op", 2.99) == pytest.approx(0.4, rel=0.01)  # 0.4 m/s reached over 2 s
    assert at(rows, "s_op", 3.9) == pytest.approx(at(rows, "s_op", 3.1))
    own = script(row("v_op", RAMP) + row("s_op", 'value = "7 m"'), tmp_path)
    assert at(applied(own), "s_op", 2.0) == 7.0


def test_the_example_is_a_script(tmp_path: Path):
    rows = applied(script((HIL / "script.toml").read_text(), tmp_path), 45.0)
    assert at(rows, "v_op", 15.0) == pytest.approx(0.2)
    assert at(rows, "reset", 38.5) == 1.0


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (row("s_wire", 'value = "1 m"'), 'input "s_wire": name = "s_wire": no input'),
        (row("s_w", 'value = "1 bar"'), 'input "s_w": value = "1 bar": unit'),
        (row("s_w", "value = 1"), 'input "s_w": value = 1: a bare number'),
        (row("s_w", ""), "give one of value, points, offset, noise, stuck, lost; it has none"),
        (row("s_w", "lost = true\nstuck = true"), "it has stuck, lost"),
        (row("s_w", "lost = true", "3 s", "1 s"), "ends before it begins"),
        (row("s_w", "lost = 1"), 'input "s_w": lost = 1'),
        (row("s_w", 'noise = "-1 m"'), "not negative"),
        (row("v_op", 'points = [["0 s", "1 m/s"]]'), "two or more pairs"),
        (row("v_op", 'points = [["2 s", "1 m/s"], ["1 s", "0 m/s"]]'), "times must increase"),
        (row("v_op", 'points = [["0 s", "1 m/s"], ["1 s", "nan m/s"]]'), "points"),
        (row("mode", 'value = "sscc"'), "choose one of manual"),
        (row("reset", "lost = true"), "reset has no quality"),
        (row("s_w", 'value = "1 m"', "-1 s"), 'input "s_w": at = '),
        (row("s_w", 'value = "1 m"\nwhen = 1'), "when"),
        ("input = 3\n", "input"),
        ("", "Write rows [[input]]"),
    ],
)
def test_what_a_script_says_wrong_is_refused_in_one_line(text: str, line: str, tmp_path: Path):
    with pytest.raises(StillhookError) as refused:
        script(text, tmp_path)
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)
