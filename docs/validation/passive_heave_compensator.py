"""A passive heave compensator: closed forms of a gas spring against the running lowering, end stops, energy, the linear
form, and the wave zone with it and without."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from blocks import Blocks

from stillhook import load_crane, read_compensator, read_payload
from stillhook.engine.lowering.summary import LoweringRun
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import vessel_file
from stillhook.physics.scalar import G
from stillhook.response.forcing import Forcing
from stillhook.response.frequency_domain import compensated_sigmas
from stillhook.response.suspended_load import suspended_load
from stillhook.response.winch.linear_form import Residual
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.motion import Motion, Profile, Sine, Still
from stillhook.sea.spectra.text import parse_sea
from stillhook.sea.vessel.realisation import Amplitudes
from stillhook.spec.lift.lowering import InSea, Lowering, Rigging
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase
from stillhook.winches.load_path.gas_spring import Compensator

SLOW_PAGE = True
CRANE = load_crane("nov-250t")
MASS = 102e3
"""Payload of 100 t and rod of 2 t [kg]."""
RHO = 1025.0
PERIODS = (3.0, 5.0, 8.0, 10.0, 14.0)
STEPS = (1, 2, 4)
"""Steps of a PLC cycle of 10 ms."""
SEEDS = 16
HOLD = (Phase(mode="manual", time="9000 s"),)
BRAKE = Residual.constant(1.0, "winch on its brake")


def unit(**changes: object) -> Compensator:
    given = {"stroke": "4 m", "area": "0.09 m^2", "p_0": "95 bar", "V_0": "1.35 m^3", "length": "7 m"}
    return Compensator(**{**given, "mass_cylinder": "8 t", "mass_rod": "2 t", **changes})


def box(mass: str = "100 t") -> Payload:
    levels = tuple(
        {"h": f"{h} m", "V": f"{V} m^3", "A33": f"{A} t", "A_p": f"{S} m^2"}
        for h, V, A, S in ((0, 0, 0, 0), (5, 10, 40, 20))
    )
    return Payload(name="box", mass=mass, height="5 m", C_D=1.0, levels=levels)


def lift(tip: Motion, link: Compensator | None, **changes: object) -> Lowering:
    given: dict[str, Any] = {
        "payload": box(),
        "start_depth": "-8 m",
        "depth": "600 m",
        "programme": HOLD,
        "duration": "300 s",
    }
    given |= {"ramp": "60 s", "rigging": Rigging(zeta=0.0)} | changes
    return Lowering(tip=tip, h_tip="40 m", compensator=link, **given)


def run(case: Lowering, *, n_sub: int = 2, every: int = 1) -> LoweringRun:
    return run_cases(CRANE, [case], step=n_sub, lanes=1, every=every, keep=unchanged)[0]


def column(r: LoweringRun, name: str, last: float = math.inf) -> np.ndarray:
    assert r.series is not None
    rows = r.series if math.isinf(last) else r.series[-round(last / r.dt) :]
    return rows[:, r.signals.index(name)]


def amplitudes(y: np.ndarray, dt: float, omegas: list[float]) -> list[float]:
    t = dt * np.arange(len(y))
    waves = [f(w * t) for w in omegas for f in (np.cos, np.sin)]
    x = np.linalg.lstsq(np.stack([np.ones_like(t), t, *waves], axis=1), y, rcond=None)[0]
    return [math.hypot(x[2 + 2 * i], x[3 + 2 * i]) for i in range(len(omegas))]


def gas_volume(link: Compensator, W: float) -> float:
    """Volume at which the gas carries W [m^3]."""
    return float(link.V_0 * (link.p_0 * link.area / W) ** (1.0 / link.n))


class Transfer(NamedTuple):
    """Payload and stroke per hook motion at a period [s], by the twin and in closed form."""

    T: float
    load: float
    stroke: float
    closed: float


def transfer(T: float, amplitude: float = 5e-3, **changes: object) -> Transfer:
    link, omega = unit(**changes), 2.0 * math.pi / T
    omega_n = math.sqrt(link.n * link.area * G / gas_volume(link, MASS * G))
    r = run(lift(Sine(amplitude=f"{amplitude} m", period=f"{T} s"), link, duration="250 s"))
    hook, load, stroke = (
        amplitudes(column(r, name, 150.0), r.dt, [omega, omega_n])[0] for name in ("s_hook", "s_load", "s_c")
    )
    return Transfer(T, load / hook, stroke / hook, 1.0 / abs((omega / omega_n) ** 2 - 1.0))


class Swing(NamedTuple):
    """Free swing after a step of the hook: amplitude [m], frequency over that of small swings, and by perturbation."""

    a: float
    ratio: float
    perturbation: float


def swing(step: float) -> tuple[float, float]:
    v = f"{step / 0.3} m/s"
    points = [("0 s", "0 m/s"), ("0.1 s", v), ("0.3 s", v), ("0.4 s", "0 m/s"), ("2000 s", "0 m/s")]
    link = unit(stroke="3.2 m", V_0="0.081 m^3", area="0.018 m^2", n=1.67, p_0="55.4 bar")
    r = run(lift(Profile(points=points), link, ramp="0 s", duration="60 s", payload=box("18 t")))
    y = column(r, "s_c", 50.0) - np.mean(column(r, "s_c", 50.0))
    rises = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
    times = r.dt * (rises - y[rises] / (y[rises + 1] - y[rises]))
    omega = 2.0 * math.pi * (len(times) - 1) / (times[-1] - times[0])
    return omega, amplitudes(y, r.dt, [omega, 2.0 * omega, 3.0 * omega])[0]


def swings() -> list[Swing]:
    link = unit(stroke="3.2 m", V_0="0.081 m^3", area="0.018 m^2", n=1.67, p_0="55.4 bar")
    V, n = gas_volume(link, 20e3 * G), link.n
    small, _ = swing(0.02)
    out = []
    for step in (0.3, 0.6, 0.9):
        omega, a = swing(step)
        out.append(Swing(a, omega / small, 1.0 + (n + 1.0) * (1.0 - 2.0 * n) / 48.0 * (a * link.area / V) ** 2))
    return out


def depths() -> list[tuple[float, float, float]]:
    """Depth of the cylinder's lower end [m], gas force by the twin and by statics [N]."""
    link, out = unit(rod_area="0.01 m^2", p_0="80 bar"), []
    for z in (-30.0, -200.0, -400.0):
        r = run(lift(Still(), link, start_depth=f"{-z} m", duration="10 s"))
        d = -(column(r, "z_load")[-1] + 15.0 + column(r, "s_c")[-1])
        W = (MASS - RHO * 10.0) * G
        out.append((d, float(column(r, "p_c")[-1]) * link.area, W - RHO * G * 0.01 * d))
    return out


