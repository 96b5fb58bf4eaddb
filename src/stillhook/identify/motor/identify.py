"""From a supplier's map to the torque loss of a motor: `identify_motor`, and what it writes.

The result of `identify_motor` as a document.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.choice import choice
from stillhook.errors import IdentifyError
from stillhook.formats.table.cells import remark_of
from stillhook.identify.motor.fit import CARDS, LossFit, LossModel, indeterminate, spread_of_levels
from stillhook.identify.motor.map import AXES, AXIS_NAMES, LossMap, gridded
from stillhook.identify.motor.rank import (
    THRESHOLD,
    Borrowed,
    Compared,
    Ranking,
    Statement,
    borrowed,
    compare_mapped,
    levels_of,
    not_to_be_used,
    rank_losses,
    usable_share,
)
from stillhook.library import motor as library_motor
from stillhook.library import motors as library_motors
from stillhook.library.parameter_sets import LOSS_RANGE, Evidence, LossSet, load_losses
from stillhook.library.toml.loss_map import map_csv
from stillhook.physics.hydraulics.motor_laws import BLIND
from stillhook.report.document import Bullets, Document, Figure, Section, Table, Text, Verdict
from stillhook.report.formatting import EMPTY, fmt, percent_fixed
from stillhook.spec.crane import Source, SourceKind
from stillhook.units import number, show
from stillhook.winches.circuits.losses import MAP, MJ4, LossAlternatives, LossName, TorqueLoss
from stillhook.winches.circuits.losses import LossModel as LossTable

SAME_SIZE = 0.02
"""A library motor whose full displacement differs by less is taken for the mapped motor's other data (inertia, speed
limits, leakage)."""
USEFUL = 0.5
"""A model within the threshold on less than half of the map is not a model of this motor."""


@dataclass(frozen=True)
class MotorLoss:
    """What a map says about one motor."""

    map: LossMap
    ranking: Ranking
    model: LossModel
    """The model requested, or else the recommended one."""
    threshold: float
    """Error over nominal torque beyond which a model must not be used [-]."""
    statements: tuple[Statement, ...]
    """Where `model` must not be used."""
    mj4_statements: tuple[Statement, ...]
    """The same for MJ4, which the twin runs."""
    covariance: FloatArray
    """Of MJ4's parameters, SI: by leaving out displacements where there are enough, else from the residuals."""
    by_levels: bool
    notes: tuple[str, ...]
    others: tuple[Borrowed, ...]
    mapped: Compared | None
    """The interpolated map against `model`; None where no level can be left out."""
    like: str | None
    """Motor that lends what a map does not contain."""
    law: str = MJ4
    """Model that the motor file names, and the twin of a crane with it runs: the one requested, "map", or else MJ4."""

    @property
    def fit(self) -> LossFit:
        return self.ranking[self.model].fit

    @property
    def mj4(self) -> LossFit:
        return self.ranking[LossModel.MJ4].fit

    @property
    def usable(self) -> bool:
        """Whether the model holds on most of the map, and that of the motor file is determined by it."""
        return usable_share(self.map, self.fit, self.threshold) >= USEFUL and self.drops_in

    @property
    def drops_in(self) -> bool:
        """Whether there is a set for a crane file: its model is determined, and right on most of the map."""
        fit = self.mj4 if self.law in (MJ4, MAP) else self.fit
        return self.law == MAP or (not fit.confounded and usable_share(self.map, fit, self.threshold) >= USEFUL)


