"""Step 0: coverage and quality of the data set. Moslatt 2020 paper F table 2, 1a to 1d, and the quality of the logs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.engine.pack.winch import drum_record
from stillhook.physics.load_path.drum import layers_filled
from stillhook.report.document import Table
from stillhook.sea.motion.recorded import window_spans
from stillhook.statistics.estimate import Estimate
from stillhook.units import number, show
from stillhook.validate.criteria.results import Measure, Note, Step, StepNumber
from stillhook.validate.data_set.campaign import Campaign, Kind
from stillhook.validate.data_set.record import SMOOTH, ClockError, Record, Segment

EVERY = 0.2
"""Spacing of the tip samples for ranges [s]: a wave of 4 s is captured within 1 % of its height."""
RESTS = 0.1
"""Peak-to-peak motion of a window below which the tip is at rest and compensation is not exercised [m]."""
NEEDED = ("s_tip", "s_w", "u_p", "e_c_measured")
"""Signals whose doubtful samples count: those that step 5 depends on."""


def check_data(campaign: Campaign, records: tuple[Record, ...], progress: Progress) -> Step[tuple[Record, ...]]:
    """Coverage of the tests with heave compensation, and quality of all logs; estimates: the records. Two wire lengths
    differ where they are `layers_apart` layers apart, two loads where they are `load_apart` of the SWL apart: enough to
    change layer, inertia and wire, or pressure, speed and friction. Source: Moslatt 2020 paper F table 2, 1a-1d."""
    cases = [(r, s) for r in records if r.test.kind is Kind.AHC for s in r.segments]
    spans = [tip_ranges(r, s, campaign.criteria.settings["window"]) for r, s in cases]
    measures = (*_coverage(campaign, records, [s for _, s in cases], spans), *_quality(records))
    statements = tuple(text for r in records for text in r.statements)
    return Step(StepNumber.DATA, measures, statements, (_table(records),), estimates=records)


def tip_ranges(record: Record, segment: Segment, window: float) -> FloatArray:
    """Peak-to-peak of the tip over every full window of a segment [m], one per EVERY; empty in a shorter segment."""
    tip = record.part(segment, "s_tip")
    if segment.duration < window - 1e-9:
        return np.zeros(0)
    every = max(1, round(EVERY / record.step))
    smooth = scipy.ndimage.uniform_filter1d(tip, max(1, round(SMOOTH / record.step)))[::every]
    return window_spans(smooth, round(window / (every * record.step)) + 1)


def _coverage(
    campaign: Campaign, records: Sequence[Record], cases: Sequence[Segment], ranges: Sequence[FloatArray]
) -> list[Measure]:
    crane, settings = campaign.crane, campaign.criteria.settings
    if not cases:
        names = ("wire_lengths", "loads", "load_share", "s_tip_pp_low", "s_tip_pp_high")
        none = [Measure.of(n, None, Note("no-load-case")) for n in names]
        return [*none, Measure.of("data_length", 0.0, data="no load case")]
    drum = drum_record(crane)
    layers = [float(layers_filled(drum.L_full - 0.5 * (s.s_w_min + s.s_w_max), drum)) for s in cases]
    layers_apart, load_apart = settings["layers_apart"], settings["load_apart"]
    lengths = different(layers, layers_apart)
    water = {r.test.name: r.test.water for r in records}
    suspended = [s.load - (w.rho * w.volume if (w := water.get(s.test)) is not None else 0.0) for s in cases]
    loads = different(suspended, load_apart * crane.SWL)
    heaviest = max(range(len(cases)), key=lambda i: suspended[i])
    wet = f", {show(suspended[heaviest], 'mass')} of it in water" if suspended[heaviest] < cases[heaviest].load else ""
    on_hook = f"{show(cases[heaviest].load, 'mass')} on the hook{wet}"
    each_length, each_load = (
        ", ".join(show(getattr(cases[i], field), kind) for i in places)
        for places, field, kind in ((lengths, "s_w", "length"), (loads, "load", "mass"))
    )
    return [
        Measure.of("wire_lengths", len(lengths), Note("lengths-apart", layers=layers_apart), data=each_length),
        Measure.of("loads", len(loads), Note("loads-apart", share=load_apart), data=each_load),
        Measure.of("load_share", suspended[heaviest] / crane.SWL, data=on_hook),
        *_motion(ranges),
        Measure.of("data_length", sum(s.duration for s in cases), data=f"{len(cases)} load cases"),
    ]


def _motion(ranges: Sequence[FloatArray]) -> list[Measure]:
    """Least and largest motion over the windows of all load cases in which the tip moves."""
    names, spans = ("s_tip_pp_low", "s_tip_pp_high"), np.concatenate(ranges)
    spans = spans[spans >= RESTS]
    if not len(spans):
        return [Measure.of(name, None) for name in names]
    low, half_low, half_high, high = (float(x) for x in np.percentile(spans, (0.0, 25.0, 75.0, 100.0)))
    half = f"{number(half_low, 3)} m to {number(half_high, 3)} m"
    data = f"{number(len(spans) * EVERY, 4)} s of windows, half of them {half}"
    return [Measure.of(name, x, data=data) for name, x in zip(names, (low, high), strict=True)]


def different(values: Sequence[float], apart: float) -> list[int]:
    """Indices of the largest set of values that pairwise differ by at least `apart`; NaN is excluded."""
    out: list[int] = []
    for i in sorted(range(len(values)), key=lambda i: values[i]):
        if np.isfinite(values[i]) and (not out or values[i] - values[out[-1]] >= apart * (1.0 - 1e-9)):
            out.append(i)
    return out


def _quality(records: Sequence[Record]) -> list[Measure]:
    out = []
    for r in records:
        test, data = f"test {r.test.name}", f"{number(r.log.samples, 6)} samples of {r.log.source}"
        out.append(Measure.of("samples_lost", r.lost, test=test, data=data))
        out.append(Measure.of("longest_gap", r.longest_hole, test=test, data=data))
        if r.test.kind is Kind.AHC and r.segments:
            out += _doubtful(r)
        out += [_drift(test, clock) for clock in r.clocks]
    return out


def _drift(test: str, clock: ClockError) -> Measure:
    drift, margin = abs(clock.drift), 2.0 * clock.u_drift
    data = f"{', '.join(clock.signals)} against {clock.against or 'the motion of the winch'}"
    e = Estimate(drift, max(0.0, drift - margin), drift + margin)
    return Measure.of("clock_drift", e, Note("corrected"), test=test, data=data)


def _doubtful(r: Record) -> list[Measure]:
    """Share of the samples of a compensated test that are at a sensor limit, bridged or unknown."""
    names = [n for n in NEEDED if n in r.doubtful and n not in r.derived]
    if not names:
        return []
    counts = {n: sum(int(r.doubtful[n][s.first : s.last].sum()) for s in r.segments) for n in names}
    total = sum(s.last - s.first for s in r.segments)
    worst = max(counts, key=lambda n: counts[n])
    data = f"{worst}, {number(total * r.step, 4)} s"
    return [Measure.of("samples_doubtful", counts[worst] / total, test=f"test {r.test.name}", data=data)]


def _table(records: Sequence[Record]) -> Table:
    head = ("test", "kind", "samples\nper s", "lost\n[%]", "longest\ngap [s]", "used\n[s]", "parts")
    rows = []
    for r in records:
        quality = (number(r.log.rate, 3), f"{100.0 * r.lost:.2f}", f"{r.longest_hole:.2f}")
        used = sum(s.duration for s in r.segments)
        rows.append((r.test.name, r.test.kind.value, *quality, f"{used:.0f}", str(len(r.segments))))
    return Table(head, tuple(rows), "Logs")
