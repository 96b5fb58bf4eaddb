"""Six people who have README alone: each comes to a useful answer with files of their own and at most one correction, and
ten mistakes of each are answered by one line that names the cure."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from tests.commands import refusal

import stillhook
from stillhook.cli import run

MOST_LINES, MOST_COLUMNS = 12, 100
AT = "x=-20 m, y=-12 m, z=25 m"


def german(x: float, digits: int) -> str:
    return f"{x:.{digits}f}".replace(".", ",")


def table(path: Path, rows: Sequence[Sequence[str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, delimiter=";").writerows(rows)


def mru(path: Path) -> None:
    """A ship's log: names of its own, decimal commas, two minutes."""
    t = 0.1 * np.arange(1200)
    waves = [
        (german(x, 1), *(german(a * math.sin(0.7 * x + b), 4) for a, b in ((0.8, 0.0), (2.0, 1.6), (1.0, 0.8))))
        for x in t
    ]
    table(path, [("Time", "MRU_Heave_m", "MRU_Roll_deg", "MRU_Pitch_deg"), *waves])


def plc(path: Path) -> None:
    """A PLC's log: German names, revolutions per minute, tonnes, lowering positive in both length and speed."""
    names = (
        "Zeit [s]",
        "Druck A [bar]",
        "Druck B [bar]",
        "Drehzahl [1/min]",
        "Pumpe Soll [%]",
        "Hakenlast [t]",
        "Seil aus [m]",
    )
    rows = []
    for k in range(600):
        t = 0.1 * k
        v = math.sin(0.6 * t)
        values = (t, 180.0 + 60.0 * v, 25.0, 900.0 * v, 70.0 * v, 82.0 + 3.0 * v, 210.0 - 1.5 * math.cos(0.6 * t))
        rows.append([german(x, 3) for x in values])
    table(path, [names, *rows])


def site(path: Path) -> None:
    """A hindcast of four weeks."""
    rows = [
        (f"2024-01-{1 + i // 24:02d} {i % 24:02d}:00", german(1.2 + 0.8 * math.sin(i / 40.0), 2), german(8 + i % 5, 1))
        for i in range(24 * 28)
    ]
    table(path, [("time", "Hs (m)", "Tp (s)"), *rows])


FILES: Mapping[str, Callable[[Path], None]] = {"mru.csv": mru, "plc.csv": plc, "site.csv": site}


class Step(NamedTuple):
    """A command line, what its answer says, and its exit code."""

    words: Sequence[str]
    says: Sequence[str]
    code: int = 0


JOURNEYS: Mapping[str, Sequence[Step]] = {
    "planner": (
        Step(["weather", "show", "site.csv"], ["672 records", "H_m0"]),
        Step(
            ["weather", "persistence", "site.csv", "--limit", "Hs <= 1.5 m", "--window", "24 h"], ["Operability", "P90"]
        ),
        Step(["new", "lift", "my-lift.toml"], ["written: my-lift.toml", "stillhook plan my-lift.toml --check"]),
        Step(["plan", "my-lift.toml", "--check"], ["PASSED", "T_POP", "stillhook plan my-lift.toml --tier frequency"]),
    ),
    "control engineer": (
        Step(["stability", "nov-250t"], ["UNSTABLE at", "Gain margin", "stillhook tune nov-250t"], 1),
        Step(["compare", "nov-250t", "--controllers", "ns,ssc"], ["error p-p", "Smallest control error"]),
        Step(["plc", "export", "nov-250t", "--controller", "ssc", "--language", "st", "--out", "plc"], ["plc"]),
    ),
    "test engineer": (
        Step(["inspect", "plc.csv", "--save", "mapping.toml"], ["F_w = Hakenlast [t]", "s_w = Seil aus"]),
        Step(["convert", "plc.csv", "si.csv", "--mapping", "mapping.toml"], ["written: si.csv", "600 rows"]),
    ),
    "student": (
        Step(["calc", "eigenfrequency", "nov-250t"], ["omega_0", "12.527"]),
        Step(["crane", "nov-250t"], ["250 t"]),
        Step(["compare", "nov-250t"], ["ssc", "efficiency"]),
    ),
    "owner": (
        Step(["list", "cranes"], ["nov-250t-secondary"]),
        Step(["new", "drives", "costs.toml"], ["stillhook compare nov-250t --drives costs.toml"]),
    ),
    "naval architect": (
        Step(["vessel", "supply-vessel-82m", "--check"], ["Low-frequency limit"]),
        Step(
            ["tip", "supply-vessel-82m", "--at", AT, "--wave", "jonswap Hs=1 m Tp=8 s", "--heading", "165 deg"],
            ["Most probable largest in 3 h"],
        ),
        Step(["tip", "--log", "mru.csv", "--at", AT], ["Largest in the log"]),
    ),
}

