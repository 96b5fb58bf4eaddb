"""Every defect of a log, made on purpose: it ends in one clear line or in a repaired, declared import."""

import numpy as np
import pytest

from stillhook.errors import LogError
from stillhook.logs.log import describe, mapping_from, read_log, to_dict

pytestmark = pytest.mark.slow

BAR, REV = 1e5, 2.0 * np.pi / 60.0
CLOSE = 1e-6  # of a value: the digits that a CSV of four decimals keeps


def refusal(path, mapping=None):
    with pytest.raises(LogError) as caught:
        read_log(path, mapping)
    text = str(caught.value)
    assert "\n" not in text
    return text


def kinds(log):
    return {(finding.signal, finding.kind) for finding in log.findings}


def told(log, kind):
    return [finding for finding in log.findings if finding.kind == kind]


def changed(staircase, name, part, value):
    values = staircase[name].copy()
    values[part] = value
    return staircase.with_columns(**{name: values})


def test_a_good_log_has_no_findings(tmp_path, staircase):
    log = read_log(staircase.write(tmp_path / "good.csv"))
    assert log.findings == ()
    assert log.gaps == ()
    assert not any(bins.any() for bins in log.doubtful.values())
    assert log.samples == len(staircase)
    assert log.rate == pytest.approx(100.0)
    assert describe(log) == [
        "good.csv: 20000 samples in 200 s (100 per second), bins of 0.1 s: p_a, p_b, omega_m, u_p, s_w"
    ]


def test_bins_hold_the_means_of_their_samples(tmp_path, staircase):
    log = read_log(staircase.write(tmp_path / "good.csv"))
    for k in (1, 700, 1500):
        inside = np.abs(staircase["time"] - log.t[k]) < 0.0499
        inside[np.argmin(np.abs(staircase["time"] - (log.t[k] - 0.05)))] = (
            True  # a sample on an edge belongs to the bin above it
        )
        assert log.signals["p_a"][k] == pytest.approx(np.mean(np.round(staircase["p_a"][inside], 4)) * BAR, rel=CLOSE)


def test_a_gap_is_told_with_its_place_and_length(tmp_path, staircase):
    keep = (staircase["time"] < 50.0) | (staircase["time"] >= 53.5)
    log = read_log(staircase.rows(keep).write(tmp_path / "gap.csv"))
    assert log.gaps == ((pytest.approx(49.99), pytest.approx(53.5)),)
    assert told(log, "gap")[0].text == "time: no samples for 3.51 s from 49.99 s on"
    assert not np.any((log.t > 50.1) & (log.t < 53.4))
    assert log.findings[0].action == "noted"


def test_many_gaps_are_summed_up(tmp_path, staircase):
    keep = np.ones(len(staircase), dtype=bool)
    for start in range(500, 19500, 500):
        keep[start : start + 40] = False
    log = read_log(staircase.rows(keep).write(tmp_path / "gaps.csv"))
    assert len(log.gaps) == 38
    assert told(log, "gap")[-1].text.startswith("time: 18 more gaps, the longest 0.41 s, from")


def test_cells_that_are_no_numbers_are_counted_masked_and_quoted(tmp_path, staircase):
    cells = staircase.cells()
    for i, word in zip(range(3000, 3030), ["---", "Bad", "#N/A", "", "NaN", "inf"] * 5, strict=True):
        cells["p_a"][i] = word
    log = read_log(staircase.write(tmp_path / "bad.csv", cells=cells))
    (finding,) = told(log, "missing")
    assert (finding.signal, finding.count, finding.action) == ("p_a", 30, "left out")
    assert finding.text == 'p_a: 30 samples missing ("---", "Bad", "#N/A"), first near 30 s'
    at = (log.t > 30.05) & (log.t < 30.25)  # the bins before and after are half good
    assert log.doubtful["p_a"][at].all()
    assert np.isnan(log.signals["p_a"][300 + 1])
    assert not np.isnan(log.signals["p_b"]).any()
    assert at.sum() <= log.doubtful["p_a"].sum() <= at.sum() + 2
    good = np.isfinite(log.signals["p_a"])
    assert np.all(np.abs(log.signals["p_a"][good] - 145 * BAR) < 60 * BAR)


