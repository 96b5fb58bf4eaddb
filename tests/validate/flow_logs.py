"""Logs of the active circuit's flow balance alone, made without the twin's laws for what leaks: form, slip, warming and drift are known."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from tests.validate.ahc_logs import TWIN, record

from stillhook.engine.pack.winch import active_record
from stillhook.physics.hydraulics.lines import capacitance
from stillhook.units import parse
from stillhook.validate.parameters.segments import LogPart

STEP = 0.01  # s
N_1000 = parse("1000 rev/min", "rotation")
L_MIN_BAR = parse("1 L/min/bar", "leakage")
BAR = 1e5
KNOTS, TABLE = (0.2, 0.4, 0.6, 0.8, 1.0), (0.1260, 0.1305, 0.1328, 0.1260, 0.1825)
"""Tables 2.5 and 2.6 at 1800 rev/min for 1355 cm^3/rev [L/min/bar]."""
NOISE = {"p_a": 0.5 * BAR, "p_b": 0.5 * BAR, "omega_m": 0.3, "alpha_p": 5e-4, "alpha_m": 5e-4}


@dataclass(frozen=True)
class Leaks:
    """Total leak: constant + stroke times the pumps' table + speed per 1000 rev/min [L/min/bar, -, L/min/bar]; slip of the electric motors
    at full flow and 250 bar [-]; warming of the oil over the log [K] at 3 % per kelvin; drift of the zeros of p_a, p_b [bar]; late: lag of
    the motor speed's signal [s]; by_pressure: rise of the conductance up to 225 bar, over that without pressure [-]."""

    constant: float = 0.0
    stroke: float = 0.0
    speed: float = 0.0
    slip: float = 0.0
    warming: float = 0.0
    drift: float = 0.0
    late: float = 0.0
    by_pressure: float = 0.0

    def conductance(self, alpha_p, n_m):
        """Cold leak conductance [L/min/bar]."""
        return (
            self.constant + self.stroke * np.interp(np.abs(alpha_p), KNOTS, TABLE) + self.speed * np.abs(n_m) / N_1000
        )


def red(rng, n, tau):
    """Noise of unit variance that hangs together over tau seconds."""
    a = np.exp(-STEP / tau)
    return lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], rng.standard_normal(n), zi=[a * rng.standard_normal()])[0]


def flow_log(leaks: Leaks, rng, *, seconds: float = 300.0):
    """Signals of one test, and its true leak conductance and head, (n,) [L/min/bar, bar]: waves of 6 to 14 s, motors reduced when fast,
    friction that turns the pressures with the motion."""
    n = round(seconds / STEP)
    t = np.arange(n) * STEP
    a = active_record(TWIN)
    D_m, Q = a.motors.count * a.motors.D_max, a.pumps.D_max * a.pumps.omega_p
    periods, phases = rng.uniform(6.0, 14.0, 20), rng.uniform(0.0, 2.0 * np.pi, 20)
    v = np.sum(np.cos(2.0 * np.pi * t[:, None] / periods + phases), axis=1) / np.sqrt(10.0)
    v *= 0.3  # of the speed of full pumps
    alpha_m = np.clip(1.0 - 1.2 * np.maximum(np.abs(v) - 0.2, 0.0), 0.6, 1.0)
    alpha_m = lfilter([0.02], [1.0, -0.98], alpha_m, zi=[0.98 * alpha_m[0]])[0]
    omega_m = v * Q / (D_m * alpha_m)
    dp = (15.0 + 3.0 * red(rng, n, 20.0) + 45.0 * np.tanh(6.0 * v) + 20.0 * v) * BAR
    p_a, p_b = 25.0 * BAR + np.maximum(dp, 0.0), 25.0 * BAR + np.maximum(-dp, 0.0)
    higher, sign = np.maximum(p_a, p_b), np.sign(dp)
    head = 2.0 / 3.0 * np.abs(dp) + 1.0 / 3.0 * higher
    warm = 1.0 + 0.03 * leaks.warming * (t / seconds - 0.5)
    filled = np.gradient(higher, STEP) * capacitance(TWIN.active.line.V, TWIN.active.line.bulk_modulus)
    alpha_p = v.copy()
    for _ in range(6):  # what leaks goes with the setting that makes up for it
        C = (
            warm
            * leaks.conductance(alpha_p, omega_m)
            * L_MIN_BAR
            * (1.0 + leaks.by_pressure * np.abs(dp) / (225.0 * BAR))
        )
        slipped = leaks.slip * Q * alpha_p**2 * np.abs(dp) / (250.0 * BAR)
        alpha_p = (D_m * alpha_m * omega_m + sign * (C * head + filled + slipped)) / Q
    late = round(leaks.late / STEP)
    log = {
        "p_a": p_a,
        "p_b": p_b,
        "omega_m": np.concatenate((np.full(late, omega_m[0]), omega_m[: n - late])),
        "alpha_p": alpha_p,
        "alpha_m": alpha_m,
    }
    log = {name: x + NOISE[name] * rng.standard_normal(n) for name, x in log.items()}
    for name in ("p_a", "p_b"):
        log[name] += leaks.drift * BAR * red(rng, n, 120.0)
    return log | {"s_tip": np.zeros(n), "s_w": np.full(n, 500.0)}, C / L_MIN_BAR, head


def flow_parts(leaks: Leaks, seed: int, *, crane=TWIN, tests: int = 2, seconds: float = 300.0):
    """Parts of some tests, and the true leak conductance at their working point [L/min/bar]."""
    rng, parts, flow, heads = np.random.default_rng(seed), [], 0.0, 0.0
    for i in range(tests):
        log, C, head = flow_log(leaks, rng, seconds=seconds)
        r = record(log, name=str(i + 1))
        parts.append(LogPart(crane, r, r.segments[0], i))
        flow, heads = flow + float(np.sum(C * head)), heads + float(np.sum(head))
    return parts, flow / heads
