"""Out of memory at the n-th large allocation, or by a limit: one line, exit code 2, and no file half-written."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.faults.bench import Bench
from tests.faults.commands import COMMANDS, Writes
from tests.faults.injector import ROOT, compiled

from stillhook.errors import UnreadableError
from stillhook.report.document import Document
from stillhook.report.pdf import Unset, pdf

LARGE = 262_144
"""Least size of an allocation that fails [bytes]: the interpreter's own are smaller."""
MOST = 20
"""Allocations of a command that fail, spread over all of them."""
ABORTED = (-6, -11)
"""Where one of its own allocations fails HDF5 ends the process; what it needs is asked for before it begins."""
INSIDE = {
    "map": Writes('map nov-250t --controllers ssc --loads "30 t" --speeds "20 m/min"'),
    "convert": COMMANDS["convert csv"],
}
"""Command lines whose arrays are NumPy's."""
LIMITED = """
import resource, sys
from pathlib import Path
import numpy, xarray
from stillhook.formats.table.netcdf import write_netcdf

names = numpy.array([f"case {i}" for i in range(20)], dtype=object)
data = xarray.Dataset({"a": (("case", "time"), numpy.random.rand(20, 10_000)), "name": ("case", names)})
write_netcdf(Path(sys.argv[1]), {"": data})
ends = set()
for size in range(0, 60_000_000, 2_000_000):
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + size, resource.RLIM_INFINITY))
    try:
        write_netcdf(Path(sys.argv[1]), {"": data})
        ends.add("written")
    except MemoryError:
        ends.add("refused")
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
print(sorted(ends))
"""
"""Runs that are written with less and less memory left."""
SMALL = """
from stillhook.report.document import Document
from stillhook.report.pdf import Unset, pdf

try:
    pdf(Document("A title"))
except Unset as problem:
    print(problem)
"""
"""A PDF with less memory than typst needs."""


def script(text: str, *arguments: str, **environment: str) -> str:
    """What a script prints; it ends by itself."""
    env = os.environ | {"PYTHONPATH": str(ROOT / "src")} | environment
    done = subprocess.run(
        [sys.executable, "-c", text, *arguments], capture_output=True, text=True, env=env, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are those of Linux")
def test_a_run_is_written_or_refused_however_little_memory_is_left(tmp_path: Path):
    assert script(LIMITED, str(tmp_path / "run.nc")) == "['refused', 'written']"


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are those of Linux")
def test_a_pdf_that_lacks_memory_is_one_line():
    line = script(SMALL, STILLHOOK_READ_MEMORY="60 MB")
    assert line.startswith("the document cannot be set (")
    assert "\n" not in line


def test_a_pdf_that_lacks_memory_is_no_other_pdf(monkeypatch: pytest.MonkeyPatch):
    def ends_once(*of: object) -> list[bytes]:
        monkeypatch.setattr("stillhook.report.pdf.in_own_process", lambda *of: [b"a PDF that cannot be archived"])
        raise UnreadableError("its reader broke down")

    monkeypatch.setattr("stillhook.report.pdf.in_own_process", ends_once)
    with pytest.raises(Unset, match="cannot be set"):
        pdf(Document("A title"))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    library = compiled(tmp_path_factory.mktemp("shim"))
    bench = Bench(tmp_path_factory.mktemp("memory"), library)
    with bench.injector:
        yield bench


@pytest.mark.thorough
@pytest.mark.parametrize("name", INSIDE)
def test_memory_that_runs_out_is_one_line(bench: Bench, name: str):
    writes = INSIDE[name]
    arguments, new = bench.complete(writes)
    bench.reset()
    count = bench.run(arguments, memory=(0, LARGE)).allocations
    assert count > 0
    for at in range(1, count + 1, 1 + count // MOST):
        start = bench.reset()
        done = bench.run(arguments, memory=(at, LARGE))
        if done.code == writes.code:  # what failed was not needed, as a cache is not
            assert bench.tree() == new
            continue
        assert (done.code, len(done.lines)) == (2, 1), done.err
        assert "memory" in done.err
        assert bench.tree() == start


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["run", "response"])
def test_memory_that_runs_out_leaves_no_half_file(bench: Bench, name: str):
    writes = COMMANDS[name]
    arguments, new = bench.complete(writes)
    bench.reset()
    count = bench.run(arguments, memory=(0, LARGE)).allocations
    for at in range(1, count + 1, 1 + count // MOST):
        bench.reset()
        done = bench.run(arguments, memory=(at, LARGE))
        assert done.code in (writes.code, 2, *ABORTED), done.err
        lasting = {name: content for name, content in bench.tree().items() if not name.startswith((".", "tmp"))}
        assert all(new[name] == content for name, content in lasting.items())
        assert not lasting or done.code == writes.code
