"""Cases of what figures show, of every winch, and of what the live twin says of a log."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import xarray
from tests.frozen.beside import Beside
from tests.frozen.drawn import figures, numbered, shown
from tests.frozen.inputs import LID, SPECTRA, STAIRCASE_MAPPING, staircase
from tests.frozen.printed import lines, printed
from tests.frozen.record import dataset
from tests.live import histories

import stillhook
from stillhook import analysis, plot
from stillhook.analysis.loop_stability.sweeps import bode_figure, motor_pole_figure, root_locus_figure
from stillhook.live import history
from stillhook.live.demo import with_friction
from stillhook.live.watch import replay
from stillhook.live.watch.comparison import Comparison
from stillhook.plan.tiers.time_domain.curves import ColumnRuns, curve_of, limits_of_curve
from stillhook.plan.tiers.time_domain.levels import cell_levels
from stillhook.plan.tiers.time_domain.measures import Measure
from stillhook.statistics.crossing_fit import Crossings, fit_crossings
from stillhook.thesis.gallery import items

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
    if not {*codes} <= {0, 1}:
        raise RuntimeError(f"exit codes {codes} of {', '.join(commands)}")
    return {"codes": codes, "figures": numbered(found)}


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
    return numbered(map(shown, made))


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


UNITS = {
    "s_tip": "m",
    "v_tip": "m/s",
    "s_w": "m",
    "p_a": "Pa",
    "p_b": "Pa",
    "p_hp": "Pa",
    "omega_m": "rad/s",
    "F_w": "N",
}
MEASURED = (*UNITS, "u_p", "u_m", "alpha_p", "alpha_m", "alpha_pm", "mode")


def simulated(growth: float, duration: str) -> xarray.Dataset:
    """A winch whose friction is so many times what its file says."""
    crane = with_friction(stillhook.load_crane("nov-250t"), growth)
    tip = "sine 1.2 m 9 s + sine 0.3 m 13 s"
    case = stillhook.Scenario(load="100 t", s_w="300 m", mode="ssc", tip=tip, duration=duration, ramp="0 s")
    return stillhook.simulate(crane, case, every="0.1 s", threads=1)


def printed_replay() -> Any:
    """A twin beside the log of a crane with twice the friction."""
    data = simulated(2.0, "56 s")
    head = ",".join(["time [s]", *(f"{name} [{UNITS.get(name, '1')}]" for name in MEASURED)])
    columns = np.column_stack([data.time, *(data[name] for name in MEASURED)])
    np.savetxt("log.csv", columns, fmt="%.9g", delimiter=",", header=head, comments="")
    with patch.object(replay, "LiveTwin", Beside):
        command = ("live", "replay", "log.csv", "--load", "100 t", "--speed", "20", "--verbose")
        return printed(*command, verbose=False)


DECIMALS = 6
"""Of differences between two runs, which may be as small as rounding."""


def watched() -> Any:
    """Minutes of a crane with two and a half times the friction: criteria, their causes, virtual sensors."""
    twin, crane = simulated(1.0, "340 s"), simulated(2.5, "340 s")
    series = [name for name in twin.data_vars if twin[name].dims == ("time",)]
    rows = {name: twin[name].values for name in series} | {"time": twin.time.values}
    seen = {name: crane[name].values for name in MEASURED}
    of = Comparison(stillhook.load_crane("nov-250t"))
    changes = []
    for i in range(len(twin.time)):
        changes += of.add({n: float(x[i]) for n, x in seen.items()}, {n: float(x[i]) for n, x in rows.items()})
    found = {
        f"{r.key} {r.window}": {k: round(v, DECIMALS) if isinstance(v, float) else v for k, v in r._asdict().items()}
        for r in of.found.results
    }
    return {"changes": [c._asdict() for c in changes], "shown": of.shown, "results": found}


def history_in_parts() -> Any:
    """Hours of a history, all of it and parts of it: as stored, evenly spaced, between rows."""
    histories.write_hours(Path("twin"), hours=2.5)
    day = "2026-11-28T"
    asked = (
        {},
        {"start": f"{day}13:00", "end": f"{day}13:30"},
        {"start": f"{day}13:00:20", "end": f"{day}13:10:40", "every": "30 s", "signals": ["p_a", "F_w"]},
        {"end": f"{day}12:05", "every": "2 min"},
    )
    runs = [history.read(Path("twin"), **of) for of in asked]
    return numbered({str(n): np.ravel(run[n].values).tolist() for n in sorted(map(str, run.variables))} for run in runs)


def vessel_and_session() -> Any:
    """A tip that vessel and boom move, as a motion unit measures it; and a session that is told what to do."""
    crane = stillhook.load_crane("nov-250t")
    boom = "x=-10 m, y=-6 m, z=8 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg"
    swell = {"heave": "sine 1 m 9 s", "roll": "sine 2 deg 12 s", "pitch": "sine 1 deg 8 s"}
    moves = {"slew": [("2 s", "9 s", "240 deg")], "luff": [("3 s", "9 s", "55 deg")]}
    unit = stillhook.MotionUnit(heave_period="25 s")
    usual = {"load": "100 t", "s_w": "100 m", "mode": "ssc", "duration": "15 s", "warm_up": "3 s"}
    cases = {
        "level": stillhook.VesselTip(boom, **swell, **moves),
        "measured": stillhook.VesselTip(boom, **swell, unit=unit),
    }
    found = {
        name: dataset(stillhook.simulate(crane, stillhook.Scenario(tip=tip, **usual), every="0.1 s", threads=1))
        for name, tip in cases.items()
    }
    session = stillhook.Session(crane, stillhook.Scenario(tip="sine 1 m 9 s", **usual))
    rows = []
    for k in range(24):
        if k == 8:
            session.set("K_p", 0.2)
        if k == 16:
            session.set("mode", "hs")
        for i in range(50):
            t = (50 * k + i) * session.cycle
            tip = {"s_tip": 0.5 * np.sin(t), "v_tip": 0.5 * np.cos(t), "a_tip": -0.5 * np.sin(t)}
            session.step(tip if k >= 4 else None)
        rows.append([session.time, *map(session.get, session.signals)])
    return found | {"session": dict(zip(("time", *session.signals), np.array(rows).T.tolist(), strict=True))}


def limits_of_runs() -> Any:
    """Limits from levels of made-up runs, and from runs that say yes or no."""
    rng, made = np.random.default_rng(1), {}
    for name, level in {
        "steep": lambda h: (h / 1.6) ** 1.6,
        "level": lambda h: 0.97 * -np.expm1(-((h / 0.9) ** 1.8)),
        "slow": lambda h: 0.5 + 0.1 * h,
    }.items():
        columns = []
        for T in np.arange(5.0, 15.0, 2.0):
            cells = tuple(
                (h, {"duration": np.ones(12), "x": level(h) * np.exp(0.15 * rng.gumbel(size=12))})
                for h in (0.8, 1.3, 1.6, 2.0)
            )
            columns.append(ColumnRuns(float(T), np.pi, Measure("x", q=0.9), 1.6, 0.05, cells))
        found = limits_of_curve(curve_of(columns), np.full(len(columns), 1.0), 6.0)
        levels = [cell_levels(columns).at(i, h) for i in range(len(columns)) for h in (0.8, 1.6, 2.0)]
        made[name] = {"Hs": found.Hs, "low": found.low, "high": found.high, "levels": np.array(levels)}
    periods, angles = np.repeat([6.0, 9.0, 12.0], 2), np.tile([2.9, 3.1], 3)
    column, ln_F = np.repeat(np.arange(6), 12), rng.normal(0.5, 0.3, 72)
    beyond = ln_F > 0.5 + 0.4 * np.log(periods[column] / 9.0) + rng.normal(0.0, 0.15, 72)
    fit = fit_crossings(Crossings(column, ln_F, beyond), periods, angles, np.full(6, 0.6))
    found = fit.limits(rng.normal(0.0, 0.25, (6, 400)), np.full(6, 0.3))
    made["crossings"] = {"Hs": found.value, "low": found.low, "high": found.high}
    return {name: {key: np.ravel(x).tolist() for key, x in part.items()} for name, part in made.items()}


def plotted() -> Any:
    """Figures that a notebook asks for, and what it prints of a run."""
    crane = stillhook.load_crane("nov-250t")
    usual = {"load": "100 t", "s_w": "100 m", "tip": "sine 1 m 10 s", "duration": "25 s", "warm_up": "5 s"}
    cases = [stillhook.Scenario(mode=mode, **usual) for mode in ("ns", "ssc")]
    runs = stillhook.simulate(crane, cases, every="0.1 s", series=True, threads=1)
    one = runs.isel(case=0)
    Path("lid.toml").write_text(LID.replace("180 s", "30 s"), encoding="utf-8")
    file = stillhook.load_lift("lid.toml")
    lift = stillhook.simulate(file.crane, file.lift, threads=1)
    grid = {"loads": ["50 t", "100 t"], "speeds": ["20 m/min", "60 m/min"]}
    data = analysis.operability_map(crane, ["ns", "ssc"], **grid)
    top = analysis.envelope(crane, layers=[9], loads=["100 t", "200 t"], modes=["ns"])
    made = (
        *(plot.run(runs), plot.run(one, title="one", start=5.0, end=20.0), plot.lowering(lift), plot.moments(lift)),
        *(plot.map(data), plot.map(data, "p_max"), plot.change(data), plot.envelope(top), plot.layers(top)),
    )
    return {"figures": numbered(map(shown, made)), "printed": lines(repr(one.stillhook))}


SLOW = ("2.17", "A4", "A5", "C4", "E5")
"""Items of the thesis that take a second and more."""


def thesis_by(*begins: str) -> Any:
    """Figures and tables of the thesis whose number begins so; of its maps `drawn_analysis` has one."""
    found = {}
    for number, item in items().items():
        made = item.state in ("drawn", "numbers", "circuit") and not item.function.startswith("maps")
        if made and number.startswith(begins) and number not in SLOW:
            with figures() as pictures:
                found[number] = [printed("thesis", number, "out", verbose=False)["out"], numbered(pictures)]
    return found


def drawn_thesis() -> Any:
    return thesis_by("1", "2", "T")


def drawn_papers() -> Any:
    return thesis_by("A", "B", "C", "D")


def drawn_paper_e() -> Any:
    return thesis_by("E", "F")


FURTHER: tuple[Callable[[], Any], ...] = (
    *(drawn_sea, drawn_weather, drawn_runs, drawn_lowering, drawn_analysis, drawn_loops, drawn_logs),
    *(every_drive, printed_drives, printed_replay, watched),
    *(drawn_thesis, drawn_papers, drawn_paper_e, plotted, limits_of_runs, history_in_parts, vessel_and_session),
)
