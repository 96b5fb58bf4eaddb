"""Learning from logs, and the test by logs of another campaign and another sea."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.errors import LiveError
from stillhook.live.residual.proof import proven
from stillhook.live.residual.samples import Samples, joined
from stillhook.live.residual.seen import Seen, seen_of
from stillhook.live.residual.terms import Scales, conditions, side, terms
from stillhook.live.residual.trees import NONE, boosted, values
from stillhook.statistics.estimate import CONFIDENCE, Estimate

PENALTIES = (1e-4, 1e-3, 1e-2, 1e-1)
"""Penalties on the coefficients that are tried, in parts of the variance of a term."""
COUNTS = (0, 25, 50, 100, 200)
"""Numbers of trees that are tried."""
TURNS = 3
"""Passes of the robust fit."""
LIMIT = 3.0
"""Error from which a sample counts less, in robust standard deviations (Huber 1964)."""
MOST_FOLDS, INNER_FOLDS = 10, 4
"""Parts that logs are held out in, for the test and for a choice within what is learned from."""
FEWEST_CAMPAIGNS = 4
"""Campaigns from which anything is learned: one is held out, one within the rest, and two differ."""
ALIKE = 0.1
"""Part by which height and period of two seas may differ for them to count as the same [-] (assumed)."""
SLOW = 10.0
"""Motor speed below which errors are larger and have an interval of their own [rad/s]."""
DRAWS = 2000
HALF = 0.5
"""Part of what adaptation leaves that level 4 may leave at most to pay [-]. Source: issue 39."""


class Sea(NamedTuple):
    """Largest peak-to-peak of the tip over 30 s [m], and mean period of its motion [s]."""

    span: float
    period: float

    def alike(self, other: Sea) -> bool:
        """Whether two are the same within ALIKE."""
        return all(abs(a - b) <= ALIKE * max(a, b) for a, b in zip(self, other, strict=True))


class LearningLog(NamedTuple):
    """What one log gives. digest: SHA-256 of the file."""

    name: str
    campaign: str
    sea: Sea
    digest: str
    samples: Samples


class Fitted(NamedTuple):
    """A model of what adaptation leaves over of the torque of one crane. coefficients (8,) of the terms [N m]; errors
    (8,) of them, standard, between logs [N m]."""

    scales: Scales
    coefficients: FloatArray
    errors: FloatArray
    trees: FloatArray
    seen: Seen

    def linear(self, x: Samples) -> FloatArray:
        """The part of the terms (n,) [N m]."""
        return np.asarray(terms(x, self.scales) @ self.coefficients)

    def torque(self, x: Samples) -> FloatArray:
        """The correction (n,), hoisting positive, wherever it is asked for [N m]."""
        trees = values(self.trees, conditions(x, self.scales)).sum(axis=0)
        return np.asarray(self.linear(x) + side(x) * trees)

    def outside(self, x: Samples) -> dict[str, np.ndarray]:
        """Which samples (n,) are outside of what was seen, by reason."""
        return self.seen.outside(conditions(x, self.scales))


class HeldOut(NamedTuple):
    """A log that was not learned from, under the correction that is zero where it is not seen or proven. Root mean
    squares of what adaptation leaves, with the linear part, and with all of it [N m]; part of the samples without a
    correction; errors of the samples that were seen [N m], and their speeds [rad/s]."""

    log: str
    campaign: str
    adapted: float
    linear: float
    learned: float
    outside: float
    error: FloatArray
    omega: FloatArray

    @property
    def ratio(self) -> float:
        """What is left over, on what adaptation leaves [-]."""
        return self.learned / self.adapted


def _rms(x: FloatArray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _ridge(logs: Sequence[Samples], scales: Scales, penalty: float) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the terms and their standard errors between logs: every log weighs the same, however long, and
    errors within one may be correlated in any way (Liang and Zeger 1986)."""
    X, y = np.concatenate([terms(x, scales) for x in logs]), np.concatenate([x.left for x in logs])
    log = np.repeat(np.arange(len(logs)), [len(x.t) for x in logs])
    base = 1.0 / np.bincount(log)[log]
    size = np.sqrt(np.maximum((X**2).mean(axis=0), 1e-12))
    X = X / size
    b, weight = np.zeros(X.shape[1]), base
    inverse = np.eye(X.shape[1])
    for _ in range(TURNS):
        inverse = np.linalg.inv(X.T @ (weight[:, None] * X) + penalty * weight.sum() * np.eye(X.shape[1]))
        b = inverse @ (X.T @ (weight * y))
        off = np.abs(y - X @ b)
        weight = base / np.maximum(1.0, off / (LIMIT * 1.4826 * np.median(off) + 1e-9))
    scores = np.zeros((len(logs), X.shape[1]))
    np.add.at(scores, log, (weight * (y - X @ b))[:, None] * X)
    errors = np.sqrt(np.diag(inverse @ (scores.T @ scores) @ inverse) * len(logs) / max(len(logs) - 1, 1))
    return b / size, errors / size


