"""Step 5: the complete twin against the crane in heave compensation, on the measured tip motion; statements and
tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Meter, Progress
from stillhook.report.document import Table
from stillhook.report.formatting import variable
from stillhook.spec.crane import Crane
from stillhook.units import number
from stillhook.validate.ahc.comparison import (
    Comparison,
    by_case,
    compare,
    correlation,
    mean_and_s,
    shape,
)
from stillhook.validate.ahc.measures import measures, signal_misfits
from stillhook.validate.ahc.replay import (
    SETTLE,
    CauseEstimate,
    Deviation,
    Replay,
    explain,
    measured_error,
    replay,
    run_twin,
    statements,
    usable,
)
from stillhook.validate.criteria.results import Note, Step, StepNumber, nothing
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.record import Record
from stillhook.validate.data_set.signals import SLOWEST

COMPARED = ("v_w", "omega_m", "p_a", "p_b", "p_hp", "F_w", "u_p", "alpha_p", "alpha_m")
"""Signals reported in addition to the control error, of the winches that have them; those of a winch type's own
follow."""
LEAST_OFFSET = 5e-3
"""Constant offset of the crane's error from the twin's that is reported [m]: a tenth of paper F's limit."""
LEAST_NOISE = 0.2
"""Share of the tip's noise in the PLC's error that is reported."""


def remarks(comparisons: Sequence[Comparison], *, logged: bool) -> Iterable[Note]:
    """What the comparison rests on, and what the judged figures do not hold."""
    if not logged:
        yield Note("error-derived")
    for c in comparisons:
        offset = float(np.mean(c.pair[0]) - np.mean(c.pair[1])) if len(c.pair[0]) else 0.0
        if abs(offset) > LEAST_OFFSET:
            yield Note("error-offset", case=c.name, cm=100.0 * offset)
    noisy = [c for c in comparisons if logged and c.noise > LEAST_NOISE]
    if noisy:
        spread = float(np.sqrt(np.mean([c.replay.tip.spread_s**2 for c in noisy])))
        yield Note("tip-noise", share=float(np.mean([c.noise for c in noisy])), spread=spread)
    yield Note("start-left-out", seconds=SETTLE)


def tables(crane: Crane, comparisons: Sequence[Comparison], explained: Sequence[CauseEstimate]) -> tuple[Table, ...]:
    """Load cases, signals in addition to the control error, causes."""
    return (_load_cases(comparisons), *_signals(crane, comparisons), *_causes(explained))


def _load_cases(comparisons: Sequence[Comparison]) -> Table:
    rows = []
    for name, rows_of_case in by_case(comparisons).items():
        x, measured, simulated = (
            np.concatenate([getattr(c.windows, k) for c in rows_of_case]) for k in ("x", "measured", "simulated")
        )
        peak = [
            max((float(np.abs(p).max()) for c in rows_of_case if len(p := c.pair[k])), default=math.nan) for k in (0, 1)
        ]
        segment = rows_of_case[0].replay.segment
        both = np.concatenate(
            [np.column_stack([p - p.mean() for p in c.quiet]) for c in rows_of_case if len(c.pair[0])]
            or [np.zeros((0, 2))]
        )
        rows.append(
            (
                name,
                f"{segment.load / 1e3:.0f} t",
                f"{segment.s_w:.0f} m",
                segment.mode.value,
                f"{sum(c.seconds for c in rows_of_case):.0f} s",
                *map(_cm, mean_and_s(x)),
                _cm(mean_and_s(measured)[0]),
                _cm(mean_and_s(simulated)[0]),
                *map(_cm, peak),
                f"{correlation(both):.3f}",
            )
        )
    header = (
        "load\ncase",
        "load",
        "wire\nout",
        "mode",
        "time",
        "devia-\ntion\n[cm]",
        "s\n[cm]",
        "e_c_pp\nmeas.\n[cm]",
        "e_c_pp\nsim.\n[cm]",
        "max e_c\nmeas.\n[cm]",
        "max e_c\nsim.\n[cm]",
        "corre-\nlation",
    )
    return Table(header, tuple(rows), "Control error by load case")


def _cm(x: float) -> str:
    return number(100.0 * x, 3) if math.isfinite(x) else "-"


def _signals(crane: Crane, comparisons: Sequence[Comparison]) -> Iterable[Table]:
    """Deviation of the twin's other signals, rms over the samples that count."""
    rows = []
    for name in dict.fromkeys((*COMPARED, *(row.name for row in crane.plant.type.rows))):
        pairs = [(c.replay.measured(name), c.simulated[name]) for c in comparisons if name in c.simulated]
        if not pairs:
            continue
        m, s = (np.concatenate(x) for x in zip(*pairs, strict=True))
        finite = np.isfinite(m)
        if finite.any():
            off = s[finite] - m[finite]
            parts = (float(np.sqrt(np.mean(off**2))), float(off.mean()), float(m[finite].std()))
            rows.append((name, *(variable(name, x, 3) for x in parts)))
    if rows:
        header = ("signal", "deviation\nrms", "deviation\nmean", "measured\nstandard deviation")
        yield Table(header, tuple(rows), "Other signals, simulated less measured (reported, not judged)")


