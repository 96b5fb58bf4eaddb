"""What level 4 leaves over on cranes, seas and campaigns that it has not seen. Tables from `trials/residual`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from blocks import Blocks

from stillhook.live.residual import TERMS
from stillhook.live.residual.fit import HALF
from stillhook.statistics.estimate import Estimate
from trials.residual.run import CASES, SPLITS, kept
from trials.store import states_of

SCRIPT = "residual"
BASIS = {"measured": "as measured", "true": "in truth"}
PARTS = {"linear": "linear terms", "learned": "and trees, with all vetoes", "always": "the same without any veto"}
DRAWS = 2000


def of_split(outcomes: Mapping[str, Any], split: str) -> list[dict[str, Any]]:
    """Folds of a split that are there."""
    return [outcomes[key] for key, case in CASES.items() if case.split == split and key in outcomes]


def logs_of(folds: Sequence[Mapping[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """Judged logs by crane."""
    cranes: dict[str, list[dict[str, Any]]] = {}
    for fold in folds:
        for name, log in fold["judged"].items():
            cranes.setdefault(name.partition("-")[0], []).append(log)
    return cranes


def ratio(cranes: Mapping[str, Sequence[Mapping[str, Any]]], basis: str, part: str) -> Estimate:
    """Mean over cranes of what a part leaves over on what adaptation leaves, with a bootstrap over cranes [-]."""
    means = np.array([np.mean([log[basis][part] / log[basis]["adapted"] for log in logs]) for logs in cranes.values()])
    draws = means[np.random.default_rng(1).integers(0, len(means), (DRAWS, len(means)))].mean(axis=1)
    return Estimate.of_draws(float(means.mean()), draws, len(means))


def said(x: Estimate) -> str:
    """A ratio with its interval."""
    return f"{x.value:.2f} ({x.low:.2f} to {x.high:.2f})"


def adapted(cranes: Mapping[str, Sequence[Mapping[str, Any]]], basis: str) -> float:
    """Mean of what adaptation leaves over [N m]."""
    return float(np.mean([log[basis]["adapted"] for logs in cranes.values() for log in logs]))


def verdict(x: Estimate) -> str:
    """Against half of what adaptation leaves."""
    return "met" if x.high <= HALF else "not met" if x.low > HALF else "not shown: the interval holds the limit"


def claims(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, tuple[str, str, str]]]:
    """The target, on each split."""
    for name, split in SPLITS.items():
        if not (folds := of_split(outcomes, name)):
            continue
        cranes = logs_of(folds)
        for basis, text in BASIS.items():
            of = ratio(cranes, basis, "learned")
            yield f"{split.text}: left over, on what adaptation leaves, {text}", ("at most 0.50", said(of), verdict(of))
    cranes = logs_of(of_split(outcomes, "crane"))
    parts = [log["held"] for logs in cranes.values() for log in logs if log["held"] is not None]
    stated = np.mean([fold["confidence"] for fold in of_split(outcomes, "crane")])
    mean = Estimate.of_mean(np.array(parts))
    ours = f"{100.0 * mean.value:.1f} % ({100.0 * mean.low:.1f} to {100.0 * mean.high:.1f} %)"
    theirs = f"at least {100.0 * stated:.0f} %"
    yield (
        "samples of unseen cranes and seas within the interval",
        (theirs, ours, "held" if mean.value >= stated else "not"),
    )


def rows(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row for each split and basis."""
    for name, split in SPLITS.items():
        if not (folds := of_split(outcomes, name)):
            continue
        cranes = logs_of(folds)
        logs = [log for of in cranes.values() for log in of]
        for basis, text in BASIS.items():
            ratios = (said(ratio(cranes, basis, part)) for part in PARTS)
            size = f"{adapted(cranes, basis):.1f} N m"
            yield split.text, text, f"{len(cranes)}, {len(logs)}", size, *ratios


def vetoes(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """How often there was no correction, and what was chosen."""
    for name, split in SPLITS.items():
        if not (folds := of_split(outcomes, name)):
            continue
        logs = [log for of in logs_of(folds).values() for log in of]
        off = sum(log["without"] == 1.0 for log in logs)
        worse = sum(log["true"]["learned"] > log["true"]["adapted"] for log in logs)
        without = sum(log["true"]["always"] > log["true"]["adapted"] for log in logs)
        yield (
            split.text,
            f"{np.median([f['logs'] for f in folds]):.0f}",
            f"{np.median([f['trees'] for f in folds]):.0f}",
            f"{100.0 * np.mean([log['outside'] for log in logs]):.0f} %",
            f"{100.0 * np.mean([log['without'] for log in logs]):.0f} %",
            f"{off} of {len(logs)}",
            f"{worse} of {len(logs)}",
            f"{without} of {len(logs)}",
        )


def terms(outcomes: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Coefficients on the split by crane, mean of the folds."""
    folds = of_split(outcomes, "crane")
    b, u = (np.mean([f["terms"][k] for f in folds], axis=0) for k in (0, 1))
    for name, value, error in zip(TERMS, b.tolist(), u.tolist(), strict=True):
        yield name, f"{value:.1f}".replace("-", "−"), f"{error:.1f}"


def compute() -> tuple[Blocks, None]:
    """Blocks of the page."""
    outcomes = kept()
    return {
        "claims": dict(claims(outcomes)),
        "code": {"outcomes": outcomes, "states": states_of(outcomes), "all": len(CASES)},
        "ratios": rows(outcomes),
        "vetoes": vetoes(outcomes),
        "terms": terms(outcomes),
    }, None