def identify_motor(
    m: LossMap, *, model: LossModel | str | None = None, threshold: float = THRESHOLD, like: str | None = None
) -> MotorLoss:
    """Fit, rank and judge all torque-loss models on a map.

    Parameters
    ----------
    m : LossMap
        Map of the motor.
    model : LossModel or str, optional
        One to look at instead of the recommended one, for the motor file as well; "map": the motor file names the map.
    threshold : float, default 0.01
        Error over nominal torque beyond which a model must not be used [-].
    like : str, optional
        Motor of the library (or path of a motor file) that lends inertia, speed limits and leakage; default one of the
        library of the same size.

    Returns
    -------
    MotorLoss
        Ranking of the models, and the one chosen.

    Raises
    ------
    IdentifyError
        Where the map determines no model or not the one requested.
    SpecError
        For an unknown motor.
    """
    if not 0.0 < threshold < 1.0:
        raise IdentifyError(
            f"threshold = {threshold:g}: give a part of the nominal torque between 0 and 1, such as 0.01."
        )
    chosen = None if model is None or model == MAP else choice(LossModel, model, "model")
    if like is not None:
        load_losses(like)
    ranking = rank_losses(m)
    chosen = chosen or ranking.recommended
    for needed in (chosen, LossModel.MJ4):
        if not any(r.model is needed for r in ranking.ranked):
            raise IdentifyError(f"{m.source}: {len(m)} cells are too few for {needed.value}. Give more of the map.")
    fit, mj4 = ranking[chosen].fit, ranking[LossModel.MJ4].fit
    spread = spread_of_levels(m, mj4)
    lender, others = like if like is not None else _motor_of_this_size(m), borrowed(m)
    return MotorLoss(
        m,
        ranking,
        chosen,
        threshold,
        not_to_be_used(m, fit, threshold),
        not_to_be_used(m, mj4, threshold),
        mj4.covariance if spread is None else spread,
        spread is not None,
        (*_doubts(others), *_notes(m, fit, mj4)),
        others,
        compare_mapped(m, chosen),
        lender,
        MAP if model == MAP else MJ4 if model is None or chosen in BLIND else chosen.value,
    )


def _motor_of_this_size(m: LossMap) -> str | None:
    sizes = {name: abs(library_motor(name).D_max / m.D_max - 1.0) for name in library_motors()}
    name = min(sizes, key=lambda n: sizes[n])
    return name if sizes[name] < SAME_SIZE else None


FAR = 0.05
"""Error over nominal torque that the library's motors, carried over to this size, stay below on each other's maps by
far (they differ by one per cent): a map that is farther from all of them has another kind of motor in it, or another
unit than its heading
says."""


def _doubts(others: tuple[Borrowed, ...]) -> tuple[str, ...]:
    near = min((o.scaled for o in others), default=0.0)
    if near < FAR:
        return ()
    text = (
        f"no motor of the library, carried over to this size, comes nearer than {percent_fixed(near, 0)} of nominal"
        " torque, where similar motors differ by about 1 %: check the units of pressure, speed, displacement and"
        " torque, and whether they are those of one motor"
    )
    return (text,)


def _notes(m: LossMap, fit: LossFit, mj4: LossFit) -> tuple[str, ...]:
    both = (fit,) if fit.model is mj4.model else (fit, mj4)
    lines = [f"{f.card.title}: {line}" for f in both for line in indeterminate(f)]
    ends = ", ".join(" to ".join(show(x, kind, 4) for x in m.range()[name]) for name, kind in AXES.items())
    lines.append(f"the map ends at {ends}: beyond, nothing was tested")
    return tuple(lines)


def loss_set(result: MotorLoss, name: str) -> LossSet:
    """The MJ4 loss and the model that is requested in its place, with everything else that a motor file has, ready for
    `stillhook.library.parameter_sets.set_toml`; a map is named by its file, see `map_table`.

    Errors: IdentifyError where the model is not determined, or no motor lends the rest.
    """
    if not result.drops_in:
        raise IdentifyError(
            f"{result.map.source}: {result.law.upper()} is not determined by this map, or wrong on most of it: there is"
            " no set for a crane. Choose another model, or the map itself."
        )
    if result.like is None:
        size = show(result.map.D_max, "displacement")
        raise IdentifyError(
            f"{result.map.source}: no motor of the library has {size}, and a map contains nothing about inertia, speed"
            " limits and leakage. Name a motor that lends them (like)."
        )
    lender, m, fit = load_losses(result.like), result.map, result.mj4
    prefix = "SYNTHETIC " if m.synthetic else ""
    text = f"MJ4 fitted to {m.source} ({len(m)} cells{', SYNTHETIC, measured on no motor' if m.synthetic else ''})"
    lent = {path: s for path, s in lender.sources.items() if path not in LOSS_RANGE}
    sources = lent | {f"loss.{n}": Source(text=text, kind=SourceKind.FITTED) for n in fit.names}
    loss = TorqueLoss.model_construct(None, **dict(zip(fit.names, map(float, fit.values), strict=True)))
    extra: dict[str, float] = {}
    if abs(lender.motor.D_max / m.D_max - 1.0) > SAME_SIZE:
        extra = {"D_max": m.D_max}
        other = Source(text=f"as {lender.title}, a motor of another size", kind=SourceKind.ASSUMED)
        sources = {k: v if k.startswith("loss.") else other for k, v in sources.items()}
        sources["D_max"] = Source(text=f"largest displacement of {m.source}", kind=SourceKind.FITTED)
    model = None if result.law == MJ4 else _crane_model(result, result.law)
    if model is not None:
        text_of = f"map {m.source}" if result.law == MAP else text.replace("MJ4", result.fit.card.title)
        source = Source(text=text_of, kind=SourceKind.FITTED)
        sources |= {f"loss_model.{field}": source for field in LossTable.model_fields}
    others = [x.value for x in result.ranking.equals if x not in BLIND and x.value != result.law]
    fitted = {law.replace("-", "_"): _crane_model(result, law) for law in others}
    for law in fitted:
        source = Source(text=text.replace("MJ4", law.upper()), kind=SourceKind.FITTED)
        sources |= {f"alternatives.{law}.{field}": source for field in LossTable.model_fields}
    models = {"loss": loss, "loss_model": model, "alternatives": LossAlternatives(**fitted) if fitted else None}
    motor = lender.motor.model_copy(update={**models, **dict.fromkeys(LOSS_RANGE), **extra})
    title = f"{prefix}{lender.title}, torque loss fitted to {m.source}"
    return LossSet(name, title, motor, sources, _evidence(result, text))


