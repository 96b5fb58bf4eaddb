"""Lifts in air off a moving deck and onto it: restitution, second hits, hoisting speeds, a winch that follows it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray
from blocks import Blocks, panel, picture, save
from scipy.integrate import solve_ivp

from stillhook import Lowering, Profile, load_crane, parse_sea, read_payload, read_vessel, simulate
from stillhook.engine.lowering.hoisting_speed import HoistingSpeed, begun, hoisting_speed
from stillhook.library.catalogue import vessel_file
from stillhook.physics.load_path.deck import damping_ratio
from stillhook.physics.scalar import G
from stillhook.plan.tiers.other_vessel import deck_speed, relative_speed
from stillhook.sea.vessel.boom import TipPoint
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.sea.vessel.relative import DeckMotion, OtherVessel
from stillhook.spec.lift.deck import Deck
from stillhook.spec.lift.lowering import DeepWire, Rigging, WinchSettings
from stillhook.spec.lift.payload import Payload

SLOW_PAGE = True
CRANE, PAYLOAD = load_crane("nov-250t"), read_payload("manifold-60t")
SIZES = {"V": "1 m^3", "A33": "1 t", "A_p": "4 m^2"}
LIGHT = Payload(name="3 t", mass="3 t", height="3 m", C_D=1.0, levels=({"h": "0 m"} | SIZES, {"h": "3 m"} | SIZES))
A, T, SLACK, RAMP = 0.5, 8.0, 2.0, 0.1  # m, s, m, m/s^2
OMEGA = 2.0 * math.pi / T
PEAK = A * OMEGA
RESTITUTION, TIMES, FOLLOWED = 5e-3, 0.1, 0.03
"""Relative, of the rebound; of the times of a second hit [s]; relative, of the speed of a set-down on a slow deck."""
SPEEDS = (0.2, 0.25, 0.3, 0.35, 0.375, 0.4, 0.45)
HS = (1.0, 1.5)
IN_SEA = (0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5)
SHOWN = (0.2, 0.3, 0.4)
SPAN, STARTS = 200.0, 48
WAIT = {"mode": "manual", "time": "20 s"}
K_H = (0.5, 0.28)
"""Of EN 13852-1 for one fall of wire and for several, as publicly quoted."""


def lift(deck: Deck, programme: tuple[dict[str, str], ...], **more: Any) -> Lowering:
    given = {"payload": PAYLOAD, "h_tip": "36 m", "depth": "60 m", "start_depth": "-4 m", "duration": "90 s"}
    return Lowering(**given | {"programme": programme, "deck": deck, "wire": DeepWire(nodes=5)} | more)


def hoists(v: float) -> dict[str, str]:
    return {"mode": "manual", "speed": f"{-v} m/s", "depth": "-12 m"}


def off(v: float, **more: Any) -> Lowering:
    deck = Deck(height="4 m", motion=f"sine {A} m {T} s", slack=f"{SLACK} m")
    return lift(deck, (WAIT, hoists(v)), winch=WinchSettings(ramp=f"{RAMP} m/s^2"), **more)


def rebound(v: float, omega: float, zeta: float) -> float:
    """Speed at the height of the deck after a hit at v [m/s], by an integration of its own, the weight included."""

    def apart(_: float, y: Any) -> float:
        return float(y[0])

    apart.terminal, apart.direction = True, -1.0  # type: ignore[attr-defined]

    def rates(_: float, y: Any) -> list[float]:
        return [y[1], G - max(omega**2 * y[0] + 2.0 * zeta * omega * y[1], 0.0)]

    run = solve_ivp(rates, (0.0, 2.0), [0.0, v], events=apart, rtol=1e-10, atol=1e-13, max_step=1e-4)
    return float(-run.y[1, -1])


def restitutions() -> tuple[list[dict[str, float]], float]:
    """A payload thrown by a deck that stops, and the first hit of its fall on the fixed deck."""
    thrown = Profile(points=[("0 s", "0 m/s"), ("2 s", "2 m/s"), ("2.02 s", "0 m/s")])
    rows = []
    for e in (0.9, 0.6, 0.3):
        deck = Deck(height="4 m", motion=thrown, slack="9 m", settlement="0.2 mm", restitution=e)
        run = simulate(CRANE, lift(deck, (WAIT,), duration="2.7 s", ramp="0 s"), every="0.01 s", step="0.5 ms")
        z, t = run.z_load.values, run.time.values
        top = 4.0 + float(thrown.sample(3.0)[0])
        v, t_hit = math.sqrt(2.0 * G * (z.max() - top)), float(run.t_second_hit)
        k = int(np.argmax(t > t_hit + 0.03))
        ours = math.sqrt(float(run.v_load[k]) ** 2 + 2.0 * G * (z[k] - top))
        closed = rebound(v, math.sqrt(G / 0.2e-3), damping_ratio(e))
        rows.append({"e": e, "v": v, "v_hit": float(run.v_second_hit_max), "ours": ours / v, "closed": closed / v})
    return rows, max(abs(row["ours"] / row["closed"] - 1.0) for row in rows)


def line(t: np.ndarray, v: float, start: float) -> np.ndarray:
    """Height of the hook's rigid line against the deck at rest, taut at 0 [m]."""
    s = np.maximum(t - start, 0.0)
    return -SLACK + np.where(s < v / RAMP, 0.5 * RAMP * s * s, v * (s - 0.5 * v / RAMP))


