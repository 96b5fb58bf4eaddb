"""The compensating cylinder against closed forms and an ideal compensator; step size; where its energy goes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from batch import jacobian
from blocks import Blocks

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack, wire_speed_max
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.library.crane_file import changed
from stillhook.spec.scenario import Operator
from stillhook.units import show
from stillhook.winches.load_path.load import Point
from stillhook.winches.types import cylinder as winch

SLOW_PAGE = True
CRANE = load_crane("nov-100t-cylinder")
TABLE = CRANE.cylinder
CASE = {"load": "50 t", "s_w": "100 m", "mode": "position", "duration": "60 s", "warm_up": "20 s"}
SINE = "sine 1 m 10 s"
FREE = {
    "pump": {"C_leak": "0 L/min/bar"},
    "friction": {"F_c": "1e-3 N", "mu": 0.0, "b": "0 N s/m", "sigma_1_ratio": 0.0},
    "passive": {"accumulator": {"R_piston": "0 bar/(L/min)"}},
}
"""The cylinder without friction and leak."""
TIPS = {"within all limits": SINE, "faster than the pumps": "sine 2 m 9 s", "longer than the stroke": "sine 4 m 40 s"}
SHARES = (0.4, 0.6, 0.8, 0.95)
"""Full wire speed over the tip's."""
STEPS = ("5 ms", "2.5 ms", "2 ms", "1 ms", "0.5 ms")
HOIST = Operator(profile=(("0 s", "0 m/min"), ("10 s", "20 m/min"), ("50 s", "20 m/min"), ("55 s", "0 m/min")))
ENERGY = {
    "wave of 1 m": {"tip": SINE},
    "hoisting in the wave": {"tip": SINE, "operator": HOIST, "s_w": "200 m"},
    "faster than the pumps": {"tip": TIPS["faster than the pumps"]},
    "into both end stops": {"tip": TIPS["longer than the stroke"], "duration": "120 s"},
}
GAINS = (0.1, 0.2, 0.4, 0.8)
"""Position gains K_p [1/m]."""


class Compared(NamedTuple):
    """Wire taken in by the twin and by an ideal compensator [m] over time [s]."""

    t: np.ndarray
    s_tip: np.ndarray
    ours: np.ndarray
    ideal: np.ndarray
    status: str


def run(crane: Any = CRANE, every: str | None = "10 ms", **case: Any) -> Any:
    return simulate(crane, Scenario(**(CASE | case)), every=every)


