"""The interpolated map as a rival of a fitted model: which is better between measured levels, and which beyond them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from stillhook.identify.motor.fit import fit_loss
from stillhook.identify.motor.map import LossMap, mapped_loss
from stillhook.identify.motor.models import LossModel
from stillhook.identify.motor.rank import folds


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
    for _, _, excluded in folds(m):
        rest, away = m.at(~excluded), m.at(excluded)
        if len(rest) <= len(complete.names):
            return None
        mapped, inside = mapped_loss(rest)(away.omega_m, away.D_m, away.dp_m)
        fitted = fit_loss(rest, model, near=complete).torque(away.omega_m, away.D_m, away.dp_m)
        off = np.column_stack((mapped - away.T_f, fitted - away.T_f))
        between.append(off[inside])
        beyond.append(off[~inside])
    sets = [np.concatenate(x) if x else np.zeros((0, 2)) for x in (between, beyond)]
    if not all(len(x) for x in sets):
        return None
    share = [math.sqrt(float(np.mean(x[:, i] ** 2))) / float(m.T_N.mean()) for i in (0, 1) for x in sets]
    return Compared(*share)
