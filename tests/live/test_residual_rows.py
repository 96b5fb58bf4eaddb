"""Rows of a PLC as samples of what adaptation leaves over, from a stream, from a log, and from the command line."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tests.live.residuals import CRANE, learned

import stillhook
from stillhook.cli import run
from stillhook.errors import LiveError
from stillhook.live.estimate import FrictionEstimator, FrictionState
from stillhook.live.residual import ResidualModel, write_model
from stillhook.live.residual.logs import samples_of, sea_of
from stillhook.live.residual.samples import BIN, TOO_SLOW, Sampler, joined

NAMES = ("s_tip", "s_w", "omega_m", "p_a", "p_b", "p_hp", "alpha_m", "alpha_pm", "alpha_p", "F_w", "mode")
UNITS = {"s_tip": "m", "s_w": "m", "omega_m": "rad/s", "p_a": "Pa", "p_b": "Pa", "p_hp": "Pa", "F_w": "N"}
OWN_LAG = 25.0
"""What the twin's own log may leave over [N m], of some 900: its load cell has no lag, and a lag of 50 ms is taken."""


@cache
def rows(period: float = 9.0, duration: float = 150.0, load: float = 60.0) -> dict[str, np.ndarray]:
    case = stillhook.Scenario(
        load=f"{load} t", s_w="800 m", mode="ssc", duration=f"{duration} s", tip=f"sine 0.9 m {period} s"
    )
    data = stillhook.simulate(CRANE, case, every="0.04 s")
    return {"time": data.time.values, **{n: data[n].values for n in NAMES}}


@cache
def state() -> FrictionState:
    """What is known of friction at the end of these rows."""
    return FrictionEstimator(CRANE).update(rows())


def sampled(x: dict[str, np.ndarray], each: int) -> tuple:
    sampler = Sampler(CRANE)
    parts = [sampler.take({n: v[k : k + each] for n, v in x.items()}, state()) for k in range(0, len(x["time"]), each)]
    return joined(parts), sampler.left_out


def test_adaptation_leaves_little_of_the_twins_own_log():
    x, _ = sampled(rows(), 25)
    assert len(x.t) > 200
    assert np.sqrt(np.mean(x.left**2)) < OWN_LAG < 0.05 * np.sqrt(np.mean(x.modelled**2))


@pytest.mark.parametrize("each", [1, 7, 10**6])
def test_samples_are_the_same_however_rows_come(each):
    """But for the inertia of the wire on the drum, which is that of the middle of what is worked off together."""
    together, of = sampled(rows(), 25)[0], sampled(rows(), each)[0]
    assert np.allclose(of.t, together.t)
    assert np.allclose(of.left, together.left, atol=0.5)
    assert np.allclose(of.omega, together.omega)


def test_what_says_nothing_is_counted():
    x = {n: v.copy() for n, v in rows().items()}
    x["mode"][:500] = 0.0
    x["p_a"][1000:1100] = np.nan
    _, left_out = sampled(x, 25)
    assert left_out["manual mode"] == round(500 * 0.04 / BIN)
    assert left_out["signal unknown"] >= round(100 * 0.04 / BIN)
    assert left_out[TOO_SLOW] > 0
    holes = {n: v[::2] for n, v in rows().items()}  # 80 ms apart
    assert sampled(holes, 25)[1].keys() == {"holes in the log"}


def test_there_are_no_samples_before_adaptation_knows_anything():
    sampler = Sampler(CRANE)
    assert not len(sampler.take(rows(), None).t)
    assert sampler.left_out.keys() == {"no estimate of friction"}


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda x: {n: v for n, v in x.items() if n != "p_a"}, "Rows without p_a"),
        (lambda x: {n: v for n, v in x.items() if n != "omega_m"}, "Rows without omega_m or v_w"),
        (lambda x: {**x, "time": x["time"][::-1]}, "time must increase"),
    ],
)
def test_rows_that_cannot_be_sampled_are_one_line(change, line):
    with pytest.raises(LiveError, match=line) as refused:
        Sampler(CRANE).take(change(rows()), state())
    assert "\n" not in str(refused.value)