class Step(NamedTuple):
    """A step [s]: largest sling tension [N] and time of the first end stop [s] in a lowering that strikes its stops."""

    h: float
    F: float
    t: float
    s: float


def steps() -> list[Step]:
    link = unit(p_0="80 bar", friction="20 kN", orifice="50 kN s^2/m^2")
    case = lift(Sine(amplitude="1.5 m", period="6 s"), link, ramp="10 s", duration="40 s")
    out = []
    for n_sub in (*STEPS, 16):
        r = run(case, n_sub=n_sub, every=0).total
        assert r.link is not None
        out.append(Step(0.01 / n_sub, r.lift.F_s_max, min(r.link.t_out, r.link.t_in), r.link.s_c_min))
    return out


def audit() -> list[tuple[str, float, float]]:
    """What a landing lost in rod and wire [J], and the energy not found again, over what passed [-]."""
    landing = (
        Phase(mode="splash", speed="15 m/min", depth="12 m"),
        Phase(mode="ahc", speed="30 m/min", depth="56 m"),
        Phase(mode="landing", speed="6 m/min", tension="250 kN", time="15 s"),
    )
    out = []
    kinds = {
        "slings alone": None,
        "gas alone": unit(),
        "orifice and seals": unit(friction="20 kN", orifice="50 kN s^2/m^2"),
    }
    for name, link in kinds.items():
        tip = Sine(amplitude="1 m", period="8 s")
        case = lift(tip, link, start_depth="-2 m", depth="60 m", programme=landing, ramp="10 s", duration="360 s")
        r = run(case, every=0)
        out.append((name, r.hang.works.damping, abs(r.energy_unaccounted)))
    return out


def irregular(sigma: float) -> tuple[IrregularTip, Forcing]:
    """A tip that moves at random with this deviation [m] about 8 s, and the same as a forcing."""
    length, k = 1200.0, np.arange(1, 400)
    omega = np.asarray(2.0 * math.pi / length * k, dtype=np.float64)
    S = np.exp(-0.5 * ((omega - 0.8) / 0.12) ** 2)
    S *= sigma**2 / S.sum()
    phases = np.random.default_rng(3).random(len(k))
    tip = IrregularTip(np.concatenate(([0.0], np.sqrt(2.0 * S) * np.exp(2j * math.pi * phases))), length)
    none = np.zeros((1, len(k)))
    return tip, Forcing(omega, np.full(len(k), omega[0]), S[None, :], none, none.astype(complex))


