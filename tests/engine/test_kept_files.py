"""Files that are kept between runs are believed only as they were written: whatever happened to one, the numbers are
those without it, with one note and no error."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.engine.damage import damaged
from tests.engine.libraries import new_store

from stillhook import Scenario, load_crane
from stillhook.base.kept import checked
from stillhook.base.kept.checked import BESIDE, Kept, is_sound, read_checked, write_beside, write_checked
from stillhook.engine.simulate import End, run_cases, stored_places
from stillhook.engine.store import SUFFIX
from stillhook.kernels.c99 import library as native
from stillhook.kernels.c99 import zig
from stillhook.trust.manifest import NAME

pytestmark = pytest.mark.slow
needs_zig = pytest.mark.skipif(native.compiler() is None, reason="Zig is not installed (extra native), or left out")
ROOT = Path(__file__).resolve().parents[2]
CRANE = load_crane("nov-250t")
CASES = [Scenario(load=f"{10 + i} t", s_w="100 m", tip="sine 1 m 10 s", duration="20 s", warm_up="5 s") for i in (0, 1)]
CONTENT = b"numbers of a run\0\xff\n" * 3


@pytest.fixture
def cache() -> Iterator[Path]:
    """A new folder of libraries."""
    with new_store() as folder:
        yield folder


@pytest.fixture(autouse=True)
def _no_note_yet():
    checked._NOTED.clear()
    yield
    checked._NOTED.clear()


def notes(caplog) -> list[str]:
    return [record.getMessage() for record in caplog.records]


# The files themselves


def test_no_flipped_bit_and_no_cut_is_believed(tmp_path, caplog):
    file = tmp_path / "answer"
    write_checked(file, CONTENT)
    assert read_checked(file, Kept.ANSWER) == CONTENT
    written = file.read_bytes()
    for bit in range(8 * len(written)):
        data = bytearray(written)
        data[bit // 8] ^= 1 << bit % 8
        file.write_bytes(bytes(data))
        assert read_checked(file, Kept.ANSWER) is None
    for length in range(len(written)):
        file.write_bytes(written[:length])
        assert read_checked(file, Kept.ANSWER) is None
    assert notes(caplog) == [f"{file}: damaged (its checksum does not fit). The answer is computed again."]


@pytest.mark.parametrize("content", [b"", CONTENT, b"x" * 100_000])
def test_what_was_written_is_read(tmp_path, caplog, content):
    write_checked(tmp_path / "a", content)
    assert read_checked(tmp_path / "a", Kept.CASES) == content
    assert read_checked(tmp_path / "b", Kept.CASES) is None  # absent: nothing is damaged
    assert notes(caplog) == []


def test_a_good_file_under_the_name_of_another_is_not_believed(tmp_path, caplog):
    write_checked(tmp_path / "a", CONTENT)
    (tmp_path / "a").rename(tmp_path / "b")
    assert read_checked(tmp_path / "b", Kept.RESIDUAL) is None
    assert notes(caplog) == [f"{tmp_path / 'b'}: damaged (its checksum does not fit). The winch is identified again."]


def test_a_folder_of_the_name_is_noted_and_waited_for_no_more_than_a_pipe_is(tmp_path, caplog):
    (tmp_path / "a").mkdir()
    assert read_checked(tmp_path / "a", Kept.CASES) is None
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "b")
        assert read_checked(tmp_path / "b", Kept.ANSWER) is None
    assert all("damaged (not a file)" in note for note in notes(caplog))


def test_a_checksum_beside_a_file_is_of_that_file(tmp_path, caplog):
    file, other = tmp_path / "library", tmp_path / f"library{BESIDE}"
    write_beside(file, CONTENT)
    assert not is_sound(file, Kept.LIBRARY)  # killed before the file had its name
    file.write_bytes(CONTENT)
    assert is_sound(file, Kept.LIBRARY)
    assert notes(caplog) == []
    written = other.read_bytes()
    for target, data in ((file, CONTENT), (other, written)):
        for wrong in damaged(data, 300):
            target.write_bytes(wrong)
            assert not is_sound(file, Kept.LIBRARY)
        target.write_bytes(data)
    other.unlink()
    assert not is_sound(file, Kept.LIBRARY)
    assert len(notes(caplog)) == 1


# Compiled code, in processes of their own: a library that is damaged ends the process that loads it

TWICE = """
from stillhook.kernels.lanes import Array

def twice(A: Array, n: int, x: float):
    for i in range(n):
        A[i] = x * A[i]
"""
START = (
    TWICE
    + """
import sys
from pathlib import Path

import numpy as np
from tests.engine.damage import damaged

from stillhook.kernels.c99 import library as native
from stillhook.kernels.c99.library import Entry, Library

folder = Path(sys.argv[1])


def by_zig():
    return Entry(Library({"twice": twice}, folder / "state", folder), "twice", None)


def by_numba():
    from stillhook.kernels.by_numba import machine_code

    return machine_code(twice, folder / "numba")


def doubled(kernel):
    A = np.array([1.0, 2.0, 3.0])
    kernel(A, 2, 2.0)
    return A.tolist()
