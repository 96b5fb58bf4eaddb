"""Every defect of a log, made on purpose: it ends in one clear line or in a repaired, declared import."""

import numpy as np
import pytest
from tests.identify.refusals import refused

from stillhook.logs.log import describe, mapping_from, read_log, to_dict

pytestmark = pytest.mark.slow

BAR, REV = 1e5, 2.0 * np.pi / 60.0
CLOSE = 1e-6  # of a value: the digits that a CSV of four decimals keeps


@pytest.fixture
def read(tmp_path):
    """A staircase written as bad.csv and read again."""

    def of(staircase, mapping=None, **written):
        return read_log(staircase.write(tmp_path / "bad.csv", **written), mapping)

    return of


def told(log, kind):
    return [finding for finding in log.findings if finding.kind == kind]


def texts(log):
    return [finding.text for finding in log.findings]


def changed(staircase, name, part, value):
    values = staircase[name].copy()
    values[part] = value
    return staircase.with_columns(**{name: values})


def test_a_good_log_has_no_findings_and_its_bins_hold_the_means_of_their_samples(read, staircase):
    log = read(staircase)
    assert log.findings == log.gaps == ()
    assert not any(bins.any() for bins in log.doubtful.values())
    assert (log.samples, log.rate) == (len(staircase), pytest.approx(100.0))
    assert describe(log) == [
        "bad.csv: 20000 samples in 200 s (100 per second), bins of 0.1 s: p_a, p_b, omega_m, u_p, s_w"
    ]
    for k in (1, 700, 1500):
        inside = np.abs(staircase["time"] - log.t[k]) < 0.0499
        edge = np.argmin(np.abs(staircase["time"] - (log.t[k] - 0.05)))
        inside[edge] = True  # a sample on an edge belongs to the bin above it
        assert log.signals["p_a"][k] == pytest.approx(np.mean(np.round(staircase["p_a"][inside], 4)) * BAR, rel=CLOSE)


def test_a_gap_is_told_with_its_place_and_length(read, staircase):
    log = read(staircase.rows((staircase["time"] < 50.0) | (staircase["time"] >= 53.5)))
    assert log.gaps == ((pytest.approx(49.99), pytest.approx(53.5)),)
    assert texts(log) == ["time: no samples for 3.51 s from 49.99 s on"]
    assert not np.any((log.t > 50.1) & (log.t < 53.4))
    assert log.findings[0].action == "noted"


def test_many_gaps_are_summed_up(read, staircase):
    place = np.arange(len(staircase))
    log = read(staircase.rows((place < 500) | (place >= 19500) | (place % 500 >= 40)))
    assert len(log.gaps) == 38
    assert told(log, "gap")[-1].text.startswith("time: 18 more gaps, the longest 0.41 s, from")


def test_cells_that_are_no_numbers_are_counted_masked_and_quoted(read, staircase):
    cells = staircase.cells()
    cells["p_a"][3000:3030] = ["---", "Bad", "#N/A", "", "NaN", "inf"] * 5
    log = read(staircase, cells=cells)
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


def test_scattered_bad_samples_leave_their_bins_usable_and_are_told(read, staircase):
    cells, count = staircase.cells(), len(staircase) // 50
    for i in np.random.default_rng(1).choice(len(staircase), count, replace=False):
        cells["p_a"][i] = ""
    log = read(staircase, cells=cells)
    assert [finding.count for finding in told(log, "missing")] == [count]
    assert log.doubtful["p_a"].mean() < 0.001
    assert np.isfinite(log.signals["p_a"]).all()


STUCK = slice(5400, 6400)  # in a plateau, at constant speed


def test_a_pressure_that_sticks_while_the_winch_turns_is_found(read, staircase):
    log = read(changed(staircase, "p_a", STUCK, staircase["p_a"][5400]))
    (finding,) = told(log, "stuck")
    assert (finding.signal, finding.start, finding.end) == ("p_a", pytest.approx(54.0), pytest.approx(63.99))
    assert finding.text.endswith("to the last digit from 54 s to 63.99 s while omega_m moves: stuck")
    doubted = log.t[log.doubtful["p_a"]]
    assert (doubted.min(), doubted.max()) == (pytest.approx(54.0), pytest.approx(63.9))


def test_a_speed_that_sticks_at_zero_is_found_by_the_wire(read, staircase):
    assert [finding.text for finding in told(read(changed(staircase, "omega_m", STUCK, 0.0)), "stuck")] == [
        "omega_m stays at 0 rev/min to the last digit from 54 s to 63.99 s while u_p moves: stuck"
    ]