MISTAKES: Mapping[str, Sequence[tuple[Sequence[str], str]]] = {
    "planner": (
        (["plan", "my-lyft.toml", "--check"], '"my-lyft.toml": no such file. Check the path.'),
        (["plan", "template-to-1500m", "--tier", "fast"], "Choose closed-form, frequency or time."),
        (["weather", "persistence", "site.csv", "--limit", "Hs < 1.5", "--window", "24 h"], "Write <= or >=."),
        (["weather", "persistence", "site.csv", "--limit", "Hs <= 1 m", "--window", "1 fortnight"], "not one of s, h"),
        (["weather", "persistence", "site.csv", "--limit", "Hsig <= 1 m", "--window", "24 h"], "not one of Hs, Tp"),
        (["weather", "show", "sight.csv"], "the library, which has SYNTHETIC-norwegian-sea"),
        (["weather", "show", "site.csv", "--column", "Hs=Height [m]"], "It has Hs (m), Tp (s)"),
        (["weather", "alpha", "--hs", "2", "--t-pop", "24 h"], 'write "2 m"'),
        (["new", "plan", "x.toml"], "choose crane, lift, campaign"),
        (["lower", "anchor-to-3000m", "--film", "pid", "--out", "f"], "Choose of manual, level-1"),
    ),
    "control engineer": (
        (["stability", "nov-25t"], 'did you mean "nov-250t"?'),
        (["stability", "nov-250t", "--alpha-m", "1.4"], "must be above 0 and at most 1"),
        (["stability", "nov-250t", "--delay", "50"], 'write "50 s" (allowed: s, ms'),
        (["compare", "nov-250t", "--controllers", "ns,pid"], "not one of manual, level-1"),
        (["compare", "nov-250t", "--motion", "sine 2 m"], 'Write "sine 2.8 m 12 s"'),
        (["compare", "nov-250t", "--load", "400 t"], "Lower the load or choose another crane"),
        (["tune", "nov-250t", "--objective", "speed"], "choose one of error"),
        (["plc", "export", "nov-250t", "--controller", "ssc", "--language", "ladder", "--out", "plc"], "Choose st."),
        (["envelope", "nov-250t", "--loads", "50 t to 200 t"], 'Write "A to B by STEP"'),
        (["fmu", "nov-250t", "--platforms", "amiga", "--out", "a.fmu"], "not one of linux64"),
    ),
    "test engineer": (
        (["inspect", "nothing.csv"], "no such file. Check the path."),
        (["inspect", "mru.csv", "--format", "picture"], "not one of motion, log, weather"),
        (["inspect", "mru.csv", "--column", "heave"], 'Write --column "heave='),
        (["inspect", "mru.csv", "--column", "heave=Hiv [m]"], 'it has "Time", "MRU_Heave_m"'),
        (["inspect", "mru.csv", "--column", "heave=MRU_Heave_m [kN]"], "not one of m, cm"),
        (["identify", "friction", "campaign.toml"], "no such file. Check the path."),
        (["identify", "curve", "mru.csv"], "Give a mapping (--mapping file.toml)"),
        (["certificate", "mru.csv"], "Give the certificate.json that stillhook validate wrote"),
        (["live", "replay", "mru.csv"], "Give it, such as --load"),
        (["convert", "mru.csv", "mru.docx"], "Choose one of .csv, .xlsx"),
    ),
    "student": (
        (["simulate"], "No such command 'simulate'. See --help."),
        (["run", "case.toml"], "no such file. Check the path."),
        (["crane", "nov250t"], 'did you mean "nov-250t"?'),
        (["list", "crane"], "choose cranes, vessels"),
        (["compare", "nov-250t", "--s-w", "100"], 'write "100 m"'),
        (["compare", "nov-250t", "--lode", "100 t"], "--load"),
        (["sea", "jonswap Hs=2 Tp=9 s"], 'write "2 m"'),
        (["sea", "jonswop Hs=2 m Tp=9 s"], "not one of jonswap, pm"),
        (["calc", "motor-loss", "D_m=1 l"], "Write D_m=VALUE"),
        (["uncertainty", "nov-250t", "--draws", "-3"], "give a whole number from 1"),
    ),
    "owner": (
        (["compare", "nov-250t", "--drives", "steam"], "Choose active-passive, cylinder"),
        (["compare", "nov-250t", "--drives", "cost.toml"], "no such file. Check the path."),
        (["compare", "nov-250t", "--drives", "electric,electric"], "Name each drive once."),
        (["new", "drives", "costs.txt"], "name a file that ends in .toml"),
        (["new", "drives"], "Missing argument 'OUT'"),
        (["new", "drives", "c.toml", "nov-250t"], "leave it out"),
        (["certificate", "none.json", "--check"], "or validate again"),
        (["condition", "2024"], "no such campaign file or folder"),
        (["report", "nowhere"], "Give the folder that stillhook plan --out wrote"),
        (["weather", "lift", "template-to-1500m", "site.xlsx"], "no such file. Check the path."),
    ),
    "naval architect": (
        (["vessel", "supply-vessel-82"], 'did you mean "supply-vessel-82m"?'),
        (["vessel", "mru.csv"], "Supported: ShipX/VERES .re1"),
        (["vessel", "supply-vessel-82m", "--chek"], "--check"),
        (["tip", "supply-vessel-82m", "--at", AT, "--wave", "jonswap Hs=1 m Tp=8 s"], 'Add "heading=180 deg"'),
        (
            ["tip", "supply-vessel-82m", "--at", "-20,-12", "--wave", "jonswap Hs=1 m Tp=8 s"],
            'Write a place such as "x=',
        ),
        (["tip", "supply-vessel-82m", "--at", "x=-20 ft, y=-12 m", "--wave", "pm Hs=1 m Tp=8 s"], "not one of m, cm"),
        (["tip", "--log", "mru.csv"], 'as --at "x='),
        (["tip", "--log", "mru.csv", "--at", AT, "--column", "surge=x"], "Allowed: time, heave"),
        (["response", "anchor-to-3000m", "--wave", "Hs=2 m"], 'Write "jonswap Hs=2 m'),
        (["payload", "box-10t"], "the library has manifold-60t"),
    ),
}


