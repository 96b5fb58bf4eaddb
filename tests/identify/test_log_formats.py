"""A log reads the same from every format and every dialect of text."""

import sys
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from tests.identify.refusals import refused as refusal
from tests.parquet import write_parquet

from stillhook.errors import LogError, UnitError
from stillhook.logs import log as log_module
from stillhook.logs.log import describe, mapping_from, read_log

pytestmark = pytest.mark.slow

SAME = 1e-9  # relative: rounding of means only
UNITS = {"p_a": "bar", "p_b": "bar", "omega_m": "rev/min", "u_p": "%", "s_w": "m"}
BETWEEN = 0.15  # m: straight lines between samples of 1 s, where the speed changes by 0.3 m/s in 1.5 s


@pytest.fixture(scope="module")
def short(make_staircase):
    full = make_staircase(40.0)
    return full.with_columns(**{name: np.round(values, 3) for name, values in full.columns.items()})


@pytest.fixture(scope="module")
def plain(short, tmp_path_factory):
    return read_log(short.write(tmp_path_factory.mktemp("plain") / "plain.csv"))


def same(log, other):
    assert list(log.signals) == list(other.signals)
    np.testing.assert_allclose(log.t, other.t, rtol=0, atol=1e-9)
    for name in other.signals:
        np.testing.assert_allclose(log.signals[name], other.signals[name], rtol=SAME, atol=1e-9, err_msg=name)
        np.testing.assert_array_equal(log.doubtful[name], other.doubtful[name])
    assert log.samples == other.samples
    assert log.rate == pytest.approx(other.rate)


def text_of(short, separator=",", decimal=".", header=None, pad=""):
    names = ["time [s]", "p_a [bar]", "p_b [bar]", "omega_m [rev/min]", "u_p [%]", "s_w [m]"]
    rows = zip(*short.cells(3).values(), strict=True)
    lines = [separator.join(pad + cell.replace(".", decimal) + pad for cell in row) for row in rows]
    return [header if header is not None else separator.join(names), *lines]


def commented(rows):
    notes = ["", "# a note", "// another", "% a third"]
    return [rows[0], *(x for i, row in enumerate(rows[1:]) for x in ([row, *notes] if i % 900 == 7 else [row]))]


def quoted(rows, decimal="."):
    return [",".join(f'"{cell.replace(".", decimal)}"' for cell in line.split(",")) for line in rows]


BARE = "time,p_a,p_b,omega_m,u_p,s_w"
NO_BLANKS = "time[s],p_a[bar],p_b[bar],omega_m[rev/min],u_p[%],s_w[m]"
METADATA = ["PLC: AC500", "Crane: 150 t", "Operator: A. Nonymous", "Exported: 2020-05-01 12:00:00", "Interval: 10 ms"]
DIALECTS = {
    "semicolon": {"separator": ";"},
    "tab": {"separator": "\t"},
    "bar": {"separator": "|"},
    "blanks": {"separator": "   ", "header": f"#{NO_BLANKS}"},
    "leading blanks": (
        lambda rows: ["  " + line for line in rows],
        {"separator": "  ", "header": NO_BLANKS.replace(",", " ")},
    ),
    "padded cells": {"pad": " "},
    "decimal comma": {"separator": ";", "decimal": ","},
    "decimal comma, tab": {"separator": "\t", "decimal": ","},
    "byte order mark": lambda rows: ["\ufeff" + rows[0], *rows[1:]],
    "CRLF": lambda rows: "\r\n".join(rows).encode() + b"\r\n",
    "CR": lambda rows: "\r".join(rows).encode(),
    "UTF-16": lambda rows: "\r\n".join(rows).encode("utf-16"),
    "UTF-16 without mark": lambda rows: "\n".join(rows).encode("utf-16-le"),
    "Latin-1": lambda rows: "\n".join(["Anlage: Kran 7, Öltemperatur 45 °C", *rows]).encode("latin-1"),
    "preamble": lambda rows: [*METADATA, "", *rows],
    "padded preamble": lambda rows: ["Date,2020-05-01,,,,", "Rate,100,,,,", *rows],
    "units below": lambda rows: [BARE, "s,bar,bar,rev/min,%,m", *rows[1:]],
    "units in brackets below": lambda rows: [BARE, "[s],[bar],[bar],[rpm],[%],[m]", *rows[1:]],
    "comments": lambda rows: ["# crane 7", "# second line", *commented(rows)],
    "quotes": quoted,
    "quoted decimal comma": lambda rows: [rows[0], *quoted(rows[1:], ",")],
    "trailing separators": lambda rows: [line + "," for line in rows],
    "trailing separators below": lambda rows: [rows[0], *(line + ",," for line in rows[1:])],
    "other text columns": lambda rows: [
        rows[0] + ',note,"a ""b"',
        *(line + ',"pump 1, on",æ' for line in rows[1:]),
    ],
    "no newline at the end": lambda rows: "\n".join(rows).encode().rstrip(b"\n"),
}
"""How the rows are written, or what is made of them, or both."""


