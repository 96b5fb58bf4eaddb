"""Speed of the crane tip as a limit in real time: how much of it a sea makes, and whether it protects a phase."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.plan.assessments.card.claim import parts_of
from stillhook.plan.definition.lift_plan import LiftPlan
from stillhook.response.forcing import Forcing, forcing_of_seas
from stillhook.sea.spectra.spectrum import Sea
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.rao import wavenumber
from stillhook.sea.vessel.realisation import decay
from stillhook.spec.lift.joining import IN_AIR
from stillhook.spec.lift.phase import Phase

PROTECTS = 0.5
"""Share of the tip in the relative velocity between load and water from which on a limit of its speed protects."""
UNIT = 1.0
"""Height of the sea [m] for speeds per metre."""


def share_of_tip(forcing: Forcing, z: float, depth: float) -> FloatArray:
    r"""Part of the variance of the relative velocity between load and water that is due to the crane tip [-], of n seas
    (n,), without compensation.

    .. math:: \frac{\sigma_{tip}^2}{\sigma_{tip}^2 + \sigma_w^2(z)}, \quad
       \sigma_w^2 = \int \omega^2 e^{2kz} S(\omega)\,d\omega

    Parameters: forcing by the seas; z height of the load, negative below the surface [m]; depth of the water [m]. Tip
    and water are taken as independent: what they have in common depends on the place of the load under the tip.
    """
    under = decay(wavenumber(forcing.omega, depth), np.array([z]), depth)[0]
    water, tip = forcing.wave @ (forcing.omega * under) ** 2, forcing.deviation(1) ** 2
    return np.asarray(np.divide(tip, tip + water, out=np.zeros_like(tip), where=tip > 0.0))


def per_metre(plan: LiftPlan) -> list[dict[str, Any]]:
    """Standard deviation of the tip's speed in a sea of 1 m, each heading and period, over its lowering place."""
    env = plan.environment
    cells = [(beta, Tp) for beta in env.headings for Tp in env.Tp]
    at = plan.tip_of(plan.phases[-1])
    speeds = _forcing(plan, [env.sea(UNIT, Tp, beta) for beta, Tp in cells], at).deviation(1)
    return [{"beta": beta, "T_p": Tp, "sigma_v": float(v)} for (beta, Tp), v in zip(cells, speeds, strict=True)]


def _forcing(plan: LiftPlan, seas: Sequence[Sea], at: TipPoint) -> Forcing:
    return forcing_of_seas(seas, plan.vessel, at.x, at.y, depth=plan.depth)


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
            out[part] = _at_limit(plan, wet, limits[part])
    return out


def _at_limit(plan: LiftPlan, phases: Sequence[Phase], cells: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    env = plan.environment
    heights = []
    for Tp in env.Tp:
        of = [cell["Hs_limit"] for cell in cells if cell["T_p"] == Tp]
        heights.append(0.0 if None in of else min(of))
    seas = [env.sea(Hs or UNIT, Tp, beta) for Hs, Tp in zip(heights, env.Tp, strict=True) for beta in env.headings]
    shape = (len(env.Tp), len(env.headings))
    shares, speeds = [], []
    for at, z in dict.fromkeys((plan.tip_of(phase), _shallowest(phase)) for phase in phases):
        forcing = _forcing(plan, seas, at)
        shares.append(share_of_tip(forcing, z, plan.depth).reshape(shape).min(axis=1))
        speeds.append(forcing.deviation(1).reshape(shape).min(axis=1))
    rows = zip(env.Tp, heights, np.min(shares, axis=0).tolist(), np.min(speeds, axis=0).tolist(), strict=True)
    return [
        {"T_p": Tp, "Hs_limit": Hs, "share": share, "protects": share >= PROTECTS, "sigma_v": v}
        for Tp, Hs, share, v in rows
    ]


def _shallowest(phase: Phase) -> float:
    """Least depth of the payload's underside in a phase, as a height [m]; 0 at the surface."""
    return min(0.0, max(z for z in (phase.z_start, phase.z_end) if z is not None))
