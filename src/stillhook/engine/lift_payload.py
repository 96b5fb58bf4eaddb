"""A payload as the kernels read it: one record, and its numbers at even levels of submergence."""

import math

import numpy as np
from numpy.typing import NDArray

from stillhook.errors import LiftError
from stillhook.lift.payload import Payload
from stillhook.physics import payload as kernel
from stillhook.physics.payload import LEVELS
from stillhook.physics.scalar import G
from stillhook.units import show

COLUMNS = len(kernel.Wetted._fields)
"""Numbers of a level, in the order of `Wetted`: V, A33, dA33, B."""
PLAIN_DRAG_GROWTH = 1.0
"""Growth of the drag at touch-down for payloads without hatches (assumed): the water has to leave sideways."""


def pack_payload(payload: Payload, rho: float, depth: float) -> tuple[kernel.Payload, NDArray[np.float64]]:
    """The record and the levels (LEVELS, 4) of a payload over a seabed `depth` [m] down, in water of density rho [kg/m^3].

    Row j holds `Wetted` at submergence j reach / (LEVELS - 1). Errors: LiftError where the payload floats.
    """
    reach = level_reach(payload, rho)
    h = np.linspace(0.0, reach, LEVELS)
    at = payload.at(h, rho)
    rows = np.zeros((LEVELS, COLUMNS))
    rows[:, 0], rows[:, 1], rows[:, 3] = at.V, at.A33, 0.5 * rho * payload.C_D * at.A_p
    rows[:-1, 2] = np.diff(at.A33) / np.diff(h)
    W_sub = submerged_weight(payload, rho)
    bed = payload.seabed
    k_soil = W_sub / bed.settlement
    A33 = float(at.A33[-1]) * (1.0 + bed.added_mass)
    gap_0 = bed.gap if bed.gap is not None else mouth(payload, rho)
    vent = 0.0 if payload.shape is None else payload.shape.vent_gap
    record = kernel.Payload(
        m=payload.mass,
        W=payload.mass * G,
        H=payload.height,
        rho=rho,
        g=G,
        C_lin=payload.C_lin,
        depth=depth,
        k_soil=k_soil,
        c_soil=2.0 * bed.zeta * math.sqrt(k_soil * (payload.mass + A33)),
        gap_0=gap_0,
        gap_B=gap_0 if vent <= 0.0 else vent,
        bottom_A=bed.added_mass,
        bottom_B=drag_growth(payload, float(rows[-1, 3]), rho),
        reach=reach,
        i_dh=(LEVELS - 1) / reach,
    )
    return record, rows


def level_reach(payload: Payload, rho: float) -> float:
    """Submergence of the last level [m]: nothing changes beyond it, and the first face that hits water lies on a level."""
    reach = payload.reach(rho)
    contact = 0.0 if payload.shape is None else payload.shape.contact
    before = math.floor(contact / reach * (LEVELS - 1))
    return contact * (LEVELS - 1) / before if before > 0 else reach


def submerged_weight(payload: Payload, rho: float) -> float:
    """Weight less buoyancy of the covered payload [N]. Errors: LiftError where it floats."""
    V = payload.covered(rho).V
    if rho * V >= payload.mass:
        weighs, displaces = show(payload.mass, "mass"), show(rho * V, "mass")
        raise LiftError(
            f'Payload "{payload.name}": it floats, for it weighs {weighs} and displaces {displaces} of water. '
            "Give a larger mass or a smaller volume."
        )
    return (payload.mass - rho * V) * G


def mouth(payload: Payload, rho: float) -> float:
    """Height over the seabed at which the gap under the payload is as wide as its underside [m]: area over perimeter."""
    if payload.shape is not None:
        return payload.shape.mouth
    A_p = payload.covered(rho).A_p
    return 0.5 * math.sqrt(A_p / math.pi) if A_p > 0.0 else payload.height


def drag_growth(payload: Payload, B: float, rho: float) -> float:
    """Growth of the drag at touch-down [-]: as given, else so that all water under it leaves through its hatches, else assumed."""
    if payload.seabed.drag is not None:
        return payload.seabed.drag
    vent = 0.0 if payload.shape is None else payload.shape.vent_drag(rho)
    return max(vent / B - 1.0, 0.0) if vent > 0.0 and B > 0.0 else PLAIN_DRAG_GROWTH
