"""An electric winch in the running twin against closed forms: cascade, losses, torque, heat, store; steps, energy."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import causes
import numpy as np
from blocks import Blocks, Rows

from stillhook import Scenario, load_crane
from stillhook.analysis.steady.limits import Direction, top_of_drive
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.summary import ScenarioRun, limits_passed
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.library import changed
from stillhook.physics.electric import machine
from stillhook.physics.electric.machine import Body, time_to_limit
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator
from stillhook.winches.types import electric

CRANE = load_crane("nov-100t-electric")
MOTOR = CRANE.electric.motor
FREE = causes.variants(globals(), "free")[0].on(CRANE)
"""The crane without friction."""
WAVE = {"load": "47 t", "s_w": "200 m", "tip": "sine 1 m 10 s", "duration": "100 s", "warm_up": "40 s"}
FINE, FINEST = 10, 100
"""Steps per PLC cycle of 10 ms: of these runs, and of the reference of the table of steps."""
DEAD_TIME = 0.015
"""Of the PLC: computing time of a cycle, and half a hold [s]."""
UNREDUCED = 1.0e9
"""Rate below which the current loop is then integrated as it is [1/s]."""
STEPS = (2, 4, 5, 10, 20)


def run(crane: Crane = CRANE, n_sub: int = FINE, **case: Any) -> ScenarioRun:
    return run_cases(crane, [Scenario(**({"mode": "position"} | case))], step=n_sub, lanes=1, every=1, keep=unchanged)[
        0
    ]


def steady(speed: float, duration: float) -> dict[str, Any]:
    """A steady wire speed by the operator, hoisting positive [m/s]."""
    profile = (("0 s", "0 m/s"), ("5 s", f"{speed} m/s"), (f"{duration} s", f"{speed} m/s"))
    return {"mode": "manual", "tip": "still", "operator": Operator(profile=profile), "duration": f"{duration} s"}


def joules(result: ScenarioRun, name: str) -> float:
    return float(getattr(result.stats.power, name) * result.t_cycle)


def counted(result: ScenarioRun, name: str) -> np.ndarray:
    return result.column(name)[round(result.warm_up / result.t_cycle) :]


def weight(load: float) -> float:
    return (load + CRANE.hook_mass) * G


def poles(crane: Crane) -> tuple[np.ndarray, np.ndarray]:
    """Of the linearised rates with the position loop closed, and of the polynomial of the cascade [1/s]."""
    p = pack(crane, Scenario(load="47 t", s_w="100 m")).params
    geo, F = electric.geometry(100.0, p), p.hoist.load.W
    q = electric.load.Point(v_w=0.0, F_w=F, a_load=0.0, k=1.0, stretch=0.0, stretch_rate=0.0)
    T = F * geo.r_eff
    names = ("i", "omega_m", "omega_ref", "T_n")
    middle = electric.start(100.0, None, p)._replace(i=machine.current(T, p.drive.machines), T_ff=T)

    def rate(v: np.ndarray) -> np.ndarray:
        x = middle._replace(**{n: getattr(middle, n) + d for n, d in zip(names, v[:4], strict=True)})
        u = electric.Command(u_p=-p.plc.gains.K_p * v[4], T_ff=0.0, brake=0.0)
        r = electric.rates(electric.circuit(x, q, u, geo, p), x, q, u, geo, p)
        return np.array([*(getattr(r, n) for n in names), x.omega_m * geo.r_eff])

    step = (1.0, 0.1, 0.1, 10.0, 1e-3)
    J = np.column_stack([(rate(e * h) - rate(-e * h)) / (2.0 * h) for e, h in zip(np.eye(5), step, strict=True)])
    speed, inertia = crane.electric.speed, 1.0 / geo.i_J
    K, K_i = speed.K, speed.K / speed.T_i
    loop = np.polymul([inertia / p.drive.rate_i, inertia, K, K_i], [speed.tau_ref, 1.0, 0.0])
    kappa = crane.control.K_p * MOTOR.n_full * geo.r_eff
    return np.sort_complex(np.linalg.eigvals(J)), np.sort_complex(
        np.roots(np.polyadd(loop, kappa * np.array([K, K_i])))
    )


def step_decay() -> tuple[float, float]:
    """Decay of a step of the wire in the twin, and the slowest pole with the dead time T of the PLC, for which the
    position loop's gain grows by exp(-s T) [1/s]."""
    operator = Operator(steps=(("20 s", "0.05 m"),))
    result = run(FREE, **(WAVE | {"tip": "still", "operator": operator, "duration": "30 s", "warm_up": "5 s"}))
    e = np.abs(result.column("e_c"))
    slow = 0.0
    for _ in range(20):
        late = changed(FREE, {"control": {"K_p": f"{FREE.control.K_p * math.exp(slow * DEAD_TIME)!r} 1/m"}})
        slow = float(np.min(np.abs(poles(late)[1])))
    return -math.log(e[2250] / e[2100]) / 1.5, slow


