"""Secondary control on a rail with accumulators: closed forms, steps, energy, and a load that is lost."""

from __future__ import annotations

import math
import types
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import causes
import numpy as np
from batch import jacobian
from blocks import Blocks
from scipy.signal import lsim

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.summary import ScenarioRun
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.library.write import Item, items
from stillhook.physics.hydraulics.secondary import largest_speed_gain
from stillhook.physics.scalar import G
from stillhook.spec.crane import Crane, SourceKind
from stillhook.spec.scenario import Operator
from stillhook.units import show
from stillhook.winches.records import Tick
from stillhook.winches.types import secondary

SLOW_PAGE = True
NAME = "nov-250t-secondary"
BASE = {"load": "125 t", "s_w": "200 m", "tip": "sine 1 m 10 s", "mode": "position"}
LOSSLESS, FIRST_ORDER = causes.variants(globals())
STEPS = (2, 4, 8, 16)
FINEST = 64
"""Steps per PLC cycle of 10 ms."""
LOST = ("60 t", "125 t", "250 t")


@cache
def crane(lossless: bool = False) -> Crane:
    return LOSSLESS.on(load_crane(NAME)) if lossless else load_crane(NAME)


def case(**changes: Any) -> Scenario:
    """A case of the page; operator: a speed from 10 s on, with the tip still."""
    speed = changes.pop("operator", None)
    if speed is not None:
        profile = (("0 s", "0 m/min"), ("10 s", speed), ("100 s", speed), ("105 s", "0 m/min"))
        changes = {"mode": "manual", "tip": "still", "s_w": "400 m", "duration": "110 s", "warm_up": "0 s"} | changes
        changes["operator"] = Operator(profile=profile)
    return Scenario(**({"duration": "60 s", "warm_up": "30 s"} | BASE | changes))


def run_one(of: Crane, scenario: Scenario, n_sub: int) -> ScenarioRun:
    return run_cases(of, [scenario], step=n_sub, lanes=1, keep=unchanged)[0]


def weight() -> float:
    return float((case().load + crane().hook_mass) * G)


# Speed loop


class Moving(NamedTuple):
    """The winch at a speed with the hook's weight: state, point of the load path, command, drum."""

    x: secondary.State
    q: Any
    u: secondary.Command
    geo: Any


def moving(p: Any, omega_m: float) -> Moving:
    geo = secondary.geometry(200.0, p)
    F = p.hoist.load.W
    D, dp = p.rail.settings.D_m_max, p.rail.settings.p_set - p.rail.settings.p_lp
    rest = secondary.State(*[0.0] * len(secondary.State._fields))
    V_o = 0.5 * p.rail.accumulator.V_stroke
    x = rest._replace(alpha_s=F * geo.r_eff / (D * dp), V_o=V_o, omega_m=omega_m)
    u = secondary.Command(omega_ref=omega_m, T_ahead=F * geo.r_eff, u_rp=0.0, f_pump=1.0, brake=0.0)
    return Moving(x, types.SimpleNamespace(F_w=F), u, geo)


def poles(p: Any) -> np.ndarray:
    """Eigenvalues of setting, its rate, integral and speed at 50 rad/s, from differences of the twin's own rates."""
    x, q, u, geo = moving(p, 50.0)
    steps = {"alpha_s": 1e-6, "alpha_s_dot": 1e-6, "T_I": 1.0, "omega_m": 1e-4}
    return np.linalg.eigvals(jacobian(secondary, x, q, u, geo, p, steps))


def worst_pole() -> float:
    """Largest relative distance of a pole from those of s^4 + 2 zeta w s^3 + w^2 s^2 + K w^2 s + K w^2/T_i."""
    servo, drive = crane().secondary.unit.servo, crane().secondary.drive
    w, K = servo.omega_n, drive.K
    closed = np.roots([1.0, 2.0 * servo.zeta * w, w * w, K * w * w, K * w * w / drive.T_i])
    found = poles(pack(crane(True), case(load="0 t", gas_held=True)).params)
    return max(float(np.min(np.abs(found - pole)) / abs(pole)) for pole in closed)


