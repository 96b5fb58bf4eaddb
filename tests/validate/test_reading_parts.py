"""A record in parts: modes in the PLC's own words, loads from the cell, wire and tip from what there is."""

import numpy as np
import polars as pl
import pytest
from tests.validate.crane_logs import ahc, changed, manual, read, signals

from stillhook.errors import LogError, ValidateError
from stillhook.spec.scenario import Mode
from stillhook.units import show

pytestmark = pytest.mark.slow

HOOK, G = 3.0, 9.80665


def refusal(folder, frame, **more):
    with pytest.raises((LogError, ValidateError)) as caught:
        read(folder, frame, **more)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def half_on(frame: pl.DataFrame, on, off, start: float = 40.0) -> pl.DataFrame:
    """The log with another sign for its mode before and after a moment."""
    return frame.with_columns(pl.Series("Mode", [on if t >= start else off for t in frame["Time"]]))


# --- modes -----------------------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("on", "off", "modes"),
    [
        (5, 0, ""),
        (17, 4, '17 = "ssc"\n4 = "manual"'),
        ("AHC on", "off", '"AHC on" = "ssc"\noff = "manual"'),
        ("AHC ON", "Off", '"ahc on" = "ssc"\noff = "manual"'),
        (True, False, 'true = "ssc"\nfalse = "manual"'),
    ],
)
def test_a_part_with_heave_compensation_is_found_in_whatever_the_log_calls_it(tmp_path, on, off, modes):
    record = read(tmp_path, half_on(ahc(), on, off), modes=modes)
    (segment,) = record.segments
    assert segment.mode is Mode.SSC
    assert segment.start == pytest.approx(40.0, abs=0.015)
    assert set(np.unique(record.signals["mode"])) == {0.0, 5.0}
    assert any(
        "100 s of 140 s are used, from 40 s on; in 40 s the winch did not compensate" in text
        for text in record.statements
    )


def test_modes_that_change_part_the_record(tmp_path):
    frame = ahc()
    record = read(tmp_path, half_on(frame, 5, 3, 70.0))
    assert [s.mode for s in record.segments] == [Mode.NS, Mode.SSC]


def test_a_number_without_a_meaning_is_refused_with_what_to_write(tmp_path):
    text = refusal(tmp_path, half_on(ahc(), 17, 0))
    assert text.startswith(
        'test "1": mode: the log holds 17 for 100 s, which is not one of 0, 1, 2, 3, 4, 5, 6, 7. State its meaning'
    )
    assert text.endswith('[modes], such as "5" = "ssc".')


def test_a_mean_of_two_modes_in_one_bin_is_no_mode(tmp_path):
    """At 1 kHz the bin in which the mode changes holds both."""
    frame = half_on(ahc(), 5, 0, 70.004)
    t = np.arange(0.0, 139.0, 0.001)
    own = frame["Time"].to_numpy()
    fast = pl.DataFrame(
        {h: (np.round(t, 4) if h == "Time" else np.interp(t, own, frame[h].to_numpy())) for h in frame.columns}
    )
    fast = fast.with_columns(pl.Series("Mode", np.where(t < 70.004, 0, 5)))
    record = read(tmp_path, fast)
    assert set(np.unique(record.signals["mode"])) == {0.0, 5.0}
    assert len(record.segments) == 1


def test_without_a_mode_in_the_log_the_stated_one_holds_throughout(tmp_path):
    rows = signals(mode=None)
    (segment,) = read(tmp_path, ahc(), rows=rows, test='load = "90 t"\nmode = "ns"').segments
    assert segment.mode is Mode.NS
    text = refusal(tmp_path, ahc(), rows=rows)
    assert text.startswith(
        'test "1": mode: missing. State the mode of the PLC in the campaign file, or map a signal mode; one of level-1,'
    )


def test_a_stated_mode_that_the_log_never_is_in_is_refused(tmp_path):
    text = refusal(tmp_path, half_on(ahc(), 1, 0), test='load = "90 t"\nmode = "ssc"')
    assert (
        'mode = "ssc" is stated, but the log contains manual and level-1. State what the numbers of the log mean'
        in text
    )


def test_a_log_without_heave_compensation_gives_no_load_case_and_says_so(tmp_path):
    record = read(tmp_path, manual(), test='load = "0 t"')
    assert record.segments == ()
    assert record.statements[0].endswith("none of it is used. The winch was in manual mode throughout.")


def test_a_short_log_is_told_to_be_too_short(tmp_path):
    record = read(tmp_path, ahc()[:4000])
    assert record.segments == ()
    assert "no uninterrupted part of at least 60 s has one mode" in record.statements[-1]


def test_moves_of_the_operator_while_compensating_are_told(tmp_path):
    frame = ahc()
    v_op = frame["Joystick"].to_numpy().copy()
    v_op[5000:5300], v_op[9000:9100] = 3.0, -3.0
    record = read(tmp_path, changed(frame, "Joystick", v_op))
    assert len(record.segments) == 1
    assert any(
        "the operator moves the wire 2 times while the winch compensates, 4 s in all" in text
        for text in record.statements
    )


