"""Cases of what people read: answers in the terminal, short and in full, and the texts of written files."""

from pathlib import Path
from typing import Any

import numpy as np
from tests.frozen.inputs import LID, SPECTRA, STAIRCASE_MAPPING, staircase, weather_csv
from tests.frozen.printed import printed, texts
from trials.campaigns.motor_map import synthetic_map, write_map

import stillhook
from stillhook.live.demo import with_friction

SINE = ("--motion", "sine 2 m 12 s", "--duration", "40 s")
SEA = "jonswap Hs=2 m Tp=8 s gamma=3.3"
KINDS = ("cranes", "vessels", "payloads", "compensators", "frictions", "lifts", "controllers", "winches")


def every(*commands: str) -> dict[str, Any]:
    """Answers of commands, their words parted by |."""
    return {command: printed(*command.split("|")) for command in commands}


def printed_library() -> Any:
    return every(
        *(f"list|{kind}" for kind in KINDS),
        *("crane|nov-250t", "crane|nov-100t-electric", "payload|suction-anchor-85t", "payload|manifold-60t"),
        "friction|compare|crane-1|crane-2",
        "vessel|supply-vessel-82m|--at|x=-20 m, y=-18 m",
        "vessel|construction-vessel-130m|--check",
        *("calc|drum|nov-250t", "calc|drum|nov-250t|layer=3", "calc|inertia|nov-250t|s_w=200 m"),
        *("calc|steady|nov-250t|v_w=8 m/min", "calc|speed|nov-250t|alpha_m=0.7"),
        *("calc|eigenfrequency|nov-250t|alpha_m=0.7", "calc|gain-limit|nov-100t-pure-active|alpha_m=0.7"),
        "calc|motor-loss|A6VM215|D_m=215 cm^3/rev|omega_m=1000 rev/min|dp_m=200 bar",
        "calc|friction|crane-1|T_d=1.5 MN m|omega_m=100 rev/min",
    )


def printed_starters() -> Any:
    answers = [printed("new", kind, f"{kind}.toml", verbose=False) for kind in ("crane", "lift", "payload", "drives")]
    answers += [printed("new", "crane", "electric.toml", "nov-100t-electric", verbose=False)]
    return [*answers, texts(".", ".toml")]


def printed_sea() -> Any:
    Path("spectra.txt").write_text(SPECTRA, encoding="utf-8")
    tip = "tip|supply-vessel-82m|--at|x=-20 m, y=-12 m|--wave|jonswap Hs=1 m Tp=8 s|--heading"
    return every(
        *(f"sea|{SEA}", "sea|spectra.txt", "inspect|spectra.txt", "sea|torsethaugen Hs=2 m Tp=8 s"),
        *(f"{tip}|165 deg", f"{tip}|165 deg|--spread|4|--seeds|3", f"{tip}|all"),
    )


def printed_analysis() -> Any:
    sine = "|".join(SINE)
    return every(
        f"compare|nov-250t|{sine}",
        f"compare|nov-100t-pure-active|--load|60 t|{sine}",
        f"compare|nov-250t|--drives|active-passive,electric|{sine}",
        "envelope|nov-250t|--loads|100 t|--loads|200 t",
        "envelope|nov-100t-pure-active|--loads|50 t",
        "map|nov-250t|--loads|50 t, 100 t|--speeds|20 m/min, 60 m/min",
        "stability|nov-250t|--load|100 t|--s-w|100 m|--v-tip|10 m/min",
        "stability|nov-250t|--layer|2",
        f"uncertainty|nov-250t|{sine}|--draws|8|--controllers|ns,ssc|--limit|e_c_pp <= 10 cm",
    )


def printed_weather() -> Any:
    Path("site.csv").write_text(weather_csv(), encoding="utf-8")
    limits = "--limit|Hs <= 1.5 m|--limit|wind <= 10 m/s"
    return every(
        *("inspect|site.csv", "weather|show|site.csv", "weather|show|SYNTHETIC-norwegian-sea"),
        f"weather|persistence|SYNTHETIC-norwegian-sea|{limits}|--window|24 h",
        "weather|persistence|site.csv|--limit|Hs <= 1 m|--window|18 h",
        *("weather|alpha|--hs|2 m|--t-pop|24 h", "weather|alpha|--hs|0.8 m|--t-pop|24 h"),
        "weather|forecast|SYNTHETIC-norwegian-sea|--limit|Hs <= 2 m|--t-pop|24 h|--t-c|12 h",
    )


def printed_logs() -> Any:
    write_map(synthetic_map("A6VM170", seed=2), "map.csv")
    Path("log.csv").write_text(staircase(), encoding="utf-8")
    Path("mapping.toml").write_text(STAIRCASE_MAPPING, encoding="utf-8")
    return every("identify|curve|log.csv|--mapping|mapping.toml", "inspect|map.csv", "inspect|log.csv")


def printed_parameters() -> Any:
    """Of a winch that loses a fifth more than its file says."""
    names = ("s_tip", "s_w", "omega_m", "p_a", "p_b", "p_hp", "alpha_m", "alpha_pm", "alpha_p", "F_w")
    units = {"s_tip": "m", "s_w": "m", "omega_m": "rad/s", "p_a": "Pa", "p_b": "Pa", "p_hp": "Pa", "F_w": "N"}
    crane = with_friction(stillhook.load_crane("nov-250t"), 1.2)
    case = stillhook.Scenario(load="60 t", s_w="800 m", mode="ssc", tip="sine 0.8 m 9 s", duration="90 s")
    data = stillhook.simulate(crane, case, every="0.02 s", threads=1)
    head = ",".join(["time [s]", *(f"{name} [{units.get(name, '1')}]" for name in names)])
    columns = np.column_stack([data.time, *(data[name] for name in names)])
    np.savetxt("log.csv", columns, fmt="%.9g", delimiter=",", header=head, comments="")
    return every("live|parameters|log.csv|--crane|nov-250t|--load|60 t", "inspect|log.csv")


def printed_lowering() -> Any:
    Path("lid.toml").write_text(LID.replace("180 s", "60 s"), encoding="utf-8")
    return [printed("lower", "lid.toml"), printed("lower", "anchor-to-3000m", "--duration", "60 s")]


def printed_plan() -> Any:
    lifts = ("template-to-1500m", "manifold-recovery")
    return [printed("plan", lift, "--check", "--verbose", verbose=False) for lift in lifts]


def printed_export() -> Any:
    return [
        *(printed("plc", "export", "nov-250t", "--out", "plc"), texts("plc", ".st")),
        printed("plc", "check", "plc/nov-250t-ssc.st"),
    ]


def printed_thesis() -> Any:
    return every("thesis", *(f"thesis|{number}" for number in ("E3", "ET2", "2.17", "C13", "T2.7")))


ANSWERS = (
    *(printed_library, printed_starters, printed_sea, printed_analysis, printed_weather),
    *(printed_logs, printed_parameters, printed_lowering, printed_plan, printed_export, printed_thesis),
)