def learn(logs: Sequence[Samples], scales: Scales, penalty: float, count: int) -> Fitted:
    """A model of these logs, with a penalty of PENALTIES and so many trees."""
    b, errors = _ridge(logs, scales, penalty)
    x = joined(logs)
    at = [conditions(each, scales) for each in logs]
    trees = NONE
    if count:
        weight = np.repeat([len(x.t) / len(logs) / len(each.t) for each in logs], [len(each.t) for each in logs])
        trees = boosted(np.concatenate(at), side(x) * (x.left - terms(x, scales) @ b), weight, count)
    return Fitted(scales, b, errors, trees, seen_of(at))


def folds(logs: Sequence[LearningLog], most: int) -> Iterator[tuple[list[LearningLog], list[LearningLog]]]:
    """What is learned from and what is held out, in turn: no campaign and no sea is on both sides."""
    campaigns = sorted({log.campaign for log in logs})
    for k in range(min(most, len(campaigns))):
        names = set(campaigns[k :: min(most, len(campaigns))])
        test = [log for log in logs if log.campaign in names]
        rest = [
            log for log in logs if log.campaign not in names and not any(log.sea.alike(other.sea) for other in test)
        ]
        if len({log.campaign for log in rest}) >= 2:
            yield rest, test


def choose(logs: Sequence[LearningLog], scales: Scales) -> tuple[float, int]:
    """Penalty and number of trees with the least error on logs that are held out within these."""
    errors = np.zeros((len(PENALTIES), len(COUNTS)))
    for rest, test in folds(logs, INNER_FOLDS):
        for i, penalty in enumerate(PENALTIES):
            fitted = learn([log.samples for log in rest], scales, penalty, COUNTS[-1])
            for log in test:
                x = log.samples
                each = side(x) * values(fitted.trees, conditions(x, scales))
                for j, count in enumerate(COUNTS):
                    errors[i, j] += _rms(x.left - fitted.linear(x) - each[:count].sum(axis=0)) / _rms(x.left)
    best = int(errors.argmin())
    return PENALTIES[best // len(COUNTS)], COUNTS[best % len(COUNTS)]


def judged(fitted: Fitted, log: LearningLog) -> HeldOut:
    """A log under a model that did not learn from it."""
    x = log.samples
    torque, inside = fitted.torque(x), ~np.any([np.zeros(len(x.t), dtype=bool), *fitted.outside(x).values()], axis=0)
    used = inside & proven(x.left, torque, inside)
    adapted, linear = _rms(x.left), _rms(x.left - used * fitted.linear(x))
    learned, error = _rms(x.left - used * torque), (x.left - torque)[inside]
    return HeldOut(log.name, log.campaign, adapted, linear, learned, 1.0 - float(used.mean()), error, x.omega[inside])


def hold_out(logs: Sequence[LearningLog], scales: Scales) -> list[HeldOut]:
    """Every log under a model that was learned, and whose settings were chosen, without its campaign and its sea.

    Errors: LiveError for too few campaigns, or seas that are all alike.
    """
    campaigns = {log.campaign for log in logs}
    if len(campaigns) < FEWEST_CAMPAIGNS:
        raise LiveError(
            f"{len(campaigns)} campaigns with usable logs: {FEWEST_CAMPAIGNS} are the fewest that anything is learned"
            " from. Give logs of more days, those of each in a folder of its own."
        )
    out = []
    for rest, test in folds(logs, MOST_FOLDS):
        fitted = learn([log.samples for log in rest], scales, *choose(rest, scales))
        out += [judged(fitted, log) for log in test]
    if not out:
        raise LiveError("No campaign can be held out: all seas are alike. Give logs of other heights and periods.")
    return out


def intervals(held: Sequence[HeldOut]) -> tuple[float, float, float]:
    """Confidence, and half widths that hold what is left over on a campaign that was not seen [N m], below and from
    SLOW on.

    Campaigns are exchangeable, samples within one are not: the distributions of the campaigns are averaged, with one
    more that is beyond all (Dunn, Wasserman and Ramdas 2022). With fewer than 19 campaigns 95 % cannot be stated, and
    the confidence is what can.
    """
    campaigns = sorted({one.campaign for one in held})
    n = len(campaigns)
    confidence = min(CONFIDENCE, n / (n + 1.0))
    halves = []
    for slow in (True, False):
        parts = []
        for name in campaigns:
            of = [np.abs(o.error[(np.abs(o.omega) < SLOW) == slow]) for o in held if o.campaign == name]
            parts.append(np.concatenate(of))
        parts = [part for part in parts if len(part)]
        errors = np.concatenate(parts)
        weights = np.concatenate([np.full(len(part), 1.0 / len(part) / (n + 1.0)) for part in parts])
        order = np.argsort(errors)
        total = np.cumsum(weights[order])
        halves.append(float(errors[order][min(int(np.searchsorted(total, confidence - 1e-9)), len(errors) - 1)]))
    return confidence, halves[0], halves[1]


def ratio_of(held: Sequence[HeldOut], seed: int = 1) -> Estimate:
    """Mean over campaigns of what is left over on what adaptation leaves, with the interval of a bootstrap over
    campaigns [-]."""
    names = sorted({one.campaign for one in held})
    means = np.array([np.mean([o.ratio for o in held if o.campaign == name]) for name in names])
    draws = means[np.random.default_rng(seed).integers(0, len(means), (DRAWS, len(means)))].mean(axis=1)
    return Estimate.of_draws(float(means.mean()), draws, len(means))
