"""Out of memory at the n-th large allocation: one line, exit code 2, and no file half-written."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.faults.bench import Bench
from tests.faults.commands import COMMANDS, Writes
from tests.faults.injector import compiled

LARGE = 262_144
"""Least size of an allocation that fails [bytes]: the interpreter's own are smaller."""
MOST = 20
"""Allocations of a command that fail, spread over all of them."""
ABORTED = (-6, -11)
"""HDF5 and Typst end the process where they get no memory; nothing in Python can prevent it."""
INSIDE = {
    "map": Writes('map nov-250t --controllers ssc --loads "30 t" --speeds "20 m/min"'),
    "convert": COMMANDS["convert csv"],
}
"""Command lines whose arrays are NumPy's."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    library = compiled(tmp_path_factory.mktemp("shim"))
    if library is None:
        pytest.skip("allocations fail in libc, on Linux with a C compiler")
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
