"""A winch type that the engine does not know is refused in one line everywhere, and what a known type means is said
everywhere."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Any

import pytest

from stillhook import Crane, Scenario, library, load_crane, simulate
from stillhook.analysis.compare import compare
from stillhook.analysis.controllers import strong_ssc
from stillhook.analysis.loop_stability.governing import governing
from stillhook.analysis.loop_stability.margins import strongest_gain
from stillhook.analysis.loop_stability.models.eigenfrequency import eigenfrequency, gain_limit
from stillhook.analysis.loop_stability.models.linearisation import linearise
from stillhook.analysis.loop_stability.stability import both_loops, full_stability, stability
from stillhook.analysis.loop_stability.sweeps import bode, root_locus, sweep
from stillhook.analysis.maps.operability import map_of
from stillhook.analysis.maps.settling import settling_of
from stillhook.analysis.operating_envelope.load_speed import envelope, setting_curves
from stillhook.analysis.steady.operating_point import operating_point
from stillhook.analysis.steady.steady_state import speed_limit, steady
from stillhook.analysis.tuning.tune import tune
from stillhook.analysis.uncertainty.monte_carlo import monte_carlo
from stillhook.cli import run
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.batch import summaries
from stillhook.engine.scenario.checks import NOTES
from stillhook.errors import SpecError
from stillhook.kernels.build import PLANTS as DRIVEN
from stillhook.kernels.winch_type import PLANTS, plant_of
from stillhook.spec.crane import Plant
from stillhook.spec.scenario import Mode


class Other(StrEnum):
    """A type of a later version."""

    ELECTRIC = "electric"


CASE = Scenario(load="40 t", s_w="100 m", tip="sine 1 m 10 s", warm_up="10 s", duration="20 s")
SMALL: dict[str, Any] = {"loads": "40 t", "speeds": "20 m/min"}
LINE = ': winch type "electric" is unknown here. Known types: active-passive and pure-active. Choose another crane.'


def unknown(name: str) -> Crane:
    return load_crane(name).model_copy(update={"plant": Other.ELECTRIC})


ASKED: dict[str, Callable[[Crane], Any]] = {
    "simulate": lambda c: simulate(c, CASE),
    "summaries": lambda c: summaries(c, [CASE]),
    "pack": lambda c: pack(c, CASE),
    "compare": lambda c: compare(c, CASE, modes=["ns"]),
    "envelope": lambda c: envelope(c, loads=["40 t"], modes=["ns"]),
    "setting_curves": lambda c: setting_curves(c, modes=["ns"]),
    "map": lambda c: map_of(c, ["ns"], **SMALL),
    "settling": lambda c: settling_of(c, ["ns"], **SMALL),
    "stability": stability,
    "both_loops": both_loops,
    "full_stability": lambda c: full_stability(c, load=0.0, s_w=100.0, v_tip=0.1),
    "sweep": sweep,
    "bode": bode,
    "root_locus": root_locus,
    "gain_limit": gain_limit,
    "eigenfrequency": eigenfrequency,
    "strongest_gain": strongest_gain,
    "governing": lambda c: governing(c, Mode.NS),
    "strong_ssc": lambda c: strong_ssc(c).on(c),
    "steady": lambda c: steady(c, 0.5, "ns"),
    "speed_limit": lambda c: speed_limit(c, "ns"),
    "linearise": lambda c: linearise(operating_point(c, 0.1, 0.8, load=0.0, s_w=100.0)),
    "tune": lambda c: tune(c, "ns", cases=[CASE], budget=20),
    "monte_carlo": lambda c: monte_carlo(c, [CASE], n=4),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["nov-250t", "nov-100t-pure-active"])
@pytest.mark.parametrize("what", ASKED)
def test_an_unknown_winch_type_is_refused_and_never_taken_for_another(what: str, name: str):
    with pytest.raises(SpecError) as refused:
        ASKED[what](unknown(name))
    assert str(refused.value).startswith(f'"{name}"')
    assert LINE in str(refused.value)
    assert "\n" not in str(refused.value)


COMMANDS = (
    ("compare", "--load", "40 t", "--motion", "sine 1 m 10 s", "--duration", "20 s", "--warm-up", "5 s"),
    ("envelope", "--load", "40 t"),
    ("map", "--loads", "40 t", "--speeds", "20 m/min"),
    ("map", "--metric", "settling", "--loads", "40 t", "--speeds", "20 m/min"),
    ("stability",),
    ("stability", "--full", "--v-tip", "10 m/min"),
    ("stability", "--layer", "3"),
    ("tune", "--budget", "20"),
    ("uncertainty", "--draws", "4"),
)
NAMED = ("compare", "uncertainty")
"""Commands that take the crane as an option."""


@pytest.mark.thorough
@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_commands_refuse_an_unknown_winch_type_in_one_line(words: tuple[str, ...], monkeypatch, capsys):
    for home in ("stillhook.library", "stillhook.library.crane_file.load"):
        monkeypatch.setattr(f"{home}.load_crane", lambda name: unknown("nov-250t"))
    crane = ["--crane", "nov-250t"] if words[0] in NAMED else ["nov-250t"]
    assert run([words[0], *crane, *words[1:]]) == 2
    shown = capsys.readouterr()
    assert LINE in shown.err
    assert shown.err.count("\n") == 1


def test_every_type_of_a_crane_file_has_a_plant_a_driver_and_notes():
    assert set(PLANTS) == set(NOTES) == set(Plant)
    assert all(DRIVEN[plant.value] is PLANTS[plant] for plant in Plant)
    assert plant_of(load_crane("nov-250t")) is not plant_of(load_crane("nov-100t-pure-active"))


PURE, SINKS, OFFSET = (
    "nov-100t-pure-active",
    "nothing makes up for leakage in manual mode",
    "the load is held by the pumps against leakage",
)


def found(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[str, dict[str, Any]]:
    """What a command prints for people, and as JSON."""
    run(list(words))
    text = capsys.readouterr().out
    run([*words, "--json"])
    return " ".join(text.split()), json.loads(capsys.readouterr().out)


@pytest.mark.thorough
@pytest.mark.parametrize(
    "words",
    [
        ("envelope", PURE, "--load", "60 t", "--modes", "ns,ssc"),
        ("map", PURE, "--controllers", "ns,ssc", "--loads", "60 t", "--speeds", "10 m/min"),
        (
            "tune",
            PURE,
            "--controllers",
            "ssc",
            "--loads",
            "60 t",
            "--speeds",
            "10 m/min",
            "--periods",
            "10 s",
            *("--budget", "20"),
        ),
        ("uncertainty", "--crane", PURE, "--load", "60 t", "--modes", "ns,ssc", "--draws", "16"),
    ],
    ids=lambda words: words[0],
)
def test_a_pure_active_winch_tells_of_its_offset_in_every_answer(words: tuple[str, ...], capsys):
    text, data = found(capsys, *words)
    assert OFFSET in text
    assert any(OFFSET in note and "with 60 t" in note for note in data["notes"])


def test_more_oil_than_the_accumulator_takes_is_said_of_a_map(capsys):
    words = (
        "map",
        "nov-250t",
        "--controllers",
        "ns",
        "--loads",
        "250 t",
        "--speeds",
        "120 m/min",
        "--period",
        "30 s",
        "--duration",
        "80 s",
    )
    text, data = found(capsys, *words)
    assert "the piston will run into its ends" in text
    assert any("accumulator's stroke" in note for note in data["notes"])


LIFT = """
crane = "nov-100t-pure-active"
start = "10 m"
duration = "40 s"
[payload]
name = "box"
mass = "60 t"
shape = "box"
length = "5 m"
width = "4 m"
height = "3 m"
[tip]
height = "30 m"
motion = "sine 0.3 m 9 s"
[water]
depth = "100 m"
[wire]
nodes = 3
[[stage]]
mode = "ahc"
time = "10 s"
"""
LOWERED = """
[[stage]]
mode = "manual"
lower = "6 m/min"
time = "10 s"
"""


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("stages", "brake", "sinks"),
    [("", False, False), (LOWERED, False, True), (LOWERED, True, False)],
    ids=["compensated", "then lowered manually", "with a brake that holds at rest"],
)
def test_a_lowering_with_a_pure_active_winch_tells_of_offset_and_sinking(
    stages: str, brake: bool, sinks: bool, tmp_path: Path, capsys
):
    written = (Path(library.__file__).parent / "data" / "cranes" / f"{PURE}.toml").read_text(encoding="utf-8")
    without = re.sub(r"(?ms)^\[brake\]\n.*?(?=^\[)", "", written)
    assert "[brake]" in written
    assert "[brake]" not in without
    (tmp_path / "pure.toml").write_text(written if brake else without, encoding="utf-8")
    (tmp_path / "box.toml").write_text(LIFT.replace(f'"{PURE}"', '"pure.toml"') + stages)
    text, data = found(capsys, "lower", str(tmp_path / "box.toml"))
    assert OFFSET in text
    assert any(OFFSET in note for note in data["notes"])
    assert any(SINKS in note for note in data["notes"]) is sinks
