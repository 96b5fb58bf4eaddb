"""Command lines of the contract between winch types, controllers and commands, and the files that they read."""

from __future__ import annotations

from pathlib import Path

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
start = "2 m"
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
VESSEL
[tip]
at = "x=-15 m, y=-24 m, z=36 m"
[water]
depth = "25 m"
[wire]
nodes = 3
[[stage]]
mode = "splash"
lower = "30 m/min"
depth = "8 m"
[[stage]]
mode = "ahc"
time = "20 s"
"""
PLAN = """
crane = "CRANE"
vessel = "construction-vessel-130m"
payload = "manifold-60t"
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
start = "-80 m"
duration = "2 min"
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


def write_files(folder: Path, crane: str, mode: str) -> dict[str, str]:
    """Files that the commands read, by the word that stands for each."""
    texts = {"case": CASE, "lift": LIFT.replace("VESSEL", ""), "plan": PLAN, "friction": FRICTION}
    texts["lift"] = 'vessel = "construction-vessel-130m"\n' + texts["lift"]
    files = {}
    for name, text in texts.items():
        path = folder / f"{name}-{mode}{'.friction' if name == 'friction' else ''}.toml"
        path.write_text(text.replace("CRANE", crane).replace("MODE", mode), encoding="utf-8")
        files[name] = str(path)
    return files


def of_controller(crane: str, mode: str, folder: Path) -> dict[str, list[str]]:
    """Commands that take a controller, on a crane."""
    f, run = write_files(folder, crane, mode), ["--load", "30 t", "--duration", "20 s", "--warm-up", "10 s"]
    cells = ["--loads", "30 t", "--speeds", "20 m/min"]
    tuned = [*cells, "--periods", "10 s", "--budget", "20", "--free", "K_p"]
    unsure = ["uncertainty", "--crane", crane, *run, "--modes", mode, "--draws", "4"]
    return {
        "compare": ["compare", "--crane", crane, *run, "--modes", mode],
        "run": ["run", f["case"]],
        "map": ["map", crane, "--controllers", mode, *cells],
        "map settling": ["map", crane, "--controllers", mode, "--metric", "settling", *cells],
        "envelope": ["envelope", crane, "--load", "30 t", "--modes", mode],
        "tune": ["tune", crane, "--controllers", mode, *tuned],
        "uncertainty": unsure,
        "calc steady": ["calc", "steady", crane, "--v-w", "20 m/min", "--mode", mode],
        "lower": ["lower", f["lift"]],
        "response": ["response", f["lift"]],
        "plan check": ["plan", f["plan"], "--check"],
        "plan quick": ["plan", f["plan"], "--quick", "--threads", "1"],
        "plan": ["plan", f["plan"], "--threads", "1", "--store", str(folder / f"store-{mode}")],
        "friction draws": [
            "friction",
            "draws",
            f["friction"],
            "--crane",
            crane,
            "--load",
            "30 t",
            "--mode",
            mode,
            "--n",
            "4",
        ],
    }


def of_winch(crane: str, mode: str, folder: Path) -> dict[str, list[str]]:
    """Commands that take no controller, and other forms of those that do."""
    f, out = write_files(folder, crane, mode), folder / f"out-{mode}"
    run = ["--load", "30 t", "--duration", "20 s", "--warm-up", "10 s"]
    cells = ["--loads", "20 t, 30 t", "--speeds", "20 m/min, 30 m/min"]
    unsure = ["uncertainty", "--crane", crane, *run, "--modes", f"ns,{mode}" if mode != "ns" else mode, "--draws", "8"]
    pair = f"ns,{mode}" if mode != "ns" else "ns"

    def written(name: str) -> list[str]:
        return ["--out", str(out / name)]

    return {
        "crane": ["crane", crane],
        "compare files": ["compare", "--crane", crane, *run, "--modes", pair, *written("compare")],
        "run files": ["run", f["case"], *written("run")],
        "map files": ["map", crane, "--controllers", pair, *cells, *written("map")],
        **{
            f"map {m}": ["map", crane, "--controllers", pair, *cells, "--metric", m]
            for m in ("eta_c", "p_max", "alpha_m")
        },
        "map settling files": [
            "map",
            crane,
            "--controllers",
            pair,
            "--metric",
            "settling",
            *cells,
            *written("settling"),
        ],
        "envelope files": ["envelope", crane, "--load", "30 t", "--modes", pair, *written("envelope")],
        "stability": ["stability", crane, *written("stability")],
        "stability alpha": ["stability", crane, "--alpha-m", "1", "--delay", "50 ms"],
        "stability full": ["stability", crane, "--full", "--load", "30 t", "--v-tip", "10 m/min"],
        "stability layer": ["stability", crane, "--layer", "3"],
        "strong-ssc": ["compare", "--crane", crane, *run, "--modes", "ssc"],
        "map strong": ["map", crane, "--controllers", "strong-ssc", "--loads", "30 t", "--speeds", "20 m/min"],
        "tune files": [
            "tune",
            crane,
            "--controllers",
            mode,
            "--budget",
            "20",
            "--loads",
            "30 t",
            "--speeds",
            "20 m/min",
            "--periods",
            "10 s",
            "--objective",
            "error",
            *written("tune"),
        ],
        "uncertainty sobol": [*unsure, "--sobol", *written("uncertainty")],
        "uncertainty attribute": [*unsure, "--limit", "e_c_pp <= 10 cm", "--attribute"],
        "uncertainty pressure": [*unsure, "--limit", "p_max <= 300 bar"],
        "uncertainty case": ["uncertainty", f["case"], "--draws", "4"],
        "lower files": ["lower", f["lift"], *written("lower")],
        "response files": ["response", f["lift"], *written("response")],
        "plan closed-form": ["plan", f["plan"], "--tier", "closed-form", *written("closed")],
        "plan files": ["plan", f["plan"], "--quick", "--threads", "1", *written("plan")],
        "plan twin files": ["plan", f["plan"], "--threads", "1", *written("twin")],
        "report": ["report", str(out / "plan")],
        **{f"calc {name}": ["calc", name, crane] for name in ("drum", "inertia", "speed")},
        **{f"calc {name}": ["calc", name, crane, "--alpha-m", "0.8"] for name in ("eigenfrequency", "gain-limit")},
        "calc friction": ["calc", "friction", "L4593", "--speed", "1000 rev/min", "--drum-torque", "1 MN m"],
        "friction compare": ["friction", "compare", "crane-1", "crane-2", "--crane", crane, "--load", "30 t"],
        "identify example": ["identify", "example-campaign", "crane-2", str(out / "identify"), "--duration", "3 min"],
        "certificate example": ["certificate", "example-campaign", str(out / "trials"), "--crane", crane],
        "validate": ["validate", str(out / "trials" / "campaign.toml"), "--out", str(out / "validated")],
        "certificate show": ["certificate", "show", str(out / "validated" / "certificate.json")],
        "certificate check": ["certificate", "check", str(out / "validated" / "certificate.json"), "--quick"],
    }