MAP_FILE = "map.csv"


def _crane_model(result: MotorLoss, model: str) -> LossTable:
    """The table of a crane file for a model that was fitted, or for the map."""
    law = LossName(model)
    if law == MAP:
        return LossTable.model_construct(None, law=law, map=MAP_FILE, scale=1.0)
    if law == MJ4:
        return LossTable.model_construct(None, law=law, scale=1.0)
    C = tuple(map(float, result.ranking[LossModel(law)].fit.values))
    return LossTable.model_construct(None, law=law, C=C, n_low=result.map.omega_low, scale=1.0)


def map_table(result: MotorLoss) -> str:
    """The map as the table that a crane file names: every combination of its levels."""
    grid, filled = gridded(result.map)
    gaps = f", {filled} combinations interpolated between cells" if filled else ""
    note = f"{'SYNTHETIC ' if result.map.synthetic else ''}map {result.map.source}{gaps}; torque loss of one motor"
    return map_csv(dict(zip((*AXES, "T_f"), map(list, grid), strict=True)), remark_of(note))


def _evidence(result: MotorLoss, text: str) -> Evidence:
    free = [i for i, e in enumerate(result.mj4.errors) if np.isfinite(e)]
    method = "by leaving out displacements in turn" if result.by_levels else "from the residuals"
    matrix = result.covariance[np.ix_(free, free)]
    names = [result.mj4.names[i] for i in free]
    remarks = [*(avoid(s, result.threshold) for s in result.mj4_statements), *result.notes]
    return Evidence.fitted(
        names,
        matrix,
        dof=float(result.mj4.dof),
        data=f"{text}; covariance {method}",
        ranges=result.map.range(),
        statements=remarks,
    )


def avoid(s: Statement, threshold: float) -> str:
    """A region in one line."""
    return (
        f"{s.text}: off by up to {percent_fixed(s.worst, 1)} of nominal torque ({s.bad} of {s.cells} cells beyond"
        f" {percent_fixed(threshold, 1)})"
    )


OF_CARD = ("title", "author", "year", "equation", "validity", "sees_displacement")
"""What a model's card says of it in the numbers of a result."""


def to_dict(result: MotorLoss) -> dict[str, Any]:
    """Everything in SI, ready for JSON."""
    m, r = result.map, result.ranking
    return {
        "map": m.source,
        "synthetic": m.synthetic,
        "cells": len(m),
        "D_max": m.D_max,
        "range": {k: list(v) for k, v in m.range().items()},
        "findings": list(m.findings),
        "rule": r.rule,
        "best": r.best.value,
        "recommended": r.recommended.value,
        "equals": [x.value for x in r.equals],
        "motor_file": result.law,
        "reason": r.reason,
        "model": result.model.value,
        "usable": result.usable,
        "usable_share": usable_share(m, result.fit, result.threshold),
        "threshold": result.threshold,
        "not_to_be_used": [asdict(s) for s in result.statements],
        "mj4_not_to_be_used": [asdict(s) for s in result.mj4_statements],
        "notes": list(result.notes),
        "mj4_covariance": result.covariance.tolist(),
        "mj4_covariance_by_levels": result.by_levels,
        "interpolated_map": None if result.mapped is None else asdict(result.mapped),
        "other_motors": [asdict(o) for o in result.others],
        "models": [
            {
                "model": x.model.value,
                **{name: getattr(x.fit.card, name) for name in OF_CARD},
                **{name: getattr(x, name) for name in ("eligible", "reason", "cv")},
                "cv_by_axis": dict(x.cv_by_axis),
                "normalised_fixed": None if x.fixed is None else x.fixed.normalised,
                **{name: getattr(x.fit, name) for name in ("normalised", "rms", "rms_share", "aicc")},
                "at_bound": list(x.fit.at_bound),
                "confounded": [list(g) for g in x.fit.confounded],
                "parameters": {
                    name: {"value": float(v), "standard_error": float(e), "unit": unit}
                    for name, unit, v, e in zip(x.fit.names, x.fit.card.units, x.fit.values, x.fit.errors, strict=True)
                },
                "covariance": x.fit.covariance.tolist(),
                "correlation": x.fit.correlation.tolist(),
            }
            for x in r.ranked
        ],
    }


