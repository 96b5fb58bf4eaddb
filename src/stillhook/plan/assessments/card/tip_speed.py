"""Speed of the crane tip as a limit in real time: how much of it a sea makes, and whether it protects a phase."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.plan.assessments.card.claim import parts_of
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.sea.vessel.rao import wavenumber
from stillhook.sea.vessel.realisation import decay
from stillhook.sea.vessel.tip import TipResponse, tip_response
from stillhook.spec.lift.joining import IN_AIR
from stillhook.spec.lift.phase import Phase

PROTECTS = 0.5
"""Share of the tip in the relative velocity between load and water from which on a limit of its speed protects."""
UNIT = 1.0
"""Height of the sea [m] for speeds per metre."""


def share_of_tip(tip: TipResponse, z: float, depth: float) -> float:
    r"""Part of the variance of the relative velocity between load and water that is due to the crane tip [-], without
    compensation.

    .. math:: \frac{\sigma_{tip}^2}{\sigma_{tip}^2 + \sigma_w^2(z)}, \quad
       \sigma_w^2 = \int \omega^2 e^{2kz} S(\omega)\,d\omega

    Parameters: tip in a sea; z height of the load, negative below the surface [m]; depth of the water [m]. Tip and
    water are taken as independent: what they have in common depends on the place of the load under the tip.
    """
    surface = tip.weight * tip.omega**2 * tip.S_wave
    water = float(np.sum(surface * decay(wavenumber(tip.omega, depth), np.array([z]), depth)[0] ** 2))
    return tip.sigma_v**2 / (tip.sigma_v**2 + water) if tip.sigma_v > 0.0 else 0.0


def per_metre(plan: LiftPlan) -> list[dict[str, Any]]:
    """Standard deviation of the tip's speed in a sea of 1 m, each heading and period, over its lowering place."""
    at, env = plan.tip_of(plan.phases[-1]), plan.environment
    return [
        {"beta": beta, "T_p": Tp, "sigma_v": tip_response(plan.vessel, env.sea(UNIT, Tp, beta), at.x, at.y).sigma_v}
        for beta in env.headings
        for Tp in env.Tp
    ]


def in_phases(plan: LiftPlan, limits: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, list[dict[str, Any]]]:
    """Of every part of the lift in water and every period: share of the tip, the least over phases and headings;
    whether a limit of its speed protects; sigma_v, the speed that the tip has at the limit of the worst heading, the
    least over all headings [m/s]: a smaller speed stops the lift earlier.

    limits: cells of each part, `stillhook.plan.assessments.card.claim.cells_of`.
    """
    out: dict[str, list[dict[str, Any]]] = {}
    for part, phases in parts_of(plan).items():
        wet = [phase for phase in phases if phase.kind not in IN_AIR]
        if wet:
            out[part] = [_at_limit(plan, wet, Tp, limits[part]) for Tp in plan.environment.Tp]
    return out


def _at_limit(plan: LiftPlan, phases: Sequence[Phase], Tp: float, cells: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    heights = [cell["Hs_limit"] for cell in cells if cell["T_p"] == Tp]
    known = [Hs for Hs in heights if Hs is not None]
    Hs = min(known) if len(known) == len(heights) else 0.0
    shares, speeds = [], []
    for beta in plan.environment.headings:
        sea = plan.environment.sea(Hs or UNIT, Tp, beta)
        for x, y, z in {(*_place(plan, phase), _shallowest(phase)) for phase in phases}:
            tip = tip_response(plan.vessel, sea, x, y)
            shares.append(share_of_tip(tip, z, plan.depth))
            speeds.append(tip.sigma_v)
    share = min(shares)
    return {"T_p": Tp, "Hs_limit": Hs, "share": share, "protects": share >= PROTECTS, "sigma_v": min(speeds)}


def _place(plan: LiftPlan, phase: Phase) -> tuple[float, float]:
    at = plan.tip_of(phase)
    return at.x, at.y


def _shallowest(phase: Phase) -> float:
    """Least depth of the payload's underside in a phase, as a height [m]; 0 at the surface."""
    return min(0.0, max(z for z in (phase.z_start, phase.z_end) if z is not None))
