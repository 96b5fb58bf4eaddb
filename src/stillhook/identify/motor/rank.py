"""Which loss model for this motor: accuracy, parsimony, and where in the map the answer must not be used.

The interpolated map as a rival of a fitted model: which is better between measured levels, and which beyond them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stillhook.base.arrays import FloatArray, IntArray
from stillhook.errors import IdentifyError
from stillhook.identify.motor.fit import CARDS, LossFit, LossModel, fit_loss
from stillhook.identify.motor.map import AXES, LossMap, blocks, levels, mapped_loss
from stillhook.library import motor as library_motor
from stillhook.library import motors as library_motors
from stillhook.physics.hydraulics.motor import TorqueLossFit, torque_loss
from stillhook.report.formatting import percent_fixed
from stillhook.units import show

MATERIAL = 0.002
"""Part of the mean nominal torque by which a model may be worse than the best and still be as good: at 200 bar it is
0.4 bar, less than the pressure sensors of a crane resolve (0.5 bar), and a fifth of the 1 % that paper A asks of a
model."""
THRESHOLD = 0.01
"""Residual over the cell's nominal torque beyond which a model must not be used there (paper A section 4)."""
MOST_FOLDS = 6
"""Blocks left out in turn on each axis."""
MOST_STATEMENTS = 3
PURITY = 0.5
"""A region is named if at least this part of its cells is beyond the threshold."""
WORTH_NAMING = 0.08
"""Part of all bad cells that a region must add to be named."""
WORDY = 0.03
"""Part of all bad cells that one more condition in a statement must gain."""


RULE = (
    "Recommended: of the models whose cross-validated error is within one standard error of the best one's, or within"
    f" {percent_fixed(MATERIAL, 1)} of the mean nominal torque of it, the one with the fewest parameters (of two alike:"
    " the smaller error). Cross-validated: whole levels of displacement, pressure and speed are left out in turn, ends"
    " included, so that both interpolation and extrapolation count."
)


@dataclass(frozen=True)
class Ranked:
    model: LossModel
    fit: LossFit
    fixed: LossFit | None
    """The fit at the full displacement alone; None where that slice has too few cells."""
    cv: float
    """Root mean square error of cells that the fit did not see, over the mean nominal torque [-]."""
    cv_by_axis: Mapping[str, float]
    eligible: bool
    reason: str = ""


@dataclass(frozen=True)
class Statement:
    """A region where a model deviates beyond the threshold; counts leave out what statements before it cover."""

    text: str
    cells: int
    bad: int
    worst: float
    """Largest error over nominal torque of its bad cells [-]."""


@dataclass(frozen=True)
class Ranking:
    """All models on a map, best first by cross-validated error; `recommended` by accuracy and parsimony."""

    source: str
    ranked: tuple[Ranked, ...]
    best: LossModel
    recommended: LossModel
    reason: str
    equals: tuple[LossModel, ...] = ()
    """Models that are as good as the best by the rule, best first."""
    rule: str = RULE

    def __getitem__(self, model: LossModel) -> Ranked:
        return next(r for r in self.ranked if r.model is model)


def rank_losses(m: LossMap) -> Ranking:
    """All models fitted, cross-validated and put in order.

    Errors: IdentifyError where the map has too few cells or levels for any model.
    """
    parts = folds(m)
    ranked, squares = [], {}
    full = m.full()
    for model in LossModel:
        card = CARDS[model]
        if len(m) <= 2 * len(card.names):
            continue
        fit = fit_loss(m, model)
        fixed = fit_loss(full, model) if len(full) > len(card.names) and model is not LossModel.HUHTALA_28 else None
        squares[model] = _fold_residuals(m, fit, parts)
        ranked.append(_ranked(m, fit, fixed, parts, squares[model]))
    eligible = [r for r in ranked if r.eligible]
    if not eligible:
        raise IdentifyError(
            f"{m.source}: {len(m)} cells on too few levels determine no model. Give more levels of each setting."
        )
    best = min(eligible, key=lambda r: r.cv)
    good = _as_good(eligible, best, squares, float(m.T_N.mean()))
    chosen, reason = _choose(good, best)
    order = tuple(sorted(ranked, key=lambda r: (not r.eligible, r.cv)))
    return Ranking(m.source, order, best.model, chosen.model, reason, tuple(r.model for r in good))


Fold = tuple[str, NDArray[np.bool_]]


def folds(m: LossMap) -> list[Fold]:
    """Axis and cells that are left out: blocks of neighbouring levels, each in turn."""
    labels = {axis: blocks(m.axis(axis), MOST_FOLDS) for axis in AXES}
    return [(axis, label == i) for axis, label in labels.items() if label.max() for i in range(int(label.max()) + 1)]


