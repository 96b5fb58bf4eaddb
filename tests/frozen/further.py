"""Cases of what figures show, of every winch, and of what the live twin says of a log."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.frozen.drawn import figures, shown
from tests.frozen.inputs import LID, SPECTRA, STAIRCASE_MAPPING, staircase
from tests.frozen.printed import lines, printed
from tests.frozen.record import dataset

import stillhook
from stillhook.analysis.loop_stability.sweeps import bode_figure, motor_pole_figure, root_locus_figure

RUN = """crane = "nov-250t"
[scenario]
load = "100 t"
s_w = "100 m"
tip = "sine 1 m 10 s"
duration = "30 s"
warm_up = "10 s"
"""
SINE = "--motion|sine 2 m 12 s|--duration|40 s"


def drawn(*commands: str) -> Any:
    """Figures that commands write, their words parted by |."""
    with figures() as found:
        codes = [printed(*command.split("|"), "--out", "out", verbose=False)["code"] for command in commands]
    return {"codes": codes, "figures": found}


def drawn_sea() -> Any:
    Path("spectra.txt").write_text(SPECTRA, encoding="utf-8")
    wave = "jonswap Hs=1 m Tp=8 s"
    return drawn(
        *("sea|jonswap Hs=2 m Tp=8 s gamma=3.3", "sea|spectra.txt", "payload|suction-anchor-85t"),
        f"tip|supply-vessel-82m|--at|x=-20 m, y=-12 m|--wave|{wave}|--heading|165 deg",
        "vessel|supply-vessel-82m|--at|x=-20 m, y=-18 m",
    )


def drawn_weather() -> Any:
    hindcast = "SYNTHETIC-norwegian-sea"
    return drawn(
        f"weather|persistence|{hindcast}|--limit|Hs <= 1.5 m|--window|24 h",
        f"weather|forecast|{hindcast}|--limit|Hs <= 2 m|--t-pop|24 h|--t-c|12 h",
    )


def drawn_runs() -> Any:
    Path("case.toml").write_text(RUN, encoding="utf-8")
    return drawn("run|case.toml", f"compare|nov-250t|--drives|active-passive,electric|{SINE}")


def drawn_lowering() -> Any:
    Path("lid.toml").write_text(LID.replace("180 s", "60 s"), encoding="utf-8")
    return drawn("lower|lid.toml")


def drawn_analysis() -> Any:
    return drawn(
        "map|nov-250t|--loads|50 t, 100 t|--speeds|20 m/min, 60 m/min",
        f"uncertainty|nov-250t|{SINE}|--draws|8|--controllers|ns,ssc|--limit|e_c_pp <= 10 cm",
    )


def drawn_loops() -> Any:
    crane = stillhook.load_crane("nov-250t")
    made = (bode_figure(crane, (1.0, 0.6), delay=0.05), root_locus_figure(crane), motor_pole_figure(crane))
    return [shown(figure) for figure in made]


def drawn_logs() -> Any:
    Path("log.csv").write_text(staircase(), encoding="utf-8")
    Path("mapping.toml").write_text(STAIRCASE_MAPPING, encoding="utf-8")
    return drawn("identify|curve|log.csv|--mapping|mapping.toml", "friction|compare|crane-1|crane-2")


OTHER_DRIVES = {
    "nov-100t-cylinder": 40,
    "nov-100t-electric": 60,
    "nov-250t-digital": 100,
    "nov-250t-secondary": 100,
    "utility-20t-open-circuit": 8,
}
"""Cranes whose winch takes a speed command, and a load [t]; more than most of them hold in all that is asked."""


def every_drive() -> Any:
    """Heave compensation, a joystick up and down, and a load that is too heavy, with the notes on them."""
    profile = [
        ["2 s", "0 m/min"],
        ["4 s", "15 m/min"],
        ["10 s", "15 m/min"],
        ["13 s", "-15 m/min"],
        ["18 s", "0 m/min"],
    ]
    found = {}
    for name, tonnes in OTHER_DRIVES.items():
        crane = stillhook.load_crane(name)
        given = {"s_w": "60 m", "duration": "20 s", "warm_up": "5 s"}
        cases = {
            "position": {"load": f"{tonnes} t", "mode": "position", "tip": "sine 1 m 10 s"},
            "joystick": {"load": "1 t", "mode": "manual", "tip": "sine 0.2 m 8 s", "operator": {"profile": profile}},
            "heavy": {"load": f"{crane.SWL} kg", "mode": "position", "tip": "sine 4 m 9 s"},
        }
        for label, case in cases.items():
            series = {"every": "0.1 s"} if label == "position" else {"series": False}
            run = stillhook.simulate(crane, stillhook.Scenario(**case, **given), threads=1, **series)
            found[f"{name} {label}"] = dataset(run) | {"notes": lines(run.notes.item().replace("; ", "\n"))}
    return found


def printed_drives() -> Any:
    return {name: printed("envelope", name, "--loads", f"{tonnes} t") for name, tonnes in OTHER_DRIVES.items()}


FURTHER: tuple[Callable[[], Any], ...] = (
    *(drawn_sea, drawn_weather, drawn_runs, drawn_lowering, drawn_analysis, drawn_loops, drawn_logs),
    *(every_drive, printed_drives),
)
