"""Logs of tests as a PLC writes them: short simulated runs with typical noise, as CSV beside a campaign file."""

import functools
from pathlib import Path

import numpy as np
import pandas as pd
from tests.validate.ahc_logs import TWIN, sea

from stillhook import Scenario, simulate
from stillhook.spec.scenario import Operator
from stillhook.validate.data_set.campaign import load_campaign
from stillhook.validate.data_set.read import read_records

COLUMNS = {
    "time": ("Time", "s", 1.0),
    "s_tip": ("Tip pos", "m", 1.0),
    "v_tip": ("Tip speed", "m/s", 1.0),
    "a_tip": ("Tip acc", "m/s^2", 1.0),
    "s_w": ("Wire out", "m", 1.0),
    "v_w": ("Wire speed", "m/min", 60.0),
    "omega_m": ("Motor speed", "rev/min", 30.0 / np.pi),
    "p_a": ("PT A", "bar", 1e-5),
    "p_b": ("PT B", "bar", 1e-5),
    "u_p": ("Pump command", "%", 100.0),
    "u_m": ("Motor command", "%", 100.0),
    "alpha_m": ("Motor setting", "%", 100.0),
    "F_w": ("Load cell", "kN", 1e-3),
    "e_c_measured": ("AHC error", "mm", 1e3),
    "v_op": ("Joystick", "m/min", 60.0),
    "mode": ("Mode", "1", 1.0),
}
"""Signal: heading, unit and its factor from SI."""
NOISE = {"s_tip": 1e-3, "v_tip": 3e-3, "a_tip": 0.01, "p_a": 0.5e5, "p_b": 0.5e5, "alpha_m": 5e-4, "F_w": 3e3}
STEPS = {
    "s_tip": 1e-3,
    "v_tip": 1e-3,
    "a_tip": 1e-3,
    "s_w": 1e-3,
    "v_w": 0.01 / 60.0,
    "omega_m": 0.05,
    "p_a": 1e4,
    "p_b": 1e4,
    "F_w": 1e2,
    "e_c_measured": 1e-4,
}
"""Standard deviation and last digit of the samples [SI]."""


def logged(case: Scenario, seed: int = 0) -> pd.DataFrame:
    """What the PLC logs of a run, from the end of its warm-up on: it computes its error from the samples of tip and wire that it logs."""
    rng = np.random.default_rng(seed)
    run = simulate(TWIN, case, every="10 ms")
    keep = run["time"].values >= case.warm_up - 1e-9
    out = {"Time": np.round(run["time"].values[keep] - case.warm_up, 4)}
    si = {
        name: run[name].values[keep] + NOISE.get(name, 0.0) * rng.standard_normal(int(keep.sum()))
        for name in COLUMNS
        if name != "time"
    }
    si["v_w"] = si["v_w"] * (1.0 + 2e-3 * rng.standard_normal(len(si["v_w"])))
    for name, digit in STEPS.items():
        si[name] = digit * np.round(si[name] / digit)
    active = si["mode"] > 0
    datum = np.mean(run["e_c_measured"].values[keep] + si["s_w"] - si["s_tip"])
    si["e_c_measured"] = np.where(active, si["s_tip"] - si["s_w"] + datum, 0.0)
    for name, values in si.items():
        out[COLUMNS[name][0]] = np.round(values * COLUMNS[name][2], 5)
    return pd.DataFrame(out)


@functools.cache
def ahc(seconds: float = 140.0, seed: int = 1) -> pd.DataFrame:
    """Heave compensation of 90 t with 487 m of wire out."""
    return logged(
        Scenario(load="90 t", s_w="487 m", tip=sea(seed), mode="ssc", duration=f"{seconds + 40.0} s", warm_up="40 s")
    )


@functools.cache
def manual() -> pd.DataFrame:
    """Hoisting and lowering without load, with rests of five seconds between."""
    points, t = [("0 s", "0 m/min")], 3.0
    for v in (20, -20, 30, -30, 25, -25):
        for wait, speed in ((0.0, 0), (0.5, v), (5.0, v), (0.5, 0), (5.0, 0)):
            t += wait
            points.append((f"{t:.2f} s", f"{speed} m/min"))
    return logged(
        Scenario(load="0 t", s_w="40 m", mode="manual", duration=f"{t:.2f} s", operator=Operator(profile=points))
    )


def signals(**rows: str | None) -> dict[str, str]:
    """Rows of the mapping, some changed, or left out (None)."""
    out = {name: f'{{ column = "{heading}", unit = "{unit}" }}' for name, (heading, unit, _) in COLUMNS.items()}
    return {name: row for name, row in (out | rows).items() if row is not None}


def with_clock(*names: str, column: str = "T2") -> dict[str, str]:
    """Rows of signals that another clock stamped."""
    return {n: f'{{ column = "{COLUMNS[n][0]}", unit = "{COLUMNS[n][1]}", clock = "{column}" }}' for n in names}


def write(
    folder: Path,
    frame: pd.DataFrame,
    *,
    test: str = 'load = "90 t"',
    kind: str = "ahc",
    rows: dict[str, str] | None = None,
    top: str = "",
    modes: str = "",
) -> Path:
    """A campaign of one test."""
    frame.to_csv(folder / "x.csv", index=False)
    mapping = "\n".join(f"{name} = {row}" for name, row in (signals() if rows is None else rows).items())
    table = f"[modes]\n{modes}\n" if modes else ""
    path = folder / "campaign.toml"
    path.write_text(
        f'title = "SYNTHETIC"\ndate = 2026-11-21\ncrane = "nov-250t"\n{top}\n[signals]\n{mapping}\n{table}'
        f'[[test]]\nname = "1"\nlog = "x.csv"\nkind = "{kind}"\n{test}\n'
    )
    return path


def read(folder: Path, frame: pd.DataFrame, **more):
    """The record of a test."""
    (record,) = read_records(load_campaign(write(folder, frame, **more)), lambda share: None)
    return record


def changed(frame: pd.DataFrame, heading: str, values: np.ndarray) -> pd.DataFrame:
    return frame.assign(**{heading: values})


def at(frame: pd.DataFrame, t: np.ndarray) -> pd.DataFrame:
    """The log as if it had been written at other times [s]."""
    own = frame["Time"].to_numpy()
    out = {h: np.interp(t, own, frame[h].to_numpy()) for h in frame.columns if h != "Time"}
    return pd.DataFrame({"Time": np.round(t, 6), **out})
