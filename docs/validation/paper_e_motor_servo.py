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
from blocks import Blocks, save

from stillhook import Crane
from stillhook.analysis.steady.steady_state import reduction_lead
from stillhook.library import changed
from stillhook.thesis import quay
from stillhook.thesis.quay import CRANE, D_ONE, DURATION, HALF, OPEN_LOOP, PATTERNS, WARM, pattern

SLOW_PAGE = True
PICTURE = "paper-e-motor-servo.png"
OFFSET = 20.0  # cm^3/rev: "up to"
EASILY = 0.95  # share of the pumps below which the speed is met easily
SPEEDS = np.arange(70.0, 121.0)  # m/min


CONTROLS = CLOSED, OPEN, OPEN_10, BLIND = causes.variants(globals(), "control")
ROWS = causes.variants(globals())


def crane_of(v: causes.Variant) -> Crane:
    """The crane of a variant, motors in open loop with feedback unless it is about that."""
    return v.on(CRANE if v in CONTROLS else changed(CRANE, OPEN_LOOP))


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


def found(v: causes.Variant, period: float, amplitude: float) -> Found:
    run = quay.run(crane_of(v), pattern(amplitude, period)).sel(time=slice(WARM, None))
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


def attribution() -> causes.Attribution:
    """What the printed comparison depends on, both patterns read as amplitudes."""
    named = {"closed": CLOSED, "open": OPEN, "blind": BLIND}
    runs = {f"{name} {T:g}": (crane_of(v), pattern(A, T)) for name, v in named.items() for T, A in PATTERNS}
    return causes.attribute(runs, causes.figures(globals()), [v.alternative() for v in ROWS[1:]])


class Followed(NamedTuple):
    """Fastest tip that leaves the pumps something, and the wire's speed there; the wire's highest speed whatever the
    tip asks [m/min]."""

    tip: float
    wire: float
    most: float


def followed(v: causes.Variant, period: float) -> Followed:
    crane = crane_of(v)
    found_ = side_by_side((crane, pattern(v_tip / 60.0 * period / (2.0 * math.pi), period)) for v_tip in SPEEDS)
    full = next(i for i, x in enumerate(found_) if x["saturation_time"] > 0.0)
    wire = [60.0 * x["v_w_max"] for x in found_]
    return Followed(float(SPEEDS[full - 1]), wire[full - 1], max(wire))


Readings = dict[tuple[str, float], tuple[Found, Found]]


def claims(runs: Readings, limit: Mapping[str, Followed]) -> dict[str, Any]:
    """Numbers of the claims."""
    whole = {v.label: [runs[v.label, T][0] for T, _ in PATTERNS] for v in CONTROLS}
    half = [runs[OPEN.label, T][1] for T, _ in PATTERNS]
    open_, closed, blind = (whole[v.label] for v in (OPEN, CLOSED, BLIND))
    least, most = quay.staircase_offsets()
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


def pattern_rows(runs: Readings) -> list[dict[str, Any]]:
    rows = [
        {"label": label, "T": T, "share": share, "f": f}
        for (label, T), both in runs.items()
        for share, f in zip((1.0, HALF), both, strict=True)
    ]
    return sorted(rows, key=lambda r: (r["T"], r["share"]), reverse=True)


def compute() -> tuple[Blocks, dict[tuple[float, float], xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    runs = {(v.label, T): (found(v, T, A), found(v, T, HALF * A)) for T, A in PATTERNS for v in CONTROLS}
    limit = {v.label: followed(v, PATTERNS[0][0]) for v in CONTROLS}
    said = claims(runs, limit)
    blocks = {
        "causes": causes.block(attribution()),
        "claims": said,
        "patterns": pattern_rows(runs),
        "limits": [{"name": name, "x": x} for name, x in limit.items()],
        "sensitivity": [{"label": r.label, "both": [found(r, T, A) for T, A in PATTERNS]} for r in ROWS],
    }
    shown = {(T, share): runs[OPEN.label, T][i].run for T, _ in PATTERNS for i, share in enumerate((1.0, HALF))}
    return blocks, shown


def draw(runs: Mapping[tuple[float, float], xarray.Dataset]) -> None:
    """Steps at standstill (figure 13) above the two patterns in both readings (figure 14)."""
    steps, patterns = quay.motor_steps(), quay.motor_patterns(runs)
    save(replace(patterns, panels=(*steps.panels, *patterns.panels)).figure(), PICTURE)
