"""A record in parts: modes in the PLC's own words, loads from the cell, wire and tip from what there is."""

import numpy as np
import pandas as pd
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


def half_on(frame: pd.DataFrame, on, off, start: float = 40.0) -> pd.DataFrame:
    """The log with another sign for its mode before and after a moment."""
    return frame.assign(Mode=[on if t >= start else off for t in frame["Time"]])


# --- modes -----------------------------------------------------------------------------------------------------------------------------------


@pytest.mark.long
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
    assert any("100 s of 140 s are used, from 40 s on" in text for text in record.statements)
    assert any("in 40 s the winch did not compensate" in text for text in record.statements)


def test_modes_that_change_part_the_record(tmp_path):
    frame = ahc()
    record = read(tmp_path, half_on(frame, 5, 3, 70.0))
    assert [s.mode for s in record.segments] == [Mode.NS, Mode.SSC]


@pytest.mark.long
def test_a_mean_of_two_modes_in_one_bin_is_no_mode(tmp_path):
    """At 1 kHz the bin in which the mode changes holds both."""
    frame = half_on(ahc(), 5, 0, 70.004)
    t = np.arange(0.0, 139.0, 0.001)
    own = frame["Time"].to_numpy()
    fast = pd.DataFrame(
        {h: (np.round(t, 4) if h == "Time" else np.interp(t, own, frame[h].to_numpy())) for h in frame.columns}
    )
    fast = fast.assign(Mode=np.where(t < 70.004, 0, 5))
    record = read(tmp_path, fast)
    assert set(np.unique(record.signals["mode"])) == {0.0, 5.0}
    assert len(record.segments) == 1


def test_without_a_mode_in_the_log_the_stated_one_holds_throughout(tmp_path):
    (segment,) = read(tmp_path, ahc(), rows=signals(mode=None), test='load = "90 t"\nmode = "ns"').segments
    assert segment.mode is Mode.NS


# --- loads -----------------------------------------------------------------------------------------------------------------------------------


def heavier(frame: pd.DataFrame, tonnes: float, start: float, ramp: float = 0.0) -> pd.DataFrame:
    t = frame["Time"].to_numpy()
    return changed(
        frame,
        "Load cell",
        frame["Load cell"].to_numpy() + tonnes * G * np.clip((t - start) / max(ramp, 1e-9), 0.0, 1.0),
    )


def test_the_load_comes_from_the_cell_where_it_is_not_stated(tmp_path):
    record = read(tmp_path, ahc(), test="")
    assert record.segments[0].load == pytest.approx(90e3, abs=300.0)  # a tenth of a per cent of the cell's range


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


# --- wire and tip ----------------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("left_out", "how"),
    [
        ({"s_w": None}, "the speed of the wire"),
        ({"s_w": None, "v_w": None}, "the speed of the motors on the layer in use"),
    ],
)
def test_wire_out_is_made_from_its_start_and_a_speed(tmp_path, left_out, how):
    frame = ahc()
    start = float(frame["Wire out"][0])
    record = read(tmp_path, frame, rows=signals(**left_out), test=f'load = "90 t"\ns_w = "{start} m"')
    true = np.interp(record.t + record.zero, frame["Time"].to_numpy(), frame["Wire out"].to_numpy())
    assert np.abs(record.signals["s_w"] - true).max() < 0.03  # m: 140 s of speeds with their last digits and noise
    assert record.derived == {"s_w"}
    assert any(text.endswith(f"and {how}.") for text in record.statements)


def test_a_tip_that_is_not_logged_is_made_from_the_error_of_the_plc(tmp_path):
    frame = ahc()
    record = read(tmp_path, frame, rows=signals(s_tip=None))
    apart = record.signals["s_tip"] - np.interp(
        record.t + record.zero, frame["Time"].to_numpy(), frame["Tip pos"].to_numpy()
    )
    assert np.ptp(apart) < 3e-3  # m: noise of the tip between two samples
    assert record.derived == {"s_tip"}


def jumped(frame: pd.DataFrame) -> pd.DataFrame:
    t = frame["Time"].to_numpy()
    return changed(frame, "Time", np.where(t > 70.0, t + 1e6, t))


