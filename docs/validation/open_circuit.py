"""The open-circuit winch beside closed forms of valve-controlled motors, its audit of energy, its steps, and where its
energy goes."""

from __future__ import annotations

import math
from typing import Any

import causes
import numpy as np
from batch import jacobian
from blocks import Blocks

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack
from stillhook.library import changed
from stillhook.physics.hydraulics.valves import spool_opening
from stillhook.spec.scenario import Operator
from stillhook.winches.types import open_circuit

NAME = "utility-20t-open-circuit"
CRANE = load_crane(NAME)
BAR = 1.0e5
MATCHED, LEAKY = causes.variants(globals())
SHOWN = ("p_a", "p_b", "p_s", "omega_m", "P_hpu", "y_cb", "x_v")
FINE = "1 ms"
CLOSED = 5.0e-3
"""Relative: what the laminar zone of an edge may take from a closed form of sharp edges."""
POLES = 1.0e-3
AUDIT = 1.0e-3
STEPS = ("5 ms", "2.5 ms", "1.25 ms")
REFERENCE = "0.3125 ms"
SEA = {"s_w": "100 m", "tip": "sine 1 m 10 s", "mode": "position", "duration": "60 s", "warm_up": "20 s"}


def steady(winch: Any, load: str, speed: str, step: str | None = FINE) -> dict[str, float]:
    """Mean of each signal over the last second of a steady hoist, or of a lowering below zero."""
    operator = Operator(profile=(("0 s", "0 m/min"), ("3 s", speed), ("40 s", speed)))
    still = {"tip": "still", "duration": "40 s", "warm_up": "0 s", "ramp": "0 s"}
    case = Scenario(load=load, s_w="150 m", mode="manual", operator=operator, **still)
    run = simulate(winch, case, every="10 ms", step=step)
    late = run.time.values > 39.0
    return {name: float(np.mean(run[name].values[late])) for name in SHOWN}


def speed_rows(winch: Any) -> tuple[list[dict[str, Any]], float]:
    """Steady speed with the spool at its stop, and the largest difference."""
    rows, worst, A = [], 0.0, circuit_of(winch)
    for load in ("2 t", "5 t", "10 t", "15 t"):
        y = steady(winch, load, "42 m/min")
        dp = y["p_a"] - y["p_b"]
        closed = A.edges.K_v / A.D_m * math.sqrt((y["p_s"] - dp) / 2.0)
        off = y["omega_m"] / closed - 1.0
        worst = max(worst, abs(off))
        rows.append({**locals()})
    return rows, worst


def circuit_of(winch: Any) -> Any:
    return pack(winch, Scenario(load="10 t", s_w="100 m", mode="manual")).params.A