def linear() -> list[tuple[str, float, float, float, float]]:
    """Deviations of stroke and payload [m]: twin, linear form."""
    tip, forcing = irregular(0.25)
    soft = {"V_0": "4 m^3", "p_0": "94 bar"}
    near = {"p_0": "80 bar"}
    cases = {
        "12.9 s, gas alone": unit(**soft),
        "12.9 s, orifice of 200 kN s²/m²": unit(**soft, orifice="200 kN s^2/m^2"),
        "12.9 s, seals of 20 kN": unit(**soft, friction="20 kN"),
        "7.3 s (resonance), orifice of 200 kN s²/m²": unit(**near, orifice="200 kN s^2/m^2"),
        "7.3 s (resonance), gas alone": unit(**near),
    }
    out = []
    for name, link in cases.items():
        case = lift(tip, link, start_depth="120 m", duration="1200 s", ramp="20 s", rigging=Rigging())
        load = suspended_load(CRANE, case, -120.0)
        s, way = compensated_sigmas(forcing, load, BRAKE)
        assert way is not None
        r = run(case, every=2)
        stroke, moved = (float(np.std(column(r, name, 1140.0))) for name in ("s_c", "s_load"))
        out.append((name, stroke, float(way.stroke[0]), moved, float(s.load[0])))
    return out


class Surface(NamedTuple):
    """Manifold through the waves, the mean over seeds: largest and least sling tension [N], runs with slack slings, and
    runs whose rod struck an end."""

    F_max: float
    F_min: float
    slack: int
    stops: int


def surface() -> dict[tuple[float, str], Surface]:
    out = {}
    rao = read_vessel(vessel_file("construction-vessel-130m"))
    down = (Phase(mode="manual", time="30 s"), Phase(mode="manual", speed="15 m/min", depth="20 m"))
    library = read_compensator("phc-60t")
    links = {"slings": None, "phc-60t": library, "no seals": library.model_copy(update={"friction": 0.0})}
    for Tp in (7.0, 10.0):
        sea = parse_sea(f"jonswap Hs=2 m Tp={Tp} s", heading="180 deg")
        for name, link in links.items():
            calm = Lowering(
                payload=read_payload("manifold-60t"), h_tip="36 m", depth="300 m", start_depth="-5 m", programme=down,
                duration="160 s", compensator=link,
            )  # fmt: skip
            cases = [
                InSea(calm, sea, seed, rao, -15.0, -24.0, water=True, amplitudes=Amplitudes.RAYLEIGH).lowering()
                for seed in range(1, SEEDS + 1)
            ]
            runs = [r.total for r in run_cases(CRANE, cases, step=2, lanes=16, keep=unchanged)]
            out[Tp, name] = Surface(
                float(np.mean([r.lift.F_s_max for r in runs])),
                float(np.mean([r.lift.F_s_min for r in runs])),
                sum(r.lift.slack > 0.0 for r in runs),
                sum(r.link is not None and r.link.out + r.link.inside > 0.0 for r in runs),
            )
    return out


def compute() -> tuple[Blocks, None]:
    free, swung, deep, stepped = [transfer(T) for T in PERIODS], swings(), depths(), steps()
    audited, linear_rows, through = audit(), linear(), surface()
    found = {
        "claims": claims(free, swung, deep, audited, linear_rows),
        "transfer": free,
        "amplitude": swung,
        "depth": deep,
        "steps": stepped,
        "audit": audited,
        "linear": linear_rows,
        "surface": [{"Tp": Tp, "name": name, **x._asdict()} for (Tp, name), x in through.items()],
    }
    return found, None


def claims(free: list[Transfer], swung: list[Swing], deep: Any, audited: Any, linear_rows: Any) -> dict[str, Any]:
    off = max(abs(x.load / x.closed - 1.0) for x in free)
    bent = max(abs(x.ratio - x.perturbation) for x in swung)
    pressed = max(abs(F / closed - 1.0) for _, F, closed in deep)
    lost = max(missing for _, _, missing in audited)
    soft = [row for row in linear_rows if row[0].startswith("12.9") and "seals" not in row[0]]
    away = max(abs(ours / theirs - 1.0) for _, theirs, ours, *_ in soft)
    return locals()


def within(x: float) -> str:
    return f"within {100.0 * x:.1g} %"