def test_a_logger_that_freezes_while_the_winch_turns_is_found(read, staircase):
    frozen = staircase
    for name in ("p_a", "p_b", "omega_m", "u_p", "s_w"):
        frozen = changed(frozen, name, slice(5400, 5900), staircase[name][5400])
    assert {"p_a", "p_b", "omega_m"} <= {finding.signal for finding in told(read(frozen), "stuck")}


def coarse_speed(staircase):
    """A 12-bit converter over -3000 to 3000 rev/min, and noise that grows with the speed."""
    step, rng = 1.46, np.random.default_rng(3)
    speed = np.gradient(100.0 - staircase["s_w"], staircase["time"]) * 300.0
    return step * np.round(speed * (1.0 + 0.002 * rng.standard_normal(len(staircase))) / step)


@pytest.mark.parametrize(
    "columns",
    [
        lambda s: {"u_p": np.round(s["u_p"]), "omega_m": np.round(s["omega_m"])},
        lambda s: {"p_a": np.round(s["p_a"]), "p_b": np.round(s["p_b"]), "omega_m": 10 * np.round(s["omega_m"] / 10)},
        lambda s: {"omega_m": coarse_speed(s)},
    ],
    ids=["a winch at rest and a held command", "coarse signals", "a coarse speed whose noise grows with it"],
)
def test_what_is_not_stuck_has_no_findings(read, staircase, columns):
    assert read(staircase.with_columns(**columns(staircase))).findings == ()


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("p_b", 25.0, "p_b stays at 25 bar throughout while p_a changes: right for a low side that boost holds"),
        ("alpha_m", 0.8, "alpha_m stays at 0.8 throughout, as a set value may"),
    ],
)
def test_a_low_side_that_boost_holds_and_set_values_may_be_constant_and_are_told(read, staircase, name, value, text):
    log = read(staircase.with_columns(**{name: np.full(len(staircase), value)}))
    (finding,) = log.findings
    assert finding.text.startswith(text)
    assert not log.doubtful[name].any()


def test_samples_at_the_end_of_the_range_are_doubtful(read, staircase):
    units = {"time": "s", "omega_m": "rev/min", "p_b": "bar", "p_a": "bar"}
    rows = {name: {"column": f"{name} [{unit}]", "unit": unit} for name, unit in units.items()}
    rows["p_a"]["range"] = ["0 bar", "150 bar"]
    log = read(staircase.with_columns(p_a=np.minimum(staircase["p_a"], 150.0)), mapping_from(rows, "m"))
    (finding,) = told(log, "saturated")
    assert finding.count == pytest.approx((staircase["p_a"] >= 150.0).sum(), rel=0.1)
    start = f"p_a: {finding.count} samples are at an end of its range (0 bar to 150 bar), from 2.3 s on, in "
    assert finding.text.startswith(start)
    assert finding.text.endswith("bins: the sensor or its converter is saturated")
    hoisting = (log.t > 6) & (log.t < 15)
    assert log.doubtful["p_a"][hoisting].all()


def test_a_rail_that_nobody_named_is_found_in_a_noisy_signal(read, staircase):
    log = read(staircase.with_columns(p_a=np.minimum(staircase["p_a"], 161.5)))
    (finding,) = told(log, "saturated")
    assert finding.signal == "p_a"
    assert "samples or more are exactly at its largest value 161.5 bar, which a noisy signal does not" in finding.text
    touched = np.unique(np.round(staircase["time"][staircase["p_a"] >= 161.5], 1))
    assert log.doubtful["p_a"].sum() == pytest.approx(len(touched), rel=0.05)


def test_late_and_repeated_samples_are_left_out_and_told(read, staircase):
    time = staircase["time"].copy()
    time[4000] = time[3999]
    time[7000:7003] -= 0.05
    log = read(staircase.with_columns(time=time))
    (finding,) = told(log, "time-backwards")
    assert (finding.count, finding.action) == (4, "left out")
    text = "time: 4 samples whose time repeats or runs back (by up to 0.04 s) left out, the first is line 4002"
    assert finding.text == text
    assert np.all(np.diff(log.t) > 0.0)


def test_lines_without_a_time_are_left_out_and_told(read, staircase):
    cells = staircase.cells()
    cells["time"][5000] = "???"
    assert texts(read(staircase, cells=cells)) == [
        "time: 1 line without a readable time left out, the first is line 5002"
    ]


HEAD = "time [s],p_a [bar],p_b [bar],omega_m [rev/min],u_p [%],s_w [m]"