def test_a_stream_without_certificate_is_told_what_the_model_says_and_applies_nothing():
    stream, estimator = ResidualModel(CRANE, learned()), FrictionEstimator(CRANE)
    x, last = rows(), None
    for k in range(0, len(x["time"]), 5):
        part = {n: v[k : k + 5] for n, v in x.items()}
        last = stream.update(part, estimator.update(part))
        assert last.applied == 0.0
        assert last.level == 4
    assert np.isfinite(last.torque)
    assert any("no certificate" in reason for reason in stream.vetoes)
    assert sum(n for reason, n in stream.vetoes.items() if "no certificate" in reason) > 200


def test_a_sea_is_read_from_the_tip():
    sea = sea_of("log", rows())
    assert sea.span == pytest.approx(1.8, rel=0.02)
    assert sea.period == pytest.approx(9.0, rel=0.02)
    with pytest.raises(LiveError, match="s_tip is missing or shows no waves"):
        sea_of("log", {**rows(), "s_tip": 0.0 * rows()["s_tip"]})


def write(file: Path, x: dict[str, np.ndarray]) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    head = ",".join(["time [s]", *(f"{name} [{UNITS.get(name, '1')}]" for name in NAMES)])
    np.savetxt(file, np.column_stack(list(x.values())), delimiter=",", header=head, comments="", fmt="%.8g")
    return file


@pytest.mark.thorough
def test_a_winch_that_is_its_file_gives_nothing_to_learn(tmp_path, capsys):
    """Four days of the twin itself: level 4 does not pay, the file says so, and it tests no log that it learned from."""
    periods = (8.0, 9.5, 11.0, 12.5)
    files = [write(tmp_path / f"day{k}" / "a.csv", rows(p, 320.0, 50.0 + 5.0 * k)) for k, p in enumerate(periods)]
    model = tmp_path / "model.json"
    words = ["--crane", "nov-250t", "--json"]
    assert run(["live", "residual", *map(str, files), *words, "--out", str(model)]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["level"] == 4
    assert not found["pays"]
    assert [one["campaign"] for one in found["logs"]] == ["day0", "day1", "day2", "day3"]
    assert run(["live", "residual", str(model), str(files[0]), *words]) == 2
    assert "was learned from this log" in capsys.readouterr().err
    other = write(tmp_path / "day9" / "b.csv", rows(10.0, 320.0))
    assert run(["live", "residual", str(model), str(other), "--crane", "nov-250t", "--verbose"]) == 1
    out = capsys.readouterr().out
    assert "Level 4 does not pay" in out
    assert "(level 4)" in out


def test_what_cannot_be_is_one_line(tmp_path, capsys):
    short, model = write(tmp_path / "day1" / "a.csv", rows()), tmp_path / "model.json"
    write_model(model, learned())
    for words, line in (
        ([str(short), "--crane", "nov-250t"], "usable samples (mostly: no estimate of friction)"),
        ([str(short), "--crane", "nov-100t-electric"], "has no pressures of both lines"),
        ([str(model), "--crane", "nov-250t"], "live residual: give logs"),
        ([str(model), str(short), "--crane", "nov-250t", "--out", "x.json"], "--out has no meaning"),
        ([str(model), str(short), "--crane", "nov-150t"], 'not for "nov-150t"'),
        (
            [str(tmp_path / "none.json"), str(short), "--crane", "nov-250t"],
            'none.json": no such file. Learn a model with stillhook live residual',
        ),
    ):
        assert run(["live", "residual", *words]) == 2
        error = capsys.readouterr().err
        assert line in error
        assert error.count("\n") == 1


def test_samples_of_a_log_are_those_of_the_stream():
    x, left_out = samples_of(CRANE, rows())
    estimator, sampler, parts = FrictionEstimator(CRANE), Sampler(CRANE), []
    for k in range(0, len(rows()["time"]), 25):
        part = {n: v[k : k + 25] for n, v in rows().items()}
        parts.append(sampler.take(part, estimator.update(part)))
    assert np.allclose(joined(parts).left, x.left, atol=2.0)
    assert left_out["no estimate of friction"] == sampler.left_out["no estimate of friction"]