RANKING_HEADER = (
    "model",
    "eq.",
    "para-\nmeters",
    "fixed D:\nerror",
    "all D:\nerror",
    "left out:\n% of T_N",
    "AICc\nless best",
    "status",
)
OTHERS_HEADER = ("MJ4 parameters of", "error as printed\n[% of T_N]", "scaled to\nthis size")
PARAMETER_HEADER = ("parameter", "value", "standard error", "of levels", "unit", "status")
ERROR = "Error: sum of squared errors over sum of squared torque losses. T_N: mean nominal torque D dp of the map."
STANDARD_ERROR = (
    "Standard error: as if the errors of all cells were independent. Of levels: how far the parameter moves when"
    " displacements are left out in turn; wider, because a model that is not quite right deviates alike in neighbouring"
    " cells."
)
SYNTHETIC = (
    "SYNTHETIC: this map was made by a formula and measured on no motor. No number on this page may be used for a real"
    " one."
)
CAPTIONS = {
    "ranking": (
        "Error of each model, number of parameters in brackets. Below right: error on levels that the fit has not seen."
    ),
    "terms": "What the loss is made of, summed over the speeds.",
    "terms-over-speed": "What the loss is made of, over the speed.",
    "residuals-over-speed": "Map less model. Grey: the threshold. Above: half displacement and more; below: less.",
    "residuals-over-map": "Largest error in each box; the other setting takes all its values.",
    "model-and-map": "Dashed: the model beyond the map. Dotted: the interpolated map, which holds its edge there.",
}


def _ranking(result: MotorLoss) -> list[list[str]]:
    """All models, best first: errors, and remarks."""
    ranked = result.ranking.ranked
    least = min(r.fit.aicc for r in ranked)
    rows = []
    for r in ranked:
        card = r.fit.card
        remarks = {
            "recommended": r.model is result.ranking.recommended,
            "best": r.model is result.ranking.best,
            r.reason: bool(r.reason),
            "does not see the displacement": not card.sees_displacement,
            f"{', '.join(r.fit.at_bound)} at bound": bool(r.fit.at_bound),
        }
        fixed = EMPTY if r.fixed is None else f"{r.fixed.normalised:.2e}"
        errors = [fixed, f"{r.fit.normalised:.2e}", percent_fixed(r.cv), f"{r.fit.aicc - least:.0f}"]
        status = "; ".join(text for text, applies in remarks.items() if applies)
        rows.append([card.title, card.equation, str(len(card.names)), *errors, status])
    return rows


def _parameters(result: MotorLoss, fit: LossFit) -> list[list[str]]:
    """Parameters of one fit with their standard errors, SI."""
    wide = result.covariance.diagonal() if fit.model is LossModel.MJ4 and result.by_levels else None
    rows = []
    for i, (name, unit) in enumerate(zip(fit.names, fit.card.units, strict=True)):
        error = float(fit.errors[i])
        remark = "" if math.isfinite(error) else "cannot be distinguished from others"
        if name in fit.at_bound:
            remark = "at its bound"
        spread = math.nan if wide is None or not math.isfinite(error) else math.sqrt(wide[i])
        rows.append([name, number(float(fit.values[i]), 4), fmt(error, digits=2), fmt(spread, digits=2), unit, remark])
    return rows


def _verdict(result: MotorLoss) -> Verdict:
    share = usable_share(result.map, result.fit, result.threshold)
    within, cells = percent_fixed(result.threshold, 1), percent_fixed(share, 1)
    text = f"{result.fit.card.title} is within {within} of nominal torque on {cells} of the map's cells."
    if share < USEFUL:
        return Verdict(f"NO: {text} No model of this motor comes from this map.", passed=False)
    if not result.drops_in:
        reason = f"But {result.law.upper()}, for the motor file, is not determined by this map, or wrong on most of it."
        return Verdict(f"NO: {text} {reason}", passed=False)
    return Verdict(text, passed=True)


