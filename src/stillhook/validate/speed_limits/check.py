"""Step 3: the winch's velocity limits. Speeds of crane and twin with saturated pumps.

Source: Moslatt 2020 paper F, verification element 3 and criterion 4 ("pump saturation should be tested and evaluated").
Two runs of the twin: its winch driven by the measured commands (pumps, motors, gear, layers, leakage), and the complete
twin on the measured tip motion and joystick (the PLC's limits as well).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.report.document import Table
from stillhook.statistics.block_bootstrap import interval
from stillhook.units import number, show
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import FLAT, FULL, Record
from stillhook.validate.speed_limits.runs import SaturatedPart, saturated_parts

SETTLED = 0.3
"""Start of a saturated span that is not compared [s]: swash plates and pressures still move."""
LEAST = 0.2
"""Shortest remainder that is compared [s]."""
ROW = 2.0  # s of the pieces that the interval is drawn from: longer than anything rings at a plateau
NOTABLE = 0.08  # speed error from which causes are reported
NEAR = 0.95  # of the end: a command within 5 % of it misses it by a difference in feedback alone
APART = 0.02  # of full displacement by which the motors must differ to be named
TO_LOG = "log hoisting and lowering with the joystick beyond the winch's limit, with v_op, u_p, alpha_p and s_w"
LACKS = {
    "driven": "no span with saturated pumps can be repeated: log u_m or alpha_m, and some seconds before it",
    "complete": "the complete twin could not be run on it: log s_tip and v_op",
}
WAYS = {1: "hoisting", -1: "lowering"}


@dataclass(frozen=True)
class Plateau:
    """A saturated span: mean wire speed measured, of the driven and of the complete twin [m/s], NaN where it was not
    run; way 1 hoisting, -1 lowering; samples [first, last) of its part that are compared."""

    part: SaturatedPart
    first: int
    last: int
    way: int
    v_w: float
    driven: float
    complete: float

    @property
    def start(self) -> float:
        return float(self.part.t[self.first])

    @property
    def duration(self) -> float:
        return (self.last - self.first) * self.part.step


@dataclass(frozen=True)
class LimitsStep(Step):
    """Step 3 with what its figures need."""

    parts: tuple[SaturatedPart, ...] = ()
    plateaus: tuple[Plateau, ...] = ()


@dataclass(frozen=True)
class Times:
    """Time that the pumps are at their end [s]: in the log, all of it; and over what the complete twin could be run on:
    in log and twin each, in either, and in one of them while the other is not even near its end (log_alone,
    twin_alone)."""

    log_all: float
    log: float
    twin: float
    either: float
    log_alone: float
    twin_alone: float

    @property
    def overlap(self) -> float | None:
        """Share of the time at an end of either in which the other is there too, or near; None where neither is."""
        return 1.0 - (self.log_alone + self.twin_alone) / self.either if self.either > 0.0 else None


def check_limits(campaign: Campaign, records: tuple[Record, ...], progress: Callable[[float], None]) -> Step:
    """Step 3 of the validation. Measures: saturation_time [s] in the log, limit_speed_error (twin driven by the
    measured commands over the crane, less 1, hoisting and lowering), the same of the complete twin,
    saturation_overlap."""
    parts: list[SaturatedPart] = []
    for i, record in enumerate(records):
        parts += saturated_parts(campaign, record)
        progress((i + 1) / len(records))
    plateaus = [p for part in parts for p in plateaus_of(part)]
    times = times_of(parts)
    causes = _causes(parts, plateaus, times)
    return LimitsStep(
        StepNumber.LIMITS,
        _measures(plateaus, times, causes),
        _statements(parts, plateaus, times, causes),
        (_table(plateaus),),
        _data(plateaus, times),
        tuple(parts),
        tuple(plateaus),
    )


def plateaus_of(part: SaturatedPart) -> list[Plateau]:
    """The saturated spans of a part that are long enough to compare speeds."""
    skip, least, result = round(SETTLED / part.step), max(1, round(LEAST / part.step)), []
    for a, b in part.spans():
        if b - a - skip < least:
            continue
        cut = slice(a + skip, b)
        v_w = float(part.v_w[cut].mean())
        driven = float(part.driven["v_w"][cut].mean())
        complete = float(part.complete["v_w"][cut].mean()) if part.complete is not None else np.nan
        result.append(Plateau(part, a + skip, b, 1 if v_w > 0.0 else -1, v_w, driven, complete))
    return result


def times_of(parts: Sequence[SaturatedPart]) -> Times:
    """Saturation times of the pumps, in log and twin."""
    sums = np.zeros(6)
    for p in parts:
        sums[0] += float(p.saturated.sum()) * p.step
        if p.complete is None or p.twin_saturated is None:
            continue
        requested = np.abs(p.complete["u_raw"])
        log, twin = p.saturated & np.isfinite(requested), p.twin_saturated
        apart = log & (requested < NEAR), twin & ~log & (np.abs(p.signals["u_p"]) < NEAR * p.ends["u_p"])
        sums[1:] += [float(x.sum()) * p.step for x in (log, twin, log | twin, *apart)]
    return Times(*sums.tolist())


def _measures(plateaus: Sequence[Plateau], times: Times, causes: Mapping[str, str]) -> tuple[Measure, ...]:
    nowhere = f"the pumps are never saturated: {TO_LOG}"
    out = [Measure("saturation_time", times.log_all, "time", note=causes.get("ends", ""))]
    if times.log_all == 0.0:
        twin = f"; the twin's are for {times.twin:.1f} s" if times.twin > 0.0 else ""
        out = [Measure("saturation_time", None, "time", note=nowhere + twin)]
    for name, run in (("limit_speed_error", "driven"), ("limit_speed_error_whole", "complete")):
        result = [m for way in WAYS if (m := _speed(name, run, way, plateaus, causes))]
        out += result or [Measure(name, None, note=LACKS[run] if times.log_all > 0.0 else nowhere)]
    overlap, each = times.overlap, f"log {times.log:.1f} s, twin {times.twin:.1f} s"
    none = f"neither the log's nor the twin's pumps are saturated where both are known: {TO_LOG}"
    note = causes.get("overlap") or (none if overlap is None else "")
    return (*out, Measure("saturation_overlap", overlap, data=each, note=note))


def _speed(name: str, run: str, way: int, plateaus: Sequence[Plateau], causes: Mapping[str, str]) -> Measure | None:
    """The speed error of one direction over all its plateaus, each weighing as long as it lasts."""
    same = [p for p in _known(plateaus, run) if p.way == way]
    if not same:
        return None
    rows = np.concatenate([_rows(p, run) for p in same])
    result = interval(lambda x: float(x[:, 1].sum() / x[:, 0].sum() - 1.0), [rows])
    low, high = (x if np.isfinite(x) else None for x in (result.low, result.high))
    plural, seconds = "s" if len(same) > 1 else "", sum(p.duration for p in same)
    data = f"{len(same)} plateau{plural}, {seconds:.1f} s, {show(_mean(same), 'speed')}"
    note = causes.get(run, "") if abs(result.value) > NOTABLE else ""
    return Measure(name, result.value, "", low, high, test=WAYS[way], data=data, note=note)


def _rows(p: Plateau, run: str) -> FloatArray:
    """Wire that ran in pieces of about ROW, measured and simulated: sums of the speeds."""
    series = p.part.driven if run == "driven" else p.part.complete
    assert series is not None
    x = np.column_stack([p.part.v_w, series["v_w"]])[p.first : p.last]
    pieces = np.array_split(x, max(1, round(len(x) * p.part.step / ROW)))
    return np.stack([piece.sum(axis=0) for piece in pieces])


def _mean(plateaus: Sequence[Plateau]) -> float:
    return float(np.average([p.v_w for p in plateaus], weights=[p.duration for p in plateaus]))


def _known(plateaus: Sequence[Plateau], run: str) -> list[Plateau]:
    """The plateaus on which a twin was run."""
    return [p for p in plateaus if np.isfinite(getattr(p, run))]


def _error(plateaus: Sequence[Plateau], run: str) -> float:
    """Speed error over all plateaus of both ways."""
    known = _known(plateaus, run)
    if not known:
        return 0.0
    w = np.array([p.duration for p in known])
    simulated, measured = (np.array([abs(getattr(p, name)) for p in known]) for name in (run, "v_w"))
    return float(w @ simulated / (w @ measured) - 1.0)


def _causes(parts: Sequence[SaturatedPart], plateaus: Sequence[Plateau], times: Times) -> dict[str, str]:
    """What is off, a line each: "ends" (the log stops below full command), "driven", "complete", "overlap"."""
    out: dict[str, str] = {}
    for p in parts:
        for name, text in (("u_p", "the PLC holds the pump command"), ("alpha_p", "the pumps' setting stops")):
            if p.ends.get(name, FULL) < FULL and "ends" not in out:
                out["ends"] = (
                    f"test {p.name}: {text} at {100.0 * (p.ends[name] + FLAT):.3g} % in the log, at 100 % in the twin"
                )
    driven, complete = _error(plateaus, "driven"), _error(plateaus, "complete")
    if abs(driven) > NOTABLE:
        stop = out.get("ends", "") if any(p.ends.get("alpha_p", FULL) < FULL for p in parts) else ""
        out["driven"] = stop or _motors(plateaus) or _faster(driven)
    if abs(complete) > NOTABLE:
        out["complete"] = (
            out.get("ends") or out.get("driven") or f"{_faster(complete)}; or its PLC requests another motion (step 2)"
        )
    if times.log_alone + times.twin_alone > 0.1 * times.either:
        who = ("log", "twin") if times.log_alone > times.twin_alone else ("twin", "log")
        alone = max(times.log_alone, times.twin_alone)
        out["overlap"] = f"the {who[0]}'s pumps are saturated for {alone:.1f} s where the {who[1]}'s are not"
    return out


def _motors(plateaus: Sequence[Plateau]) -> str:
    """Whether the motors have another displacement at the plateaus than the twin's."""
    for p in plateaus:
        log = p.part.signals.get("alpha_m")
        if log is None:
            continue
        a, b = float(log[p.first : p.last].mean()), float(p.part.driven["alpha_m"][p.first : p.last].mean())
        if abs(a - b) > APART:
            return (
                f"test {p.part.name}, from {p.start:.0f} s on: on the same command the motors are at {a:.3f} of their"
                f" displacement in the log, at {b:.3f} in the twin"
            )
    return ""