def in_dialect(short, name):
    change = DIALECTS[name]
    change, how = change if isinstance(change, tuple) else (list, change) if isinstance(change, dict) else (change, {})
    content = change(text_of(short, **how))
    return content if isinstance(content, bytes) else "\n".join(content).encode()


@pytest.mark.thorough
@pytest.mark.parametrize("name", DIALECTS)
def test_every_dialect_of_text_reads_the_same(tmp_path, short, plain, name):
    path = tmp_path / "log.csv"
    path.write_bytes(in_dialect(short, name))
    log = read_log(path)
    same(log, plain)
    assert log.findings == ()


@pytest.mark.thorough
@pytest.mark.parametrize(
    "name", ["semicolon", "blanks", "comments", "UTF-16", "quotes", "CRLF", "trailing separators below"]
)
@pytest.mark.parametrize("size", [2049, 65537])
def test_the_size_of_the_pieces_changes_no_bit(tmp_path, short, monkeypatch, name, size):
    path = tmp_path / "log.csv"
    path.write_bytes(in_dialect(short, name))
    whole = read_log(path)
    monkeypatch.setattr(log_module, "CHUNK", size)
    pieces = read_log(path)
    assert np.array_equal(whole.t, pieces.t)
    for signal in whole.signals:
        assert np.array_equal(whole.signals[signal], pieces.signals[signal])
    assert whole.findings == pieces.findings


def test_pieces_change_nothing_of_a_log_full_of_defects(tmp_path, make_staircase, monkeypatch):
    bad = make_staircase(60.0)
    p_a = np.minimum(bad["p_a"], 161.5)
    p_a[1500:1900] = p_a[1500]
    p_a[777] = 9999.0
    time = bad["time"].copy()
    time[4000:4002] -= 0.03
    bad = bad.with_columns(p_a=p_a, time=time).rows((bad["time"] < 30.0) | (bad["time"] > 33.0))
    cells = bad.cells()
    for i in range(2100, 2500, 7):
        cells["omega_m"][i] = "---"
    path = bad.write(tmp_path / "bad.csv", cells=cells)
    path.write_text(path.read_text().replace("\n1.2300,", "\n1.2300,77,\n1.2300,", 1))  # a line of another length
    whole = read_log(path)
    assert {finding.kind for finding in whole.findings} == {
        "gap",
        "missing",
        "stuck",
        "saturated",
        "impossible",
        "time-backwards",
        "broken",
    }
    for size in (1000, 33333):
        monkeypatch.setattr(log_module, "CHUNK", size)
        pieces = read_log(path)
        assert describe(pieces) == describe(whole)
        for signal in whole.signals:
            assert np.array_equal(whole.signals[signal], pieces.signals[signal], equal_nan=True)
            assert np.array_equal(whole.doubtful[signal], pieces.doubtful[signal])


def columns_of(short):
    names = ["time [s]", "p_a [bar]", "p_b [bar]", "omega_m [rev/min]", "u_p [%]", "s_w [m]"]
    return dict(zip(names, short.columns.values(), strict=True))


def test_parquet_reads_the_same(tmp_path, short, plain):
    write_parquet(columns_of(short), tmp_path / "log.parquet")
    same(read_log(tmp_path / "log.parquet"), plain)


def test_parquet_with_dates_reads_the_same(tmp_path, short, plain):
    table = columns_of(short)
    start = datetime(2020, 5, 1, 23, 59, 50, tzinfo=UTC)
    table["time"] = [start + timedelta(seconds=float(t)) for t in table.pop("time [s]")]
    write_parquet(table, tmp_path / "log.parquet")
    same(read_log(tmp_path / "log.parquet"), plain)


