"""Lines that run dry: column separation in closed form, and sudden starts of every hydraulic winch with voids, litres
and joules."""

from __future__ import annotations

from typing import Any

import causes
import numpy as np
import xarray
from blocks import Blocks

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack
from stillhook.physics.hydraulics.lines import P_VAPOUR, line_pressure, void_volume
from stillhook.physics.hydraulics.pump import PumpLeak
from stillhook.winches.circuits.active import ActiveCircuit, active_flows

BAR, LITRE = 1.0e5, 1.0e-3
FLOW, P_0, TURNS, STEP = 1.0e-3, 25.0e5, 0.6, 1.0e-4  # m^3/s, Pa, s, s
CLOSED = 1.0e-3
"""Relative: two steps of the closed form's time."""
AUDIT = 1.0e-3
PRESSURES = ("p_a", "p_b", "p_s", "p_hp", "p_r")
SUDDEN: dict[str, Any] = {"s_w": "100 m", "duration": "40 s", "warm_up": "0 s", "ramp": "0 s"}


ROWS = causes.variants(globals())
"""Starts at full motion. before: lowest pressure in version 0.10, where oil carried tension [bar]."""


def run(row: causes.Variant, step: str | None = None, **more: str) -> xarray.Dataset:
    crane = row.on(load_crane(row.own["crane"]))
    asked = SUDDEN | {"mode": crane.plant.type.default_mode} | row.more | more
    return simulate(crane, Scenario(**asked), every="10 ms", step=step)


def lowest(data: xarray.Dataset) -> float:
    """Lowest pressure of all lines [Pa]."""
    return min(float(data[name].min()) for name in PRESSURES if name in data)


def bare() -> ActiveCircuit:
    """The active circuit of the 100 t crane without leak and valves."""
    crane = load_crane("nov-100t-pure-active")
    A: ActiveCircuit = pack(crane, Scenario(load="40 t", s_w="100 m", tip="still")).params.active
    return A._replace(
        pumps=A.pumps._replace(leak=PumpLeak(*[0.0] * len(PumpLeak._fields))),
        motors=A.motors._replace(C_1=0.0, C_2=0.0),
        boost=A.boost._replace(G=0.0),
        relief=A.relief._replace(G=0.0),
        flushing=A.flushing._replace(G=0.0),
        i_beta=0.0,  # the flow that leaves is given, however much of the line is vapour
    )


def separation() -> tuple[list[tuple[str, tuple[float, float, str]]], float]:
    """A line out of which a given flow is drawn, and pushed back from TURNS on: times and void, closed form beside
    it."""
    A, P = bare(), P_0
    t = np.arange(0.0, 1.3, STEP)
    p, void = np.empty_like(t), np.empty_like(t)
    for i, now in enumerate(t):
        p[i], void[i] = line_pressure(P), void_volume(P, A.i_C_h)
        P += STEP * A.i_C_h * active_flows(0.0, 1.0, FLOW if now < TURNS else -FLOW, P, 50.0e5, 1.0, A).Q_a
    dry = (P_0 - P_VAPOUR) / (A.i_C_h * FLOW)
    closed = {
        "reaches the vapour pressure after": (float(t[np.argmax(void > 0.0)]), dry, "s"),
        "largest void": (float(void.max()) / LITRE, FLOW * (TURNS - dry) / LITRE, "L"),
        "void is closed after": (float(t[len(t) - np.argmax(void[::-1] > 0.0)]), 2.0 * TURNS - dry, "s"),
        "back at the first pressure after": (float(t[np.argmax((t > TURNS) & (p >= P_0))]), 2.0 * TURNS, "s"),
    }
    return list(closed.items()), max(abs(ours / theirs - 1.0) for ours, theirs, _ in closed.values())


def compute() -> tuple[Blocks, None]:
    closed, off = separation()
    rows, steps, worst, least = [], [], 0.0, 0.0
    for case in ROWS:
        name = case.label
        data = run(case)
        audit, low = float(data["energy_unaccounted"]), lowest(data)
        worst, least = max(worst, abs(audit)), min(least, low)
        rows.append({"name": name, "case": case, "low": low, "data": data, "audit": audit})
        steps.append((name, *(float(run(case, step)["void_max"]) / LITRE for step in ("2 ms", "1 ms", "0.5 ms"))))
    notes = run(ROWS[0], warm_up="15 s", duration="60 s")
    blocks = {"claims": locals(), "closed": closed, "runs": rows, "steps": steps, "note": {"notes": notes}}
    return blocks, None
