"""Command lines that write, as short as they can be; OUT is where they write, other capitals the files of `prepare`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from tests.contract.commands import CASE, LIFT, PLAN


class Writes(NamedTuple):
    """line: command line; target: name in the folder of outputs that OUT stands for; code: usual exit code; quick: takes
    a fraction of a second, so that the default tests have it; over: also written over what an earlier run left; parts:
    several outputs, each of which is complete by itself; given: word of the folder that OUT is a copy of before."""

    line: str
    target: str = "out"
    code: int = 0
    quick: bool = False
    over: bool = True
    parts: bool = False
    given: str = ""


PREPARED = {
    "SERIES": "run CASE --out SERIES",
    "TRIALS": "example sea-trials TRIALS",
    "TESTS": "example friction-tests TESTS",
    "CERTIFIED": "python certified CERTIFIED",
    "PLANNED": "plan PLAN --tier closed-form --out PLANNED",
    "MAP": "example motor-map MAP/map.csv",
    "KEYS": "certificate key new --name Trials --out KEYS",
    "HISTORY": "python history HISTORY",
}
"""Word of a command line -> the command line that makes what it stands for."""

CONFIG = "config"
"""Name, in the folder of outputs, of the user's folder of settings."""
POINT = '--loads "30 t" --speeds "20 m/min" --periods "10 s"'
WAVE = '--wave "jonswap Hs=1 m Tp=8 s gamma=3.3" --heading "180 deg"'
COMMANDS = {
    "new crane": Writes("new crane OUT", "my.toml", quick=True, over=False),
    "new payload": Writes("new payload OUT", "my.toml", over=False),
    "example plan": Writes("example plan OUT", quick=True, over=False),
    "example live": Writes("example live OUT", quick=True, over=False),
    "example motor-map": Writes("example motor-map OUT", "map.csv", over=False),
    "example sea-trials": Writes("example sea-trials OUT", over=False),
    "plc export": Writes("plc export nov-250t --controller ssc --out OUT"),
    "external": Writes("external orcaflex nov-250t --platforms source --out OUT"),
    "fmu": Writes("fmu nov-250t --platforms source --out OUT", "w.fmu", quick=True),
    "fmu system": Writes("fmu nov-250t CASE --contents ssp --platforms source --out OUT", "w.ssp"),
    "fmu reference": Writes(
        "fmu nov-250t CASE --platforms source --reference OUT/reference --out OUT/w.fmu", parts=True
    ),
    "convert csv": Writes("convert SERIES/runs.nc OUT", "r.csv"),
    "convert xlsx": Writes("convert SERIES/runs.nc OUT --signals e_c,F_w", "r.xlsx"),
    "convert parquet": Writes("convert SERIES/runs.nc OUT", "r.parquet"),
    "convert mat": Writes("convert SERIES/runs.nc OUT", "r.mat"),
    "convert crane": Writes("convert nov-250t OUT", "c.xlsx", quick=True),
    "inspect": Writes("inspect TESTS/logs/LOG --save OUT", "mapping.toml"),
    "run": Writes("run CASE --out OUT"),
    "compare": Writes("compare SHORT --controllers ns,ssc --out OUT"),
    "lower": Writes("lower LIFT --out OUT"),
    "response": Writes("response LIFT --out OUT"),
    "sea": Writes('sea "jonswap Hs=2 m Tp=8 s gamma=3.3" --out OUT'),
    "tip": Writes(f'tip supply-vessel-82m --at "x=-20 m, y=-18 m" {WAVE} --duration "3 min" --seed 1 --out OUT'),
    "vessel": Writes('vessel supply-vessel-82m --at "x=-20 m, y=-18 m" --out OUT'),
    "payload": Writes("payload suction-anchor-85t --out OUT"),
    "map": Writes(f"map nov-250t --controllers ssc {POINT} --out OUT"),
    "envelope": Writes('envelope utility-20t-open-circuit --loads "10 t" --layer 1 --out OUT'),
    "stability": Writes('stability nov-250t --controller ssc --load "30 t" --s-w "100 m" --v-tip "10 m/min" --out OUT'),
    "tune": Writes(f"tune TUNED --controllers ssc {POINT} --free K_p --objective error --out OUT"),
    "uncertainty": Writes("uncertainty SHORT --controllers ssc --draws 4 --out OUT"),
    "identify motor": Writes("identify motor MAP/map.csv --out OUT"),
    "identify friction": Writes("identify friction TESTS/campaign.toml --out OUT"),
    "identify component": Writes("identify component pump-leakage LEAK --mapping BASE --out OUT"),
    "identify curve": Writes("identify curve RAM --mapping RAM-MAPPING --out OUT"),
    "friction compare": Writes('friction compare crane-1 crane-2 --load "30 t" --crane nov-150t --out OUT'),
    "validate": Writes("validate TRIALS/campaign.toml --steps 0,1 --out OUT"),
    "certificate sign": Writes(
        "certificate sign OUT/certificate.json --key KEYS/key.pem", over=False, given="CERTIFIED"
    ),
    "certificate sign folder": Writes("certificate sign OUT --key KEYS/key.pem", over=False, given="CERTIFIED"),
    "certificate key trust": Writes("certificate key trust KEYS/public.pem", CONFIG, over=False),
    "live history": Writes("live history HISTORY --out OUT", "h.csv"),
    "plan": Writes("plan PLAN --tier closed-form --out OUT"),
    "plan store": Writes("plan PLAN --workers 1 --store OUT/store --out OUT", parts=True),
    "report": Writes("report PLANNED --figures --out OUT"),
    "thesis": Writes("thesis E19 OUT"),
    "weather persistence": Writes(
        'weather persistence SYNTHETIC-norwegian-sea --limit "Hs <= 1.5 m" --window "24 h" --out OUT'
    ),
    "weather forecast": Writes(
        'weather forecast SYNTHETIC-norwegian-sea --limit "Hs <= 2 m" --t-pop "24 h" --t-c "12 h" --out OUT', code=1
    ),
}
"""Every command with an output, by a name; `test_every_command_that_writes_is_here` keeps it complete."""