def _fold_residuals(m: LossMap, fit: LossFit, parts: list[Fold]) -> FloatArray:
    """Mean square error of each fold's cells [N^2 m^2] from a fit without them; NaN where such a fit has no answer."""
    out = []
    for _, excluded in parts:
        seen, unseen = m.at(~excluded), m.at(excluded)
        try:
            other = fit_loss(seen, fit.model, near=fit)
            out.append(float(np.mean((unseen.T_f - other.torque(unseen.omega_m, unseen.D_m, unseen.dp_m)) ** 2)))
        except IdentifyError:
            out.append(math.nan)
    return np.array(out)


def _ranked(m: LossMap, fit: LossFit, fixed: LossFit | None, parts: list[Fold], square: FloatArray) -> Ranked:
    T_N = float(m.T_N.mean())
    names = np.array([axis for axis, _ in parts])
    by_axis = {axis: math.sqrt(float(square[names == axis].mean())) / T_N for axis in AXES if (names == axis).any()}
    cv = math.sqrt(float(square.mean())) / T_N if len(square) else math.nan
    reason = ""
    if fit.confounded:
        reason = "parameters cannot be distinguished on this map"
    elif not math.isfinite(cv):
        reason = "too few cells or levels to cross-validate"
    return Ranked(fit.model, fit, fixed, cv, by_axis, not reason, reason)


def _as_good(eligible: list[Ranked], best: Ranked, squares: Mapping[LossModel, FloatArray], T_N: float) -> list[Ranked]:
    """The models that are not materially worse than the best, best first."""

    def as_good(r: Ranked) -> bool:
        off = (squares[r.model] - squares[best.model]) / T_N**2
        error = float(np.std(off, ddof=1)) / math.sqrt(len(off)) if len(off) > 1 else 0.0
        return float(off.mean()) <= error or r.cv - best.cv <= MATERIAL

    return sorted((r for r in eligible if as_good(r)), key=lambda r: r.cv)


def _choose(good: list[Ranked], best: Ranked) -> tuple[Ranked, str]:
    """The model with the fewest parameters of them."""
    chosen = min(good, key=lambda r: (len(r.fit.names), r.cv))
    error = f"cross-validated error {percent_fixed(chosen.cv)} of the mean nominal torque"
    text = f"{chosen.fit.card.title}: {len(chosen.fit.names)} parameters, {error}"
    if chosen is best:
        return chosen, f"{text}, the smallest of all"
    return chosen, f"{text}; the best, {best.fit.card.title} with {len(best.fit.names)}, has {percent_fixed(best.cv)}"


def residual_share(m: LossMap, fit: LossFit) -> FloatArray:
    """Map less model over the nominal torque of the cell [-] (paper A figures 8 and 9); NaN without pressure."""
    T_N = np.where(m.T_N > 0.0, m.T_N, np.nan)
    return np.asarray((m.T_f - fit.torque(m.omega_m, m.D_m, m.dp_m)) / T_N)


def not_to_be_used(m: LossMap, fit: LossFit, threshold: float = THRESHOLD) -> tuple[Statement, ...]:
    """Regions of the map where the model deviates beyond the threshold, the largest first, then what is left over.

    Boxes that are open to one side on each axis are tried; each named one adds most bad cells at fewest good ones.
    """
    share = np.abs(residual_share(m, fit))
    share = np.where(np.isnan(share), 0.0, share)
    label = np.column_stack([blocks(m.axis(name), 24) for name in AXES])
    counts = tuple(int(label[:, i].max()) + 1 for i in range(3))
    remaining, named = share > threshold, np.zeros(len(m), dtype=bool)
    out: list[Statement] = []
    total = int(remaining.sum())
    while remaining.any() and len(out) < MOST_STATEMENTS:
        box, new = _best_box(label, counts, remaining, share <= threshold)
        if box is None or new < WORTH_NAMING * total:
            break
        inside = _in_box(label, box)
        bad = inside & remaining
        cells = int((inside & ~named).sum())
        out.append(Statement(_words(m, label, box), cells, int(bad.sum()), float(share[bad].max())))
        named |= inside
        remaining &= ~inside
    if remaining.any():
        out.append(
            Statement(
                "single cells elsewhere", int(remaining.sum()), int(remaining.sum()), float(share[remaining].max())
            )
        )
    return tuple(out)


Box = tuple[tuple[int, int], ...]
"""First and last level on each axis; at least one of them is an end of the axis."""


def _best_box(
    label: IntArray, counts: tuple[int, ...], bad: NDArray[np.bool_], good: NDArray[np.bool_]
) -> tuple[Box | None, int]:
    """The box with most bad cells less good ones, at least half of it bad."""
    options, masks = [], []
    for count in counts:
        last, place = count - 1, np.arange(count)
        ends = [(0, last), *((0, i) for i in range(last)), *((i, last) for i in range(1, count))]
        options.append(ends)
        masks.append(np.array([(place >= lo) & (place <= hi) for lo, hi in ends], dtype=np.float64))

    def inside(rows: NDArray[np.bool_]) -> FloatArray:
        table = np.zeros(counts)
        np.add.at(table, tuple(label[rows].T), 1.0)
        for axis, mask in enumerate(masks):
            table = np.moveaxis(np.tensordot(mask, table, axes=(1, axis)), 0, axis)
        return table

    b, g = inside(bad), inside(good)
    conditions = sum(np.ix_(*[np.array([o != ends[0] for o in ends], dtype=np.float64) for ends in options]))
    score = np.where(b >= PURITY * (b + g), b - 0.5 * g - WORDY * bad.sum() * conditions, -np.inf)
    at = np.unravel_index(int(np.argmax(score)), score.shape)
    if not np.isfinite(score[at]) or b[at] == 0.0:
        return None, 0
    return tuple(ends[i] for ends, i in zip(options, at, strict=True)), int(b[at])


