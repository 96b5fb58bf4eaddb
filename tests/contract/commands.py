"""Command lines of the contract between winch types, controllers and commands, the files that they read, and a loop
over them for a process of its own: `python -m tests.contract.commands CRANE MODE FOLDER COMMAND...`."""

from __future__ import annotations

import contextlib
import functools
import io
import json
import re
import shlex
import sys
from pathlib import Path
from typing import NamedTuple

from tests.scripts import DOCS
from trials.campaigns.__main__ import main as campaigns

from stillhook import load_crane
from stillhook.cli import run

CASE = """
crane = "CRANE"
[scenario]
load = "30 t"
s_w = "100 m"
tip = "sine 1 m 10 s"
duration = "20 s"
warm_up = "10 s"
mode = "MODE"
"""
LIFT = """
crane = "CRANE"
controller = "MODE"
vessel = "construction-vessel-130m"
start_depth = "-2 m"
duration = "60 s"
[payload]
name = "lid"
mass = "30 t"
shape = "plate"
length = "5 m"
width = "4 m"
height = "0.5 m"
[sea]
wave = "jonswap Hs=1 m Tp=8 s gamma=2"
heading = "180 deg"
[tip]
at = "x=-15 m, y=-24 m, z=36 m"
[water]
depth = "25 m"
[wire]
nodes = 3
[[phase]]
mode = "splash"
speed = "30 m/min"
depth = "8 m"
[[phase]]
mode = "ahc"
time = "20 s"
"""
COMPENSATOR = """[compensator]
unit = "phc-60t"
p_0 = "48 bar"
"""
PLAN = """
crane = "CRANE"
vessel = "construction-vessel-130m"
payload = "manifold-60t"
start_depth = "80 m"
alternatives = ["none", "cap-80", "MODE"]
[tip]
at = "x=-15 m, y=-24 m, z=36 m"
[water]
depth = "100 m"
[environment]
Hs = ["1 m", "2 m"]
Tp = ["9 s"]
headings = ["180 deg"]
[operation]
T_POP = "4 h"
[[phase]]
name = "deep"
kind = "deep"
time = "2 min"
"""
FRICTION = """
title = "Friction with evidence"
Y_1 = 1.6e-05
Y_2 = "0 N m"
Y_3 = "0.6 N m"
Y_4 = "230 rev/min"
Y_5 = "0.0094 N m s/rad"
Y_6 = 1.6e-05
[evidence]
names = ["Y_1", "Y_6"]
covariance = [[4e-14, -1e-14], [-1e-14, 9e-15]]
dof = 312
data = "seven staircases"
"""
ON_CRANE = CASE.replace('mode = "MODE"\n', "")
TUNED_CASE = 'crane = "CRANE"\n[settings]\nbudget = 20\n'
DRIVEN = ON_CRANE + "[settings]\ndraws = 2\n"
FILES = {
    "CASE": CASE,
    "SHORT": ON_CRANE,
    "TUNED": TUNED_CASE,
    "DRIVEN": DRIVEN,
    "LIFT": LIFT,
    "HUNG": LIFT + COMPENSATOR,
    "PLAN": PLAN,
    "FRICTION": FRICTION,
}
"""Word of a command line -> text of the file that it stands for."""

CELLS = '--loads "20 t, 30 t" --speeds "20 m/min, 30 m/min"'
POINT = '--loads "30 t" --speeds "20 m/min" --periods "10 s" --free K_p'

