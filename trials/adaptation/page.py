"""What the estimator makes of an independent crane whose friction steps, and of one with faults. Tables from
`trials/adaptation`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from blocks import Blocks

from stillhook.statistics.estimate import Estimate
from trials.adaptation.crane import FAULTS
from trials.adaptation.run import CASES, GROUPS, JUDGED, LATE, LATE_FAULT, SOON, kept
from trials.store import states_of

SCRIPT = "adaptation"

LEAST, MOST = 0.90, 0.98
"""Share of intervals that must hold the truth."""
BIAS, NEAR, WITHIN = 0.003, 0.02, 60.0
"""Largest mean error [-]; how near an estimate must be SOON after the step [-]; time in which it must be found [s]."""
MOMENTS = {"before": "before the step", "soon": f"{SOON:.0f} s after it", "late": f"{LATE:.0f} s after it"}
SCALES = {"loss": "all losses", "system": "system friction"}
PARAMETERS = {
    "leakage": "leakage of the active circuit",
    "gas": "charge of gas",
    "displacement": "displacement above its reading",
    "pump_delay": "delay of the pumps",
}
OFFSETS = {"displacement": (100.0, "% of full", 2), "pump_delay": (1e3, "ms", 2)}
"""Parameters that are no factors: scale, unit and digits that they are shown with; others in parts of the truth."""
FAULT_MOMENTS = {"before": "before its step", "soon": f"{SOON:.0f} s after", "late": f"{LATE_FAULT:.0f} s after"}
FAULTY = ("file-faults", "other-faults")
DAY = 24.0
ENOUGH = 50
"""Runs from which a share or a bias is judged."""
NOT_RUN, TOO_FEW_RUNS = "not run yet", "not judged: too few runs yet"


def of_group(outcomes: Mapping[str, Any], group: str) -> list[dict[str, Any]]:
    """Outcomes of a group, in the order of their seeds."""
    return [outcomes[key] for key, case in CASES.items() if case.group == group and key in outcomes]


def errors(
    runs: Sequence[Mapping[str, Any]], moment: str, scale: str, *, halves: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Errors of a scale at a moment, and halves of the intervals, in parts of the truth; runs without an estimate are
    left out."""
    found = [one[moment] for one in runs if one[moment] is not None]
    return np.array([x[scale] for x in found]), np.array([x[f"{scale}_half"] for x in found] if halves else [])


def shown(name: str, x: float, *, sign: bool = False) -> str:
    """An error or a width of a parameter."""
    if name not in OFFSETS:
        return percent(x, sign=sign)
    scale, unit, digits = OFFSETS[name]
    return f"{scale * x:{'+' if sign else ''}.{digits}f} {unit}".replace("-", "−")