def test_parquet_in_small_pieces_with_missing_values(tmp_path, short, monkeypatch):
    table = columns_of(short)
    table["p_a [bar]"] = [None if i == 50 else x for i, x in enumerate(table["p_a [bar]"])]
    write_parquet(table, tmp_path / "log.parquet")
    monkeypatch.setattr(log_module, "CHUNK", 4096)
    assert [finding.text for finding in read_log(tmp_path / "log.parquet").findings] == [
        "p_a: 1 sample missing (empty cells), first near 0.5 s"
    ]


def matlab(short):
    return {
        "time": short["time"],
        "crane": {name: short[name] for name in ("p_a", "p_b", "omega_m")},
        "more": np.column_stack((short["u_p"], short["s_w"])),
    }


MATLAB = {
    "time": {"column": "time", "unit": "s"},
    "p_a": {"column": "crane.p_a", "unit": "bar"},
    "p_b": {"column": "crane.p_b", "unit": "bar"},
    "omega_m": {"column": "crane.omega_m", "unit": "rpm"},
    "u_p": {"column": "more(:,1)", "unit": "%"},
    "s_w": {"column": "more(:,2)", "unit": "m"},
}


def test_mat_version_5_reads_the_same(tmp_path, short, plain):
    from scipy.io import savemat

    savemat(tmp_path / "log.mat", matlab(short), oned_as="column")
    same(read_log(tmp_path / "log.mat", mapping_from(MATLAB, "m")), plain)


def test_mat_version_7_3_reads_the_same(tmp_path, short, plain):
    import h5py

    content = matlab(short)
    with h5py.File(tmp_path / "log.mat", "w", userblock_size=512) as file:
        file["time"] = content["time"][None, :]
        file["more"] = content["more"].T
        for name, values in content["crane"].items():
            file[f"crane/{name}"] = values[None, :]
    with (tmp_path / "log.mat").open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    same(read_log(tmp_path / "log.mat", mapping_from(MATLAB, "m")), plain)


@pytest.mark.thorough
def test_mdf4_reads_the_same(tmp_path, short, plain):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF() as mdf:
        mdf.append([asammdf.Signal(short[name], short["time"], name=name, unit=unit) for name, unit in UNITS.items()])
        mdf.save(tmp_path / "log.mf4")
    same(read_log(tmp_path / "log.mf4"), plain)


@pytest.mark.long
def test_mdf4_signals_of_a_slower_group_are_brought_onto_the_bins(tmp_path, short):
    asammdf = pytest.importorskip("asammdf")
    slow = short.rows(np.arange(len(short)) % 100 == 0)
    with asammdf.MDF() as mdf:
        mdf.append(
            [
                asammdf.Signal(short[name], short["time"], name=name, unit=unit)
                for name, unit in (("p_a", "bar"), ("omega_m", "rpm"))
            ]
        )
        mdf.append([asammdf.Signal(slow["s_w"], slow["time"], name="s_w", unit="m")])
        mdf.save(tmp_path / "log.mf4")
    log = read_log(tmp_path / "log.mf4")
    true = np.interp(log.t, short["time"], short["s_w"])
    known = log.t <= 39.15  # the last sample of the slow group is at 39 s
    assert np.max(np.abs(log.signals["s_w"] - true)[known]) < BETWEEN
    assert np.isnan(log.signals["s_w"][~known]).all()
    assert log.doubtful["s_w"][~known].all()
    assert log.rate == pytest.approx(100.0)


def test_tdms_reads_the_same(tmp_path, short, plain):
    nptdms = pytest.importorskip("nptdms")
    timing = {"wf_increment": 0.01, "wf_start_offset": 0.0, "wf_start_time": np.datetime64("2020-05-01T12:00:00")}
    with nptdms.TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("crane", name, short[name], {**timing, "unit_string": unit})
                for name, unit in UNITS.items()
            ]
        )
    same(read_log(tmp_path / "log.tdms"), plain)


def test_tdms_with_a_channel_of_stamps_reads_the_same(tmp_path, short, plain):
    nptdms = pytest.importorskip("nptdms")
    stamps = np.datetime64("2020-05-01T12:00:00", "us") + np.round(1e6 * short["time"]).astype("timedelta64[us]")
    channels = [nptdms.ChannelObject("crane", name, short[name], {"unit_string": unit}) for name, unit in UNITS.items()]
    with nptdms.TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("crane", "time", stamps), *channels])
    same(read_log(tmp_path / "log.tdms"), plain)


