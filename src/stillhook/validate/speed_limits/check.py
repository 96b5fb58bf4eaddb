"""Step 3: the winch's velocity limits. What the crane reaches with its pumps at their end, and what the twin reaches
there.

Source: Moslatt 2020 paper F, verification element 3 and criterion 4 ("pump saturation should be tested and evaluated").
Two runs of the twin: its winch driven by the measured commands (pumps, motors, gear, layers, leakage), and the whole
twin on the measured tip motion and joystick (the PLC's limits as well).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.statistics.block_bootstrap import interval
from stillhook.units import number, show
from stillhook.validate.criteria.results import Measure, Step, StepNumber, Table
from stillhook.validate.data_set.campaign import Campaign
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.data_set.records.saturation import FLAT, FULL
from stillhook.validate.speed_limits.runs import Limited, limited

SETTLED = 0.3
"""Start of a saturated stretch that is not compared [s]: swash plates and pressures still move."""
LEAST = 0.2
"""Shortest rest of it that is compared [s]."""
ROW = 2.0  # s of the pieces that the interval is drawn from: longer than anything rings at a plateau
TOLD = 0.08  # speed error from which causes are looked for
NEAR = 0.95  # of the end: a command within 5 % of it misses it by a difference in feedback alone
APART = 0.02  # of full displacement by which the motors must differ to be named
TO_LOG = "log hoisting and lowering with the joystick beyond what the winch can, and v_op, u_p, alpha_p, s_w with it"
LACKS = {
    "driven": "no stretch at the pumps' end can be repeated: log u_m or alpha_m, and some seconds before it",
    "whole": "the whole twin could not be run on it: log s_tip and v_op",
}
WAYS = {1: "hoisting", -1: "lowering"}


@dataclass(frozen=True)
class Plateau:
    """A saturated stretch: mean wire speed measured, of the driven and of the whole twin [m/s], NaN where it was not
    run; way 1 hoisting, -1 lowering; samples [first, last) of its part that are compared."""

    part: Limited
    first: int
    last: int
    way: int
    v_w: float
    driven: float
    whole: float

    @property
    def start(self) -> float:
        return float(self.part.t[self.first])

    @property
    def duration(self) -> float:
        return (self.last - self.first) * self.part.step


@dataclass(frozen=True)
class LimitsStep(Step):
    """Step 3 with what its figures need."""

    parts: tuple[Limited, ...] = ()
    plateaus: tuple[Plateau, ...] = ()


@dataclass(frozen=True)
class Times:
    """Time that the pumps are at their end [s]: in the log, all of it; and over what the whole twin could be run on: in
    log and twin each, in either, and in one of them while the other is not even near its end (log_alone,
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
    measured commands over the crane, less 1, hoisting and lowering), the same of the whole twin, saturation_overlap."""
    parts: list[Limited] = []
    for i, record in enumerate(records):
        parts += limited(campaign, record)
        progress((i + 1) / len(records))
    plateaus = [p for part in parts for p in plateaus_of(part)]
    times = times_of(parts)
    why = _causes(parts, plateaus, times)
    return LimitsStep(
        StepNumber.LIMITS,
        _measures(plateaus, times, why),
        _statements(parts, plateaus, times, why),
        (_table(plateaus),),
        _data(plateaus, times),
        tuple(parts),
        tuple(plateaus),
    )


def plateaus_of(part: Limited) -> list[Plateau]:
    """The saturated stretches of a part that last long enough for their speeds to be compared."""
    skip, least, found = round(SETTLED / part.step), max(1, round(LEAST / part.step)), []
    for a, b in part.stretches():
        if b - a - skip < least:
            continue
        cut = slice(a + skip, b)
        v_w = float(part.v_w[cut].mean())
        driven = float(part.driven["v_w"][cut].mean())
        whole = float(part.whole["v_w"][cut].mean()) if part.whole is not None else np.nan
        found.append(Plateau(part, a + skip, b, 1 if v_w > 0.0 else -1, v_w, driven, whole))
    return found


def times_of(parts: Sequence[Limited]) -> Times:
    """How long the pumps are at their end, in log and twin."""
    sums = np.zeros(6)
    for p in parts:
        sums[0] += float(p.saturated.sum()) * p.step
        if p.whole is None or p.twin_saturated is None:
            continue
        asked = np.abs(p.whole["u_raw"])
        log, twin = p.saturated & np.isfinite(asked), p.twin_saturated
        apart = log & (asked < NEAR), twin & ~log & (np.abs(p.signals["u_p"]) < NEAR * p.ends["u_p"])
        sums[1:] += [float(x.sum()) * p.step for x in (log, twin, log | twin, *apart)]
    return Times(*sums.tolist())


def _measures(plateaus: Sequence[Plateau], times: Times, why: Mapping[str, str]) -> tuple[Measure, ...]:
    nowhere = f"the pumps are nowhere at their end: {TO_LOG}"
    out = [Measure("saturation_time", times.log_all, "time", note=why.get("ends", ""))]
    if times.log_all == 0.0:
        seen = f"; the twin's are for {times.twin:.1f} s" if times.twin > 0.0 else ""
        out = [Measure("saturation_time", None, "time", note=nowhere + seen)]
    for name, run in (("limit_speed_error", "driven"), ("limit_speed_error_whole", "whole")):
        found = [m for way in WAYS if (m := _speed(name, run, way, plateaus, why))]
        out += found or [Measure(name, None, note=LACKS[run] if times.log_all > 0.0 else nowhere)]
    overlap, each = times.overlap, f"log {times.log:.1f} s, twin {times.twin:.1f} s"
    out.append(Measure("saturation_overlap", overlap, data=each, note=why.get("overlap", "") or _none(overlap)))
    return tuple(out)


def _none(overlap: float | None) -> str:
    return (
        f"neither the log's pumps nor the twin's are at their end where both are known: {TO_LOG}"
        if overlap is None
        else ""
    )


def _speed(name: str, run: str, way: int, plateaus: Sequence[Plateau], why: Mapping[str, str]) -> Measure | None:
    """The speed error of one direction over all its plateaus, each weighing as long as it lasts."""
    mine = [p for p in plateaus if p.way == way and np.isfinite(getattr(p, run))]
    if not mine:
        return None
    rows = np.concatenate([_rows(p, run) for p in mine])
    found = interval(lambda x: float(x[:, 1].sum() / x[:, 0].sum() - 1.0), [rows])
    low, high = (x if np.isfinite(x) else None for x in (found.low, found.high))
    data = (
        f"{len(mine)} plateau{'s' if len(mine) > 1 else ''}, {sum(p.duration for p in mine):.1f} s,"
        f" {show(_mean(mine), 'speed')}"
    )
    note = why.get(run, "") if abs(found.value) > TOLD else ""
    return Measure(name, found.value, "", low, high, test=WAYS[way], data=data, note=note)


def _rows(p: Plateau, run: str) -> FloatArray:
    """Wire that ran in pieces of about ROW, measured and simulated: sums of the speeds."""
    series = p.part.driven if run == "driven" else p.part.whole
    assert series is not None
    x = np.column_stack([p.part.v_w, series["v_w"]])[p.first : p.last]
    pieces = np.array_split(x, max(1, round(len(x) * p.part.step / ROW)))
    return np.stack([piece.sum(axis=0) for piece in pieces])


def _mean(plateaus: Sequence[Plateau]) -> float:
    return float(np.average([p.v_w for p in plateaus], weights=[p.duration for p in plateaus]))


def _error(plateaus: Sequence[Plateau], run: str) -> float:
    """Speed error over all plateaus of both ways."""
    known = [p for p in plateaus if np.isfinite(getattr(p, run))]
    if not known:
        return 0.0
    w = np.array([p.duration for p in known])
    return float(
        w @ np.array([abs(getattr(p, run)) for p in known]) / (w @ np.array([abs(p.v_w) for p in known])) - 1.0
    )


def _causes(parts: Sequence[Limited], plateaus: Sequence[Plateau], times: Times) -> dict[str, str]:
    """What is off, a line each: "ends" (the log stops below full command), "driven", "whole", "overlap"."""
    out: dict[str, str] = {}
    for p in parts:
        for name, what in (("u_p", "the PLC holds the pump command"), ("alpha_p", "the pumps' setting stops")):
            if p.ends.get(name, FULL) < FULL and "ends" not in out:
                out["ends"] = (
                    f"test {p.name}: {what} at {100.0 * (p.ends[name] + FLAT):.3g} % in the log, at 100 % in the twin"
                )
    driven, whole = _error(plateaus, "driven"), _error(plateaus, "whole")
    if abs(driven) > TOLD:
        stop = out.get("ends", "") if any(p.ends.get("alpha_p", FULL) < FULL for p in parts) else ""
        out["driven"] = stop or _motors(plateaus) or _faster(driven)
    if abs(whole) > TOLD:
        out["whole"] = (
            out.get("ends") or out.get("driven") or f"{_faster(whole)}; or its PLC asks for something else (step 2)"
        )
    if times.log_alone + times.twin_alone > 0.1 * times.either:
        who = ("log", "twin") if times.log_alone > times.twin_alone else ("twin", "log")
        alone = max(times.log_alone, times.twin_alone)
        out["overlap"] = f"the {who[0]}'s pumps are at their end for {alone:.1f} s where the {who[1]}'s are not"
    return out


def _motors(plateaus: Sequence[Plateau]) -> str:
    """Whether the motors stand elsewhere at the plateaus than the twin's."""
    for p in plateaus:
        log = p.part.signals.get("alpha_m")
        if log is None:
            continue
        a, b = float(log[p.first : p.last].mean()), float(p.part.driven["alpha_m"][p.first : p.last].mean())
        if abs(a - b) > APART:
            where = f"test {p.part.name}, from {p.start:.0f} s on"
            return (
                f"{where}: on the same command the motors stand at {a:.3f} of their displacement in the log, at {b:.3f}"
                " in the twin"
            )
    return ""