"""
)
DAMAGED = (
    START
    + """
make = {"zig": by_zig, "numba": by_numba}[sys.argv[2]]
assert doubled(make()) == [2.0, 4.0, 3.0]
(file,) = [path for path in folder.rglob(sys.argv[3]) if path.name[0] != "."]
sound = file.read_bytes()
for data in damaged(sound, int(sys.argv[4]), int(sys.argv[5])):
    file.unlink()
    file.write_bytes(data)
    assert doubled(make()) == [2.0, 4.0, 3.0]
    assert doubled(make()) == [2.0, 4.0, 3.0]
"""
)


def script(tmp_path: Path, text: str, *arguments: object, **more: object) -> subprocess.Popen[str]:
    """A Python process on the cache of the tests, at whose end its output can be read."""
    file = tmp_path / "script.py"
    file.write_text(text, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join((str(ROOT / "src"), str(ROOT)))}
    command = [sys.executable, str(file), *map(str, arguments)]
    return subprocess.Popen(
        command, env=environment | more, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
    )


def finished(process: subprocess.Popen[str]) -> tuple[str, list[str]]:
    out, error = process.communicate(timeout=600.0)
    assert process.returncode == 0, (process.returncode, error)
    return out, error.splitlines()


@pytest.mark.long
@needs_zig
@pytest.mark.parametrize("files", [f"*{native.SUFFIX}", f"*{native.SUFFIX}{BESIDE}", "library*.txt"])
@pytest.mark.parametrize("count", [8, pytest.param(80, marks=pytest.mark.thorough)])
def test_a_damaged_library_is_compiled_again_and_never_loaded(tmp_path, cache, files, count):
    out, said = finished(script(tmp_path, DAMAGED, cache, "zig", files, count, count))
    assert out == ""
    (line,) = said
    assert line.endswith(" The kernel is compiled again.")
    assert ": damaged (" in line


@pytest.mark.long
@pytest.mark.usefixtures("numba")
@pytest.mark.parametrize("count", [8, pytest.param(80, marks=pytest.mark.thorough)])
def test_damaged_machine_code_of_numba_is_compiled_again(tmp_path, cache, count):
    _, said = finished(script(tmp_path, DAMAGED, cache, "numba", "*.nbc", count, count))
    (line,) = said
    assert line.endswith(" Numba compiles the kernel again.")


WHEEL = (
    START
    + """
by_zig().function
(made,) = folder.glob(f"*{native.SUFFIX}")
shipped = folder / "shipped" / "library"
native.write_beside(shipped, made.read_bytes())
shipped.write_bytes(bytes(x ^ (i % 97 == 0) for i, x in enumerate(made.read_bytes())))
native.shipped_library = lambda *_, **__: shipped
print(doubled(by_zig()))
"""
)


@needs_zig
def test_a_damaged_library_of_a_wheel_is_left_out(tmp_path, cache):
    out, (line,) = finished(script(tmp_path, WHEEL, cache))
    assert out == "[2.0, 4.0, 3.0]\n"
    assert line.endswith(" The compiled kernels of this installation are not used: install Stillhook again.")


ONCE = (
    START
    + """
calls = []
run = native.subprocess.run
native.subprocess.run = lambda *a, **k: (calls.append(a), run(*a, **k))[1]
print(doubled(by_zig()), len(calls))
"""
)


@needs_zig
def test_two_processes_that_begin_together_compile_once(tmp_path, cache):
    both = [script(tmp_path, ONCE, cache) for _ in range(2)]
    answers = [finished(each) for each in both]
    assert [said for _, said in answers] == [[], []]
    assert sorted(out for out, _ in answers) == ["[2.0, 4.0, 3.0] 0\n", "[2.0, 4.0, 3.0] 1\n"]


KILLED = (
    START
    + """
import os, time
def hang(*_, **__):
    print("compiling", flush=True)
    time.sleep(600.0)