def rigid(v: float, start: float) -> tuple[float, float, float]:
    """Lift-off, second hit [s] and its speed [m/s] on a rigid wire; NaN where there is none."""
    t = np.arange(start, start + SLACK / v + v / RAMP + 3.0 * T, 1e-3)
    gap = line(t, v, start) - A * np.sin(OMEGA * t)
    i = int(np.argmax(gap >= 0.0))
    below = gap[i + 1 :] < 0.0
    if not below.any():
        return float(t[i]), math.nan, math.nan
    j = i + 1 + int(np.argmax(below))
    speed = PEAK * math.cos(OMEGA * t[j]) - (line(t[j : j + 1], v, start) - line(t[j - 1 : j], v, start))[0] / 1e-3
    return float(t[i]), float(t[j]), float(speed)


def hit_rows() -> tuple[list[tuple[str, ...]], float, xarray.Dataset]:
    """A light payload, so that the wire hardly gives, off a deck of 1 m from several starts: the hook's line is that of
    the run's wire until it meets the deck, and straight from there."""
    v, tall, rows, worst = 0.3, 1.0, [], 0.0
    deck = Deck(height="4 m", motion=f"sine {tall} m {T} s", slack="3 m")
    more = {"payload": LIGHT, "rigging": Rigging(stiffness="50 MN/m", height="4 m", zeta=1.0), "h_tip": "28 m"}
    case = lift(deck, (WAIT, hoists(v)), winch=WinchSettings(ramp="0.2 m/s^2"), **more)
    for start in (20.0, 21.0, 22.0, 24.0):
        run = simulate(CRANE, begun(case, 1, v, start - 20.0), every="0.02 s", step="2 ms")
        t = np.arange(0.0, 60.0, 1e-3)
        z, hook = tall * np.sin(OMEGA * t), np.interp(t, run.time, float(run.s_w[0]) - run.s_w - 3.0)
        i = int(np.argmax(hook >= z))
        again = z[i] + v * (t - t[i]) < z
        again[: i + 2] = False
        j = int(np.argmax(again))
        speed = tall * OMEGA * math.cos(OMEGA * t[j]) - v
        closed = (t[i], t[j], speed) if again.any() else (t[i], math.nan, math.nan)
        ours = tuple(float(run[name]) for name in ("t_lift_off", "t_second_hit", "v_second_hit_max"))
        pairs = zip(closed, ours, ("s", "s", "m/s"), strict=True)
        cells = [f"{x:.2f} {unit}" if x == x else "none" for *pair, unit in pairs for x in pair]
        rows.append((f"{start:.0f} s", *cells))
        if again.any():
            worst = max(worst, abs(ours[1] - closed[1]))
    heavy = simulate(CRANE, off(0.2), every="0.02 s")
    return rows, worst, heavy


def speed_rows(found: HoistingSpeed) -> list[dict[str, Any]]:
    """Starts with a second hit and the fastest, by the twin and on a rigid wire."""
    rows = []
    for row in found.rows:
        hits = [rigid(row.v, 20.0 + found.span * i / found.starts)[2] for i in range(found.starts)]
        again = [v for v in hits if not math.isnan(v)]
        closed = {"share_rigid": len(again) / len(hits), "v_rigid": max(again, default=0.0)}
        rows.append({**row._asdict(), **closed})
    return rows


