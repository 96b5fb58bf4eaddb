"""What level 4 leaves over on cranes, seas and campaigns that it has not seen, kept in outcomes.json, which the page is
made from.

    python -m trials.residual.run            run what is not in the file yet, in a single process
    python -m trials.residual.run --new      run also what was computed by other code

It may be stopped at any time: outcomes are in the file, samples of logs in a temporary folder of this machine. Then
`python docs/validation/make.py residual` writes the page. Cranes below JUDGED were looked at while the model was
written; no outcome of those from JUDGED on was.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.library import load_crane
from stillhook.live.residual.fit import Fitted, applied, choose, hold_out, interval, learn
from stillhook.live.residual.logs import FEWEST as FEWEST_SAMPLES
from stillhook.live.residual.proof import FEWEST
from stillhook.live.residual.samples import BIN, Samples
from stillhook.live.residual.terms import Scales
from trials import store
from trials.adaptation.crane import CRANE_FILE
from trials.adaptation.plant import FILE_FORM, OTHER_FORM
from trials.residual.crane import Session
from trials.residual.logs import SampledLog, sampled
from trials.residual.logs import code as samples_code

STORE = Path(__file__).resolve().parent / "outcomes.json"
JUDGED = 100
"""First crane that the model is judged on."""
CRANES = {OTHER_FORM: 20, FILE_FORM: 12}
"""Cranes of each form of the friction law."""
SEAS = 2
"""Logs of a crane's first campaign, each in its own sea with its own load and wire."""
SCALES = Scales.of(load_crane(CRANE_FILE))


class Split(NamedTuple):
    """What is held out. text for the page; form of the law of the cranes that are judged, and of those that are learned
    from; folds; cranes that are learned from at most."""

    text: str
    form: float = OTHER_FORM
    learned: float = OTHER_FORM
    folds: int = 10
    most: int = 99


SPLITS: Mapping[str, Split] = {
    "crane": Split("another crane, another sea"),
    "sea": Split("the same crane, another sea", folds=5),
    "campaign": Split("the same crane, a later campaign and another sea: worn by 20 %, oil 4 K warmer", folds=1),
    "time": Split("time alone: second half of each log", folds=1),
    "crane-few": Split("another crane, another sea; learned from 5 cranes", folds=5, most=5),
    "file": Split("another crane, another sea; the law is the crane file's", FILE_FORM, FILE_FORM, 6),
    "foreign": Split("learned from cranes of the other law, used where the law is the file's", FILE_FORM, folds=1),
}


class Case(NamedTuple):
    """One fold of a split."""

    split: str
    fold: int

    @property
    def key(self) -> str:
        return f"{self.split}/{self.fold}"


CASES: Mapping[str, Case] = {c.key: c for name, s in SPLITS.items() for k in range(s.folds) for c in [Case(name, k)]}


def of_crane(crane: int, form: float) -> list[SampledLog]:
    """The logs of its first campaign."""
    return [sampled(Session(crane, 0, sea, form)) for sea in range(SEAS)]


def later(crane: int, form: float) -> SampledLog:
    """The log of its later campaign."""
    return sampled(Session(crane, 1, SEAS + 1, form, later=True))


def halves(log: SampledLog) -> tuple[SampledLog, SampledLog]:
    """First and second half."""
    n = len(log.truth) // 2
    return tuple(  # type: ignore[return-value]
        log._replace(log=log.log._replace(samples=Samples(*(c[part] for c in log.log.samples))), truth=log.truth[part])
        for part in (slice(None, n), slice(n, None))
    )


