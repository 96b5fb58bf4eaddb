"""What the friction estimator makes of an independent crane whose friction steps. Tables from `trials/adaptation`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from blocks import Blocks

from stillhook.statistics.estimate import Estimate
from trials.adaptation.run import CASES, GROUPS, JUDGED, LATE, SOON, kept
from trials.store import states_of

SCRIPT = "adaptation"

LEAST, MOST = 0.90, 0.98
"""Share of intervals that must hold the truth."""
BIAS, NEAR, WITHIN = 0.003, 0.02, 60.0
"""Largest mean error [-]; how near an estimate must be SOON after the step [-]; time in which it must be found [s]."""
MOMENTS = {"before": "before the step", "soon": f"{SOON:.0f} s after it", "late": f"{LATE:.0f} s after it"}
SCALES = {"loss": "all losses", "system": "system friction"}
DAY = 24.0
NOT_RUN = "not run yet"


def of_group(outcomes: Mapping[str, Any], group: str) -> list[dict[str, Any]]:
    """Outcomes of a group, in the order of their seeds."""
    return [outcomes[key] for key, case in CASES.items() if case.group == group and key in outcomes]


def errors(runs: Sequence[Mapping[str, Any]], moment: str, scale: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors of a scale at a moment, and halves of the intervals, in parts of the truth; runs without an estimate are
    left out."""
    found = [one[moment] for one in runs if one[moment] is not None]
    return np.array([x[scale] for x in found]), np.array([x[f"{scale}_half"] for x in found])


def percent(x: float, digits: int = 2, *, sign: bool = False) -> str:
    """A part as a percentage."""
    return f"{100.0 * x:{'+' if sign else ''}.{digits}f} %".replace("-", "−")


def held(error: np.ndarray, half: np.ndarray) -> str:
    """How many intervals hold the truth, with Wilson's interval of that share."""
    hits, n = int(np.sum(np.abs(error) <= half)), len(error)
    share = Estimate.of_share(hits, n)
    return f"{hits} of {n} ({100.0 * share.low:.0f} to {100.0 * share.high:.0f} %)"


def found_after(runs: Sequence[Mapping[str, Any]]) -> np.ndarray:
    """Time from the step to its alarm [s], NaN where there is none within the run."""
    return np.array([next((a[0] for a in one["alarms"] if a[0] > 0.0), np.nan) for one in runs])


def false_alarms(outcomes: Mapping[str, Any]) -> tuple[int, float]:
    """Alarms without a step, and the hours in which they could have been."""
    quiet = of_group(outcomes, "quiet")
    return sum(len(one["alarms"]) for one in quiet), sum(one["hours"] for one in quiet)


