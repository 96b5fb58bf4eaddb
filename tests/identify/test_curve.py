"""A friction curve of any machine: with a steady load, and with one that depends on the place as well."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from scipy.signal import lfilter
from tests.identify.refusals import refused
from typer.testing import CliRunner

from stillhook.cli.identify import curve as command
from stillhook.identify.curve import CurvePoint, curve_figure, friction_curve, window_figure, with_visits
from stillhook.identify.steady_state.steps import WindowSettings
from stillhook.logs.log import Log

STROKE = 1.5  # m
SPEEDS = (0.05, 0.1, 0.2, 0.3)  # m/s
SPRING = 8000.0  # N/m
STIFF = 2000.0  # N, at the middle


def friction(v: float) -> float:
    return 300.0 + 2000.0 * v


def ram(
    *, spring: float = SPRING, noise: float = 20.0, lost: float | None = None, rate: float = 50.0, seed: int = 0
) -> Log:
    """A ram that goes out and in at each speed, against a spring and friction; bins of 0.1 s."""
    rng = np.random.default_rng(seed)
    dt = 1.0 / rate
    parts = [np.zeros(int(2.0 / dt))]
    for s in SPEEDS:
        for v in (s, -s):
            n = int(STROKE / s / dt)
            parts += [np.full(n, v), np.zeros(int(2.0 / dt))]
    v = lfilter([dt / 0.1], [1.0, dt / 0.1 - 1.0], np.concatenate(parts))
    x = 0.1 + np.cumsum(v) * dt
    F = STIFF + spring * (x - 0.85) + np.sign(v) * np.where(np.abs(v) > 1e-3, 300.0 + 2000.0 * np.abs(v), 0.0)
    F = F + noise * rng.standard_normal(len(v))
    v = v + 0.002 * 0.3 * rng.standard_normal(len(v))
    m = round(0.1 / dt)
    n = len(v) // m
    mean = lambda y: y[: n * m].reshape(n, m).mean(axis=1)
    signals = {"speed": mean(v), "effort": mean(F), "position": mean(x)}
    none = {k: np.zeros(n, dtype=bool) for k in signals}
    return Log("ram.csv", 0.1 * (np.arange(n) + 0.5), signals, none, (), (), rate, len(v))


def test_a_steady_load_gives_friction_from_means() -> None:
    found = friction_curve(ram(spring=0.0))
    assert len(found.points) == len(SPEEDS)
    for p, v in zip(found.points, SPEEDS, strict=True):
        assert p.speed == pytest.approx(v, rel=2e-3)
        assert abs(p.friction - friction(v)) < 4.0 * p.u_friction
        assert abs(p.load - STIFF) < 4.0 * p.u_load


def test_a_spring_is_compared_place_by_place() -> None:
    """The load changes by 12 kN along the way, forty times the friction: friction and spring come back all the same."""
    found = friction_curve(ram(), position="position")
    assert len(found.points) == len(SPEEDS)
    for p, v in zip(found.points, SPEEDS, strict=True):
        assert abs(p.friction - friction(v)) < 4.0 * p.u_friction
        assert p.u_friction < 0.02 * friction(v)
        assert p.way is not None
        assert p.load_way is not None
        assert (p.load_way[1] - p.load_way[0]) / (p.way[1] - p.way[0]) == pytest.approx(SPRING, rel=0.01)
        assert p.way[1] - p.way[0] > 0.5 * STROKE


def test_without_its_position_a_spring_is_refused_and_not_averaged() -> None:
    """Effort drifts all along: no stretch is steady, and the reason says so."""
    assert "effort still drifted by" in refused(friction_curve, ram())


@pytest.mark.slow
def test_intervals_of_the_place_by_place_friction_hold_the_truth() -> None:
    """60 rams of 4 speeds: 95 % intervals hold 90 to 100 %."""
    inside = []
    for seed in range(60):
        found = friction_curve(ram(seed=seed), position="position")
        inside += [p.estimate.contains(friction(v)) for p, v in zip(found.points, SPEEDS, strict=True)]
    assert len(inside) == 240
    assert np.mean(inside) >= 0.90


def test_a_friction_that_depends_on_the_place_is_less_certain() -> None:
    log = ram()
    v, x = log.signals["speed"], log.signals["position"]
    tight = np.sign(v) * np.where(np.abs(v) > 1e-2, 200.0 * (x - 0.85), 0.0)
    found = friction_curve(log, position="position", effort=log.signals["effort"] + tight)
    plain = friction_curve(log, position="position")
    assert all(a.u_friction > 3.0 * b.u_friction for a, b in zip(found.points, plain.points, strict=True))
    assert all(a.estimate.contains(friction(v)) for a, v in zip(found.points, SPEEDS, strict=True))


def test_one_direction_alone_gives_no_friction() -> None:
    log = ram(spring=0.0)
    up = np.where(log.signals["speed"] > 0.0, log.signals["speed"], 0.0)
    one_way = replace(log, signals={**log.signals, "speed": up})
    assert "no lowering stretch at all" in refused(friction_curve, one_way)


def test_a_missing_position_is_named() -> None:
    assert 'no signal "place". It has effort, position, speed' in refused(friction_curve, ram(), position="place")


def test_the_figure_shows_what_was_used_and_what_was_not() -> None:
    log = ram()
    found = friction_curve(log, position="position", settings=WindowSettings(least_length="6 s"))
    figure = curve_figure(found, log, "effort")
    words = [t.get_text() for ax in figure.axes for t in ax.texts]
    assert len([r for r in found.steady.rejected if r.code == "short"]) == words.count("short") > 0
    assert figure.axes[2].get_xlabel() == "speed [SI]"
    spans = [span.vertices[:, 0] for group in figure.axes[0].collections for span in group.get_paths()]
    ends = [(float(x.min()), float(x.max())) for x in spans]
    assert all((w.start, w.end) in ends for w in found.steady.windows)
    assert len(spans) == len(found.steady.windows) + len(found.steady.rejected) + len(found.steady.trimmed)
    assert len(window_figure(log, "speed", "effort", found.steady, (), "").axes) == 2


# ---- the command


def written(folder: Path, settings: str = 'position = "position"') -> tuple[Path, Path]:
    log = ram()
    file, mapping = folder / "ram.csv", folder / "ram.toml"
    s = log.signals
    rows = [
        f"{t:.2f},{1e3 * v:.4f},{F:.2f},{1e3 * x:.3f}"
        for t, v, F, x in zip(log.t, s["speed"], s["effort"], s["position"], strict=True)
    ]
    file.write_text("\n".join(["t,v,F,x", *rows]) + "\n", encoding="utf-8")
    mapping.write_text(
        '[signals]\ntime = { column = "t", unit = "s" }\nspeed = { column = "v", quantity = "speed", unit = "mm/s" }\n'
        'effort = { column = "F", quantity = "force", unit = "N" }\nposition = { column = "x", quantity = "length", unit = "mm" }\n'
        f"[curve]\n{settings}\n",
        encoding="utf-8",
    )
    return file, mapping


@pytest.fixture(scope="module")
def app() -> typer.Typer:
    made = typer.Typer()
    made.command("curve")(command)
    return made


@pytest.mark.slow
def test_the_command_prints_a_table_and_writes_figure_csv_and_json(tmp_path: Path, app: typer.Typer) -> None:
    file, mapping = written(tmp_path)
    out = tmp_path / "out"
    result = CliRunner().invoke(app, [str(file), "--mapping", str(mapping), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert "m/min" in result.output
    assert "kN" in result.output
    assert sorted(p.name for p in out.iterdir()) == ["curve.csv", "curve.json", "curve.png", "stillhook-manifest.json"]
    data = json.loads((out / "curve.json").read_text(encoding="utf-8"))
    assert [round(p["speed"], 2) for p in data["points"]] == list(SPEEDS)
    assert data["kinds"] == {"speed": "speed", "effort": "force", "position": "length"}
    assert len((out / "curve.csv").read_text(encoding="utf-8").splitlines()) == 1 + len(SPEEDS)


def test_json_holds_points_with_intervals_and_rejects_with_reasons(tmp_path: Path, app: typer.Typer) -> None:
    file, mapping = written(tmp_path, 'position = "position"\nleast_length = "6 s"')
    result = CliRunner().invoke(app, [str(file), "--mapping", str(mapping), "--json"])
    data = json.loads(result.stdout)
    assert data["points"][0]["interval_95"][0] < friction(0.05) < data["points"][0]["interval_95"][1]
    assert any("a window needs 6 s" in r["reason"] for r in data["rejected"])


def test_bad_options_are_refused_before_the_log_is_read(tmp_path: Path, app: typer.Typer) -> None:
    for setting, value in (("least_length", "2"), ("least_speed", "fast"), ("least", "unknown field")):
        _, mapping = written(tmp_path, f'{setting} = "{value}"')
        result = CliRunner().invoke(app, [str(tmp_path / "none.csv"), "--mapping", str(mapping)])
        assert value in str(result.exception)


# ---- what no single visit shows


def test_visits_that_differ_by_more_than_each_shows_widen_every_interval() -> None:
    """Friction that changes from visit to visit (place of the wire, oil): an interval of 12 N must not stand next to a neighbour 121 N off."""
    rng, inside, alone = np.random.default_rng(5), [], []
    visit = CurvePoint(0.0, 0.0, 6.0, 0.0, 6.0, None, None)  # type: ignore[arg-type]
    for _ in range(200):
        v = np.linspace(0.05, 0.6, 9)
        raw = [
            replace(visit, speed=float(x), friction=friction(x) + 60.0 * float(e))
            for x, e in zip(v, rng.standard_normal(9), strict=True)
        ]
        found = with_visits(raw)
        inside += [p.estimate.contains(friction(p.speed)) for p in found]
        alone += [p.estimate.contains(friction(p.speed)) for p in raw]
    assert np.mean(alone) < 0.3
    assert 0.90 <= np.mean(inside) <= 0.98


def test_visits_that_agree_are_left_as_they_are() -> None:
    exact = CurvePoint(0.0, 0.0, 6.0, 0.0, 6.0, None, None)  # type: ignore[arg-type]
    found = with_visits([replace(exact, speed=v, friction=friction(v)) for v in (0.1, 0.2, 0.3, 0.4)])
    assert [p.u_friction for p in found] == [6.0] * 4


def test_a_log_without_the_signals_is_refused_with_the_columns_that_are_needed(
    tmp_path: Path, app: typer.Typer
) -> None:
    file, _ = written(tmp_path)
    problem = str(CliRunner().invoke(app, [str(file)]).exception)
    assert "with the columns of time, speed, effort under [signals]" in problem
    assert 'among "t", "v", "F", "x"' in problem


def quick(hold: float, *, spring: float = 0.0, noise: float = 20.0) -> Log:
    """A ram that holds every speed for no longer than this [s]; bins of 0.05 s."""
    rng, dt = np.random.default_rng(3), 0.05
    parts = [np.zeros(40)]
    for s in (0.3, 0.4, 0.5, 0.6):
        for v in (s, -s):
            parts += [np.linspace(0.0, v, 4), np.full(round(hold / dt), v), np.linspace(v, 0.0, 4), np.zeros(40)]
    v = np.concatenate(parts)
    F = (
        STIFF
        + spring * np.cumsum(v) * dt
        + np.sign(v) * np.where(np.abs(v) > 1e-3, friction(0.0) + 2000.0 * np.abs(v), 0.0)
    )
    signals = {"speed": v + 1e-3 * rng.standard_normal(len(v)), "effort": F + noise * rng.standard_normal(len(v))}
    none, t = dict.fromkeys(signals, np.zeros(len(v), dtype=bool)), dt * (np.arange(len(v)) + 0.5)
    return Log("quick.csv", t, signals, none, (), (), 20.0, len(v))


def test_a_log_of_short_steps_is_read_with_shorter_stretches_and_says_so() -> None:
    found = friction_curve(quick(2.2))
    assert found.adapted
    assert found.least_length == 1.0  # smoothing and guard take 1.2 s of a hold
    assert len(found.points) == 4
    for p in found.points:
        assert p.estimate.contains(friction(p.speed))
    assert found.to_dict()["least_length_adapted"]
    assert not friction_curve(ram(spring=0.0)).adapted


@pytest.mark.parametrize(
    ("log", "settings", "words"),
    [
        (quick(1.5), None, "Stretches down to 0.7 s were tried as well."),
        (quick(2.2), WindowSettings(least_length="2 s"), 'take shorter stretches: curve.least_length = "'),
        (quick(2.2, spring=SPRING), None, "no speed at which both directions can be compared"),
        (ram(spring=0.0), WindowSettings(least_length="40 s"), 'take shorter stretches: curve.least_length = "'),
    ],
    ids=["too short for any", "a least length that was named", "a load that changes along the way", "none so long"],
)
def test_steps_too_short_are_refused_with_the_way_out(log: Log, settings: WindowSettings | None, words: str) -> None:
    assert words in refused(friction_curve, log, settings=settings)