def in_sea(Hs: float) -> dict[str, Any]:
    """Off a supply vessel in a sea of Hs [m], against the rule of the standard."""
    rao, other = (read_vessel(vessel_file(name)) for name in ("construction-vessel-130m", "supply-vessel-82m"))
    x, y, repeat = -15.0, -24.0, 320.0
    waves = realise(parse_sea(f"jonswap Hs={Hs} m Tp=8 s", heading="150 deg"), repeat, 1)
    below = DeckMotion(OtherVessel(other, TipPoint(-20.0, 0.0)))
    tip, moved = (tip_motion(waves, of, x, y) for of in (rao, below))
    deck = Deck(height="4 m", motion=moved, slack=f"{SLACK} m")
    up = hoists(0.3) | {"depth": "-9 m"}
    case = lift(deck, (WAIT, up), tip=tip, duration=f"{repeat} s", winch=WinchSettings(ramp=f"{RAMP} m/s^2"))
    found = hoisting_speed(CRANE, case, IN_SEA, starts=STARTS, span=SPAN)
    t = np.arange(20.0, 20.0 + SPAN, 0.1)
    v_C, v_D = (float(np.abs(motion.sample(t)[1]).max()) for motion in (tip, moved))
    V_D = float(deck_speed(Hs))
    rules = [k * float(relative_speed(Hs, v_C)) for k in K_H]
    at = {"shares": [row.share for row in found.rows if row.v in SHOWN]}
    return {"Hs": Hs, "V_D": V_D, "v_D": v_D, "v_C": v_C, "rules": rules, "lowest": found.lowest, **at}


def followed_rows() -> tuple[list[dict[str, Any]], float]:
    """Set-down at 0.2 m/s on a sine deck of 1 m, the winch following it or holding the payload against the tip."""
    down = (
        {"mode": "ahc", "time": "30 s"},
        {"mode": "landing", "speed": "12 m/min", "tension": "100 kN", "time": "9 s"},
    )
    rows = []
    for period, delay in ((30.0, 0.0), (12.0, 0.0), (8.0, 0.0), (8.0, 0.2)):
        speeds: dict[bool, list[float]] = {True: [], False: []}
        for followed in speeds:
            cases = []
            for phase in range(0, 360, 45):
                motion = f"sine 1 m {period} s {phase} deg"
                deck = Deck(height="4 m", motion=motion, followed=followed, delay=f"{delay} s")
                cases.append(lift(deck, down, start_depth="-7 m", duration="70 s"))
            speeds[followed] = simulate(CRANE, cases).v_landed.values.tolist()
        rows.append({"period": period, "delay": delay, "with_it": speeds[True], "alone": speeds[False]})
    return rows, max(abs(v / 0.2 - 1.0) for v in rows[0]["with_it"])


def compute() -> tuple[Blocks, Any]:
    restitution, off_rebound = restitutions()
    hits, off_time, heavy = hit_rows()
    found = hoisting_speed(CRANE, off(0.3), SPEEDS)
    speeds = speed_rows(found)
    seas = [in_sea(Hs) for Hs in HS]
    following, off_followed = followed_rows()
    blocks = {
        "claims": locals(),
        "restitution": restitution,
        "hits": hits,
        "speeds": speeds,
        "seas": seas,
        "followed": following,
    }
    return blocks, (heavy, speeds)


def draw(shown: Any) -> None:
    run, rows = shown
    figure = picture(11.0, 3.6)
    left, middle, right = figure.subplots(1, 3)
    cut = run.sel(time=slice(22.0, 48.0))
    left.plot(cut.time, cut.z_deck, label="deck")
    left.plot(cut.time, cut.z_load, label="underside of the payload")
    left.plot(cut.time, cut.s_hook - float(run.s_hook[0]) + 4.0 - SLACK, "--", label="hook, 2 m of slack taken off")
    panel(left, "60 t off a sine deck at 12 m/min", "time [s]", "height above still water [m]")
    middle.plot(cut.time, cut.F_deck / 1e3, label="deck")
    middle.plot(cut.time, cut.F_sling / 1e3, label="slings")
    panel(middle, "forces on the payload", "time [s]", "force [kN]")
    v = [60.0 * row["v"] for row in rows]
    right.plot(v, [row["v_hit"] for row in rows], "o-", label="twin")
    right.plot(v, [row["v_rigid"] for row in rows], "s--", label="rigid wire")
    right.axvline(60.0 * PEAK, color="grey", lw=1.0, label="A ω")
    panel(right, "fastest second hit of 64 starts", "hoisting speed [m/min]", "speed of the hit [m/s]")
    save(figure, "moving-deck.png")