def claims(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """Claim, and theirs, ours and verdict, of the group that the issue is about; of the other law its intervals."""
    for group in ("file-step", "other-step"):
        runs, text = of_group(outcomes, group), GROUPS[group].text
        for scale, name in SCALES.items():
            for moment, when in MOMENTS.items():
                what = f"{text}: {name} {when}"
                if not runs:
                    yield what, (f"bias below {percent(BIAS, 1)}; 90 to 98 of 100", NOT_RUN, NOT_RUN)
                    continue
                error, half = errors(runs, moment, scale)
                bias, u = float(error.mean()), float(error.std(ddof=1) / np.sqrt(len(error)))
                share = float(np.mean(np.abs(error) <= half))
                wide = (
                    "held" if LEAST <= share <= MOST else "too few" if share < LEAST else "too many: wider than needed"
                )
                near = "bias met" if abs(bias) < BIAS else "bias too large"
                ours = f"{percent(bias, sign=True)} ± {percent(1.96 * u)}; {held(error, half)}"
                yield what, (f"bias below {percent(BIAS, 1)}; 90 to 98 of 100", ours, f"{near}; {wide}")
        yield from step_claims(runs, text)
    count, hours = false_alarms(outcomes)
    if hours == 0.0:
        yield "false alarms", ("at most 1 in 24 h", NOT_RUN, NOT_RUN)
    else:
        verdict = "met" if count * DAY / hours <= 1.0 else "not met"
        yield "false alarms", ("at most 1 in 24 h", f"{count} in {hours:.0f} h", verdict)


def step_claims(runs: Sequence[Mapping[str, Any]], text: str) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """When the step was found, and how near the estimates are soon after."""
    if not runs:
        return
    after = found_after(runs)
    hits, n = int(np.sum(after <= WITHIN)), len(runs)
    ours = f"{hits} of {n}; median {np.nanmedian(after):.0f} s, latest {np.nanmax(after):.0f} s"
    yield f"{text}: step of +30 % found", (f"within {WITHIN:.0f} s", ours, "met" if hits == n else "not all")
    for scale, name in SCALES.items():
        error, _ = errors(runs, "soon", scale)
        hits = int(np.sum(np.abs(error) < NEAR))
        none = n - len(error)
        ours = f"{hits} of {n}" + (f"; {none} without an estimate yet" if none else "")
        off = n - hits - none
        verdict = "met" if hits == n else "not all: accuracy of the sensors" if off else "not all: too few half waves"
        yield f"{text}: {name} to {percent(NEAR, 0)}", (f"by {SOON:.0f} s", ours, verdict)
    rises = np.array([[one["rise"], *one["alarms"][-1][2:]] for one in runs if one["alarms"]])
    error = rises[:, 1] - rises[:, 0]
    ours = f"{percent(float(error.mean()), sign=True)}, rms {percent(float(np.sqrt(np.mean(error**2))))}"
    ours += f"; interval holds it in {held(error, rises[:, 2])}"
    yield f"{text}: rise that the alarm states, less the true one", ("–", ours, "for information")


def rows(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row for each group, moment and scale."""
    for name, group in GROUPS.items():
        runs = of_group(outcomes, name) if group.step else []
        for scale, of in SCALES.items():
            for moment, when in MOMENTS.items():
                if not runs:
                    continue
                error, half = errors(runs, moment, scale)
                rms = float(np.sqrt(np.mean(error**2)))
                widths = percent(float(np.median(half)))
                bias = percent(float(error.mean()), sign=True)
                yield group.text, of, when, str(len(error)), bias, percent(rms), widths, held(error, half)


def alarms(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """When steps were found, and alarms before them."""
    for name, group in GROUPS.items():
        runs = of_group(outcomes, name) if group.step else []
        if not runs:
            continue
        after, early = found_after(runs), sum(a[0] < 0.0 for one in runs for a in one["alarms"])
        more = sum(sum(a[0] > 0.0 for a in one["alarms"]) - 1 for one in runs if one["alarms"])
        some = np.isfinite(after).any()
        times = (f"{np.nanmedian(after):.0f} s", f"{np.nanmax(after):.0f} s") if some else ("–", "–")
        yield group.text, f"{int(np.isfinite(after).sum())} of {len(runs)}", *times, str(early), str(max(more, 0))


def clocks(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Error of the clock's offset that was found."""
    for name, group in GROUPS.items():
        runs = of_group(outcomes, name) if group.step else []
        found = np.array([one["before"]["clock"] for one in runs if one["before"] is not None])
        if len(found):
            size = f"{1e3 * float(np.sqrt(np.mean(found**2))):.1f} ms", f"{1e3 * float(np.abs(found).max()):.1f} ms"
            yield group.text, str(len(found)), *size


def compute() -> tuple[Blocks, None]:
    """Blocks of the page."""
    outcomes = kept()
    count, hours = false_alarms(outcomes)
    return {
        "claims": dict(claims(outcomes)),
        "code": {"outcomes": outcomes, "states": states_of(outcomes), "first": JUDGED, "hours": hours, "count": count},
        "estimates": rows(outcomes),
        "alarms": alarms(outcomes),
        "clocks": clocks(outcomes),
    }, None