def _faster(error: float) -> str:
    if error > 0.0:
        return (
            f"the twin is {100.0 * error:.2g} % faster: its pumps give more or turn faster, its motors take less, or it"
            " leaks less"
        )
    return (
        f"the twin is {-100.0 * error:.2g} % slower: its pumps give less or turn slower, its motors take more, or it"
        " leaks more"
    )


def _statements(
    parts: Sequence[Limited], plateaus: Sequence[Plateau], times: Times, why: Mapping[str, str]
) -> tuple[str, ...]:
    out = []
    if times.log_all == 0.0:
        out.append(f"The velocity limits are not shown: the pumps are nowhere at their end. To show them, {TO_LOG}.")
    else:
        tests = ", ".join(dict.fromkeys(p.name for p in parts if p.saturated.any()))
        out.append(f"The crane's pumps are at their end for {times.log_all:.1f} s (test {tests}).")
    for way, name in WAYS.items():
        mine = [p for p in plateaus if p.way == way]
        if mine:
            speed, driven, whole = show(abs(_mean(mine)), "speed"), _reached(mine, "driven"), _reached(mine, "whole")
            out.append(
                f"There it reaches {speed} {name}; the twin driven by its commands {driven}, the whole twin {whole}."
            )
        elif times.log_all > 0.0:
            out.append(f"The limit when {name} is not shown.")
    out += [f"Off: {text}." for text in dict.fromkeys(why.values())]
    out += [f"{note[0].upper()}{note[1:]}." for p in parts for note in p.notes]
    return tuple(out)


