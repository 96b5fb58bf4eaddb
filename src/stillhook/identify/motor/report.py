"""The result of `identify_motor` as a document."""

from __future__ import annotations

import math
from collections.abc import Mapping

from stillhook.identify.motor.fit import LossFit
from stillhook.identify.motor.identify import USEFUL, MotorLoss, avoid
from stillhook.identify.motor.map import AXES
from stillhook.identify.motor.models import LossModel
from stillhook.identify.motor.rank import levels_of, usable_share
from stillhook.report.document import Bullets, Document, Figure, Section, Table, Text, Verdict
from stillhook.report.formatting import EMPTY, percent_fixed
from stillhook.units import number, show

AXIS_NAMES = {"D_m": "displacement", "omega_m": "speed", "dp_m": "pressure drop"}
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
        remark = [
            *(["recommended"] if r.model is result.ranking.recommended else []),
            *(["best"] if r.model is result.ranking.best else []),
            *([r.reason] if r.reason else []),
            *([] if r.fit.card.sees_displacement else ["does not see the displacement"]),
            *([f"{', '.join(r.fit.at_bound)} at bound"] if r.fit.at_bound else []),
        ]
        fixed = EMPTY if r.fixed is None else f"{r.fixed.normalised:.2e}"
        cv = percent_fixed(r.cv) if math.isfinite(r.cv) else EMPTY
        card, all_data = r.fit.card, f"{r.fit.normalised:.2e}"
        rows.append(
            [
                card.title,
                card.equation,
                str(len(card.names)),
                fixed,
                all_data,
                cv,
                f"{r.fit.aicc - least:.0f}",
                "; ".join(remark),
            ]
        )
    return rows


def _parameters(result: MotorLoss, fit: LossFit) -> list[list[str]]:
    """Parameters of one fit with their standard errors, SI."""
    wide = result.covariance.diagonal() if fit.model is LossModel.MJ4 and result.by_levels else None
    rows = []
    for i, p in enumerate(fit.card.parameters):
        error = fit.errors[i]
        remark = (
            "at its bound"
            if p.name in fit.at_bound
            else ""
            if math.isfinite(error)
            else "cannot be distinguished from others"
        )
        spread = "-" if wide is None or not math.isfinite(error) else number(math.sqrt(wide[i]), 2)
        stated = number(float(error), 2) if math.isfinite(error) else "-"
        rows.append([p.name, number(float(fit.values[i]), 4), stated, spread, p.unit, remark])
    return rows


def _verdict(result: MotorLoss) -> Verdict:
    """Whether a model of this motor comes from the map."""
    share = usable_share(result.map, result.fit, result.threshold)
    within, cells = percent_fixed(result.threshold, 1), percent_fixed(share, 1)
    text = f"{result.fit.card.title} is within {within} of nominal torque on {cells} of the map's cells."
    if share < USEFUL:
        return Verdict(f"NO: {text} No model of this motor comes from this map.", passed=False)
    if not result.drops_in:
        reason = "But MJ4, which the twin runs, is not determined by this map, or wrong on most of it."
        return Verdict(f"NO: {text} {reason}", passed=False)
    return Verdict(text, passed=True)


def _twin(result: MotorLoss) -> str:
    """What the twin runs, where that is another model than the one that is recommended."""
    if result.model is LossModel.MJ4:
        return "The twin runs MJ4: the motor file holds this fit."
    r = result.ranking
    return (
        f"The twin runs MJ4, so the motor file holds MJ4 ({percent_fixed(r[LossModel.MJ4].cv)} on levels left out), not"
        f" {result.fit.card.title} ({percent_fixed(r[result.model].cv)})."
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


def _other_motors(result: MotorLoss) -> list[tuple[str, str, str]]:
    """What the parameters of other motors would cost on this map."""
    fitted = ("fitted to this map", percent_fixed(result.mj4.rms_share), EMPTY)
    return [fitted, *((o.name, percent_fixed(o.unscaled), percent_fixed(o.scaled)) for o in result.others)]


def _map(result: MotorLoss) -> list[str]:
    m, count = result.map, levels_of(result.map)
    ends = [
        f"{AXIS_NAMES[n]} {show(lo, AXES[n], 4)} to {show(hi, AXES[n], 4)} ({count[n]} levels)"
        for n, (lo, hi) in m.range().items()
    ]
    return [f"{len(m)} cells: {', '.join(ends)}", *m.findings]


def report(result: MotorLoss, pictures: Mapping[str, bytes]) -> Document:
    """The report; pictures (PNG) by the stems of `motor_figures.figures`."""
    r, card = result.ranking, result.fit.card
    best = next(i for i, x in enumerate(r.ranked) if x.model is result.model)
    borders = [avoid(s, result.threshold) for s in result.statements]
    nowhere = f"no cell of the map is beyond {percent_fixed(result.threshold, 1)}"
    sections = [
        Section("The map", [Bullets(_map(result))]),
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
        Section("What the parameters of other motors would cost here", [Table(OTHERS_HEADER, _other_motors(result))]),
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