def eigenfrequency() -> tuple[float, float]:
    """Of the rod on its oil at mid stroke [rad/s]: sqrt(4 beta A^2 / (V_t m)), and of the twin's own rates."""
    V_t = 2.0 * TABLE.line.V + TABLE.A_a * TABLE.x_max
    closed = math.sqrt(4.0 * TABLE.line.bulk_modulus * TABLE.A_a**2 / (V_t * TABLE.m))
    p = pack(changed(CRANE, {"cylinder": FREE}), Scenario(**CASE, tip=SINE)).params
    geo, q = winch.geometry(100.0, p), Point(0.0, p.hoist.load.W, 0.0, 1.0, 0.0, 0.0)
    u = winch.Command(0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    p_0 = 0.5 * (TABLE.boost.p + p.cylinder.flushing.p)  # boost and flushing valves are both shut
    x_0 = winch.start(100.0, None, p)._replace(p_a=p_0, p_b=p_0)
    steps = {"p_a": 1e3, "p_b": 1e3, "x_rod": 1e-4, "v_rod": 1e-5}
    return closed, float(np.abs(np.linalg.eigvals(jacobian(winch, x_0, q, u, geo, p, steps)).imag).max())


def full_speed() -> tuple[float, float]:
    """Wire speed with full pumps [m/s]: falls Q / A, and of a run."""
    found = run(changed(CRANE, {"cylinder": {"pump": FREE["pump"]}}), tip="sine 3 m 12 s", load="5 t")
    full = np.abs(found.alpha_p.values) == 1.0
    steady = full & np.roll(full, 50) & (np.abs(found.x_rod.values - 0.5 * TABLE.x_max) < 1.3)
    closed = TABLE.falls * sum(TABLE.pump.D) * TABLE.pump.omega_p / TABLE.A_a
    return closed, float(np.abs(found.v_w.values[steady]).mean())


def stroke() -> tuple[float, float]:
    """Wire between both end stops [m]: falls times stroke, and of a run."""
    found = run(tip="sine 4.5 m 40 s", duration="120 s")
    return TABLE.falls * TABLE.x_max, float(np.ptp(found.s_w.values))


def harmonics() -> list[tuple[float, float, float]]:
    """Share of full speed, first harmonic of the wire's speed over the tip's: of a clipped sine, and of runs without
    position feedback."""
    period, out = 8.0, []
    crane = changed(CRANE, {"control": {"K_p": "0 1/m"}, "cylinder": {"pump": FREE["pump"]}})
    for r in SHARES:
        height = wire_speed_max(CRANE) / r * period / (2.0 * math.pi)
        found = run(crane, tip=f"sine {height!r} m {period} s", load="5 t", duration="40 s", warm_up="10 s")
        last = slice(found.time.size - round(3.0 * period / 0.01), None)
        turn = np.exp(-2j * math.pi * found.time.values[last] / period)
        ours = abs(np.mean(found.v_w.values[last] * turn) / np.mean(found.v_tip.values[last] * turn))
        out.append((r, 2.0 / math.pi * (math.asin(r) + r * math.sqrt(1.0 - r * r)), float(ours)))
    return out


def saturated_loop(r: float, K: float, omega: float) -> complex:
    """Wire speed over the tip's, turned round: first harmonic of a follower of limited speed, by harmonic balance.

    r full speed over the tip's, K gain from position to speed [1/s]. The command u = v_tip + K e is cut as a clipped
    sine of amplitude U: y' = N(U) u, N = (2/pi)(asin rho + rho sqrt(1 - rho^2)) with rho the full speed over U.
    """
    U, N, s = 1.0 / r, 1.0, 1j * omega
    for _ in range(200):
        rho = min(1.0 / U, 1.0)
        N = 2.0 / math.pi * (math.asin(rho) + rho * math.sqrt(1.0 - rho * rho))
        U = abs((s + K) / (s + K * N)) / r
    return N * (s + K) / (s + K * N)


def followed() -> list[tuple[str, ...]]:
    """First harmonic beyond full speed with the crane's own position gain: amplitude and lag of the wire, what is left
    over; clipped sine, saturated loop, runs."""
    period, rows = 8.0, []
    omega, v = 2.0 * math.pi / period, wire_speed_max(CRANE)
    crane = changed(CRANE, {"cylinder": FREE})
    for r in SHARES:
        found = run(crane, tip=f"sine {v / r / omega!r} m {period} s", load="5 t", duration="120 s", warm_up="40 s")
        last = slice(found.time.size - round(3.0 * period / 0.01), None)
        turn = np.exp(-1j * omega * found.time.values[last])
        ours = complex(np.mean(found.v_w.values[last] * turn) / -np.mean(found.v_tip.values[last] * turn))
        clipped = 2.0 / math.pi * (math.asin(r) + r * math.sqrt(1.0 - r * r))
        loop = saturated_loop(r, CRANE.control.K_p * v, omega)
        left = (f"{abs(1.0 - G):.4f}" for G in (clipped, loop, ours))
        rows.append((f"{r:g}", *(f"{abs(G):.4f}, {-np.angle(G, deg=True):.1f} deg" for G in (loop, ours)), *left))
    return rows


def compared(tip: str) -> Compared:
    """Twin and ideal compensator: a position-controlled cylinder with limited speed and stroke, without internals."""
    found = run(tip=tip, duration="80 s")
    t, s, v = (found[n].values for n in ("time", "s_tip", "v_tip"))
    v_max, half, y = wire_speed_max(CRANE), 0.5 * TABLE.falls * TABLE.x_max, np.zeros(found.time.size)
    for i in range(len(t) - 1):
        speed = min(max(-v[i] - CRANE.control.K_p * v_max * (s[i] - s[0] + y[i]), -v_max), v_max)
        y[i + 1] = min(max(y[i] + speed * (t[i + 1] - t[i]), -half), half)
    return Compared(t, s, found.s_w.values[0] - found.s_w.values, y, found.status.item())


def audited() -> list[tuple[str, float, Any]]:
    """Case, part of the energy that is not accounted for, powers summed up [J]."""
    cases = [Scenario(**(CASE | case)) for case in ENERGY.values()]
    results = run_cases(CRANE, cases, step=5, lanes=1, keep=unchanged)
    out = []
    for name, result in zip(ENERGY, results, strict=True):
        joules = {k: v * result.t_cycle for k, v in result.stats.power._asdict().items()}
        out.append((name, result.energy_unaccounted, joules))
    return out


def step_rows() -> list[dict[str, Any]]:
    """Error and peak pressure by step, and what they differ by from a quarter of the step."""
    found = {
        h: simulate(CRANE, Scenario(**CASE, tip=SINE), step=h)
        for h in sorted({*STEPS, *(_quarter(h) for h in STEPS)}, key=lambda h: float(h.split()[0]))
    }
    rows = []
    for h in STEPS:
        here, fine = found[h], found[_quarter(h)]
        p_max = show(float(here.p_max), "pressure", 5)
        rows.append({**locals()})
    return rows


def _quarter(h: str) -> str:
    return f"{float(h.split()[0]) / 4.0:g} ms"


def gain_rows() -> list[tuple[str, ...]]:
    rows = []
    for K_p in GAINS:
        crane = changed(CRANE, {"control": {"K_p": f"{K_p} 1/m"}})
        found = [run(crane, every=None, tip=SINE, load=load) for load in ("10 t", "50 t", "100 t")]
        rows.append(
            (f"{K_p:g} 1/m", *(f"{1e3 * float(r.e_c_pp):.1f} mm ({100.0 * float(r.eta_c):.1f} %)" for r in found))
        )
    return rows


def assumed_rows() -> list[tuple[str, ...]]:
    kinds: dict[str, list[str]] = {}
    for place, source in sorted(CRANE.sources.items()):
        if place.startswith("cylinder."):
            kinds.setdefault(source.kind.value, []).append(f"`{place.removeprefix('cylinder.')}`")
    return [(kind, str(len(places)), ", ".join(places)) for kind, places in sorted(kinds.items())]


def compute() -> tuple[Blocks, None]:
    pairs, waves = {name: compared(tip) for name, tip in TIPS.items()}, harmonics()
    audits = audited()
    losses = ("pump", "boost", "make_up", "winch", "tip", "friction", "leakage", "relief", "flushing", "cushion")
    rows = [(name, *(f"{1e-3 * joules[k]:.0f}" for k in losses), f"{abs(part):.1e}") for name, part, joules in audits]
    return {
        "claims": claims(pairs, waves, audits),
        "harmonics": [{"closed": closed, "ours": ours, "r": r} for r, closed, ours in waves],
        "ideal": [ideal_row(name, pair) for name, pair in pairs.items()],
        "followed": followed(),
        "gains": gain_rows(),
        "energy": rows,
        "steps": step_rows(),
        "sources": assumed_rows(),
    }, None


def ideal_row(name: str, pair: Compared) -> dict[str, Any]:
    late = pair.t > 20.0
    left = [np.ptp((pair.s_tip + y)[late]) for y in (pair.ideal, pair.ours)]
    return locals()


def claims(
    pairs: dict[str, Compared], waves: list[tuple[float, float, float]], audits: list[tuple[str, float, Any]]
) -> dict[str, Any]:
    w, w_ours = eigenfrequency()
    v, v_ours = full_speed()
    s, s_ours = stroke()
    harmonic = max(abs(ours / closed - 1.0) for _, closed, ours in waves)
    ideal = max(float(np.abs(p.ours - p.ideal).max() / np.ptp(p.s_tip)) for p in pairs.values())
    audit = max(abs(part) for _, part, _ in audits)
    return locals()