def compute() -> tuple[Blocks, None]:
    return {
        "claims": claims(run(**WAVE)),
        "poles": pole_table(),
        "envelope": envelope_table(),
        "steps": step_table(),
        "energy": energy_table(),
        "limits": limit_table(),
        "assumed": assumed(),
    }, None


def row(ours: float, theirs: float, unit: str, digits: int, allowed: float) -> tuple[str, str, str]:
    """Cells of a claim: theirs, ours with the difference, verdict."""
    off = ours / theirs - 1.0
    text = f"{ours:.{digits}f} {unit} ({100.0 * off:+.2g} %)".replace("-", "−")
    return f"{theirs:.{digits}f} {unit}", text, "reproduced" if abs(off) < allowed else "not reproduced"


def claims(wave: ScenarioRun) -> dict[str, Any]:
    ours, theirs = poles(FREE)
    far = float(np.max(np.abs(ours - theirs) / np.abs(theirs)))
    decay, slow = step_decay()
    hold = run(load="100 t", s_w="10 m", tip="still", duration="60 s", warm_up="10 s")
    T = weight(100.0e3) * 0.5 * (CRANE.drum.d_max - CRANE.wire.d) / CRANE.i_hD / MOTOR.count
    hot = changed(CRANE, {"electric": {"motor": {"tau_th": "60 s", "theta_max": "60 degC"}}})
    warm = run(hot, load="100 t", s_w="10 m", tip="still", duration="60 s", warm_up="1 s")
    crossed = 0.01 * int(np.argmax(warm.column("theta") > 333.15))
    rise = MOTOR.rise * (T / MOTOR.T_rated) ** 2
    heated = 60.0 * math.log(rise / (rise - 30.0))
    geo = electric.geometry(200.0, pack(CRANE, Scenario(load="47 t", s_w="200 m")).params)
    inertial = (2.0 * math.pi / 10.0) ** 2 / geo.r_eff / geo.i_J / math.sqrt(2.0)
    load = weight(47.0e3) * geo.r_eff
    rms = [math.sqrt(np.mean(counted(r, "T_m")[:6000] ** 2)) for r in (run(FREE, **WAVE), wave)]
    omega = counted(wave, "omega_m")[:6000]
    T_f = joules(wave, "friction") / 60.0 / float(np.mean(np.abs(omega)))
    down = run(**(WAVE | steady(-0.6, 60.0)))
    P, s_w = counted(down, "P_dc"), counted(down, "s_w")
    back = -0.01 * float(np.sum(P) - 0.5 * (P[0] + P[-1]))
    losses = sum(joules(down, name) for name in ("copper", "iron", "inverter", "friction"))
    M = pack(CRANE, Scenario(load="47 t", s_w="200 m")).params.drive.machines
    speeds = np.linspace(1.0, M.n_max, 22939)
    full = [machine.torque_limit(w, 1e9, 1e9, M) >= M.T_max for w in speeds]
    corner = float(speeds[np.argmin(full)])
    winding = Body(300.0, 1.0, 1.0 / 180.0, 400.0)
    published = time_to_limit(300.0, 100.0 * (47.0 / 26.0) ** 2, winding)
    grid = changed(CRANE, {"electric": {"supply": {"P_max": "300 kW"}}})
    hoist = run(grid, load="97 t", s_w="200 m", **steady(1.0, 120.0))
    p = pack(grid, Scenario(load="97 t", s_w="200 m")).params
    at_end = electric.geometry(float(hoist.column("s_w")[-1]), p)
    limit, _ = electric.speed_limit(p, at_end, p.hoist.load.W)
    return locals()


def released(s_w: np.ndarray) -> float:
    """Energy that the load gives up while wire is paid out [J]."""
    return weight(47.0e3) * float(s_w[-1] - s_w[0])


def constants() -> tuple[float, float]:
    """Voltage and torque constant of one machine [V s/rad, N m/A]: a hoist and a lowering at one speed, no friction.

    Losses are the same both ways: what reverses of the link's power is the machines' own. The wire is damped, so that
    the load does not swing.
    """
    calm = changed(FREE, {"wire": {"zeta": 0.5, "zeta_low": 0.5, "zeta_high": 0.5}})
    ends = []
    for speed in (0.5, -0.5):
        result = run(calm, **(WAVE | {"warm_up": "5 s"} | steady(speed, 20.0)))
        ends.append([float(result.column(name)[-1]) for name in ("P_dc", "i", "omega_m", "s_w")])
    (P_up, i, omega, s_w), (P_down, *_) = ends
    r_eff = electric.geometry(s_w, pack(FREE, Scenario(load="47 t", s_w="200 m")).params).r_eff
    return (P_up - P_down) / (2.0 * MOTOR.count * i * omega), weight(47.0e3) * r_eff / (MOTOR.count * i)