def test_scattered_bad_samples_leave_their_bins_usable_and_are_told(tmp_path, staircase):
    cells = staircase.cells()
    for i in np.random.default_rng(1).choice(len(staircase), len(staircase) // 50, replace=False):
        cells["p_a"][i] = ""
    log = read_log(staircase.write(tmp_path / "holes.csv", cells=cells))
    (finding,) = told(log, "missing")
    assert finding.count == len(staircase) // 50
    assert log.doubtful["p_a"].mean() < 0.001
    assert np.isfinite(log.signals["p_a"]).all()


def test_a_column_without_any_number_is_refused(tmp_path, staircase):
    cells = staircase.cells() | {"p_b": ["open"] * len(staircase)}
    assert refusal(staircase.write(tmp_path / "off.csv", cells=cells)) == (
        'off.csv: p_b: column "p_b [bar]" holds no number that can be read ("open"). Map another column or leave the signal out.'
    )


def test_a_pressure_that_sticks_while_the_winch_turns_is_found(tmp_path, staircase):
    stuck = changed(staircase, "p_a", slice(5400, 6400), staircase["p_a"][5400])  # in a plateau, at constant speed
    log = read_log(stuck.write(tmp_path / "stuck.csv"))
    (finding,) = told(log, "stuck")
    assert finding.signal == "p_a"
    assert (finding.start, finding.end) == (pytest.approx(54.0), pytest.approx(63.99))
    assert "stays at" in finding.text
    assert finding.text.endswith("to the last digit from 54 s to 63.99 s while omega_m moves: stuck")
    doubted = log.t[log.doubtful["p_a"]]
    assert doubted.min() == pytest.approx(54.0)
    assert doubted.max() == pytest.approx(63.9)


def test_a_speed_that_sticks_at_zero_is_found_by_the_wire(tmp_path, staircase):
    stuck = changed(staircase, "omega_m", slice(5400, 6400), 0.0)
    log = read_log(stuck.write(tmp_path / "stuck.csv"))
    assert [finding.text for finding in told(log, "stuck")] == [
        "omega_m stays at 0 rev/min to the last digit from 54 s to 63.99 s while u_p moves: stuck"
    ]


def test_a_winch_at_rest_and_a_held_command_are_not_stuck(tmp_path, staircase):
    still = staircase.with_columns(u_p=np.round(staircase["u_p"]), omega_m=np.round(staircase["omega_m"]))
    assert read_log(still.write(tmp_path / "rest.csv")).findings == ()


def test_coarse_signals_are_not_stuck(tmp_path, staircase):
    coarse = staircase.with_columns(
        p_a=np.round(staircase["p_a"]), p_b=np.round(staircase["p_b"]), omega_m=10 * np.round(staircase["omega_m"] / 10)
    )
    assert read_log(coarse.write(tmp_path / "coarse.csv")).findings == ()


def test_a_coarse_speed_whose_noise_grows_with_speed_is_not_stuck(tmp_path, staircase):
    rng = np.random.default_rng(3)
    step = 1.46  # rev/min: a 12-bit converter over -3000 to 3000 rev/min
    speed = np.gradient(100.0 - staircase["s_w"], staircase["time"]) * 300.0
    speed = step * np.round(speed * (1.0 + 0.002 * rng.standard_normal(len(staircase))) / step)
    assert read_log(staircase.with_columns(omega_m=speed).write(tmp_path / "coarse.csv")).findings == ()


def test_a_logger_that_freezes_while_the_winch_turns_is_found(tmp_path, staircase):
    frozen = staircase
    for name in ("p_a", "p_b", "omega_m", "u_p", "s_w"):
        frozen = changed(frozen, name, slice(5400, 5900), staircase[name][5400])
    log = read_log(frozen.write(tmp_path / "frozen.csv"))
    assert {"p_a", "p_b", "omega_m"} <= {finding.signal for finding in told(log, "stuck")}


def test_a_required_signal_that_never_changes_is_refused(tmp_path, staircase):
    dead = staircase.with_columns(p_a=np.full(len(staircase), 125.0))
    assert refusal(dead.write(tmp_path / "dead.csv")) == (
        'dead.csv: p_a stays at 125 bar throughout while p_b changes: the sensor was off or stuck, or column "p_a [bar]" is another one. '
        "Map another column, or leave the signal out."
    )


def test_a_low_side_that_boost_holds_is_used_and_told(tmp_path, staircase):
    log = read_log(staircase.with_columns(p_b=np.full(len(staircase), 25.0)).write(tmp_path / "held.csv"))
    assert [f.text for f in log.findings] == [
        "p_b stays at 25 bar throughout while p_a changes: right for a low side that boost holds, wrong for a dead sensor"
    ]
    assert not log.doubtful["p_b"].any()


def test_set_values_may_be_constant_and_are_told(tmp_path, staircase):
    held = staircase.with_columns(alpha_m=np.full(len(staircase), 0.8))
    names = dict(
        zip(
            held.columns,
            ["time [s]", "p_a [bar]", "p_b [bar]", "omega_m [rev/min]", "u_p [%]", "s_w [m]", "alpha_m"],
            strict=True,
        )
    )
    log = read_log(held.write(tmp_path / "held.csv", header=",".join(names.values())))
    assert [finding.text for finding in log.findings] == ["alpha_m stays at 0.8 throughout, as a set value may"]
    assert not log.doubtful["alpha_m"].any()


def test_samples_at_the_end_of_the_range_are_doubtful(tmp_path, staircase):
    mapping = mapping_from(
        {
            name: {"column": f"{name} [{unit}]", "unit": unit}
            for name, unit in (("time", "s"), ("omega_m", "rev/min"), ("p_b", "bar"))
        }
        | {"p_a": {"column": "p_a [bar]", "unit": "bar", "range": ["0 bar", "150 bar"]}},
        "m",
    )
    log = read_log(
        staircase.with_columns(p_a=np.minimum(staircase["p_a"], 150.0)).write(tmp_path / "range.csv"), mapping
    )
    (finding,) = told(log, "saturated")
    above = staircase["p_a"] >= 150.0
    assert finding.count == pytest.approx(above.sum(), rel=0.1)
    assert finding.text.startswith(
        f"p_a: {finding.count} samples are at an end of its range (0 bar to 150 bar), from 2.3 s on, in "
    )
    assert finding.text.endswith("bins: the sensor or its converter is saturated")
    hoisting = (log.t > 6) & (log.t < 15)
    assert log.doubtful["p_a"][hoisting].all()


def test_a_rail_that_nobody_named_is_found_in_a_noisy_signal(tmp_path, staircase):
    clipped = staircase.with_columns(p_a=np.minimum(staircase["p_a"], 161.5))
    log = read_log(clipped.write(tmp_path / "rail.csv"))
    (finding,) = told(log, "saturated")
    assert finding.signal == "p_a"
    assert "samples or more are exactly at its largest value 161.5 bar, which a noisy signal does not" in finding.text
    touched = np.unique(np.round(staircase["time"][staircase["p_a"] >= 161.5], 1))
    assert log.doubtful["p_a"].sum() == pytest.approx(len(touched), rel=0.05)


def test_late_and_repeated_samples_are_left_out_and_told(tmp_path, staircase):
    time = staircase["time"].copy()
    time[4000] = time[3999]
    time[7000:7003] -= 0.05
    log = read_log(staircase.with_columns(time=time).write(tmp_path / "back.csv"))
    (finding,) = told(log, "time-backwards")
    assert (finding.count, finding.action) == (4, "left out")
    assert (
        finding.text
        == "time: 4 samples whose time repeats or runs back (by up to 0.04 s) left out, the first is line 4002"
    )
    assert np.all(np.diff(log.t) > 0.0)


def test_two_logs_in_one_file_are_refused_with_the_line(tmp_path, staircase):
    time = np.concatenate((staircase["time"][:12000], staircase["time"][:8000]))
    assert refusal(staircase.with_columns(time=time).write(tmp_path / "two.csv")) == (
        'two.csv: line 12002: time in "time [s]" runs back by 119.99 s. The clock restarted, or two logs were joined: cut the file there and '
        "give the parts as logs of their own (or correct a stamp that jumped ahead before it)."
    )


def test_lines_without_a_time_are_left_out_and_told(tmp_path, staircase):
    cells = staircase.cells()
    cells["time"][5000] = "???"
    log = read_log(staircase.write(tmp_path / "untimed.csv", cells=cells))
    assert [finding.text for finding in log.findings] == [
        "time: 1 line without a readable time left out, the first is line 5002"
    ]


def test_stamps_without_fractions_of_a_second_are_refused(tmp_path, staircase):
    path = staircase.with_columns(time=np.floor(staircase["time"])).write(tmp_path / "whole.csv")
    assert "most stamps repeat" in refusal(path)
    assert refusal(path).endswith("Export them with fractions of a second.")


@pytest.mark.parametrize(
    ("unit", "text"),
    [
        (
            "ms",
            'time in "time": 1e+05 samples per second are more than any log has (20000). Check its unit: is it "s" rather than "ms"?',
        ),
        ("min", "one sample in 0.6 s"),
    ],
)
def test_time_in_another_unit_shows_in_the_rate(tmp_path, staircase, unit, text):
    path = staircase.write(tmp_path / "rate.csv")
    mapping = mapping_from({"time": {"column": "time", "unit": unit}, "p_a": {"column": "p_a", "unit": "bar"}}, "m")
    if unit == "ms":
        assert refusal(path, mapping) == f"rate.csv: {text}"
    else:  # a log of one sample in 0.6 s is possible
        assert read_log(path, mapping).every == pytest.approx(0.6)


def test_milliseconds_taken_for_seconds_are_refused(tmp_path, staircase):
    path = staircase.with_columns(time=1e3 * staircase["time"]).write(tmp_path / "ms.csv")
    assert refusal(path) == (
        'ms.csv: time in "time [s]": one sample in 10 s is too slow for steady windows (at most 5 s). Check its unit: is it "ms" rather than "s"?'
    )


@pytest.mark.parametrize(
    ("heading", "text"),
    [
        ("p_a [MPa]", "p_a = 1"),
        ("p_a [kPa]", "p_a never exceeds 1.6"),
    ],
)
def test_pressures_in_another_unit_are_refused(tmp_path, staircase, heading, text):
    header = "time [s],PA,p_b [bar],omega_m [rev/min],u_p [%],s_w [m]".replace("PA", heading)
    said = refusal(staircase.write(tmp_path / "unit.csv", header=header))
    assert text in said
    assert f'of column "{heading}" in the mapping, or its scale.' in said


def test_a_motor_speed_beyond_all_motors_is_refused(tmp_path, staircase):
    said = refusal(staircase.with_columns(omega_m=60.0 * staircase["omega_m"]).write(tmp_path / "unit.csv"))
    assert said.startswith("unit.csv: line ")
    assert "is beyond 10000 rev/min" in said
    assert said.endswith('Check the unit "rev/min" of column "omega_m [rev/min]" in the mapping, or its scale.')


def test_percent_read_as_plain_numbers_is_refused(tmp_path, staircase):
    said = refusal(
        staircase.write(tmp_path / "unit.csv", header="time [s],p_a [bar],p_b [bar],omega_m [rev/min],u_p [1],s_w [m]")
    )
    assert "u_p = " in said
    assert "is beyond 1.5" in said
    assert 'Check the unit "1" of column "u_p [1]"' in said


def test_single_spikes_are_left_out_and_told(tmp_path, staircase):
    spiked = changed(changed(staircase, "p_a", 4321, 9999.0), "p_a", 9000, -5000.0)
    log = read_log(spiked.write(tmp_path / "spike.csv"))
    assert [finding.text for finding in log.findings] == [
        "p_a = 9999 bar is beyond 1000 bar in line 4323: 2 such samples left out"
    ]
    assert log.doubtful["p_a"].sum() == 0  # nine good samples are left in each bin
    assert np.nanmax(log.signals["p_a"]) < 200 * BAR


def test_findings_are_plain_data(tmp_path, staircase):
    log = read_log(changed(staircase, "p_a", 4321, 9999.0).write(tmp_path / "spike.csv"))
    said = to_dict(log)
    assert said["findings"][0]["kind"] == "impossible"
    assert said["samples"] == 20000
    assert said["signals"] == ["p_a", "p_b", "omega_m", "u_p", "s_w"]


def test_empty_cells_at_even_distances_are_a_slower_signal(tmp_path, staircase):
    cells = staircase.cells()
    cells["s_w"] = [cell if i % 50 == 0 else "" for i, cell in enumerate(cells["s_w"])]
    log = read_log(staircase.write(tmp_path / "slow.csv", cells=cells))
    assert [finding.text for finding in log.findings] == [
        "s_w: one value in 50 lines, the other cells are empty: read as a slower signal"
    ]
    known = log.t <= staircase["time"][19950]
    true = np.interp(log.t, staircase["time"], staircase["s_w"])
    assert np.max(np.abs(log.signals["s_w"] - true)[known]) < 0.05  # straight lines between values 0.5 s apart
    assert not log.doubtful["s_w"][known].any()


def test_a_unit_that_contradicts_the_file_is_told(tmp_path, staircase):
    path = staircase.write(
        tmp_path / "unit.csv", header="time [s],p_a [psi],p_b [kPa],omega_m [rev/min],u_p [%],s_w [m]"
    )
    rows = {
        name: {"column": name, "unit": unit}
        for name, unit in {"time": "s", "p_a": "bar", "p_b": "bar", "omega_m": "rev/min"}.items()
    }
    assert [finding.text for finding in read_log(path, mapping_from(rows, "m")).findings] == [
        'p_a: the mapping states "bar" and the file "psi"; the mapping is believed',
        'p_b: the mapping states "bar" and the file "kPa"; the mapping is believed',
    ]


def test_a_spacing_that_changes_is_told(tmp_path, staircase):
    keep = (np.arange(len(staircase)) < 8000) | (np.arange(len(staircase)) % 4 == 0)
    log = read_log(staircase.rows(keep).write(tmp_path / "uneven.csv"))
    assert [f.text for f in log.findings] == [
        "time: 55 samples per second on average, and 100 at the start: the spacing is uneven"
    ]