def _faster(error: float) -> str:
    faster, more, less = ("faster", "more", "less") if error > 0.0 else ("slower", "less", "more")
    return (
        f"the twin is {100.0 * abs(error):.2g} % {faster}: its pumps give {more} or turn {faster}, its motors take"
        f" {less}, or it leaks {less}"
    )


def _statements(
    parts: Sequence[SaturatedPart], plateaus: Sequence[Plateau], times: Times, causes: Mapping[str, str]
) -> tuple[str, ...]:
    out = []
    if times.log_all == 0.0:
        out.append(f"The velocity limits are not shown: the pumps are never saturated. To show them, {TO_LOG}.")
    else:
        tests = ", ".join(dict.fromkeys(p.name for p in parts if p.saturated.any()))
        out.append(f"The crane's pumps are saturated for {times.log_all:.1f} s (test {tests}).")
    for way, name in WAYS.items():
        same = [p for p in plateaus if p.way == way]
        if same:
            out.append(
                f"At saturation it reaches {show(abs(_mean(same)), 'speed')} {name}; the twin driven by its commands"
                f" {_reached(same, 'driven')}, the complete twin {_reached(same, 'complete')}."
            )
        elif times.log_all > 0.0:
            out.append(f"The limit when {name} is not shown.")
    out += [f"Deviation: {text}." for text in dict.fromkeys(causes.values())]
    out += [f"{note[0].upper()}{note[1:]}." for p in parts for note in p.notes]
    return tuple(out)