def of_parameter(runs: Sequence[Mapping[str, Any]], name: str, moment: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors and halves of the intervals of a parameter; runs without an estimate are left out."""
    found = np.array([one[name][moment][:2] for one in runs if one[name][moment] is not None]).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def own_alarms(one: Mapping[str, Any], name: str) -> tuple[float, int]:
    """Time from a fault to the alarm of its parameter [s], NaN without one, and how many alarms it has besides."""
    moment = FAULTS[name.replace("_", " ")][0]
    hits = [a[0] - moment for a in one[name]["alarms"] if 0.0 < a[0] - moment < LATE_FAULT]
    return (hits[0] if hits else np.nan), len(one[name]["alarms"]) - bool(hits)


def parameter_claims(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """What becomes of each parameter before and after its step, and whether the step was found."""
    for group in FAULTY:
        runs, text = of_group(outcomes, group), GROUPS[group].text
        for name, meaning in PARAMETERS.items():
            if not runs:
                yield f"{text}: {meaning}", ("90 to 98 of 100", NOT_RUN, NOT_RUN)
                continue
            for moment in ("before", "late"):
                error, half = of_parameter(runs, name, moment)
                share = float(np.mean(np.abs(error) <= half))
                verdict = "held" if LEAST <= share <= MOST else "too few" if share < LEAST else "wider than needed"
                verdict = verdict if len(error) >= ENOUGH else TOO_FEW_RUNS
                ours = f"{shown(name, float(error.mean()), sign=True)}; {held(error, half)}"
                yield f"{text}: {meaning} {FAULT_MOMENTS[moment]}", ("90 to 98 of 100", ours, verdict)
            after = np.array([own_alarms(one, name)[0] for one in runs])
            hits = int(np.sum(after <= WITHIN))
            ours = f"{hits} of {len(runs)}"
            if hits:
                ours += f"; median {np.nanmedian(after):.0f} s, latest {np.nanmax(after):.0f} s"
            verdict = "met" if hits == len(runs) else "not all"
            yield f"{text}: step of the {meaning} found", (f"within {WITHIN:.0f} s", ours, verdict)


def parameter_rows(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row for each group with faults, parameter and moment."""
    for group in FAULTY:
        runs = of_group(outcomes, group)
        for name, meaning in PARAMETERS.items():
            for moment, when in FAULT_MOMENTS.items():
                if not runs:
                    continue
                error, half = of_parameter(runs, name, moment)
                rms, width = float(np.sqrt(np.mean(error**2))), float(np.median(half))
                sizes = shown(name, float(error.mean()), sign=True), shown(name, rms), shown(name, width)
                yield GROUPS[group].text, meaning, when, str(len(error)), *sizes, held(error, half)


def parameter_alarms(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """When faults were found, the rises that were stated, and alarms that no fault of this parameter is behind."""
    for group in FAULTY:
        runs = of_group(outcomes, group)
        for name, meaning in PARAMETERS.items():
            if not runs:
                continue
            each = [own_alarms(one, name) for one in runs]
            after, more = np.array([a for a, _ in each]), sum(n for _, n in each)
            moment = FAULTS[name.replace("_", " ")][0]
            rises = np.array(
                [
                    [one[name]["rise"], *a[2:4]]
                    for one in runs
                    for a in [next((a for a in one[name]["alarms"] if 0.0 < a[0] - moment < LATE_FAULT), None)]
                    if a is not None
                ]
            ).reshape(-1, 3)
            error, known = rises[:, 1] - rises[:, 0], np.isfinite(after)
            times = (f"{np.nanmedian(after):.0f} s", f"{np.nanmax(after):.0f} s") if known.any() else ("–", "–")
            size = shown(name, float(np.sqrt(np.mean(error**2)))) if len(error) else "–"
            kept_in = held(error, rises[:, 2]) if len(error) else "–"
            yield GROUPS[group].text, meaning, f"{int(known.sum())} of {len(runs)}", *times, size, kept_in, str(more)


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
                verdict = f"{near}; {wide}" if len(error) >= ENOUGH else TOO_FEW_RUNS
                yield what, (f"bias below {percent(BIAS, 1)}; 90 to 98 of 100", ours, verdict)
        yield from step_claims(runs, text)
    yield from parameter_claims(outcomes)
    count, hours = false_alarms(outcomes)
    if hours == 0.0:
        yield "false alarms", ("at most 1 in 24 h", NOT_RUN, NOT_RUN)
    else:
        verdict = "met" if count * DAY / hours <= 1.0 else "not met"
        verdict = verdict if hours >= DAY else TOO_FEW_RUNS
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
    error, _ = errors(runs, "late", "loss_all", halves=False)
    what = "all losses, over all moments that slide, weak half waves too"
    yield f"{text}: {what}", ("–", f"{percent(float(error.mean()), sign=True)} {MOMENTS['late']}", "for information")
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


def other_alarms(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Alarms of the parameters where nothing of theirs stepped."""
    quiet = of_group(outcomes, "quiet")
    stepped = [*of_group(outcomes, "file-step"), *of_group(outcomes, "other-step")]
    hours = sum(one["hours"] for one in quiet)
    for name, meaning in {**PARAMETERS, "motor_delay": "delay of the motors"}.items():
        counts = [sum(len(one["others"].get(name, ())) for one in runs) for runs in (quiet, stepped)]
        yield meaning, f"{counts[0]} in {hours:.0f} h" if quiet else NOT_RUN, f"{counts[1]} in {len(stepped)} runs"


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
        "parameters": parameter_rows(outcomes),
        "faults": parameter_alarms(outcomes),
        "others": other_alarms(outcomes),
    }, None