def _in_box(label: IntArray, box: Box) -> NDArray[np.bool_]:
    first, last = np.array(box).T
    return np.asarray(((label >= first) & (label <= last)).all(axis=1))


def _words(m: LossMap, label: IntArray, box: Box) -> str:
    """A box in words, with the settings of the map at its sides."""
    parts = []
    for levels_of_cells, (first, last), (name, kind) in zip(label.T, box, AXES.items(), strict=True):
        x = m.axis(name)
        if last < levels_of_cells.max():
            parts.append(f"{show(float(x[levels_of_cells == last].max()), kind, 3)} and below")
        elif first > 0:
            parts.append(f"{show(float(x[levels_of_cells == first].min()), kind, 3)} and above")
    return ", ".join(parts) if parts else "everywhere"


@dataclass(frozen=True)
class Borrowed:
    """What it costs to use the published MJ4 parameters of a motor of the library for the mapped one."""

    name: str
    unscaled: float
    """Root mean square error over the mean nominal torque [-] with the parameters as printed."""
    scaled: float
    """The same with the parameters carried over to this size by similarity."""


def scaled_mj4(fit: TorqueLossFit, ratio: float) -> TorqueLossFit:
    """MJ4 parameters for a motor with `ratio` times the displacement, all lengths in proportion, pressures and speeds
    alike.

    Torque grows with D: X_1, X_4, X_5 as D, X_3 not at all; the turbulent torque rho w^2 D^(5/3) leaves X_2 as
    D^(-4/3). Not in the thesis: dimensional analysis. X_1 of paper D table 1 grows faster (as D^2.4).
    """
    return TorqueLossFit(
        X_1=fit.X_1 * ratio, X_2=fit.X_2 * ratio ** (-4.0 / 3.0), X_3=fit.X_3, X_4=fit.X_4 * ratio, X_5=fit.X_5 * ratio
    )


def borrowed(m: LossMap) -> tuple[Borrowed, ...]:
    """Cost of each library motor's own parameters on this map, as printed and scaled."""
    T_N, out = float(m.T_N.mean()), []
    for name in library_motors():
        other = library_motor(name)
        fit = TorqueLossFit(*(getattr(other.loss, f) for f in TorqueLossFit._fields))
        errors = [
            math.sqrt(float(np.mean((m.T_f - torque_loss(m.omega_m, m.D_m, m.dp_m, x)) ** 2))) / T_N
            for x in (fit, scaled_mj4(fit, m.D_max / other.D_max))
        ]
        out.append(Borrowed(name, *errors))
    return tuple(out)


def usable_share(m: LossMap, fit: LossFit, threshold: float = THRESHOLD) -> float:
    """Part of the map's cells within the threshold [-]."""
    share = residual_share(m, fit)
    return float(np.mean(np.abs(share[np.isfinite(share)]) <= threshold))


def levels_of(m: LossMap) -> dict[str, int]:
    return {name: int(levels(m.axis(name)).max()) + 1 for name in AXES}


@dataclass(frozen=True)
class Compared:
    """Errors on levels that were left out, over the mean nominal torque [-]: between the remaining levels, and beyond
    them."""

    mapped_between: float
    mapped_beyond: float
    fitted_between: float
    fitted_beyond: float


def compare_mapped(m: LossMap, model: LossModel) -> Compared | None:
    """The interpolated map against a fitted model on blocks of levels left out in turn; None where nothing can be left
    out.

    Source of the question: Moslatt 2020 paper D section 2.1, which expects a map to be better inside the supplier's
    range and a model to be better outside.
    """
    between, beyond = [], []
    complete = fit_loss(m, model)
    for _, excluded in folds(m):
        seen, unseen = m.at(~excluded), m.at(excluded)
        if len(seen) <= len(complete.names):
            return None
        mapped, inside = mapped_loss(seen)(unseen.omega_m, unseen.D_m, unseen.dp_m)
        fitted = fit_loss(seen, model, near=complete).torque(unseen.omega_m, unseen.D_m, unseen.dp_m)
        off = np.column_stack((mapped - unseen.T_f, fitted - unseen.T_f))
        between.append(off[inside])
        beyond.append(off[~inside])
    sets = [np.concatenate(x) if x else np.zeros((0, 2)) for x in (between, beyond)]
    if not all(len(x) for x in sets):
        return None
    share = [math.sqrt(float(np.mean(x[:, i] ** 2))) / float(m.T_N.mean()) for i in (0, 1) for x in sets]
    return Compared(*share)