def _twin(result: MotorLoss) -> str:
    """What the twin runs, where that is another model than the one that is recommended."""
    r, equals = result.ranking, [CARDS[x].title for x in result.ranking.equals]
    alike = f" Equally good by the rule: {', '.join(equals)}." if len(equals) > 1 else ""
    if result.law != MJ4:
        what = "the map itself" if result.law == MAP else CARDS[LossModel(result.law)].title
        return f"The motor file names {what}, as requested, and the twin runs it.{alike}"
    if result.model is LossModel.MJ4:
        return f"The twin runs MJ4: the motor file holds this fit.{alike}"
    return (
        f"The twin runs MJ4 unless the motor file names another model (--model), so it holds MJ4"
        f" ({percent_fixed(r[LossModel.MJ4].cv)} on levels left out), not {result.fit.card.title}"
        f" ({percent_fixed(r[result.model].cv)}).{alike}"
    )


def _mapped(result: MotorLoss) -> str:
    """How the interpolated map compares with the model on levels that were left out."""
    c = result.mapped
    if c is None:
        return "Interpolated map: too few levels to compare it with the model."
    between = f"{percent_fixed(c.mapped_between)} against {percent_fixed(c.fitted_between)}"
    beyond = f"{percent_fixed(c.mapped_beyond)} against {percent_fixed(c.fitted_beyond)}"
    return (
        f"Interpolated map against {result.fit.card.title}, on levels left out, in % of the mean nominal torque:"
        f" between the other levels {between}; beyond them, where the map holds its edge, {beyond}."
    )


def _map(m: LossMap) -> list[str]:
    count = levels_of(m)
    ends = [
        f"{AXIS_NAMES[n]} {show(lo, AXES[n], 4)} to {show(hi, AXES[n], 4)} ({count[n]} levels)"
        for n, (lo, hi) in m.range().items()
    ]
    return [f"{len(m)} cells: {', '.join(ends)}", *m.findings]


def report(result: MotorLoss, pictures: Mapping[str, bytes]) -> Document:
    """The report; pictures (PNG) by the stems of `stillhook.identify.motor.figures.figures`."""
    r, card = result.ranking, result.fit.card
    best = next(i for i, x in enumerate(r.ranked) if x.model is result.model)
    borders = [avoid(s, result.threshold) for s in result.statements]
    nowhere = f"no cell of the map is beyond {percent_fixed(result.threshold, 1)}"
    others = [("fitted to this map", percent_fixed(result.mj4.rms_share), EMPTY)]
    others += [(o.name, percent_fixed(o.unscaled), percent_fixed(o.scaled)) for o in result.others]
    sections = [
        Section("The map", [Bullets(_map(result.map))]),
        Section("Models", [Text(r.rule), Table(RANKING_HEADER, _ranking(result), bold_rows=[best]), Text(ERROR)]),
        Section(
            f"Parameters of {card.title} (paper {card.equation}), SI",
            [
                Table(PARAMETER_HEADER, _parameters(result, result.fit)),
                Text(f"Holds: {card.validity}."),
                Text(STANDARD_ERROR),
            ],
        ),
        *_mj4(result),
        Section("Where it must not be used", [Bullets([*(borders or [nowhere]), *result.notes])]),
        Section("The map itself as a model", [Text(_mapped(result))]),
        Section("What the parameters of other motors would cost here", [Table(OTHERS_HEADER, others)]),
        *([Section("Figures", [Figure(png, CAPTIONS[stem]) for stem, png in pictures.items()])] if pictures else []),
    ]
    return Document(
        title="Torque loss of a motor",
        name=result.map.source,
        marks=[SYNTHETIC] if result.map.synthetic else [],
        front=[_verdict(result), Text(f"Recommended: {r.reason}."), Text(_twin(result))],
        sections=sections,
    )


def _mj4(result: MotorLoss) -> list[Section]:
    """The model that the twin runs, where another one is recommended."""
    if result.model is LossModel.MJ4:
        return []
    borders = Bullets([avoid(s, result.threshold) for s in result.mj4_statements])
    return [Section("MJ4, which the twin runs", [Table(PARAMETER_HEADER, _parameters(result, result.mj4)), borders])]
