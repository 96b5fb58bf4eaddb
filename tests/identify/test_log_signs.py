"""Signs that contradict each other are refused with the row of the mapping to write."""

import numpy as np
import pytest

from stillhook.errors import LogError
from stillhook.logs.log import check_signs, read_log


def refusal(path):
    with pytest.raises(LogError) as caught:
        read_log(path)
    return str(caught.value)


def flipped(staircase, *names):
    return staircase.with_columns(**{name: -staircase[name] for name in names})


def only(staircase, *names):
    return staircase.with_columns().__class__({name: staircase[name] for name in ("time", *names)})


END = "Hoisting is positive, p_a is the hoisting side."


@pytest.mark.slow
def test_a_flipped_motor_speed_is_refused(tmp_path, staircase):
    assert refusal(flipped(staircase, "omega_m").write(tmp_path / "f.csv")) == (
        "f.csv: signs contradict each other. In the mapping set sign = -1 for omega_m: the pressure drop is higher when it is negative, and "
        f"hoisting must be positive. {END}"
    )


@pytest.mark.slow
def test_a_flipped_command_is_refused(tmp_path, staircase):
    assert refusal(flipped(staircase, "u_p").write(tmp_path / "f.csv")) == (
        f"f.csv: signs contradict each other. In the mapping set sign = -1 for u_p: it runs against omega_m (the pressures agree with the speed). {END}"
    )


@pytest.mark.slow
def test_swapped_pressures_are_refused(tmp_path, staircase):
    swapped = staircase.with_columns(p_a=staircase["p_b"], p_b=staircase["p_a"])
    assert refusal(swapped.write(tmp_path / "f.csv")) == (
        "f.csv: signs contradict each other. In the mapping swap the columns of p_a and p_b: the pressure drop is negative with a hanging load "
        f"(map p_hp if a passive system carries it). {END}"
    )


@pytest.mark.slow
def test_everything_that_counts_lowering_positive_is_refused(tmp_path, staircase):
    said = refusal(flipped(staircase, "omega_m", "u_p").write(tmp_path / "f.csv"))
    assert "set sign = -1 for omega_m" in said
    assert "u_p" in said


@pytest.mark.slow
def test_a_flipped_wire_is_refused(tmp_path, staircase):
    assert refusal(flipped(staircase, "s_w").write(tmp_path / "f.csv")) == (
        "f.csv: signs contradict each other. In the mapping set sign = -1 for s_w: it grows while omega_m is positive, and wire paid out must "
        f"shrink when hoisting. {END}"
    )


def test_without_pressures_either_of_command_and_speed_may_be_wrong(tmp_path, staircase):
    said = refusal(only(flipped(staircase, "u_p"), "omega_m", "u_p").write(tmp_path / "f.csv"))
    assert (
        "set sign = -1 for u_p: it runs against omega_m (or for the speed, whichever counts hoisting negative)" in said
    )


@pytest.mark.slow
def test_without_a_hanging_load_both_ways_out_are_named(tmp_path, make_staircase):
    light = make_staircase(load=2.0)  # an active circuit next to a passive one that carries the load
    assert read_log(light.write(tmp_path / "light.csv")).findings == ()
    said = refusal(only(flipped(light, "omega_m"), "p_a", "p_b", "omega_m").write(tmp_path / "f.csv"))
    assert "swap the columns of p_a and p_b, or set sign = -1 for omega_m" in said
    assert refusal(flipped(light, "omega_m").write(tmp_path / "g.csv")) == (
        "g.csv: signs contradict each other. In the mapping set sign = -1 for omega_m: friction makes the pressure drop higher when hoisting, and "
        f"here it is lower, and the pump command runs against the speed. {END}"
    )


@pytest.mark.slow
def test_a_passive_system_that_carries_more_than_the_load_is_no_swap(tmp_path, make_staircase):
    over = make_staircase(load=-40.0)
    over = over.with_columns(p_hp=300.0 + over["p_b"], p_b=over["p_b"] + 60.0, p_a=over["p_a"] + 60.0)
    header = "time [s],p_a [bar],p_b [bar],omega_m [rev/min],u_p [%],s_w [m],p_hp [bar]"
    assert not any(f.kind == "flipped" for f in read_log(over.write(tmp_path / "over.csv", header=header)).findings)


@pytest.mark.slow
def test_a_sign_that_the_mapping_holds_is_turned_round_again(tmp_path, staircase):
    from stillhook.logs.log import mapping_from

    names = {"p_a": "bar", "p_b": "bar", "omega_m": "rev/min"}
    rows = {name: {"column": name, "unit": unit} for name, unit in names.items()} | {
        "time": {"column": "time", "unit": "s"}
    }
    rows["omega_m"]["sign"] = -1
    with pytest.raises(LogError) as caught:
        read_log(staircase.write(tmp_path / "f.csv"), mapping_from(rows, "m"))
    assert "set sign = 1 for omega_m" in str(caught.value)


def test_too_little_motion_judges_nothing(tmp_path, staircase):
    short = flipped(staircase, "omega_m").rows(np.arange(len(staircase)) < 700)
    check_signs(read_log(short.write(tmp_path / "short.csv"), None))