def _reached(plateaus: Sequence[Plateau], run: str) -> str:
    return f"{_tenths(_error(plateaus, run))} %" if _known(plateaus, run) else "not run"


def _tenths(share: float) -> str:
    return f"{round(100.0 * share, 1) + 0.0:+.1f}"


def _table(plateaus: Sequence[Plateau]) -> Table:
    rows = []
    for p in plateaus:
        errors = (_tenths(x / p.v_w - 1.0) if np.isfinite(x) else "-" for x in (p.driven, p.complete))
        rows.append((p.part.name, f"{p.start:.1f}", f"{p.duration:.1f}", WAYS[p.way], number(60.0 * p.v_w, 4), *errors))
    header = ("test", "from\n[s]", "for\n[s]", "", "wire speed\n[m/min]", "driven\ntwin [%]", "complete\ntwin [%]")
    return Table(header, tuple(rows), "Wire speed with saturated pumps, and deviation of the twin")


def _data(plateaus: Sequence[Plateau], times: Times) -> dict[str, object]:
    return {
        "saturation_time": times.log_all,
        "saturation_time_twin": times.twin,
        "saturation_log_alone": times.log_alone,
        "saturation_twin_alone": times.twin_alone,
        "plateaus": [
            {
                "test": p.part.name,
                "start": p.start,
                "duration": p.duration,
                "v_w": p.v_w,
                "v_w_driven": p.driven if np.isfinite(p.driven) else None,
                "v_w_complete": p.complete if np.isfinite(p.complete) else None,
            }
            for p in plateaus
        ],
    }
