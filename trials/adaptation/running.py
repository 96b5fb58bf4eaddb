"""The running twin that follows an independent crane whose friction steps: observer and adaptation of
`stillhook.live.observer` on its stream of measured values, without processes, kept in running.json.

    python -m trials.adaptation.running        run what is not in the file yet, in a single process

The crane carries a certificate that was made up for the trial, with an envelope that holds all of its conditions: what
is tried is what follows from a certificate, not the certificate. Seeds from FIRST on were not looked at before.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import stillhook
from stillhook.control.registry import mode_of_code
from stillhook.kernels.build import results_hash
from stillhook.library import load_crane
from stillhook.live.observer.adaptation import Adaptation
from stillhook.live.observer.observer import FACTOR, Observer, Task
from stillhook.live.observer.settings import AdaptSettings, ObserverSettings
from stillhook.live.runtime.board import STATUS
from stillhook.spec.crane import Crane, content
from stillhook.spec.validity import Certified
from stillhook.trust.keys import new_key
from stillhook.trust.signature import Signed, sign
from stillhook.trust.trust_list import TrustedKey, TrustList
from trials import store
from trials.adaptation.crane import CRANE_FILE, Trial, simulate
from trials.adaptation.plant import FILE_FORM, OTHER_FORM
from trials.independent_crane.sea_trial import CYCLE

STORE = Path(__file__).resolve().parent / "running.json"
FIRST, RUNS = 1400, 6
"""Seeds of each form of the friction law."""
ENVELOPE = {
    "load": ["30 t", "170 t"],
    "s_w": ["200 m", "2400 m"],
    "s_tip_pp": ["0.5 m", "3.5 m"],
    "period": ["5 s", "14 s"],
    "modes": ["ns", "ssc"],
}
EVERY = 5
"""Cycles from message to message: 20 Hz."""
LOOK = 20
"""Cycles between two looks of the observer: 0.2 s."""
AHEAD = 3.0 * 3600.0
"""What the sender's clock is off [s]."""
DELAY = (0.003, 0.03)
"""Delay of a message, drawn evenly [s]."""
WINDOWS: Mapping[str, tuple[float, float]] = {"before": (-200.0, -5.0), "after": (5.0, 60.0), "late": (150.0, 400.0)}
"""Parts over which deviations are taken, from the step [s]."""
COMPARED = ("p_a", "p_b", "u_p")
"""What is compared on one clock."""


class Case(NamedTuple):
    """A seed, the form of the law, and whether the twin follows."""

    seed: int
    form: float
    adapts: bool

    @property
    def key(self) -> str:
        law = "other" if self.form == OTHER_FORM else "file"
        return f"{law}-{'adapted' if self.adapts else 'as-filed'}/{self.seed}"


CASES = {
    case.key: case
    for form in (FILE_FORM, OTHER_FORM)
    for i in range(RUNS)
    for adapts in (True, False)
    for case in [Case(FIRST + i, form, adapts)]
}


def certified(crane: Crane) -> Crane:
    """The crane with a certificate as if of real logs, signed by a key that is trusted."""
    record = Certified.of(
        digest="0" * 64,
        date="2026-11-28",
        criteria="paper-f version 1",
        passed=True,
        synthetic=False,
        level=2,
        variant=2,
        version="0",
        code=results_hash(),
        content=content(crane),
        envelope=ENVELOPE,
    )
    key = new_key("Trial")
    record = record.model_copy(update={"signature": sign(Signed.CERTIFICATE, record.statement, key).to_dict()})
    trust = TrustList(Path("trust.toml"), (TrustedKey(key.name, key.public),))
    return crane.model_copy(update={"certified": record.judged(trust)})


def outcome(case: Case) -> dict[str, Any]:
    """What twin and observer make of a run; times from the step [s]."""
    run = simulate(Trial(case.seed, case.form))
    x, at, crane = run.rows, run.t_step, certified(load_crane(CRANE_FILE))
    mode = mode_of_code(float(x["mode"][0]))
    scenario = stillhook.Scenario(
        load=f"{run.conditions['load']!r} kg", s_w=f"{float(x['s_w'][0])!r} m", tip="still", mode=mode
    )
    session = stillhook.Session(crane, scenario)
    signals = tuple(name for name in ObserverSettings().signals if name in x and name != "v_w")
    names = (*STATUS, *session.signals, FACTOR)
    events: list[tuple[float, str, str]] = []
    begin = 1.0e9
    observer = Observer(
        Task(crane, names, ObserverSettings(signals)), begin, lambda n, text, v: events.append((t, n, text))
    )
    adaptation = Adaptation(AdaptSettings(), 1.0, begin) if case.adapts else None
    rng = np.random.default_rng(case.seed)
    row = np.zeros(len(names))
    time_at, twin, factors = list(STATUS).index("time_utc"), {n: [] for n in COMPARED}, []
    for i in range(len(x["time"])):
        t = i * CYCLE
        session.step({n: float(x[n][i]) for n in ("s_tip", "v_tip", "a_tip")})
        row[time_at] = begin + t - CYCLE  # when the cycle began
        row[len(STATUS) :] = [session.get(n) for n in names[len(STATUS) :]]
        observer.see(row.copy())
        for n in COMPARED:
            twin[n].append(session.get(n))
        factors.append(session.get(FACTOR))
        if i % EVERY == 0:
            values = {n: float(x[n][i]) for n in (*signals, "s_tip", "v_tip", "a_tip", "mode")}
            observer.hear(begin + t + rng.uniform(*DELAY), begin + t + AHEAD, values)
        if i % LOOK == 0:
            observer.advance(begin + t)
            if adaptation is not None and (change := adaptation.next(observer.proposal, begin + t)) is not None:
                session.set(FACTOR, change.new)
                events.append((t, "adapted", change.text))
    found: dict[str, Any] = {"scale": [round(s, 4) for s in run.scale]}
    time = x["time"] - at
    apart = {n: x[n] - np.array(twin[n]) for n in COMPARED}
    apart["dp"] = apart["p_a"] - apart["p_b"]
    for name, (first, last) in WINDOWS.items():
        part = (time >= first) & (time < last)
        rms = {n: float(np.sqrt(np.mean(d[part] ** 2))) for n, d in apart.items()}
        found[name] = {n: float(f"{v:.4g}") for n, v in rms.items()}
    found["factor"] = {n: round(factors[np.searchsorted(time, b) - 1], 4) for n, (_, b) in WINDOWS.items()}
    shown = ("alarm", "alarm-over", "unit", "clock", "lost", "encoder-clock")
    found["events"] = [[round(t - at, 1), n, text] for t, n, text in events if n in shown]
    found["changes"] = [[round(t - at, 1), text] for t, n, text in events if n == "adapted"]
    return found


def code() -> str:
    """The code that computes."""
    root = STORE.parents[2]
    files = [
        *sorted((root / "src/stillhook/live/estimate").glob("*.py")),
        *sorted((root / "src/stillhook/live/observer").glob("*.py")),
        *sorted((root / "src/stillhook/live/watch").glob("*.py")),
        *(STORE.parent / f"{n}.py" for n in ("crane", "plant", "running")),
    ]
    return sha256(b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


if __name__ == "__main__":
    store.run(STORE, CASES, outcome, code(), sys.argv[1:], group=lambda key: key.partition("/")[0], workers=1)