def pole_table() -> Rows:
    def text(s: complex) -> str:
        return f"{s.real:.4f}" + (f" ± {abs(s.imag):.4f} i" if abs(s.imag) > 1e-9 else "")

    ours, theirs = poles(FREE)
    return [
        (text(b), text(a), f"{abs(a - b) / abs(b):.0e}") for a, b in zip(ours, theirs, strict=True) if b.imag >= -1e-9
    ]


def step_table() -> Rows:
    rows = []
    for name, _, _, case, *_ in causes.variants(globals(), "case"):
        reference = run(n_sub=FINEST, **(WAVE | case))

        def off(result: ScenarioRun, signal: str, reference: ScenarioRun = reference) -> float:
            return float(np.max(np.abs(result.column(signal) - reference.column(signal))))

        for n in STEPS:
            result = run(n_sub=n, **(WAVE | case))
            cells = (1e3 * off(result, "s_w"), off(result, "T_m"), off(result, "E_store"))
            rows.append((name, f"{10.0 / n:g} ms", f"{cells[0]:.4f} mm", f"{cells[1]:.2f} N m", f"{cells[2]:.0f} J"))
        machine.CURRENT_RATE, kept = UNREDUCED, machine.CURRENT_RATE
        try:
            result = run(n_sub=FINEST, **(WAVE | case))
        finally:
            machine.CURRENT_RATE = kept
        cells = (1e3 * off(result, "s_w"), off(result, "T_m"), off(result, "E_store"))
        current = "0.1 ms, current loop at 300 Hz"
        rows.append((name, current, f"{cells[0]:.4f} mm", f"{cells[1]:.2f} N m", f"{cells[2]:.0f} J"))
    return rows


PROMISED = {Direction.LOWERING: 100.0, Direction.HOISTING: 500.0}
"""Wire out at the start of a run at a speed of the envelope [m]."""


def envelope_table() -> Rows:
    """Speeds of the envelope, the slower of start and end of the run, and runs at that and at 1.05 times it."""
    rows, duration = [], 300.0
    warm = changed(CRANE, {"electric": {"supply": {"tau_th": "30 s"}}})
    for direction, start in PROMISED.items():
        v = top_of_drive(CRANE, 100.0e3, start, direction).v_w
        v = min(v, top_of_drive(CRANE, 100.0e3, start - direction.sign * v * duration, direction).v_w)
        for share in (1.0, 1.05):
            way = steady(direction.sign * share * v, duration)
            result = run(warm, 2, load="100 t", s_w=f"{start} m", warm_up="10 s", **way)
            e, kW = result.stats.extremes, [result.column(name)[-1] / 1e3 for name in ("P_el", "P_resistor")]
            passed = limits_passed(CRANE.plant.type, result.stats)
            volts = f"{e.V_dc_min:.0f} to {e.V_dc_max:.0f} V"
            at_end = [f"{x:.0f} kW" if not passed else "" for x in kW]
            speed = f"{60.0 * share * v:.1f} m/min"
            rows.append((str(direction), f"{share:g}", speed, volts, *at_end, ", ".join(passed) or "nothing"))
    return rows


POWERS = ("grid", "tip", "copper", "iron", "inverter", "store", "resistor", "friction")


def energy_table() -> Rows:
    rows = []
    for name, _, _, case, *_ in causes.variants(globals(), "audited"):
        quarter, usual = (run(n_sub=n, **(WAVE | case)) for n in (8, 2))
        cells = [f"{joules(usual, each) / 1e3:.1f}" for each in POWERS]
        missing = [f"{abs(r.energy_unaccounted):.0e}" for r in (usual, quarter)]
        rows.append((name, *cells, *missing))
    return rows


def limit_table() -> Rows:
    rows = []
    for row in causes.variants(globals(), "pushed"):
        result = run(row.on(CRANE), 2 * FINE, **(WAVE | row.more))
        rows.append(
            (row.label, row.own["expected"], ", ".join(limits_passed(CRANE.plant.type, result.stats)) or "nothing")
        )
    return rows


def assumed() -> str:
    own = {path: source for path, source in CRANE.sources.items() if path.startswith("electric")}
    kinds = Counter(source.kind.value for source in own.values())
    parts = [f"{count} {kind}" for kind, count in sorted(kinds.items())]
    names = ", ".join(f"`{path.removeprefix('electric.')}`" for path, s in own.items() if s.kind.value == "assumed")
    return f"Of the {len(own)} numbers of `[electric]`: {', '.join(parts)}. Assumed: {names}."
