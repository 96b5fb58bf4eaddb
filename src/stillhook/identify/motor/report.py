"""The result of `identify_motor` in words and tables, for a terminal and for a page that a colleague can read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from stillhook.identify.motor.fit import LossFit
from stillhook.identify.motor.identify import USEFUL, MotorLoss, avoid
from stillhook.identify.motor.map import AXES
from stillhook.identify.motor.models import LossModel
from stillhook.identify.motor.rank import levels_of, percent, usable_share
from stillhook.report.html import bullets, heading, page, paragraph, picture, table
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
PARAMETER_HEADER = ("parameter", "value", "standard error", "of levels", "unit", "status")
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


def ranking_rows(result: MotorLoss) -> list[list[str]]:
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
        fixed = "-" if r.fixed is None else f"{r.fixed.normalised:.2e}"
        cv = "-" if not math.isfinite(r.cv) else percent(r.cv)
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


def parameter_rows(result: MotorLoss, fit: LossFit) -> list[list[str]]:
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


def verdict(result: MotorLoss) -> str:
    share = usable_share(result.map, result.fit, result.threshold)
    title = result.fit.card.title
    text = (
        f"{title} is within {percent(result.threshold, 1)} of nominal torque on {percent(share, 1)} of the map's cells."
    )
    if share < USEFUL:
        return f"NO: {text} No model of this motor comes from this map."
    if not result.drops_in:
        return f"NO: {text} But MJ4, which the twin runs, is not determined by this map, or wrong on most of it."
    return text


def twin_line(result: MotorLoss) -> str:
    """What the twin runs, where that is another model than the one that is recommended."""
    if result.model is LossModel.MJ4:
        return "The twin runs MJ4: the motor file holds this fit."
    r = result.ranking
    return (
        f"The twin runs MJ4, so the motor file holds MJ4 ({percent(r[LossModel.MJ4].cv)} on levels left out), not"
        f" {result.fit.card.title} ({percent(r[result.model].cv)})."
    )


def mapped_line(result: MotorLoss) -> str:
    """How the interpolated map compares with the model on levels that were left out."""
    c = result.mapped
    if c is None:
        return "Interpolated map: too few levels to compare it with the model."
    title = result.fit.card.title
    return (
        f"Interpolated map against {title}, on levels left out, in % of the mean nominal torque: between the other"
        f" levels {percent(c.mapped_between)} against {percent(c.fitted_between)}; beyond them, where the map holds its"
        f" edge, {percent(c.mapped_beyond)} against {percent(c.fitted_beyond)}."
    )


def other_rows(result: MotorLoss) -> Iterable[Sequence[str]]:
    refitted = result.mj4.rms_share
    yield "fitted to this map", percent(refitted), "-"
    for o in result.others:
        yield o.name, percent(o.unscaled), percent(o.scaled)


def map_lines(result: MotorLoss) -> list[str]:
    m, count = result.map, levels_of(result.map)
    ends = [
        f"{AXIS_NAMES[n]} {show(lo, AXES[n], 4)} to {show(hi, AXES[n], 4)} ({count[n]} levels)"
        for n, (lo, hi) in m.range().items()
    ]
    return [f"{len(m)} cells: {', '.join(ends)}", *m.findings]


def report(result: MotorLoss, pictures: Mapping[str, bytes]) -> str:
    """The page as text; pictures (PNG) by the stems of `motor_figures.figures`."""
    r, m = result.ranking, result.map
    chosen = next(i for i, x in enumerate(r.ranked) if x.model is result.model)
    borders = [avoid(s, result.threshold) for s in result.statements]
    mj4 = (
        []
        if result.model is LossModel.MJ4
        else [
            heading("MJ4, which the twin runs"),
            table(PARAMETER_HEADER, parameter_rows(result, result.mj4)),
            bullets(avoid(s, result.threshold) for s in result.mj4_statements),
        ]
    )
    parts = [
        paragraph(verdict(result), no=not result.usable),
        paragraph(f"Recommended: {r.reason}."),
        paragraph(twin_line(result)),
        heading("The map"),
        bullets(map_lines(result)),
        heading("Models"),
        paragraph(r.rule),
        table(
            tuple(h.replace("-\n", "").replace("\n", " ") for h in RANKING_HEADER), ranking_rows(result), chosen=chosen
        ),
        paragraph(
            "Error: sum of squared errors over sum of squared torque losses. T_N: mean nominal torque D dp of the map."
        ),
        heading(f"Parameters of {result.fit.card.title} (paper {result.fit.card.equation}), SI"),
        table(PARAMETER_HEADER, parameter_rows(result, result.fit)),
        paragraph(f"Holds: {result.fit.card.validity}."),
        paragraph(
            "Standard error: as if the errors of all cells were independent. Of levels: how far the parameter moves"
            " when displacements are left out in turn; wider, because a model that is not quite right deviates alike in"
            " neighbouring cells."
        ),
        *mj4,
        heading("Where it must not be used"),
        bullets([*(borders or [f"no cell of the map is beyond {percent(result.threshold, 1)}"]), *result.notes]),
        heading("The map itself as a model"),
        paragraph(mapped_line(result)),
        heading("What the parameters of other motors would cost here"),
        table(("MJ4 parameters of", "error as printed [% of T_N]", "scaled to this size"), other_rows(result)),
        heading("Figures"),
        *(picture(png, CAPTIONS[stem]) for stem, png in pictures.items()),
    ]
    return page(f"Torque loss of a motor: {m.source}", parts, synthetic=SYNTHETIC if m.synthetic else "")
