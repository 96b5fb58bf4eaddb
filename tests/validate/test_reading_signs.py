"""Signs of heave-compensated logs: every flip is named in one line, and no good log is blamed."""

import numpy as np
import pytest
from tests.validate.crane_logs import COLUMNS, ahc, changed, manual, signals, write

from stillhook.errors import LogError
from stillhook.logs.log import read_log
from stillhook.validate.data_set.campaign import load_campaign

END = "Hoisting and up are positive, p_a is the hoisting side."


def flipped(*names):
    """The mapping with some signals turned round."""
    return {n: f'{{ column = "{COLUMNS[n][0]}", unit = "{COLUMNS[n][1]}", sign = -1 }}' for n in names}


SWAPPED = {"p_a": '{ column = "PT B", unit = "bar" }', "p_b": '{ column = "PT A", unit = "bar" }'}


def only(*names):
    return {n: None for n in COLUMNS if n not in ("time", *names)}


def read(folder, frame, rows, every="10 ms"):
    (test,) = load_campaign(write(folder, frame, rows=signals(**rows))).tests
    return read_log(test.log, test.mapping, every=every)


def said(folder, frame, rows, **more):
    with pytest.raises(LogError) as caught:
        read(folder, frame, rows, **more)
    text = str(caught.value)
    assert text.startswith("x.csv: signs contradict each other. In the mapping ")
    assert text.endswith(END)
    assert "\n" not in text
    return text.removeprefix("x.csv: signs contradict each other. In the mapping ").removesuffix(f". {END}")


@pytest.mark.slow
@pytest.mark.parametrize("every", ["10 ms", "0.1 s"])
def test_swapped_pressure_lines_are_named_although_a_passive_system_carries_the_load(tmp_path, every):
    told = said(tmp_path, ahc(), SWAPPED, every=every)
    assert (
        told
        == "swap the columns of p_a and p_b: friction makes the pressure drop higher when hoisting, and here it is lower"
    )


@pytest.mark.slow
def test_swapped_pressure_lines_are_named_in_a_test_without_heave_compensation_too(tmp_path):
    assert said(tmp_path, manual(), SWAPPED).startswith("swap the columns of p_a and p_b: ")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "against"),
    [
        ("s_tip", "v_tip, omega_m, v_w, s_w and u_p"),
        ("v_tip", "s_tip, omega_m, v_w, s_w, u_p and a_tip"),
        ("a_tip", "v_tip"),
        ("v_w", "omega_m, s_w, u_p, s_tip and v_tip"),
        ("omega_m", "v_w, s_w, u_p, s_tip and v_tip"),
        ("u_p", "omega_m, v_w, s_w, s_tip and v_tip"),
    ],
)
def test_one_flipped_signal_is_told_from_all_the_others(tmp_path, name, against):
    assert said(tmp_path, ahc(), flipped(name)) == f"set sign = 1 for {name}: it contradicts {against}"


@pytest.mark.slow
def test_a_wire_that_is_counted_the_other_way_takes_an_offset_as_well(tmp_path):
    frame = ahc()
    counted = changed(frame, "Wire out", 2831.0 - frame["Wire out"].to_numpy())  # wire on the drum
    assert said(tmp_path, counted, {}) == (
        "set sign = -1 and an offset that makes it the wire out for s_w: it contradicts omega_m, v_w, u_p, s_tip and v_tip"
    )


@pytest.mark.slow
def test_all_signals_of_the_tip_flipped_are_named_together(tmp_path):
    told = said(tmp_path, ahc(), flipped("s_tip", "v_tip", "a_tip"))
    assert (
        told
        == "set sign = 1 for s_tip, set sign = 1 for v_tip and set sign = 1 for a_tip: they contradict omega_m, v_w, s_w and u_p"
    )


def test_a_flipped_speed_and_swapped_lines_are_both_named(tmp_path):
    told = said(tmp_path, ahc(), flipped("omega_m") | SWAPPED)
    assert told.startswith("set sign = 1 for omega_m: it contradicts ")
    assert "; swap the columns of p_a and p_b: friction" in told


@pytest.mark.slow
def test_a_flipped_error_of_the_plc_is_named(tmp_path):
    told = said(tmp_path, ahc(), flipped("e_c_measured"))
    assert told == "set sign = 1 for e_c_measured: it runs against s_tip - s_w, and too little wire out is positive"


@pytest.mark.slow
def test_a_wire_that_pushes_is_named(tmp_path):
    assert (
        said(tmp_path, ahc(), flipped("F_w"))
        == "set sign = 1 for F_w: it is negative throughout, and tension is positive"
    )


def test_where_two_signals_are_all_there_is_both_ways_out_are_named(tmp_path):
    told = said(tmp_path, ahc(), flipped("s_tip") | only("s_tip", "s_w"))
    assert (
        told
        == "set sign = 1 for s_tip, or set sign = -1 and an offset that makes it the wire out for s_w: it contradicts s_w"
    )


@pytest.mark.thorough
@pytest.mark.parametrize("noise", [1.0, 5.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_good_log_is_not_blamed_however_noisy(tmp_path, seed, noise):
    frame = ahc(140.0, seed)
    rng = np.random.default_rng(seed)
    for heading, size in (
        ("Tip pos", 2e-3),
        ("Tip speed", 5e-3),
        ("Tip acc", 0.02),
        ("PT A", 1.0),
        ("PT B", 1.0),
        ("AHC error", 2.0),
        ("Load cell", 5.0),
    ):
        frame = changed(
            frame, heading, np.round(frame[heading].to_numpy() + noise * size * rng.standard_normal(len(frame)), 4)
        )
    read(tmp_path, frame, {})


@pytest.mark.slow
def test_a_tip_that_moves_above_a_winch_in_manual_mode_says_nothing_of_signs(tmp_path):
    frame = manual()
    t = frame["Time"].to_numpy()
    for sign in (1.0, -1.0):
        moving = changed(changed(frame, "Tip pos", sign * np.sin(0.7 * t)), "Tip speed", sign * 0.7 * np.cos(0.7 * t))
        read(tmp_path, changed(moving, "Tip acc", -sign * 0.49 * np.sin(0.7 * t)), {})


@pytest.mark.slow
def test_stuck_and_cut_off_sensors_are_found_in_narrow_bins_as_in_wide_ones(tmp_path):
    """Checks look at a tenth of a second, however narrow the bins are."""
    frame = ahc()
    p_a = frame["PT A"].to_numpy().copy()
    p_a[4000:4600] = p_a[4000]
    p_b = np.minimum(frame["PT B"].to_numpy(), np.percentile(frame["PT B"].to_numpy(), 97.0).round(1))
    spoiled = changed(changed(frame, "PT A", p_a), "PT B", p_b)
    found = [
        {(f.signal, f.kind) for f in read(tmp_path, spoiled, {}, every=every).findings if f.action == "noted"}
        for every in ("10 ms", "0.1 s")
    ]
    assert found[0] == found[1]
    assert {("p_a", "stuck"), ("p_b", "saturated")} <= found[0]
