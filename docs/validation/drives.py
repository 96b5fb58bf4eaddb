"""Drives side by side against what does not know the engine: sizes, energies and the order of the drives."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np
from blocks import Blocks

from stillhook import Scenario, load_crane
from stillhook.analysis.drives.comparison import DriveComparison, DriveRun, compare_drives
from stillhook.engine.pack.winch import pack, wire_speed_max
from stillhook.physics.scalar import G
from stillhook.report.formatting import HOUR
from stillhook.spec.crane import holding_torque

SLOW_PAGE = True
REFERENCE = load_crane("nov-250t")
DRIVES = ("active-passive", "pure-active", "secondary", "cylinder", "electric", "open-circuit")
AMPLITUDE, PERIOD, LOAD = 1.5, 10.0, 100.0e3
CASE = Scenario(load="100 t", s_w="100 m", tip="sine 1.5 m 10 s", duration="300 s", warm_up="100 s")
N, SEED = 64, 0
SURE = 0.95
"""Share of draws with one order from which two drives are distinguished."""
KWH = 3.6e6
AUDIT = 1e-3
NOTHING = 1e-6
"""Share of what is drawn that is nothing: samples of a power that stays positive."""
CLOSED = 0.03
"""What closed forms of a hook at rest may differ by: break-away friction is left out."""


def electric_form(run: DriveRun) -> dict[str, float]:
    r"""Losses per hour [J] of an electric winch whose wire moves as the tip does, so that the hook is at rest:
    friction :math:`T_c \overline{|\omega|} + n Y_5 \overline{\omega^2}`, copper :math:`n R \overline{i^2}` with
    :math:`T = T_0 + J \dot\omega + (T_c + n Y_5 |\omega|) sign \omega`, iron :math:`n k \overline{\omega^2}`, inverters
    :math:`n (P_0 + R_i \overline{i^2})`; break-away is left out, and the wire has no weight, as in every
    `Scenario`."""
    crane = run.drive.crane
    p = pack(crane, run.case).params
    geo = crane.plant.type.module.geometry(100.0, p)
    h, M, y = p.hoist, p.drive.machines, p.hoist.friction
    w = 2.0 * math.pi / PERIOD
    peak = AMPLITUDE * w / geo.r_eff
    F = (LOAD + crane.hook_mass) * G
    T_0, T_a = F * geo.r_eff, peak * w / geo.i_J
    T_c, viscous = h.n_motors * (y.Y_2 + y.Y_6 * F * 0.5 * geo.d), h.n_motors * y.Y_5
    mean, square = 2.0 * peak / math.pi, 0.5 * peak**2
    T2 = T_0**2 + 0.5 * T_a**2 + T_c**2 + viscous**2 * square + 2.0 * T_c * viscous * mean
    i2 = T2 / (M.count * M.K_t) ** 2
    return {
        "friction": HOUR * (T_c * mean + viscous * square),
        "copper": HOUR * M.count * M.R * i2,
        "iron": HOUR * M.count * M.k_iron * square,
        "inverter": HOUR * M.count * (M.P_idle + M.R_inverter * i2),
    }


def sizes(runs: list[DriveRun]) -> list[dict[str, Any]]:
    """Top speed, and torque at the shafts over that of the load, of the sized drive and of the crane that it is of."""
    rows = []
    for run in runs:
        of, crane = load_crane(run.drive.source), run.drive.crane
        less, more = (capability(c) / holding_torque(c) for c in (of, crane))
        more /= less
        rows.append({**locals()})
    return rows


def capability(crane: Any) -> float:
    """Largest torque of electric machines [N m], else displacement of all motors [m^3/rad]; NaN without a shaft."""
    if crane.table("cylinder"):
        return math.nan
    return float(sum(m.count * (m.T_max if crane.table("electric") else m.D_max) for m in crane.motors))


def balances(runs: list[DriveRun]) -> list[dict[str, Any]]:
    rows = []
    for run in runs:
        e = run.energy
        largest = sorted(((x, n) for n, x in e.lost.items()), reverse=True)[:3]
        rows.append({**locals()})
    return rows


def order(found: DriveComparison, name: str) -> tuple[list[tuple[str, ...]], int]:
    """Pairs of drives: better one at the nominal values, its share of draws, verdict; how many are distinguished."""
    rows, told = [], 0
    for a, b in combinations(sorted(found.runs, key=lambda r: r.value(name)), 2):
        x, y = a.drawn[name], b.drawn[name]
        good = np.isfinite(x) & np.isfinite(y)
        share = float(np.mean(x[good] < y[good]))
        told += share >= SURE
        bands = "yes" if b.name in found.better(name)[a.name] else "no"
        if a.short or b.short:
            bands = "not ranked"
        rows.append((a.name, b.name, f"{100.0 * share:.0f} %", "yes" if share >= SURE else "no", bands))
    return rows, told


def compute() -> tuple[Blocks, DriveComparison]:
    found = compare_drives(REFERENCE, CASE, DRIVES, n=N, seed=SEED)
    runs = list(found.runs)
    by_name = {run.name: run for run in runs}
    electric, closed = by_name["electric"].energy, electric_form(by_name["electric"])
    tables = {name: order(found, name) for name in ("e_c_pp", "energy_net")}
    return {
        "claims": claims(found, closed),
        "sizes": sizes(runs),
        "balance": balances(runs),
        "electric": [{"electric": electric, "n": n, "x": x} for n, x in closed.items()],
        "error-order": tables["e_c_pp"][0],
        "energy-order": tables["energy_net"][0],
        "factors": {"found": found},
    }, found


def claims(found: DriveComparison, closed: dict[str, float]) -> dict[str, Any]:
    runs = {run.name: run for run in found.runs}
    audit = max(abs(run.energy.unaccounted) for run in found.runs)
    v = wire_speed_max(REFERENCE)
    cylinder = load_crane("nov-100t-cylinder").cylinder
    ends = {"cylinder": cylinder.falls * cylinder.v_max}
    speed = max(abs(wire_speed_max(r.drive.crane) / min(v, ends.get(r.name, v)) - 1.0) for r in found.runs)
    lost = runs["electric"].energy.lost
    most = max(abs(lost[n] / x - 1.0) for n, x in closed.items())
    hoists = (LOAD + REFERENCE.hook_mass) * G * 2.0 * AMPLITUDE * HOUR / PERIOD
    valve = runs["open-circuit"].energy
    idle = next(run for run in found.runs if run.name == "pure-active").energy
    return locals()
