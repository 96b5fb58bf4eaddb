"""Signs that contradict each other are refused with the row of the mapping to write."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from tests.identify.refusals import refused

from stillhook.logs.log import check_signs, mapping_from, read_log
from stillhook.logs.signs import _pull

pytestmark = pytest.mark.slow


def flipped(staircase, *names):
    return staircase.with_columns(**{name: -staircase[name] for name in names})


def only(staircase, *names):
    return dataclasses.replace(staircase, columns={name: staircase[name] for name in ("time", *names)})


def swapped(staircase):
    return staircase.with_columns(p_a=staircase["p_b"], p_b=staircase["p_a"])


END = "Hoisting is positive, p_a is the hoisting side."
LIGHT = {"load": 2.0}  # an active circuit next to a passive one that carries the load


@pytest.mark.parametrize(
    ("how", "change", "parts"),
    [
        (
            {},
            lambda s: flipped(s, "omega_m"),
            ["set sign = -1 for omega_m: the pressure drop is higher when it is negative"],
        ),
        ({}, lambda s: flipped(s, "u_p"), ["set sign = -1 for u_p: it runs against omega_m (the pressures agree with"]),
        (
            {},
            swapped,
            ["swap the columns of p_a and p_b: the pressure drop is negative with a hanging load (map p_hp if"],
        ),
        ({}, lambda s: flipped(s, "omega_m", "u_p"), ["set sign = -1 for omega_m", "u_p"]),
        ({}, lambda s: flipped(s, "s_w"), ["set sign = -1 for s_w: it grows while omega_m is positive"]),
        (
            {},
            lambda s: only(flipped(s, "u_p"), "omega_m", "u_p"),
            ["set sign = -1 for u_p: it runs against omega_m (or for the speed, whichever counts hoisting negative)"],
        ),
        (
            LIGHT,
            lambda s: only(flipped(s, "omega_m"), "p_a", "p_b", "omega_m"),
            ["swap the columns of p_a and p_b, or set sign = -1 for omega_m"],
        ),
        (
            LIGHT,
            lambda s: flipped(s, "omega_m"),
            ["set sign = -1 for omega_m: friction makes the pressure drop higher", "the pump command runs against"],
        ),
    ],
    ids=["speed", "command", "pressures", "lowering positive", "wire", "no pressures", "light, no command", "light"],
)
def test_signs_that_contradict_each_other_are_refused_with_what_to_write(tmp_path, make_staircase, how, change, parts):
    line = refused(read_log, change(make_staircase(**how)).write(tmp_path / "f.csv"))
    assert line.startswith("f.csv: signs contradict each other. In the mapping ")
    assert line.endswith(END)
    assert all(part in line for part in parts), line


def test_without_a_hanging_load_right_signs_have_no_findings(tmp_path, make_staircase):
    assert read_log(make_staircase(**LIGHT).write(tmp_path / "light.csv")).findings == ()


def test_a_passive_system_that_carries_more_than_the_load_is_no_swap(tmp_path, make_staircase):
    over = make_staircase(load=-40.0)
    over = over.with_columns(p_hp=300.0 + over["p_b"], p_b=over["p_b"] + 60.0, p_a=over["p_a"] + 60.0)
    header = "time [s],p_a [bar],p_b [bar],omega_m [rev/min],u_p [%],s_w [m],p_hp [bar]"
    assert not any(f.kind == "flipped" for f in read_log(over.write(tmp_path / "over.csv", header=header)).findings)


def test_a_sign_that_the_mapping_holds_is_turned_round_again(tmp_path, staircase):
    units = {"time": "s", "p_a": "bar", "p_b": "bar", "omega_m": "rev/min"}
    rows = {name: {"column": name, "unit": unit} for name, unit in units.items()}
    rows["omega_m"]["sign"] = -1
    line = refused(read_log, staircase.write(tmp_path / "f.csv"), mapping_from(rows, "m"))
    assert "set sign = 1 for omega_m" in line


def test_too_little_motion_judges_nothing(tmp_path, staircase):
    short = flipped(staircase, "omega_m").rows(np.arange(len(staircase)) < 700)
    check_signs(read_log(short.write(tmp_path / "short.csv"), None))


def logged(tension) -> SimpleNamespace:
    return SimpleNamespace(signals={"F_w": tension}, doubtful={"F_w": np.zeros(len(tension), np.bool_)})


@pytest.mark.parametrize(
    ("pushing", "named"),
    [(1.0, True), (0.995, True), (0.98, False), (0.6, False), (0.0, False)],
    ids=["throughout", "but for spikes", "but for a fiftieth", "most of the time", "never"],
)
def test_a_tension_that_is_negative_throughout_is_named_and_a_few_spikes_hide_nothing(pushing, named):
    """A wire cannot push."""
    tension = np.where(np.arange(1000) < round(1000 * pushing), -2e5, 1e5)
    assert bool(_pull(logged(tension), lambda name: f"set sign = -1 for {name}")) == named


def test_a_wire_that_hangs_slack_does_not_push_and_no_tension_says_nothing():
    assert _pull(logged(np.zeros(100)), str) == []
    assert _pull(logged(np.full(100, np.nan)), str) == []
    assert _pull(SimpleNamespace(signals={}), str) == []
