"""Files of any kind that are no files, do not end, lie about what they hold, or hold what no reader expects: one line, soon, in little memory."""

import functools
import gzip
import json
import os
import resource
import stat
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import stillhook
from stillhook import load_crane, load_lift, load_plan, read_tip_motion, read_vessel
from stillhook.base.gateway import access, budget
from stillhook.base.gateway.budget import JSON, RECORDS, TABLE, TOML, in_time
from stillhook.base.gateway.guard import guarded, reader
from stillhook.base.gateway.parse import from_json, from_toml, from_yaml
from stillhook.base.kept.sealed import read_sealed
from stillhook.errors import Cancelled, LogError, SpecError, StillhookError, UnreadableError
from stillhook.export.hosts.exchange import Exchange, Sample
from stillhook.formats.case_file import load_case
from stillhook.formats.motion.open import read_ship_motion
from stillhook.formats.table.read import open_table
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.formats.weather.file import read_weather
from stillhook.library.certificate import read_certificate
from stillhook.logs.log import read_log
from stillhook.plan.definition.load_chart import read_load_chart
from stillhook.spec.lift.stored import stored_lowerings

SOON = 20.0
"""Longest time for one line about a file of any size here [s]: a busy machine, and the first use of a library."""
READERS: dict[str, Callable[[Path], object]] = {
    "crane.toml": load_crane,
    "case.toml": load_case,
    "lift.toml": load_lift,
    "plan.toml": load_plan,
    "vessel.yml": read_vessel,
    "vessel.re1": read_vessel,
    "motion.csv": read_ship_motion,
    "tip.csv": read_tip_motion,
    "tip.json": read_tip_motion,
    "weather.csv": read_weather,
    "spectra.txt": read_sea,
    "chart.csv": read_load_chart,
    "log.csv": read_log,
    "certificate.json": read_certificate,
    "run.nc": stillhook.load_run,
}


def line_of(read: Callable[[], object]) -> str:
    """The one line with which a file is refused."""
    start = time.monotonic()
    with pytest.raises(StillhookError) as problem:
        read()
    assert time.monotonic() - start < SOON
    line = str(problem.value)
    assert line.isprintable()
    assert len(line) < 1000
    return line


@pytest.fixture(params=list(READERS))
def kind(request) -> str:
    return request.param


class TestWhatIsNoFile:
    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in folders there")
    def test_a_pipe_is_refused_without_waiting_for_someone_to_write(self, kind, tmp_path):
        os.mkfifo(tmp_path / kind)
        assert kind in line_of(lambda: READERS[kind](tmp_path / kind))

    @pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes in folders there")
    def test_a_pipe_that_takes_the_place_of_a_file_between_look_and_opening_is_refused(self, tmp_path, monkeypatch):
        file, usual = tmp_path / "crane.toml", Path.stat
        os.mkfifo(file)
        (tmp_path / "other").write_text("x")
        swapped = lambda path, **more: usual(tmp_path / "other" if path == file else path, **more)
        monkeypatch.setattr(Path, "stat", swapped)
        assert "is not an ordinary file" in line_of(lambda: access.read_bytes(file, "file", SpecError, TOML))

    @pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no such device")
    def test_a_device_without_end_is_refused(self, kind, tmp_path):
        (tmp_path / kind).symlink_to("/dev/zero")
        assert kind in line_of(lambda: READERS[kind](tmp_path / kind))

    def test_a_folder_is_refused(self, kind, tmp_path):
        (tmp_path / kind).mkdir()
        assert kind in line_of(lambda: READERS[kind](tmp_path / kind))

    def test_a_file_that_is_not_there_is_refused(self, kind, tmp_path):
        assert kind in line_of(lambda: READERS[kind](tmp_path / kind))

    def test_links_that_point_at_each_other_are_refused(self, kind, tmp_path):
        (tmp_path / kind).symlink_to(tmp_path / "second")
        (tmp_path / "second").symlink_to(tmp_path / kind)
        assert kind in line_of(lambda: READERS[kind](tmp_path / kind))

    @pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="all rights, or no such rights there")
    def test_a_file_that_may_not_be_read_is_refused(self, kind, tmp_path):
        (tmp_path / kind).write_text("x")
        (tmp_path / kind).chmod(0)
        assert kind in line_of(lambda: READERS[kind](tmp_path / kind))

    @pytest.mark.parametrize("name", ["\0", "a\0b.toml", "x" * 5000 + ".toml", "\ud800.toml"])
    def test_a_name_that_no_file_can_have_is_refused(self, name):
        line_of(lambda: access.read_bytes(name, "file", SpecError, TOML))


