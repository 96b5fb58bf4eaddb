"""A payload through the surface: added mass against printed values, drops against an independent solution, a lowering
against statics."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from blocks import Blocks
from scipy.integrate import solve_ivp

from stillhook import load_crane
from stillhook.engine.pack.payload import COLUMNS, pack_payload, wetted_at
from stillhook.engine.simulate import simulate
from stillhook.library.catalogue import read_payload
from stillhook.physics.load_path import payload as phys
from stillhook.physics.load_path.payload import Water
from stillhook.physics.scalar import G
from stillhook.spec.lift import shapes as formula
from stillhook.spec.lift.lowering import Lowering
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase

RHO = 1025.0
PLATES = ((1.25, 0.642), (1.5, 0.690), (2.5, 0.801), (4.0, 0.872), (6.25, 0.917), (8.0, 0.934))
"""b/a and C_A of rectangular plates that the package does not keep. DNV-RP-H103, appendix A."""
PRISMS = ((1.0, 0.68), (2.0, 0.36), (3.0, 0.24))
"""Height over side and C_A, on the volume, of square prisms that move along their axis. DNV-RP-H103, appendix A."""
DROPS = {"mud-mat-25t": 12.0, "ventilated-box-30t": 12.0, "suction-anchor-85t": 12.0}
"""Payload -> time that is followed [s]."""
FALL = 1.0  # m, underside above still water
STILL = Water(*[0.0] * len(Water._fields))
STEP = 1e-3
SPEED = 0.5  # m/s


class Drop(NamedTuple):
    """Depth and speed of a payload let go, as the kernels' forces have it, and as the balance of momentum; U_smooth
    with smooth curves."""

    t: np.ndarray
    h: np.ndarray
    U: np.ndarray
    h_exact: np.ndarray
    U_exact: np.ndarray
    U_smooth: np.ndarray


def wet_at(z: float, record: Any, rows: np.ndarray) -> Any:
    return wetted_at(phys.submergence(z, 0.0, record.reach), rows)


def acceleration(z: float, v: float, record: Any, rows: np.ndarray) -> float:
    f = phys.water_force(z, v, wet_at(z, record, rows), STILL, record)
    return float((f.buoyancy + f.inertia + f.drag + f.slam + f.bottom - record.W) / (record.m + f.m_a))


def drop(load: Payload, duration: float) -> Drop:
    """Free fall from FALL above still water, deep water."""
    record, rows = pack_payload(load, RHO, 1e4)
    z, v, out = FALL, 0.0, []
    times = np.arange(round(duration / STEP) + 1) * STEP
    for _ in times:
        out.append((-z, -v))
        k_1 = acceleration(z, v, record, rows)
        k_2 = acceleration(z + v * STEP / 2, v + k_1 * STEP / 2, record, rows)
        k_3 = acceleration(z + v * STEP / 2 + k_1 * STEP**2 / 4, v + k_2 * STEP / 2, record, rows)
        k_4 = acceleration(z + v * STEP + k_2 * STEP**2 / 2, v + k_3 * STEP, record, rows)
        z, v = z + v * STEP + (k_1 + k_2 + k_3) * STEP**2 / 6, v + (k_1 + 2 * k_2 + 2 * k_3 + k_4) * STEP / 6
    h, U = np.array(out).T
    h_exact, U_exact = by_momentum(load, times, smooth=False)
    return Drop(times, h, U, h_exact, U_exact, by_momentum(load, times, smooth=True)[1])


def by_momentum(load: Payload, times: np.ndarray, *, smooth: bool) -> tuple[np.ndarray, np.ndarray]:
    """d/dt (m + A33) U = m g - buoyancy - drag, A33 its smooth curve, adaptive steps of high order; U is momentum over
    mass.

    smooth: volume and drag from their smooth curves as well, else from the levels.
    """
    fine, rows = load.curve(RHO, 20_001), pack_payload(load, RHO, 1e4)[1]
    of_levels = tuple(rows[:, COLUMNS.index(name)] for name in ("h", "V", "B"))
    h_V, V, B = (fine.h, fine.V, 0.5 * RHO * load.C_D * fine.A_p) if smooth else of_levels

    def rate(t: float, y: np.ndarray) -> list[float]:
        U = y[1] / (load.mass + np.interp(y[0], fine.h, fine.A33, left=0.0))
        drag = np.interp(y[0], h_V, B, left=0.0) * U * abs(U)
        return [U, load.mass * G - RHO * G * np.interp(y[0], h_V, V, left=0.0) - drag]

    found = solve_ivp(
        rate, (0.0, times[-1]), (-FALL, 0.0), method="DOP853", rtol=1e-8, atol=1e-6, max_step=5e-3, t_eval=times
    )
    return found.y[0], found.y[1] / (load.mass + np.interp(found.y[0], fine.h, fine.A33, left=0.0))


def kept_energy(load: Payload) -> tuple[float, float]:
    """Part of the energy that is left in body and water after an entry without weight and drag: by momentum, and by the
    kernels' forces."""
    record, rows = pack_payload(load, RHO, 1e4)
    record, rows = record._replace(W=1e-9, g=0.0), rows * np.array([name != "B" for name in COLUMNS])
    z, v = 0.0, -3.0
    while z > -record.reach - 0.1:
        k = acceleration(z, v, record, rows)
        k_2 = acceleration(z + v * STEP / 2, v + k * STEP / 2, record, rows)
        z, v = z + STEP * (v + k * STEP / 2), v + STEP * k_2
    A33 = load.covered(RHO).A33
    return load.mass / (load.mass + A33), (load.mass + A33) * v * v / (load.mass * 9.0)