def natural_frequency() -> tuple[float, float]:
    """sqrt(K_alpha D p omega_swash/J), and the twin's own [rad/s]."""
    p = pack(FIRST_ORDER.on(crane(True)), case(load="0 t", gas_held=True)).params
    x, q, u, geo = moving(p, 50.0)
    u_s = [secondary.circuit(x, q, u._replace(omega_ref=50.0 + d), geo, p).u_s for d in (0.0, 0.1)]
    D, dp = p.rail.settings.D_m_max, p.rail.settings.p_set - p.rail.settings.p_lp
    closed = math.sqrt((u_s[1] - u_s[0]) / 0.1 * D * dp * 20.0 * geo.i_J)
    return closed, next(float(abs(pole)) for pole in poles(p) if pole.imag > 1.0)


def marginal_gain() -> tuple[float, float]:
    """Speed gain of marginal stability by Routh, and where the twin's poles cross [1/s]."""
    servo, drive = crane().secondary.unit.servo, crane().secondary.drive
    p = pack(crane(True), case(load="0 t", gas_held=True)).params
    low, high = 1.0, 200.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        stable = np.max(poles(p._replace(drive=p.drive._replace(K=middle))).real) < 0.0
        low, high = (middle, high) if stable else (low, middle)
    return float(largest_speed_gain(servo.omega_n, servo.zeta, drive.T_i)), low


def step_response() -> float:
    """Largest distance of the running twin from the linear loop after a speed command, of the step."""
    scenario = case(operator="10 m/min", load="0 t", gas_held=True, duration="40 s")
    run = simulate(crane(True), scenario, every="10 ms")
    p = pack(crane(True), scenario).params
    geo = secondary.geometry(400.0, p)
    servo, drive = crane().secondary.unit.servo, crane().secondary.drive
    K = drive.K / (1.0 + p.hoist.load.m * geo.r_eff**2 * geo.i_J)
    w, T_i = servo.omega_n, drive.T_i
    loop = ([K * w * w, K * w * w / T_i], [1.0, 2.0 * servo.zeta * w, w * w, K * w * w, K * w * w / T_i])
    held = np.append(0.0, run.omega_ref.values[:-1])  # commands take effect a cycle later
    _, expected, _ = lsim(loop, held, run.time.values, interp=False)
    return float(np.max(np.abs(run.omega_m.values - expected)) / np.max(np.abs(expected)))


# Oil, pressure, energy, torque


def swings() -> dict[str, tuple[float, float]]:
    """Swing of the oil [m^3] and of the rail [Pa] in a swell without losses: closed form, ours."""
    run = simulate(crane(True), case(warm_up="50 s", duration="100 s"))
    rail, late = crane().secondary, run.time.values > 50.0
    gas = rail.accumulator.gas
    V = weight() * 2.0 / (gas.p_0 - rail.p_lp)
    mean = float(run.V_acc.values[late].mean()) - 0.5 * rail.accumulator.V_stroke
    high, low = (gas.p_0 * (gas.V_0 / (gas.V_0 - mean - sign * 0.5 * V)) ** gas.n for sign in (1.0, -1.0))
    return {
        "oil": (V, float(np.ptp(run.V_acc.values[late]))),
        "pressure": (high - low, float(np.ptp(run.p_r.values[late]))),
    }


def over_periods() -> tuple[float, float]:
    """Energy of pumps, boost and tip over ten periods of a steady swell, and what is lost [J]."""
    result = run_one(crane(), case(warm_up="700 s", duration="800 s"), 2)
    power = {name: value * result.t_cycle for name, value in result.stats.power._asdict().items()}
    lost = sum(power[name] for name in ("friction", "leakage", "relief", "piston", "wire", "drag"))
    return power["pump"] + power["boost"] + power["tip"], lost


def torque_by_speed() -> float:
    """Two hoisting speeds on a rail of constant pressure: difference of the units' torque less that of friction, over
    the torque."""
    rail, found = crane().secondary, []
    most = rail.unit.D_total * (rail.accumulator.gas.p_0 - rail.p_lp)
    for speed in ("5 m/min", "30 m/min"):
        run = simulate(crane(), case(operator=speed, gas_held=True))
        steady = (run.time.values > 50.0) & (run.time.values < 55.0)
        found.append((most * float(run.alpha_s.values[steady].mean()), float(run.T_f.values[steady].mean())))
    (T_1, f_1), (T_2, f_2) = found
    return abs((T_2 - T_1) - (f_2 - f_1)) / T_1


# A lost load