def power_curve(winch: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Load pressure over that of the supply, power at the shaft over the most that the closed form gives, and
    efficiency."""
    A, rows = circuit_of(winch), []
    for load in ("2 t", "5 t", "8 t", "10 t", "11 t", "12 t", "13 t", "14 t", "16 t", "18 t"):
        y = steady(winch, load, "42 m/min")
        dp, p_s = y["p_a"] - y["p_b"], y["p_s"]
        most = 2.0 / 3.0 * p_s * A.edges.K_v * math.sqrt(p_s / 6.0)
        shaft = dp * A.D_m * y["omega_m"]
        rows.append((dp / p_s, shaft / most, shaft / y["P_hpu"]))
    return tuple(np.array(rows).T)  # type: ignore[return-value]


def ratio_of_most_power(ratio: np.ndarray, power: np.ndarray) -> float:
    """Where a cubic through the squares of the powers has its highest point."""
    turns = np.roots(np.polyder(np.polyfit(ratio, power**2, 3)))
    return float(max(turns.real))


def pole(opened: float) -> tuple[complex, complex]:
    """Pole of the two lines and the shaft at a steady hoist of 100 bar from 200 bar: by the winch's own rates, and by
    Merritt's closed form."""
    winch = LEAKY.on(MATCHED.on(CRANE))
    p = pack(winch, Scenario(load="10 t", s_w="100 m", mode="manual")).params
    A, geo = p.A, open_circuit.geometry(100.0, p)
    u = open_circuit.Command(x_v=opened, f_pump=1.0, brake=0.0)
    dp, p_s = 100.0 * BAR, 200.0 * BAR
    omega = A.edges.K_v * float(spool_opening(opened, A.edges)) / A.D_m * math.sqrt((p_s - dp) / 2.0)
    at = open_circuit.start(100.0, None, p)._replace(
        x_v=opened, p_a=(p_s + dp) / 2, p_b=(p_s - dp) / 2, p_s=p_s, omega_m=omega
    )
    point = open_circuit.PATH.Point(v_w=0.0, F_w=1.0e5, a_load=0.0, k=0.0, stretch=0.0, stretch_rate=0.0)
    fields = {"p_a": 1.0e3, "p_b": 1.0e3, "omega_m": 1.0e-3}

    J = jacobian(open_circuit, at, point, u, geo, p, fields, lambda circuit: circuit._replace(g=1.0e-9))
    ours = max(np.linalg.eigvals(J), key=lambda z: z.imag)
    C_t, J = 2.0 / A.i_C_h, 1.0 / geo.i_J
    K_ce = A.D_m * omega / (2.0 * (p_s - dp)) + A.motors.count * A.motors.C_1 * (2.0 / 3.0 + 1.0 / 6.0)
    omega_h, zeta = 2.0 * A.D_m / math.sqrt(C_t * J), K_ce / A.D_m * math.sqrt(J / C_t)
    return complex(ours), omega_h * complex(-zeta, math.sqrt(1.0 - zeta * zeta))


def pole_rows() -> tuple[list[dict[str, Any]], float]:
    rows, worst = [], 0.0
    for opened in (0.2, 0.5, 0.9):
        ours, closed = pole(opened)
        zetas = [-z.real / abs(z) for z in (ours, closed)]
        worst = max(worst, abs(abs(ours) / abs(closed) - 1.0), abs(zetas[0] / zetas[1] - 1.0))
        rows.append({**locals()})
    return rows, worst


def balance_rows() -> tuple[list[dict[str, Any]], float]:
    """Pressure of line A while lowering and hoisting at 20 m/min, and the difference by the closed form."""
    rows, worst, A = [], 0.0, circuit_of(CRANE)
    for load in ("2 t", "10 t", "20 t"):
        down, up = (steady(CRANE, load, speed, None) for speed in ("-20 m/min", "20 m/min"))
        dp, dp_up = down["p_a"] - down["p_b"], up["p_a"] - up["p_b"]
        p_b = (A.cb.p_crack + down["y_cb"] / A.cb.i_dp_open - dp) / (1.0 + A.cb.psi)
        K = A.edges.K_v * float(spool_opening(up["x_v"], A.edges))
        leak = A.motors.count * A.motors.C_1 * dp_up
        back = A.tank.p_T + ((A.D_m * up["omega_m"] + leak) / K) ** 2
        ours, theirs = down["p_a"] - up["p_a"], (p_b + dp) - (back + dp_up)
        worst = max(worst, abs(ours - theirs) / BAR)
        rows.append({**locals()})
    return rows, worst


def audit_rows() -> tuple[list[tuple[str, ...]], float, float]:
    """Energy unaccounted for, and the lowest power of the pumps in any of the runs [W]."""
    rows, worst, least = [], 0.0, math.inf
    for row in causes.variants(globals(), "audited"):
        run = simulate(CRANE, Scenario(**({"load": "10 t"} | SEA | row.more)), every="10 ms")
        left = float(run.energy_unaccounted)
        worst, least = max(worst, abs(left)), min(least, float(run.P_hpu.min()))
        rows.append((row.label, run.status.item(), f"{left:.1e}".replace("-", "−")))
    return rows, worst, least


def step_rows() -> list[dict[str, Any]]:
    case = Scenario(load="10 t", **SEA)
    runs = {step: simulate(CRANE, case, step=step, every="0.1 s") for step in (*STEPS, REFERENCE)}
    exact = runs[REFERENCE]
    return [{"exact": exact, "runs": runs, "step": step} for step in STEPS]


def swing_rows() -> list[tuple[str, ...]]:
    """Swing of the wire speed early and late in a slow lowering, over the damping of the pilot line."""
    operator = Operator(profile=(("0 s", "0 m/min"), ("2 s", "-5 m/min"), ("60 s", "-5 m/min")))
    still = {"tip": "still", "warm_up": "0 s", "ramp": "0 s", "duration": "60 s"}
    case = Scenario(load="10 t", s_w="100 m", mode="manual", operator=operator, **still)
    rows = []
    for tau in ("0.1 s", "0.3 s", "1 s", "1.5 s"):
        run = simulate(changed(CRANE, {"open": {"counterbalance": {"tau_pilot": tau}}}), case, every="20 ms")
        t, v = run.time.values, run.v_w.values * 60.0
        early, late = (np.ptp(v[(t >= a) & (t < a + 6.0)]) for a in (6.0, 54.0))
        rows.append((tau, f"{early:.2f} m/min", f"{late:.2f} m/min"))
    return rows


def assumed() -> str:
    """How many numbers of the circuit come from where, in a sentence."""
    own = [s for path, s in CRANE.sources.items() if path.startswith("open.")]
    kinds = {kind: sum(str(s.kind) == kind for s in own) for kind in ("published", "datasheet", "derived", "assumed")}
    read = ", ".join(f"{n} {kind}" for kind, n in kinds.items())
    return f"Of the {len(own)} numbers of the circuit: {read}. `stillhook crane {NAME}` names the source of each."


def compute() -> tuple[Blocks, None]:
    matched = MATCHED.on(CRANE)
    speeds, off_speed = speed_rows(matched)
    ratio, power, efficiency = power_curve(matched)
    best = ratio_of_most_power(ratio, power)
    poles, off_poles = pole_rows()
    balance, off_balance = balance_rows()
    audit, off_audit, least = audit_rows()

    return {
        "claims": locals(),
        "speed": speeds,
        "poles": poles,
        "balance": balance,
        "audit": audit,
        "steps": step_rows(),
        "sources": assumed(),
        "swing": swing_rows(),
    }, None