CONTENT = {
    "nothing": b"",
    "blanks": b" \n\t\r\n" * 1000,
    "zeros": b"\0" * 100_000,
    "byte order alone": b"\xff\xfe",
    "half a sign of UTF-16": b"\xff\xfea",
    "UTF-16": "a = [1, 2]\n".encode("utf-16"),
    "UTF-32": "a = [1, 2]\n".encode("utf-32"),
    "bytes of no text": bytes(range(256)) * 400,
    "carriage returns": b"a,b\r1,2\r" * 1000,
    "one line": b"1," * 2_000_000,
    "one word": b"x" * 4_000_000,
    "one number": b"9" * 4_000_000,
    "one dotted key": b"a." * 40_000 + b"b = 1",
    "one dotted table": b"[" + b"a." * 40_000 + b"b]\nc = 1",
    "brackets": b"[" * 500_000,
    "brackets in a value": b"a = " + b"[" * 50_000 + b"]" * 50_000,
    "braces": b'{"a":' * 100_000,
    "quotes": b'"' * 500_001,
    "anchors": b"VesselTypes: &a [x]\n" + b"".join(b"k%d: &k%d [*a, *a, *a]\n" % (i, i) for i in range(100)),
    "not numbers": b"time [s],heave [m],tip [m],Hs [m]\n" + b"nan,inf,-inf,1e999\n" * 100,
    "huge numbers": b"time [s],heave [m],tip [m],Hs [m]\n" + b"1e308,1e308,-1e308,1e308\n" * 100,
}


@pytest.mark.long
@pytest.mark.parametrize("content", CONTENT.values(), ids=CONTENT)
def test_what_no_reader_expects_is_one_line_soon(kind, content, tmp_path):
    (tmp_path / kind).write_bytes(content)
    assert kind in line_of(lambda: READERS[kind](tmp_path / kind))


class TestBudgets:
    @pytest.mark.long
    def test_a_file_larger_than_its_budget_is_refused(self, kind, tmp_path):
        """Of logs, which are read in pieces, and of binary files, which have limits of their own, there is none."""
        with (tmp_path / kind).open("wb") as file:
            file.truncate(RECORDS.size + 1)
        assert kind in line_of(lambda: READERS[kind](tmp_path / kind))

    def test_of_a_file_that_grows_no_more_than_the_budget_is_read(self, tmp_path):
        file, over = tmp_path / "grows.toml", threading.Event()
        file.write_bytes(b"#" * 1000)

        def grow() -> None:
            with file.open("ab") as stream:
                while not over.is_set() and stream.tell() < 20 * TOML.size:
                    stream.write(b"#" * 100_000)

        writer = threading.Thread(target=grow)
        writer.start()
        try:
            while file.stat().st_size <= TOML.size:
                time.sleep(0.01)
            assert "holds more than 1 MB" in line_of(lambda: load_crane(file))
        finally:
            over.set()
            writer.join()

    def test_what_gz_packs_densely_is_refused_before_it_fills_memory(self, tmp_path):
        file = tmp_path / "chart.csv"
        with gzip.open(file, "wb") as stream:
            for _ in range(20):
                stream.write(b"1,2\n" * 1_000_000)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        assert "holds more than 50 MB" in line_of(lambda: open_table(file, SpecError))
        assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 < 4 * TABLE.size

    @pytest.mark.parametrize("text", ["a." * 40_000 + "b = 1", "[" + "a." * 40_000 + "b]", '"a".' * 20_000 + "b = 1"])
    def test_a_key_of_many_parts_costs_no_memory(self, text):
        """tomllib takes 1.6 GB for 40 kB of them: their square."""
        start = time.monotonic()
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with pytest.raises(UnreadableError, match=r"a key of .* parts, up to 32 are read"):
            from_toml(text)
        assert time.monotonic() - start < 2.0
        assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 < 100e6

    @pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
    def test_rows_and_cells_beyond_the_budget_are_refused(self, end, tmp_path):
        (tmp_path / "x.csv").write_bytes((b"1,2;3" + end) * 4096)
        rows, cells = 4096, 2 * 4096
        read = lambda **most: access.read_bytes(tmp_path / "x.csv", "table", LogError, TABLE._replace(**most))
        assert read(rows=rows, cells=cells)
        assert f"x.csv: holds more than {rows - 1} lines" in line_of(lambda: read(rows=rows - 1))
        assert f"x.csv: holds more than {cells - 1} cells" in line_of(lambda: read(cells=cells - 1))

    @pytest.mark.long
    def test_a_file_that_takes_too_long_is_refused_with_the_variable_that_allows_more(self, monkeypatch):
        monkeypatch.setenv(budget.TIME, "0.01 s")
        slow = (time.sleep(0.001) for _ in range(100_000))
        assert budget.TIME in line_of(lambda: list(in_time(slow, 0, "x.csv", LogError)))


