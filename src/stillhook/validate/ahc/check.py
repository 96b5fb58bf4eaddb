"""Step 5: the complete twin against the crane in heave compensation, on the measured tip motion.

Source: Moslatt 2020 paper F, "(5) Active heave compensation", eqs 1 to 3, 6, 7, table 2, figures 10 to 13.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Meter
from stillhook.validate.ahc.comparison import Comparison, Shape, Spectra, compare, shape
from stillhook.validate.ahc.diagnosis import CauseEstimate, Deviation, explain, statements
from stillhook.validate.ahc.measures import measures
from stillhook.validate.ahc.replay import Replay, measured_error, replay, run_twin, usable
from stillhook.validate.ahc.texts import comparison_statements, tables
from stillhook.validate.criteria.names import MEASURES
from stillhook.validate.criteria.results import Measure, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.records.record import Record
from stillhook.validate.data_set.records.tip import SLOWEST

SIGNALS = ("e_c_measured", "v_w", "omega_m", "p_a", "p_b", "p_hp", "F_w", "u_p", "alpha_p", "alpha_m")
"""Signals of the twin stored for comparison."""
WEIGHTS = (3.0, 1.0, 2.0)
"""Shares of the work: runs, comparison, causes."""


@dataclass(frozen=True)
class AhcStep(Step):
    """Step 5 with what its figures need."""

    comparisons: tuple[Comparison, ...] = ()
    shape: Shape | None = None
    spectra: Spectra | None = None
    explained: tuple[CauseEstimate, ...] = ()


def check_ahc(campaign: Campaign, records: tuple[Record, ...], progress: Callable[[float], None]) -> Step:
    """Run the complete twin on the tip motion of every segment with heave compensation and compare its control error
    with the crane's.

    Errors: SimulationError, ScenarioError, ValidateError of one line, where the twin cannot repeat the test.
    """
    window, meter = campaign.criteria.settings["window"], Meter(sum(WEIGHTS), progress)
    parts, left_out = usable(records, window)
    reason = _obstacle(campaign, records, parts)
    if reason:
        nothing = tuple(
            Measure(name, None, m.quantity, note=reason) for name, m in MEASURES.items() if m.step is StepNumber.AHC
        )
        return AhcStep(StepNumber.AHC, nothing, (f"Step 5 has nothing to compare: {reason}.", *left_out))
    replays = [replay(campaign, record, segment) for record, segment in parts]
    runs = _runs(campaign, replays, meter.part(WEIGHTS[0]))
    measured, logged = measured_error(replays)
    comparisons = tuple(
        compare(r, run, e, window, logged=logged) for r, run, e in zip(replays, runs, measured, strict=True)
    )
    like, spectra = shape([(*c.quiet, c.replay.record.step) for c in comparisons if len(c.pair[0])])
    meter.part(WEIGHTS[1])(1.0)
    explained, deviation = explain(campaign.crane, replays, measured) if logged else ((), Deviation(math.nan, math.nan))
    meter.part(WEIGHTS[2])(1.0)
    results = measures(comparisons, like, campaign.criteria.settings)
    lines = comparison_statements(comparisons, like, logged=logged)
    return AhcStep(
        StepNumber.AHC,
        results,
        (*lines, *statements(explained, deviation), *left_out),
        tables(comparisons, explained),
        _data(comparisons, like),
        comparisons,
        like,
        spectra,
        explained,
    )


def _obstacle(campaign: Campaign, records: Sequence[Record], parts: Sequence[tuple[Record, object]]) -> str:
    tests = [r for r in records if r.test.kind is Kind.AHC]
    if not campaign.of(Kind.AHC):
        return 'the campaign has no test of kind = "ahc"; log the crane in heave compensation'
    without = next((r.test.name for r in tests if not r.has("s_tip")), None)
    if without is not None:
        return f's_tip is not in the log of test "{without}"; log the tip motion as received by the PLC'
    without = next((r.test.name for r in tests if not r.has("e_c_measured") and not r.has("s_w")), None)
    if without is not None:
        return (
            f'neither e_c_measured nor s_w is in the log of test "{without}"; log the PLC\'s control error, or the wire'
            " paid out"
        )
    made = next((r.test.name for r in tests if not r.has("e_c_measured") and "s_w" in r.derived), None)
    if made is not None:
        return (
            f'in test "{made}" the wire paid out is derived from a speed, too coarse for centimetres; log e_c_measured'
            " or s_w"
        )
    slow = next((r for r in tests if r.step > SLOWEST + 1e-9), None)
    if slow is not None:
        return (
            f'the log of test "{slow.test.name}" has a sample every {slow.step:.3g} s; log every {SLOWEST:g} s or'
            " faster"
        )
    return "" if parts else "no segment with heave compensation is long enough; log 60 s or more without interruption"


def _runs(
    campaign: Campaign, replays: Sequence[Replay], reached: Callable[[float], None]
) -> list[dict[str, FloatArray]]:
    """One run a segment; one after another, since the longest is most of the work."""
    total, done, out = sum(r.case.duration for r in replays), 0.0, []
    for r in replays:
        out += run_twin([campaign.crane], [r], SIGNALS)
        done += r.case.duration
        reached(done / total)
    return out


def _data(comparisons: Sequence[Comparison], like: Shape) -> dict[str, object]:
    """Data of the figures, for JSON: windows by load case [s, m]; shape."""
    return {
        "windows": [
            {
                "test": c.name,
                "time": c.windows.ends.tolist(),
                "e_c_pp_measured": c.windows.measured.tolist(),
                "e_c_pp": c.windows.simulated.tolist(),
                "s_tip_pp": c.windows.s_tip_pp.tolist(),
            }
            for c in comparisons
        ],
        "shape": {k: v if math.isfinite(v) else None for k, v in like._asdict().items()},
    }
