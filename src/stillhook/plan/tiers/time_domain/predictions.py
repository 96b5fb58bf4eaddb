"""What cheaper methods predict of the limits that the twin's tier looks for."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from stillhook.plan.definition.rules import Alternative, Tier
from stillhook.plan.limits import Limits
from stillhook.plan.tiers.time_domain.placing import Column


def predicted_by_rule(predicted: Sequence[Limits]) -> dict[tuple[str, Alternative, str], dict[Column, float]]:
    """(phase, alternative, rule) -> predicted limits [m] by column: frequency-domain method, else closed form."""
    result: dict[tuple[str, Alternative, str], dict[Column, float]] = {}
    for tier in (Tier.CLOSED_FORM, Tier.FREQUENCY):
        for limits in (p for p in predicted if p.tier is tier):
            for rule, Hs in limits.Hs.items():
                rows = zip(limits.Tp, limits.beta, Hs, strict=True)
                known = {(float(T), float(beta)): float(h) for T, beta, h in rows if math.isfinite(h)}
                result.setdefault((limits.phase, limits.alternative, rule), {}).update(known)
    return result


def least_predicted(predicted: Sequence[Limits]) -> dict[tuple[str, Alternative, Column], tuple[float, Tier]]:
    """(phase, alternative, column) -> lowest predicted limit [m] and its tier: frequency-domain method, else closed
    form."""
    result: dict[tuple[str, Alternative, Column], tuple[float, Tier]] = {}
    for tier in (Tier.CLOSED_FORM, Tier.FREQUENCY):
        for limits in (p for p in predicted if p.tier is tier):
            table = [np.where(np.isnan(row), np.inf, row) for row in limits.Hs.values() if not np.isnan(row).all()]
            if not table:
                continue
            least = np.min(table, axis=0)
            for T, beta, Hs in zip(limits.Tp, limits.beta, least, strict=True):
                result[limits.phase, limits.alternative, (float(T), float(beta))] = float(Hs), tier
    return result