class TestToml:
    @pytest.mark.parametrize(
        "text",
        [
            'a = "b.b.b.' + "b." * 100 + '"',
            "a = '" + "[" * 100 + "'",
            'a = """' + "{\n" * 100 + '"""',
            "# " + "b." * 100 + "\na = 1",
            "a = [" + "1.5, " * 200 + "]",
            "\n".join(f"k{i} = 1.5" for i in range(200)),
            '"' + "b." * 40 + '" = 1',
            "a = '''x'''''\nb = 1",
        ],
    )
    def test_signs_in_texts_comments_and_numbers_are_no_nesting(self, text):
        from_toml(text)

    @pytest.mark.parametrize(
        "text",
        [
            "x = {y = '''a'''', " + "b." * 60 + "c = 1, z = 'q'}",
            'x = {y = """a"""", ' + "b." * 60 + 'c = 1, z = "q"}',
            '"a#".' + "b." * 60 + "c = 1",
            "a.\\\n".replace("\\\n", "") * 60 + "b = 1",
            "a = " + "{b = [" * 40 + "]}" * 40,
        ],
    )
    def test_nesting_hides_behind_nothing(self, text):
        with pytest.raises(UnreadableError, match=r"parts|deep"):
            from_toml(text)


class TestJson:
    @pytest.mark.parametrize(
        ("text", "says"),
        [
            ('{"a": 1, "b": 2, "a": 3}', '"a" is given twice'),
            ("[NaN]", "NaN is not a number"),
            ("[-Infinity]", "-Infinity is not a number"),
            ("[1e999]", "too large a number"),
            (f"[{'9' * 400}.0]", "too large a number"),
            (f"[-{'9' * 30}]", "too large a whole number"),
            (f"[{'9' * 5000}]", "too large a whole number"),
            ("[" * 65 + "]" * 65, "nested 65 deep, up to 64 are read"),
            ("[" * 1_000_000, "nested 1000000 deep"),
            (r'["\ud800"]', "is not Unicode text"),
            (r'{"\udfff": 1}', "is not Unicode text"),
            (b'["\xff"]', "can't decode byte 0xff"),
            ("", "Expecting value"),
            ('{"a": 1} {"a": 2}', "Extra data"),
        ],
    )
    def test_what_no_file_of_ours_holds_is_refused(self, text, says):
        with pytest.raises(UnreadableError) as problem:
            from_json(text)
        assert says in str(problem.value)

    @pytest.mark.parametrize(
        "value",
        [
            {"a": "[" * 1000, "b": '"' * 200, "c": "\\" * 99},
            "\U0001f600",
            [1e308, -1e-320, 2**64 - 1, -(2**63)],
            functools.reduce(lambda inner, _: [inner], range(63), []),
        ],
    )
    def test_what_json_writes_comes_back(self, value):
        assert from_json(json.dumps(value)) == value
        assert from_json(json.dumps(value).encode()) == value


class TestYaml:
    @pytest.mark.parametrize(
        ("text", "says"),
        [
            ("a: &x [1, *x]\n", "*x is a part of itself"),
            ("- &a [x]\n" + "".join("- &a [*a, *a, *a]\n" for _ in range(20)), "more than 5000000 values"),
            ("[" * 33 + "]" * 33, "nested 33 deep, up to 32 are read"),
            ("{" * 100_000, "nested 33 deep"),
            ("a: " + "1:" * 100_000 + "1", "too long a number"),
            ("a: 0x" + "f" * 100_000, "too long a number"),
            ("a: !!python/object/apply:os.system [x]", "constructor"),
            ("a: 2020-13-45", "month"),
        ],
    )
    def test_what_no_model_holds_is_refused(self, text, says):
        pytest.importorskip("yaml")
        start = time.monotonic()
        with pytest.raises(UnreadableError) as problem:
            from_yaml(text)
        assert says in str(problem.value)
        assert time.monotonic() - start < 2.0


