"""A campaign on disk with its records, and a validation of it as the steps would leave it."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure

from stillhook.logs.types import Log
from stillhook.report.document import Table
from stillhook.report.kit import caption
from stillhook.spec.scenario import Mode
from stillhook.validate.criteria.criteria import Criterion, Limit
from stillhook.validate.criteria.judge import judge
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign, CraneTest, load_campaign
from stillhook.validate.data_set.record import Record, Segment
from stillhook.validate.validation import Validation

DT = 0.1
LENGTH = 400.0
CASES = {"1": (82e3, 487.0, Mode.NS, 1.0, 8.0), "2": (164e3, 2314.0, Mode.SSC, 0.4, 11.0)}
"""Test -> load [kg], wire out [m], mode, amplitude [m] and period [s] of the tip."""
FOUND = {
    "wire_lengths": 3.0,
    "loads": 3.0,
    "load_share": 0.656,
    "s_tip_pp_low": 0.4,
    "s_tip_pp_high": 2.3,
    "data_length": 2200.0,
    "e_c_pp_deviation": 0.021,
    "e_c_max_difference": 0.012,
    "eta_c_deviation_high": 0.011,
    "e_c_correlation": 0.97,
    "u_p_deviation": 0.004,
    "u_m_deviation": 0.003,
}


def write(folder: Path, *, crane: str = "nov-250t", synthetic: bool = True, order: str = "12") -> Path:
    """A campaign file with its logs, and nothing in them that the steps are needed for; order: in which the logs come onto the disk."""
    (folder / "logs").mkdir(parents=True, exist_ok=True)
    for name in order:
        (folder / "logs" / f"{name}.csv").write_text(f"Time [s],Tip [m]\n0,0\n0.1,0.{name}\n")
    tests = [
        f'[[test]]\nname = "{name}"\nlog = "logs/{name}.csv"\nkind = "ahc"\nload = "{CASES[name][0] / 1e3:g} t"\n'
        for name in CASES
    ]
    head = f'title = "Sea trial"\ndate = 2026-11-21\ncrane = "{crane}"\ndelay = "40 ms"\n'
    mark = "synthetic = true\n" if synthetic else ""
    (folder / "campaign.toml").write_text(head + mark + "\n" + "\n".join(tests))
    return folder / "campaign.toml"


def record(test: CraneTest) -> Record:
    load, s_w, mode, A, T = CASES.get(test.name, CASES["2"])
    t = np.arange(0.0, LENGTH, DT)
    s_tip = A * np.sin(2.0 * np.pi * t / T)
    signals = {"s_tip": s_tip, "s_w": s_w + s_tip, "e_c_measured": 0.02 * s_tip}
    part = Segment(test.name, 0, len(t), 0.0, t[-1], load, s_w, s_w - A, s_w + A, 2.0 * A, T, mode)
    return Record(
        test,
        Log(test.log.name, t, signals, {}, (), (), 10.0, len(t)),
        t,
        DT,
        signals,
        (part,),
        (f"all of test {test.name} is there",),
    )


def staged(campaign: str | Path | Campaign, *, complete: bool = True, **found: float | None) -> Validation:
    """found: measures that are other than in FOUND."""
    todo = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    values = FOUND | found
    steps = []
    for number in StepNumber if complete else (StepNumber.DATA,):
        rows = [c for c in todo.criteria.criteria if c.step is number]
        measures = tuple(_measure(c.measure, values.get(c.measure, _well_within(c)), c.quantity) for c in rows)
        estimates = SimpleNamespace(comparisons=()) if number is StepNumber.AHC else None
        text, table = f"step {int(number)} was taken", _table(number)
        steps.append(Step(number, measures, (text,), (table,), estimates=estimates))
    steps[-1] = replace(steps[-1], data={"e_c_pp": np.zeros(3)})
    measures = tuple(m for s in steps for m in s.measures)
    return Validation(
        todo,
        tuple(record(t) for t in todo.tests),
        tuple(steps),
        judge(todo.criteria, measures, [s.number for s in steps]),
    )


def _well_within(c: Criterion) -> float:
    return 2.0 * c.limit if c.kind is Limit.AT_LEAST else 0.5 * c.limit


def _measure(name: str, value: float | None, quantity: str) -> Measure:
    low, high = (None, None) if value is None else (0.9 * value, 1.1 * value)
    return Measure(name, value, quantity, low, high, "", "2 load cases, 740 s", ("log it",) if value is None else ())


def _table(number: StepNumber) -> Table:
    return Table(("load case", "mean\n[cm]"), (("1", "1.9"), ("2", "2.1")), f"Table of step {int(number)}")


def drawn(estimates: object, campaign: Campaign) -> dict[str, Figure]:
    figure = Figure(figsize=(8.0, 3.0), layout="constrained")
    ax = figure.subplots()
    for r in map(record, campaign.tests):
        ax.plot(r.t, r.signals["s_tip"], label=f"{r.test.name}, {'SYNTHETIC' if campaign.synthetic else 'measured'}")
    ax.legend()
    return {"tip-over-time": caption(figure, "Motion of the crane tip over time, all tests.")}