def _reached(plateaus: Sequence[Plateau], run: str) -> str:
    known = [p for p in plateaus if np.isfinite(getattr(p, run))]
    if not known:
        return "not run"
    return f"{_tenths(_error(known, run))} %"


def _tenths(share: float) -> str:
    return f"{round(100.0 * share, 1) + 0.0:+.1f}"


def _table(plateaus: Sequence[Plateau]) -> Table:
    rows = []
    for p in plateaus:
        errors = (_tenths(x / p.v_w - 1.0) if np.isfinite(x) else "-" for x in (p.driven, p.whole))
        rows.append((p.part.name, f"{p.start:.1f}", f"{p.duration:.1f}", WAYS[p.way], number(60.0 * p.v_w, 4), *errors))
    header = ("test", "from\n[s]", "for\n[s]", "", "wire speed\n[m/min]", "driven\ntwin [%]", "whole\ntwin [%]")
    return Table("Wire speed with the pumps at their end, and the twin's off it", header, tuple(rows))


def _data(plateaus: Sequence[Plateau], times: Times) -> dict[str, object]:
    def or_none(x: float) -> float | None:
        return x if np.isfinite(x) else None

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
                "v_w_driven": or_none(p.driven),
                "v_w_whole": or_none(p.whole),
            }
            for p in plateaus
        ],
    }
