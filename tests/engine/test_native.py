"""Kernels compiled by Zig: the bits of Numba, kept under their source, and Numba where Zig cannot."""

import logging
import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from tests.engine.libraries import new_store

from stillhook import Scenario, load_crane
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.errors import SimulationError
from stillhook.kernels.build import driver
from stillhook.kernels.c99 import library as native
from stillhook.kernels.c99.library import Entry, Library
from stillhook.kernels.lanes import VL, Array

needs_zig = pytest.mark.skipif(native.compiler() is None, reason="Zig is not installed (extra native), or left out")


def twice(A: Array, n: int, x: float):
    for i in range(n):
        A[i] = x * A[i]


def outside(A: Array, n: int, x: float):
    A[:n] *= x


@pytest.fixture
def store() -> Iterator[Path]:
    """A new folder of libraries."""
    with new_store() as folder:
        yield folder


def library(folder: Path, function=twice) -> Library:
    return Library({"twice": function}, folder / "state", folder)


def doubled(entry) -> list[float]:
    A = np.array([1.0, 2.0, 3.0])
    entry(A, 2, 2.0)
    return A.tolist()


@needs_zig
@pytest.mark.thorough
@pytest.mark.parametrize("plant", ["active-passive", "pure-active"])
@pytest.mark.parametrize("lanes", [1, VL])
def test_zig_and_numba_agree_to_the_bit(plant, lanes, monkeypatch, numba):
    crane = load_crane({"active-passive": "nov-250t", "pure-active": "nov-100t-pure-active"}[plant])
    cases = [
        Scenario(load=f"{10 + 3 * i} t", s_w="80 m", tip="sine 2 m 9 s", mode="hs", duration="120 s")
        for i in range(lanes)
    ]

    def results():
        return run_cases([crane] * lanes, cases, step=2, lanes=lanes, every=1, threads=1, keep=unchanged)

    by_zig = results()
    d = driver(plant, lanes)
    monkeypatch.setattr(d, "run", d.run.other())
    monkeypatch.setattr(d, "at_rest", d.at_rest.other())
    for ours, theirs in zip(by_zig, results(), strict=True):
        np.testing.assert_array_equal(ours.series, theirs.series)
        assert ours.stats == theirs.stats


@needs_zig
@pytest.mark.slow
def test_an_edit_elsewhere_does_not_compile_again(store, monkeypatch):
    assert doubled(Entry(library(store), "twice", dict)) == [2.0, 4.0, 3.0]
    monkeypatch.setattr(native, "compiler", lambda: ("no such compiler",))
    other_state = Library({"twice": twice}, store / "other-state", store)
    assert doubled(Entry(other_state, "twice", dict)) == [2.0, 4.0, 3.0]
    assert other_state.is_compiled()


@needs_zig
@pytest.mark.slow
def test_one_compilation_serves_all(store, monkeypatch):
    calls = []
    run = subprocess.run
    monkeypatch.setattr(native.subprocess, "run", lambda *a, **k: (calls.append(a), run(*a, **k))[1])
    with ThreadPoolExecutor(4) as pool:
        made = list(pool.map(lambda _: next(library(store).files()), range(4)))
    assert len(set(made)) == len(calls) == 1


@needs_zig
def test_numba_compiles_what_is_outside_the_translated_subset(store, caplog):
    assert doubled(Entry(library(store, outside), "twice", lambda: outside)) == [2.0, 4.0, 3.0]
    assert caplog.records == []


@needs_zig
def test_numba_compiles_where_zig_fails(store, monkeypatch, caplog):
    monkeypatch.setattr(native, "FLAGS", (*native.FLAGS, "--no-such-option"))
    with caplog.at_level(logging.WARNING):
        assert doubled(Entry(library(store), "twice", lambda: twice)) == [2.0, 4.0, 3.0]
    (record,) = caplog.records
    assert record.message.startswith("Zig did not compile a kernel, so Numba does: ")
    assert "\n" not in record.message
    assert not list(store.glob("*.so"))


def test_an_unknown_way_to_compile_is_refused(monkeypatch):
    monkeypatch.setenv(native.VARIABLE, "magic")
    with pytest.raises(SimulationError, match=r'^STILLHOOK_KERNELS = "magic": choose native or numba\.$'):
        native.compiler()
    monkeypatch.setenv(native.VARIABLE, "numba")
    assert native.compiler() is None
