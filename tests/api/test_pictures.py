"""Two processes draw what one draws, and nothing is lost where the second cannot."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from stillhook.report import pictures
from stillhook.report.pictures import png

FEW, MANY = 2, pictures.WORTH


def figure(i: int) -> Figure:
    drawn = Figure(figsize=(4.0, 3.0), layout="constrained")
    ax = drawn.subplots()
    ax.plot(np.arange(50), np.sin(0.1 * (i + 1) * np.arange(50)), label=f"case {i}")
    ax.set_xlabel("time [s]")
    ax.legend()
    return drawn


def named(n: int) -> dict[str, Figure]:
    return {f"picture-{i}": figure(i) for i in range(n)}


@pytest.fixture
def cores(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)


@pytest.fixture
def started(monkeypatch, cores):
    """Processes that were started."""
    found, real = [], pictures.subprocess.Popen

    def popen(*arguments, **options):
        found.append(real(*arguments, **options))
        return found[-1]

    monkeypatch.setattr(pictures.subprocess, "Popen", popen)
    return found


@pytest.mark.thorough
@pytest.mark.parametrize(("n", "processes"), [(FEW, 0), (MANY, 1)])
def test_pictures_are_those_of_one_process_in_their_order(started, n, processes):
    drawn = pictures.pngs(named(n), 60)
    assert list(drawn) == list(named(n))
    assert drawn == {name: png(one, 60) for name, one in named(n).items()}
    assert len(started) == processes
    assert all(p.poll() is not None for p in started)


@pytest.mark.thorough
def test_settings_of_this_process_hold_in_the_second(started):
    import matplotlib

    with matplotlib.rc_context({"lines.linewidth": 5.0, "font.size": 14.0, "savefig.facecolor": "red"}):
        assert pictures.pngs(named(MANY), 60) == {name: png(one, 60) for name, one in named(MANY).items()}
    assert len(started) == 1


@pytest.mark.thorough
def test_a_figure_that_cannot_be_sent_is_drawn_here(started):
    odd = named(MANY)
    odd["picture-1"].axes[0].xaxis.set_major_formatter(lambda x, _: f"{x:.0f} s")
    assert set(pictures.pngs(odd, 60)) == set(odd)
    assert not started


@pytest.mark.thorough
@pytest.mark.parametrize(
    "boot", ["raise SystemExit(1)", "import sys; sys.stdout.write('no pictures')", "import sys; sys.stdin.read(10)"]
)
def test_a_second_process_that_breaks_down_costs_no_picture(started, monkeypatch, boot):
    monkeypatch.setattr(pictures, "_BOOT", boot)
    assert pictures.pngs(named(MANY), 60) == {name: png(one, 60) for name, one in named(MANY).items()}


@pytest.mark.thorough
def test_no_process_at_all_costs_no_picture(monkeypatch, cores, tmp_path):
    monkeypatch.setattr(sys, "executable", str(Path(tmp_path) / "none"))
    assert set(pictures.pngs(named(MANY), 60)) == set(named(MANY))


@pytest.mark.slow
def test_an_error_here_ends_the_second_process(started, monkeypatch):
    def broken(*_):
        raise ValueError("no ink")

    monkeypatch.setattr(pictures, "png", broken)
    with pytest.raises(ValueError, match="no ink"):
        pictures.pngs(named(MANY), 60)
    assert all(p.poll() is not None for p in started)