class Lost(NamedTuple):
    """After the load is lost at 0 s: time [s], motor speed [rad/s], setting [-]."""

    t: np.ndarray
    omega_m: np.ndarray
    alpha_s: np.ndarray

    @property
    def highest(self) -> float:
        return float(np.max(np.abs(self.omega_m)))


def lost(load: str, *, guarded: bool) -> Lost:
    """The wire goes slack at once: rates of the twin in steps of 1 ms, and what its PLC feeds forward each cycle, one
    cycle late."""
    p = pack(crane(), case(load=load, mode="manual", tip="still")).params
    if not guarded:
        p = p._replace(drive=p.drive._replace(most=1e9))
    x, _, u, geo = moving(p, 0.0)
    q, tick, rows = types.SimpleNamespace(F_w=0.0), Tick(*[0.0] * len(Tick._fields)), []
    h, t_cycle, F_mean, waiting = 1e-3, p.plc.t_cycle, p.hoist.load.W, u
    for k in range(1000):
        rows.append((k * h, x.omega_m, x.alpha_s))
        if k % round(t_cycle / h) == 0:
            u, F_mean = waiting, F_mean * (1.0 - t_cycle / (p.plc.tau_F + t_cycle))
            r = types.SimpleNamespace(F=1.0, p_hp=p.rail.settings.p_set)
            m = types.SimpleNamespace(F=F_mean, mode=0.0)
            waiting = u._replace(T_ahead=secondary.torque_ahead(0.0, 0.0, r, x, m, 0.0, tick, geo, p))
        c = secondary.circuit(x, q, u, geo, p)
        z = secondary.bristle_after(c, x, p, h)
        rate = secondary.rates(c, x, q, u, geo, p)
        x = secondary.State(*(a + h * b for a, b in zip(x, rate, strict=True)))._replace(z=z)
    return Lost(*np.array(rows).T)


# The page


def rpm(omega: float) -> str:
    return f"{omega * 30.0 / math.pi:.0f} rev/min"


def claims() -> dict[str, Any]:
    oil, pressure = swings()["oil"], swings()["pressure"]
    given, spent = over_periods()
    closed, found = natural_frequency()
    routh, crosses = marginal_gain()
    pole, step, torque = worst_pole(), step_response(), torque_by_speed()

    def off(pair: tuple[float, float]) -> float:
        return abs(pair[1] / pair[0] - 1.0)

    return locals()


def steps() -> list[tuple[str, str, str]]:
    """Error of the wire paid out after 12 s, by step."""
    scenario = case(duration="12 s", warm_up="5 s")
    s_w = {n: run_one(crane(), scenario, n).state.path.s_w for n in (*STEPS, FINEST)}
    errors = [abs(s_w[n] - s_w[FINEST]) for n in STEPS]
    ratios = ["", *(f"{b / a:.2f}" for a, b in pairwise(errors))]
    return [(f"{10.0 / n:g} ms", f"{1e6 * e:.2f} µm", r) for n, e, r in zip(STEPS, errors, ratios, strict=True)]


def audit() -> list[tuple[str, str, str]]:
    rows = []
    for row in causes.variants(globals(), "audited"):
        result = run_one(crane(), case(**row.more), 5)
        passed = ", ".join(crane().plant.type.limits_passed(result.stats)) or "none"
        rows.append((row.label, f"{abs(result.energy_unaccounted):.0e}", passed))
    return rows


def text(item: Item) -> str:
    """A value as the crane sheet has it."""
    if item.quantity is None:
        return f"{item.value:g}" if isinstance(item.value, float) else str(item.value)
    values = item.value if isinstance(item.value, tuple) else (item.value,)
    return ", ".join(show(value, item.quantity) for value in values)


def assumed() -> list[tuple[str, str, str]]:
    shown = {item.path: item for item in items(crane())}
    return [
        (f"`{path}`", text(shown[path]), source.text)
        for path, source in crane().sources.items()
        if path.startswith("secondary.") and source.kind is SourceKind.ASSUMED
    ]


def compute() -> tuple[Blocks, None]:
    shown = {load: (lost(load, guarded=True), lost(load, guarded=False)) for load in LOST}
    limit = crane().secondary.unit.n_max_full
    rows = [(load, rpm(a.highest), rpm(b.highest), rpm(limit)) for load, (a, b) in shown.items()]
    return {
        "claims": claims(),
        "steps": steps(),
        "audit": audit(),
        "lost": rows,
        "assumed": assumed(),
    }, None