def _causes(explained: Sequence[CauseEstimate]) -> Iterable[Table]:
    rows = tuple(
        (x.cause.words, f"{100.0 * x.amount:+.3g} %", f"{100.0 * x.share:.0f} %", f"{100.0 * x.share_e:.0f} %")
        for x in explained
        if x.share > 0.0
    )
    if rows:
        yield Table(
            ("cause", "change", "explains", "of e_c\nalone"),
            rows,
            "Possible causes of the remaining deviation, one at a time (not judged; small causes cannot be"
            " distinguished)",
        )


SIGNALS = ("e_c_measured", "v_w", "F_w", "u_p")
"""Signals of the twin stored for comparison, with those of its winch type's own."""
WEIGHTS = (1.9, 2.9, 2.3, 3.3)
"""Parts of the work: runs, comparison, causes, measures; time that each took on the example campaign."""


@dataclass(frozen=True)
class AhcEstimates:
    """Estimates of step 5."""

    comparisons: tuple[Comparison, ...]


def check_ahc(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[AhcEstimates]:
    """Run the complete twin on the tip motion of every segment with heave compensation and compare its control error
    with the crane's. Errors: SimulationError, ScenarioError, ValidateError of one line, where the twin cannot repeat
    the test."""
    window, meter = campaign.criteria.settings["window"], Meter(sum(WEIGHTS), progress)
    parts, left_out = usable(records, window)
    if reason := _obstacle(campaign, records, parts):
        return nothing(StepNumber.AHC, reason, *left_out)
    replays = [replay(campaign, record, segment) for record, segment in parts]
    runs = _runs(campaign, replays, meter.part(WEIGHTS[0]))
    measured, logged = measured_error(replays)
    comparisons = tuple(
        compare(r, run, e, window, logged=logged) for r, run, e in zip(replays, runs, measured, strict=True)
    )
    like = shape([(*c.quiet, c.replay.record.step) for c in comparisons if len(c.pair[0])])
    meter.part(WEIGHTS[1])(1.0)
    explained, deviation = explain(campaign.crane, replays, measured) if logged else ((), Deviation(math.nan, math.nan))
    meter.part(WEIGHTS[2])(1.0)
    results = measures(comparisons, like, campaign.criteria.settings)
    if any(c.measure == "signal_misfit" for c in campaign.criteria.criteria):
        results += signal_misfits(campaign.crane, comparisons, window)
    return Step(
        StepNumber.AHC,
        results,
        (*remarks(comparisons, logged=logged), *statements(explained, deviation), *left_out),
        tables(campaign.crane, comparisons, explained),
        {"shape": like, "deviation": deviation, "causes": {x.cause.name: x[1:] for x in explained}},
        AhcEstimates(comparisons),
    )


OBSTACLES: Mapping[str, Callable[[Record], bool]] = {
    "no-s_tip": lambda r: not r.has("s_tip"),
    "no-error": lambda r: not r.has("e_c_measured") and not r.has("s_w"),
    "wire-derived": lambda r: not r.has("e_c_measured") and "s_w" in r.derived,
    "too-slow": lambda r: r.step > SLOWEST + 1e-9,
}
"""What of a test of heave compensation does not allow a comparison."""


def _obstacle(campaign: Campaign, records: Sequence[Record], parts: Sequence[tuple[Record, object]]) -> Note | None:
    """Reason why nothing can be compared: the first that any test of heave compensation gives."""
    if not campaign.of(Kind.AHC):
        return Note("no-ahc-test")
    tests = [r for r in records if r.test.kind is Kind.AHC]
    for code, applies in OBSTACLES.items():
        if test := next((r for r in tests if applies(r)), None):
            return Note(code, test=test.test.name, step=test.step, least=SLOWEST)
    return None if parts else Note("no-long-segment")


def _runs(campaign: Campaign, replays: Sequence[Replay], reached: Progress) -> list[dict[str, FloatArray]]:
    """One run a segment; one after another, since the longest is most of the work."""
    names = (*SIGNALS, *(row.name for row in campaign.crane.plant.type.rows))
    total, done, out = sum(r.case.duration for r in replays), 0.0, []
    for r in replays:
        out += run_twin([campaign.crane], [r], names)
        done += r.case.duration
        reached(done / total)
    return out