@pytest.mark.parametrize(
    ("module", "magic", "text"),
    [
        ("asammdf", b"MDF     4.10", 'x.log: is MDF, which takes the reader asammdf: pip install "stillhook[logs]".'),
        ("duckdb", b"PAR1", 'x.log: is Parquet, which takes the reader duckdb: pip install "stillhook[logs]".'),
        ("nptdms", b"TDSm", 'x.log: is TDMS, which takes the reader nptdms: pip install "stillhook[logs]".'),
    ],
)
def test_a_reader_that_is_not_installed_is_named(tmp_path, monkeypatch, module, magic, text):
    monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / "x.log").write_bytes(magic + bytes(600))
    assert refusal(read_log, tmp_path / "x.log") == text


@pytest.mark.parametrize(
    ("unit", "write"),
    [
        (None, "%Y-%m-%dT%H:%M:%S.%fZ"),
        (None, "%Y-%m-%d %H:%M:%S.%f"),
        ("UTC", "%Y-%m-%d %H:%M:%S.%f"),
        ("UTC", "%Y-%m-%dT%H:%M:%S.%f+02:00"),
        ("UTC", "%d.%m.%Y %H:%M:%S.%f"),
        (None, "%d.%m.%Y %H:%M:%S,%f"),
        ("%m/%d/%Y %H:%M:%S%.f", "%m/%d/%Y %H:%M:%S.%f"),
        ("%H:%M:%S%.f", "%H:%M:%S.%f"),
    ],
)
def test_stamps_read_the_same_as_seconds(tmp_path, short, plain, unit, write):
    start = datetime(2020, 4, 30, 22, 59, 50, tzinfo=UTC)
    cells = short.cells(3)
    cells["time"] = [(start + timedelta(seconds=float(t))).strftime(write) for t in short["time"]]
    path = short.write(tmp_path / "stamps.csv", separator=";", cells=cells, header="t;p_a;p_b;omega_m;u_p;s_w")
    rows = {name: {"column": name, "unit": of} for name, of in UNITS.items()} | {"time": {"column": "t"}}
    if unit:
        rows["time"]["unit"] = unit
    same(read_log(path, mapping_from(rows, "m")), plain)


def test_date_and_time_in_two_columns_are_joined(tmp_path, short, plain):
    start = datetime(2020, 4, 30, 23, 59, 50, tzinfo=UTC)
    stamps = [start + timedelta(seconds=float(t)) for t in short["time"]]
    cells = {"d": [s.strftime("%d.%m.%Y") for s in stamps], "time": [s.strftime("%H:%M:%S.%f") for s in stamps]}
    cells |= {name: values for name, values in short.cells(3).items() if name != "time"}
    header = "Date,Time,p_a [bar],p_b [bar],omega_m [rev/min],u_p [%],s_w [m]"
    path = short.write(tmp_path / "two.csv", cells=cells, header=header)
    names = {"p_a": "p_a", "p_b": "p_b", "omega_m": "omega_m", "u_p": "u_p", "s_w": "s_w"}
    same(read_log(path, mapping_from({"time": "Date + Time", **names}, "m")), plain)


def test_slow_logs_hold_one_sample_in_a_bin(tmp_path, make_staircase):
    slow = make_staircase(200.0, 1.0)
    log = read_log(slow.write(tmp_path / "slow.csv"))
    assert log.every == pytest.approx(1.0)
    assert len(log.t) == len(slow)
    np.testing.assert_allclose(log.signals["p_a"], 1e5 * np.round(slow["p_a"], 4))


def test_no_header_takes_the_place_of_a_column(tmp_path, short, plain):
    path = tmp_path / "bare.csv"
    path.write_text("\n".join(text_of(short)[1:]))
    units = {"time": "s", **UNITS}
    same(
        read_log(
            path,
            mapping_from({name: {"column": i + 1, "unit": unit} for i, (name, unit) in enumerate(units.items())}, "m"),
        ),
        plain,
    )


def refused(path, error=LogError):
    line = refusal(read_log, path, error=error)
    assert line.startswith(f"{path.name}: ")
    return line


