"""Statements and tables of step 5."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from stillhook.report.document import Table
from stillhook.units import number, show
from stillhook.validate.ahc.comparison import Comparison, Shape, correlation, mean_and_s
from stillhook.validate.ahc.diagnosis import CauseEstimate
from stillhook.validate.ahc.replay import SETTLE

COMPARED = (
    ("v_w", "speed"),
    ("omega_m", "rotation"),
    ("p_a", "pressure"),
    ("p_b", "pressure"),
    ("p_hp", "pressure"),
    ("F_w", "force"),
    ("u_p", ""),
    ("alpha_p", ""),
    ("alpha_m", ""),
)
"""Signals reported in addition to the control error."""
LEAST_LAG = 0.01
"""Lags up to this are the log's own spacing [s]."""
LEAST_OFFSET = 5e-3
"""Constant offset of the crane's error from the twin's that is reported [m]: a tenth of paper F's limit."""
LEAST_NOISE = 0.2
"""Share of the tip's noise in the PLC's error that is reported."""


def comparison_statements(comparisons: Sequence[Comparison], like: Shape, *, logged: bool) -> tuple[str, ...]:
    """The comparison in sentences, the most important first."""
    x = np.concatenate([c.windows.x for c in comparisons])
    mean, s = mean_and_s(x)
    first = (
        f"The twin repeats {_cases(comparisons)} with the measured tip motion. Peak to peak over the window its"
        " control error"
        f" deviates by {100.0 * mean:.2g} cm from the crane's on average (s {100.0 * s:.2g} cm){_range(comparisons)}."
        if len(x)
        else "The twin repeats the tests, but no window of the logs is complete."
    )
    return (first, *_shape(like), *_remarks(comparisons, logged=logged))


def _range(comparisons: Sequence[Comparison]) -> str:
    """Load cases with the least and the largest mean deviation."""
    names = dict.fromkeys(c.name for c in comparisons if len(c.windows.x))
    means = {n: float(np.mean(np.concatenate([c.windows.x for c in comparisons if c.name == n]))) for n in names}
    if len(means) < 2:
        return ""
    least, most = min(means, key=lambda n: means[n]), max(means, key=lambda n: means[n])
    return (
        f", from {100.0 * means[least]:.2g} cm in load case {least} to {100.0 * means[most]:.2g} cm in load case {most}"
    )


def _cases(comparisons: Sequence[Comparison]) -> str:
    n = len({c.name for c in comparisons})
    return f"{n} load case{'s' if n > 1 else ''}"


def _shape(like: Shape) -> Iterable[str]:
    if not math.isfinite(like.correlation):
        return
    text = f"The control errors correlate by {like.correlation:.3f}"
    if math.isfinite(like.distance):
        text += (
            f"; with periods of 2 to 30 s, which contain {100.0 * like.band_share:.0f} % of the measured energy, the"
            f" twin's is {like.band_ratio:.2f} times as large, and its spectrum deviates by {like.distance:.2g} dB"
        )
    yield text + "."
    if math.isfinite(like.lag) and abs(like.lag) > max(LEAST_LAG, 3.0 * like.u_lag):
        after = "after" if like.lag > 0.0 else "before"
        yield f"The measured error is {1e3 * abs(like.lag):.0f} ms {after} the simulated one; no shift was applied."


def _remarks(comparisons: Sequence[Comparison], *, logged: bool) -> Iterable[str]:
    if not logged:
        yield (
            "e_c_measured was not logged in every test: the control error is derived from s_tip and s_w, about its"
            " mean,"
            " so that a constant offset of the crane is not visible."
        )
    for c in comparisons:
        offset = float(np.mean(c.pair[0]) - np.mean(c.pair[1])) if len(c.pair[0]) else 0.0
        if abs(offset) > LEAST_OFFSET:
            yield (
                f"In load case {c.name} the crane's error has an offset of {100.0 * offset:+.2g} cm from the"
                " twin's on average; it affects the largest error, not the peak-to-peak error."
            )
    noisy = [c for c in comparisons if logged and c.noise > LEAST_NOISE]
    if noisy:
        spread = float(np.sqrt(np.mean([c.replay.tip.spread_s**2 for c in noisy])))
        share = float(np.mean([c.noise for c in noisy]))
        yield (
            f"The PLC's error contains {100.0 * share:.0f} % of the noise of the logged tip"
            f" ({show(spread, 'diameter', 2)}"
            " rms); the simulated one contains the same."
        )
    yield f"The first {SETTLE:.0f} s of every segment are left out because the twin starts from rest."


def tables(comparisons: Sequence[Comparison], explained: Sequence[CauseEstimate]) -> tuple[Table, ...]:
    """Load cases, signals beside the control error, causes."""
    return (_load_cases(comparisons), *_signals(comparisons), *_causes(explained))


def _load_cases(comparisons: Sequence[Comparison]) -> Table:
    rows = []
    for name in dict.fromkeys(c.name for c in comparisons):
        rows_of_case = [c for c in comparisons if c.name == name]
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
                f"{sum(len(c.e_measured) * c.replay.record.step for c in rows_of_case):.0f} s",
                *map(_cm, mean_and_s(x)),
                _cm(_mean(measured)),
                _cm(_mean(simulated)),
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


def _mean(x: np.ndarray) -> float:
    return float(x.mean()) if len(x) else math.nan


def _cm(x: float) -> str:
    return number(100.0 * x, 3) if math.isfinite(x) else "-"


def _signals(comparisons: Sequence[Comparison]) -> Iterable[Table]:
    """Deviation of the twin's other signals, rms over the samples that count. Reported, not judged."""
    rows = []
    for name, kind in COMPARED:
        pairs = [(c.replay.measured(name), c.simulated[name]) for c in comparisons]
        m, s = (np.concatenate(x) for x in zip(*pairs, strict=True))
        known = np.isfinite(m)
        if known.any():
            off = s[known] - m[known]
            parts = (float(np.sqrt(np.mean(off**2))), float(off.mean()), float(m[known].std()))
            rows.append((name, *(show(x, kind, 3) if kind else number(x, 3) for x in parts)))
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