# --- loads -----------------------------------------------------------------------------------------------------------------------------------


def heavier(frame: pl.DataFrame, tonnes: float, start: float, ramp: float = 0.0) -> pl.DataFrame:
    t = frame["Time"].to_numpy()
    return changed(
        frame,
        "Load cell",
        frame["Load cell"].to_numpy() + tonnes * G * np.clip((t - start) / max(ramp, 1e-9), 0.0, 1.0),
    )


def test_the_load_comes_from_the_cell_where_it_is_not_stated(tmp_path):
    record = read(tmp_path, ahc(), test="")
    assert record.segments[0].load == pytest.approx(90e3, abs=300.0)  # a tenth of a per cent of the cell's range
    assert any(
        f"the load is not stated; it is {show(record.segments[0].load, 'mass')} from" in text
        for text in record.statements
    )


def test_a_payload_in_water_weighs_less_and_its_load_is_found_again(tmp_path):
    volume, rho = 10.0, 1025.0
    lighter = heavier(ahc(), -volume * rho / 1e3, -1.0)
    record = read(tmp_path, lighter, test=f'water = {{ volume = "{volume} m^3" }}')
    assert record.segments[0].load == pytest.approx(90e3, abs=300.0)
    assert not any(
        "load cell shows" in text
        for text in read(tmp_path, lighter, test=f'load = "90 t"\nwater = {{ volume = "{volume} m^3" }}').statements
    )


@pytest.mark.parametrize("ramp", [0.0, 20.0])
def test_a_change_of_load_parts_the_record_and_the_stated_load_stays_where_the_cell_agrees(tmp_path, ramp):
    record = read(tmp_path, heavier(ahc(170.0), 40.0, 75.0, ramp))
    first, second = record.segments
    assert first.load == 90e3
    assert second.load == pytest.approx(130e3, abs=600.0)
    assert first.start + first.duration == pytest.approx(75.0 + 0.3 * ramp, abs=2.0 + 0.2 * ramp)
    assert second.start >= 75.0 + 0.5 * ramp - 1.5
    there = (
        f"the load differs from the stated one in a part, where it is {show(second.load, 'mass')} from the load cell"
    )
    assert any(there in text for text in record.statements)


def test_waves_in_the_load_cell_are_no_change_of_load(tmp_path):
    frame = ahc()
    swing = 40.0 * np.sin(0.7 * frame["Time"].to_numpy())  # kN, 4 % of the load either way
    assert len(read(tmp_path, changed(frame, "Load cell", frame["Load cell"].to_numpy() + swing)).segments) == 1


def test_a_load_cell_that_says_something_else_is_told_and_the_stated_load_counts(tmp_path):
    frame = ahc()
    record = read(tmp_path, changed(frame, "Load cell", frame["Load cell"].to_numpy() / G))
    assert record.segments[0].load == 90e3
    assert any(
        "where the stated load and the hook weigh 912" in text and "the stated load is used" in text
        for text in record.statements
    )


def test_no_load_at_all_is_refused(tmp_path):
    assert refusal(tmp_path, ahc(), test="", rows=signals(F_w=None)) == (
        'test "1": load: missing, and no load cell F_w in the log. State the load on the hook.'
    )
    text = refusal(tmp_path, ahc(), test="", rows=signals(F_w='{ column = "Load cell", unit = "N" }'))
    assert text.startswith('test "1": the load cell shows 0.9')
    assert "Check the unit of F_w, or state the load." in text


# --- wire and tip ----------------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("left_out", "how"),
    [({"s_w": None}, "the wire's speed"), ({"s_w": None, "v_w": None}, "the motors' speed on the layer in use")],
)
def test_wire_out_is_made_from_its_start_and_a_speed(tmp_path, left_out, how):
    frame = ahc()
    start = float(frame["Wire out"][0])
    record = read(tmp_path, frame, rows=signals(**left_out), test=f'load = "90 t"\ns_w = "{start} m"')
    true = np.interp(record.t + record.zero, frame["Time"].to_numpy(), frame["Wire out"].to_numpy())
    assert np.abs(record.signals["s_w"] - true).max() < 0.03  # m: 140 s of speeds with their last digits and noise
    assert record.derived == {"s_w"}
    assert any(text.endswith(f"and {how}.") for text in record.statements)
    assert record.lags == ()  # a wire made from its speed says nothing of lags