def divided(case: Case) -> tuple[list[SampledLog], list[SampledLog]]:
    """What is learned from, and what is judged; no sea is in both, but for time alone."""
    split = SPLITS[case.split]
    cranes = [JUDGED + i for i in range(CRANES[split.form])]
    test_of = cranes[case.fold :: split.folds]
    if case.split == "time":
        pairs = [halves(log) for crane in cranes for log in of_crane(crane, split.form)]
        return [a for a, _ in pairs], [b for _, b in pairs]
    if case.split == "foreign":
        test = [log for crane in cranes for log in of_crane(crane, split.form)]
        rest = [log for i in range(CRANES[split.learned]) for log in of_crane(JUDGED + i, split.learned)]
        return rest, test  # the friction is foreign: that seas are not is of no use to it
    if case.split == "campaign":
        test = [later(crane, split.form) for crane in cranes]
        rest = [log for crane in cranes for log in of_crane(crane, split.form)]
        return rest, test  # seas are drawn anew; leaving all out that are alike would leave nothing
    if case.split == "sea":
        test = [of_crane(crane, split.form)[1] for crane in test_of]
        rest = [log for crane in cranes for log in of_crane(crane, split.form)[: 1 if crane in test_of else SEAS]]
    else:
        test = [log for crane in test_of for log in of_crane(crane, split.form)]
        rest = [log for crane in cranes if crane not in test_of for log in of_crane(crane, split.form)]
        rest = rest[: SEAS * split.most]
    seas = [log.log.sea for log in test]
    return [log for log in rest if not any(log.log.sea.alike(sea) for sea in seas)], test


def rms(x: np.ndarray) -> float:
    """Root mean square."""
    return round(float(np.sqrt(np.mean(x**2))), 3)


def of_log(fitted: Fitted, log: SampledLog, half: float, first: int) -> dict[str, Any]:
    """A log that was not learned from: what adaptation, the linear part, all of the model, and all of it without any
    veto leave over, as measured and in truth, from sample `first` on [N m]; parts of the samples outside of what was
    seen, without a correction, and of those seen that the interval holds."""
    x = log.log.samples
    torque, inside, used = applied(fitted, x)
    counted = slice(first, None)
    corrections = {
        "adapted": np.zeros(len(x.t)),
        "linear": used * fitted.linear(x),
        "learned": used * torque,
        "always": torque,
    }
    both = {"measured": x.left, "true": log.truth}
    out: dict[str, Any] = {
        name: {part: rms((y - c)[counted]) for part, c in corrections.items()} for name, y in both.items()
    }
    error = np.abs(x.left - torque)[inside]
    out["outside"], out["without"] = round(1.0 - float(inside.mean()), 3), round(1.0 - float(used[counted].mean()), 3)
    out["held"] = round(float(np.mean(error <= half)), 4) if len(error) else None
    return out


def outcome(case: Case) -> dict[str, Any]:
    """A fold: settings that were chosen within what is learned from, and every log that is judged."""
    rest, test = divided(case)
    logs = [log.log for log in rest]
    if case.split == "time":  # halves of one campaign: their settings are chosen as for all others
        logs = [log.log._replace(campaign=log.log.name) for log in rest]
    penalty, count = choose(logs, SCALES)
    fitted = learn([log.samples for log in logs], SCALES, penalty, count)
    confidence, half = (
        interval(hold_out(logs, SCALES, (penalty, count))) if case.split in ("crane", "file") else (0.0, 0.0)
    )
    first = 0 if case.split == "time" else round(FEWEST / BIN)  # what proves the model; halves are too short for it
    test = [log for log in test if case.split == "time" or len(log.truth) >= FEWEST_SAMPLES]
    judged = {f"{log.log.campaign}/{log.session.sea}": of_log(fitted, log, half, first) for log in test}
    chosen = {"penalty": penalty, "trees": count, "logs": len(rest), "cranes": len({log.session.crane for log in rest})}
    terms = [round(float(b), 2) for b in fitted.coefficients], [round(float(u), 2) for u in fitted.errors]
    return {**chosen, "terms": terms, "confidence": round(confidence, 3), "half": round(half, 2), "judged": judged}


def kept() -> dict[str, Any]:
    """Outcomes by key, each with the code that it was computed by."""
    return store.read(STORE)


def code() -> str:
    """The code that computes: samples, and the model."""
    import stillhook

    folder = Path(stillhook.__file__).parent / "live/residual"
    files = [folder / f"{n}.py" for n in ("fit", "proof", "seen", "terms", "trees")]
    files.append(STORE.with_name("run.py"))
    return sha256(samples_code().encode() + b"".join(f.read_bytes() for f in files)).hexdigest()[:16]


if __name__ == "__main__":
    store.run(STORE, CASES, outcome, code(), sys.argv[1:], group=lambda key: key.partition("/")[0], workers=1)
