"""What step 5 tells: statements and tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from stillhook.units import number, show
from stillhook.validate.ahc.compared import Compared
from stillhook.validate.ahc.diagnosis import Explained
from stillhook.validate.ahc.replay import SETTLE
from stillhook.validate.ahc.shape import Shape, correlation
from stillhook.validate.ahc.windows import mean_and_s
from stillhook.validate.criteria.results import Table

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
"""Signals that are told beside the control error."""
SAID_LAG = 0.01
"""Lags up to this are the log's own spacing [s]."""
SAID_OFFSET = 5e-3
"""Standing offset of the crane's error from the twin's from which it is said [m]: a tenth of what paper F allows."""
SAID_NOISE = 0.2
"""Share of the tip's noise in the PLC's error from which it is worth saying."""


def said(compared: Sequence[Compared], like: Shape, *, logged: bool) -> tuple[str, ...]:
    """The comparison in sentences, the most important first."""
    x = np.concatenate([c.windows.x for c in compared])
    mean, s = mean_and_s(x)
    first = (
        f"The twin repeats {_cases(compared)} with the tip motion that was measured. Peak to peak over the window its"
        f" control error is {100.0 * mean:.2g} cm off the crane's on average (s {100.0 * s:.2g} cm){_range(compared)}."
        if len(x)
        else "The twin repeats the tests, but no window of the logs is full of numbers."
    )
    return (first, *_shape(like), *_how(compared, logged=logged))


def _range(compared: Sequence[Compared]) -> str:
    """Load cases with the least and the largest mean deviation."""
    names = dict.fromkeys(c.name for c in compared if len(c.windows.x))
    means = {n: float(np.mean(np.concatenate([c.windows.x for c in compared if c.name == n]))) for n in names}
    if len(means) < 2:
        return ""
    least, most = min(means, key=lambda n: means[n]), max(means, key=lambda n: means[n])
    return (
        f", from {100.0 * means[least]:.2g} cm in load case {least} to {100.0 * means[most]:.2g} cm in load case {most}"
    )


def _cases(compared: Sequence[Compared]) -> str:
    n = len({c.name for c in compared})
    return f"{n} load case{'s' if n > 1 else ''}"


def _shape(like: Shape) -> Iterable[str]:
    if not math.isfinite(like.correlation):
        return
    text = f"The control errors correlate by {like.correlation:.3f}"
    if math.isfinite(like.distance):
        text += (
            f"; with periods of 2 to 30 s, which hold {100.0 * like.band_share:.0f} % of the measured energy, the"
            f" twin's is {like.band_ratio:.2f} times as large, its spectrum {like.distance:.2g} dB off"
        )
    yield text + "."
    if math.isfinite(like.lag) and abs(like.lag) > max(SAID_LAG, 3.0 * like.u_lag):
        after = "after" if like.lag > 0.0 else "before"
        yield f"The measured error comes {1e3 * abs(like.lag):.0f} ms {after} the simulated one; nothing was shifted."


def _how(compared: Sequence[Compared], *, logged: bool) -> Iterable[str]:
    if not logged:
        yield (
            "e_c_measured was not logged in every test: the control error is made from s_tip and s_w, about its mean,"
            " so that a standing offset of the crane is not seen."
        )
    for c in compared:
        offset = float(np.mean(c.pair[0]) - np.mean(c.pair[1])) if len(c.pair[0]) else 0.0
        if abs(offset) > SAID_OFFSET:
            yield (
                f"In load case {c.name} the crane's error stands {100.0 * offset:+.2g} cm off the twin's on average;"
                " peak to peak that does not count, in the largest error it does."
            )
    noisy = [c for c in compared if logged and c.noise > SAID_NOISE]
    if noisy:
        spread = float(np.sqrt(np.mean([c.replay.tip.spread_s**2 for c in noisy])))
        share = float(np.mean([c.noise for c in noisy]))
        yield (
            f"The PLC's error holds {100.0 * share:.0f} % of the noise of the logged tip ({show(spread, 'diameter', 2)}"
            " rms); as much is in the simulated one."
        )
    yield f"The first {SETTLE:.0f} s of every stretch are left out: there the twin comes from rest."


def tables(compared: Sequence[Compared], explained: Sequence[Explained]) -> tuple[Table, ...]:
    """Load cases, signals beside the control error, causes."""
    return (_load_cases(compared), *_signals(compared), *_causes(explained))


def _load_cases(compared: Sequence[Compared]) -> Table:
    rows = []
    for name in dict.fromkeys(c.name for c in compared):
        own = [c for c in compared if c.name == name]
        x, measured, simulated = (
            np.concatenate([getattr(c.windows, k) for c in own]) for k in ("x", "measured", "simulated")
        )
        peak = [max((float(np.abs(p).max()) for c in own if len(p := c.pair[k])), default=math.nan) for k in (0, 1)]
        segment = own[0].replay.segment
        both = np.concatenate(
            [np.column_stack([p - p.mean() for p in c.quiet]) for c in own if len(c.pair[0])] or [np.zeros((0, 2))]
        )
        rows.append(
            (
                name,
                f"{segment.load / 1e3:.0f} t",
                f"{segment.s_w:.0f} m",
                segment.mode.value,
                f"{sum(len(c.e_measured) * c.replay.record.step for c in own):.0f} s",
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
    return Table("Control error by load case", header, tuple(rows))


def _mean(x: np.ndarray) -> float:
    return float(x.mean()) if len(x) else math.nan


def _cm(x: float) -> str:
    return number(100.0 * x, 3) if math.isfinite(x) else "-"


def _signals(compared: Sequence[Compared]) -> Iterable[Table]:
    """How far the twin's other signals are off, rms over the samples that count. Told, not judged."""
    rows = []
    for name, kind in COMPARED:
        pairs = [(c.replay.measured(name), c.simulated[name]) for c in compared]
        m, s = (np.concatenate(x) for x in zip(*pairs, strict=True))
        known = np.isfinite(m)
        if known.any():
            off = s[known] - m[known]
            parts = (float(np.sqrt(np.mean(off**2))), float(off.mean()), float(m[known].std()))
            rows.append((name, *(show(x, kind, 3) if kind else number(x, 3) for x in parts)))
    if rows:
        header = ("signal", "deviation\nrms", "deviation\nmean", "measured\nstandard deviation")
        yield Table("Other signals, simulated less measured (told, not judged)", header, tuple(rows))


def _causes(explained: Sequence[Explained]) -> Iterable[Table]:
    rows = tuple(
        (x.cause.words, f"{100.0 * x.amount:+.3g} %", f"{100.0 * x.share:.0f} %", f"{100.0 * x.share_e:.0f} %")
        for x in explained
        if x.share > 0.0
    )
    if rows:
        yield Table(
            "What would explain what is left of the deviation, one cause at a time (not judged; small causes cannot be"
            " told apart)",
            ("cause", "change", "explains", "of e_c\nalone"),
            rows,
        )