def test_a_tip_that_is_not_logged_is_made_from_the_error_of_the_plc(tmp_path):
    frame = ahc()
    record = read(tmp_path, frame, rows=signals(s_tip=None))
    apart = record.signals["s_tip"] - np.interp(
        record.t + record.zero, frame["Time"].to_numpy(), frame["Tip pos"].to_numpy()
    )
    assert np.ptp(apart) < 3e-3  # m: noise of the tip between two samples
    assert record.derived == {"s_tip"}


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        (
            {"s_tip": None, "e_c_measured": None},
            'test "1": no s_tip in x.csv. Map the tip\'s height (or e_c_measured together with s_w)',
        ),
        (
            {"s_w": None},
            'test "1": no s_w in x.csv. Map wire out, or a speed (v_w, omega_m) and state s_w at the start.',
        ),
        ({"s_tip": '{ column = "Tip pos", unit = "mm" }'}, "s_w moves 9"),
        (
            {"s_w": '{ column = "Wire out", unit = "cm" }'},
            "times as far as s_tip while the winch compensates. Check the units of s_tip, s_w.",
        ),
        (
            {"s_w": '{ column = "Wire out", unit = "m", scale = 10 }'},
            'where "nov-250t" has 0 m to 2831 m. Check unit, sign and offset of s_w.',
        ),
        ({"p_a": '{ column = "PT A", unit = "Pa" }'}, "p_a never exceeds"),
        ({"u_p": '{ column = "Pump command", unit = "1" }'}, "is beyond 1.5"),
    ],
)
def test_what_is_missing_or_in_another_unit_is_named_in_one_line(tmp_path, rows, told):
    assert told in refusal(tmp_path, ahc(), rows=signals(**rows))


def test_stamps_that_jump_far_ahead_are_refused_before_they_fill_the_memory(tmp_path):
    frame = ahc()
    t = frame["Time"].to_numpy()
    told = refusal(tmp_path, changed(frame, "Time", np.where(t > 70.0, t + 1e6, t)))
    assert "and a test may take 3e+04 s. Check the time stamps, or take a part with start and end." in told


def test_a_limits_test_needs_some_sign_of_motion_and_no_tip(tmp_path):
    rows = signals(s_tip=None, v_tip=None, a_tip=None, s_w=None, v_w=None, e_c_measured=None)
    assert len(read(tmp_path, manual(), kind="limits", test='load = "0 t"', rows=rows).segments) == 1
    rows.pop("omega_m")
    text = refusal(tmp_path, manual(), kind="limits", test='load = "0 t"', rows=rows)
    assert text == 'test "1": no signal in x.csv shows the motion of the winch. Map s_w, v_w or omega_m.'


def test_another_start_of_the_wire_than_stated_is_told(tmp_path):
    record = read(tmp_path, ahc(), test='load = "90 t"\ns_w = "500 m"')
    assert any("but the campaign file states 500 m: the log is used." in text for text in record.statements)
    assert record.segments[0].s_w == pytest.approx(487.0, abs=2.0)


def test_period_and_range_of_the_tip_are_those_of_its_waves(tmp_path):
    t = np.arange(0.0, 140.0, 0.01)
    frame = ahc()[: len(t)]
    swing = np.round(0.7 * np.sin(2.0 * np.pi * t / 8.0) + 1e-3 * np.random.default_rng(2).standard_normal(len(t)), 3)
    frame = frame.with_columns(pl.Series("Tip pos", swing)).drop("Tip speed", "Tip acc")
    (segment,) = read(tmp_path, frame, rows=signals(v_tip=None, a_tip=None, e_c_measured=None)).segments
    assert segment.period == pytest.approx(8.0, abs=0.02)
    assert segment.s_tip_pp == pytest.approx(1.4, rel=0.02)  # smoothing over half a second takes 0.6 %
    (rest,) = read(tmp_path, manual(), kind="limits", test='load = "0 t"').segments
    assert rest.s_tip_pp == 0.0
    assert np.isnan(rest.period)


# --- weight of the wire out ------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("where", ['depth = "457 m"', 'h_tip = "30 m"'])
def test_payload_and_depth_give_the_load_with_the_weight_of_the_wire_out(tmp_path, where):
    """The log is that of 90 t on the winch with 487 m of wire out; 36 kg/m weigh 31.3 kg/m in water."""
    wire = 36.0 * 30.0 + 36.0 * 457.0 * (1.0 - 1025.0 / 7850.0)
    record = read(tmp_path, ahc(), test=f'payload = "{90.0 - wire / 1e3:.4f} t"\n{where}')
    (segment,) = record.segments
    assert segment.load == pytest.approx(90e3, abs=100.0)  # the wire follows the waves by some metres
    assert record.test.load == pytest.approx(segment.load, abs=100.0)
    (text,) = (s for s in record.statements if "of wire" in s)
    assert text.startswith('Test "1": the load is 90 t: payload 74.6 t and 15.4 t of wire (30')
    assert not any("load cell" in s for s in record.statements)


def test_a_payload_whose_wire_is_left_out_contradicts_the_load_cell(tmp_path):
    record = read(tmp_path, ahc(), test='load = "74.6 t"')
    assert any("the load cell shows" in s for s in record.statements)


def test_depth_and_wire_out_that_cannot_be_are_one_line(tmp_path):
    line = refusal(tmp_path, ahc(), test='payload = "60 t"\ndepth = "800 m"')
    assert "depth 800 m: more than the wire out, 487" in line
    line = refusal(tmp_path, ahc(), test='payload = "245 t"\nh_tip = "30 m"')
    assert 'give 260 t; "nov-250t" is rated for 250 t. Check payload, depth and wire out.' in line
    line = refusal(tmp_path, ahc(), test='payload = "60 t"\nh_tip = "30 m"\ndepth = "457 m"')
    assert "depth and h_tip: both given where the wire out" in line