NO_MODE, NO_CELL = signals(mode=None), signals(F_w=None)
REFUSED = {  # what differs from a good log and campaign -> words of the refusal
    "s_tip": (
        {"rows": signals(s_tip=None, e_c_measured=None)},
        ("no s_tip in x.csv", "e_c_measured together with s_w"),
    ),
    "s_w": ({"rows": signals(s_w=None)}, ("no s_w in x.csv", "state s_w at the start")),
    "tip in mm": ({"rows": signals(s_tip='{ column = "Tip pos", unit = "mm" }')}, ("s_w moves 9",)),
    "wire in cm": ({"rows": signals(s_w='{ column = "Wire out", unit = "cm" }')}, ("as far as s_tip", "s_tip, s_w")),
    "wire by ten": (
        {"rows": signals(s_w='{ column = "Wire out", unit = "m", scale = 10 }')},
        ("0 m to 2831 m", "unit, sign and offset of s_w"),
    ),
    "p_a in Pa": ({"rows": signals(p_a='{ column = "PT A", unit = "Pa" }')}, ("p_a never exceeds",)),
    "u_p in parts": ({"rows": signals(u_p='{ column = "Pump command", unit = "1" }')}, ("is beyond 1.5",)),
    "stamps": ({"frame": jumped}, ("a test may take 3e+04 s", "start and end")),
    "code": ({"frame": lambda x: half_on(x, 17, 0)}, ("mode: the log holds 17 for 100 s", "0, 1, 2", "[modes]")),
    "no mode": ({"rows": NO_MODE}, ("mode: missing", "level-1,")),
    "other mode": (
        {"frame": lambda x: half_on(x, 1, 0), "test": 'load = "90 t"\nmode = "ssc"'},
        ('mode = "ssc"', "manual and level-1", "[modes]"),
    ),
    "no load": ({"test": "", "rows": NO_CELL}, ("load: missing", "F_w")),
    "cell in N": (
        {"test": "", "rows": signals(F_w='{ column = "Load cell", unit = "N" }')},
        ("the load cell shows 0.9", "unit of F_w"),
    ),
    "depth": ({"test": 'payload = "60 t"\ndepth = "800 m"'}, ("depth 800 m", "487")),
    "SWL": ({"test": 'payload = "245 t"\nh_tip = "30 m"'}, ("260 t", "250 t", "payload, depth and wire out")),
    "both": ({"test": 'payload = "60 t"\nh_tip = "30 m"\ndepth = "457 m"'}, ("depth and h_tip: both",)),
}


@pytest.mark.long
@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_with_its_place_and_what_to_do(tmp_path, case):
    how, words = REFUSED[case]
    text = refusal(tmp_path, how.get("frame", lambda x: x)(ahc()), **{k: v for k, v in how.items() if k != "frame"})
    assert text.startswith('test "1": ')
    assert all(word in text for word in words), text


STATED = {  # what differs from a good log and campaign -> words of the statement
    "manual": (lambda: manual(), 'load = "0 t"', "none of it is used. The winch was in manual mode throughout."),
    "short": (lambda: ahc()[:4000], 'load = "90 t"', "no uninterrupted part of at least 60 s has one mode"),
    "no load": (ahc, "", "the load is not stated; it is 89"),
    "light": (ahc, 'load = "74.6 t"', "the load cell shows"),
    "wire": (ahc, 'load = "90 t"\ns_w = "500 m"', "but the campaign file states 500 m: the log is used."),
}


@pytest.mark.parametrize("case", STATED)
def test_what_reading_brings_up_is_stated(tmp_path, case):
    frame, test, words = STATED[case]
    record = read(tmp_path, frame(), test=test)
    assert any(words in text for text in record.statements), record.statements
    assert (record.segments == ()) == (case in ("manual", "short"))


def test_a_limits_test_needs_some_sign_of_motion_and_no_tip(tmp_path):
    rows = signals(s_tip=None, v_tip=None, a_tip=None, s_w=None, v_w=None, e_c_measured=None)
    assert len(read(tmp_path, manual(), kind="limits", test='load = "0 t"', rows=rows).segments) == 1
    rows.pop("omega_m")
    text = refusal(tmp_path, manual(), kind="limits", test='load = "0 t"', rows=rows)
    assert text == 'test "1": no signal in x.csv shows the motion of the winch. Map s_w, v_w or omega_m.'


def test_period_and_range_of_the_tip_are_those_of_its_waves(tmp_path):
    t = np.arange(0.0, 140.0, 0.01)
    frame = ahc()[: len(t)]
    swing = np.round(0.7 * np.sin(2.0 * np.pi * t / 8.0) + 1e-3 * np.random.default_rng(2).standard_normal(len(t)), 3)
    frame = changed(frame, "Tip pos", swing).drop(columns=["Tip speed", "Tip acc"])
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