@pytest.mark.parametrize(
    ("columns", "written", "parts"),
    [
        (lambda s: {"p_a": np.full(len(s), 125.0)}, {}, ["p_a stays at 125 bar throughout", "off or stuck, or column"]),
        (
            lambda s: {"time": np.concatenate((s["time"][:12000], s["time"][:8000]))},
            {},
            ['line 12002: time in "time [s]" runs back by 119.99 s', "cut the file there"],
        ),
        (
            lambda s: {"time": np.floor(s["time"])},
            {},
            ["most stamps repeat", "Export them with fractions of a second."],
        ),
        (
            lambda s: {"time": 1e3 * s["time"]},
            {},
            ["one sample in 10 s is too slow for steady windows (at most 5 s)", 'is it "ms" rather than "s"?'],
        ),
        (lambda s: {}, {"header": HEAD.replace("p_a [bar]", "p_a [MPa]")}, ["p_a = 1", 'of column "p_a [MPa]" in the']),
        (
            lambda s: {},
            {"header": HEAD.replace("p_a [bar]", "p_a [kPa]")},
            ["p_a never exceeds 1.6", 'of column "p_a [kPa]" in the mapping, or its scale.'],
        ),
        (
            lambda s: {"omega_m": 60.0 * s["omega_m"]},
            {},
            ["line ", "is beyond 10000 rev/min", 'Check the unit "rev/min" of column "omega_m [rev/min]"'],
        ),
        (
            lambda s: {},
            {"header": HEAD.replace("u_p [%]", "u_p [1]")},
            ["u_p = ", "is beyond 1.5", 'Check the unit "1" of column "u_p [1]"'],
        ),
    ],
    ids=["dead sensor", "two logs", "whole seconds", "ms as s", "MPa", "kPa", "beyond all motors", "per cent as parts"],
)
def test_what_cannot_be_right_is_refused_with_its_place_and_what_to_check(read, staircase, columns, written, parts):
    line = refused(read, staircase.with_columns(**columns(staircase)), **written)
    assert line.startswith("bad.csv: ")
    assert all(part in line for part in parts), line


def test_a_column_without_any_number_is_refused(read, staircase):
    line = refused(read, staircase, cells=staircase.cells() | {"p_b": ["open"] * len(staircase)})
    assert 'p_b: column "p_b [bar]" holds no number that can be read ("open"). Map another column' in line


def test_time_in_another_unit_shows_in_the_rate(read, staircase):
    def rows(unit):
        return {"time": {"column": "time", "unit": unit}, "p_a": {"column": "p_a", "unit": "bar"}}

    line = refused(read, staircase, mapping_from(rows("ms"), "m"))
    assert "1e+05 samples per second are more than any log has (20000)" in line
    assert 'is it "s" rather than "ms"?' in line
    assert read(staircase, mapping_from(rows("min"), "m")).every == pytest.approx(0.6)  # such a log is possible


def test_single_spikes_are_left_out_and_told(read, staircase):
    log = read(changed(changed(staircase, "p_a", 4321, 9999.0), "p_a", 9000, -5000.0))
    assert texts(log) == ["p_a = 9999 bar is beyond 1000 bar in line 4323: 2 such samples left out"]
    assert log.doubtful["p_a"].sum() == 0  # nine good samples are left in each bin
    assert np.nanmax(log.signals["p_a"]) < 200 * BAR
    data = to_dict(log)
    assert (data["findings"][0]["kind"], data["samples"]) == ("impossible", 20000)
    assert data["signals"] == ["p_a", "p_b", "omega_m", "u_p", "s_w"]


def test_empty_cells_at_even_distances_are_a_slower_signal(read, staircase):
    cells = staircase.cells()
    cells["s_w"] = [cell if i % 50 == 0 else "" for i, cell in enumerate(cells["s_w"])]
    log = read(staircase, cells=cells)
    assert texts(log) == ["s_w: one value in 50 lines, the other cells are empty: read as a slower signal"]
    known = log.t <= staircase["time"][19950]
    true = np.interp(log.t, staircase["time"], staircase["s_w"])
    assert np.max(np.abs(log.signals["s_w"] - true)[known]) < 0.05  # straight lines between values 0.5 s apart
    assert not log.doubtful["s_w"][known].any()


def test_a_unit_that_contradicts_the_file_is_told(read, staircase):
    units = {"time": "s", "p_a": "bar", "p_b": "bar", "omega_m": "rev/min"}
    rows = {name: {"column": name, "unit": unit} for name, unit in units.items()}
    header = HEAD.replace("p_a [bar]", "p_a [psi]").replace("p_b [bar]", "p_b [kPa]")
    assert texts(read(staircase, mapping_from(rows, "m"), header=header)) == [
        'p_a: the mapping states "bar" and the file "psi"; the mapping is believed',
        'p_b: the mapping states "bar" and the file "kPa"; the mapping is believed',
    ]


def test_a_spacing_that_changes_is_told(read, staircase):
    keep = (np.arange(len(staircase)) < 8000) | (np.arange(len(staircase)) % 4 == 0)
    assert texts(read(staircase.rows(keep))) == [
        "time: 55 samples per second on average, and 100 at the start: the spacing is uneven"
    ]
