"""Paper E's tests of the motors' displacement control at the quay: open loop with and without feedback, closed loop; 12
s and 6 s."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import causes
import numpy as np
import xarray
from batch import side_by_side
from blocks import Blocks, percent, save
from quay import CRANE, OPEN_LOOP, OPEN_LOOP_10, OPEN_LOOP_BLIND, WARM

from stillhook import Crane
from stillhook.analysis.steady.steady_state import reduction_lead
from stillhook.library import changed
from stillhook.thesis.quay import (
    D_ONE,
    DURATION,
    HALF,
    PATTERNS,
    done_in_a_second,  # noqa: F401  # in the claims
    motor_patterns,
    motor_steps,
    pattern,
    staircase_offsets,
)
from stillhook.thesis.quay import run as run_of

SLOW_PAGE = True
PICTURE = "paper-e-motor-servo.png"
OFFSET = 20.0  # cm^3/rev: "up to"
EASILY = 0.95  # share of the pumps below which the speed is met easily
SPEEDS = np.arange(70.0, 121.0)  # m/min


class Variant(NamedTuple):
    """One way to control the motors: name, what is changed in the crane."""

    label: str
    changes: Mapping[str, Any] = {}


CLOSED = Variant("closed loop")
OPEN = Variant("open loop with feedback (this crane)", OPEN_LOOP)
OPEN_10 = Variant("open loop with feedback, 10 % offset, 6 % hysteresis", OPEN_LOOP_10)
BLIND = Variant("open loop without feedback", OPEN_LOOP_BLIND)
VARIANTS = (CLOSED, OPEN, OPEN_10, BLIND)


def servo_at(omega_n: str) -> dict[str, Any]:
    return {"active": {"motor": {**OPEN_LOOP["active"]["motor"], "servo": {"omega_n": omega_n}}}}


def play_of(offset: float, hysteresis: float) -> dict[str, Any]:
    return {"active": {"motor": {**OPEN_LOOP["active"]["motor"], "offset": offset, "hysteresis": hysteresis}}}


ROWS = (
    Variant("**as above** (offset 7.5 %, hysteresis 4 %, 5 rad/s, `u_thr` 0.6)", OPEN_LOOP),
    Variant("offset 5 %", play_of(0.05, 0.04)),
    Variant("offset 10 %", play_of(0.10, 0.04)),
    Variant("no hysteresis", play_of(0.075, 0.0)),
    Variant("hysteresis 8 %", play_of(0.075, 0.08)),
    Variant("motors of 10 rad/s (0.5 s for the stroke)", servo_at("10 rad/s")),
    Variant("motors of 3 rad/s (1.7 s)", servo_at("3 rad/s")),
    Variant("motors of 1.4 rad/s (3.5 s, the slowest that paper C names)", servo_at("1.4 rad/s")),
    Variant("`u_thr` 0.5", OPEN_LOOP | {"control": {"u_thr": 0.5}}),
    Variant("`u_thr` 0.4", OPEN_LOOP | {"control": {"u_thr": 0.4}}),
    Variant("`u_thr` 0.7", OPEN_LOOP | {"control": {"u_thr": 0.7}}),
    Variant(
        "`alpha_min` 0.5 instead of 0.6", {"active": {"motor": {**OPEN_LOOP["active"]["motor"], "alpha_min": 0.5}}}
    ),
    Variant("`K_2` 0", OPEN_LOOP | {"control": {"K_2": "0 s^2/m"}}),
    Variant("friction of L4593, the largest set", OPEN_LOOP | {"friction": {"library": "L4593"}}),
)


def crane_of(v: Variant) -> Crane:
    return changed(CRANE, v.changes) if v.changes else CRANE


class Found(NamedTuple):
    """One run: series after the warm-up; tip and wire speed [m/min]; error peak-to-peak [cm]; largest pump and smallest
    motor displacement [-]; by how much the motors stand above their command at most, and their least displacement above
    the least command [cm^3/rev each]; shares of the time with pumps full, motors full [-]."""

    run: xarray.Dataset
    v_tip: float
    v_w: float
    e_c_pp: float
    alpha_p: float
    alpha_m: float
    above: float
    bottom: float
    pumps_full: float
    motors_full: float


def found(v: Variant, period: float, amplitude: float) -> Found:
    run = run_of(crane_of(v), pattern(amplitude, period)).sel(time=slice(WARM, None))
    return Found(
        run=run,
        v_tip=60.0 * float(run["v_tip_max"]),
        v_w=60.0 * float(run["v_w_max"]),
        e_c_pp=100.0 * float(run["e_c_pp"]),
        alpha_p=float(run["alpha_p_max"]),
        alpha_m=float(run["alpha_m_min"]),
        above=D_ONE * max(float((run["alpha_m"] - run["u_m"]).max()), 0.0),
        bottom=D_ONE * float(run["alpha_m"].min() - run["u_m"].min()),
        pumps_full=float(run["saturation_time"]) / DURATION,
        motors_full=float((run["alpha_m"] > 0.999).mean()),
    )


# %: by how much an error must be larger to be called affected here, and within a fifth of it to be called not affected
AFFECTED = 50.0


def setting(v: Variant) -> causes.Alternative:
    """A row as a setting of every run; how the motors are controlled stays that of the run."""
    active = v.changes.get("active", {})
    motor = {k: x for k, x in active.get("motor", {}).items() if k != "variant"}
    tables = {k: x for k, x in v.changes.items() if k != "active"} | ({"active": {"motor": motor}} if motor else {})
    return causes.varied(v.label, tables, group="motors" if motor else "u_thr" if "u_thr" in v.label else "")


def attribution() -> causes.Attribution:
    """What the printed comparison depends on, both patterns read as amplitudes."""
    named = {"closed": CLOSED, "open": OPEN, "blind": BLIND}
    runs = {f"{name} {T:g}": (crane_of(v), pattern(A, T)) for name, v in named.items() for T, A in PATTERNS}

    def off(a: str, b: str, T: float) -> Any:
        return lambda r: 100.0 * (r[f"{a} {T:g}"]["e_c_pp"] / r[f"{b} {T:g}"]["e_c_pp"] - 1.0)

    figures = []
    for T, _ in PATTERNS:
        figures += [
            causes.Figure(
                f"error, open loop over closed, {T:g} s",
                off("open", "closed", T),
                most=AFFECTED / 5.0,
                unit="%",
                digits=0,
                printed="not affected",
            ),
            causes.Figure(
                f"without feedback over with, {T:g} s",
                off("blind", "open", T),
                AFFECTED,
                unit="%",
                digits=0,
                printed="affected",
            ),
            causes.Figure(
                f"pumps, {T:g} s",
                lambda r, T=T: 100.0 * r[f"open {T:g}"]["alpha_p_max"],
                most=100.0 * EASILY,
                unit="%",
                digits=0,
                printed="easily met",
            ),
        ]
    return causes.attribute(runs, figures, [setting(v) for v in ROWS[1:]])


class Followed(NamedTuple):
    """Fastest tip that leaves the pumps something, and the wire's speed there; the wire's highest speed whatever the
    tip asks [m/min]."""

    tip: float
    wire: float
    most: float


def followed(v: Variant, period: float) -> Followed:
    crane = crane_of(v)
    found_ = side_by_side((crane, pattern(v_tip / 60.0 * period / (2.0 * math.pi), period)) for v_tip in SPEEDS)
    full = next(i for i, x in enumerate(found_) if x["saturation_time"] > 0.0)
    wire = [60.0 * x["v_w_max"] for x in found_]
    return Followed(float(SPEEDS[full - 1]), wire[full - 1], max(wire))


Readings = dict[tuple[str, float], tuple[Found, Found]]


def claims(runs: Readings, limit: Mapping[str, Followed]) -> dict[str, Any]:
    """Numbers of the claims."""
    whole = {v.label: [runs[v.label, T][0] for T, _ in PATTERNS] for v in VARIANTS}
    half = [runs[OPEN.label, T][1] for T, _ in PATTERNS]
    open_, closed, blind = (whole[v.label] for v in (OPEN, CLOSED, BLIND))
    least, most = staircase_offsets()
    lead = reduction_lead(CRANE, 110.0 / 60.0, 6.0)
    same = all(abs(a.e_c_pp / b.e_c_pp - 1.0) < 0.1 for a, b in zip(open_, closed, strict=True))
    u_04 = found(next(r for r in ROWS if r.label == "`u_thr` 0.4"), *PATTERNS[0]).motors_full
    return locals()


def _reading(amplitude: Sequence[bool], height: Sequence[bool]) -> str:
    """Which reading of "amplitude" a sentence of the paper fits."""
    return {
        (True, True): "fits both readings",
        (True, False): "fits amplitudes only",
        (False, True): "fits heights only",
        (False, False): "fits neither",
    }[all(amplitude), all(height)]


def pattern_rows(runs: Readings) -> list[tuple[object, ...]]:
    rows = []
    for (label, T), both in runs.items():
        for share, f in zip((1.0, HALF), both, strict=True):
            name = f"{T:g} s, {share * dict(PATTERNS)[T]:g} m, {label}"
            speeds, motors = (
                (f"{f.v_tip:.0f}", f"{f.v_w:.0f}"),
                (f"{f.alpha_m:.2f}", f"{f.bottom:.0f}", f"{f.above:.0f}"),
            )
            rows.append((name, *speeds, f"{f.e_c_pp:.1f}", percent(f.alpha_p), percent(f.pumps_full), *motors))
    return sorted(rows, key=lambda r: [float(x.split()[0]) for x in str(r[0]).split(", ")[:2]], reverse=True)


def variant(v: Variant) -> tuple[object, ...]:
    both = [found(v, T, A) for T, A in PATTERNS]
    cells = (
        (
            f"{f.e_c_pp:.1f}",
            percent(f.alpha_p),
            percent(f.pumps_full),
            f"{f.alpha_m:.2f}",
            f"{f.bottom:.0f}",
            f"{f.above:.0f}",
        )
        for f in both
    )
    return (v.label, *(" / ".join(pair) for pair in zip(*cells, strict=True)))


def compute() -> tuple[Blocks, dict[tuple[float, float], xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    runs = {(v.label, T): (found(v, T, A), found(v, T, HALF * A)) for T, A in PATTERNS for v in VARIANTS}
    limit = {v.label: followed(v, PATTERNS[0][0]) for v in VARIANTS}
    said = claims(runs, limit)
    limits = [(name, f"{x.tip:.0f} m/min", f"{x.wire:.0f} m/min", f"{x.most:.0f} m/min") for name, x in limit.items()]
    blocks = {
        "causes": causes.block(attribution()),
        "claims": said,
        "patterns": pattern_rows(runs),
        "limits": limits,
        "sensitivity": [variant(r) for r in ROWS],
    }
    shown = {(T, share): runs[OPEN.label, T][i].run for T, _ in PATTERNS for i, share in enumerate((1.0, HALF))}
    return blocks, shown


def draw(runs: Mapping[tuple[float, float], xarray.Dataset]) -> None:
    """Steps at standstill (figure 13) above the two patterns in both readings (figure 14)."""
    steps, patterns = motor_steps(), motor_patterns(runs)
    save(replace(patterns, panels=(*steps.panels, *patterns.panels)).figure(), PICTURE)