@pytest.fixture(autouse=True)
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files of all six."""
    for name, write in FILES.items():
        write(tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.long
@pytest.mark.parametrize("who", JOURNEYS)
def test_each_comes_to_an_answer_of_a_dozen_lines(who: str, capsys: pytest.CaptureFixture[str]):
    for step in JOURNEYS[who]:
        assert run([*step.words]) == step.code, step.words
        answer = capsys.readouterr().out
        lines = answer.rstrip("\n").splitlines()
        assert len(lines) <= MOST_LINES, answer
        assert max(map(len, lines)) <= MOST_COLUMNS, answer
        for text in step.says:
            assert text in " ".join(answer.split()), (step.words, answer)


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "cure"),
    [
        pytest.param(words, cure, id=f"{who}: {' '.join(words)[:60]}")
        for who in MISTAKES
        for words, cure in MISTAKES[who]
    ],
)
def test_a_mistake_is_answered_by_one_line_that_names_the_cure(
    words: Sequence[str], cure: str, desk: Path, capsys: pytest.CaptureFixture[str]
):
    before = sorted(desk.iterdir())
    assert cure in refusal(capsys, *words)
    assert sorted(desk.iterdir()) == before  # nothing half written


def test_every_person_makes_ten_mistakes():
    assert {who: len(of) for who, of in MISTAKES.items()} == dict.fromkeys(JOURNEYS, 10)


@pytest.mark.slow
def test_the_student_goes_on_in_python():
    crane = stillhook.load_crane("nov-250t")
    tip = stillhook.Sine(amplitude="2.8 m", period="12 s")
    lift = stillhook.simulate(crane, stillhook.Scenario(load="100 t", s_w="100 m", tip=tip, mode="ssc"))
    assert lift.stillhook.summary["status"] == "ok"
    assert lift.stillhook.plot().axes


@pytest.mark.thorough
def test_the_planner_and_the_owner_go_on_to_limits_and_costs(capsys: pytest.CaptureFixture[str]):
    for words in (["new", "lift", "my-lift.toml"], ["plan", "my-lift.toml", "--tier", "frequency"]):
        assert run(words) == 0
    assert "OP_LIM" in capsys.readouterr().out
    assert run(["new", "drives", "costs.toml"]) == 0
    assert run(["compare", "nov-250t", "--drives", "costs.toml", "--load", "100 t", "--motion", "sine 1 m 12 s"]) == 0
    assert "electric" in capsys.readouterr().out
