"""Results of many draws as plain data in SI: bands, chances, paired differences and indices of every case."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from stillhook.analysis.uncertainty.bands import Limit, bands, chances, failures, paired_difference, troubles
from stillhook.analysis.uncertainty.sobol import Index, Sensitivity
from stillhook.statistics.estimate import Estimate

if TYPE_CHECKING:
    import xarray

NAMES = ("e_c_pp", "eta_c", "p_max", "u_p_max", "alpha_m_min")
"""Numbers of the summary with reported bands, where the winch type has them."""
COMPARED = ("e_c_pp", "p_max")
"""Numbers whose paired differences are reported."""
AT_MOST = 0.05
"""Tolerated probability of exceeding a limit unless another is given [-]: the 95 % that bands are reported
for."""


class Verdict(NamedTuple):
    """Whether a case keeps a limit: the chance of going beyond it, and whether that is at most the tolerated one."""

    chance: Estimate
    kept: bool


def verdicts(run: xarray.Dataset, limits: Sequence[Limit], at_most: float = AT_MOST) -> dict[str, dict[str, Verdict]]:
    """Case -> limit in words -> verdict, by the share of the draws itself (its interval is the confidence)."""
    out: dict[str, dict[str, Verdict]] = {str(c): {} for c in run["case"].values}
    for limit in limits:
        for case, chance in chances(run, limit).items():
            out[case][str(limit)] = Verdict(chance, chance.value <= at_most)
    return out


def report(
    run: xarray.Dataset,
    limits: Sequence[Limit] = (),
    at_most: float = AT_MOST,
    pairs: Sequence[tuple[str, str]] = (),
    indices: Sequence[Sensitivity] = (),
) -> dict[str, Any]:
    """Everything as plain data; pairs: cases to compare draw by draw; indices: of
    `stillhook.analysis.uncertainty.sobol`."""
    band, trouble, failed, verdict = (
        bands(run, [name for name in NAMES if name in run]),
        troubles(run),
        failures(run),
        verdicts(run, limits, at_most),
    )
    at_values = json.loads(run.attrs["at_values"])
    cases = {
        c: {
            "at_values": at_values[c],
            "band_90": {name: b._asdict() for name, b in band[c].items()},
            "beyond_limits": _chance(trouble[c]),
            "limits": {
                text: {**_chance(v.chance), "at_most": at_most, "kept": v.kept} for text, v in verdict[c].items()
            },
            "failed": failed[c],
        }
        for c in band
    }
    differences: dict[str, Any] = {}
    for case, other in pairs:
        paired = {name: paired_difference(run, case, other, name) for name in COMPARED if name in run}
        differences[f"{case} / {other}"] = {
            name: {"relative": p.relative._asdict(), "lower": _chance(p.lower)} for name, p in paired.items()
        }
    return {
        "twin": str(run.attrs["twin"]),
        "draws": int(run.sizes["draw"]),
        "seed": int(run.attrs["seed"]),
        "factors": json.loads(run.attrs["factors"]),
        "cases": cases,
        "differences": differences,
        "sensitivity": [_indices(s) for s in indices],
    }


def _chance(share: Estimate) -> dict[str, Any]:
    hits = round(share.value * share.n)
    return {**share.to_dict("share"), "hits": hits, "n": share.n}


def _index(index: Index) -> dict[str, float]:
    return {
        name + end: value
        for name, e in (("first", index.first), ("total", index.total))
        for end, value in (("", e.value), ("_low", e.low), ("_high", e.high))
    }


def _indices(s: Sensitivity) -> dict[str, Any]:
    return {
        "case": s.case,
        "output": s.output,
        "mean": s.mean,
        "deviation": s.deviation,
        "indices": {name: _index(i) for name, i in s.indices.items()},
        "converged": s.converged,
        "change": s.change,
        "runs": s.runs,
        "statements": [*s.words(), s.convergence()],
    }
