"""Learning from logs, and the test by logs of another campaign and another sea."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.errors import LiveError
from stillhook.live.residual.proof import FEWEST, proven
from stillhook.live.residual.samples import BIN, Samples
from stillhook.live.residual.seen import Seen, seen_of
from stillhook.live.residual.terms import Scales, conditions, side, terms
from stillhook.live.residual.trees import NONE, boosted, values
from stillhook.statistics.estimate import CONFIDENCE, Estimate

PENALTIES = (1e-3, 1e-2, 1e-1)
"""Penalties on the coefficients that are tried, in parts of the variance of a term."""
COUNTS = (0, 25, 50, 100)
"""Numbers of trees that are tried."""
TURNS, LIMIT = 3, 3.0
"""Passes of the robust fit, and error from which a sample counts less, in robust standard deviations (Huber 1964)."""
MOST_FOLDS, INNER_FOLDS = 10, 5
"""Parts that logs are held out in, for the test and for a choice within what is learned from."""
FEWEST_CAMPAIGNS = 4
"""Campaigns from which anything is learned: one is held out, one within the rest, and two differ."""
ALIKE = 0.1
"""Part by which height and period of two seas may differ for them to count as the same [-] (assumed)."""
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
    (8,) of them, standard, between logs [N m]; trees: nodes."""

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

    def outside(self, x: Samples) -> dict[str, BoolArray]:
        """Which samples (n,) are outside of what was seen, by reason."""
        return self.seen.outside(conditions(x, self.scales))


class HeldOut(NamedTuple):
    """A log that was not learned from, under the correction that is zero where it is not seen or proven. Root mean
    squares of what adaptation leaves, with the linear part, and with all of it [N m]; part of the samples outside of
    what was seen, and without a correction; errors of the samples that were seen [N m]."""

    log: str
    campaign: str
    adapted: float
    linear: float
    learned: float
    outside: float
    without: float
    error: FloatArray


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
    b, weight, inverse = np.zeros(X.shape[1]), base, np.eye(X.shape[1])
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
    at, trees = [conditions(x, scales) for x in logs], NONE
    if count:
        left = np.concatenate([side(x) * (x.left - terms(x, scales) @ b) for x in logs])
        mean = len(left) / len(logs)
        weight = np.concatenate([np.full(len(x.t), mean / len(x.t)) for x in logs])
        trees = boosted(np.concatenate(at), left, weight, count)
    return Fitted(scales, b, errors, trees, seen_of(at))


def folds(logs: Sequence[LearningLog], most: int) -> Iterator[tuple[list[LearningLog], list[LearningLog]]]:
    """What is learned from and what is held out, in turn: no campaign and no sea is on both sides."""
    campaigns = sorted({log.campaign for log in logs})
    for k in range(min(most, len(campaigns))):
        names = set(campaigns[k :: min(most, len(campaigns))])
        test = [log for log in logs if log.campaign in names]
        others = [log for log in logs if log.campaign not in names]
        rest = [log for log in others if not any(log.sea.alike(other.sea) for other in test)]
        if len({log.campaign for log in rest}) >= 2:
            yield rest, test


def choose(logs: Sequence[LearningLog], scales: Scales) -> tuple[float, int]:
    """Penalty of the linear part, then number of trees on it, with the least error on logs that are held out within
    these."""
    parts = [([log.samples for log in rest], [log.samples for log in test]) for rest, test in folds(logs, INNER_FOLDS)]
    linear = dict.fromkeys(PENALTIES, 0.0)
    for penalty in PENALTIES:
        for rest, test in parts:
            b, _ = _ridge(rest, scales, penalty)
            linear[penalty] += sum(_rms(x.left - terms(x, scales) @ b) / _rms(x.left) for x in test)
    penalty = min(linear, key=linear.__getitem__)
    errors = np.zeros(len(COUNTS))
    for rest, test in parts:
        fitted = learn(rest, scales, penalty, COUNTS[-1])
        for x in test:
            each = side(x) * values(fitted.trees, conditions(x, scales))
            left = x.left - fitted.linear(x)
            errors += [_rms(left - each[:count].sum(axis=0)) / _rms(x.left) for count in COUNTS]
    return penalty, COUNTS[int(errors.argmin())]