ELSEWHERE = {
    "demo": "plan with its report",
    "condition": "tests/live/test_condition.py: interrupted at each write",
    "certificate key new": "the writer keys: keys are never the same twice",
    "live residual": "atomic_file, as inspect: it learns from the logs of four campaigns",
}
"""Commands with an output that are not swept, and what has the same calls."""

STROKE, SPEEDS, STEP = 1.0, (0.05, 0.1, 0.2), 0.1
"""Of a machine that is run to and fro [m, m/s], and spacing of its log [s]."""


def prepare(folder: Path) -> dict[str, str]:
    """Write the files of the command lines; word -> path."""
    crane = "nov-250t"
    short = CASE.replace('mode = "MODE"\n', "")
    texts = {"CASE": CASE, "SHORT": short, "LIFT": LIFT, "PLAN": PLAN}
    texts["TUNED"] = 'crane = "CRANE"\n[settings]\nbudget = 20\n'
    texts["BASE"] = '[component]\nbase = "CRANE"\n'
    texts["RAM-MAPPING"] = (
        '[signals]\ntime = { column = "t", unit = "s" }\nspeed = { column = "v", quantity = "speed", unit = "m/s" }\n'
        'effort = { column = "F", quantity = "force", unit = "N" }\n'
    )
    words = {}
    for word, text in texts.items():
        file = folder / f"{word.lower()}.toml"
        file.write_text(text.replace("CRANE", crane).replace("MODE", "ssc"), encoding="utf-8")
        words[word] = str(file)
    for word, lines in {"LEAK": _leak(), "RAM": _to_and_fro()}.items():
        file = folder / f"{word.lower()}.csv"
        file.write_text("\n".join([*lines, ""]), encoding="utf-8")
        words[word] = str(file)
    return words | {word: str(folder / word.lower()) for word in PREPARED}


def _leak() -> Iterator[str]:
    """A table of a pump's conductances."""
    yield "D [cm^3/rev],n [rev/min],C_leak [L/min/bar]"
    yield from (f"{D},{n},{0.02 + 1e-5 * n}" for n in (1500, 2000) for D in (355, 284, 213, 142, 71))


def _to_and_fro() -> Iterator[str]:
    """A log of a machine with friction that is run to and fro in steps."""
    yield "t,v,F"
    k = 0
    for v in (sign * speed for speed in SPEEDS for sign in (1.0, 0.0, -1.0, 0.0)):
        for _ in range(round(STROKE / abs(v) / STEP) if v else 20):
            k += 1
            F = 2000.0 + math.copysign(300.0 + 2000.0 * abs(v), v) * (v != 0.0) + 20.0 * math.sin(7.3 * k)
            yield f"{STEP * k:.1f},{v},{F:.2f}"