OF_CONTROLLER = {
    "compare": "compare SHORT --controllers MODE",
    "run": "run CASE",
    "map": f"map CRANE --controllers MODE {CELLS}",
    "map settling": f"map CRANE --controllers MODE --metric settling {CELLS}",
    "envelope": 'envelope CRANE --controllers MODE --loads "30 t"',
    "tune": f"tune TUNED --controllers MODE {POINT}",
    "uncertainty": "uncertainty SHORT --controllers MODE --draws 4",
    "calc steady": 'calc steady CRANE controller=MODE "v_w=20 m/min"',
    "lower": "lower LIFT",
    "response": "response LIFT",
    "plan check": "plan PLAN --check",
    "plan quick": "plan PLAN --tier frequency --workers 1",
    "plan": "plan PLAN --workers 1 --store OUT",
    "friction draws": 'friction draws FRICTION --crane CRANE --controller MODE --load "30 t" --draws 4',
}
"""Commands that take a controller."""
OF_OPERATOR = ("compare", "run", "calc steady", "friction draws")
"""Those that also take manual mode."""
OF_WINCH = {
    "crane": "crane CRANE",
    "compare files": "compare SHORT --controllers PAIR --out OUT",
    "run files": "run CASE --out OUT",
    "map files": f"map CRANE --controllers PAIR {CELLS} --out OUT",
    "map eta_c": f"map CRANE --controllers PAIR {CELLS} --metric eta_c",
    "map p_max": f"map CRANE --controllers PAIR {CELLS} --metric p_max",
    "map alpha_m": f"map CRANE --controllers PAIR {CELLS} --metric alpha_m",
    "map settling files": f"map CRANE --controllers PAIR --metric settling {CELLS} --out OUT",
    "map strong-ssc": f"map CRANE --controllers strong-ssc {CELLS}",
    "envelope layer": 'envelope CRANE --controllers PAIR --loads "30 t" --layer 5',
    "stability": "stability CRANE",
    "stability controller": "stability CRANE --controller MODE --load '30 t' --s-w '100 m' --v-tip '10 m/min'",
    "stability delay": 'stability CRANE --alpha-m 1 --delay "50 ms"',
    "stability full": 'stability CRANE --full --load "30 t" --v-tip "10 m/min"',
    "tune files": f"tune TUNED --controllers MODE {POINT} --objective error --out OUT",
    "uncertainty files": "uncertainty SHORT --controllers PAIR --draws 8 --sobol --out OUT",
    "uncertainty causes": 'uncertainty SHORT --controllers PAIR --draws 4 --limit "e_c_pp <= 1 cm" --attribute',
    "uncertainty pressure": 'uncertainty SHORT --controllers PAIR --draws 4 --limit "p_max <= 300 bar"',
    "uncertainty case": "uncertainty CASE --draws 4",
    "compare drives": "compare DRIVEN --drives active-passive,electric",
    "validate": "trials.campaigns sea-trials OUT --crane CRANE ; validate CAMPAIGN --steps 0,1,5",
    "lower compensated": "lower HUNG",
    "response compensated": "response HUNG",
    "lower files": "lower LIFT --out OUT",
    "response files": "response LIFT --out OUT",
    "plan closed-form": "plan PLAN --tier closed-form",
    "plan files": "plan PLAN --tier frequency --workers 1 --out OUT",
    "calc drum": "calc drum CRANE",
    "calc inertia": "calc inertia CRANE",
    "calc speed": "calc speed CRANE",
    "calc eigenfrequency": "calc eigenfrequency CRANE alpha_m=0.8",
    "calc gain-limit": "calc gain-limit CRANE alpha_m=0.8",
    "calc friction": 'calc friction L4593 "T_d=1 MN m" "omega_m=100 rev/min"',
    "friction compare": 'friction compare crane-1 crane-2 --crane CRANE --load "30 t"',
}
"""Commands that take no controller, and other forms of those that do."""
OF_CLOSED_CIRCUITS = {
    "map strong-ssc": "another kind of drive",
    "stability delay": "closed circuits",
    "stability full": "closed circuits",
    "calc eigenfrequency": "closed circuit",
    "calc gain-limit": "closed circuit",
}
"""Commands that have no meaning for a winch without a closed circuit -> what their one line says."""
OF_NUMBERS = {"map p_max": "p_max", "map alpha_m": "alpha_m_min", "uncertainty pressure": "p_max"}
"""Commands that ask for a number -> the number, which a winch type may not have."""
BOTH = OF_CONTROLLER | OF_WINCH


class Answer(NamedTuple):
    """What a command line gave: exit code, and what it printed as error."""

    code: int
    error: str

    @property
    def given(self) -> bool:
        """Whether the question was answered: done, or done and the answer is no."""
        return self.code in (0, 1)

    @property
    def refused(self) -> bool:
        """Whether it was refused in one line."""
        lines = self.error.strip().splitlines()
        return self.code == 2 and len(lines) == 1 and lines[0].startswith("error: ")


PRINTED = re.compile(r"^`([\w-]+\.(?:py|toml))`:\n\n```(?:python|toml)\n(.*?)^```", re.MULTILINE | re.DOTALL)
"""A file that a how-to page prints: its name, and its text."""


def printed_files() -> dict[str, str]:
    """Files of the pages on a module of one's own, by name."""
    pages = [DOCS / "how-to" / f"add-a-{page}.md" for page in ("controller", "winch", "load-path-element", "sensor")]
    return {name: text for page in pages for name, text in PRINTED.findall(page.read_text(encoding="utf-8"))}


SMALL_SWL = 60.0e3
"""SWL below which loads and payload are those of a small crane [kg]."""
SMALLER = {"30 t": "10 t", "20 t": "6 t", "manifold-60t": "spool-20t", "48 bar": "16 bar"}
"""Loads, payload and gas of the commands, for a small crane."""


@functools.cache
def is_small(crane: str) -> bool:
    return load_crane(crane).SWL < SMALL_SWL


def sized(text: str, crane: str) -> str:
    """A command line or file with loads that the crane carries."""
    if not is_small(crane):
        return text
    for large, small in SMALLER.items():
        text = text.replace(large, small)
    return text


def answer(command: str, crane: str, mode: str, folder: Path) -> Answer:
    """Run a command of `BOTH`, or those that it names one after another, until one has no answer; its files are written
    to the folder."""
    words = {
        "CRANE": crane,
        "MODE": mode,
        "PAIR": mode if mode in ("ns", "position") else f"ns,{mode}",
        "OUT": str(folder / "out"),
        "CAMPAIGN": str(folder / "out" / "campaign.toml"),
    }
    for word, text in FILES.items():
        if word not in BOTH[command].split():
            continue
        file = folder / f"{word.lower()}.toml"
        file.write_text(sized(text, crane).replace("CRANE", crane).replace("MODE", mode), encoding="utf-8")
        words[word] = str(file)
    error = io.StringIO()
    code = 0
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(error):
        for line in sized(BOTH[command], crane).split(" ; "):
            first, *arguments = (words.get(word, word.replace("MODE", mode)) for word in shlex.split(line))
            code = max(code, campaigns(arguments) if first == "trials.campaigns" else run([first, *arguments]))
            if code == 2:
                break
    return Answer(code, error.getvalue())


def answers(crane: str, mode: str, folder: Path, commands: list[str]) -> dict[str, Answer]:
    """Some commands of `BOTH` on a crane under one controller, each in a folder of its own."""
    places = {command: folder / command.replace(" ", "-") for command in commands}
    for place in places.values():
        place.mkdir()
    return {command: answer(command, crane, mode, place) for command, place in places.items()}


if __name__ == "__main__":
    print(json.dumps(answers(sys.argv[1], sys.argv[2], Path(sys.argv[3]), sys.argv[4:])))
