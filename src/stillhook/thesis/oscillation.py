"""Paper C's measurements: ramps of the winch at four motor displacements (C5, C6, CT1), and heave compensation at two
of them (C7, C8)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
import xarray

from stillhook.analysis.loop_stability.stability import eigenfrequency
from stillhook.engine.simulate import simulate
from stillhook.library import changed, load_crane
from stillhook.sea.motion.motion import Motion, Sine, Sum
from stillhook.spec.crane import Crane, wire_inertia
from stillhook.spec.scenario import Operator, Scenario
from stillhook.thesis.gallery import Axis, Drawing, Panel, Printed, over_time
from stillhook.thesis.quay import BEAT
from stillhook.thesis.ringing import ringing, rms_above
from stillhook.units import from_display, in_display

CC, BAR = from_display(1.0, "displacement"), from_display(1.0, "pressure")
D_MAX = 3000.0  # cm^3/rev: 12 motors of 250
THEIRS: Mapping[int, tuple[float, str]] = {2940: (0.4, "no"), 2500: (0.4, "no"), 1600: (0.7, "yes"), 735: (1.5, "yes")}
"""Displacement [cm^3/rev] -> period [s], and whether it affects the speed: table 1."""
ROUNDING = 0.05  # s: the periods are printed in tenths
START = 2.0  # s: the stick begins to move
SPEED, RAMP = 15.0, 1.0  # m/min and s: so short a ramp that everything after it rings freely
LEAST = 0.3 * BAR
SEEN = 0.05  # share of the speed: a swing that shows in a picture of the speed
LOW, HIGH, D_ONE = 162, 245, 250.0  # cm^3/rev each, figures 7 and 8, and the full displacement
MODE_OF = {LOW: "hs", HIGH: "ns"}  # the two fixed settings of the classic controller
RING = 0.5  # Hz: above the waves (0.08 and 0.17 Hz), below the circuit's eigenfrequency at either displacement
WARM = 30.0  # s
MOTOR = {"type": "A6VM280", "D_max": "250 cm^3/rev", "C_1": "0.04 L/min/bar", "C_2": "1e-5 L/min/bar/(rev/min)"}
SIDES = (("A side", "p_a"), ("B side", "p_b"))


def constant() -> tuple[float, float]:
    """Period times displacement [s cm^3/rev]: the least and the most that all four printed periods allow."""
    least, most = ([(T + off) * D for D, (T, _) in THEIRS.items()] for off in (-ROUNDING, ROUNDING))
    return max(least), min(most)


def _inertia(base: Crane, J: float) -> dict[str, str]:
    """Table of the inertia of a winch with twelve motors, J at the motor shaft [kg m^2]."""
    J_gear, J_motors = 12 * 0.05, 12 * 0.0559  # as the other cranes' gears; rotors as the library's A6VM280
    J_drum = (J - J_gear - J_motors) * base.i_hD**2 - wire_inertia(base.drum, base.wire)
    return {name: f"{x!r} kg m^2" for name, x in (("J_m_eff", J), ("J_gear", J_gear), ("J_drum", J_drum))}


@cache
def twelve_motors() -> Crane:
    """A winch with twelve motors of 250 cm^3/rev in one closed circuit, whose eigenperiod is what the printed periods
    ask for."""
    base, like = load_crane("nov-100t-pure-active"), load_crane("nov-250t").active
    line = base.active.line
    C_h = like.line.V / like.motor.D_total * D_MAX * CC / line.bulk_modulus
    J = (sum(constant()) / 2.0 * CC / (2.0 * math.pi)) ** 2 / C_h
    own = {
        "name": "twelve-motors",
        "title": "Twelve motors of 250 cm^3/rev in one closed circuit, paper C table 1",
        "SWL": "165 t",
        "active": {
            "motor": MOTOR | {"count": 12, "alpha_min": 0.2},
            "pump": {"D": ["500 cm^3/rev"] * 3},
            "line": {"V": f"{C_h * line.bulk_modulus!r} m^3"},
            "C_leak": "0.74 L/min/bar",
        },
        "friction": {"library": "crane-2"},
        "inertia": _inertia(base, J),
        "control": {"alpha_ns": 1.0, "alpha_hs": 0.6},
    }
    # the quay tests begin from a winch that its circuits hold
    return changed(base, own).model_copy(update={"brake": None})


@cache
def of_165t() -> Crane:
    """The 150 t crane of the same paper with three active motors of 250 cm^3/rev, and as many more passive ones."""
    base = load_crane("nov-150t")
    own = {
        "name": "165t",
        "title": "165 t active/passive winch of paper C figures 7 and 8",
        "SWL": "165 t",
        "active": {"motor": MOTOR | {"alpha_min": 0.6}, "line": {"V": f"{50.0 * 750.0 / 645.0!r} L"}},
        "passive": {"motor": MOTOR | {"count": 9}},
        "inertia": _inertia(base, base.inertia.J_m_eff * 12 / 11),  # one passive motor more
        "control": {"alpha_hs": LOW / D_ONE, "alpha_ns": HIGH / D_ONE},
    }
    return changed(base, own)


def ramped(D: int, *, ramp: float = RAMP, speed: float = SPEED, load: float = 0.0) -> Scenario:
    """The winch ramped up at a fixed displacement D [cm^3/rev]: time in which the stick goes over [s], speed [m/min],
    load [t]."""
    profile = ((f"{START:g} s", "0 m/min"), (f"{START + ramp:g} s", f"{speed:g} m/min"))
    stick, times = Operator(profile=profile, alpha_m=D / D_MAX), {"duration": f"{ramp + 22:g} s", "warm_up": "1 s"}
    return Scenario(load=f"{load:g} t", s_w="15 m", mode="manual", operator=stick, **times)


def swing(run: xarray.Dataset, end: float) -> float:
    """Overshoot of the wire speed over its final value [-]."""
    v = run["v_w"].values
    return float(np.max(v)) / float(np.mean(v[run["time"].values > end])) - 1.0


@cache
def ramps() -> Mapping[int, xarray.Dataset]:
    """The ramp at every displacement."""
    return {D: simulate(twelve_motors(), ramped(D), every="0.01 s") for D in THEIRS}


def ramp(*signals: str, runs: Mapping[int, xarray.Dataset] | None = None) -> Drawing:
    """A-side pressure or wire speed while the winch is ramped up (C5, C6), and table CT1."""
    runs, printed = runs or ramps(), []
    for D, (T, seen) in THEIRS.items():
        T_ours = ringing(runs[D], "p_a", start=START, least=LEAST).period
        late = float(runs[D]["time"][-1]) - 2.0
        shown = "yes" if swing(runs[D], late) > SEEN else "no"
        linear = eigenfrequency(twelve_motors(), D / D_MAX).period
        ours = f"{T_ours:.2f} s (linear {linear:.2f} s), {shown}"
        printed.append(Printed(f"{D} cm³/rev: period, effect on speed", f"{T:g} s, {seen}", ours))
    labelled = {f"{D} cm³/rev": run for D, run in runs.items()}
    panels = [over_time(labelled, (name,), START - 0.5, START + 8.0) for name in signals]
    note = (
        "Ours: the winch is not described; inertia and oil follow from the printed periods, empty hook, stick in 1 s."
    )
    return Drawing("Twelve motors of 250 cm³/rev: ramp at a fixed displacement", panels, printed=printed, note=note)


def sea(scale: float = 1.0) -> Motion:
    """The pattern of paper E scenario 3, two fifths of its size: up to 36 m/min."""
    return Sum([Sine.from_si(0.8 * scale, 13.0), Sine.from_si(0.2 * scale, 6.0)])


def offshore(D: int, tip: Motion | None = None, beats: float = 2.0, more: Mapping[str, str] | None = None) -> Scenario:
    """A light hook in heave compensation at a fixed displacement [cm^3/rev]."""
    times = {"warm_up": f"{WARM:g} s", "duration": f"{WARM + beats * BEAT:g} s"}
    asked: dict[str, Any] = {"load": "1 t", "s_w": "100 m", **times, **(more or {})}
    return Scenario(tip=tip or sea(), mode=MODE_OF[D], **asked)


@cache
def offshore_runs() -> Mapping[int, xarray.Dataset]:
    return {D: simulate(of_165t(), offshore(D), every="0.01 s") for D in (LOW, HIGH)}


def contrast_panels(D: int, run: xarray.Dataset) -> list[Panel]:
    """Wanted and actual wire speed, pressures of both sides."""
    speed, wanted = (
        over_time({word: run}, (name,), 60.0, 90.0) for word, name in (("wire", "v_w"), ("wanted", "v_tip"))
    )
    both = [*(one._replace(y=-one.y, style="--") for one in wanted.curves), *speed.curves]
    title, sides = f"{D} cm³/rev each", [over_time({word: run}, (p,), 60.0, 90.0).curves[0] for word, p in SIDES]
    pressure = Axis("pressure", "pressure")
    return [Panel(speed.x, speed.y, both, title), Panel(speed.x, pressure, sides, title)]


def contrast(D: str) -> Drawing:
    """Speeds and pressures in heave compensation at a displacement (C7, C8)."""
    runs, D_shown = offshore_runs(), int(D)
    rms = {k: in_display(rms_above(run, "p_a", frequency=RING, start=WARM), "pressure") for k, run in runs.items()}
    ours = f"{rms[LOW]:.1f} against {rms[HIGH]:.1f} bar rms above 0.5 Hz"
    return Drawing(
        f"165 t crane, 4 t on the wire, heave compensation at {D} cm³/rev",
        contrast_panels(D_shown, runs[D_shown]),
        printed=[Printed("pressure oscillations at 162 cm³/rev", "significantly more than at 245", ours)],
        note="Ours: the tip's motion is that of paper E scenario 3, two fifths of its size.",
    )