native.subprocess.run = hang
doubled(by_zig())
"""
)


@pytest.mark.long
@needs_zig
@pytest.mark.skipif(os.name == "nt", reason="no such signal")
def test_a_process_that_is_killed_while_it_compiles_holds_nobody_up(tmp_path, cache):
    first = script(tmp_path, KILLED, cache)
    assert first.stdout.readline() == "compiling\n"
    waiting = script(tmp_path, ONCE, cache)
    time.sleep(1.0)
    first.send_signal(signal.SIGKILL)
    first.communicate()
    assert finished(waiting) == ("[2.0, 4.0, 3.0] 1\n", [])


@needs_zig
def test_a_library_is_not_linked_with_a_damaged_object_of_zig(tmp_path, caplog):
    cache = tmp_path / "zig"

    def compiled() -> str:
        with zig.workplace(cache):
            known = cache / zig.OBJECTS / "abc" / "runtime.o"
            if not known.exists():
                known.parent.mkdir(parents=True)
                known.write_bytes(CONTENT)
            return known.read_bytes()

    assert compiled() == compiled() == CONTENT
    assert notes(caplog) == []
    (cache / zig.OBJECTS / "abc" / "runtime.o").write_bytes(CONTENT[:-1])
    assert compiled() == CONTENT
    assert notes(caplog) == [f"{cache}: damaged (an object in it has changed). Zig makes what it keeps again."]
    (cache / zig.OBJECTS / "abc" / "runtime.o").unlink()
    assert compiled() == CONTENT


def test_a_zig_that_crashes_with_what_it_kept_runs_once_more_without(tmp_path, caplog):
    """A changed index ends Zig by a signal; an error in the text is an answer, and nothing is removed."""
    cache, index = tmp_path / "zig", tmp_path / "zig" / "z" / "index"

    def answer(code: int, words: str = "") -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess([], code, "", words)

    def compile_in(folder, environment):
        return answer(-signal.SIGSEGV if index.exists() else 0)

    assert zig.compiled(cache, compile_in).returncode == 0
    index.parent.mkdir(parents=True)
    index.write_bytes(b"damaged")
    assert zig.compiled(cache, lambda folder, environment: answer(1, "kernels.c:1: error: x")).returncode == 1
    assert index.exists()
    assert notes(caplog) == []
    assert zig.compiled(cache, compile_in).returncode == 0
    assert not index.exists()
    assert notes(caplog) == [f"{cache}: damaged (Zig crashed with what it kept). Zig makes what it keeps again."]


# A store


@pytest.mark.long
def test_cases_of_a_damaged_file_are_computed_again_and_the_file_is_replaced(tmp_path, caplog):
    first = run_cases(CRANE, CASES, store=tmp_path)
    (file,) = tmp_path.glob(f"*{SUFFIX}")
    sound = file.read_bytes()
    for wrong in damaged(sound, 100):
        file.write_bytes(wrong)
        assert repr(run_cases(CRANE, CASES, store=tmp_path)) == repr(first)
        assert file.read_bytes() == sound
    (note,) = notes(caplog)
    assert note.startswith(f"{file}: damaged (")
    assert note.endswith(" Its cases are computed again.")


@pytest.mark.parametrize("factor", [0.5, np.nan])
def test_other_numbers_in_a_store_are_not_believed(tmp_path, caplog, factor):
    """A sound file of NumPy, with the numbers of others: as a program writes it that knows no checksum."""
    first = run_cases(CRANE, CASES, store=tmp_path)
    (file,) = tmp_path.glob(f"*{SUFFIX}")
    with np.load(file, allow_pickle=False) as data:
        tables = dict(data)
    with open(file, "wb") as out:
        np.savez_compressed(out, **(tables | {"numbers": factor * tables["numbers"]}))
    assert repr(run_cases(CRANE, CASES, store=tmp_path)) == repr(first)
    assert len(notes(caplog)) == 1
    assert repr(run_cases(CRANE, CASES, store=tmp_path)) == repr(first)


def test_a_damaged_file_is_removed_when_its_cases_are_kept_in_others(tmp_path, caplog):
    first = run_cases(CRANE, CASES, store=tmp_path)
    (file,) = tmp_path.glob(f"*{SUFFIX}")
    file.write_bytes(file.read_bytes()[:-1])
    stranger = tmp_path / f"of a person{SUFFIX}"
    stranger.write_bytes(b"PK half a file")
    assert repr(run_cases(CRANE, CASES[::-1], store=tmp_path)) == repr(first[::-1])
    assert not file.exists()
    assert stranger.exists()  # no store gave it this name
    assert len(notes(caplog)) == 1


def test_a_damaged_file_stays_where_nothing_is_kept(tmp_path):
    first = run_cases(CRANE, CASES, store=tmp_path)
    (file,) = tmp_path.glob(f"*{SUFFIX}")
    sound = file.read_bytes()
    file.write_bytes(sound[:-1])
    settings = {"step": "5 ms", "sampling": "20 ms", "end": End.DURATION}
    assert stored_places(CRANE, CASES, store=tmp_path, **settings) == []
    assert file.read_bytes() == sound[:-1]
    file.write_bytes(sound)  # as another process replaces it
    assert stored_places(CRANE, CASES, store=tmp_path, **settings) == [0, 1]
    assert repr(run_cases(CRANE, CASES, store=tmp_path)) == repr(first)


STORED = """
import sys
from stillhook import Scenario, load_crane
from stillhook.engine.simulate import End, run_cases, stored_places

cases = [
    Scenario(load=f"{10 + i} t", s_w="100 m", tip="sine 1 m 10 s", duration="200 s", warm_up="5 s") for i in range(64)
]
for line in map(repr, run_cases(load_crane("nov-250t"), cases, store=sys.argv[1], threads=1)):
    print(line)
"""


@pytest.mark.long
def test_two_processes_share_a_store(tmp_path):
    store = tmp_path / "store"
    both = [script(tmp_path, STORED, store) for _ in range(2)]
    (a, said_a), (b, said_b) = map(finished, both)
    assert a == b
    assert said_a == said_b == []
    assert finished(script(tmp_path, STORED, store)) == (a, [])
    assert {path.name for path in store.iterdir() if not path.name.endswith(SUFFIX)} == {NAME}