class Statics(NamedTuple):
    """Sling tension of a lowering at a steady speed and its closed form, over submergence."""

    h: np.ndarray
    F: np.ndarray
    F_closed: np.ndarray


def lowered(name: str) -> Statics:
    """A crane at rest lowers the payload through still water at SPEED."""
    load = read_payload(name)
    stage = Phase(name="down", mode="manual", speed=f"{SPEED} m/s", depth="24 m")
    case = Lowering(payload=load, h_tip="40 m", depth="500 m", start_depth="-3 m", duration="60 s", programme=(stage,))
    run = simulate(load_crane("nov-250t"), case, every="10 ms")
    z, v, F = (run[k].values for k in ("z_load", "v_load", "F_sling"))
    record, rows = pack_payload(load, RHO, 500.0)
    h = -z
    V, A33, rise, B = np.array([wet_at(x, record, rows)[:4] for x in z]).T
    slope = np.where((h > 0.0) & (h < record.reach), rise, 0.0)
    a = np.gradient(v, run["time"].values)
    closed = (record.m + A33) * a + record.W - RHO * G * V + B * v * abs(v) - slope * v * v
    level = np.searchsorted(rows[:, COLUMNS.index("h")], h, side="right")
    corner = np.zeros(len(h), bool)
    corner[1:-1] = level[2:] != level[:-2]  # the acceleration jumps there: differences across it mean nothing
    moving = (h > -2.0) & (h < 20.0) & ~corner
    return Statics(h[moving], F[moving], closed[moving])


def compute() -> tuple[Blocks, None]:
    drops = {name: drop(read_payload(name), duration) for name, duration in DROPS.items()}
    statics = lowered("suction-anchor-85t")
    return {
        "claims": claims(drops, statics),
        "plates": PLATES,
        "prisms": PRISMS,
        "drops": [drop_row(name, d) for name, d in drops.items()],
    }, None


def prism(ratio: float) -> float:
    return formula.plate(1.0, 1.0, 1.0) * formula.height_factor(1.0, ratio) / ratio


def worst(d: Drop, U: np.ndarray) -> float:
    """Largest difference of speed as part of the highest speed."""
    return float(np.abs(d.U - U).max() / d.U.max())


def sinking(name: str) -> float:
    load = read_payload(name)
    return math.sqrt((load.mass - RHO * load.covered(RHO).V) * G / load.drag(RHO))


def drop_row(name: str, d: Drop) -> dict[str, Any]:
    low, exact = float(d.U[d.h > 0.0].min()), float(d.U_exact[d.h_exact > 0.0].min())
    return locals()


def claims(drops: Mapping[str, Drop], statics: Statics) -> dict[str, Any]:
    plate = max(abs(formula.plate(1.0, 1.0, r) / (math.pi / 4.0 * r * C) - 1.0) for r, C in PLATES)
    tall = max(abs(prism(r) / C - 1.0) for r, C in PRISMS)
    fall = max(worst(d, d.U_exact) for d in drops.values())
    by_hand, ours = kept_energy(read_payload("mud-mat-25t"))
    off = float(np.abs(statics.F - statics.F_closed).max() / statics.F.max())
    return locals()


def within(x: float) -> str:
    return f"within {100.0 * x:.2g} %"
