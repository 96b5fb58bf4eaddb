"""Records of heave compensation for tests of step 5: a winch simulated with known differences from the twin, its signals as a log has them."""

import datetime
import functools
from dataclasses import replace
from pathlib import Path

import numpy as np

from stillhook import Scenario, Sine, load_crane, simulate
from stillhook.logs.types import Log
from stillhook.sea.motion.motion import Sum
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Operator
from stillhook.validate.criteria.criteria import load_criteria
from stillhook.validate.data_set.campaign import Campaign, CraneTest, Kind
from stillhook.validate.data_set.record import Record, Segment

STEP = 0.01  # s, the PLC's cycle
NAMES = ("s_tip", "v_tip", "s_w", "v_w", "p_a", "p_b", "F_w", "u_p", "e_c_measured", "v_op")
TWIN = load_crane("nov-250t")


@functools.cache
def sea(seed: int, height: float = 1.3, period: float = 9.0) -> Sum:
    """Irregular tip motion: thirty waves of a narrow spectrum; height four standard deviations [m], period of the peak [s]."""
    rng = np.random.default_rng(seed)
    f = np.linspace(0.6 / period, 1.8 / period, 30)
    power = f**-5.0 * np.exp(-1.25 * (period * f) ** -4.0)
    a = np.sqrt(power) * height / 4.0 / np.sqrt(power.sum() / 2.0)
    return Sum(
        [
            Sine.from_si(float(A), float(1.0 / x), float(p))
            for A, x, p in zip(a, f, rng.uniform(0.0, 2.0 * np.pi, len(f)), strict=True)
        ]
    )


def crane_log(
    crane: Crane,
    *,
    duration: float = 150.0,
    seed: int = 1,
    load: float = 90e3,
    s_w: float = 487.0,
    delay: float = 0.0,
    operator: Operator | None = None,
) -> dict[str, np.ndarray]:
    """What a crane's PLC logs in heave compensation, without noise: tip as the PLC gets it, delayed [s]."""
    lead = 40.0  # s in which the winch comes into its swing
    case = Scenario(
        load=f"{load} kg",
        s_w=f"{s_w} m",
        tip=sea(seed),
        mode="ssc",
        duration=f"{lead + duration} s",
        operator=operator or Operator(),
        sensors={"delay": f"{delay} s"},
    )
    run = simulate(crane, case, every="10 ms")
    log = {name: run[name].values for name in NAMES}
    late = round(delay / STEP)
    if late:
        for name in ("s_tip", "v_tip"):
            log[name] = np.concatenate((np.full(late, log[name][0]), log[name][:-late]))
    first = round(lead / STEP)
    return {name: x[first:].copy() for name, x in log.items()}


def record(
    log: dict[str, np.ndarray],
    *,
    name: str = "1",
    load: float = 90e3,
    parts: tuple[tuple[int, int], ...] = (),
    mode: Mode = Mode.SSC,
    kind: Kind = Kind.AHC,
    step: float = STEP,
) -> Record:
    """A log as a record; parts: its unbroken parts as samples, default all of it; step between samples [s]."""
    n = len(log["s_w"])
    t = np.arange(n) * step
    test = CraneTest(name, Path(f"{name}.csv"), kind, load, mode, None, None, None, -np.inf, np.inf)
    segments = tuple(
        Segment(
            test=name,
            first=a,
            last=b,
            start=float(t[a]),
            duration=float(t[b - 1] - t[a]),
            load=load,
            s_w=float(log["s_w"][a]),
            s_w_min=float(np.nanmin(log["s_w"])),
            s_w_max=float(np.nanmax(log["s_w"])),
            s_tip_pp=float(np.ptp(log["s_tip"][a:b])) if "s_tip" in log else 0.0,
            period=8.0,
            mode=mode,
        )
        for a, b in (parts or ((0, n),))
    )
    source = Log(f"{name}.csv", t, log, {}, (), (), 1.0 / step, n)
    return Record(test, source, t, step, log, segments, ())


def campaign(*records: Record, twin: Crane = TWIN, delay: float = 0.0, window: float = 30.0) -> Campaign:
    """A campaign of these records."""
    criteria = load_criteria("paper-f")
    criteria = replace(criteria, settings={**criteria.settings, "window": window})
    tests = tuple(r.test for r in records)
    return Campaign(
        "staged", datetime.date(2026, 11, 21), Path("campaign.toml"), twin, twin.name, criteria, delay, tests, True, ()
    )