class TestWhatEscapes:
    @pytest.mark.parametrize(
        ("problem", "says"),
        [
            (KeyError("a\nb"), "KeyError: 'a\\nb'"),
            (MemoryError(), "takes more memory than there is"),
            (RecursionError("x"), "nested too deep"),
            (OSError(5, "Input/output error"), "(Input/output error)"),
            (UnreadableError("cut short"), "(cut short)"),
            (ValueError("x" * 10_000), "ValueError: xxx"),
            (ZeroDivisionError(), "(ZeroDivisionError)"),
        ],
    )
    def test_any_exception_of_a_reader_is_one_line_of_its_error(self, problem, says):
        @reader(LogError)
        def read(path: Path) -> None:
            raise problem

        for call in (lambda: read("folder/x.csv"), lambda: read(path=Path("folder/x.csv"))):
            with pytest.raises(LogError) as seen:
                call()
            line = str(seen.value)
            assert line.startswith("x.csv: cannot be read (")
            assert says in line
            assert line.endswith("). Correct the file, or give another.")
            assert len(line) < 250
            assert seen.value.__cause__ is problem

    @pytest.mark.parametrize("problem", [SpecError("mine"), Cancelled(), ModuleNotFoundError("x"), KeyboardInterrupt()])
    def test_errors_of_our_own_cancellation_and_missing_libraries_pass(self, problem):
        with pytest.raises(type(problem)) as seen, guarded("x.csv", LogError):
            raise problem
        assert seen.value is problem

    def test_a_sealed_file_of_the_wrong_shape_is_refused(self, tmp_path):
        for text in ("[]", "null", '"x"', '{"format": {"a": 1}}', '{"format": "x 1", "digest": [1]}'):
            (tmp_path / "x.json").write_text(text)
            line_of(lambda: read_sealed(tmp_path / "x.json", "x 1", "a thing", "Make it again.", SpecError))
        assert JSON.depth < 100
        assert stat.S_ISREG((tmp_path / "x.json").stat().st_mode)


CRANE = load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", mode="ssc")
DEEP = functools.reduce(lambda inner, _: [inner], range(5000), [])


class TestWhatIsStored:
    @pytest.mark.parametrize(
        "change",
        [
            {"s_w": None},
            {"s_w": "100 m"},
            {"load": -1.0},
            {"load": True},
            {"duration": 1e300},
            {"operator": {"profile": [[0.0, "x"]], "steps": []}},
            {"sensors": {"delay": None}},
            {"water": {"volume": -1.0}},
            {"modes": [[1.0]]},
            {"mode": []},
            {"strange": 1.0},
        ],
    )
    def test_a_scenario_that_none_can_be_is_refused(self, change):
        assert stillhook.Scenario.from_dict(CASE.to_dict()) == CASE
        assert line_of(lambda: stillhook.Scenario.from_dict({**CASE.to_dict(), **change})).startswith("stored scenario")

    @pytest.mark.parametrize("value", [None, "x", float("nan"), 1e308, 10**400, [1.0]])
    @pytest.mark.parametrize("place", range(5))
    def test_a_host_that_gives_no_finite_number_is_refused(self, place, value):
        sample = [0.0, 1.01e6, 20.0, 0.0, 0.0]
        sample[place] = value
        line_of(lambda: Exchange(CRANE, CASE).at(Sample(*sample), new_step=True))

    @pytest.mark.parametrize("value", [10**5000, DEEP, {1: DEEP}, object()], ids=["digits", "deep", "table", "object"])
    def test_an_argument_that_cannot_be_printed_is_refused(self, value):
        session = stillhook.Session(CRANE, CASE)
        for call in (session.set_states, session.step, session.restore, lambda x: session.set("v_op", x)):
            line_of(functools.partial(call, value))

    @pytest.mark.parametrize(
        "text", ["", "[]", "null", '{"lifts": 1}', '{"lifts": [{}], "cases": []}', "[" * 100_000, '{"lifts": [NaN]}']
    )
    def test_lowerings_of_another_shape_are_refused(self, text):
        assert line_of(lambda: stored_lowerings(text)).startswith("stored lowerings: ")


@pytest.mark.parametrize("read", [from_toml, from_json])
def test_a_text_with_bytes_that_were_no_text_is_refused(read):
    text = b'{"a": "\xf2"}'.decode("utf-8", "surrogateescape")
    with pytest.raises(UnreadableError, match="is not Unicode text"):
        read(text if read is from_json else 'a = "\udcf2"')


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ('a = "\\u001b[31mvalidated"', "U+001B"),
        ('[t]\na = ["x", { b = "over\\rwritten" }]', "U+000D"),
        ("a = 'left\u202eright'", "U+202E"),
        ("a = '''two\n\u2028'''", "U+2028"),
        ('a = "\\U0000FFFE"', "U+FFFE"),
        ('a = "C:\\bin"', "U+0008"),
    ],
)
def test_values_that_command_a_terminal_or_hide_what_follows_are_refused(text, code):
    with pytest.raises(UnreadableError, match="has a sign that is not for print, ") as problem:
        from_toml(text)
    assert code in str(problem.value)
    assert str(problem.value).isprintable()


def test_texts_of_any_language_and_of_several_lines_are_read():
    text = "Ålesund\u00a0№ 7, 吊机\t😀\nsecond line"
    assert from_toml(f'a = """{text}"""  # \u202e in a remark\n') == {"a": text}