def table(header, row):
    return "\n".join([header, *(row.format(i) for i in range(30))])


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", ["is empty. Give a log"]),
        ("\n\n", ["is empty. Give a log"]),
        ("a,b\nc,d\n", ["holds no table", "; tab | , or blanks", 'begins with "a,b"']),
        (
            table("time [s],p_a [bar]", "{0},5,1{0},25"),
            ["line 1: the header names 2 columns and the rows below hold 4 fields", 'decimal comma needs ";"'],
        ),
        (
            table("time [s];p_a [bar]", "{0}.5;1{0},25"),
            ['comma ("10,25", line 2) and with a point ("0.5", line 2)', "one decimal sign"],
        ),
        (table("time [s],pressure", "{0},1{0}"), ["names a signal of Stillhook", '"pressure"', "Give a mapping"]),
        (
            table("t,p_a [bar]", "{0},1{0}"),
            ["names a time of Stillhook", '"t"', 'time = { column = "...", unit = "s" }'],
        ),
        ("time [s],p_a [bar]\n1,2\n2,3\n", ['time in "time [s]": 2 samples are not a log']),
    ],
)
def test_texts_that_are_no_log_end_in_one_line(tmp_path, content, says):
    (tmp_path / "x.csv").write_text(content)
    line = refused(tmp_path / "x.csv")
    assert all(part in line for part in says), line


@pytest.mark.parametrize(
    ("heading", "says"),
    [
        ("p_a", 'column "p_a" has no unit; choose one of Pa, bar, kPa, MPa.'),
        (
            "p_a [psi]",
            'has the unit "psi", which is not one of Pa, bar, kPa, MPa. Write unit = "bar", scale = 0.0689476.',
        ),
    ],
)
def test_headings_without_a_unit_of_ours_are_refused(tmp_path, heading, says):
    (tmp_path / "x.csv").write_text(table(f"time [s],{heading}", "{0},1{0}"))
    assert says in refused(tmp_path / "x.csv", UnitError)


def test_files_that_are_no_log_end_in_one_line(tmp_path):
    (tmp_path / "x.xlsx").write_bytes(b"PK\x03\x04" + bytes(100))
    for path, text in (
        (tmp_path, f"{tmp_path}: is a folder. Give one log file in it."),
        (tmp_path / "no.csv", f'"{tmp_path / "no.csv"}": no such file. Check the path.'),
        (tmp_path / "x.xlsx", "x.xlsx: is a zip or Excel file. Unpack it, or save the log as CSV or Parquet."),
    ):
        assert refusal(read_log, path) == text


def test_lines_of_another_length_are_left_out_and_told(tmp_path, short):
    lines = text_of(short)
    lines[1000] = lines[1000].rsplit(",", 2)[0]
    lines.append("39.99,14")
    (tmp_path / "cut.csv").write_text("\n".join(lines))
    log = read_log(tmp_path / "cut.csv")
    assert [finding.text for finding in log.findings] == [
        "2 lines of another length than the header left out, the first is line 1001: 4 fields where the header has 6"
    ]


def test_many_lines_of_another_length_are_refused(tmp_path, short):
    lines = [line + ",9" if i % 3 == 1 and i > 300 else line for i, line in enumerate(text_of(short))]
    (tmp_path / "cut.csv").write_text("\n".join(lines))
    line = refused(tmp_path / "cut.csv")
    assert "line 302: 7 fields where the header has 6 (" in line
    assert 'such lines among 4000). Correct the export; a decimal comma needs ";"' in line


def test_an_open_quote_is_refused_with_its_line(tmp_path, short):
    lines = text_of(short)
    lines[500] = '"' + lines[500]
    (tmp_path / "quote.csv").write_text("\n".join(lines))
    assert "line 501: a quote is not closed" in refused(tmp_path / "quote.csv")


def test_progress_goes_from_start_to_end(tmp_path, short, monkeypatch):
    monkeypatch.setattr(log_module, "CHUNK", 20000)
    shares = []
    read_log(short.write(tmp_path / "log.csv"), progress=shares.append)
    assert len(shares) > 5
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_an_interrupt_leaves_at_once(tmp_path, short, monkeypatch):
    monkeypatch.setattr(log_module, "CHUNK", 20000)

    def stop(share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        read_log(short.write(tmp_path / "log.csv"), progress=stop)