def applied(fitted: Fitted, x: Samples) -> tuple[FloatArray, BoolArray, BoolArray]:
    """Torque that a model says [N m], where it was seen, and where the samples before prove it as well (n,)."""
    torque, inside = fitted.torque(x), np.ones(len(x.t), dtype=np.bool_)
    for outside in fitted.outside(x).values():
        inside &= ~outside
    return torque, inside, inside & proven(x.left, torque, inside)


def judged(fitted: Fitted, log: LearningLog) -> HeldOut:
    """A log under a model that did not learn from it; the first samples, that prove the model, are not counted."""
    x = log.samples
    torque, inside, used = applied(fitted, x)
    counted = slice(round(FEWEST / BIN), None)
    adapted, linear, learned = (_rms((x.left - used * y)[counted]) for y in (0.0 * torque, fitted.linear(x), torque))
    outside, without = 1.0 - float(inside.mean()), 1.0 - float(used[counted].mean())
    error = (x.left - torque)[inside]
    return HeldOut(log.name, log.campaign, adapted, linear, learned, outside, without, error)


def hold_out(logs: Sequence[LearningLog], scales: Scales, settings: tuple[float, int] | None = None) -> list[HeldOut]:
    """Every log under a model that was learned without its campaign and its sea. settings: penalty and trees, which are
    chosen without them as well where None.

    Errors: LiveError for too few campaigns, or seas that are all alike.
    """
    if (n := len({log.campaign for log in logs})) < FEWEST_CAMPAIGNS:
        raise LiveError(
            f"{n} campaigns with usable logs: {FEWEST_CAMPAIGNS} are the fewest that anything is learned from. Give"
            " logs of more days, those of each in a folder of its own."
        )
    out = []
    for rest, test in folds(logs, MOST_FOLDS):
        fitted = learn([log.samples for log in rest], scales, *(settings or choose(rest, scales)))
        out += [judged(fitted, log) for log in test]
    if not out:
        raise LiveError("No campaign can be held out: all seas are alike. Give logs of other heights and periods.")
    return out


def interval(held: Sequence[HeldOut]) -> tuple[float, float]:
    """Confidence, and half width that holds what the correction leaves over on a campaign that was not seen [N m].

    Campaigns are exchangeable, samples within one are not: the distributions of the campaigns are averaged, with one
    more that is beyond all (Dunn, Wasserman and Ramdas 2022). With fewer than 39 campaigns less than 95 % is stated, so
    that one campaign's worth of samples may be beyond the interval: else the worst sample of all would be its end.
    """
    campaigns = sorted({one.campaign for one in held})
    parts = [np.concatenate([np.abs(o.error) for o in held if o.campaign == name]) for name in campaigns]
    parts = [part for part in parts if len(part)]
    n = len(parts)
    if not n:
        return 0.0, np.inf
    confidence = min(CONFIDENCE, (n - 1.0) / (n + 1.0))
    errors = np.concatenate(parts)
    order = np.argsort(errors)
    weight = np.concatenate([np.full(len(part), 1.0 / len(part) / (n + 1.0)) for part in parts])[order]
    place = min(int(np.searchsorted(np.cumsum(weight), confidence - 1e-9)), len(errors) - 1)
    return confidence, float(errors[order][place])


def ratio_of(held: Sequence[HeldOut], part: str = "learned", seed: int = 1) -> Estimate:
    """Mean over campaigns of what `part` leaves over, on what adaptation leaves, with the interval of a bootstrap over
    campaigns [-]."""
    names = sorted({one.campaign for one in held})
    means = np.array([np.mean([getattr(o, part) / o.adapted for o in held if o.campaign == name]) for name in names])
    draws = means[np.random.default_rng(seed).integers(0, len(means), (DRAWS, len(means)))].mean(axis=1)
    return Estimate.of_draws(float(means.mean()), draws, len(means))
